"""What the autopilot does by itself when something is wrong: its fence, its failsafes, a sounder's depth."""

from __future__ import annotations

import math

from companion.boat import AutopilotLimits
from companion.doctor.report import Examined, Level, Needs, Report
from companion.words import counted

FENCE_ITEMS = 84  # what every board holds (672 bytes of storage, 8 each)
POLYGON_BIT = 4
MODES_FS = {
    0: "nothing",
    1: "RTL",
    2: "HOLD",
    3: "SmartRTL or RTL or HOLD",
    4: "SmartRTL or HOLD",
    5: "a disarming",
    6: "LOITER or HOLD",
}
ADRIFT = frozenset({2, 4, 5})  # what leaves a sailboat to drift: the boat's sails are eased and nobody steers
DRIFTS = "a sailboat in HOLD eases her sails and drifts, out of a fence and onto whatever is there"


def fence(report: Report, seen: Examined, needs: Needs) -> None:
    """Look at the fence that is on the autopilot and at what a breach does."""
    enabled, kind = report.get("FENCE_ENABLE"), report.get("FENCE_TYPE")
    radius, action = report.get("FENCE_RADIUS"), report.get("FENCE_ACTION")
    on = enabled is not None and enabled != 0
    if kind is not None and int(kind) & AutopilotLimits.CIRCLE_BIT and radius is not None and (on or needs.has_fence):
        inside = needs.reach_m + needs.margin_m <= radius
        report.add(
            Level.INFO if inside else Level.ERROR,
            "home circle",
            f"FENCE_TYPE {kind:g} includes the circle of {radius:g} m around home",
            "the voyage stays inside it"
            if inside
            else f"the voyage goes {needs.reach_m:.0f} m from home and breaches it; 4 means polygons only",
            name="FENCE_TYPE",
            wanted=None if inside else float(POLYGON_BIT),
        )
    if on and seen.fence is not None and not seen.fence and kind is not None and int(kind) == POLYGON_BIT:
        report.add(
            Level.WARNING,
            "empty fence",
            "a polygon fence is enabled and there is none on the autopilot",
            "it guards nothing",
            name="FENCE_ENABLE",
            wanted=0.0,
        )
    if seen.fence is not None and len(seen.fence) > FENCE_ITEMS:
        report.add(
            Level.ERROR,
            "fence size",
            f"{counted(len(seen.fence), 'fence item')}; boards hold {FENCE_ITEMS}",
            "the rest is not there: simplify it with 'companion fence'",
        )
    if not on and needs.has_fence:
        report.add(
            Level.WARNING,
            "fence off",
            "FENCE_ENABLE is 0 and the mission wants its fence on the autopilot",
            "the last line of defence is missing",
            name="FENCE_ENABLE",
            wanted=1.0,
        )
    if on and action is not None:
        does = MODES_FS.get(int(action), f"action {action:g}")
        drifts = needs.sails and int(action) in ADRIFT
        level = Level.ERROR if drifts else Level.WARNING if action == 0 else Level.INFO
        report.add(
            level,
            "fence action",
            f"on a breach: {does}" if action else "on a breach: only a report",
            "the fence stops nothing"
            if action == 0
            else DRIFTS
            if drifts
            else "it coasts about 7 m on at 3 m/s and sails straight home; with [operator] set_auto the companion "
            "plans the way back inside",
            name="FENCE_ACTION",
            wanted=1.0 if action == 0 or drifts else None,
        )


def failsafes(report: Report, needs: Needs) -> None:
    """Look at what the autopilot does when something is lost."""
    radio, station, action = report.get("FS_THR_ENABLE"), report.get("FS_GCS_ENABLE"), report.get("FS_ACTION")
    drifts = needs.sails and action is not None and int(action) in ADRIFT
    bad = Level.ERROR if drifts else Level.WARNING
    drift = f"; {DRIFTS}" if drifts else ""
    does = MODES_FS.get(int(action), f"action {action:g}") if action is not None else "an action that was not read"
    if radio == 1.0:
        report.add(
            bad,
            "radio failsafe",
            f"FS_THR_ENABLE is 1: out of RC range the boat goes to {does}",
            f"a voyage beyond RC range ends there; 2 continues the mission in AUTO{drift}",
            name="FS_THR_ENABLE",
            wanted=2.0,
        )
    elif radio == 0.0:
        report.add(
            Level.INFO,
            "radio failsafe",
            "FS_THR_ENABLE is 0: losing the RC does nothing",
            "the mission goes on",
            name="FS_THR_ENABLE",
        )
    if station == 0.0:
        report.add(
            Level.INFO,
            "station failsafe",
            "FS_GCS_ENABLE is 0: losing the ground station does nothing",
            "the mission goes on to its safe end; losing the companion never triggers anything",
            name="FS_GCS_ENABLE",
        )
    elif station is not None:
        quirk = station == 2.0 and radio not in {None, 0.0, 2.0}
        if station != 2.0 or quirk:
            report.add(
                bad,
                "station failsafe",
                f"FS_GCS_ENABLE is {station:g}: losing the ground station means {does}",
                "with FS_THR_ENABLE 1 'continue in AUTO' is ignored: set that to 2"
                if quirk
                else f"a voyage beyond its range ends there; 2 continues the mission in AUTO{drift}",
                name="FS_THR_ENABLE" if quirk else "FS_GCS_ENABLE",
                wanted=2.0,
            )
    if report.get("FS_EKF_ACTION") in {0.0, 2.0}:
        report.add(
            Level.WARNING,
            "EKF failsafe",
            f"FS_EKF_ACTION is {report.get('FS_EKF_ACTION'):g}: a lost position stops nothing",
            "the boat sails on by a position that is wrong; in HOLD she drifts, and with "
            "[operator] set_auto sails on when it is back",
            name="FS_EKF_ACTION",
            wanted=1.0,
        )
    crash, angle = report.get("FS_CRASH_CHECK"), report.get("CRASH_ANGLE")
    if crash not in {None, 0.0} or angle not in {None, 0.0}:
        report.add(
            Level.WARNING,
            "crash check",
            "FS_CRASH_CHECK or CRASH_ANGLE is on",
            "a becalmed or heeled sailboat looks crashed and is disarmed",
            wanted=0.0,
            name="FS_CRASH_CHECK" if crash else "CRASH_ANGLE",
        )
    _battery(report, needs)


def _battery(report: Report, needs: Needs) -> None:
    if not (report.get("BATT_MONITOR") or 0.0) > 0.0:
        return
    for name in ("BATT_FS_LOW_ACT", "BATT_FS_CRT_ACT"):
        action = report.get(name)
        if action is not None and needs.sails and int(action) in ADRIFT:
            report.add(
                Level.ERROR,
                "battery failsafe",
                f"{name} is {action:g}: a low battery means {MODES_FS[int(action)]}",
                DRIFTS,
                name=name,
                wanted=1.0,
            )
    if report.get("BATT_FS_LOW_ACT") == 0.0:
        leads = (
            "makes for the mission's refuge"
            if needs.has_refuge
            else ("would make for a refuge, if the mission named one ([[refuge]])")
        )
        report.add(
            Level.INFO,
            "battery failsafe",
            "BATT_FS_LOW_ACT is 0: a low battery does nothing on the autopilot",
            f"the companion says so, and at 10 % {leads}",
            name="BATT_FS_LOW_ACT",
        )


DOWN = 25.0  # of RNGFNDn_ORIENT
NMEA_SOUNDER = 17.0  # of RNGFNDn_TYPE: DBT, DPT and HDED
RANGEFINDER_PORT = 9.0  # of SERIALn_PROTOCOL
RANGEFINDERS = "123456789A"
SEEN_BELOW_M = 5.0  # beyond the least depth: a slope of 1 in 12 at 3 m/s is then told 20 s before
SHOALEST_M = 0.2


def sounder(report: Report, needs: Needs) -> None:
    """Look at the rangefinders of a boat whose depth is watched: one that looks down, and how far it reaches."""
    if needs.least_depth_m is None:
        return
    report.add(
        Level.INFO,
        "depth failsafe",
        "ArduRover has no depth failsafe of its own: no depth makes it change its mode or its way",
        "it is the companion alone that turns her back where it shoals; the autopilot's fence holds what a chart knows",
    )
    kinds = {n: kind for n in RANGEFINDERS if (kind := report.get(f"RNGFND{n}_TYPE"))}
    down = [n for n in kinds if report.get(f"RNGFND{n}_ORIENT") == DOWN]
    if not kinds:
        if report.get("RNGFND1_TYPE") is not None:
            report.add(
                Level.INFO,
                "sounder",
                "RNGFND1_TYPE is 0: the autopilot has no sounder",
                f"nothing tells it of a depth; for one that speaks NMEA 0183 it is {NMEA_SOUNDER:g}, RNGFND1_ORIENT "
                f"{DOWN:g}, and SERIALn_PROTOCOL {RANGEFINDER_PORT:g} of its port",
                name="RNGFND1_TYPE",
            )
        return
    if not down:
        first = next((n for n, kind in kinds.items() if kind == NMEA_SOUNDER), None)
        name = None if first is None else f"RNGFND{first}_ORIENT"
        report.add(
            Level.WARNING,
            "sounder",
            "no rangefinder looks down" + (f": {name} is {report.get(name):g}" if name else ""),
            "depths are told of one that does, and of no other",
            name=name,
            wanted=DOWN if name else None,
        )
        return
    ports = [report.get(f"SERIAL{n}_PROTOCOL") for n in range(1, 10)]
    if any(kinds[n] == NMEA_SOUNDER for n in down) and any(ports) and RANGEFINDER_PORT not in ports:
        report.add(
            Level.WARNING,
            "sounder",
            f"no SERIALn_PROTOCOL is {RANGEFINDER_PORT:g}: no port listens to the sounder",
            "its depths do not come: set it on the port that it is wired to",
        )
    for n in down:
        _reach(report, f"RNGFND{n}_", needs.least_depth_m)


def _reach(report: Report, prefix: str, least_m: float) -> None:
    """Look at between which depths a sounder tells."""
    name, reach_m, unit_m = _metres(report, f"{prefix}MAX")
    if reach_m is not None and reach_m < least_m + SEEN_BELOW_M:
        report.add(
            Level.WARNING,
            "sounder",
            f"{name} is {reach_m / unit_m:g}: depths beyond {reach_m:g} m are not told",
            f"a slope towards the {least_m:g} m that she needs is seen late; what is deeper counts as deep",
            name=name,
            wanted=math.ceil(least_m + 2.0 * SEEN_BELOW_M) / unit_m,
        )
    name, nearest_m, unit_m = _metres(report, f"{prefix}MIN")
    if nearest_m is not None and nearest_m > max(SHOALEST_M, least_m):
        report.add(
            Level.WARNING,
            "sounder",
            f"{name} is {nearest_m / unit_m:g}: depths below {nearest_m:g} m are not told",
            f"water that is less deep than the {least_m:g} m that she needs tells no depth at all",
            name=name,
            wanted=SHOALEST_M / unit_m,
        )


def _metres(report: Report, name: str) -> tuple[str, float | None, float]:
    """Return a distance's name, value [m] and unit [m]; before 4.7 it is in centimetres, and called so."""
    value, old = report.get(name), report.get(f"{name}_CM")
    if value is None and old is not None:
        return f"{name}_CM", old * 0.01, 0.01
    return name, value, 1.0
