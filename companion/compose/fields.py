"""The fields that a mission composes: from the words of its file to trees in its local frame."""

from __future__ import annotations

import math

import numpy as np

from companion.errors import InputError
from companion.field.expression import MAX, PROJECT, is_name, names_in, parse, projects
from companion.field.tree import (
    LEAST,
    Along,
    Atom,
    AwayFrom,
    AwayFromLine,
    Conditions,
    Heading,
    OutOf,
    PointTo,
    Round,
    StayAt,
    Tree,
    lengths,
)
from companion.field.values import Habits, Situation
from companion.geo.frame import LocalFrame
from companion.geofence import Code, Finding, Mission, Severity
from companion.geofence.mission import (
    AtomOptions,
    ByField,
    CircleAtomOptions,
    HeadingAtomOptions,
    LeaveAtomOptions,
    LineAtomOptions,
    MarkOptions,
    PointAtomOptions,
    RepulsiveLineAtomOptions,
    RepulsivePointAtomOptions,
    StationAtomOptions,
)
from companion.geofence.shapes import polygon_en
from companion.messages import GeoPoint
from companion.skipper.way import Composed, Until
from companion.words import listed

LEAST_LINE_M = 1.0
MOST_ATOMS = 64
RANGE_M = 50_000.0


def composed_of(mission: Mission, number: int, by_field: ByField, frame: LocalFrame) -> Composed:
    """Return the field of the mission's goal ``number`` (from 1). Raises InputError with the place and a remedy."""
    source, place = str(mission.path), f"[[goal]] {number} field"
    atoms = atoms_of(mission, frame)
    expression = parse(by_field.text, tuple(atoms), source, place)
    if projects(expression) and mission.autopilot.frame == "motor":
        raise InputError(source, place, f"{PROJECT}(...) keeps out of the no-go zone, and a motor boat has none",
                         "write what is in its brackets alone")
    tree = Tree(expression=expression, atoms=tuple((name, atoms[name]) for name in names_in(expression)))
    return Composed(
        tree=tree, until=Until(by_field.until), for_s=by_field.for_s,
        water_en=None if by_field.shape is None else polygon_en(by_field.shape, frame, cover=False))


def atoms_of(mission: Mission, frame: LocalFrame) -> dict[str, Atom]:
    """Return the atoms of a mission by their names, in its local frame. Raises InputError."""
    source, options = str(mission.path), mission.options.field
    if len(options) > MOST_ATOMS:
        raise InputError(source, "[field]", f"there are {len(options)} atoms", f"{MOST_ATOMS} are the most")
    out: dict[str, Atom] = {}
    for name, atom in options.items():
        if not is_name(name):
            raise InputError(source, f"[field.{name[:40]}]", "is no name that an expression can have",
                             f"write letters, digits and _, a letter first; {MAX} and {PROJECT} mean something else")
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
                raise InputError(str(mission.path), f"[field.{name}]", f"start and end are {length_m:.1f} m apart",
                                 "a line has two places")
    for number, goal in enumerate(mission.goals, start=1):
        if goal.field is None:
            continue
        for name, made in composed_of(mission, number, goal.field, LocalFrame(goal.point)).tree.atoms:
            places = (getattr(made, key, None) for key in ("at_en", "from_en", "to_en"))
            far_m = max((math.hypot(*place) for place in places if place is not None), default=0.0)
            if not far_m <= RANGE_M:
                raise InputError(str(mission.path), f"[field.{name}]",
                                 f"is {far_m / 1000.0:.0f} km from [[goal]] {number}, which is sailed by it",
                                 "are lat and lon swapped? a field is sailed within 50 km")


def told_of(mission: Mission) -> tuple[str, ...]:
    """Return a line for each goal that is sailed by a field: which, and what ends it."""
    frame, out = mission.frame(), []
    for number, goal in enumerate(mission.goals, start=1):
        if goal.field is not None:
            made = composed_of(mission, number, goal.field, frame)
            name = f", {goal.name}" if goal.name else ""
            out.append(f"goal {number}{name}: by field {made.tree.text}, {made.until_words}")
    return tuple(out)


def findings_of(mission: Mission) -> tuple[Finding, ...]:
    """Return what is worth knowing of a mission's fields: atoms that nobody sails by, a field without a value."""
    out, told = [], set()
    for number, goal in enumerate(mission.goals, start=1):
        if goal.field is None:
            continue
        frame = LocalFrame(goal.point)
        tree = composed_of(mission, number, goal.field, frame).tree
        told |= {name for name, _ in tree.atoms}
        place = frame.en_from_geo(goal.point)
        found = float(lengths(tree, preview(mission, place), np.array([place]))[0])
        if found < LEAST and tree.station_en is None and goal.field.until != "place":
            out.append(Finding(
                severity=Severity.WARNING, code=Code.FIELD, place=f"[[goal]] {number} field",
                text=f"{tree.text} has no value at the goal's own place ({found:.2f} of 10): she would not be steered",
                remedy="place it where the field leads somewhere"))
    left = [name for name in mission.options.field if name not in told]
    if left:
        out.append(Finding(severity=Severity.WARNING, code=Code.FIELD, place="[field]",
                           text=f"no goal is sailed by {listed(left)}", remedy="name it in a goal's field"))
    return tuple(out)


def preview(mission: Mission, at_en: tuple[float, float], twd_from_rad: float | None = None,
            tws_mps: float | None = None) -> Conditions:
    """Return a boat that lies at ``at_en`` in the wind that previews assume, or in another."""
    from_rad = math.radians(mission.wind.preview_from_deg) if twd_from_rad is None else twd_from_rad
    speed_mps = mission.wind.preview_speed_mps if tws_mps is None else tws_mps
    sails = mission.autopilot.frame == "sailboat"
    return Conditions(
        seen=Situation(t_s=0.0, en_m=at_en, velocity_en_mps=(0.0, 0.0), heading_rad=0.0, tws_mps=speed_mps,
                       twd_from_rad=from_rad if sails else None),
        habits=Habits(
            is_sailing=sails, no_go_half_rad=math.radians(mission.boat.no_go_half_deg),
            turn_rate_radps=math.radians(mission.boat.turn_rate_deg_s), tack_s=max(1.0, mission.boat.tack_loss_s)))


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
