"""The doctor: is this autopilot set up to be sailed, and what to set instead.

Pure: parameters, version, lists and message rates in, findings out. ``companion doctor`` reads them from an
autopilot, prints the findings, and sets parameters only when told to. Names are ArduPilot's; where 4.7 renamed a
parameter both names are understood. SIM_ parameters are never looked at. Here is what concerns sailing: boat, wind,
navigation; ``safety`` has the rest.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from companion.boat import (
    AutopilotLimits,
    Hull,
    Steering,
    SteeringBand,
    narrowest_corridor_m,
    proposed_margin,
    widest_corridor_m,
)
from companion.mavlink.microservices import lookup
from companion.mavlink.wire import believable
from companion.messages import MissionItem
from companion.skipper.step import ends_safely

__all__ = ["RATES_HZ", "DoctorFinding", "Examined", "Level", "Needs", "examine", "examine_steering"]


class Level(enum.IntEnum):
    """How bad it is."""

    INFO = 0  # good to know
    WARNING = 1  # may spoil a voyage
    ERROR = 2  # will


@dataclass(frozen=True, slots=True, kw_only=True)
class DoctorFinding:
    """One finding: what is, why it matters, and what to set (``wanted`` None: nothing that a parameter can do)."""

    level: Level
    code: str
    what: str
    why: str
    parameter: str | None = None
    value: float | None = None
    wanted: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Needs:
    """What the voyage needs of the autopilot; the defaults are those of a mission that says nothing."""

    no_go_half_rad: float = math.radians(45.0)  # the boat's, as the plans use it
    margin_m: float = 15.0
    margin_floor_m: float = 8.0
    goal_radius_m: float = 5.0
    loiter_radius_m: float = 15.0
    speed_mps: float = 3.0
    hull: Hull = field(default_factory=Hull)
    reach_m: float = 0.0  # farthest place of the voyage from home
    has_fence: bool = False  # the mission wants its fence on the autopilot
    has_refuge: bool = False  # the mission names a place for a critical battery
    sails: bool = True  # False: a motor boat
    can_tack: bool = True  # False: it gybes round, and no corridor of tacks is of use
    least_depth_m: float | None = None  # that a sounder may tell: her keel and the room under it; None: not watched


@dataclass(frozen=True, slots=True, kw_only=True)
class Examined:
    """What was read from the autopilot; a part that could not be read is None."""

    parameters: Mapping[str, float]
    version: tuple[int, int, int] | None = None
    mission: Sequence[MissionItem] | None = None
    fence: Sequence[MissionItem] | None = None
    rates_hz: Mapping[str, float] | None = None
    system_id: int | None = None  # of its heartbeats
    uid: str | None = None  # of its board, "" when it tells none
    is_signed: bool = False  # its frames carry signatures
    has_key: bool = False  # ours do too
    planner_speed: float | None = None  # of this computer, as a share of the reference core


class Report:
    """The findings so far, about the parameters that were read."""

    def __init__(self, parameters: Mapping[str, float]) -> None:
        self.parameters = parameters
        self.findings: list[DoctorFinding] = []

    def get(self, name: str) -> float | None:
        """Return a parameter under any of its names, None when it was not answered."""
        return lookup(self.parameters, name)

    def add(
        self, level: Level, code: str, what: str, why: str, *, name: str | None = None, wanted: float | None = None
    ) -> None:
        """Add a finding, about parameter ``name`` if one is given."""
        value = self.get(name) if name is not None else None
        self.findings.append(
            DoctorFinding(level=level, code=code, what=what, why=why, parameter=name, value=value, wanted=wanted)
        )

    def expect(self, level: Level, name: str, wanted: float, why: str) -> None:
        """Add a finding if a parameter was answered and is not as wanted."""
        value = self.get(name)
        if value is not None and value != wanted:
            self.add(level, name.lower(), f"{name} is {value:g}", why, name=name, wanted=wanted)


FENCE_ITEMS = 84  # what every board holds (672 bytes of storage, 8 each)
POLYGON_BIT = 4
RATES_HZ = {"WIND": 0.9, "GLOBAL_POSITION_INT": 0.9, "ATTITUDE": 0.9, "MISSION_CURRENT": 0.4, "EKF_STATUS_REPORT": 0.4}
OLDEST = (4, 3)  # before it the boat is steered by L1
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
            f"{len(seen.fence)} fence items; boards hold {FENCE_ITEMS}",
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
            f"the mission on board ({len(seen.mission)} items) has no safe end",
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
            f"a mission of {len(seen.mission)} items is on board",
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


def examine(seen: Examined, needs: Needs) -> tuple[DoctorFinding, ...]:
    """Return the findings, worst first, each once."""
    report = Report(seen.parameters)
    if not seen.parameters:
        report.add(
            Level.ERROR,
            "no parameters",
            "no parameter was answered",
            "what is not signed is not answered on this link"
            if seen.is_signed and not seen.has_key
            else "is another program using the link, or does a router in between let nothing through to it?",
        )
    else:
        report.expect(Level.ERROR, "FRAME_CLASS", 2.0, "no order is given to anything but a boat")
        for why in believable(seen.parameters)[1]:
            report.add(
                Level.ERROR, "impossible", why, "the companion sails by the default in its place", name=why.split()[0]
            )
        if needs.sails:
            _boat(report, needs)
            _wind(report)
        else:
            report.expect(Level.ERROR, "SAIL_ENABLE", 0.0, "the mission is for a motor boat")
        _navigation(report, needs)
        fence(report, seen, needs)
        failsafes(report, needs)
        sounder(report, needs)
        identity(report, seen)
    signing(report, seen)
    version(report, seen)
    mission(report, seen)
    streams(report, seen)
    _computer(report, seen)
    return tuple(sorted(report.findings, key=lambda f: (-f.level, f.code)))


def _boat(report: Report, needs: Needs) -> None:
    report.expect(Level.ERROR, "SAIL_ENABLE", 1.0, "without it the autopilot sails into the wind")
    no_go = report.get("SAIL_NO_GO_ANGLE")
    planned = math.degrees(needs.no_go_half_rad)
    if no_go is not None and no_go > planned + 0.5:
        report.add(
            Level.INFO,
            "no-go",
            f"SAIL_NO_GO_ANGLE {no_go:g}° is wider than the boat's {planned:g}°",
            f"plans keep to {no_go + 2.0:g}°: if the boat points higher, lower the parameter",
            name="SAIL_NO_GO_ANGLE",
        )
    if no_go is not None and no_go < planned - 5.0:
        report.add(
            Level.WARNING,
            "no-go",
            f"SAIL_NO_GO_ANGLE {no_go:g}° is narrower than the boat's {planned:g}°",
            "in a header the autopilot points higher than the boat sails",
            name="SAIL_NO_GO_ANGLE",
            wanted=planned,
        )
    limits = AutopilotLimits.from_params(
        believable({name: value for name in AutopilotLimits.PARAMETERS if (value := report.get(name)) is not None})[0]
    )
    if not needs.can_tack:
        if limits.sail_xtrack_max_m > 0.0:
            report.add(
                Level.WARNING,
                "corridor",
                f"SAIL_XTRACK_MAX is {limits.sail_xtrack_max_m:g}, and this boat cannot tack",
                "when a shift closes a leg the autopilot tries to tack at that corridor's edge; "
                "at 0 it sails on, and the companion gybes round",
                name="SAIL_XTRACK_MAX",
                wanted=0.0,
            )
    else:
        _corridor(report, needs, limits)
    loiter = report.get("SAIL_LOIT_RADIUS")
    if loiter is not None and 2.5 * loiter > needs.loiter_radius_m:
        report.add(
            Level.WARNING,
            "loiter",
            f"SAIL_LOIT_RADIUS {loiter:g} m needs about {2.5 * loiter:.0f} m of room",
            f"the mission's end is chosen with {needs.loiter_radius_m:g} m",
            name="SAIL_LOIT_RADIUS",
            wanted=math.floor(needs.loiter_radius_m / 2.5),
        )
    report.expect(Level.INFO, "LOIT_TYPE", 1.0, "a sailboat keeps moving in a loiter; 1 turns it bow to the point")


def _corridor(report: Report, needs: Needs, limits: AutopilotLimits) -> None:
    """Hold corridor and margin against each other, once for both: what is wanted of one must not spoil the other."""
    corridor_m, speed_mps = limits.sail_xtrack_max_m, needs.speed_mps
    narrowest_m = narrowest_corridor_m(speed_mps)
    fitting_m = widest_corridor_m(limits, needs.margin_m, speed_mps=speed_mps, hull=needs.hull)
    proposed = proposed_margin(limits, speed_mps=speed_mps, hull=needs.hull)
    if corridor_m < narrowest_m:
        wanted = narrowest_m if fitting_m is None else fitting_m
        if corridor_m <= 0.0:
            what = "SAIL_XTRACK_MAX is 0: no corridor when a shift closes a leg"
            why = (
                "the autopilot then sails long boards to the layline, wherever that is; the companion reacts, but "
                "if it dies nothing bounds the boat"
            )
        else:
            what = f"SAIL_XTRACK_MAX {corridor_m:g} m is soon crossed at {speed_mps:.1f} m/s"
            why = "when a shift closes a leg the autopilot does little but tack"
        report.add(Level.WARNING, "corridor", what, why, name="SAIL_XTRACK_MAX", wanted=wanted)
    if proposed.margin.total_m > needs.margin_m + 1e-6:
        narrows = fitting_m is not None and fitting_m < corridor_m
        report.add(
            Level.WARNING,
            "margin",
            f"the margin of {needs.margin_m:g} m is less than {proposed.margin.describe()}",
            "when a shift closes a leg the autopilot beats in its corridor: "
            f"{'narrow it, or ' if narrows else ''}plan with [area] margin_m = {proposed.margin_m:g}",
            name="SAIL_XTRACK_MAX",
            wanted=fitting_m if narrows else None,
        )


def _wind(report: Report) -> None:
    kind = report.get("WNDVN_TYPE")
    speed = report.get("WNDVN_SPEED_TYPE")
    if kind == 0:
        report.add(
            Level.ERROR,
            "vane",
            "WNDVN_TYPE is 0: no wind vane",
            "arming is refused, and nothing can be planned",
            name="WNDVN_TYPE",
        )
    elif kind in {1.0, 2.0}:
        report.add(
            Level.ERROR,
            "vane",
            f"WNDVN_TYPE is {kind:g}: the wind is the heading at arming, not a measurement",
            "it may serve a short try in steady wind, no voyage",
            name="WNDVN_TYPE",
        )
    elif kind == 11.0:
        report.add(
            Level.ERROR,
            "vane",
            "WNDVN_TYPE is 11: the simulator's apparent wind, which the model never fills",
            "the boat tacks at random",
            name="WNDVN_TYPE",
            wanted=10.0,
        )
    if speed == 0:
        report.add(
            Level.WARNING,
            "wind speed",
            "WNDVN_SPEED_TYPE is 0: no wind speed sensor",
            "the autopilot's true wind is then vane plus heading: wrong whenever the boat moves",
            name="WNDVN_SPEED_TYPE",
        )
    minimum = report.get("WNDVN_SPEED_MIN")
    if minimum is not None and minimum > 0.0:
        report.add(
            Level.INFO,
            "held wind",
            f"below WNDVN_SPEED_MIN {minimum:g} m/s the old true wind is held",
            "it looks fresh; the wind watch marks it as held",
            name="WNDVN_SPEED_MIN",
        )
    cut_hz = report.get("WNDVN_TRUE_FILT")
    if cut_hz is not None and cut_hz > 0.0:
        lag_s = 1.0 / (2.0 * math.pi * cut_hz)
        level = Level.INFO if lag_s < 5.0 else Level.WARNING
        report.add(
            level,
            "wind filter",
            f"WNDVN_TRUE_FILT {cut_hz:g} Hz: the true wind lags {lag_s:.1f} s",
            "the forecaster accounts for it; a longer lag delays the answer to a header",
            name="WNDVN_TRUE_FILT",
            wanted=None if lag_s < 5.0 else 0.05,
        )


def _navigation(report: Report, needs: Needs) -> None:
    radius = report.get("WP_RADIUS")
    if radius is not None and radius > needs.goal_radius_m:
        report.add(
            Level.WARNING,
            "waypoint radius",
            f"WP_RADIUS {radius:g} m is more than the goal's radius {needs.goal_radius_m:g} m",
            "waypoints count as reached, and corners are cut, that far off",
            name="WP_RADIUS",
            wanted=max(1.0, math.floor(min(needs.goal_radius_m, 3.0))),
        )
    avoid = report.get("AVOID_ENABLE")
    if avoid is not None and avoid != 0:
        report.add(
            Level.WARNING,
            "avoidance",
            f"AVOID_ENABLE is {avoid:g}",
            "near a fence the autopilot eases the sail, and outside an inclusion fence it may never move again "
            "(ArduPilot issue 34218); it does not keep the boat out either",
            name="AVOID_ENABLE",
            wanted=0.0,
        )
    oa_type = report.get("OA_TYPE")
    if oa_type is not None and oa_type != 0:
        report.add(
            Level.WARNING,
            "two planners",
            f"OA_TYPE is {oa_type:g}",
            "the autopilot's path planner knows no wind and bends the companion's legs",
            name="OA_TYPE",
            wanted=0.0,
        )
    report.expect(
        Level.WARNING, "MIS_RESTART", 0.0, "at 1 every return to AUTO begins the mission again at its first item"
    )
    if report.get("MIS_DONE_BEHAVE") == 0:
        report.add(
            Level.INFO,
            "mission end",
            "MIS_DONE_BEHAVE is 0: HOLD after the last item",
            "HOLD drifts; the companion's missions end in a loiter of their own",
            name="MIS_DONE_BEHAVE",
            wanted=1.0,
        )


LATE, NARROW = 0.03, 0.3  # of the reference core: plans come late; in narrow water they are not as fast


def _computer(report: Report, seen: Examined) -> None:
    """Say how fast this computer plans, where that was measured, and what follows from it."""
    speed = seen.planner_speed
    if speed is None:
        return
    what = f"this computer plans at {100.0 * speed:.0f} % of the reference core"
    if speed >= NARROW:
        report.add(Level.INFO, "computer", what, "as good as plans can be, and in time")
    elif speed >= LATE:
        report.add(
            Level.INFO,
            "computer",
            what,
            "plans come in time; in narrow water they are somewhat slower ways: "
            "less is looked at in their budget ([skipper] planning_budget_s)",
        )
    else:
        report.add(
            Level.WARNING,
            "computer",
            what,
            "plans come late, and are asked for so much earlier; is something "
            "else at work on it, or is it throttled by heat or a weak supply?",
        )


# ----------------------------------------------------------------------------------------- steering
MOST_STEP = 0.3  # of a parameter, at once
FF_OFF, FF_APART = 0.15, 0.4  # from what logs show, and one band's from another's (shares)
HARD_OVER, SWINGS_RAD, MANY_REVERSALS = 0.2, math.radians(2.0), 40.0
OVERSHOOT_RAD, LEEWARD_RAD = math.radians(15.0), math.radians(3.0)
SLOW_TACK_S, LAG_S, ASTERN, HEELED = 5.0, 1.0, 0.02, 0.1
BUILDS_MPS = 1.0  # ArduRover's integrator builds above it alone
LATER = "; one group of parameters at a time: after the next log"


def examine_steering(steering: Steering, parameters: Mapping[str, float] | None = None) -> tuple[DoctorFinding, ...]:
    """Return what logs say of the autopilot's tuning; only the first group that wants a change has one proposed.

    Args:
        steering: what the logs tell.
        parameters: as the autopilot has them now; where they are not given, as the logs tell them.

    """
    report = Report(steering.parameters if parameters is None else parameters)
    _swings(report, steering)
    _rate_control(report, steering)
    _turns(report, steering)
    _steady(report, steering)
    report.add(
        Level.INFO,
        "tuning sails",
        "SAIL_ANGLE_IDEAL, _MIN and _MAX cannot be judged by these logs",
        "the sheet follows the apparent wind by them, so that each wind was sailed with one trim: sail a reach there "
        "and back with SAIL_ANGLE_IDEAL 5 more, and again with 5 less, and compare what is learned from each",
        name="SAIL_ANGLE_IDEAL",
    )
    first: DoctorFinding | None = None
    findings = []
    for f in report.findings:
        if first is not None and f.wanted is not None:
            findings.append(replace(f, level=Level.INFO, wanted=None, why=f.why + LATER))
            continue
        if f.wanted is not None:
            first = f
        findings.append(f)
    return tuple(findings)


def _step(value: float | None, share: float) -> float | None:
    """Return a parameter moved by a share of it, ``MOST_STEP`` at most; None: it is not known, or nothing."""
    if not value:
        return None
    return float(f"{value * min(max(share, 1.0 - MOST_STEP), 1.0 + MOST_STEP):.3g}")


def _speeds_of(band: SteeringBand) -> str:
    return f"at {band.low_mps:g} to {band.high_mps:g} m/s"


def _rate_control(report: Report, steering: Steering) -> None:
    told = [b for b in steering.bands if b.ff is not None]
    if not told:
        report.add(
            Level.INFO,
            "tuning FF",
            "the logs hold too few turns to tell ATC_STR_RAT_FF by",
            "two waypoints across the wind and back, ten times, tell it",
            name="ATC_STR_RAT_FF",
        )
        return
    total_s = sum(b.turning_s for b in told)
    seen = sum(b.turning_s * (b.ff or 0.0) for b in told) / total_s
    by_band = ", ".join(f"{b.ff:.2f} {_speeds_of(b)}" for b in told)
    now = report.get("ATC_STR_RAT_FF")
    off = now is not None and now > 0.0 and abs(seen / now - 1.0) > FF_OFF
    report.add(
        Level.WARNING if off else Level.INFO,
        "tuning FF",
        f"{total_s:.0f} s of turns ask for ATC_STR_RAT_FF {seen:.2f} ({by_band})",
        "the rate of turn is not what is asked for, and P and I work against it: FF first, then P and I below it"
        if off
        else "as it is"
        if now is not None
        else "the logs do not tell what it is",
        name="ATC_STR_RAT_FF",
        wanted=_step(now, seen / now) if off and now is not None else None,
    )
    ff = [b.ff for b in told if b.ff is not None]
    if max(ff) > (1.0 + FF_APART) * min(ff):
        report.add(
            Level.INFO,
            "tuning scale",
            f"it differs with her speed: {by_band}",
            "MOT_SPD_SCA_BASE is where the rudder begins to be scaled down by the speed: too low, and she overshoots "
            "when she is fast",
            name="MOT_SPD_SCA_BASE",
        )
    for band in steering.bands:
        if band.lag_s is not None and band.lag_s > LAG_S:
            report.add(
                Level.INFO,
                "tuning lag",
                f"{_speeds_of(band)} the rate of turn follows what is asked for by {band.lag_s:.1f} s",
                "a slow servo, play in the rudder, or ATC_STR_RAT_FLTT: gains above what this allows swing",
            )


def _swings(report: Report, steering: Steering) -> None:
    swinging = [b for b in steering.bands if b.swing_hz is not None and b.swing_rad > SWINGS_RAD]
    if swinging:
        worst = max(swinging, key=lambda b: b.swing_rad)
        report.add(
            Level.WARNING,
            "tuning P",
            f"{_speeds_of(worst)} bow and rudder swing together by {math.degrees(worst.swing_rad):.0f} degrees, "
            f"{worst.swing_hz:.2f} times a second",
            "too much ATC_STR_RAT_P, unless it is the waves: judge it in flat water",
            name="ATC_STR_RAT_P",
            wanted=_step(report.get("ATC_STR_RAT_P"), 1.0 - MOST_STEP),
        )
        return
    busy = [b for b in steering.bands if b.reversals_per_min is not None and b.reversals_per_min > MANY_REVERSALS]
    if busy:
        worst = max(busy, key=lambda b: b.reversals_per_min or 0.0)
        report.add(
            Level.WARNING,
            "tuning P",
            f"{_speeds_of(worst)} the rudder reverses {worst.reversals_per_min:.0f} times a minute on a course",
            "it wears the servo, brakes the boat and steers nothing: less ATC_STR_RAT_P",
            name="ATC_STR_RAT_P",
            wanted=_step(report.get("ATC_STR_RAT_P"), 1.0 - MOST_STEP),
        )


def _turns(report: Report, steering: Steering) -> None:
    if steering.overshoot_rad is not None and steering.overshoot_rad > OVERSHOOT_RAD:
        report.add(
            Level.WARNING,
            "tuning angle",
            f"after turns the bow goes {math.degrees(steering.overshoot_rad):.0f} degrees past the new course",
            "ATC_STR_ANG_P asks for more turn than the rudder stops in time",
            name="ATC_STR_ANG_P",
            wanted=_step(report.get("ATC_STR_ANG_P"), 0.8),
        )
    stuck = [b for b in steering.bands if b.saturated > HARD_OVER]
    if stuck:
        worst = max(stuck, key=lambda b: b.saturated)
        report.add(
            Level.WARNING,
            "tuning rate",
            f"{_speeds_of(worst)} the rudder is hard over for {100.0 * worst.saturated:.0f} % of the time",
            "more turn is asked for than she has: a rudder hard over is a brake",
            name="ATC_STR_RAT_MAX",
            wanted=_step(report.get("ATC_STR_RAT_MAX"), 1.0 - MOST_STEP),
        )
    slow = steering.tack_s is not None and steering.tack_s > SLOW_TACK_S
    if steering.time_outs or slow:
        took = "" if steering.tack_s is None else f"; one takes {steering.tack_s:.1f} s"
        report.add(
            Level.WARNING if steering.time_outs else Level.INFO,
            "tuning tacks",
            f"{steering.time_outs} of {steering.tacks} tacks were given up{took}",
            "where they stall, the bow is turned faster than way lasts: a lower WP_PIVOT_RATE turns by the rudder's "
            "flow, not against it",
            name="WP_PIVOT_RATE",
            wanted=_step(report.get("WP_PIVOT_RATE"), 0.8) if steering.time_outs else None,
        )


def _steady(report: Report, steering: Steering) -> None:
    for band in steering.bands:
        error = band.steady_error_rad
        if error is None or abs(error) <= LEEWARD_RAD:
            continue
        what = (
            f"{_speeds_of(band)} she lies {math.degrees(abs(error)):.0f} degrees to "
            f"{'leeward' if error > 0.0 else 'windward'} of the heading that is asked for, whichever side she heels to"
        )
        if band.low_mps < BUILDS_MPS:
            report.add(
                Level.INFO,
                "tuning I",
                what,
                "below 1 m/s ArduRover's integrator does not build: no gain mends it, the rig's balance does",
            )
        else:
            report.add(
                Level.WARNING,
                "tuning I",
                what,
                "ATC_STR_RAT_I takes too long, or ATC_STR_RAT_IMAX ends it",
                name="ATC_STR_RAT_I",
                wanted=_step(report.get("ATC_STR_RAT_I"), 1.0 + MOST_STEP),
            )
    if steering.astern > ASTERN:
        report.add(
            Level.INFO,
            "tuning astern",
            f"she goes astern for {100.0 * steering.astern:.0f} % of the time that she is steered",
            "the rudder is then turned round, as for one in reverse: in irons, or in an adverse stream, that holds her",
        )
    if steering.heeled is not None and steering.heeled > HEELED:
        report.add(
            Level.WARNING,
            "tuning heel",
            f"she heels more than SAIL_HEEL_MAX for {100.0 * steering.heeled:.0f} % of the time",
            "the sheet is not eased enough above it (ATC_SAIL_P), or it is lower than she sails by",
            name="ATC_SAIL_P",
            wanted=_step(report.get("ATC_SAIL_P"), 1.0 + MOST_STEP),
        )
