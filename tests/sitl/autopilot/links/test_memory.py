"""The link in memory: perfect by default, and with the faults that were asked for."""

from __future__ import annotations

import asyncio
import itertools

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s, run_virtual
from companion.errors import LinkError
from companion.mavlink.transports import TransportState
from sitl.autopilot import Impairment, MemoryLink
from sitl.autopilot.memory_link import FrameStream, frames
from sitl.autopilot.server import pieces


def traffic(impairment: Impairment, count: int = 2000, seed: int = 1) -> list[tuple[float, float, bytes]]:
    """Return (sent, arrived, frame) for frames sent every 10 ms."""
    codec = mav.MAVLink(None)

    async def main() -> list[tuple[float, float, bytes]]:
        link = MemoryLink(impairment=impairment, seed=seed)
        out: list[tuple[float, float, bytes]] = []
        await link.near.open(lambda data: None)
        await link.far.open(lambda data: out.append((0.0, now_s(), data)))
        sent = {}
        for n in range(count):
            frame = mav.MAVLink_system_time_message(n, n).pack(codec)
            sent[frame] = now_s()
            link.near.write(frame)
            await asyncio.sleep(0.01)
        await asyncio.sleep(2.0)
        return [(sent.get(data, -1.0), t, data) for _, t, data in out]

    return run_virtual(main())


def test_perfect_by_default() -> None:
    got = traffic(Impairment(), 100)
    assert len(got) == 100
    assert all(arrived == sent for sent, arrived, _ in got)


def test_rates_of_faults() -> None:
    got = traffic(Impairment(loss=0.3, duplicate=0.2, corrupt=0.1))
    assert len(got) / 2000 == pytest.approx(0.7 * 1.2, abs=0.04)
    broken = sum(1 for sent, _, _ in got if sent < 0.0)
    assert broken / len(got) == pytest.approx(0.1, abs=0.03)


def test_delay_keeps_order_and_reorder_breaks_it() -> None:
    got = traffic(Impairment(delay_s=0.3, jitter_s=0.1), 500)
    assert all(0.3 <= arrived - sent <= 0.4 + 1e-6 for sent, arrived, _ in got)
    assert [s for s, _, _ in got] == sorted(s for s, _, _ in got)
    mixed = [s for s, _, _ in traffic(Impairment(reorder=0.3), 500)]
    assert mixed != sorted(mixed)
    assert sorted(mixed) == sorted(s for s, _, _ in got)


def test_a_seed_repeats() -> None:
    bad = Impairment(loss=0.3, duplicate=0.2, corrupt=0.1, reorder=0.2, jitter_s=0.1)
    assert traffic(bad, 300, seed=7) == traffic(bad, 300, seed=7)
    assert traffic(bad, 300, seed=7) != traffic(bad, 300, seed=8)


def test_cut_mend_close_and_open_again() -> None:
    async def main() -> None:
        link = MemoryLink()
        out: list[bytes] = []
        assert link.near.state is TransportState.CLOSED
        link.near.write(b"lost")
        await link.near.open(lambda data: None)
        await link.far.open(out.append)
        with pytest.raises(LinkError):
            await link.far.open(out.append)
        link.cut()
        link.near.write(b"lost")
        link.mend()
        link.near.write(b"1")
        await asyncio.sleep(0.0)
        await asyncio.sleep(0.0)
        await link.far.close()
        link.near.write(b"lost")
        await asyncio.sleep(0.1)
        await link.far.open(out.append)
        link.near.write(b"2")
        await asyncio.sleep(0.1)
        assert out == [b"1", b"2"]
        assert link.near.stats.writes_dropped == 2

    run_virtual(main())


@settings(max_examples=100)
@given(st.binary(max_size=400), st.integers(0, 5))
def test_frames_loses_no_byte(noise: bytes, count: int) -> None:
    codec = mav.MAVLink(None)
    data = noise + b"".join(mav.MAVLink_system_time_message(n, n).pack(codec) for n in range(count))
    assert b"".join(frames(data)) == data


def test_datagrams_hold_whole_frames() -> None:
    codec = mav.MAVLink(None)
    data = b"".join(mav.MAVLink_param_value_message(b"NAME", n, 9, 300, n).pack(codec) for n in range(300))
    cut = pieces(data)
    assert b"".join(cut) == data
    assert len(cut) > 5
    for piece in cut:
        assert len(piece) <= 1200
        assert all(m.get_type() == "PARAM_VALUE" for m in mav.MAVLink(None).parse_buffer(piece))


@given(cuts=st.lists(st.integers(0, 400), max_size=30), noise=st.binary(max_size=20).filter(lambda b: b"\xfd" not in b))
def test_a_stream_cut_anywhere_comes_out_as_whole_frames(cuts: list[int], noise: bytes) -> None:
    codec = mav.MAVLink(None)
    sent = [mav.MAVLink_system_time_message(n, n).pack(codec) for n in range(8)]
    stream = noise + b"".join(sent)
    places = sorted({min(c, len(stream)) for c in cuts} | {0, len(stream)})
    line, out = FrameStream(), []
    for a, b in itertools.pairwise(places):
        out += line.take(stream[a:b])
    assert out[-8:] == sent
    assert b"".join(out) == stream
