"""Voyages among ships with bad AIS: counted, bounded, shown in the status; never a crash or a plan through a ship."""

import asyncio
import json
import math
import socket

import msgspec
import pytest
from pyais.encode import encode_dict

from companion.clock import now_s, run_virtual
from companion.commands.status import EXIT_ALARM, exit_code, status_document, traffic_line
from companion.geofence import load_mission
from companion.mavlink.tlog import read_tlog
from companion.mavlink.wire.companion_status import StatusReader
from companion.mavlink.wire.frames import Codec
from companion.replay import replay
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import load_scenario
from sitl.scenario.traffic import ship_of
from tests.voyages.test_traffic import CROSSING, decisions, failed, port, unheard, with_feeds  # noqa: F401 - a fixture

AFTER_S = 260.0  # the ship has gone by: the voyage need not be sailed to its end


def ais(mmsi, point, course_deg, speed_mps, **more):
    values = {
        "type": 1,
        "mmsi": mmsi,
        "lat": point.lat_deg,
        "lon": point.lon_deg,
        "course": course_deg,
        "speed": speed_mps * 3600.0 / 1852.0,
        "heading": int(course_deg),
    }
    return [line.encode() for line in encode_dict(values | more, talker_id="AI", sentence_type="VDM")]


class Boat:
    """Where the simulated boat is: an observer of the run."""

    position = None

    def truth(self, t_s, autopilot, link):
        self.position = autopilot.truth.position

    def life(self, start_s, end_s):
        """Nothing."""


def sail(folder, udp, speak, *, limit_s=AFTER_S):
    """Sail the crossing with what ``speak(frame, ship, boat, send)`` says on the feed; return verdict and statuses."""
    with_feeds(folder, f"udpin:127.0.0.1:{udp}")
    scenario = msgspec.structs.replace(unheard(load_scenario(CROSSING)), mission="mission.toml", limit_s=limit_s)
    ship, boat = ship_of(scenario.events[0], 0), Boat()
    frame = load_mission(folder / "mission.toml").frame()

    async def voyage():
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:

            def send(data):
                sender.sendto(data, ("127.0.0.1", udp))

            task = asyncio.create_task(speak(frame, ship, boat, send))
            verdict = await run_embedded(scenario, folder / "scenario.toml", 0, folder / "out", observer=boat)
            task.cancel()
            return verdict

    return run_virtual(voyage()), on_air(folder / "out")


def on_air(out):
    """What ``companion status`` has of other vessels, time by time: read from the frames that went out."""
    reader, codec, found = StatusReader(), Codec(254, 25), []
    for record in read_tlog(out / "telemetry.tlog"):
        for message in codec.feed(record.frame):
            if reader.take(record.unix_us / 1e6, message):
                document = status_document(reader.report(record.unix_us / 1e6), None, True, 0.0, 0.0)
                if document["traffic"] is not None:
                    found.append(document["traffic"])
                    worst = document["traffic"]["worst"]
                    assert (worst is None or worst["alarm"] not in {"act", "touch"}) or (
                        exit_code(document, 10.0) == EXIT_ALARM
                    )
    return found


def is_safe(verdict):
    """Nothing broke and nothing was hit; a voyage that was cut short has not arrived."""
    return set(failed(verdict)) <= {"arrived", "distance of the last position to the goal, m", "alerts"} and (
        verdict.figures["vessel_distances_m"]["211000001"] >= 50.0
    )


def test_noise_fragments_and_floods_hide_no_ship(tmp_path, port):  # noqa: F811 - the fixture
    async def speak(frame, ship, boat, send):
        await asyncio.sleep(40.0)
        n = 0
        while True:
            here = frame.geo_from_en(*ship.at(now_s()))
            first, second = ais(
                211000001,
                here,
                180.0,
                5.0,
                type=5,
                shipname="NELLIE",
                ship_type=70,
                to_bow=50,
                to_stern=50,
                to_port=8,
                to_starboard=8,
            )
            good = ais(211000001, here, 180.0, 5.0)[0]
            send(second + b"\r\n" + first)  # the second part comes first
            send(first)  # and one that is never finished
            send(good.replace(b",A,", b",B,", 1))  # a wrong checksum
            send(b"\x00\xff!AIVDM,9,9,,A,*00" * 20)
            send(b'{"id": 8, "lat": 50.82, "lon": -1.305, "age_s": 3000}')  # an hour's clock error
            if n == 5:
                for _ in range(40):
                    send(b"\r\n".join([good] * 60))  # 2400 reports within a second
            send(good)
            n += 1
            await asyncio.sleep(5.0)

    verdict, seen = sail(tmp_path, port, speak)
    assert is_safe(verdict), failed(verdict)
    last = seen[-1]
    assert last["refused"] > 100
    assert f"{last['refused']} refused" in traffic_line(last)
    assert {s["worst"]["name"] for s in seen if s["worst"]} >= {"NELLIE"}
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert summary["ais_dropped"] > 0
    assert summary["traffic"]["stale"] > 0
    assert not replay(tmp_path / "out").differences


def test_two_ships_with_one_number_are_both_kept_clear_of(tmp_path, port):  # noqa: F811 - the fixture
    async def speak(frame, ship, boat, send):
        await asyncio.sleep(40.0)
        while True:
            send(ais(211000001, frame.geo_from_en(*ship.at(now_s())), 180.0, 5.0)[0])
            far = (600.0 + 4.0 * now_s(), 4000.0)
            send(ais(211000001, frame.geo_from_en(*far), 90.0, 4.0)[0])
            await asyncio.sleep(5.0)

    verdict, seen = sail(tmp_path, port, speak)
    assert is_safe(verdict), failed(verdict)
    assert max(s["vessels"] for s in seen) == 2
    assert seen[-1]["shared_mmsi"] >= 1
    assert "shared MMSI" in traffic_line(seen[-1])


def test_a_ship_reported_on_top_of_us_and_a_feed_that_stops(tmp_path, port):  # noqa: F811 - the fixture
    """From 90 s to 120 s somebody claims to be where we are; at 120 s the feed falls silent, the ship coming."""

    async def speak(frame, ship, boat, send):
        await asyncio.sleep(40.0)
        while now_s() < 120.0:
            send(ais(211000001, frame.geo_from_en(*ship.at(now_s())), 180.0, 5.0)[0])
            if now_s() >= 90.0 and boat.position is not None:
                send(ais(211000099, boat.position, 90.0, 2.5)[0])
            await asyncio.sleep(5.0)

    verdict, seen = sail(tmp_path, port, speak)
    assert is_safe(verdict), failed(verdict)
    worst = [s["worst"] for s in seen if s["worst"]]
    assert any(w["name"] == "211000099" and w["alarm"] == "touch" for w in worst)
    assert seen[-1]["silent_feeds"] == 1
    assert seen[-1]["silence_s"] > 100.0
    assert "1 of 1 feed silent" in traffic_line(seen[-1])
    records = decisions(tmp_path / "out")
    assert [d["silent"] for d in records if d["kind"] == "feed"] == [True]
    said = [d for d in records if d.get("action") == "Announce" and d["code"] == "vessel near"]
    assert any("211000099: touch" in d["text"] and "rule" in d["text"] for d in said)


@pytest.mark.campaign
@pytest.mark.parametrize("jump_s", [-400.0, 400.0, 3000.0, math.nan])
def test_ages_that_jump_move_no_ship_out_of_sight(tmp_path, port, jump_s):  # noqa: F811 - the fixture
    async def speak(frame, ship, boat, send):
        await asyncio.sleep(40.0)
        while True:
            for age_s in (jump_s, 0.0):
                point = frame.geo_from_en(*ship.at(now_s()))
                send(
                    json.dumps(
                        {
                            "id": 211000001,
                            "lat": point.lat_deg,
                            "lon": point.lon_deg,
                            "heading_deg": 180.0,
                            "speed_mps": 5.0,
                            "length_m": 100.0,
                            "age_s": age_s,
                        }
                    ).encode()
                )
            await asyncio.sleep(5.0)

    verdict, _ = sail(tmp_path, port, speak)
    assert is_safe(verdict), failed(verdict)
