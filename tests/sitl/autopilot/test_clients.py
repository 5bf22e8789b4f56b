"""Independent clients sail the simulated boat over UDP: MAVSDK 4, and pymavlink's mavutil with MAVWPLoader."""

from __future__ import annotations

import math
import os
import subprocess
import sys
import textwrap
import time

import pytest

from tests.sitl.boats import boat_process, e7

LEGS = [(0.0, 0.0), (40.0, 30.0), (80.0, 0.0), (40.0, -30.0)]


def test_mavutil_and_mavwploader() -> None:
    os.environ["MAVLINK20"] = "1"
    from pymavlink import mavutil, mavwp

    with boat_process("--warm", "--moored", "--speedup", "8", "--wind", "6@0") as (host, _, udp):
        link = mavutil.mavlink_connection(f"udpout:{host}:{udp}", source_system=255, dialect="ardupilotmega")
        assert link.WIRE_PROTOCOL_VERSION == "2.0"
        link.mav.heartbeat_send(6, 8, 0, 0, 4)
        beat = link.wait_heartbeat(timeout=5)
        assert (beat.type, beat.autopilot) == (11, 3)
        wind = link.recv_match(type="WIND", blocking=True, timeout=3)
        assert wind.speed == pytest.approx(6.0, abs=0.1)

        loader = mavwp.MAVWPLoader()
        for n, place in enumerate(LEGS):
            lat, lon = e7(*place)
            loader.add(link.mav.mission_item_int_encode(1, 1, n, 3, 16, 0, 1, 0, 0, 0, 0, lat, lon, 0))
        link.mav.mission_count_send(1, 1, loader.count(), 0)
        while True:
            m = link.recv_match(type=["MISSION_REQUEST", "MISSION_ACK"], blocking=True, timeout=3)
            assert m is not None
            if m.get_type() == "MISSION_ACK":
                assert m.type == 0
                break
            link.mav.send(loader.wp(m.seq))

        back = mavwp.MAVWPLoader()
        link.mav.mission_request_list_send(1, 1, 0)
        count = link.recv_match(type="MISSION_COUNT", blocking=True, timeout=3).count
        assert count == len(LEGS)
        for n in range(count):
            link.mav.mission_request_int_send(1, 1, n, 0)
            back.add(link.recv_match(type="MISSION_ITEM_INT", blocking=True, timeout=3))
        link.mav.mission_ack_send(1, 1, 0, 0)
        for n in range(1, count):
            assert (back.wp(n).x, back.wp(n).y) == e7(*LEGS[n])

        link.set_mode("AUTO")
        link.arducopter_arm()
        link.motors_armed_wait()
        assert link.flightmode == "AUTO"
        reached = link.recv_match(type="MISSION_ITEM_REACHED", blocking=True, timeout=8)
        assert reached.seq == 1
        link.param_fetch_one("SAIL_NO_GO_ANGLE")
        value = link.recv_match(type="PARAM_VALUE", blocking=True, timeout=3)
        assert (value.param_id, value.param_value) == ("SAIL_NO_GO_ANGLE", 45.0)
        link.close()


_MAVSDK = textwrap.dedent("""
    import sys, time, threading
    from mavsdk import Mavsdk, Configuration
    from mavsdk.component_type import ComponentType
    from mavsdk import logging
    from mavsdk.plugins.mission_raw import MissionRaw, MissionItem
    from mavsdk.plugins.telemetry import Telemetry
    from mavsdk.plugins.action import Action
    from mavsdk.plugins.param import Param
    from tests.sitl.boats import e7

    logging.log_subscribe(lambda *a: True)
    LEGS = [(0.0, 0.0), (40.0, 30.0), (80.0, 0.0), (40.0, -30.0)]
    m = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    assert int(m.add_any_connection(f"udpout://{sys.argv[1]}:{sys.argv[2]}")) in (0, 1), "connection"
    system = m.first_autopilot(10.0)
    assert system is not None and system.has_autopilot(), "no autopilot"
    telemetry, raw, action = Telemetry(system), MissionRaw(system), Action(system)
    deadline = time.time() + 5
    while time.time() < deadline and not abs(telemetry.position().latitude_deg - 51.1) < 0.01:
        time.sleep(0.05)
    position = telemetry.position()
    assert abs(position.latitude_deg - 51.1) < 0.01 and abs(position.longitude_deg + 1.3) < 0.01, position
    assert telemetry.gps_info().fix_type >= 3, telemetry.gps_info()

    def item(n, command, p1, place, kind, frame=3):
        lat, lon = e7(*place)
        return MissionItem(n, frame, command, 1 if n == 0 else 0, 1, p1, 0.0, 0.0, 0.0, lat, lon, 0.0, kind)

    items = [item(n, 16, 0.0, place, 0) for n, place in enumerate(LEGS)]
    raw.upload_mission(items)
    back = raw.download_mission()
    assert [(i.x, i.y, i.command) for i in back[1:]] == [(i.x, i.y, i.command) for i in items[1:]], back
    zone = [(-200.0, -200.0), (300.0, -200.0), (300.0, 300.0), (-200.0, 300.0)]
    fence = [item(n, 5001, 4.0, p, 1, 0) for n, p in enumerate(zone)] + [item(4, 5004, 20.0, (150.0, 150.0), 1, 0)]
    raw.upload_geofence(fence)
    found = raw.download_geofence()
    assert [(i.x, i.y, i.command, i.param1) for i in found] == [(i.x, i.y, i.command, i.param1) for i in fence], found
    raw.upload_rally_points([item(0, 5100, 0.0, (5.0, 5.0), 2)])
    assert len(raw.download_rallypoints()) == 1
    param = Param(system)
    assert abs(param.get_param_float("SAIL_NO_GO_ANGLE") - 45.0) < 1e-6
    param.set_param_float("SAIL_NO_GO_ANGLE", 40.0)
    assert abs(param.get_param_float("SAIL_NO_GO_ANGLE") - 40.0) < 1e-6

    action.arm()
    raw.start_mission()
    deadline = time.time() + 8
    while time.time() < deadline and raw.mission_progress().current < 2:
        time.sleep(0.05)
    assert raw.mission_progress().current >= 2, raw.mission_progress()
    assert telemetry.armed(), "not armed"
    v = telemetry.velocity_ned()
    assert (v.north_m_s ** 2 + v.east_m_s ** 2) ** 0.5 > 1.0, v
    print("sailed", raw.mission_progress().current)
    m.destroy()
""")


def test_mavsdk() -> None:
    with boat_process("--warm", "--moored", "--speedup", "8", "--wind", "6@0") as (host, _, udp):
        began = time.monotonic()
        # a process of its own: MAVSDK keeps threads, and must not be forked with
        done = subprocess.run(
            [sys.executable, "-c", _MAVSDK, host, str(udp)], capture_output=True, text=True, timeout=60, check=False
        )
        assert done.returncode == 0, done.stdout + done.stderr
        assert "sailed" in done.stdout
        assert time.monotonic() - began < 40.0
        assert math.isfinite(began)
