"""Voyages among ships under the virtual clock: AIS from the autopilot and from a feed, avoided and replayed."""

import asyncio
import json
import math
import socket
from itertools import pairwise
from pathlib import Path

import msgspec
import pytest

from companion.clock import now_s, run_virtual
from companion.compose import feeds_of
from companion.errors import InputError
from companion.geofence import load_mission
from companion.messages import AisReport, GeoPoint
from companion.replay import replay
from companion.telemetry.folder.records import ais_of, ais_record
from companion.traffic.plans import ALIKE_M
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import load_scenario
from sitl.scenario.traffic import ship_of

CROSSING = Path("sitl/scenarios/crossing.toml")


def unheard(scenario):
    events = tuple(msgspec.structs.replace(e, is_on_ais=False) for e in scenario.events)
    return msgspec.structs.replace(scenario, events=events)


def decisions(out):
    return [json.loads(line) for line in (out / "decisions.jsonl").read_text().splitlines()]


def failed(verdict):
    return [c.name for c in verdict.checks if not c.passed]


def test_a_ship_heard_by_the_autopilot_is_avoided_and_the_voyage_replays(tmp_path):
    verdict = run_virtual(run_embedded(load_scenario(CROSSING), CROSSING, 0, tmp_path))
    assert verdict.passed, failed(verdict)
    asked = [d for d in decisions(tmp_path) if d.get("action") == "RequestPlan"]
    assert any(d["reason"] == "obstacle" and "211000001" in d["text"] and d["vessels"] == ["211000001"] for d in asked)
    assert all(b["t_s"] - a["t_s"] >= 20.0 for a, b in pairwise(asked) if b["reason"] == "obstacle")
    assert not replay(tmp_path).differences
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert 0.0 < summary["promised_risk_vessels"] < summary["promised_risk"]
    assert 0.0 <= summary["path_risk_vessels"] <= summary["path_risk"]
    plans = [d["plan"] for d in decisions(tmp_path) if d["kind"] == "plan" and d["plan"]]
    changed = [d for d in decisions(tmp_path) if "path_distance_m" in d]
    assert any(d["path_distance_m"] > 50.0 and "211000001" in d["old_route"] for d in changed)
    assert any("vessels" in p["why"]["text"] and p["why"]["data"]["risk"]["by_vessel"] for p in plans)


def test_the_same_ship_unheard_is_run_into(tmp_path):
    verdict = run_virtual(run_embedded(unheard(load_scenario(CROSSING)), CROSSING, 0, tmp_path))
    assert "distance to vessels, m" in failed(verdict)
    assert verdict.figures["vessel_distances_m"]["211000001"] < 5.0


@pytest.fixture
def port():
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def with_feeds(folder, *feeds):
    text = Path("sitl/missions/fairway.toml").read_text()
    assert "[traffic]" in text
    names = ", ".join(f'"{f}"' for f in feeds)
    head, tail = text.split("safe_distance_m", 1)
    (folder / "mission.toml").write_text(f"{head}feeds = [{names}]\nsafe_distance_m{tail}")
    return folder / "mission.toml"


def test_a_ship_of_a_udp_feed_is_avoided_and_the_voyage_replays(tmp_path, port):
    with_feeds(tmp_path, f"udpin:127.0.0.1:{port}", "mavlink")
    scenario = msgspec.structs.replace(unheard(load_scenario(CROSSING)), mission="mission.toml")
    event = scenario.events[0]
    frame = load_mission(tmp_path / "mission.toml").frame()

    async def broadcast():
        ship = ship_of(event, 0)
        await asyncio.sleep(event.at_s)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender:
            while True:
                place = frame.geo_from_en(*ship.at(now_s()))
                said = {
                    "id": 7,
                    "name": "Intruder",
                    "lat": place.lat_deg,
                    "lon": place.lon_deg,
                    "length_m": 100.0,
                    "heading_deg": event.course_deg,
                    "speed_mps": event.sog_mps,
                }
                sender.sendto(json.dumps(said).encode(), ("127.0.0.1", port))
                await asyncio.sleep(5.0)

    async def voyage():
        task = asyncio.create_task(broadcast())
        verdict = await run_embedded(scenario, tmp_path / "scenario.toml", 0, tmp_path / "out")
        task.cancel()
        return verdict

    verdict = run_virtual(voyage())
    assert verdict.passed, failed(verdict)
    records = decisions(tmp_path / "out")
    assert sum(d["kind"] == "ais" for d in records) > 20
    assert any(d.get("vessels") == ["Intruder"] for d in records)
    assert not replay(tmp_path / "out").differences


def test_a_feed_that_cannot_be_opened_is_told_and_the_boat_sails(tmp_path, port):
    with_feeds(tmp_path, f"udpin:127.0.0.1:{port}")
    scenario = msgspec.structs.replace(unheard(load_scenario(CROSSING)), mission="mission.toml", limit_s=60.0)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as taken:
        taken.bind(("127.0.0.1", port))
        verdict = run_virtual(run_embedded(scenario, tmp_path / "scenario.toml", 0, tmp_path / "out"))
    assert "no unhandled error" not in failed(verdict)
    records = decisions(tmp_path / "out")
    assert any(d["kind"] == "refusal" and str(port) in d["text"] for d in records)
    assert any(d.get("action") == "UploadMission" for d in records)


def test_a_feed_name_that_is_none_is_bad_input(tmp_path):
    with pytest.raises(InputError, match="traffic"):
        feeds_of(load_mission(with_feeds(tmp_path, "udp:nowhere")))


@pytest.mark.parametrize(
    "report",
    [
        AisReport(
            t_s=0.1 + 0.2, mmsi=7, position=GeoPoint(lat_deg=51.1, lon_deg=-1.3), course_rad=math.pi / 3, name="x"
        ),
        AisReport(t_s=1.0, mmsi=8, is_class_b=True, age_s=2.5),
    ],
)
def test_a_report_survives_its_record(report):
    assert ais_of(json.loads(json.dumps(ais_record(report)))) == report


def test_four_ships_at_once_and_the_paths_look_alike(tmp_path):
    """Büsser 2009, 5.2: no replanning more often than every 20 s; a path that is safe stays or changes little."""
    path = Path("sitl/scenarios/four-ships.toml")
    verdict = run_virtual(run_embedded(load_scenario(path), path, 1, tmp_path))
    assert verdict.passed, failed(verdict)
    records = decisions(tmp_path)
    asked = [d["t_s"] for d in records if d.get("action") == "RequestPlan" and not d["rung"]]
    assert len({v for d in records for v in d.get("vessels", ())}) == 4
    assert all(b - a >= 20.0 for a, b in pairwise(asked))
    changes = [d for d in records if d.get("action") == "UploadMission" and "path_distance_m" in d]
    given_up = [d for d in changes if d["old_route"] != "safe"]
    assert [d["old_route"].split()[1] for d in given_up] == [f"21100000{n}" for n in range(1, 5)]  # as they are heard
    assert max(d["path_distance_m"] for d in given_up) > ALIKE_M
    safe_since = [t for t in asked if t > given_up[-1]["t_s"]]
    assert len(safe_since) > 2
    assert all(d["path_distance_m"] <= ALIKE_M for d in changes if d["old_route"] == "safe")
    assert sum(d["t_s"] > given_up[-1]["t_s"] for d in changes) < len(safe_since)  # it stays
    shared = [d for d in records if d.get("action") == "RequestPlan" and d.get("vessels")]
    for plan in shared:
        assert plan["instant"]["wind"] + plan["instant"]["vessels"] == pytest.approx(1.0 - plan["delta_s"])
