"""A voyage that is commanded by satellite, by a shore that knows docs/reference/far.md and nothing of ours."""

import asyncio
import json
from pathlib import Path

import msgspec
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import now_s, run_virtual
from companion.replay import replay
from companion.telemetry.folder.recorder import read_jsonl
from sitl.faults import KEY, injection
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, HeldSpec, SatelliteSpec, load_scenario
from tests.orders.far import by_the_page
from tests.voyages.test_orders import Station, failed

SOURCE = Path("sitl/scenarios/far-away.toml")
HOLD, GO_ON, HOME = 1, 2, 5
DONE, EXPIRED = 1, 5
YEAR_2020_S = 1_577_836_800


class Shore:
    """Gives a hold twice over, one that has expired, forgeries, a go_on; its own bytes and its own counters."""

    def __init__(self):
        self.statuses = []  # (time, counts), in the order in which they came

    async def __call__(self, satellite, event, frame, wanted_by, errors):
        self.satellite, self.told = satellite, 0
        hold = self.order(1, HOLD, 3600.0)
        await self.until_told(hold, 1, DONE)
        satellite.send(self.order(2, HOME, -7200.0))  # it lay about for hours
        satellite.send(self.order(9, HOME, 3600.0, key=bytes(32)))  # a stranger's
        satellite.send(hold[:-1] + bytes([hold[-1] ^ 1]))  # damaged
        satellite.send(by_the_page.write("The status", KEY, 1, minute=1))  # its own voice, played back
        await self.until_told(self.order(2, HOME, -7200.0), 2, EXPIRED)
        await asyncio.sleep(max(0.0, 600.0 - now_s()))  # she was killed, and lives again
        satellite.send(hold)
        await self.until_told(self.order(3, GO_ON, 3600.0), 3, DONE)
        satellite.send(hold)  # the hold once more, behind the go_on

    def order(self, counter, verb, left_s, key=KEY):
        expires = int((self.satellite.epoch_s + now_s() + left_s - YEAR_2020_S) // 60) + 1
        return by_the_page.write("The order", key, 1, verb=verb, counter=counter, expires=expires)

    async def until_told(self, data, counter, reply):
        """Send the same bytes again and again until a status tells the counter."""
        for _ in range(20):
            self.satellite.send(data)
            for _ in range(15):
                await asyncio.sleep(20.0)
                for at_s, heard in self.satellite.heard[self.told :]:
                    self.statuses.append((at_s, by_the_page.read("The status", heard, KEY)))
                self.told = len(self.satellite.heard)
                if any((c["order"], c["reply"] & 0xF) == (counter, reply) for _, c in self.statuses):
                    return
        raise AssertionError(f"order {counter} was never answered with {reply}")


def test_a_voyage_by_satellite_each_order_once_the_late_one_never_and_over_a_kill(tmp_path, monkeypatch):
    shore = Shore()
    monkeypatch.setattr(injection, "order_far", shore)
    (tmp_path / "m.toml").write_text(Path("missions/buoy-course.toml").read_text().replace("laps = 5", "laps = 1"))
    scenario = msgspec.structs.replace(
        load_scenario(SOURCE),
        mission="m.toml",
        limit_s=4000.0,
        satellite=SatelliteSpec(delay_s=10.0, delay_most_s=120.0, loss=0.3, duplicate=0.5, status_every_s=300.0),
        events=(
            EventSpec(at_s=20.0, kind="far_order"),
            EventSpec(at_s=500.0, kind="kill_companion", restart_after_s=5.0),
        ),
        expect=ExpectSpec(alerts=("order",), marks_rounded=3, held=HeldSpec(from_s=200.0, to_s=600.0, within_m=35.0)),
    )
    verdict = run_virtual(run_embedded(scenario, tmp_path / "s.toml", 1, tmp_path))
    assert verdict.passed, failed(verdict)
    decisions = list(read_jsonl(tmp_path / "decisions.jsonl"))
    carried_out = [d["order"]["verb"] for d in decisions if d["kind"] == "order"]
    assert carried_out == ["hold", "go_on"], "each once, and nothing of what had expired or was forged"
    refused = [d["text"] for d in decisions if d["kind"] == "far" and "its code is wrong" in d["text"]]
    assert refused
    assert any("nothing is done twice" in d["text"] for d in decisions if d["kind"] == "far")
    standing = {c["flags"] >> 4 for _, c in shore.statuses}
    assert standing == {0, HOLD}, "what stands is told, and that it does no more"
    assert json.loads((tmp_path / "far" / "taken.json").read_text())["replies"].keys() == {"1", "2", "3"}
    assert shore.satellite.lost > 0
    assert not replay(tmp_path).differences


@pytest.mark.campaign
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("seed", range(3))
def test_an_order_that_comes_two_hours_late_counts_for_nothing(tmp_path, seed):
    verdict = run_virtual(run_embedded(load_scenario(SOURCE), SOURCE, seed, tmp_path))
    assert verdict.passed, failed(verdict)
    orders = [d["order"]["verb"] for d in read_jsonl(tmp_path / "decisions.jsonl") if d["kind"] == "order"]
    assert orders == ["hold", "go_on"]
    assert not replay(tmp_path).differences


def test_what_the_mission_does_not_permit_is_refused_and_told(tmp_path):
    scenario = msgspec.structs.replace(
        load_scenario(SOURCE),
        mission="../missions/open-water.toml",
        limit_s=120.0,
        exit_on_arrival=False,
        satellite=SatelliteSpec(delay_s=1.0, delay_most_s=5.0),
        events=(EventSpec(at_s=20.0, kind="far_order", order="hold", answer="refused"),),
        expect=ExpectSpec(arrived=None),
    )
    verdict = run_virtual(run_embedded(scenario, SOURCE, 0, tmp_path))
    assert verdict.passed, failed(verdict)
    said = [d["text"] for d in read_jsonl(tmp_path / "decisions.jsonl") if d.get("code") == "order"]
    assert said == ["order hold: not permitted: the mission's [operator] far_orders permits none"]


class HighLatencyStation(Station):
    """Asks the companion for HIGH_LATENCY2, and lets it be."""

    async def talk(self, transport):
        beat = wire.MAVLink_heartbeat_message(wire.MAV_TYPE_GCS, wire.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
        await self.send(transport, beat, 10.0)
        assert not self.of("HIGH_LATENCY2")
        for param, wait_s in ((1.0, 21.0), (0.0, 11.0), (3.0, 1.0)):
            command = wire.MAVLink_command_long_message(
                1, 191, wire.MAV_CMD_CONTROL_HIGH_LATENCY, 0, param, 0, 0, 0, 0, 0, 0
            )
            await self.send(transport, command, wait_s)


def test_high_latency_is_spoken_while_it_is_asked_for(tmp_path, monkeypatch):
    station = HighLatencyStation()
    monkeypatch.setattr(injection, "give_order", station)
    path = Path("sitl/scenarios/upwind.toml")
    scenario = msgspec.structs.replace(
        load_scenario(path),
        events=(EventSpec(at_s=60.0, kind="order"),),
        limit_s=110.0,
        expect=ExpectSpec(arrived=None, within_m=None),
    )
    verdict = run_virtual(run_embedded(scenario, path, 0, tmp_path))
    assert verdict.passed, failed(verdict)
    heard = station.of("HIGH_LATENCY2")
    assert 4 <= len(heard) <= 5, "every 5 s for 21 s, through the autopilot, and then no more"
    assert {(m.custom_mode, m.autopilot, m.custom0 & 0xFF) for m in heard} == {(10, 3, 129)}
    assert [(a.command, a.result) for a in station.of("COMMAND_ACK")] == [(2600, 0), (2600, 0), (2600, 2)]
