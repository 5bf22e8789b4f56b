"""Feeds' sockets: UDP, TCP, a serial port; closed, unplugged, silent, full of noise. Real sockets, hurried time."""

from __future__ import annotations

import asyncio
import contextlib
import json
import os
import socket
from collections.abc import AsyncIterator, Callable, Coroutine
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pyais.encode import encode_dict

from companion.clock import now_s, run, run_virtual
from companion.errors import InputError, LinkError
from companion.messages import AisReport
from companion.traffic.feeds import MAX_PARTIAL, SILENT_S, Feed, open_feed, parse_feed
from companion.traffic.nmea import NmeaDecoder

SPEEDUP = 20.0
PATIENCE_S = 400.0  # hurried seconds: an answer that does not come is a failure, not a wait for ever


def hurried(what: Coroutine[Any, Any, None]) -> None:
    run(what, speedup=SPEEDUP)


def sentence(mmsi: int, **more: Any) -> bytes:
    values = {"type": 1, "mmsi": mmsi, "lat": 50.8, "lon": -1.3, "course": 90.0, "speed": 5.0, "heading": 90}
    return encode_dict(values | more, talker_id="AI", sentence_type="VDM")[0].encode() + b"\r\n"


async def until(condition: Callable[[], bool]) -> None:
    async with asyncio.timeout(PATIENCE_S):
        while not condition():  # noqa: ASYNC110 - what is waited for is the outside world
            await asyncio.sleep(0.2)


def free_port(kind: socket.SocketKind) -> int:
    with socket.socket(socket.AF_INET, kind) as probe:
        probe.bind(("127.0.0.1", 0))
        return int(probe.getsockname()[1])


# --------------------------------------------------------------------------------------------- UDP
def test_udp_takes_sentences_and_json_and_counts_the_rest() -> None:
    async def listen() -> None:
        heard: list[AisReport] = []
        port = free_port(socket.SOCK_DGRAM)
        async with open_feed(parse_feed(f"udpin:127.0.0.1:{port}"), heard.append, NmeaDecoder(), "AIS feed") as feed:
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
                for data in (
                    sentence(211000001) + sentence(211000002),
                    json.dumps({"id": 7, "lat": 50.8, "lon": -1.3}).encode(),
                    b'{"id": 7, "lat": 95}',
                    b"\x00\xff" * 400,
                    b"",
                    sentence(211000003).replace(b"A", b"B", 1),
                ):
                    sender.sendto(data, ("127.0.0.1", port))
            await until(lambda: feed.counts.refused >= 3)
        assert [r.mmsi for r in heard] == [211000001, 211000002, 7]
        assert feed.counts.bad_checksum == 1
        assert "3 reports" in feed.sentence()

    hurried(listen())


def test_a_feed_may_have_an_address_of_ipv6() -> None:
    async def listen() -> None:
        heard: list[AisReport] = []
        with socket.socket(socket.AF_INET6, socket.SOCK_DGRAM) as sender:
            try:
                sender.bind(("::1", 0))
            except OSError:
                pytest.skip("no IPv6 here")
            port = free_port(socket.SOCK_DGRAM)
            async with open_feed(parse_feed(f"udpin:[::1]:{port}"), heard.append, NmeaDecoder(), "AIS feed"):
                sender.sendto(sentence(211000001), ("::1", port))
                await until(lambda: bool(heard))
        assert [r.mmsi for r in heard] == [211000001]

    hurried(listen())


def test_a_udp_port_that_is_taken_is_a_dead_link() -> None:
    async def listen() -> None:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
            taken.bind(("127.0.0.1", 0))
            with pytest.raises(LinkError, match="AIS feed"):
                async with open_feed(
                    parse_feed(f"udpin:127.0.0.1:{taken.getsockname()[1]}"), lambda _: None, NmeaDecoder(), "AIS feed"
                ):
                    pass

    hurried(listen())


# --------------------------------------------------------------------------------------------- TCP
@contextlib.asynccontextmanager
async def receiver(port: int, *sent: bytes) -> AsyncIterator[None]:
    """A multiplexer that says ``sent`` to whoever connects, and dies with all its connections at the end."""
    writers: list[asyncio.StreamWriter] = []

    async def talk(_: asyncio.StreamReader, writer: asyncio.StreamWriter) -> None:
        writers.append(writer)
        for piece in sent:
            writer.write(piece)
            await writer.drain()

    server = await asyncio.start_server(talk, "127.0.0.1", port, reuse_address=True)
    try:
        yield
    finally:
        server.close()
        for writer in writers:
            writer.close()


def test_tcp_connects_again_when_the_receiver_restarts() -> None:
    async def listen() -> None:
        heard: list[AisReport] = []
        port = free_port(socket.SOCK_STREAM)
        async with open_feed(parse_feed(f"tcp:127.0.0.1:{port}"), heard.append, NmeaDecoder(), "AIS feed") as feed:
            await until(lambda: bool(feed.last_error))  # nobody is there yet
            line = sentence(211000001)
            async with receiver(port, line[:20], line[20:], sentence(211000002)[:11]):
                await until(lambda: len(heard) == 1)
            await until(lambda: bool(feed.last_error))
            assert feed.connections == 1
            async with receiver(port, sentence(211000003)):
                await until(lambda: len(heard) == 2)
            assert feed.connections == 2
            assert not feed.last_error
        # What was cut off with the first connection did not spoil the second's first line.
        assert [r.mmsi for r in heard] == [211000001, 211000003]
        assert feed.counts.refused == 0

    hurried(listen())


def test_tcp_connects_again_when_the_receiver_has_lost_its_power() -> None:
    """No end of the connection comes, and nothing more: for as long as it was sailed it was waited for."""

    async def listen() -> None:
        heard: list[AisReport] = []
        port = free_port(socket.SOCK_STREAM)
        async with (
            receiver(port, sentence(211000001)),
            open_feed(parse_feed(f"tcp:127.0.0.1:{port}"), heard.append, NmeaDecoder(), "AIS feed") as feed,
        ):
            await asyncio.sleep(SILENT_S / 2.0)
            assert feed.connections == 1
            await until(lambda: len(heard) == 2)
            assert feed.connections == 2

    hurried(listen())


def test_a_feed_that_is_left_leaves_no_task_and_no_socket() -> None:
    async def listen() -> None:
        port = free_port(socket.SOCK_STREAM)
        async with receiver(port, sentence(211000001)):
            async with open_feed(
                parse_feed(f"tcp:127.0.0.1:{port}"), lambda _: None, NmeaDecoder(), "AIS feed"
            ) as feed:
                await until(lambda: feed.counts.reports == 1)
            assert not [t for t in asyncio.all_tasks() if t.get_name().startswith("AIS feed")]

    hurried(listen())


# ------------------------------------------------------------------------------------------ serial
class Port:
    """A receiver on a serial port: a pseudo-terminal behind a name that stays when it is plugged in again."""

    def __init__(self, name: Path) -> None:
        self.name = name
        self.plug()

    def plug(self) -> None:
        self.far, near = os.openpty()
        os.set_blocking(self.far, False)
        self.name.symlink_to(os.ttyname(near))
        self._near = near

    def say(self, data: bytes) -> None:
        os.write(self.far, data)

    def unplug(self) -> None:
        self.name.unlink()
        os.close(self.far)
        os.close(self._near)


def test_serial_is_read_and_found_again_after_it_was_unplugged(tmp_path: Path) -> None:
    async def listen() -> None:
        heard: list[AisReport] = []
        port = Port(tmp_path / "ttyAIS")
        async with open_feed(parse_feed(f"{port.name}:38400"), heard.append, NmeaDecoder(), "AIS feed") as feed:
            await until(lambda: feed.connections == 1)
            port.say(sentence(211000001))
            await until(lambda: len(heard) == 1)
            port.unplug()
            await until(lambda: bool(feed.last_error))
            assert feed.last_error in feed.sentence()
            await asyncio.sleep(30.0)  # and while it is away nothing ends
            port.plug()
            await until(lambda: feed.connections == 2)
            port.say(sentence(211000002))
            await until(lambda: len(heard) == 2)
        port.unplug()
        assert [r.mmsi for r in heard] == [211000001, 211000002]

    hurried(listen())


def test_a_name_that_is_no_serial_port_is_tried_again_and_told(tmp_path: Path) -> None:
    (tmp_path / "notes").write_text("no port")

    async def listen() -> None:
        async with open_feed(parse_feed(f"{tmp_path}/notes:38400"), lambda _: None, NmeaDecoder(), "AIS feed") as feed:
            await until(lambda: bool(feed.last_error))
            await asyncio.sleep(20.0)
            assert feed.connections == 0
            assert "never heard" in feed.sentence()

    hurried(listen())


# ----------------------------------------------------------------------------------------- silence
def test_a_feed_that_stops_is_silent_after_a_minute_and_heard_again() -> None:
    async def listen() -> None:
        feed = Feed(parse_feed("tcp:127.0.0.1:10110"), lambda _: None, NmeaDecoder())
        assert not feed.is_silent  # it was opened just now
        await asyncio.sleep(SILENT_S + 1.0)
        assert feed.is_silent
        feed.stream(sentence(211000001))
        assert not feed.is_silent
        await asyncio.sleep(SILENT_S + 1.0)
        assert feed.is_silent
        assert f"heard {SILENT_S + 1.0:.0f} s ago" in feed.sentence()

    run_virtual(listen())


# ------------------------------------------------------------------------------------------- noise
@settings(max_examples=150)
@given(
    st.lists(
        st.binary(max_size=300) | st.sampled_from([b"!AIVDM,", b"\r\n", b"$", b"\\s:x*00\\", b"{", b"\x00" * 50]),
        max_size=20,
    ),
    st.lists(st.integers(1, 40), min_size=1, max_size=8),
)
def test_noise_on_a_stream_is_counted_and_the_next_line_is_read(noise: list[bytes], cuts: list[int]) -> None:
    async def listen() -> None:
        heard: list[AisReport] = []
        feed = Feed(parse_feed("tcp:127.0.0.1:10110"), heard.append, NmeaDecoder())
        data = b"".join(noise)
        at = 0
        while at < len(data):
            step = cuts[at % len(cuts)]
            feed.stream(data[at : at + step])
            feed.datagram(data[at : at + step])
            at += step
        assert len(feed._partial) <= MAX_PARTIAL
        found = len(heard)
        feed.stream(b"\n" + sentence(211000001))
        assert [r.mmsi for r in heard[found:]] == [211000001]
        assert feed.counts.lines >= feed.counts.reports + feed.counts.other

    run_virtual(listen())


def test_a_stream_without_a_line_end_is_bounded() -> None:
    async def listen() -> None:
        feed = Feed(parse_feed("tcp:127.0.0.1:10110"), lambda _: None, NmeaDecoder())
        for _ in range(100):
            feed.stream(b"x" * 1000)
        assert len(feed._partial) <= MAX_PARTIAL
        assert feed.counts.bad_form >= 40

    run_virtual(listen())


def test_a_report_is_stamped_with_its_arrival() -> None:
    async def listen() -> None:
        heard: list[AisReport] = []
        feed = Feed(parse_feed("udpin:127.0.0.1:10110"), heard.append, NmeaDecoder())
        await asyncio.sleep(12.5)
        feed.datagram(sentence(211000001))
        assert heard[0].t_s == now_s() == 12.5

    run_virtual(listen())


@pytest.mark.parametrize("text", ["", "udp:x:1", "udpin:h:0", "tcp:h:99999", "tcp:h", "dev/tty", "/dev/ttyUSB0:x"])
def test_what_is_no_feed_is_bad_input(text: str) -> None:
    with pytest.raises(InputError):
        parse_feed(text)
