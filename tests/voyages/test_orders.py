"""Orders over real MAVLink to a voyage on the simulated autopilot: by another's client, over restarts, refused."""

import asyncio
import json
from pathlib import Path

import msgspec
import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.clock import run_virtual
from companion.replay import replay
from companion.telemetry.folder.recorder import read_jsonl
from sitl.faults import injection
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, HeldSpec, load_scenario
from tests.voyages.test_disk_trouble import Shore

HOLD = Path("sitl/scenarios/orders-hold.toml")
PARKED = {"arrived": None, "within_m": None, "alerts": ("order",)}


def sail(out, events, observer=None, **changes):
    scenario = msgspec.structs.replace(load_scenario(HOLD), events=tuple(events), **changes)
    return run_virtual(run_embedded(scenario, HOLD, 0, out, observer=observer))


def failed(verdict):
    return [(c.name, c.figure, c.required) for c in verdict.checks if not c.passed]


def order(at_s, words, answer="done"):
    return EventSpec(at_s=at_s, kind="order", order=words, answer=answer)


class Station:
    """A ground station of another make: pymavlink alone, 255/190, over the autopilot's second link."""

    def __init__(self):
        self.mav = wire.MAVLink(None, srcSystem=255, srcComponent=190)
        self.mav.robust_parsing = True
        self.heard = []

    async def __call__(self, transport, event, frame):
        await transport.open(lambda data: self.heard.extend(self.mav.parse_buffer(data) or []))
        try:
            await self.talk(transport)
        finally:
            await transport.close()
        return ""

    async def talk(self, transport):
        beat = wire.MAVLink_heartbeat_message(wire.MAV_TYPE_GCS, wire.MAV_AUTOPILOT_INVALID, 0, 0, 0, 3)
        await self.send(transport, beat, 1.0)
        for confirmation in (0, 1):  # the second as if the first answer had been lost
            await self.send(transport, self.long(191, 1, confirmation), 1.5)
        for component in (190, 1, 0):
            await self.send(transport, self.long(component, 8), 1.5)
        await self.send(transport, self.long(191, 99), 1.5)
        await self.send(transport, self.long(191, 0, command=wire.MAV_CMD_DO_SET_MODE), 1.5)
        await self.send(
            transport,
            wire.MAVLink_command_int_message(
                1, 191, wire.MAV_FRAME_GLOBAL, wire.MAV_CMD_USER_2, 0, 0, 0, 0, 0, 0, 0, 0, 0
            ),
            1.5,
        )

    @staticmethod
    def long(component, verb, confirmation=0, command=wire.MAV_CMD_USER_1):
        return wire.MAVLink_command_long_message(1, component, command, confirmation, verb, 0, 0, 0, 0, 0, 0)

    async def send(self, transport, message, wait_s):
        transport.write(message.pack(self.mav))
        self.mav.seq = (self.mav.seq + 1) % 256
        await asyncio.sleep(wait_s)

    def of(self, kind, component=191):
        return [m for m in self.heard if m.get_type() == kind and m.get_srcComponent() == component]


def test_a_station_that_knows_pymavlink_alone_is_answered(tmp_path, monkeypatch):
    station = Station()
    monkeypatch.setattr(injection, "give_order", station)
    verdict = sail(
        tmp_path,
        [EventSpec(at_s=60.0, kind="order")],
        limit_s=100.0,
        exit_on_arrival=False,
        expect=ExpectSpec(**PARKED),
    )
    assert verdict.passed, failed(verdict)
    acks = [(a.command, a.result) for a in station.of("COMMAND_ACK")]
    assert acks == [(31010, 0), (31010, 0), (31010, 3), (176, 3), (31011, 2)]
    assert {(a.target_system, a.target_component) for a in station.of("COMMAND_ACK")} == {(255, 190)}
    autopilots = [(a.command, a.result) for a in station.of("COMMAND_ACK", component=1)]
    assert autopilots.count((31010, wire.MAV_RESULT_UNSUPPORTED)) >= 1, "what names the autopilot is the autopilot's"
    said = [t.text for t in station.of("STATUSTEXT") if t.text.startswith("order ") and t.chunk_seq == 0]
    assert [text.split(":")[0] for text in said] == ["order hold", "order hold", "order unknown", "order goal"]
    uploads = [d for d in read_jsonl(tmp_path / "decisions.jsonl") if d.get("action") == "UploadMission"]
    assert len(uploads) == 2, "the first plan, and one loiter for the order and its repetition"
    assert not replay(tmp_path).differences


@pytest.mark.parametrize("saved", ["kept", "torn"])
def test_killed_while_she_holds_she_holds_on_and_goes_on_when_told(tmp_path, saved):
    """With the state torn the order is gone, and the mission on board holds her all the same until it is planned on."""
    events = [order(40.0, "hold"), EventSpec(at_s=100.0, kind="kill_companion", restart_after_s=3.0, saved=saved)]
    if saved == "kept":
        events.append(order(150.0, "go_on"))
        expect = ExpectSpec(alerts=("order",), within_m=40.0, held=HeldSpec(from_s=70.0, to_s=150.0, within_m=35.0))
    else:
        expect = ExpectSpec(alerts=("order",), within_m=40.0, held=HeldSpec(from_s=70.0, to_s=103.0, within_m=35.0))
    shore = Shore()
    verdict = sail(tmp_path, events, shore, expect=expect, limit_s=400.0)
    assert verdict.passed, failed(verdict)
    assert not replay(tmp_path).differences
    if saved == "kept":
        told = [d["text"] for d in read_jsonl(tmp_path / "decisions.jsonl") if d.get("code") == "order"]
        assert any(text.startswith("since before this start she is under an order: hold") for text in told)
        assert "since before this start she is under an order: hold" in shore.said  # before the autopilot was found


def test_the_state_says_what_she_was_told(tmp_path):
    sail(tmp_path, [order(40.0, "hold")], limit_s=120.0, exit_on_arrival=False, expect=ExpectSpec(**PARKED))
    standing = json.loads((tmp_path / "state.json").read_text())["standing"]
    assert (standing["verb"], standing["by"]) == ("hold", "somebody ashore")
    summary = json.loads((tmp_path / "summary.json").read_text())
    assert summary["end_phase"] == "holding"


def test_what_the_mission_does_not_permit_is_refused_and_she_sails_on(tmp_path):
    mission = Path("sitl/missions/open-water.toml").read_text().replace('orders = "all"\n', "")
    (tmp_path / "m.toml").write_text(mission)
    scenario = msgspec.structs.replace(
        load_scenario(HOLD),
        mission="m.toml",
        limit_s=300.0,
        expect=ExpectSpec(alerts=("order",), within_m=40.0),
        events=(order(20.0, "hold", "refused"), order(40.0, "stop", "refused"), order(60.0, "why")),
    )
    verdict = run_virtual(run_embedded(scenario, tmp_path / "s.toml", 0, tmp_path / "v"))
    assert verdict.passed, failed(verdict)


def test_given_up_she_sails_to_the_end_of_what_is_on_board_and_on_when_told(tmp_path):
    verdict = sail(
        tmp_path,
        [order(30.0, "stop"), order(60.0, "hold", "not now"), order(90.0, "go_on")],
        expect=ExpectSpec(alerts=("order",), within_m=40.0),
        limit_s=400.0,
    )
    assert verdict.passed, failed(verdict)
    asked = {
        d["t_s"]
        for d in read_jsonl(tmp_path / "decisions.jsonl")
        if d.get("action") in {"UploadMission", "SetMode", "SetCurrent", "RequestPlan", "Arm"}
    }
    assert not [t_s for t_s in asked if 34.0 <= t_s <= 89.0]
