"""Live runs: what the vessels of a scenario say over UDP, and a voyage among them on the real ArduRover."""

import asyncio
import contextlib
import json
import math
import os
import socket
import statistics
import subprocess
import sys
import time
import tty
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s, run, run_virtual
from companion.errors import InputError, JobError
from companion.geo.angles import difference_rad
from companion.geo.frame import LocalFrame
from companion.mavlink.transports import open_link
from companion.messages import GeoPoint
from companion.traffic.feeds import open_feed, parse_feed
from companion.traffic.nmea import NmeaDecoder
from companion.traffic.soundings import SoundingDecoder
from sitl.ardurover.simulation import find
from sitl.autopilot import AisVessel, VaneFault, VaneState
from sitl.faults.link_faults import FaultyVane, Relay, impair
from sitl.run.boats import LiveFix
from sitl.run.depths import spoken_depths
from sitl.run.live import follow, run_live
from sitl.scenario.scenario import EventSpec, load_scenario
from sitl.scenario.traffic import Others, distance_m, free_port, sentences, ship_of
from sitl.scenario.true_track import TrueTrack
from sitl.world import MOST_M
from sitl.world.environment import Constant

ORIGIN = GeoPoint(lat_deg=50.817, lon_deg=-1.31)
FRAME = LocalFrame(ORIGIN)


@given(
    lat=st.floats(-85.0, 85.0),
    lon=st.floats(-179.99, 179.99),
    course=st.floats(0.0, 359.99),
    speed=st.floats(0.0, 50.0),
    mmsi=st.integers(200_000_000, 799_999_999),
)
def test_a_receivers_sentence_says_where_the_ship_is(lat, lon, course, speed, mmsi):
    vessel = AisVessel(
        mmsi=mmsi,
        position=GeoPoint(lat_deg=lat, lon_deg=lon),
        cog_deg=course,
        sog_mps=speed,
        heading_deg=course,
        nav_status=0,
    )
    report = NmeaDecoder().feed(sentences(vessel).strip(), 1.0)
    assert report.mmsi == mmsi
    assert not report.is_class_b
    assert report.position.lat_deg == pytest.approx(lat, abs=1e-4 / 60.0)
    assert report.position.lon_deg == pytest.approx(lon, abs=1e-4 / 60.0)
    assert report.speed_mps == pytest.approx(speed, abs=0.052)
    assert abs(difference_rad(report.course_rad, math.radians(course))) <= math.radians(0.11)


def passed(vane, *messages):
    packer = mav.MAVLink(None, srcSystem=1, srcComponent=1)
    for message in messages:
        frame = vane.pass_on(bytes(message.pack(packer)))
    return frame, mav.MAVLink(None).parse_char(frame)


@given(
    st.floats(0.0, 359.9),
    st.floats(-math.pi, math.pi),
    st.floats(-3.0, 3.0),
    st.floats(-3.0, 3.0),
    st.floats(2.0, 12.0),
)
def test_a_vane_broken_on_the_link_says_what_a_broken_one_would(twd_deg, yaw, north, east, speed):
    def attitude(yaw):
        return mav.MAVLink_attitude_message(0, 0.0, 0.0, yaw, 0.0, 0.0, 0.0)

    at_rest = mav.MAVLink_global_position_int_message(0, 0, 0, 0, 0, 0, 0, 0, 0)
    way = mav.MAVLink_global_position_int_message(0, 0, 0, 0, 0, round(100 * north), round(100 * east), 0, 0)
    wind = mav.MAVLink_wind_message(twd_deg, speed, 0.0)
    vane = FaultyVane(seed=0)
    frame, _ = passed(vane, attitude(yaw), way, wind)
    assert frame[9:-2] == bytes(wind.pack(mav.MAVLink(None, srcSystem=1, srcComponent=1)))[9:-2]  # untouched
    vane.set(VaneFault(state=VaneState.FROZEN))
    _, heard = passed(vane, wind)  # nothing has moved yet
    assert abs(difference_rad(math.radians(heard.direction), math.radians(twd_deg))) < 1e-3
    assert math.isclose(heard.speed, speed, abs_tol=1e-3)
    vane.set(VaneFault())
    passed(vane, attitude(yaw), at_rest, wind)
    vane.set(VaneFault(state=VaneState.FROZEN))
    _, heard = passed(vane, attitude(yaw + 0.5), mav.MAVLink_wind_message(twd_deg + 5.0, speed, 0.0))
    assert abs(difference_rad(math.radians(heard.direction), math.radians(twd_deg) + 0.5)) < 1e-3  # it turns with her
    vane.set(VaneFault(state=VaneState.OFFSET, value_rad=0.2))
    _, heard = passed(vane, wind)
    assert abs(difference_rad(math.radians(heard.direction), math.radians(twd_deg) + 0.2)) < 1e-3


async def heard_for(seconds, event, began_s):
    """Play ``event`` and return what a companion's feed hears, and the judge's truth."""
    port, reports, truth = free_port(), [], TrueTrack()
    others = Others(FRAME, Constant(0.0, 5.0), 0, port=port)
    async with open_feed(parse_feed(f"udpin:127.0.0.1:{port}"), reports.append, NmeaDecoder(), "AIS feed"):
        playing = asyncio.create_task(others.play(event, began_s, lambda: (((0.0, 0.0), (0.0, 0.0)), 0.0)))
        for _ in range(seconds):
            await asyncio.sleep(1.0)
            others.note(truth, (0.0, 0.0), now_s() - began_s)
        playing.cancel()
    return reports, truth


def test_a_ship_is_reported_where_the_judge_measures_it():
    event = EventSpec(at_s=40.0, kind="vessel", east_m=300.0, north_m=200.0, course_deg=180.0, sog_mps=5.0)
    # the scenario began 40 s before the loop's time 0: the ship is at its place now
    reports, truth = run_virtual(heard_for(60, event, -40.0))
    assert len(reports) == 6
    ship = ship_of(event, 0)
    for report in reports:
        assert math.dist(FRAME.en_from_geo(report.position), ship.at(report.t_s + 40.0)) < 1.0
    assert reports[-1].t_s > 45.0
    # abeam after 40 s, 300 m off the middle
    assert truth.vessels_m == {"211000001": pytest.approx(distance_m(ship, (0.0, 0.0), 80.0), abs=0.1)}


def test_a_ship_without_ais_is_judged_and_not_told():
    event = EventSpec(at_s=0.0, kind="vessel", east_m=300.0, course_deg=180.0, sog_mps=5.0, is_on_ais=False)
    reports, truth = run_virtual(heard_for(20, event, 0.0))
    assert reports == []
    assert truth.vessels_m["211000001"] == pytest.approx(292.0, abs=0.1)  # half a beam off its middle


def test_a_ship_whose_time_is_over_is_neither_told_nor_measured():
    event = EventSpec(at_s=0.0, kind="vessel", east_m=300.0, course_deg=0.0, sog_mps=5.0, every_s=5.0, for_s=22.0)
    reports, truth = run_virtual(heard_for(90, event, 0.0))
    assert [report.t_s for report in reports] == pytest.approx([0.0, 5.0, 10.0, 15.0, 20.0], abs=1.0)
    assert truth.vessels_m["211000001"] == pytest.approx(292.0, abs=1.0)  # as it was while it was there

    async def looked():
        others = Others(FRAME, Constant(0.0, 5.0), 0, port=0, hear=lambda _: None)
        playing = asyncio.create_task(others.play(event, 0.0, lambda: (((0.0, 0.0), (0.0, 0.0)), 0.0)))
        await asyncio.sleep(20.0)
        near = others.nearest_m((0.0, 0.0), now_s())
        await asyncio.sleep(20.0)
        await playing  # it is over
        return near, others.nearest_m((0.0, 0.0), now_s())

    assert run_virtual(looked()) == (pytest.approx(263.0, abs=50.0), math.inf)


def test_an_intruder_comes_at_our_boat():
    event = EventSpec(at_s=0.0, kind="intruder", gap_m=70.0, bearing_deg=45.0, sog_mps=3.0, every_s=1.0)
    reports, truth = run_virtual(heard_for(40, event, 0.0))
    assert len(reports) >= 39
    assert truth.vessels_m["211000001"] < 1.0


def test_a_second_boat_sails_to_its_goal_round_ours():
    event = EventSpec(at_s=0.0, kind="second_boat", east_m=120.0, goal_east_m=-120.0, every_s=2.0)
    reports, truth = run_virtual(heard_for(400, event, 0.0))
    assert truth.second_boat_m < 15.0
    assert truth.vessels_m["211000001"] > 8.0
    assert len(reports) == 200


def test_a_relay_carries_both_ways_and_its_link_is_cut_for_a_while():
    codec = mav.MAVLink(None)

    def frame(n):
        return mav.MAVLink_system_time_message(n, n).pack(codec)

    async def main():
        port = free_port()
        boat, heard_by_boat, heard = open_link(f"udpin:127.0.0.1:{port}"), [], []
        await boat.open(heard_by_boat.append)
        async with Relay(f"udpout:127.0.0.1:{port}", seed=1) as relay:
            companion = open_link(relay.link)
            await companion.open(heard.append)
            relay.line.near.write(frame(0))  # as the companion's first word: the boat then knows whom to answer
            await asyncio.sleep(0.1)
            boat.write(frame(1)[:7])
            boat.write(frame(1)[7:] + frame(2))
            await asyncio.sleep(0.1)
            companion.write(frame(3))
            await asyncio.sleep(0.1)
            cut = asyncio.create_task(impair(relay.line, EventSpec(at_s=0.0, kind="link_cut", for_s=0.3)))
            await asyncio.sleep(0.1)
            for end in (boat, companion):
                end.write(frame(4))
            await cut
            boat.write(frame(5))
            await asyncio.sleep(0.1)
            await companion.close()
        await boat.close()
        return heard_by_boat, heard

    heard_by_boat, heard = asyncio.run(main())
    numbers = [m.time_boot_ms for m in mav.MAVLink(None).parse_buffer(b"".join(heard))]
    assert numbers == [1, 2, 5]
    assert [m.time_boot_ms for m in mav.MAVLink(None).parse_buffer(b"".join(heard_by_boat))] == [0, 3]


class Afloat:
    """A boat that sails, and whose companion sums the voyage up after ten seconds and draws for a minute."""

    def __init__(self, summary):
        self.began_s, self.summary = now_s(), summary

    def fix(self):
        if now_s() - self.began_s >= 10.0:
            self.summary.touch()
        return LiveFix(position=ORIGIN, heading_rad=0.0, speed_mps=2.0, wind=(0.0, 5.0), sails=True)


def test_the_voyage_is_over_with_its_summary_however_long_the_picture_takes(tmp_path):
    """At a quarter of a core a voyage of 45 s was said to have taken 130."""

    async def watched():
        truth, summary = TrueTrack(), tmp_path / "summary.json"
        others = Others(FRAME, Constant(0.0, 5.0), 0, port=free_port())
        await asyncio.wait_for(follow(Afloat(summary), FRAME, truth, others, now_s(), summary), 70.0)
        return truth.t_s[-1] - truth.t_s[0]

    assert run_virtual(watched()) == pytest.approx(10.0, abs=0.5)


UNHEARD_M = 9.9  # until the feed hears: what is spoken to a port that is opened later is lost
DEPTHS_M = (6.0, 5.9, None, 5.8, 55.0, 5.7)  # no echo, and beyond its reach


async def sounded_over(feed, port, carried):
    """Return what a companion's feed hears of a sounder that speaks to ``port``, and the decoder's counts."""
    pings, depths, decoder = [], iter(DEPTHS_M), SoundingDecoder()
    async with open_feed(parse_feed(feed, baud=4800), pings.append, decoder, "sounder") as heard:
        async with spoken_depths(lambda: next(depths, 5.7) if pings else UNHEARD_M, port, 0.4):
            while len(told := [ping for ping in pings if ping.depth_m != UNHEARD_M]) < len(DEPTHS_M):
                carried()
                await asyncio.sleep(0.1)
        return told[: len(DEPTHS_M)], heard.counts


def of_pings(pings, counts):
    assert [ping.depth_m for ping in pings] == [6.0, 5.9, None, 5.8, None, 5.7]
    assert {(ping.offset_m, ping.most_m) for ping in pings if ping.depth_m} == {(0.4, MOST_M)}
    assert counts.refused == 0


def test_a_sounder_of_a_live_run_is_heard_by_udp():
    port = free_port()
    of_pings(*run(sounded_over(f"udpin:127.0.0.1:{port}", port, lambda: None), speedup=10.0))


def test_and_through_a_multiplexer_on_a_serial_port():
    """The same sentences over a pseudo-terminal, as an instrument's port gives them."""
    ours, theirs = os.openpty()
    tty.setraw(ours)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as wire:
        wire.bind(("127.0.0.1", 0))
        wire.setblocking(False)

        def carried():
            with contextlib.suppress(BlockingIOError):
                while True:
                    os.write(ours, wire.recv(1024))

        try:
            of_pings(*run(sounded_over(f"{os.ttyname(theirs)}:4800", wire.getsockname()[1], carried), speedup=10.0))
        finally:
            os.close(ours)
            os.close(theirs)


def test_the_bottom_of_a_live_run_is_sounded_and_judged(tmp_path):
    """By the companion's own sounder, of the water that the judge holds the keel against."""
    source, folder = Path("sitl/scenarios/nmea-sounder.toml"), tmp_path / "v"
    scenario = msgspec.structs.replace(load_scenario(source), limit_s=20.0)
    verdict = run_live(scenario, source, 0, folder, autopilot="embedded", program=None, speedup=8.0)
    pings = [
        entry["ping_m"]
        for line in (folder / "decisions.jsonl").read_text().splitlines()
        if (entry := json.loads(line))["kind"] == "sounding" and entry["ping_m"] is not None
    ]
    assert len(pings) > 10
    assert statistics.median(pings) == pytest.approx(10.5, abs=0.3)  # 9 m, 1 m and half of 1 m of tide
    assert verdict.figures["groundings"] == 0


def test_a_mission_that_hears_no_sounder_is_told_before_a_live_run_begins(tmp_path):
    scenario = load_scenario(Path("sitl/scenarios/nmea-sounder.toml"))
    silent = msgspec.structs.replace(scenario, mission=str(Path("sitl/missions/shoaling.toml").resolve()))
    with pytest.raises(InputError, match="hears no sounder by UDP"):
        run_live(
            silent, Path("sitl/scenarios/a.toml"), 0, tmp_path / "v", autopilot="embedded", program=None, speedup=9.0
        )
    assert not (tmp_path / "v").exists()


def test_a_reboot_is_none_of_the_real_autopilots_whose_simulation_would_begin_anew(tmp_path):
    source = Path("sitl/scenarios/reboot.toml")
    with pytest.raises(JobError, match="reboot can be played by the embedded autopilot only"):
        run_live(load_scenario(source), source, 0, tmp_path, autopilot="ardurover", program=None, speedup=None)
    assert list(tmp_path.iterdir()) == []


PROGRAM = find()


@pytest.mark.campaign
@pytest.mark.ardurover
@pytest.mark.skipif(PROGRAM is None, reason="no ardurover: run 'sitl fetch' or set $ARDUROVER")
@pytest.mark.parametrize("name", ["crossing", "head-on", "overtaking"])
def test_the_real_autopilot_sails_among_ships(name, tmp_path):
    source = Path(f"sitl/scenarios/{name}.toml")
    verdict = run_live(
        load_scenario(source), source, 1, tmp_path / "v", autopilot="ardurover", program=PROGRAM, speedup=None
    )
    assert verdict.passed, [c for c in verdict.checks if not c.passed]


@pytest.mark.parametrize("begun", ["live_boat", "companion.cli"])
def test_a_run_that_is_terminated_leaves_nobody_behind(begun, tmp_path):
    with subprocess.Popen(
        [sys.executable, "-m", "sitl.cli", "run", "rocks", "--live", "--out", str(tmp_path / "v")],
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    ) as run:
        try:
            left = {}
            while not any(begun in words for words in left.values()):
                time.sleep(0.02)
                left = children(run.pid)
            if begun == "companion.cli":
                while "WAITING" not in run.stdout.readline():  # its own progress
                    pass
                left = children(run.pid)
            run.terminate()
            rest = run.stdout.read()
            assert run.wait(60.0) == 130
            assert "Traceback" not in rest
            until_s = time.monotonic() + 20.0
            while alive := [words for pid, words in left.items() if command_of(pid) == words]:
                assert time.monotonic() < until_s, alive
                time.sleep(0.1)
        finally:
            run.kill()


def command_of(pid):
    try:
        return Path(f"/proc/{pid}/cmdline").read_text().replace("\0", " ")
    except OSError:
        return ""


def children(pid):
    """Return the processes below one, by their numbers."""
    found, above = {}, {pid}
    while above:
        below = {int(n) for p in above for n in Path(f"/proc/{p}/task/{p}/children").read_text().split()}
        found |= {n: command_of(n) for n in below}
        above = below
    return found


def hear_for(ear, for_s):
    until_s = time.monotonic() + for_s
    while time.monotonic() < until_s:
        ear.recv(300)


def test_the_boat_ends_with_the_one_who_began_it():
    """Who is killed can end nobody."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as ear:
        ear.bind(("127.0.0.1", 0))
        ear.settimeout(60.0)
        boat = [
            sys.executable,
            "-m",
            "sitl.run.live_boat",
            "sitl/scenarios/demo.toml",
            "--endpoint",
            f"udpout:127.0.0.1:{ear.getsockname()[1]}",
        ]
        starter = subprocess.Popen(
            [sys.executable, "-c", f"import subprocess; subprocess.run({boat!r})"], stdin=subprocess.DEVNULL
        )
        try:
            ear.recv(300)
        finally:
            starter.kill()
            starter.wait()
        ear.settimeout(3.0)
        with pytest.raises(TimeoutError):
            hear_for(ear, 60.0)
