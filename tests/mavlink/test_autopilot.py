"""The link and the facade against the simulated autopilot, under the virtual clock."""

import asyncio
import itertools
from functools import partial

import pytest

from companion.clock import now_s, run_virtual
from companion.errors import LinkError
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices.command import TransferOutcome
from companion.mavlink.mission_lists import MissionLists
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.wire.companion_status import StatusReader
from companion.mavlink.wire.frames import Drop
from companion.mavlink.wire.items import canonical, mission_hash
from companion.messages import (
    Command,
    CompanionStatus,
    GeoPoint,
    MissionItem,
    MissionState,
    Mode,
    sailed_part,
    waypoint,
)
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.autopilot.memory_link import Impairment
from sitl.world.environment import Constant

HOME = GeoPoint(lat_deg=51.1, lon_deg=-1.3)


def mission(count, *, east=0.001, north=0.0):
    """Return ``count`` waypoints eastward and a safe end."""
    points = [GeoPoint(lat_deg=51.1 + north, lon_deg=-1.3 + east * (i + 1)) for i in range(count)]
    return [*(waypoint(p) for p in points), waypoint(points[-1], command=Command.NAV_LOITER_UNLIM)]


def sail(main, *, impairment=None, seed=1, has_ftp=True, **link_options):
    """Run ``main(boat, link, autopilot, memory)`` with a warm boat at the other end of a memory link."""

    async def whole():
        boat = SimulatedAutopilot(
            AutopilotConfig(is_warm=True, home=HOME, has_ftp=has_ftp), Constant(0.0, 5.0), seed=seed
        )
        memory = MemoryLink(seed=seed, impairment=impairment or Impairment())
        async with serve(boat, [memory.far]), Link(memory.near, **link_options) as link, Autopilot(link) as autopilot:
            return await main(boat, link, autopilot, memory)

    return run_virtual(whole())


async def set_sail(autopilot, items):
    assert (await autopilot.upload_mission(items)).is_ok
    assert (await autopilot.set_mode(Mode.AUTO)).is_ok
    assert (await autopilot.arm()).is_ok


@pytest.mark.parametrize("method", ["items", "ftp", "auto"])
def test_a_mission_goes_up_and_comes_back(method):
    async def main(boat, link, autopilot, memory):
        items = mission(9)
        result = await autopilot.upload_mission(items, method=method)
        assert (result.outcome, result.count) == (TransferOutcome.OK, 10)
        read = await autopilot.read_mission()
        assert [canonical(i) for i in read.items] == [canonical(i) for i in items]
        assert mission_hash(read.items) == mission_hash(items)
        assert read.home is not None
        return result

    result = sail(main)
    assert result.method == ("items" if method == "items" else "ftp")
    assert result.duration_s < 0.6


def test_a_shorter_plan_over_a_running_one_leaves_nothing_of_the_old():
    async def main(boat, link, autopilot, memory):
        await set_sail(autopilot, mission(10))
        await asyncio.sleep(15.0)
        short = mission(3, north=0.001)
        result = await autopilot.upload_mission(short, set_current=1)
        assert result.is_ok, result
        read = await autopilot.read_mission()
        assert sailed_part(read.items) == tuple(canonical(i) for i in short)
        old = {canonical(i) for i in mission(10)}
        assert not old & set(read.items)
        assert mission_hash(read.items) == mission_hash(short)
        status = autopilot.status
        assert (status.mission_seq, status.mission_state) == (1, MissionState.ACTIVE)

    sail(main)


def test_over_ftp_the_item_is_made_current_before_the_mission_is_read_back(monkeypatch):
    """Of a boat at its old item 4 item 4 of the new mission was sailed for while it was read, 15 s, over a rock."""
    seen, read = [], MissionLists._read

    async def main(boat, link, autopilot, memory):
        async def reading(lists, kind, method):
            seen.append(autopilot.status.mission_seq)
            return await read(lists, kind, method)

        await set_sail(autopilot, mission(10))
        assert (await autopilot.set_current(4)).is_ok
        monkeypatch.setattr(MissionLists, "_read", reading)
        result = await autopilot.upload_mission(mission(6, north=0.001), set_current=1)
        assert (result.is_ok, result.method) == (True, "ftp")

    sail(main)
    assert seen == [1]


def test_a_partial_write_keeps_the_leg_that_is_sailed():
    async def main(boat, link, autopilot, memory):
        old = mission(8)
        await set_sail(autopilot, old)
        await asyncio.sleep(10.0)
        new = [*old[:2], *mission(6, north=0.0005)[2:]]
        result = await autopilot.upload_mission(new, method="partial", keep_first=2)
        assert result.is_ok, result
        read = await autopilot.read_mission()
        assert mission_hash(read.items) == mission_hash(new)
        assert autopilot.status.mission_seq == 1

    sail(main)


GUARD_OLD, GUARD_NEW = mission(5), [*mission(5)[:2], *mission(7, north=0.0005)[2:]]
GUARD_GAP = waypoint(GeoPoint(lat_deg=51.1, lon_deg=-1.298), command=Command.NAV_LOITER_UNLIM)


@pytest.mark.parametrize("old", [GUARD_OLD, mission(14)], ids=["longer", "shorter"])
def test_behind_a_stopgap_no_mixture_is_ever_on_board(old):
    """The link is cut after every so many frames: what the boat would sail is the old, the held back or the new."""
    new = [*old[:2], *GUARD_NEW[2:]]
    whole = [tuple(canonical(i) for i in sailed_part(m)) for m in (old, [*old[:2], GUARD_GAP], new)]
    seen = set()

    async def main(boat, link, autopilot, memory, frames):
        await set_sail(autopilot, old)
        await asyncio.sleep(3.0)
        write = memory.near.write
        left = frames

        def until_cut(data):
            nonlocal left
            left -= 1
            if left < 0:
                memory.cut()
            write(data)

        memory.near.write = until_cut
        task = asyncio.create_task(
            autopilot.upload_mission(new, method="guarded", keep_first=2, set_current=None, stopgap=GUARD_GAP)
        )
        judged = None
        while not task.done():
            await asyncio.sleep(0.02)
            stored = boat.pilot.helm.mission.items[1:]
            if stored == judged:
                continue
            judged = stored
            on_board = tuple(
                canonical(
                    MissionItem(
                        command=i.command, lat_e7=i.x, lon_e7=i.y, frame=i.frame, params=(i.p1, i.p2, i.p3, i.p4)
                    )
                )
                for i in stored
            )
            assert sailed_part(on_board) in whole, (frames, on_board)
            seen.add(whole.index(sailed_part(on_board)))
        result = await task
        assert not result.is_ok or sailed_part(on_board) == whole[2]
        return result.is_ok

    frames = 0
    while not sail(partial(main, frames=frames), has_ftp=False):
        frames += 1
        assert frames < 200
    assert seen == {0, 1, 2}


def test_refusals_have_the_autopilots_words():
    async def main(boat, link, autopilot, memory):
        answer = await autopilot.set_mode(Mode.AUTO)
        assert answer.outcome is TransferOutcome.REFUSED
        assert "No Mission" in answer.text
        many = await autopilot.upload_mission(mission(700), method="items")
        assert many.outcome is TransferOutcome.REFUSED
        assert "655" in many.text
        bad = [MissionItem(command=5001, lat_e7=511000000, lon_e7=-13000000, params=(5.0, 0.0, 0.0, 0.0), frame=0)] * 3
        fence = await autopilot.upload_fence(bad)
        assert fence.outcome is TransferOutcome.REFUSED
        assert "Fence validation failed" in fence.text
        missing = await autopilot.get_parameter("NO_SUCH_PARAM")
        assert missing.outcome is TransferOutcome.TIMEOUT
        current = await autopilot.set_current(99)
        assert current.outcome is TransferOutcome.REFUSED

    sail(main)


def test_fences_rally_points_and_parameters():
    async def main(boat, link, autopilot, memory):
        ring = [(511100000, -13100000), (511100000, -12800000), (510900000, -12800000), (510900000, -13100000)]
        fence = [
            *(MissionItem(command=5001, lat_e7=a, lon_e7=o, params=(4.0, 0.0, 0.0, 0.0), frame=0) for a, o in ring),
            MissionItem(command=5004, lat_e7=511000000, lon_e7=-12950000, params=(25.5, 0.0, 0.0, 0.0), frame=0),
        ]
        assert (await autopilot.upload_fence(fence)).is_ok
        read = await autopilot.read_fence()
        assert [canonical(i) for i in read.items] == [canonical(i) for i in fence]
        assert (await autopilot.upload_fence([])).is_ok
        assert (await autopilot.read_fence()).items == ()
        rally = [MissionItem(command=5100, lat_e7=511000000, lon_e7=-12990000)]
        assert (await autopilot.upload_rally(rally)).is_ok
        assert (await autopilot.get_parameter("MAV_SYSID")).value == 1.0
        assert (await autopilot.set_parameter("SAIL_XTRACK_MAX", 25.0)).is_ok
        assert (await autopilot.get_parameter("SAIL_XTRACK_MAX")).value == 25.0
        table = await autopilot.read_parameters()
        assert table.outcome is TransferOutcome.OK
        assert table.get("MAV_SYSID") == table.get("SYSID_THISMAV") == 1.0
        assert table.get("SAIL_XTRACK_MAX") == 25.0

    sail(main)


def test_a_list_that_was_asked_for_is_no_forgery_however_fast_it_comes():
    """It took a doctor a minute: the burst was out of step with the streams before it, and was dropped as forged."""

    async def main(boat, link, autopilot, memory):
        await asyncio.sleep(7.0)  # the streams' numbers are known by now
        began_s = now_s()
        table = await autopilot.read_parameters()
        assert len(table.values) > 200
        assert now_s() - began_s < 2.0
        assert link.stats.dropped[Drop.OUT_OF_STEP] == 0

    sail(main)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("method", ["items", "ftp"])
def test_a_link_that_loses_a_third_still_delivers_the_whole_mission(method, seed):
    async def main(boat, link, autopilot, memory):
        items = mission(6)
        for _ in range(3):
            result = await autopilot.upload_mission(items, method=method)
            if result.is_ok:
                break
        assert result.is_ok, result
        memory.impairment = Impairment()
        await asyncio.sleep(15.0)
        read = await autopilot.read_mission()
        assert mission_hash(read.items) == mission_hash(items)

    bad = Impairment(loss=0.3, duplicate=0.15, reorder=0.15, corrupt=0.02, delay_s=0.05, jitter_s=0.05)
    sail(main, impairment=bad, seed=seed)


@pytest.mark.parametrize("cut_after_s", [0.03, 0.07, 0.11, 0.15])
def test_an_ftp_upload_cut_short_leaves_the_old_mission_whole(cut_after_s):
    async def main(boat, link, autopilot, memory):
        old, new = mission(10), mission(10, north=0.002)
        await set_sail(autopilot, old)
        await asyncio.sleep(5.0)
        upload = asyncio.ensure_future(autopilot.upload_mission(new, method="ftp"))
        await asyncio.sleep(cut_after_s)
        memory.cut()
        result = await upload
        assert result.outcome is TransferOutcome.LINK
        memory.mend()
        await asyncio.sleep(5.0)
        read = await autopilot.read_mission()
        assert mission_hash(read.items) in {mission_hash(old), mission_hash(new)}

    sail(main)


def test_a_cut_item_upload_is_told_and_repaired_by_the_next():
    async def main(boat, link, autopilot, memory):
        await set_sail(autopilot, mission(10))
        new = mission(10, north=0.002)
        upload = asyncio.ensure_future(autopilot.upload_mission(new, method="items"))
        await asyncio.sleep(0.09)
        memory.cut()
        assert (await upload).outcome is TransferOutcome.LINK
        memory.mend()
        await asyncio.sleep(2.0)
        assert (await autopilot.upload_mission(new)).is_ok

    sail(main)


def test_rates_are_asked_for_and_again_after_a_reboot():
    async def main(boat, link, autopilot, memory):
        await asyncio.sleep(20.0)
        attitude = next(stream for stream in link.monitor.table if stream.name == "ATTITUDE")
        assert link.monitor.below_rate(now_s()) == ()
        assert link.monitor.rate_hz(now_s(), attitude) == pytest.approx(5.0, abs=0.5)
        assert link.stats.reboots == 0
        boat.reboot()
        await asyncio.sleep(30.0)
        assert link.stats.reboots == 1
        assert autopilot.assembler.reboots == 1
        assert link.monitor.rate_hz(now_s(), attitude) == pytest.approx(5.0, abs=0.5)

    sail(main)


def test_own_traffic_of_normal_sailing_is_small():
    async def main(boat, link, autopilot, memory):
        await set_sail(autopilot, mission(8))
        status = CompanionStatus(
            t_s=now_s(),
            state="destination approach",
            twd_from_rad=1.0,
            twd_sigma_rad=0.1,
            tws_mps=5.0,
            tws_sigma_mps=0.5,
            promised_risk=0.02,
            next_tack_s=40.0,
            cross_track_m=-3.0,
            alert_code="wind shift",
            alert_text="the wind turned 25 deg against the plan's: planning again from waypoint 4",
            plan_id=3,
        )
        for _ in range(30):
            autopilot.send_status(status)
            await asyncio.sleep(2.0)
        assert link.bytes_per_s()[1] < 200.0
        return link.bytes_per_s()[1]

    assert sail(main) > 60.0


def test_everything_is_in_the_sink_both_ways():
    frames = []

    async def main(boat, link, autopilot, memory):
        await autopilot.upload_mission(mission(3))
        return link.stats.frames_in, link.stats.frames_out

    counts = sail(main, sink=lambda t_s, frame: frames.append((t_s, frame)))
    ours = [f for _, f in frames if f[6] == 191]
    assert len(frames) == sum(counts)
    assert len(ours) == counts[1]
    assert all(a[0] <= b[0] for a, b in itertools.pairwise(frames))


def test_the_same_seed_repeats_every_byte():
    def once():
        frames = []

        async def main(boat, link, autopilot, memory):
            await set_sail(autopilot, mission(4))
            await asyncio.sleep(20.0)

        sail(main, sink=lambda t_s, frame: frames.append((t_s, frame)), impairment=Impairment(loss=0.1, reorder=0.1))
        return frames

    assert once() == once()


def test_we_are_an_onboard_computer_with_the_boats_system_id():
    frames = []

    async def whole():
        boat = SimulatedAutopilot(AutopilotConfig(is_warm=True, sysid=7), Constant(0.0, 5.0), seed=1)
        memory = MemoryLink(seed=1)
        async with serve(boat, [memory.far]), Link(memory.near, sink=lambda _, f: frames.append(f)) as link:
            party = await link.wait_autopilot(10.0)
            await asyncio.sleep(3.0)
            return party

    party = run_virtual(whole())
    assert (party.target_system, party.own_system, party.own_component) == (7, 7, 191)
    beats = [f for f in frames if f[6] == 191 and f[7:10] == b"\x00\x00\x00"]
    assert beats[-1][5] == 7
    assert beats[-1][10 + 4] == 18, "MAV_TYPE_ONBOARD_CONTROLLER"
    assert beats[-1][10 + 5] == 8, "MAV_AUTOPILOT_INVALID"


def test_another_system_is_not_listened_to():
    async def whole():
        boat = SimulatedAutopilot(AutopilotConfig(is_warm=True, sysid=7), Constant(0.0, 5.0), seed=1)
        memory = MemoryLink(seed=1)
        async with serve(boat, [memory.far]), Link(memory.near, target_system=3) as link:
            heard = []
            link.subscribe(lambda _, m: heard.append(m))
            with pytest.raises(LinkError, match="no autopilot's heartbeat of system 3"):
                await link.wait_autopilot(5.0)
            assert not heard
            assert link.dropped()[Drop.FOREIGN_SYSTEM] > 3

    run_virtual(whole())


def test_a_silent_link_is_an_error_of_one_line():
    async def whole():
        memory = MemoryLink(seed=1)
        async with Link(memory.near) as link:
            await link.wait_autopilot(5.0)

    with pytest.raises(LinkError, match="nothing was heard at all") as caught:
        run_virtual(whole())
    assert "\n" not in str(caught.value)


def test_a_listener_speaks_once_and_then_listens():
    async def main(boat, link, autopilot, memory):
        await asyncio.sleep(10.0)
        return link.stats.frames_out

    listener = {"identity": LinkIdentity(system=254, component=25), "streams": (), "is_quiet": True}
    # one or two heartbeats until the autopilot is heard, and the version that the facade asks for
    assert sail(main, **listener) <= 4


def test_the_status_crosses_to_another_link():
    """As through a telemetry radio: the shore hears the companion on its own link of the autopilot."""

    async def whole():
        boat = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), seed=1)
        wire, radio = MemoryLink("wire", seed=1), MemoryLink("radio", seed=2)
        shore_id = LinkIdentity(system=254, component=25)
        async with (
            serve(boat, [wire.far, radio.far]),
            Link(wire.near) as link,
            Link(radio.near, identity=shore_id, streams=(), is_quiet=True) as shore,
        ):
            reader = StatusReader()
            shore.subscribe(reader.take)
            autopilot = Autopilot(link)
            await link.wait_autopilot()
            await shore.wait_autopilot()
            for _ in range(6):
                autopilot.send_status(CompanionStatus(t_s=now_s(), state="standard", tws_mps=5.0, twd_from_rad=1.0))
                await asyncio.sleep(2.0)
            autopilot.say(4, "the wind turned: planning again from waypoint 4, which is more than fifty letters")
            texts = []
            shore.subscribe(lambda _, m: texts.append((m.get_srcComponent(), m.get_type())))
            await asyncio.sleep(1.0)
            return reader.report(now_s()), texts

    report, texts = run_virtual(whole())
    assert report.has_packed
    assert report.status.state == "standard"
    assert {"status", "wind", "co_twd", "co_tws"} <= set(report.age_s)
    assert texts.count((191, "STATUSTEXT")) == 2, "in two chunks"


def test_a_program_that_died_during_an_ftp_upload_is_followed_by_one_that_succeeds():
    async def whole():
        boat = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), seed=1)
        memory = MemoryLink(seed=1)
        hashes = []
        async with serve(boat, [memory.far]):
            for life in range(6):
                async with Link(memory.near) as link, Autopilot(link) as autopilot:
                    new = mission(20, north=0.0005 * life)
                    upload = asyncio.ensure_future(autopilot.upload_mission(new, method="ftp"))
                    await asyncio.sleep(0.02 + 0.021 * life)
                    upload.cancel()
                    await asyncio.gather(upload, return_exceptions=True)
            async with Link(memory.near) as link, Autopilot(link) as autopilot:
                result = await autopilot.upload_mission(mission(7))
                hashes.append(mission_hash((await autopilot.read_mission()).items))
        return result, hashes[0]

    result, seen = run_virtual(whole())
    assert (result.outcome, result.method) == (TransferOutcome.OK, "ftp")
    assert seen == mission_hash(mission(7))
