"""What the autopilot is and tells: its version, ids, signature, the mission on board, the messages that come."""

from __future__ import annotations

from companion.doctor.report import Examined, Level, Report
from companion.skipper.step import ends_safely
from companion.words import counted

RATES_HZ = {"WIND": 0.9, "GLOBAL_POSITION_INT": 0.9, "ATTITUDE": 0.9, "MISSION_CURRENT": 0.4, "EKF_STATUS_REPORT": 0.4}
OLDEST = (4, 3)  # before it the boat is steered by L1


def identity(report: Report, seen: Examined) -> None:
    """Look at the system ids."""
    own, station = report.get("SYSID_THISMAV"), report.get("SYSID_MYGCS")
    if own is not None and seen.system_id is not None and int(own) != seen.system_id:
        report.add(
            Level.WARNING,
            "system id",
            f"it calls itself {seen.system_id} and its parameter says {own:g}",
            "a change of SYSID_THISMAV takes a reboot",
            name="SYSID_THISMAV",
        )
    if seen.uid == "":
        report.add(
            Level.INFO,
            "board",
            "the autopilot tells no UID of its board",
            "that it has become another one under way cannot be seen",
        )
    if own is not None and station is not None and own == station:
        report.add(
            Level.ERROR,
            "system id",
            f"SYSID_MYGCS is the vehicle's own id {own:g}",
            "the companion then counts as the ground station: its heartbeat keeps the station failsafe from "
            "working, and its death triggers it",
            name="SYSID_MYGCS",
            wanted=255.0,
        )


def signing(report: Report, seen: Examined) -> None:
    """Look at whether the link is signed and the key is here."""
    if seen.is_signed and not seen.has_key:
        answers = bool(seen.parameters)
        report.add(
            Level.WARNING if answers else Level.ERROR,
            "signing",
            "the autopilot signs its messages and no key was given",
            "it answers unsigned ones on this port (as on USB), not on others: give --signing-key FILE"
            if answers
            else "it refuses what is not signed: give --signing-key FILE, to 'companion run' as well",
        )
    elif not seen.is_signed and not seen.has_key:
        report.add(
            Level.INFO,
            "signing",
            "nothing is signed: whoever can send to the autopilot orders the boat",
            "where a stranger can (a telemetry radio), give it a key: 'companion key new', 'companion key set'",
        )


def version(report: Report, seen: Examined) -> None:
    """Look at the version."""
    if seen.version is None:
        report.add(Level.INFO, "version", "the version was not told", "behaviour is assumed as in 4.3 to 4.7")
    elif seen.version[:2] < OLDEST:
        text = ".".join(map(str, seen.version))
        report.add(Level.WARNING, "version", f"ArduRover {text}", "older than 4.3: steered by L1, other waypoint rules")


def mission(report: Report, seen: Examined) -> None:
    """Look at the mission on board."""
    if seen.mission is None:
        report.add(Level.WARNING, "mission", "the mission could not be read", "it cannot be told whose it is")
        return
    if seen.mission and not ends_safely(seen.mission):
        report.add(
            Level.WARNING,
            "mission end",
            f"the mission on board ({counted(len(seen.mission), 'item')}) has no safe end",
            "after its last item the boat does what MIS_DONE_BEHAVE says",
        )
    held = [n for n, item in enumerate(seen.mission, start=1) if item.command == 16 and item.params[0] > 0.0]
    if held:
        report.add(
            Level.INFO,
            "waiting waypoints",
            f"item {held[0]} waits {seen.mission[held[0] - 1].params[0]:g} s",
            "a sailboat circles while it waits",
        )
    if seen.mission:
        report.add(
            Level.INFO,
            "mission",
            f"a mission of {counted(len(seen.mission), 'item')} is on board",
            "unless it is the companion's own it is neither resumed nor replaced without permission",
        )


def streams(report: Report, seen: Examined) -> None:
    """Look at the rates of the messages that a voyage needs."""
    if seen.rates_hz is None:
        return
    for name, wanted in RATES_HZ.items():
        rate = seen.rates_hz.get(name, 0.0)
        if rate < 0.1:
            report.add(
                Level.ERROR,
                "streams",
                f"no {name} is heard",
                "it was asked for and does not come: a router in between, or another system id?",
            )
        elif rate < wanted:
            report.add(Level.WARNING, "streams", f"{name} comes {rate:.1f} times a second", f"{wanted:g} are needed")
