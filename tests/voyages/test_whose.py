"""Whose boat, whole: neighbours on the channel, another board under way, impossible parameters, a second companion."""

from __future__ import annotations

import asyncio
import json
import math
from dataclasses import replace

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.app.options import SailOptions, at_once
from companion.app.sail import sail
from companion.clock import now_s, run_virtual
from companion.errors import LinkError
from companion.geofence import load_mission
from companion.mavlink.wire.frames import Codec
from companion.messages import Mode
from companion.replay import replay
from companion.skipper.step.saved import Persisted
from sitl.autopilot import AutopilotConfig, MemoryLink, RadioChannel, SimulatedAutopilot, serve
from sitl.faults.computer_faults import FaultyPlanner
from sitl.world.environment import AR1

MISSION = """
name = "reach"
[start]
lat = 50.8
lon = -1.31
heading_deg = 90.0
[[goal]]
lat = 50.8
lon = -1.3075
radius_m = 20.0
[area]
margin_m = 12.0
[skipper]
expansions = 2000
[operator]
arm = true
set_auto = true
"""
ORDERS = {"UploadMission", "SetMode", "Arm", "SetCurrent", "SteerHeading"}


class World:
    """Boats on one channel and a companion; ``boats`` by system id."""

    def __init__(self, tmp_path, **systems):
        (tmp_path / "mission.toml").write_text(MISSION)
        self.folder = tmp_path / "voyage"
        self.mission = load_mission(tmp_path / "mission.toml")
        configs = systems or {"ours": {}}
        self.boats, self.lines = {}, {}
        for name, change in configs.items():
            config = AutopilotConfig(
                **{
                    "home": self.mission.start,
                    "heading_rad": math.pi / 2,
                    "is_warm": True,
                    "is_moored": True,
                    "uid": name.encode(),
                    **change,
                }
            )
            self.boats[name] = SimulatedAutopilot(config, AR1(0.0, 6.0, seed=1, sd_rad=0.05), seed=1)
            self.lines[name] = MemoryLink(name, seed=1)
        self.air = RadioChannel(*(line.near for line in self.lines.values()))
        self.steps = []

    async def sail(self, *, air=None, folder=None, on_step=None, **options):
        def look(_, step):
            self.steps.append(step)
            if on_step is not None:
                on_step(step)

        settings = {"epoch_s": 1.78e9, "offload": at_once, "is_durable": False, "limit_s": 400.0, "expansions": 2000}
        return await sail(
            self.mission,
            air or self.air,
            FaultyPlanner(),
            folder or self.folder,
            SailOptions(**settings | options),
            on_status=look,
        )

    def run(self, work=None, **options):
        async def whole():
            async with _served(self):
                return await (self.sail(**options) if work is None else work())

        return run_virtual(whole())

    def decisions(self, folder=None):
        lines = ((folder or self.folder) / "decisions.jsonl").read_text().splitlines()
        return [json.loads(line) for line in lines]

    def codes(self):
        return [d["code"] for d in self.decisions() if d.get("action") == "Announce"]

    def is_untouched(self, name):
        boat = self.boats[name]
        return not boat.truth.is_armed and boat.truth.mode is not Mode.AUTO and len(boat.pilot.helm.mission.items) <= 1


def _served(world):
    from contextlib import AsyncExitStack, asynccontextmanager

    @asynccontextmanager
    async def all_of():
        async with AsyncExitStack() as stack:
            for name, boat in world.boats.items():
                await stack.enter_async_context(serve(boat, [world.lines[name].far]))
            yield

    return all_of()


# ------------------------------------------------------------------------------------------- neighbours
def test_two_boats_on_the_channel_are_listed_and_neither_is_touched(tmp_path):
    world = World(tmp_path, theirs={"sysid": 7}, ours={"sysid": 1})
    with pytest.raises(LinkError, match=r"2 autopilots are heard: system 1 \(surface boat.*system 7 .*--system N"):
        world.run()
    assert world.is_untouched("theirs")
    assert world.is_untouched("ours")


@pytest.mark.parametrize("named", [1, 7])
def test_the_one_that_the_mission_names_is_sailed_and_the_other_left_alone(tmp_path, named):
    world = World(tmp_path, theirs={"sysid": 7}, ours={"sysid": 1})
    world.mission = world.mission.with_system(named)
    world.run(limit_s=60.0)
    sailed, left = ("ours", "theirs") if named == 1 else ("theirs", "ours")
    assert world.boats[sailed].truth.is_armed
    assert world.is_untouched(left)
    assert not replay(world.folder, tmp_path / "mission.toml").differences


def test_a_state_of_another_voyage_names_no_boat(tmp_path):
    """Of two boats on the channel the one that another mission had sailed was taken, unasked."""
    world = World(tmp_path, theirs={"sysid": 7}, ours={"sysid": 1})
    saved = Persisted(voyage="another", gate=0, sailing=True, route=None, pending=None, system=7)
    (tmp_path / "state.json").write_text(json.dumps(saved.to_dict()))
    with pytest.raises(LinkError, match="2 autopilots are heard"):
        world.run(limit_s=60.0, state_path=tmp_path / "state.json")
    assert world.is_untouched("theirs")


def test_a_neighbour_heard_first_is_not_sailed_once_ours_speaks_too(tmp_path):
    world = World(tmp_path, theirs={"sysid": 7}, ours={"sysid": 1})
    world.lines["ours"].cut()

    async def work():
        asyncio.get_running_loop().call_later(15.0, world.lines["ours"].mend)
        return await world.sail(limit_s=60.0)

    world.run(work)
    assert world.is_untouched("theirs")
    assert world.is_untouched("ours")
    assert "other autopilots are heard (system 1, surface boat)" in world.steps[-1].state.why
    assert not replay(world.folder).differences


@pytest.mark.parametrize("vehicle_type", [wire.MAV_TYPE_QUADROTOR, wire.MAV_TYPE_SUBMARINE])
def test_what_is_no_rover_is_not_sailed(tmp_path, vehicle_type):
    world = World(tmp_path, theirs={"vehicle_type": vehicle_type})
    with pytest.raises(LinkError, match="is not a rover"):
        world.run()
    assert world.is_untouched("theirs")


def test_a_rover_without_sails_is_not_sailed_and_the_remedy_is_said(tmp_path):
    world = World(tmp_path, motor={"parameters": {"SAIL_ENABLE": 0.0}})
    world.run(limit_s=90.0)
    assert world.is_untouched("motor")
    assert 'write frame = "motor" in [autopilot]' in world.steps[-1].state.why


# ------------------------------------------------------------------------------------------- identity
def test_another_board_under_way_stops_all_orders_until_ours_is_back(tmp_path):
    world = World(tmp_path)
    boat = world.boats["ours"]
    ours, changed_s, back_s = boat.core.config, [], []

    def exchange(step):
        if step.state.voyage.sailing and not changed_s and step.snapshot.t_s - world.steps[0].snapshot.t_s > 50.0:
            boat.core.config = replace(ours, uid=b"another")
            boat.reboot()
            changed_s.append(step.snapshot.t_s)
        elif changed_s and not back_s and step.snapshot.t_s - changed_s[0] > 90.0:
            boat.core.config = ours
            boat.reboot()
            back_s.append(step.snapshot.t_s)

    assert world.run(on_step=exchange)["arrived"]
    stopped = [d for d in world.decisions() if d.get("action") == "StopOrders"]
    assert stopped
    assert 0.0 <= stopped[0]["t_s"] - changed_s[0] <= 10.0
    away = [d for d in world.decisions() if d.get("action") in ORDERS and changed_s[0] < d["t_s"] < back_s[0]]
    assert not away
    said = [d["text"] for d in world.decisions() if d.get("code") == "not ours"]
    assert f"UID {b'another'.hex()}, not {b'ours'.hex()}" in said[0]
    assert not replay(world.folder).differences


def test_the_board_is_asked_for_after_a_gap(tmp_path):
    world = World(tmp_path)
    line = world.lines["ours"]
    seen = []

    def cut(step):
        if step.state.voyage.sailing and not seen:
            line.cut()
            asyncio.get_running_loop().call_later(8.0, line.mend)
        if step.state.voyage.sailing:
            seen.append((step.snapshot.t_s, step.snapshot.identity.is_confirmed))

    world.run(on_step=cut, limit_s=80.0)
    assert not all(confirmed for _, confirmed in seen), "in doubt after the gap"
    assert seen[-1][1]
    assert not replay(world.folder).differences


# ------------------------------------------------------------------------------------------- parameters
def test_an_impossible_parameter_is_said_once_and_the_default_sails(tmp_path):
    world = World(tmp_path, ours={"parameters": {"SAIL_NO_GO_ANGLE": 90.0}})
    world.run(limit_s=60.0)
    assert world.boats["ours"].truth.is_armed
    assert world.codes().count("SAIL_NO_GO_ANGLE") == 1
    limits = world.steps[-1].snapshot.limits
    assert limits is not None
    assert math.isclose(limits.sail_no_go_angle_rad, math.radians(45.0))


def test_a_parameter_of_another_component_is_none(tmp_path):
    world = World(tmp_path)
    gimbal = Codec(1, 154)

    def speak(step):
        for value in (90.0, 80.0, 80.0):
            world.air.say(gimbal.pack(wire.MAVLink_param_value_message(b"SAIL_NO_GO_ANGLE", value, 9, 900, 65535)))

    world.run(on_step=speak, limit_s=60.0)
    assert math.isclose(world.steps[-1].snapshot.limits.sail_no_go_angle_rad, math.radians(45.0))
    assert "SAIL_NO_GO_ANGLE" not in world.codes()


# ------------------------------------------------------------------------------------- a second companion
def test_a_second_companion_gives_way_to_the_one_that_sails(tmp_path):
    """On another port of the same autopilot, which forwards what each of them says."""
    world = World(tmp_path)
    second = MemoryLink("second", seed=2)
    boat = world.boats["ours"]

    async def work():
        async with serve(boat, [world.lines["ours"].far, second.far]):
            first = asyncio.create_task(world.sail(token=9))
            await asyncio.sleep(30.0)
            with pytest.raises(LinkError, match="another companion is at work on this boat"):
                await world.sail(air=second.near, folder=tmp_path / "second", token=5)
            return await first

    assert run_virtual(work())["arrived"]
    orders = [d for d in world.decisions(tmp_path / "second") if d.get("action") in ORDERS]
    assert not orders


def test_of_two_that_start_together_one_sails(tmp_path):
    world = World(tmp_path)
    second = MemoryLink("second", seed=2)

    async def work():
        async with serve(world.boats["ours"], [world.lines["ours"].far, second.far]):
            runs = [
                asyncio.create_task(world.sail(token=9)),
                asyncio.create_task(world.sail(air=second.near, folder=tmp_path / "second", token=5)),
            ]
            return await asyncio.gather(*runs, return_exceptions=True)

    refused, sailed = run_virtual(work())
    assert isinstance(refused, LinkError)
    assert sailed["arrived"]


class Echo(RadioChannel):
    """A router that sends back what it was sent."""

    def write(self, data):
        super().write(data)
        asyncio.get_running_loop().call_later(0.3, self.say, data)


def test_an_echo_of_our_own_frames_is_no_second_companion(tmp_path):
    world = World(tmp_path)
    world.air = Echo(world.lines["ours"].near)
    world.run(limit_s=60.0)
    assert world.boats["ours"].truth.is_armed
    assert "second companion" not in world.codes()
    assert not replay(world.folder).differences


def test_a_companion_of_another_kind_under_way_is_said_and_sailed_on(tmp_path):
    world = World(tmp_path)
    stranger = Codec(1, 191)

    def speak(step):
        if step.state.voyage.sailing:
            world.air.say(stranger.pack(wire.MAVLink_heartbeat_message(18, 8, 0, 0, 4, 3)))

    world.run(on_step=speak, limit_s=80.0)
    assert world.boats["ours"].truth.is_armed
    minutes = (world.steps[-1].snapshot.t_s - world.steps[0].snapshot.t_s) / 60.0
    assert 1 <= world.codes().count("second companion") <= 1 + minutes
    assert not replay(world.folder).differences


# ---------------------------------------------------------------------------------- forged and recorded
def test_a_change_of_mode_is_noticed_within_two_seconds_and_a_forged_one_not_at_all(tmp_path):
    world = World(tmp_path)
    boat, forged, changed_s, noticed_s = world.boats["ours"], Codec(1, 1), [], []

    def look(step):
        if not step.state.voyage.sailing:
            return
        world.air.say(forged.pack(wire.MAVLink_heartbeat_message(11, 3, 0x80, 4, 4, 3)))
        if not changed_s and len([s for s in world.steps if s.state.voyage.sailing]) == 20:
            boat.set_mode(Mode.HOLD)
            changed_s.append(now_s())
        if step.snapshot.autopilot.mode is Mode.HOLD:
            noticed_s.append(now_s())

    world.run(on_step=look, limit_s=90.0)
    assert changed_s
    assert 0.0 <= noticed_s[0] - changed_s[0] <= 3.0, "two seconds, and the step that looks"
    assert not replay(world.folder).differences
