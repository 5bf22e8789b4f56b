"""The doctor's questions about safety: fence, failsafes, who is who on the link, what is on board, what is heard."""

from __future__ import annotations

from companion.boat import AutopilotLimits
from companion.doctor.findings import Examined, Level, Needs, Report
from companion.skipper.step import ends_safely

FENCE_ITEMS = 84             # what every board holds (672 bytes of storage, 8 each)
POLYGON_BIT = 4
RATES_HZ = {"WIND": 0.9, "GLOBAL_POSITION_INT": 0.9, "ATTITUDE": 0.9, "MISSION_CURRENT": 0.4, "EKF_STATUS_REPORT": 0.4}
OLDEST = (4, 2)              # before it the boat is steered by L1 and the upwind corridor differs
MODES_FS = {0: "nothing", 1: "RTL", 2: "HOLD", 3: "SmartRTL or RTL or HOLD", 4: "SmartRTL or HOLD", 5: "a disarming",
            6: "LOITER or HOLD"}
ADRIFT = frozenset({2, 4, 5})   # what leaves a sailboat to drift: her sails are eased and nobody steers
DRIFTS = "a sailboat in HOLD eases her sails and drifts, out of a fence and onto whatever is there"


def fence(report: Report, seen: Examined, needs: Needs) -> None:
    """Look at the fence that is on the autopilot and at what a breach does."""
    enabled, kind = report.get("FENCE_ENABLE"), report.get("FENCE_TYPE")
    radius, action = report.get("FENCE_RADIUS"), report.get("FENCE_ACTION")
    on = enabled is not None and enabled != 0
    if kind is not None and int(kind) & AutopilotLimits.CIRCLE_BIT and radius is not None and (on or needs.has_fence):
        inside = needs.reach_m + needs.margin_m <= radius
        report.add(Level.INFO if inside else Level.ERROR, "home circle",
                   f"FENCE_TYPE {kind:g} includes the circle of {radius:g} m around home",
                   "the voyage stays inside it" if inside else
                   f"the voyage goes {needs.reach_m:.0f} m from home and breaches it; 4 means polygons only",
                   name="FENCE_TYPE", wanted=None if inside else float(POLYGON_BIT))
    if on and seen.fence is not None and not seen.fence and kind is not None and int(kind) == POLYGON_BIT:
        report.add(Level.WARNING, "empty fence", "a polygon fence is enabled and there is none on the autopilot",
                   "it guards nothing", name="FENCE_ENABLE", wanted=0.0)
    if seen.fence is not None and len(seen.fence) > FENCE_ITEMS:
        report.add(Level.ERROR, "fence size", f"{len(seen.fence)} fence items; boards hold {FENCE_ITEMS}",
                   "the rest is not there: simplify it with 'companion fence'")
    if not on and needs.has_fence:
        report.add(Level.WARNING, "fence off", "FENCE_ENABLE is 0 and the mission wants its fence on the autopilot",
                   "the last line of defence is missing", name="FENCE_ENABLE", wanted=1.0)
    if on and action is not None:
        does = MODES_FS.get(int(action), f"action {action:g}")
        drifts = needs.sails and int(action) in ADRIFT
        level = Level.ERROR if drifts else Level.WARNING if action == 0 else Level.INFO
        report.add(level, "fence action", f"on a breach: {does}" if action else "on a breach: only a report",
                   "the fence stops nothing" if action == 0 else DRIFTS if drifts else
                   "it coasts about 7 m on at 3 m/s and sails straight home; with [operator] set_auto the companion "
                   "plans the way back inside", name="FENCE_ACTION", wanted=1.0 if action == 0 or drifts else None)


def failsafes(report: Report, needs: Needs) -> None:
    """Look at what the autopilot does when something is lost."""
    radio, station, action = report.get("FS_THR_ENABLE"), report.get("FS_GCS_ENABLE"), report.get("FS_ACTION")
    drifts = needs.sails and action is not None and int(action) in ADRIFT
    bad = Level.ERROR if drifts else Level.WARNING
    drift = f"; {DRIFTS}" if drifts else ""
    does = MODES_FS.get(int(action), f"action {action:g}") if action is not None else "an action that was not read"
    if radio == 1.0:
        report.add(bad, "radio failsafe", f"FS_THR_ENABLE is 1: out of RC range the boat goes to {does}",
                   f"a voyage beyond RC range ends there; 2 continues the mission in AUTO{drift}", name="FS_THR_ENABLE",
                   wanted=2.0)
    elif radio == 0.0:
        report.add(Level.INFO, "radio failsafe", "FS_THR_ENABLE is 0: losing the RC does nothing",
                   "the mission goes on", name="FS_THR_ENABLE")
    if station == 0.0:
        report.add(Level.INFO, "station failsafe", "FS_GCS_ENABLE is 0: losing the ground station does nothing",
                   "the mission goes on to its safe end; losing the companion never triggers anything",
                   name="FS_GCS_ENABLE")
    elif station is not None:
        quirk = station == 2.0 and radio not in {None, 0.0, 2.0}
        if station != 2.0 or quirk:
            report.add(
                bad, "station failsafe",
                f"FS_GCS_ENABLE is {station:g}: losing the ground station means {does}",
                "with FS_THR_ENABLE 1 'continue in AUTO' is ignored: set that to 2" if quirk else
                f"a voyage beyond its range ends there; 2 continues the mission in AUTO{drift}",
                name="FS_THR_ENABLE" if quirk else "FS_GCS_ENABLE", wanted=2.0)
    if report.get("FS_EKF_ACTION") in {0.0, 2.0}:
        report.add(Level.WARNING, "EKF failsafe", f"FS_EKF_ACTION is {report.get('FS_EKF_ACTION'):g}: a lost position "
                   "stops nothing", "the boat sails on by a position that is wrong; in HOLD she drifts, and with "
                   "[operator] set_auto sails on when it is back", name="FS_EKF_ACTION", wanted=1.0)
    crash, angle = report.get("FS_CRASH_CHECK"), report.get("CRASH_ANGLE")
    if crash not in {None, 0.0} or angle not in {None, 0.0}:
        report.add(Level.WARNING, "crash check", "FS_CRASH_CHECK or CRASH_ANGLE is on",
                   "a becalmed or heeled sailboat looks crashed and is disarmed", wanted=0.0,
                   name="FS_CRASH_CHECK" if crash else "CRASH_ANGLE")
    _battery(report, needs)


def _battery(report: Report, needs: Needs) -> None:
    if not (report.get("BATT_MONITOR") or 0.0) > 0.0:
        return
    for name in ("BATT_FS_LOW_ACT", "BATT_FS_CRT_ACT"):
        action = report.get(name)
        if action is not None and needs.sails and int(action) in ADRIFT:
            report.add(Level.ERROR, "battery failsafe", f"{name} is {action:g}: a low battery means "
                       f"{MODES_FS[int(action)]}", DRIFTS, name=name, wanted=1.0)
    if report.get("BATT_FS_LOW_ACT") == 0.0:
        leads = "makes for the mission's refuge" if needs.has_refuge else (
            "would make for a refuge, if the mission named one ([[refuge]])")
        report.add(Level.INFO, "battery failsafe", "BATT_FS_LOW_ACT is 0: a low battery does nothing on the autopilot",
                   f"the companion says so, and at 10 % {leads}", name="BATT_FS_LOW_ACT")


def identity(report: Report, seen: Examined) -> None:
    """Look at the system ids."""
    own, station = report.get("SYSID_THISMAV"), report.get("SYSID_MYGCS")
    if own is not None and seen.system_id is not None and int(own) != seen.system_id:
        report.add(Level.WARNING, "system id", f"it calls itself {seen.system_id} and its parameter says {own:g}",
                   "a change of SYSID_THISMAV takes a reboot", name="SYSID_THISMAV")
    if seen.uid == "":
        report.add(Level.INFO, "board", "the autopilot tells no UID of its board",
                   "that it has become another one under way cannot be seen")
    if own is not None and station is not None and own == station:
        report.add(Level.ERROR, "system id", f"SYSID_MYGCS is the vehicle's own id {own:g}",
                   "the companion then counts as the ground station: its heartbeat keeps the station failsafe from "
                   "working, and its death triggers it", name="SYSID_MYGCS", wanted=255.0)


def signing(report: Report, seen: Examined) -> None:
    """Look at whether the link is signed and the key is here."""
    if seen.is_signed and not seen.has_key:
        answers = bool(seen.parameters)
        report.add(
            Level.WARNING if answers else Level.ERROR, "signing",
            "the autopilot signs its messages and no key was given",
            "it answers unsigned ones on this port (as on USB), not on others: give --signing-key FILE" if answers else
            "it refuses what is not signed: give --signing-key FILE, to 'companion run' as well")
    elif not seen.is_signed and not seen.has_key:
        report.add(Level.INFO, "signing", "nothing is signed: whoever can send to the autopilot orders the boat",
                   "where a stranger can (a telemetry radio), give it a key: 'companion key new', 'companion key set'")


def version(report: Report, seen: Examined) -> None:
    """Look at the version."""
    if seen.version is None:
        report.add(Level.INFO, "version", "the version was not told", "behaviour is assumed as in 4.2 to 4.7")
    elif seen.version[:2] < OLDEST:
        text = ".".join(map(str, seen.version))
        report.add(Level.WARNING, "version", f"ArduRover {text}", "older than 4.2: steered by L1, other waypoint rules")


def mission(report: Report, seen: Examined) -> None:
    """Look at the mission on board."""
    if seen.mission is None:
        report.add(Level.WARNING, "mission", "the mission could not be read", "it cannot be told whose it is")
        return
    if seen.mission and not ends_safely(seen.mission):
        report.add(Level.WARNING, "mission end", f"the mission on board ({len(seen.mission)} items) has no safe end",
                   "after its last item the boat does what MIS_DONE_BEHAVE says")
    held = [n for n, item in enumerate(seen.mission, start=1) if item.command == 16 and item.params[0] > 0.0]
    if held:
        report.add(Level.INFO, "waiting waypoints", f"item {held[0]} waits {seen.mission[held[0] - 1].params[0]:g} s",
                   "a sailboat circles while it waits")
    if seen.mission:
        report.add(Level.INFO, "mission", f"a mission of {len(seen.mission)} items is on board",
                   "unless it is the companion's own it is neither resumed nor replaced without permission")


def streams(report: Report, seen: Examined) -> None:
    """Look at the rates of the messages that a voyage needs."""
    if seen.rates_hz is None:
        return
    for name, wanted in RATES_HZ.items():
        rate = seen.rates_hz.get(name, 0.0)
        if rate < 0.1:
            report.add(Level.ERROR, "streams", f"no {name} is heard", "it was asked for and does not come: a router in "
                       "between, or another system id?")
        elif rate < wanted:
            report.add(Level.WARNING, "streams", f"{name} comes {rate:.1f} times a second", f"{wanted:g} are needed")
