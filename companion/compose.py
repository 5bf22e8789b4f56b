"""From a mission file to the values that the rooms want: boat, voyage, skipper, planner, wind and water."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from companion.addresses import Displays, OutputName, parse_nmea, parse_signalk
from companion.boat import Boat, Hull, Polar, ardurover_sitl, avalon, constant, polar_of_table, read_polar
from companion.current import STILL, Prior, TideTable, read_table, read_tide
from companion.current.prior import table_lines
from companion.disk import read_regular
from companion.errors import InputError, unreadable
from companion.field.tree import (
    LEAST,
    MAX,
    PROJECT,
    Along,
    Atom,
    AwayFrom,
    AwayFromLine,
    FieldConditions,
    FieldTree,
    Heading,
    OutOf,
    PointTo,
    Round,
    StayAt,
    is_name,
    lengths,
    names_in,
    parse,
    projects,
)
from companion.field.values import GuidanceSettings, Situation
from companion.fold import Waters
from companion.geo.frame import RANGE_M, LocalFrame
from companion.geofence import Code, Finding, FindingLevel, LocalArea, Mission
from companion.geofence.mission import (
    AtomOptions,
    BoatFile,
    BoatOptions,
    CircleAtomOptions,
    GoalField,
    GoalGate,
    HeadingAtomOptions,
    LeaveAtomOptions,
    LineAtomOptions,
    MarkOptions,
    MissionGoal,
    PointAtomOptions,
    RepulsiveLineAtomOptions,
    RepulsivePointAtomOptions,
    StationAtomOptions,
    free_water,
    polar_path,
    read_boat_file,
)
from companion.geofence.shapes import polygon_en
from companion.messages import GeoPoint
from companion.orders import ALL, Verb, unknown
from companion.planners import ALGORITHMS, AUTO, PlannerChoice
from companion.skipper import SkipperConfig, Voyage
from companion.skipper.step import Ends, Guidance, Learning, Permissions, ReplanPolicy, SafeEnd
from companion.skipper.way import (
    KEEP_SHARE,
    SAME_M,
    TIDE_DOUBT_M,
    Box,
    Composed,
    DryingWater,
    Goal,
    Line,
    Refuge,
    Search,
    Side,
    Until,
)
from companion.traffic import Policy, TargetLimits
from companion.traffic.feeds import FeedName, parse_feed
from companion.wind import Estimator, make
from companion.words import listed

__all__ = [
    "POLARS",
    "RECENTRE_M",
    "boat_of",
    "config_of",
    "displays_of",
    "estimator_of",
    "feeds_of",
    "permissions_of",
    "planner_of",
    "polar_of",
    "polar_of_file",
    "sounder_of",
    "speed_error_of",
    "target_limits_of",
    "voyage_of",
    "water_of",
    "waters_of",
    "whole_polar",
]

# What a guess at a polar, waves, leeway and tacks that fail take of the speeds: arrivals of `sitl mismatch` spread so.
UNSAID_ERROR_PERCENT = 30.0
BETWEEN_M = 1.0  # of room between a rounding and what is kept clear of the next mark
POLARS: dict[str, Callable[[], Polar]] = {"ardurover": ardurover_sitl, "avalon": avalon}


def polar_of(mission: Mission) -> Polar:
    """Return the mission's polar."""
    return polar_named(mission.boat, mission.path)


def polar_named(boat: BoatOptions, source: Path) -> Polar:
    """Return the polar that ``[boat]`` of a file names. Raises InputError."""
    path = polar_path(boat, source)
    if path is not None:
        return whole_polar(path)
    polar = boat.polar
    if isinstance(polar, str):
        maker = POLARS.get(polar)
        if maker is None:
            raise InputError(
                str(source),
                "[boat] polar",
                f"there is no polar {polar!r}",
                'write "ardurover", "avalon", a polar file beside the mission, or a speed in m/s',
            )
        return maker()
    return constant(float(polar))


def whole_polar(path: str | Path) -> Polar:
    """Return the polar of a boat file, or of a polar file in which nothing had to be guessed. Raises InputError."""
    if Path(path).suffix == ".toml":
        return polar_of_file(read_boat_file(Path(path)), str(path))
    file = read_polar(path)
    if file.warnings:
        raise InputError(str(path), "", file.warnings[0], "fill it in: a guessed polar is not sailed")
    return file.polar


def polar_of_file(file: BoatFile, source: str) -> Polar:
    """Return the polar of a boat file that came from ``source``. Raises InputError."""
    table = file.polar
    return polar_of_table(table.twa_deg, table.tws_mps, table.speed_mps, name=file.name, source=source)


def speed_error_of(boat: BoatOptions) -> float:
    """Return how far a boat's speeds may be off together, as the deviation of the logarithm."""
    said = boat.speed_error_percent
    return (UNSAID_ERROR_PERCENT if said is None else said) / 100.0


def shape_error_of(mission: Mission) -> Polar | None:
    """Return how far each speed of a learned boat may be off beside all of them; None: its file does not say."""
    path = mission.polar_path
    if path is None or path.suffix != ".toml":
        return None
    file = read_boat_file(path)
    table, common = file.polar, speed_error_of(file.boat)
    if not table.error_percent:
        return None
    rest = [[min(math.sqrt(max((0.01 * e) ** 2 - common**2, 0.0)), 1.0) for e in row] for row in table.error_percent]
    # Nearer to the wind and in less of it than the table says it is no better known: a polar goes to zero there.
    twa_deg, tws_mps = [*table.twa_deg], [*table.tws_mps]
    if twa_deg[0] > 0.0:
        twa_deg, rest = [0.0, *twa_deg], [rest[0], *rest]
    if tws_mps[0] > 0.0:
        tws_mps, rest = [0.0, *tws_mps], [[row[0], *row] for row in rest]
    return polar_of_table(twa_deg, tws_mps, rest, name="error", source=str(path))


def sailed_boat(options: BoatOptions, polar: Polar) -> Boat:
    """Return what her speeds, her best angles and a passage are reckoned by."""
    return Boat(
        polar=polar,
        no_go_half_rad=math.radians(options.no_go_half_deg),
        max_twa_rad=math.radians(options.max_twa_deg),
        tack_loss_s=options.tack_loss_s,
        leeway_rad=math.radians(options.leeway_deg),
        max_tws_mps=options.max_tws_mps,
    )


def boat_of(mission: Mission) -> Boat:
    """Return the mission's boat; one that does not sail has no no-go zone, and tacks cost it nothing."""
    if mission.autopilot.frame == "motor":
        if isinstance(mission.boat.polar, str):
            raise InputError(
                str(mission.path),
                "[boat] polar",
                f"a motor boat has no polar, and hers is {mission.boat.polar!r}",
                "write her speed [m/s]: polar = 2.0",
            )
        return Boat(
            polar=polar_of(mission),
            no_go_half_rad=0.0,
            has_motor=True,
            turn_rate_radps=math.radians(mission.boat.turn_rate_deg_s),
            hull=Hull(length_m=mission.boat.length_m, beam_m=mission.boat.beam_m),
        )
    return Boat(
        polar=polar_of(mission),
        no_go_half_rad=math.radians(mission.boat.no_go_half_deg),
        max_twa_rad=math.radians(mission.boat.max_twa_deg),
        turn_rate_radps=math.radians(mission.boat.turn_rate_deg_s),
        tack_loss_s=mission.boat.tack_loss_s,
        gybe_loss_s=mission.boat.gybe_loss_s,
        can_tack=mission.boat.can_tack,
        gybe_room_m=mission.boat.gybe_room_m,
        hull=Hull(length_m=mission.boat.length_m, beam_m=mission.boat.beam_m),
        has_motor=mission.boat.motor,
        leeway_rad=math.radians(mission.boat.leeway_deg),
        max_tws_mps=mission.boat.max_tws_mps,
        min_tws_mps=mission.boat.min_tws_mps,
        tack_fails=mission.boat.tack_fails if mission.boat.can_tack else 0.0,
        speed_error=speed_error_of(mission.boat),
        told_speed_error=(mission.boat.speed_error_percent or 0.0) / 100.0,
        no_go_error_rad=math.radians(mission.boat.no_go_error_deg),
        shape_error=shape_error_of(mission),
    )


def planner_of(mission: Mission) -> PlannerChoice:
    """Return the mission's planner and its numbers.

    Raises:
        InputError: a number is another planner's, a tunnel has no width, or a goal has a heading for another planner.
    """
    options, algorithm = mission.options.planner, mission.skipper.planner
    given = {key: value for key in options.__struct_fields__ if (value := getattr(options, key)) is not None}
    expansions = given.pop("expansions", None)
    if expansions is not None and algorithm == AUTO.algorithm:
        others = " and ".join(f'"{name}"' for name in ALGORITHMS if name != AUTO.algorithm)
        raise InputError(
            str(mission.path), "[planner] expansions", f"is for {others}", "write [skipper] expansions for auto's"
        )
    keys = {name: {key.key for key in row.keys.values()} for name, row in ALGORITHMS.items()}
    for key in given:
        if key not in keys[algorithm]:
            whose = next(name for name, own in keys.items() if key in own)
            raise InputError(
                str(mission.path),
                f"[planner] {key}",
                f"is a number of {whose!r}, and this mission plans by {algorithm!r}",
                f'write [skipper] planner = "{whose}", or leave it out',
            )
    if "tunnel" in given and "tunnel_width_m" not in given:
        raise InputError(str(mission.path), "[planner] tunnel", "a tunnel has a width", "add tunnel_width_m")
    headed = next((n for n, goal in enumerate(mission.goals, start=1) if goal.heading_deg is not None), None)
    if headed is not None and algorithm != "astar":
        raise InputError(
            str(mission.path),
            f"[[goal]] {headed} heading_deg",
            f"is for 'astar', and this mission plans by {algorithm!r}",
            'write [skipper] planner = "astar", or leave it out',
        )
    if algorithm == AUTO.algorithm:
        return AUTO
    return PlannerChoice(algorithm=algorithm, settings=ALGORITHMS[algorithm].settings_of(given), expansions=expansions)


LEAST_LINE_M = 1.0
MOST_ATOMS = 64


def composed_field_of(mission: Mission, number: int, by_field: GoalField, frame: LocalFrame) -> Composed:
    """Return the field of the mission's goal ``number`` (from 1). Raises InputError with the place and a remedy."""
    source, place = str(mission.path), f"[[goal]] {number} field"
    atoms = atoms_of(mission, frame)
    expression = parse(by_field.text, tuple(atoms), source, place)
    if projects(expression) and mission.autopilot.frame == "motor":
        raise InputError(
            source,
            place,
            f"{PROJECT}(...) keeps out of the no-go zone, and a motor boat has none",
            "write what is in its brackets alone",
        )
    tree = FieldTree(expression=expression, atoms=tuple((name, atoms[name]) for name in names_in(expression)))
    return Composed(
        tree=tree,
        until=Until(by_field.until),
        for_s=by_field.for_s,
        water_en=None if by_field.shape is None else polygon_en(by_field.shape, frame, cover=False),
    )


def atoms_of(mission: Mission, frame: LocalFrame) -> dict[str, Atom]:
    """Return the atoms of a mission by their names, in its local frame. Raises InputError."""
    source, options = str(mission.path), mission.options.field
    if len(options) > MOST_ATOMS:
        raise InputError(source, "[field]", f"there are {len(options)} atoms", f"{MOST_ATOMS} are the most")
    out: dict[str, Atom] = {}
    for name, atom in options.items():
        if not is_name(name):
            raise InputError(
                source,
                f"[field.{name[:40]}]",
                "is no name that an expression can have",
                f"write letters, digits and _, a letter first; {MAX} and {PROJECT} mean something else",
            )
        out[name] = _atom(mission, name, atom, frame)
    return out


def require_fields(mission: Mission) -> None:
    """Raise InputError for atoms and fields that cannot be sailed, and for those on another sea than their goal.

    Under way, in a frame that moves along, they are made again and not looked at again.
    """
    atoms_of(mission, mission.frame())
    for name, atom in mission.options.field.items():
        if isinstance(atom, LineAtomOptions | RepulsiveLineAtomOptions):
            length_m = math.hypot(*_en(atom.end, LocalFrame(_geo(atom.start))))
            if length_m < LEAST_LINE_M:
                raise InputError(
                    str(mission.path),
                    f"[field.{name}]",
                    f"start and end are {length_m:.1f} m apart",
                    "a line has two places",
                )
    for number, goal in enumerate(mission.goals, start=1):
        if goal.field is None:
            continue
        for name, made in composed_field_of(mission, number, goal.field, LocalFrame(goal.point)).tree.atoms:
            places = (getattr(made, key, None) for key in ("at_en", "from_en", "to_en"))
            far_m = max((math.hypot(*place) for place in places if place is not None), default=0.0)
            if not far_m <= RANGE_M:
                raise InputError(
                    str(mission.path),
                    f"[field.{name}]",
                    f"is {far_m / 1000.0:.0f} km from [[goal]] {number}, which is sailed by it",
                    "are lat and lon swapped? a field is sailed within 50 km",
                )


def field_words(mission: Mission) -> tuple[str, ...]:
    """Return a line for each goal that is sailed by a field: which, and what ends it."""
    frame, out = mission.frame(), []
    for number, goal in enumerate(mission.goals, start=1):
        if goal.field is not None:
            made = composed_field_of(mission, number, goal.field, frame)
            name = f", {goal.name}" if goal.name else ""
            out.append(f"goal {number}{name}: by field {made.tree.text}, {made.until_words}")
    return tuple(out)


def field_findings_of(mission: Mission) -> tuple[Finding, ...]:
    """Return what is worth knowing of a mission's fields: atoms that nobody sails by, a field without a value."""
    out, told = [], set()
    for number, goal in enumerate(mission.goals, start=1):
        if goal.field is None:
            continue
        frame = LocalFrame(goal.point)
        tree = composed_field_of(mission, number, goal.field, frame).tree
        told |= {name for name, _ in tree.atoms}
        place = frame.en_from_geo(goal.point)
        found = float(lengths(tree, preview_conditions(mission, place), np.array([place]))[0])
        if found < LEAST and tree.station_en is None and goal.field.until != "place":
            out.append(
                Finding(
                    severity=FindingLevel.WARNING,
                    code=Code.FIELD,
                    place=f"[[goal]] {number} field",
                    text=f"{tree.text} has no value at the goal's own place ({found:.2f} of 10): it cannot steer there",
                    remedy="place it where the field leads somewhere",
                )
            )
    left = [name for name in mission.options.field if name not in told]
    if left:
        out.append(
            Finding(
                severity=FindingLevel.WARNING,
                code=Code.FIELD,
                place="[field]",
                text=f"no goal is sailed by {listed(left)}",
                remedy="name it in a goal's field",
            )
        )
    return tuple(out)


def preview_conditions(mission: Mission, at_en: tuple[float, float]) -> FieldConditions:
    """Return a boat that lies at ``at_en`` in the wind that previews assume."""
    sails = mission.autopilot.frame == "sailboat"
    return FieldConditions(
        seen=Situation(
            t_s=0.0,
            en_m=at_en,
            velocity_en_mps=(0.0, 0.0),
            heading_rad=0.0,
            tws_mps=mission.wind.preview_speed_mps,
            twd_from_rad=math.radians(mission.wind.preview_from_deg) if sails else None,
        ),
        habits=GuidanceSettings(
            is_sailing=sails,
            no_go_half_rad=math.radians(mission.boat.no_go_half_deg),
            turn_rate_radps=math.radians(mission.boat.turn_rate_deg_s),
            tack_s=max(1.0, mission.boat.tack_loss_s),
        ),
    )


def _atom(mission: Mission, name: str, atom: AtomOptions, frame: LocalFrame) -> Atom:
    if isinstance(atom, HeadingAtomOptions):
        return Heading(heading_rad=math.radians(atom.heading_deg))
    if isinstance(atom, LeaveAtomOptions):
        return OutOf(water_en=polygon_en(mission.waters[name], frame, cover=False))
    if isinstance(atom, LineAtomOptions | RepulsiveLineAtomOptions):
        ends = [_en(mark, frame) for mark in (atom.start, atom.end)]
        if isinstance(atom, LineAtomOptions):
            return Along(from_en=ends[0], to_en=ends[1], zone_m=atom.zone_m)
        return AwayFromLine(from_en=ends[0], to_en=ends[1], range_m=atom.range_m)
    at_en = _en(atom, frame)
    if isinstance(atom, PointAtomOptions):
        return PointTo(at_en=at_en, zone_m=atom.zone_m)
    if isinstance(atom, StationAtomOptions):
        return StayAt(at_en=at_en, zone_m=atom.zone_m)
    if isinstance(atom, CircleAtomOptions):
        return Round(at_en=at_en, radius_m=atom.radius_m, is_clockwise=atom.turn == "clockwise", zone_m=atom.zone_m)
    return AwayFrom(at_en=at_en, range_m=atom.range_m)


def _en(
    place: MarkOptions | PointAtomOptions | StationAtomOptions | CircleAtomOptions | RepulsivePointAtomOptions,
    frame: LocalFrame,
) -> tuple[float, float]:
    return frame.en_from_geo(_geo(place))


def _geo(
    place: MarkOptions | PointAtomOptions | StationAtomOptions | CircleAtomOptions | RepulsivePointAtomOptions,
) -> GeoPoint:
    return GeoPoint(lat_deg=place.lat, lon_deg=place.lon)


# A passage: how far the boat sails in one frame, and what of the area is in it: a plan may go aside as far as ahead.
RECENTRE_M = 10_000.0
HORIZONS, BEYOND_M = 1.5, 10_000.0

_SIDES = {None: Side.NONE, "port": Side.PORT, "starboard": Side.STARBOARD}


def voyage_of(mission: Mission) -> Voyage:
    """Return the voyage in the mission's local frame, with its whole area."""
    return _voyage_in(mission, mission.frame(), mission.water())


def waters_of(mission: Mission) -> Waters | None:
    """Return what makes a passage's voyage about a place, with the area that a plan from there can meet.

    None for a voyage that is sailed in one frame.
    """
    if not mission.is_passage:
        return None
    reach_m = (mission.passage.recentre_m or RECENTRE_M) + HORIZONS * mission.skipper.horizon_m + BEYOND_M

    def about(origin: GeoPoint) -> Voyage:
        frame = LocalFrame(origin)
        return _voyage_in(mission, frame, mission.area.about(frame, reach_m))

    return about


def _voyage_in(mission: Mission, frame: LocalFrame, area: LocalArea) -> Voyage:
    goals = tuple(
        Goal(
            en_m=frame.en_from_geo(g.point),
            radius_m=g.radius_m,
            name=g.name,
            side=_SIDES[g.rounding],
            rounding_m=_rounding_m(mission, g, frame) if g.rounding else 12.0,
            bandwidth_m=mission.skipper.bandwidth_m if g.bandwidth_m is None else g.bandwidth_m,
            heading_rad=None if g.heading_deg is None else math.radians(g.heading_deg),
            line=_line(g.gate, frame, mission.margin_m),
            box=None if g.box is None else Box(area_en=polygon_en(g.box.shape, frame, cover=False), for_s=g.box.for_s),
            search=None
            if g.search is None
            else Search(
                area_en=free_water(g.search.shape, frame, mission.area),
                swath_m=g.search.swath_m,
                coverage=g.search.coverage,
            ),
            field=None if g.field is None else composed_field_of(mission, number, g.field, frame),
        )
        for number, g in enumerate(mission.goals, start=1)
    )
    return Voyage(
        name=mission.name,
        frame=frame,
        goals=goals,
        area=area,
        boat=boat_of(mission),
        laps=mission.skipper.laps,
        drying=drying_of(mission, frame),
        refuges=tuple(
            Refuge(name=r.name, en_m=frame.en_from_geo(r.point), radius_m=r.radius_m) for r in mission.refuges
        ),
        # home is where she is armed, and that is near the start
        onward_en_m=frame.en_from_geo(mission.start) if mission.start and mission.skipper.end == "home" else None,
        recentre_m=(mission.passage.recentre_m or RECENTRE_M) if mission.is_passage else None,
        far_m=max(RANGE_M, mission.passage.leg_m or 0.0),
    )


def _rounding_m(mission: Mission, goal: MissionGoal, frame: LocalFrame) -> float:
    """Return how far off a mark is rounded: by the margin, less where the next mark leaves less, radius_m at least."""
    here = frame.en_from_geo(goal.point)
    others = [math.dist(here, frame.en_from_geo(g.point)) for g in mission.goals if g.rounding]
    least_m = min((off_m for off_m in others if off_m > SAME_M), default=math.inf)
    return max(goal.radius_m, min(mission.margin_m, (least_m - BETWEEN_M) / (1.0 + KEEP_SHARE)))


def drying_of(mission: Mission, frame: LocalFrame) -> tuple[DryingWater, ...]:
    """Return the water that dries in the metres of ``frame``, each piece with the tide that opens it."""
    if not mission.drying:
        return ()
    need_m = (mission.boat.draft_m or 0.0) + mission.options.area.under_keel_m
    return tuple(
        DryingWater(
            name=water.name or f"drying water {number}",
            polygon=polygon_en(water.shape, frame),
            margin_m=water.margin_m or 0.0,
            opens_at_m=need_m - (water.depth_m or 0.0) + TIDE_DOUBT_M,
        )
        for number, water in enumerate(mission.drying, start=1)
    )


def _line(gate: GoalGate | None, frame: LocalFrame, margin_m: float) -> Line | None:
    if gate is None:
        return None
    return Line(
        port_en_m=frame.en_from_geo(gate.port),
        starboard_en_m=frame.en_from_geo(gate.starboard),
        keep_m=gate.keep_m,
        margin_m=margin_m,
        not_before_s=gate.not_before_s,
        after_s=gate.after_s,
    )


def config_of(mission: Mission) -> SkipperConfig:
    """Return the skipper's thresholds; what the mission does not say keeps its default."""
    options, default = mission.skipper, SkipperConfig()
    return SkipperConfig(
        sails=mission.autopilot.frame == "sailboat",
        delta_s=mission.risk.delta_s,
        max_path_risk=mission.risk.max_path_risk,
        delta_s_ladder=tuple(d for d in default.delta_s_ladder if d < mission.risk.delta_s),
        margin_m=mission.margin_m,
        margin_floor_m=mission.margin_floor_m,
        least_depth_m=None
        if mission.boat.draft_m is None
        else mission.boat.draft_m + mission.options.area.under_keel_m - mission.options.boat.transducer_m,
        tide=tide_of(mission),
        planner=planner_of(mission),
        plan_budget_s=options.planning_budget_s,
        first_plan_budget_s=options.planning_budget_s,
        autopilot_beats=options.autopilot_beats,
        shifts=options.shifts,
        shift_tacks_apart_s=60.0 / options.tacks_per_minute,
        replan_policy=ReplanPolicy(options.replan),
        guidance=Guidance(options.guidance),
        learn=Learning(mission.boat.learn),
        station_s=options.station_s,
        adopts=mission.options.from_autopilot,
        ends=Ends.of(**msgspec.structs.asdict(mission.safety)),
        voyage_timeout_s=options.voyage_timeout_s,
        min_replan_interval_s=options.min_replan_s,
        traffic_clearance_m=mission.traffic.safe_distance_m,
        traffic_time_s=mission.traffic.safe_time_s,
        traffic_policy=Policy(mission.traffic.policy),
        wind_change_rad=math.radians(options.wind_shift_deg),
        grid_size_m=options.off_track_m,
        horizon_m=options.horizon_m,
        safe_end=SafeEnd.RETURN if options.end == "home" else SafeEnd.LOITER,
        plan_age_s=default.plan_age_s if options.max_replan_s is None else options.max_replan_s,
    )


def permissions_of(mission: Mission, *, dry_run: bool = False) -> Permissions:
    """Return what the operator allows. Uploading a mission goes with setting AUTO; a dry run allows nothing."""
    operator = mission.operator
    given = (
        Permissions()
        if dry_run
        else Permissions(
            orders=_orders(mission, "orders", mission.operator.orders),
            local_orders=_orders(mission, "local_orders", mission.operator.local_orders),
            far_orders=_orders(mission, "far_orders", mission.operator.far_orders),
            may_upload=operator.set_auto,
            may_upload_fence=operator.upload_fence,
            may_arm=operator.arm,
            may_set_mode=operator.set_auto,
            may_steer=operator.guided,
            may_trim_vane=operator.trim_vane,
            may_replace_foreign=operator.replace_foreign,
        )
    )
    if given.may_upload:
        return given
    lacking = (
        "" if operator.set_auto else "[operator] set_auto = true in the mission",
        "no --dry-run" if dry_run else "",
    )
    return replace(given, to_upload=", and ".join(filter(None, lacking)))


def _orders(mission: Mission, key: str, given: tuple[str, ...] | str) -> tuple[str, ...]:
    """Return the verbs that a key of ``[operator]`` permits. Raises InputError for a word that is no verb."""
    words = (given,) if isinstance(given, str) else given
    for word in words:
        if word != ALL and word not in set(Verb):
            said, _, remedy = unknown(word).partition("; ")
            raise InputError(
                str(mission.path),
                f"[operator] {key}",
                said,
                remedy if remedy.endswith("?") else f'{remedy}, or "{ALL}"',
            )
    return tuple(words)


_KALMAN = {"kalman_window": "n", "kalman_r_deg": "r_deg", "kalman_r_mps": "r_mps"}


def estimator_of(mission: Mission) -> Estimator:
    """Return the mission's wind estimator. Raises InputError for a name unknown."""
    numbers = _kalman(mission)
    try:
        return make(mission.wind.estimator, **numbers)
    except InputError as error:
        name = mission.wind.estimator
        raise InputError(str(mission.path), "[wind] estimator", f"{name!r} {error.problem}", error.remedy) from error


def _kalman(mission: Mission) -> dict[str, Any]:
    """Return the numbers of Wolsieffer's filter that the mission gives. Raises InputError for another estimator."""
    given = {key: value for key in _KALMAN if (value := getattr(mission.wind, key)) is not None}
    if given and mission.wind.estimator != "kalman":
        raise InputError(
            str(mission.path),
            f"[wind] {next(iter(given))}",
            f'is for the estimator "kalman", and this mission\'s is {mission.wind.estimator!r}',
            'write estimator = "kalman", or leave it out',
        )
    return {_KALMAN[key]: value for key, value in given.items()}


def tide_of(mission: Mission) -> TideTable | None:
    """Return the tide's heights, None without a table. Raises InputError: the file is no such table."""
    path = mission.heights_path
    if path is None:
        return None
    text, times = _timed(path, str(mission.path), "[area] tide")
    return TideTable(rows=read_tide(text, str(path), times), name=path.name)


def _timed(path: Path, source: str, key: str) -> tuple[str, tuple[float | None, ...]]:
    """Return the text of a table over time, and the times of its lines. Raises InputError: it cannot be read."""
    try:
        text = read_regular(path).decode("utf-8-sig")
    except OSError as error:
        raise unreadable(source, error, f"{key} {path}", "write a tide table beside the mission") from None
    except UnicodeDecodeError as error:
        raise InputError(str(path), "", "is no text in UTF-8", "save the tide table as text") from error
    return text, tuple(_unix_s(line.split(",")[0].strip()) for _, line in table_lines(text))


def water_of(mission: Mission) -> Prior:
    """Return what the mission expects of the current.

    Raises:
        InputError: a table is no tide table, or set, drift and table do not go together.
    """
    current, path = mission.current, mission.tide_path
    if current is None:
        return STILL
    source = str(mission.path)
    if path is None:
        if current.drift_mps is None or (current.set_deg is None and current.drift_mps > 0.0):
            raise InputError(
                source,
                "[current]",
                "set_deg and drift_mps are not both there",
                "write where it goes and how fast, or a table",
            )
        set_rad = math.radians(current.set_deg or 0.0)
        return Prior(
            east_mps=current.drift_mps * math.sin(set_rad),
            north_mps=current.drift_mps * math.cos(set_rad),
            sigma_mps=current.sigma_mps,
        )
    if current.set_deg is not None or current.drift_mps is not None:
        raise InputError(
            source,
            "[current] table",
            "a table and a constant current exclude one another",
            "leave out set_deg and drift_mps, or the table",
        )
    text, times = _timed(path, source, "[current] table")
    return Prior(rows=read_table(text, str(path), times), sigma_mps=current.sigma_mps, name=path.name)


def _unix_s(text: str) -> float | None:
    """Return the Unix time [s] of an ISO 8601 time with its zone, None for other text."""
    try:
        moment = dt.datetime.fromisoformat(text)
    except ValueError:
        return None
    return None if moment.tzinfo is None else moment.timestamp()


def target_limits_of(mission: Mission) -> TargetLimits:
    """Return how long an unheard vessel is remembered, and which one is ours."""
    return TargetLimits(expire_s=mission.traffic.drop_after_s, own_mmsi=mission.traffic.own_mmsi)


SOUNDER_BAUD = 4800  # NMEA 0183


def sounder_of(mission: Mission) -> tuple[FeedName, ...]:
    """Return the feed of the companion's own sounder, none without one. Raises InputError: its name is no feed."""
    name = mission.options.sounder.feed
    try:
        return () if name is None else (parse_feed(name, baud=SOUNDER_BAUD),)
    except InputError as error:
        raise InputError(str(mission.path), "[sounder] feed", f"{name!r} is not a feed", error.remedy) from error


def feeds_of(mission: Mission) -> tuple[FeedName, ...]:
    """Return the names of the AIS feeds to open; the autopilot's own AIS ("mavlink") needs none.

    Raises:
        InputError: a name is not a feed.
    """
    names = tuple(name for name in mission.traffic.feeds if name != "mavlink")
    parsed = []
    for name in names:
        try:
            parsed.append(parse_feed(name))
        except InputError as error:
            raise InputError(str(mission.path), "[traffic] feeds", f"{name!r} is not a feed", error.remedy) from error
    return tuple(parsed)


def displays_of(mission: Mission) -> Displays:
    """Return the other displays that are told of the voyage.

    Raises:
        InputError: a name is none, or there is a token for nobody.
    """
    output = mission.output
    nmea, signalk = (
        _named(mission, *named)
        for named in (("nmea", output.nmea, parse_nmea), ("signalk", output.signalk, parse_signalk))
    )
    if output.signalk_token is not None and all(name.kind == "tcp" for name in signalk):
        raise InputError(
            str(mission.path),
            "[output] signalk_token",
            "there is no WebSocket to use it on",
            'name the server: signalk = ["ws://HOST:3000"]',
        )
    token = None if output.signalk_token is None else mission.path.parent / output.signalk_token
    return Displays(nmea=nmea, signalk=signalk, token_file=token)


def _named(
    mission: Mission, key: str, names: tuple[str, ...], parse: Callable[[str], OutputName]
) -> tuple[OutputName, ...]:
    try:
        return tuple(parse(name) for name in dict.fromkeys(names))
    except InputError as error:
        raise InputError(
            str(mission.path), f"[output] {key}", f"{error.place!r} {error.problem}", error.remedy
        ) from error
