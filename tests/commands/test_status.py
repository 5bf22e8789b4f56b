"""``companion status`` on a link: what it waits for before it speaks, and what it says is not heard."""

import math
import socket
import threading
import time

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion import cli
from companion.commands.status import EXIT_ALARM, exit_code
from companion.mavlink import vehicle_identity
from companion.mavlink.wire.companion_status import status_messages
from companion.mavlink.wire.frames import Codec
from companion.messages import CompanionStatus
from sitl.scenario.traffic import free_port

MANUAL, DISARMED, STANDBY = 0, wire.MAV_MODE_FLAG_CUSTOM_MODE_ENABLED, wire.MAV_STATE_STANDBY

STATUS = CompanionStatus(t_s=1.0, state="standard", tws_mps=5.0, twd_from_rad=math.radians(359.8), next_tack_s=44.0)


@pytest.fixture
def air(monkeypatch):
    """Return a port on which an autopilot's heartbeats and a companion's status are heard."""
    monkeypatch.setattr(
        vehicle_identity, "LISTEN_S", 0.3
    )  # the autopilot's heartbeat before that counts it, and no more
    port, stop = free_port(), threading.Event()
    threads = []

    def begin(beats, kinds):
        def send():
            autopilot, companion = Codec(system=1, component=1), Codec(system=1, component=191)
            began, sent = time.monotonic(), 0
            with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as udp:
                while not stop.wait(0.02):
                    if sent < len(beats) and time.monotonic() - began >= beats[sent]:
                        sent += 1
                        beat = wire.MAVLink_heartbeat_message(
                            wire.MAV_TYPE_SURFACE_BOAT, wire.MAV_AUTOPILOT_ARDUPILOTMEGA, DISARMED, MANUAL, STANDBY, 3
                        )
                        udp.sendto(autopilot.pack(beat), ("127.0.0.1", port))
                    for message in status_messages(STATUS, 1.0, 3):  # the packed one, and the wind
                        if kinds is None or message.get_type() in kinds:
                            udp.sendto(companion.pack(message), ("127.0.0.1", port))

        threads.append(threading.Thread(target=send))
        threads[-1].start()
        return port

    yield begin
    stop.set()
    for thread in threads:
        thread.join()


def _once(port, timeout="4"):
    return cli.main(["status", "--link", f"udpin:127.0.0.1:{port}", "--once", "--timeout", timeout])


def test_one_status_waits_for_the_autopilots_mode(air, capsys):
    """It printed "STANDARD  ? ?"."""
    assert _once(air([0.1, 0.7], None)) == 0
    told = capsys.readouterr().out
    assert told.startswith("STANDARD  MANUAL disarmed  (age ")
    assert "TWD 000±" in told  # not 360
    assert "next tack about 44 s" in told  # whether it is the plan's is not heard


def test_what_was_not_heard_in_time_is_said(air, capsys):
    assert _once(air([0.1], {"WIND_COV"}), "1.2") == 0
    assert capsys.readouterr().out.startswith("state not heard yet  ")


@pytest.mark.parametrize(("verb", "code"), [(None, EXIT_ALARM), ("hold", 0), ("home", EXIT_ALARM)])
def test_a_hold_that_was_ordered_raises_no_alarm(verb, code):
    """On her way home by order she holds for a reason of her own: no plan, a failsafe."""
    order = None if verb is None else {"verb": verb, "stands_s": 5.0, "age_s": 0.1}
    document = {"age_s": 0.5, "traffic": None, "state": "holding", "order": order}
    assert exit_code(document, max_age_s=10.0) == code


@pytest.mark.parametrize("command", ["status", "watch"])
def test_a_port_that_another_program_has_is_no_link(command, capsys):
    """They ended with 1, which neither of them tells of."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as other:
        other.bind(("127.0.0.1", 0))
        link = f"udpin:127.0.0.1:{other.getsockname()[1]}"
        assert cli.main([command, "--link", link]) == 3
    assert capsys.readouterr().err == (
        f"companion {command}: {link}: address already in use: another program listens there; stop it, or take "
        "another port\n"
    )
