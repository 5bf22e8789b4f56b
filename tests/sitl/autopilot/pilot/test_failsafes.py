"""Each failsafe of the autopilot: what it says, what it does, what the heartbeat and SYS_STATUS show of it."""

from __future__ import annotations

import asyncio
import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion.messages import Mode
from tests.sitl.autopilot.test_autopilot import EAST, box
from tests.sitl.boats import Client, sail

BATTERY_BIT, RECEIVER_BIT = 0x2000000, 0x10000


def status(c: Client) -> int:
    return int(c.last("HEARTBEAT").system_status)


def test_hold_is_standby_and_a_change_of_mode_is_told_at_once() -> None:
    """The recordings: HEARTBEAT 4 in every mode but HOLD, where it is 3, armed or not; one more at the change."""

    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(2.4)
        assert status(c) == 4
        since = len(c.heard)
        c.autopilot.set_mode(Mode.HOLD)
        await asyncio.sleep(0.1)
        told = [m for _, m in c.heard[since:] if m.get_type() == "HEARTBEAT"]
        assert [(m.custom_mode, m.system_status) for m in told] == [(4, 3)]

    sail(job, is_moored=True)


@pytest.mark.parametrize(
    ("parameters", "mode", "texts"),
    [
        ({"FS_THR_ENABLE": 0.0}, Mode.AUTO, []),
        ({}, Mode.HOLD, ["Radio Failsafe"]),
        ({"FS_ACTION": 1.0}, Mode.RTL, ["Radio Failsafe"]),
        ({"FS_ACTION": 6.0}, Mode.LOITER, ["Radio Failsafe"]),
        ({"FS_THR_ENABLE": 2.0}, Mode.AUTO, ["Radio Failsafe", "Failsafe - Continuing Auto Mode"]),
    ],
)
def test_the_transmitter_out_of_range(parameters: dict[str, float], mode: Mode, texts: list[str]) -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        start = c.autopilot.t_s
        c.autopilot.pilot.radio.switch(is_on=False)
        await asyncio.sleep(4.0)
        assert c.autopilot.truth.mode is mode
        said = [t for t in c.texts() if "ailsafe" in t]
        assert said == texts
        assert status(c) == (5 if texts else 4)
        assert c.last("SYS_STATUS").onboard_control_sensors_health & RECEIVER_BIT == 0
        if texts:
            assert c.text_time("Radio Failsafe") - start == pytest.approx(2.0, abs=0.3)
            c.autopilot.pilot.radio.switch(is_on=True)
            await asyncio.sleep(1.2)
            assert c.texts()[-1] == "Radio Failsafe Cleared"
            assert c.autopilot.truth.mode is mode  # not restored

    sail(job, is_moored=True, **parameters)


def test_in_hold_and_rtl_the_links_do_not_act_and_do_once_the_mission_goes_on() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        c.autopilot.set_mode(Mode.HOLD)
        c.autopilot.pilot.radio.switch(is_on=False)
        await asyncio.sleep(10.0)
        assert "Radio Failsafe" not in c.texts()
        assert status(c) == 3
        c.autopilot.set_mode(Mode.AUTO)
        await asyncio.sleep(0.5)
        assert "Radio Failsafe" in c.texts()
        assert c.autopilot.truth.mode is Mode.HOLD

    sail(job, is_moored=True)


def test_the_mode_switch_moves_its_channel() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(1.2)
        before = c.last("RC_CHANNELS")
        assert before.chan8_raw == 1800
        assert c.autopilot.pilot.radio.select(Mode.RTL)
        await asyncio.sleep(1.2)
        assert c.last("RC_CHANNELS").chan8_raw == 1425
        assert c.autopilot.truth.mode is Mode.RTL
        assert not c.autopilot.pilot.radio.select(Mode.GUIDED)  # no place of the switch has it
        c.autopilot.pilot.radio.switch(is_on=False)
        assert not c.autopilot.pilot.radio.select(Mode.MANUAL)

    sail(job, is_moored=True)


@pytest.mark.parametrize(
    ("volts", "parameters", "mode", "texts"),
    [
        (10.0, {}, Mode.AUTO, ["Battery 1 is low 10.00V used 0 mAh"]),
        (10.0, {"BATT_FS_LOW_ACT": 2.0}, Mode.HOLD, ["Battery 1 is low 10.00V used 0 mAh"]),
        (10.0, {"BATT_FS_LOW_ACT": 1.0}, Mode.RTL, ["Battery 1 is low 10.00V used 0 mAh"]),
        # below both limits the worse is said and done alone
        (9.7, {"BATT_FS_LOW_ACT": 2.0, "BATT_FS_CRT_ACT": 1.0}, Mode.RTL, ["Battery 1 is critical 9.70V used 0 mAh"]),
    ],
)
def test_the_battery(volts: float, parameters: dict[str, float], mode: Mode, texts: list[str]) -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        await asyncio.sleep(1.2)
        assert c.last("SYS_STATUS").onboard_control_sensors_health & BATTERY_BIT == BATTERY_BIT
        c.autopilot.set_battery(volts)
        await asyncio.sleep(12.0)
        assert [t for t in c.texts() if t.startswith("Battery")] == texts
        assert c.autopilot.truth.mode is mode
        assert status(c) == (3 if mode is Mode.HOLD else 4)  # never critical: that is for links and position
        assert c.last("SYS_STATUS").onboard_control_sensors_health & BATTERY_BIT == 0

    sail(job, is_moored=True, BATT_LOW_VOLT=10.5, BATT_CRT_VOLT=9.8, **parameters)


def test_a_battery_that_falls_on_keeps_the_action_that_stands_first_in_the_order() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        c.autopilot.set_battery(10.0)
        await asyncio.sleep(12.0)
        c.autopilot.set_battery(9.7)
        await asyncio.sleep(12.0)
        assert [t[:21] for t in c.texts() if t.startswith("Battery")] == [
            "Battery 1 is low 10.0",
            "Battery 1 is critical",
        ]
        assert c.autopilot.truth.mode is Mode.HOLD

    sail(job, is_moored=True, BATT_LOW_VOLT=10.5, BATT_CRT_VOLT=9.8, BATT_FS_LOW_ACT=2.0, BATT_FS_CRT_ACT=1.0)


def test_a_battery_that_ends_it() -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        c.autopilot.set_battery(9.5)
        await asyncio.sleep(12.0)
        assert not c.autopilot.truth.is_armed

    sail(job, is_moored=True, BATT_CRT_VOLT=9.8, BATT_FS_CRT_ACT=5.0)


@pytest.mark.parametrize(
    ("check", "angle_deg", "mode", "armed"),
    [(0, 30, Mode.AUTO, True), (1, 0, Mode.AUTO, True), (1, 30, Mode.HOLD, True), (2, 30, Mode.HOLD, False)],
)
def test_a_knock_down(check: int, angle_deg: int, mode: Mode, armed: bool) -> None:
    async def job(c: Client) -> None:
        await c.set_sail(EAST)
        c.autopilot.set_roll(math.radians(50.0))
        await asyncio.sleep(2.0)
        assert c.last("ATTITUDE").roll == pytest.approx(math.radians(50.0))
        assert (c.autopilot.truth.mode, c.autopilot.truth.is_armed) == (mode, armed)
        assert ("Crash: Going to HOLD" in c.texts()) == (mode is Mode.HOLD)

    sail(job, is_moored=True, FS_CRASH_CHECK=float(check), CRASH_ANGLE=float(angle_deg))


def test_a_change_of_mode_outside_the_fence_starts_the_recovery_whoever_made_it() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(box(40.0, -50.0, 90.0, 50.0, 5002), kind=1) == 0
        assert await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
        await c.set_sail([(200.0, 0.0)])
        await c.wait("FENCE_STATUS", 60.0, lambda m: m.breach_status == 1)
        assert "Manual recovery started" not in c.texts()  # it was only reported
        c.autopilot.set_mode(Mode.LOITER)
        await asyncio.sleep(0.5)
        assert c.texts()[-1] == "Manual recovery started"

    sail(job, is_moored=True, FENCE_TYPE=4.0, FENCE_ACTION=0.0)


def test_a_breach_is_told_at_once() -> None:
    async def job(c: Client) -> None:
        assert await c.upload(box(40.0, -50.0, 90.0, 50.0, 5002), kind=1) == 0
        assert await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
        await c.set_sail([(200.0, 0.0)])
        breach = await c.wait("FENCE_STATUS", 60.0, lambda m: m.breach_status == 1)
        await asyncio.sleep(0.05)
        assert c.autopilot.core.boot_ms - breach.breach_time < 200
        assert c.autopilot.truth.mode is Mode.HOLD

    sail(job, is_moored=True, FENCE_TYPE=4.0, FENCE_ACTION=2.0)


def test_outside_the_home_circle_there_is_a_new_breach_every_20_m() -> None:
    """Measured on 4.5.2: FENCE_STATUS stays breached, its count rises, and the action is taken again."""

    async def job(c: Client) -> None:
        assert await c.ask(mav.MAV_CMD_DO_FENCE_ENABLE, 1) == 0
        await c.set_sail([(500.0, 0.0)])
        await c.wait("FENCE_STATUS", 200.0, lambda m: m.breach_status == 1)
        assert c.autopilot.truth.mode is Mode.HOLD
        c.autopilot.set_mode(Mode.AUTO)
        # the second circle is passed within the ten seconds of recovery, the third is not
        third = await c.wait("FENCE_STATUS", 60.0, lambda m: m.breach_count == 3)
        assert third.breach_status == 1
        assert c.autopilot.truth.mode is Mode.HOLD
        assert c.autopilot.truth.east_m == pytest.approx(342.0, abs=6.0)

    sail(job, is_moored=True, FENCE_ACTION=2.0)
