"""Streams, routing, set-points, fence, AIS, failsafes, faults, reboot, determinism and noise."""

from __future__ import annotations

import asyncio
import hashlib
import math
import random
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.clock import now_s, run_virtual
from companion.messages import GeoPoint, Mode
from sitl.autopilot import (
    FORCED_REBOOT,
    AisVessel,
    AutopilotConfig,
    GpsFault,
    Impairment,
    MemoryLink,
    SimulatedAutopilot,
    VaneFault,
    VaneState,
    serve,
)
from sitl.world.environment import AR1, Constant
from tests.sitl.boats import Client, e7, sail

EAST = [(100.0 * n, 0.0) for n in range(1, 7)]


# ------------------------------------------------------------------------------------------------------ streams
@pytest.mark.parametrize("hertz", [5, 10, 20, 25, 40])
def test_message_rates_are_exact(hertz: int) -> None:
    async def job(c: Client) -> None:
        c.rate(mav.MAVLINK_MSG_ID_WIND, hertz)
        await asyncio.sleep(1.0)
        start = len(c.heard)
        await asyncio.sleep(10.0)
        names = [m.get_type() for _, m in c.heard[start:]]
        assert names.count("WIND") == pytest.approx(10 * hertz, abs=1)
        assert names.count("NAMED_VALUE_FLOAT") == 2 * names.count("WIND")
        assert names.count("ATTITUDE") == pytest.approx(10, abs=1)

    sail(job)


def test_rates_that_are_refused() -> None:
    async def job(c: Client) -> None:
        assert await c.ask(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 168, 20_000) == 2
        long = [m for m in c.of("STATUSTEXT") if m.id]
        assert [m.chunk_seq for m in long] == [0, 1]
        assert "".join(m.text for m in long) == ("Requested rate for message ID 168 too fast. Increase SCHED_LOOP_RATE")
        assert await c.ask(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 251, 100_000) == 2
        assert c.texts()[-1] == "No ap_message for mavlink id (251)"
        assert await c.ask(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 231, 100_000) == 2
        assert await c.ask(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 168, 500_000) == 0
        assert await c.ask(mav.MAV_CMD_GET_MESSAGE_INTERVAL, 168) == 0
        assert c.last("MESSAGE_INTERVAL").interval_us == 500_000
        assert await c.ask(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 168, -1) == 0
        start = now_s()
        await asyncio.sleep(3.0)
        assert not c.of("WIND", start + 0.1)
        # the old request for everything overrides what was asked for before
        c.send(mav.MAVLink_request_data_stream_message(1, 1, 0, 4, 1))
        await asyncio.sleep(5.0)
        assert len(c.of("WIND", start + 3.2)) == pytest.approx(19, abs=2)

    sail(job)


def test_parameters() -> None:
    async def job(c: Client) -> None:
        c.send(mav.MAVLink_param_request_list_message(1, 1))
        await asyncio.sleep(1.0)
        values = c.of("PARAM_VALUE")
        assert [m.param_index for m in values] == list(range(values[0].param_count))
        by_name = {m.param_id: (m.param_value, m.param_type) for m in values}
        assert by_name["SAIL_NO_GO_ANGLE"] == (45.0, 9)
        assert by_name["SAIL_XTRACK_MAX"] == (10.0, 9)
        assert by_name["FENCE_TYPE"] == (6.0, 2)
        assert by_name["SYSID_MYGCS"] == (255.0, 4)
        start = now_s()
        c.send(mav.MAVLink_param_set_message(1, 1, b"SAIL_XTRACK_MAX", 30.0, 9))
        answer = await c.wait("PARAM_VALUE", 1.0)
        assert (answer.param_id, answer.param_value, answer.param_index) == ("SAIL_XTRACK_MAX", 30.0, 65535)
        assert now_s() - start <= 0.021
        c.send(mav.MAVLink_param_request_read_message(1, 1, b"NO_SUCH_PARAM", -1))
        c.send(mav.MAVLink_param_set_message(1, 1, b"NO_SUCH_PARAM", 1.0, 9))
        c.send(mav.MAVLink_param_set_message(1, 1, b"SAIL_XTRACK_MAX", math.nan, 9))
        await asyncio.sleep(1.0)
        assert [m.param_id for m in c.of("PARAM_VALUE", start + 0.1)] in ([], ["SAIL_XTRACK_MAX"])
        assert c.autopilot.core.parameters.get("SAIL_XTRACK_MAX") == 30.0

    sail(job)


def test_new_names_of_4_7() -> None:
    autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True, new_parameter_names=True), Constant(0.0, 5.0), 0)
    assert autopilot.core.parameters.entry("SYSID_MYGCS") is None
    assert autopilot.core.parameters.entry("MAV_GCS_SYSID")[1] == 255.0
    assert autopilot.core.parameters.set("MAV_GCS_SYSID", 250.0)
    assert autopilot.core.parameters.flag("SYSID_MYGCS") == 250


# ------------------------------------------------------------------------------------------------------ routing
def two_ports(job: Any) -> Any:
    async def main() -> Any:
        autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), 1)
        links = [MemoryLink(f"port {n}", seed=n) for n in range(2)]
        companion = Client(links[0].near.write, autopilot)
        shore = Client(links[1].near.write, autopilot, component=190, system=255)
        for client, link in zip((companion, shore), links, strict=True):
            await link.near.open(client.on_bytes)
        async with serve(autopilot, [link.far for link in links]):
            await job(companion, shore)

    return run_virtual(main())


def beat(client: Client, kind: int) -> None:
    client.send(mav.MAVLink_heartbeat_message(kind, 8, 0, 0, 4, 3))


def test_routing_between_ports() -> None:
    async def job(companion: Client, shore: Client) -> None:
        def foreign(client: Client, name: str) -> list[tuple[int, int]]:
            return [(m.get_srcSystem(), m.get_srcComponent()) for m in client.of(name) if m.get_srcComponent() != 1]

        beat(companion, 18)
        companion.send(mav.MAVLink_statustext_message(6, b"before anybody was heard there", 0, 0))
        await asyncio.sleep(1.0)
        assert foreign(shore, "HEARTBEAT") == foreign(shore, "STATUSTEXT") == []
        beat(shore, 6)
        await asyncio.sleep(0.1)
        assert foreign(companion, "HEARTBEAT") == [(255, 190)]
        beat(companion, 18)
        companion.send(mav.MAVLink_statustext_message(6, b"hello", 0, 0))
        companion.send(mav.MAVLink_named_value_float_message(1, b"plan", 1.0))
        companion.send(mav.MAVLink_wind_cov_message(0, 1.0, 2.0, 0.0, 0.1, 0.1, 0.0, 0.0, 0.0))
        await asyncio.sleep(0.1)
        for name in ("HEARTBEAT", "STATUSTEXT", "NAMED_VALUE_FLOAT", "WIND_COV"):
            assert foreign(shore, name) == [(1, 191)]
        # a command for the companion is not the autopilot's, one for the whole system is both's
        for target, acks in ((191, 0), (0, 1), (1, 1)):
            start, seen = now_s(), len(companion.of("COMMAND_LONG"))
            shore.send(mav.MAVLink_command_long_message(1, target, 512, 0, 148, 0, 0, 0, 0, 0, 0))
            await asyncio.sleep(0.2)
            assert len(shore.of("COMMAND_ACK", start)) == acks
            assert len(companion.of("COMMAND_LONG")) - seen == (0 if target == 1 else 1)
        companion.send(mav.MAVLink_command_ack_message(512, 0, 0, 0, 255, 190))
        await asyncio.sleep(0.1)
        assert (1, 191) in [(m.get_srcSystem(), m.get_srcComponent()) for m in shore.of("COMMAND_ACK")]

    two_ports(job)


def test_named_floats_flood_every_port_that_was_heard() -> None:
    async def job(companion: Client, shore: Client) -> None:
        companion.rate(168, 10)
        beat(shore, 6)
        await asyncio.sleep(1.0)
        start = now_s()
        await asyncio.sleep(5.0)
        for client in (companion, shore):
            assert len(client.of("NAMED_VALUE_FLOAT", start)) / 5.0 == pytest.approx(22, abs=1)
        assert len(shore.of("WIND", start)) == pytest.approx(5, abs=1)

    two_ports(job)


# ---------------------------------------------------------------------------------------------- modes and tacks
def test_commanded_tack() -> None:
    async def job(c: Client) -> None:
        await c.set_sail([(0.0, 400.0)])
        await asyncio.sleep(10.0)
        assert c.autopilot.truth.tacks == 0
        assert await c.ask(mav.MAV_CMD_DO_AUX_FUNCTION, 63, 2) == 0
        await asyncio.sleep(8.0)
        assert c.autopilot.truth.tacks == 1
        assert await c.ask(mav.MAV_CMD_DO_AUX_FUNCTION, 63, 2) == 0
        await asyncio.sleep(2.0)
        assert c.autopilot.truth.tacks == 2

    sail(job, is_moored=True, heading_deg=45.0, SAIL_XTRACK_MAX=0.0)


def test_tack_request_on_a_reach_does_nothing() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(10.0)
        await c.ask(mav.MAV_CMD_DO_AUX_FUNCTION, 63, 2)
        await asyncio.sleep(10.0)
        assert c.autopilot.truth.tacks == 0

    sail(job, is_moored=True)


@pytest.mark.parametrize("has_motor", [True, False])
def test_the_auxiliary_motor_holds_her_in_a_current_and_is_acknowledged_without_one(has_motor: bool) -> None:
    """As measured on the real one: 0.04 m/s in LOITER with it, 0.25 m/s without, 0 in reply to both."""

    async def job(c: Client) -> None:
        async def drifts_m() -> float:
            before = c.autopilot.truth
            await asyncio.sleep(60.0)
            after = c.autopilot.truth
            return math.hypot(after.east_m - before.east_m, after.north_m - before.north_m)

        await c.set_sail(EAST)
        c.autopilot.set_current(math.pi / 2.0, 0.5)
        c.autopilot.set_mode(Mode.HOLD)
        assert await c.ask(mav.MAV_CMD_DO_AUX_FUNCTION, 74, 2) == 0
        c.autopilot.set_mode(Mode.LOITER)
        await asyncio.sleep(20.0)
        assert (await drifts_m() < 8.0) == has_motor
        assert await c.ask(mav.MAV_CMD_DO_AUX_FUNCTION, 74, 1) == 0
        c.autopilot.set_mode(Mode.HOLD)
        assert await drifts_m() > 8.0

    # the air goes with the water: nothing to sail by
    sail(job, is_moored=True, has_motor=has_motor, wind=Constant(1.5 * math.pi, 0.5))


def test_an_anchor_holds_at_once_and_is_weighed() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(10.0)
        c.autopilot.core.vehicle.anchor(down=True)
        await asyncio.sleep(1.0)
        there = c.autopilot.truth
        await asyncio.sleep(20.0)
        assert c.autopilot.truth.position == there.position
        assert c.autopilot.truth.speed_mps == 0.0
        c.autopilot.core.vehicle.anchor(down=False)
        await asyncio.sleep(20.0)
        assert c.autopilot.truth.position != there.position

    sail(job, is_moored=True)


def test_reposition_and_velocity_setpoints() -> None:
    async def job(c: Client) -> None:
        await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
        lat, lon = e7(80.0, 0.0)
        c.send(mav.MAVLink_command_int_message(1, 1, 0, 192, 0, 0, -1, 1, 0, math.nan, lat, lon, 0))
        assert (await c.wait("COMMAND_ACK", 1.0)).result == 0
        await c.wait("MISSION_ITEM_REACHED", 60.0)
        start = now_s()
        for _ in range(20):
            c.send(
                mav.MAVLink_set_position_target_local_ned_message(
                    0, 1, 1, 1, 0b110111000111, 0, 0, 0, -2.0, 2.0, 0, 0, 0, 0, 0, 0
                )
            )
            await asyncio.sleep(0.5)
        assert math.degrees(c.autopilot.truth.heading_rad) == pytest.approx(135.0, abs=2.0)
        await asyncio.sleep(4.0)
        assert c.texts(start).count("target not received last 3secs, stopping") == 1

    sail(job, is_moored=True)


def test_rtl_goes_home_or_to_a_rally_point() -> None:
    async def job(c: Client) -> None:
        assert await c.upload([{"en": (60.0, -40.0), "command": 5100}], kind=2) == 0
        await c.set_sail(EAST)
        await asyncio.sleep(30.0)
        assert await c.ask(mav.MAV_CMD_DO_SET_MODE, 1, 11) == 0
        await c.wait("STATUSTEXT", 100.0, lambda m: m.text == "Reached destination")
        here = c.autopilot.truth
        assert math.dist((here.east_m, here.north_m), (60.0, -40.0)) < 5.0

    sail(job, is_moored=True)


# -------------------------------------------------------------------------------------------------------- fence
def box(west: float, south: float, east: float, north: float, command: int) -> list[dict[str, Any]]:
    corners = [(west, south), (east, south), (east, north), (west, north)]
    return [{"en": p, "command": command, "p1": 4.0, "frame": 0} for p in corners]


def test_fence_breach_as_recorded() -> None:
    async def job(c: Client) -> None:
        c.rate(mav.MAVLINK_MSG_ID_GLOBAL_POSITION_INT, 10)
        zone = box(190.0, -40.0, 240.0, 40.0, 5002)
        ring = {"en": (100.0, 80.0), "command": 5004, "p1": 25.0, "frame": 0}
        assert await c.upload([*box(-300.0, -300.0, 600.0, 300.0, 5001), *zone, ring], kind=1) == 0
        back = [(m.command, m.param1) for m in await c.download(1)]
        assert back == [(5001, 4.0)] * 4 + [(5002, 4.0)] * 4 + [(5004, 25.0)]
        assert "Fence Indexed OK" in c.texts()
        # a wrong vertex count is refused and the old fence stays
        bad = [{**v, "p1": 5.0} for v in zone[:3]]
        assert await c.upload(bad, kind=1) == 1
        assert c.texts()[-2:] == ["Incorrect item count", "Fence validation failed"]
        assert len(await c.download(1)) == 9
        assert not c.of("FENCE_STATUS")
        assert await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
        await c.set_sail([(60.0, 2.5), (300.0, 2.5)])  # home is not dead astern, as it was not
        await asyncio.sleep(1.5)
        assert c.last("SYS_STATUS").onboard_control_sensors_enabled & 0x100000
        mode = await c.wait("HEARTBEAT", 150.0, lambda m: m.custom_mode == 11)
        assert mode.custom_mode == 11
        await asyncio.sleep(0.3)
        status = c.last("FENCE_STATUS")
        breach = next(m for m in c.of("FENCE_STATUS") if m.breach_status)
        assert (breach.breach_count, breach.breach_type) == (1, 3)
        assert status.breach_count == 1
        assert "Manual recovery started" in c.texts()
        # limited from 27 m before the edge, eased in the last 2 m, 7 m deep before it is out again
        assert any(m.breach_mitigation == 2 for m in c.of("FENCE_STATUS"))
        await asyncio.sleep(20.0)
        from tests.sitl.boats import en

        tracks = [(*en(m.lat, m.lon), math.hypot(m.vx, m.vy) / 100.0) for m in c.of("GLOBAL_POSITION_INT")]
        assert max(p[0] for p in tracks) == pytest.approx(197.4, abs=4.0)
        at_edge = min(tracks, key=lambda p: abs(p[0] - 190.0))
        assert at_edge[2] == pytest.approx(1.77, abs=0.35)
        assert (await c.wait("STATUSTEXT", 120.0, lambda m: m.text == "Reached destination")) is not None
        assert c.last("FENCE_STATUS").breach_status == 0

    sail(job, is_moored=True, FENCE_TYPE=4.0)


@pytest.mark.parametrize(("action", "mode"), [(0, Mode.AUTO), (1, Mode.RTL), (2, Mode.HOLD)])
def test_fence_actions(action: int, mode: Mode) -> None:
    async def job(c: Client) -> None:
        assert await c.upload(box(40.0, -50.0, 90.0, 50.0, 5002), kind=1) == 0
        assert await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
        await c.set_sail([(200.0, 0.0)])
        await c.wait("FENCE_STATUS", 60.0, lambda m: m.breach_status == 1)
        assert c.autopilot.truth.mode is mode

    sail(job, is_moored=True, FENCE_TYPE=4.0, FENCE_ACTION=float(action))


def test_default_fence_type_has_the_300_m_circle() -> None:
    async def job(c: Client) -> None:
        assert await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
        await c.set_sail([(500.0, 0.0)])
        await c.wait("FENCE_STATUS", 200.0, lambda m: m.breach_status == 1)
        assert c.autopilot.truth.east_m == pytest.approx(301.0, abs=3.0)

    sail(job, is_moored=True)


def test_arming_in_a_breach_is_refused_until_the_fence_is_cleared() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(box(-20.0, -20.0, 20.0, 20.0, 5002), kind=1) == 0
        await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1)
        await asyncio.sleep(0.3)
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 4
        await asyncio.sleep(0.1)
        assert c.texts()[-1] == "Arm: Vehicle breaching Polygon fence"
        c.send(mav.MAVLink_mission_clear_all_message(1, 1, 1))
        assert (await c.wait("MISSION_ACK", 1.0)).type == 0
        await asyncio.sleep(0.3)
        assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1) == 0

    sail(job, is_moored=True, FENCE_TYPE=4.0)


@settings(max_examples=60)
@given(
    seed=st.integers(0, 10_000), east=st.floats(-150.0, 150.0), north=st.floats(-150.0, 150.0), inclusion=st.booleans()
)
def test_clearance_agrees_with_shapely(seed: int, east: float, north: float, *, inclusion: bool) -> None:
    import numpy as np
    from shapely import Point
    from shapely import Polygon as Shape

    from sitl.autopilot.pilot.fence import Polygon

    rng = np.random.default_rng(seed)
    angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, 9))
    radii = rng.uniform(20.0, 120.0, 9)
    ring = np.column_stack([radii * np.sin(angles), radii * np.cos(angles)])
    shape, here = Shape(ring), Point(east, north)
    if not shape.is_valid:
        return
    want = shape.exterior.distance(here) * (1.0 if shape.contains(here) == inclusion else -1.0)
    got = Polygon(1.0 if inclusion else -1.0, ring).clearance_m(east, north)
    assert got == pytest.approx(want, abs=1e-6)


# ---------------------------------------------------------------------------------------------------------- AIS
def test_ais_is_off_by_default_and_has_the_real_units() -> None:
    async def job(c: Client) -> None:
        ship = AisVessel(
            mmsi=211000001,
            position=GeoPoint(lat_deg=51.101, lon_deg=-1.3),
            cog_deg=180.0,
            sog_mps=5.0,
            heading_deg=None,
            turn_rate_dps=-2.0,
        )
        c.autopilot.hear_vessel(ship)
        c.autopilot.hear_vessel(AisVessel(mmsi=211000005, position=ship.position, is_class_b=True))
        await asyncio.sleep(3.0)
        assert not c.of("AIS_VESSEL")
        assert await c.ask(mav.MAV_CMD_SET_MESSAGE_INTERVAL, 301, 200_000) == 0
        m = await c.wait("AIS_VESSEL", 2.0)
        assert (m.MMSI, m.COG, m.heading, m.velocity, m.turn_rate) == (211000001, 18000, 51100, 97, 20)
        start = now_s()
        await asyncio.sleep(29.0)
        assert not c.of("AIS_VESSEL", start + 0.3)
        await asyncio.sleep(32.0)
        assert [m.tslc for m in c.of("AIS_VESSEL", start + 0.3)] == [33, 63]
        assert {m.MMSI for m in c.of("AIS_VESSEL")} == {211000001}

    sail(job)


# ---------------------------------------------------------------------------------------------------- failsafes
@pytest.mark.parametrize(
    ("parameters", "mode", "text"),
    [
        ({}, Mode.AUTO, None),
        ({"FS_GCS_ENABLE": 1.0}, Mode.HOLD, "Radio Failsafe"),
        ({"FS_GCS_ENABLE": 2.0}, Mode.HOLD, "Radio Failsafe"),
        ({"FS_GCS_ENABLE": 2.0, "FS_THR_ENABLE": 0.0}, Mode.AUTO, "GCS Failsafe"),
        ({"FS_GCS_ENABLE": 1.0, "FS_THR_ENABLE": 2.0}, Mode.AUTO, "Radio Failsafe"),
    ],
)
def test_loss_of_the_ground_station(parameters: dict[str, float], mode: Mode, text: str | None) -> None:
    async def job(c: Client) -> None:
        shore = mav.MAVLink(None, srcSystem=255, srcComponent=190)
        c.write(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(shore))
        await c.set_sail(EAST)
        beat(c, 18)
        await asyncio.sleep(12.0)
        assert c.autopilot.truth.mode is mode
        if text is not None:
            assert text in c.texts()
            assert c.text_time(text) == pytest.approx(6.5, abs=0.3)
            assert c.last("HEARTBEAT").system_status == 5
            c.write(mav.MAVLink_heartbeat_message(6, 8, 0, 0, 4, 3).pack(shore))
            await asyncio.sleep(1.0)
            assert "GCS Failsafe Cleared" in c.texts()
            assert c.autopilot.truth.mode is mode  # not restored

    sail(job, is_moored=True, **parameters)


def test_companion_heartbeat_counts_only_with_its_system_id() -> None:
    async def job(c: Client) -> None:
        beat(c, 18)
        await c.set_sail(EAST)
        await asyncio.sleep(10.0)
        assert c.autopilot.truth.mode is Mode.HOLD

    sail(job, is_moored=True, FS_GCS_ENABLE=1.0, SYSID_MYGCS=1.0)


# ------------------------------------------------------------------------------------------------ faults, reboot
@pytest.mark.parametrize("is_forced", [False, True])
def test_reboot_sets_boot_time_back_and_forgets_rates(is_forced: bool) -> None:
    async def job(c: Client) -> None:
        c.rate(168, 10)
        await c.set_sail(EAST)
        await asyncio.sleep(5.0)
        assert await c.ask(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, 1) == 4  # armed
        if not is_forced:
            assert await c.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 0) == 0
        before = c.last("SYSTEM_TIME").time_boot_ms
        reboot = FORCED_REBOOT if is_forced else (1.0,)
        assert await c.ask(mav.MAV_CMD_PREFLIGHT_REBOOT_SHUTDOWN, *reboot) == 0
        start = now_s()
        await asyncio.sleep(6.0)
        assert c.last("SYSTEM_TIME").time_boot_ms < before
        assert len(c.of("WIND", start + 1.0)) <= 5
        truth = c.autopilot.truth
        assert not truth.is_armed
        assert truth.mode is Mode.MANUAL
        assert len(await c.download()) == 7  # the mission is in storage
        assert c.last("EKF_STATUS_REPORT").flags != 0x33F

    sail(job)


def test_frozen_vane_turns_with_the_boat() -> None:
    async def job(c: Client) -> None:
        await c.set_sail([(200.0, 0.0), (0.0, -200.0)])
        await asyncio.sleep(20.0)
        c.autopilot.set_vane(VaneFault(state=VaneState.FROZEN))
        await asyncio.sleep(80.0)
        late = [m for m in c.of("NAMED_VALUE_FLOAT", 40.0) if m.name == "AppWndDir"]
        assert max(m.value for m in late) - min(m.value for m in late) < 0.5
        assert max(abs((m.direction + 180.0) % 360.0 - 180.0) for m in c.of("WIND", 60.0)) > 60.0
        c.autopilot.set_vane(VaneFault())
        await asyncio.sleep(30.0)
        assert abs((c.last("WIND").direction + 180.0) % 360.0 - 180.0) < 3.0

    sail(job, is_moored=True)


def test_vane_offset_and_spikes() -> None:
    async def job(c: Client) -> None:
        c.rate(168, 10)
        c.autopilot.set_vane(VaneFault(state=VaneState.OFFSET, value_rad=math.radians(10.0)))
        await asyncio.sleep(25.0)
        assert c.last("WIND").direction == pytest.approx(10.0, abs=0.5)
        c.autopilot.set_vane(VaneFault(state=VaneState.SPIKES, value_rad=math.radians(90.0)))
        start = now_s() + 20.0
        await asyncio.sleep(120.0)
        values = [m.value for m in c.of("NAMED_VALUE_FLOAT", start) if m.name == "AppWndDir"]
        assert max(map(abs, values)) > 3.0
        assert sorted(map(abs, values))[len(values) // 2] < 2.0

    sail(job, is_moored=True)


def test_gps_jump_and_loss() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(10.0)
        c.autopilot.set_gps(GpsFault(north_m=30.0))
        await asyncio.sleep(1.0)
        told = c.last("GLOBAL_POSITION_INT")
        from tests.sitl.boats import en

        assert en(told.lat, told.lon)[1] == pytest.approx(30.0, abs=4.0)
        assert c.autopilot.truth.north_m == pytest.approx(0.0, abs=4.0)
        c.autopilot.set_gps(GpsFault(is_lost=True))
        start = now_s()
        await asyncio.sleep(20.0)
        assert c.text_time("EKF failsafe") - start == pytest.approx(8.3, abs=0.2)
        assert c.last("EKF_STATUS_REPORT").flags == 0xA7
        assert c.last("GPS_RAW_INT").fix_type == 1
        assert "EKF failsafe" in c.texts()
        assert c.autopilot.truth.mode is Mode.HOLD

    sail(job, is_moored=True)


def test_a_jump_that_the_ekf_resists() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(10.0)
        start = now_s()
        c.autopilot.set_gps(GpsFault(north_m=30.0, is_resisted=True))
        await asyncio.sleep(3.0)
        assert abs(c.autopilot.core.vehicle.position[1]) < 3.0
        assert c.last("EKF_STATUS_REPORT").flags == 0x833F
        await asyncio.sleep(1.5)
        assert c.autopilot.core.vehicle.position[1] == pytest.approx(30.0, abs=5.0)
        await asyncio.sleep(1.0)
        assert c.autopilot.truth.mode is Mode.HOLD
        assert c.text_time("EKF failsafe") - start == pytest.approx(4.8, abs=0.2)
        await asyncio.sleep(8.0)
        assert c.text_time("EKF failsafe cleared") - start == pytest.approx(11.0, abs=0.2)
        assert c.autopilot.truth.mode is Mode.HOLD

    sail(job, is_moored=True)


def test_current_acts_on_an_armed_boat() -> None:
    async def job(c: Client) -> None:
        c.autopilot.set_current(math.radians(270.0), 1.0)
        await c.set_sail([(300.0, 0.0)])
        await asyncio.sleep(15.0)
        # measured: 2.93 -> 2.02 over the ground on a beam reach
        assert c.autopilot.truth.speed_mps == pytest.approx(2.02, abs=0.15)

    sail(job, is_moored=True, heading_deg=90.0)


def test_battery() -> None:
    async def job(c: Client) -> None:
        c.autopilot.set_battery(9.9)
        await asyncio.sleep(12.0)
        assert c.last("SYS_STATUS").voltage_battery == 9900
        assert c.last("BATTERY_STATUS").battery_remaining == 10
        assert not any(x.startswith("Battery") for x in c.texts())  # looked at on an armed boat only

    sail(job, BATT_LOW_VOLT=10.5)


def test_wind_set_by_parameter() -> None:
    async def job(c: Client) -> None:
        c.send(mav.MAVLink_param_set_message(1, 1, b"SIM_WIND_DIR", 90.0, 9))
        c.send(mav.MAVLink_param_set_message(1, 1, b"SIM_WIND_SPD", 8.0, 9))
        await asyncio.sleep(30.0)
        assert c.last("WIND").direction == pytest.approx(90.0, abs=0.5)
        assert c.last("WIND").speed == pytest.approx(8.0, abs=0.05)

    sail(job)


# ------------------------------------------------------------------------------------- repeatability and noise
def voyage(seed: int, step_s: float | None = None) -> tuple[str, Any]:
    """Sail half a mission in a shifting wind over a bad link; returns a hash of all bytes and the end."""

    async def main() -> tuple[str, Any]:
        autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), AR1(0.0, 5.0, seed=seed, tws_sd_mps=0.5), seed)
        bad = Impairment(loss=0.1, duplicate=0.1, reorder=0.1, corrupt=0.02, delay_s=0.05)
        link = MemoryLink(seed=seed, impairment=bad)
        client = Client(link.near.write, autopilot)
        await link.near.open(client.on_bytes)
        async with serve(autopilot, [link.far]):
            items = [(0.0, 0.0), (40.0, 90.0), (-40.0, 180.0)]
            client.answers["MISSION_REQUEST"] = lambda m: client.send(client.item(m.seq, items[m.seq]))
            for _ in range(20):
                client.send(mav.MAVLink_mission_count_message(1, 1, 3, 0))
                await asyncio.sleep(9.0)
                if any(m.type == 0 for m in client.of("MISSION_ACK")):
                    break
            for _ in range(10):
                client.command(mav.MAV_CMD_DO_SET_MODE, 1, 10)
                client.command(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1)
                await asyncio.sleep(0.3)
            await asyncio.sleep(60.0)
            return hashlib.sha256(client.bytes_in).hexdigest(), autopilot.truth

    return run_virtual(main())


def test_a_seed_repeats_bit_for_bit() -> None:
    first, again, other = voyage(3), voyage(3), voyage(4)
    assert first == again
    assert first[0] != other[0]
    assert first[1].is_armed


def test_the_core_does_not_depend_on_how_time_is_cut() -> None:
    def run(steps: list[float]) -> tuple[bytes, Any]:
        autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), AR1(1.0, 5.0, seed=9), 9)
        autopilot.open_link(0)
        autopilot.pilot.arming.arm(force=True)
        autopilot.core.vehicle.sail_leg((0.0, 0.0), (300.0, 0.0), None, is_corner=False, goes_on=False)
        for step in steps:
            autopilot.step(step)
        return autopilot.take_outgoing(0), autopilot.truth

    assert run([0.02] * 1000) == run([20.0]) == run([0.5] * 40) == run([0.013] * 1538 + [0.006])


def test_noise_and_broken_frames_are_survived() -> None:
    rng = random.Random(5)
    codec = mav.MAVLink(None, srcSystem=1, srcComponent=191)
    good = [
        mav.MAVLink_mission_count_message(1, 1, 700, 0),
        mav.MAVLink_mission_count_message(1, 1, 3, 9),
        mav.MAVLink_mission_item_int_message(1, 1, 3, 3, 16, 0, 1, math.nan, 0, 0, 0, 2**31 - 1, -(2**31), math.inf, 0),
        mav.MAVLink_command_long_message(1, 1, 511, 0, math.nan, math.inf, 0, 0, 0, 0, 0),
        mav.MAVLink_command_long_message(1, 1, 176, 0, 1, 1e30, 0, 0, 0, 0, 0),
        mav.MAVLink_command_long_message(1, 1, 224, 0, -1e9, 0, 0, 0, 0, 0, 0),
        mav.MAVLink_command_long_message(1, 1, 179, 0, 0, 0, 0, 0, 1e9, -1e9, 0),
        mav.MAVLink_command_int_message(1, 1, 99, 192, 0, 0, 0, 1, 0, 0, 2**31 - 1, 2**31 - 1, 0),
        mav.MAVLink_set_attitude_target_message(0, 1, 1, 0, [math.nan] * 4, 0, 0, 0, math.nan),
        mav.MAVLink_set_position_target_local_ned_message(0, 1, 1, 1, 0, *[math.nan] * 11),
        mav.MAVLink_set_position_target_global_int_message(0, 1, 1, 5, 0, 2**31 - 1, 0, *[math.inf] * 9),
        mav.MAVLink_mission_request_int_message(1, 1, 65535, 0),
        mav.MAVLink_mission_write_partial_list_message(1, 1, -5, 3, 0),
        mav.MAVLink_file_transfer_protocol_message(0, 1, 1, [255] * 251),
        mav.MAVLink_param_request_read_message(1, 1, b"\xff" * 16, -1),
        mav.MAVLink_param_set_message(1, 1, b"WP_SPEED", -math.inf, 9),
        mav.MAVLink_param_request_read_message(1, 1, b"", 32000),
        mav.MAVLink_request_data_stream_message(1, 1, 77, 0, 1),
        mav.MAVLink_mission_set_current_message(1, 1, 65535),
    ]
    autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), 0)
    for _ in range(400):
        data = b""
        for _ in range(rng.randrange(1, 5)):
            frame = bytearray(rng.choice(good).pack(codec))
            codec.seq = (codec.seq + 1) & 0xFF
            what = rng.random()
            if what < 0.3:
                frame = frame[: rng.randrange(len(frame))]
            elif what < 0.6:
                frame[rng.randrange(len(frame))] ^= rng.randrange(1, 256)
            elif what < 0.7:
                frame = bytearray(rng.randbytes(rng.randrange(40)))
            data += bytes(frame)
        autopilot.receive(0, data)
        autopilot.step(0.1)
    autopilot.receive(0, rng.randbytes(10_000))
    autopilot.step(12.0)
    autopilot.take_outgoing(0)
    # it still answers
    autopilot.receive(0, mav.MAVLink_command_long_message(1, 1, 512, 0, 148, 0, 0, 0, 0, 0, 0).pack(codec) * 3)
    autopilot.step(0.1)
    names = [m.get_type() for m in mav.MAVLink(None).parse_buffer(autopilot.take_outgoing(0))]
    assert "AUTOPILOT_VERSION" in names
    assert math.isfinite(autopilot.truth.east_m)


def test_an_unread_port_does_not_grow() -> None:
    autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), 0)
    autopilot.open_link(0)
    autopilot.step(300.0)
    assert len(autopilot.take_outgoing(0)) <= 65536
    assert autopilot.links[0].dropped_bytes > 0


def test_a_forger_s_offset_grows_and_the_velocity_that_is_told_has_it_in_it() -> None:
    async def job(c: Client) -> None:
        c.autopilot.set_gps(GpsFault(north_m=60.0, over_s=30.0))
        await asyncio.sleep(10.0)
        assert c.autopilot.core.vehicle.position[1] == pytest.approx(20.0, abs=1.0)
        assert c.last("GLOBAL_POSITION_INT").vx == pytest.approx(200, abs=10)
        assert c.autopilot.truth.north_m == pytest.approx(0.0, abs=1.0)
        await asyncio.sleep(30.0)
        assert c.autopilot.core.vehicle.position[1] == pytest.approx(60.0, abs=1.0)
        assert c.last("GLOBAL_POSITION_INT").vx == pytest.approx(0, abs=10)

    sail(job, is_moored=True)


def test_of_two_receivers_the_other_tells_the_truth() -> None:
    async def job(c: Client) -> None:
        from tests.sitl.boats import en

        c.rate(mav.MAVLINK_MSG_ID_GPS2_RAW, 1.0)
        await asyncio.sleep(3.0)
        assert not c.of("GPS2_RAW")
        c.autopilot.set_gps(GpsFault(north_m=200.0, is_of_one=True))
        await asyncio.sleep(3.0)
        assert en(c.last("GPS_RAW_INT").lat, c.last("GPS_RAW_INT").lon)[1] == pytest.approx(200.0, abs=1.0)
        assert en(c.last("GPS2_RAW").lat, c.last("GPS2_RAW").lon)[1] == pytest.approx(0.0, abs=1.0)

    sail(job, is_moored=True)
