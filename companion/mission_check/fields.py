"""A goal's field looked at before it is sailed: where it leads, by which headings, and the track it makes."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.compose import boat_of, voyage_of
from companion.errors import InputError
from companion.field.guidance import step
from companion.field.look_ahead import way_out_rad
from companion.field.projection import NO_GO_HALF_RAD, HysteresisRing, HysteresisZone, Projection
from companion.field.tree import (
    LEAST,
    Along,
    AwayFrom,
    AwayFromLine,
    FieldConditions,
    FieldTree,
    Named,
    OutOf,
    PointTo,
    Round,
    StayAt,
    field_of,
    lengths,
    zone_of,
)
from companion.field.values import Clearance, GuidanceSettings, GuidanceState, Intent, Situation
from companion.geo.angles import difference_rad, wrap_pi
from companion.geofence import LocalArea, Mission
from companion.skipper.way import Composed, Until

PointEn = tuple[float, float]
TRACK_S = 600.0  # a preview is no voyage
AROUND = 0.3  # of the picture's half width, beyond what lies in it
LEAST_HALF_M = 80.0
LAG_S = 3.0
FAN_RAD = np.radians(np.arange(0.0, 360.0, 5.0))


@dataclass(frozen=True, slots=True, kw_only=True)
class FieldPreview:
    """A goal's field, the boat and the wind in which it is looked at.

    ``here_en`` is where the boat is, at the mission's start or where the goal before was; ``centre_en`` and
    ``half_m`` are the square that holds all of it.
    """

    number: int
    name: str
    composed: Composed
    conditions: FieldConditions
    area: LocalArea
    here_en: PointEn
    place_en: PointEn
    radius_m: float
    centre_en: PointEn
    half_m: float

    @property
    def tree(self) -> FieldTree:
        """The field's expression and atoms."""
        return self.composed.tree

    @property
    def zone(self) -> HysteresisZone | HysteresisRing | None:
        """The band about its trajectory."""
        return zone_of(self.tree, self.conditions)

    def wanted(self, points_en: NDArray[np.float64]) -> NDArray[np.float64]:
        """Return what the field says at points (n, 2), (n, 2)."""
        return field_of(self.tree, self.conditions)(points_en)

    def sailable(self, points_en: NDArray[np.float64], q: int = 1) -> NDArray[np.float64]:
        """Return it out of the no-go zone, (n, 2): the same for a motorboat."""
        projection = self.projection
        return self.wanted(points_en) if projection is None else projection.evaluate(points_en, q)

    @property
    def projection(self) -> Projection | None:
        """The last step of the tree, None: there is no no-go zone."""
        twd = self.conditions.twd_from_rad
        if twd is None:
            return None
        return Projection(
            field=field_of(self.tree, self.conditions),
            twd_from_rad=twd,
            zone=self.zone,
            no_go_half_rad=self.conditions.habits.no_go_half_rad,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class HeadingFan:
    """Candidate headings (k,) [rad] with the speed of each (k,) [m/s], and their worth: the way made along the field.

    ``wanted_rad`` is the field's own heading, ``chosen_rad`` what the boat would be steered by.
    """

    headings_rad: NDArray[np.float64]
    speeds_mps: NDArray[np.float64]
    worth_mps: NDArray[np.float64]
    wanted_rad: float
    chosen_rad: float


def field_preview(
    mission: Mission, *, number: int | None = None, wind: tuple[float, float] | None = None
) -> FieldPreview:
    """Return the field of goal ``number`` (from 1; None: the first that has one) in ``wind`` (m/s, from [deg]).

    Of a mission that is sailed by field throughout, a mark is an attractive point.

    Raises:
        InputError: there is no such goal, or it has no field.
    """
    voyage, boat = voyage_of(mission), boat_of(mission)
    speed_mps, from_deg = wind or (mission.wind.preview_speed_mps, mission.wind.preview_from_deg)
    throughout = mission.skipper.guidance == "field"
    source, every = str(mission.path), [n for n, g in enumerate(voyage.goals, 1) if g.field is not None or throughout]
    if not every:
        raise InputError(
            source,
            "[[goal]]",
            "no goal is sailed by a field",
            'write kind = "field" in one, or [skipper] guidance = "field"',
        )
    if number is not None and number not in every:
        raise InputError(
            source, f"[[goal]] {number}", "is not sailed by a field", f"name one that is: {', '.join(map(str, every))}"
        )
    number = number or every[0]
    goal = voyage.goals[number - 1]
    composed = goal.field or Composed(
        tree=FieldTree(expression=Named("mark"), atoms=(("mark", PointTo(at_en=goal.en_m)),)), until=Until.PLACE
    )
    sails = mission.autopilot.frame == "sailboat"
    twa, speeds = boat.polar.curve(max(1.0, speed_mps))
    habits = GuidanceSettings(
        is_sailing=sails,
        no_go_half_rad=boat.no_go_half_rad or NO_GO_HALF_RAD,
        polar_twa_rad=tuple(map(float, twa)),
        polar_mps=tuple(map(float, speeds)),
        turn_rate_radps=boat.turn_rate_radps,
        tack_s=max(1.0, boat.tack_loss_s),
        lag_s=LAG_S,
        horizon_s=60.0,
        keep_m=mission.margin_floor_m,
    )
    here = voyage.goals[number - 2].en_m if number > 1 else goal.en_m
    if number == 1 and mission.start is not None:
        here = voyage.frame.en_from_geo(mission.start)
    seen = Situation(
        t_s=0.0,
        en_m=here,
        velocity_en_mps=(0.0, 0.0),
        tws_mps=speed_mps,
        heading_rad=0.0,
        twd_from_rad=math.radians(from_deg) if sails else None,
    )
    conditions = FieldConditions(seen=seen, habits=habits)
    centre, half_m = _around([here, goal.en_m], composed)
    return FieldPreview(
        number=number,
        name=goal.name or f"goal {number}",
        composed=composed,
        conditions=conditions,
        area=mission.area.local(voyage.frame),
        here_en=here,
        place_en=goal.en_m,
        radius_m=goal.radius_m,
        centre_en=centre,
        half_m=half_m,
    )


def _around(places: list[PointEn], composed: Composed) -> tuple[PointEn, float]:
    """Return the middle and the half side of the square that holds a field's atoms and these places."""
    for _, atom in composed.tree.atoms:
        if isinstance(atom, Round | AwayFrom):
            reach = atom.radius_m if isinstance(atom, Round) else atom.range_m
            places += [(atom.at_en[0] + e, atom.at_en[1] + n) for e in (-reach, reach) for n in (-reach, reach)]
        elif isinstance(atom, PointTo | StayAt):
            places.append(atom.at_en)
        elif isinstance(atom, Along | AwayFromLine):
            places += [atom.from_en, atom.to_en]
        elif isinstance(atom, OutOf):
            west, south, east, north = atom.water_en.bounds
            places += [(west, south), (east, north)]
    points = np.asarray(places)
    low, high = points.min(axis=0), points.max(axis=0)
    half = max(LEAST_HALF_M, (0.5 + AROUND) * float((high - low).max()))
    return (float(0.5 * (low[0] + high[0])), float(0.5 * (low[1] + high[1]))), half


def heading_fan(seen: FieldPreview) -> HeadingFan:
    """Return the candidate headings where the boat is, weighed by the polar."""
    at, habits, twd = np.array([seen.here_en]), seen.conditions.habits, seen.conditions.twd_from_rad
    wanted, chosen = (math.atan2(v[0][0], v[0][1]) for v in (seen.wanted(at), seen.sailable(at)))
    if twd is None:
        speeds = np.full(len(FAN_RAD), habits.polar_mps[-1])
    else:
        twa = np.abs([difference_rad(twd, h) for h in FAN_RAD])
        speeds = np.where(
            twa < habits.no_go_half_rad - 1e-9, 0.0, np.interp(twa, habits.polar_twa_rad, habits.polar_mps)
        )
    return HeadingFan(
        headings_rad=FAN_RAD,
        speeds_mps=speeds,
        worth_mps=speeds * np.cos(FAN_RAD - wanted),
        wanted_rad=wrap_pi(wanted),
        chosen_rad=wrap_pi(chosen),
    )


def field_track(seen: FieldPreview, seconds: float = TRACK_S) -> NDArray[np.float64]:
    """Return a track by the field from where the boat is: rows of t, east, north, heading [s, m, rad].

    A boat that has its polar's speed at once and turns at its rate, the shore kept clear of, no vessels; it ends where
    the goal does. The station keeper is not in it.
    """
    habits, clearance = seen.conditions.habits, _clearance(seen.area)
    twd, here = seen.conditions.twd_from_rad, seen.here_en
    v = seen.sailable(np.array([here]))[0]
    heading, state, way_out, rows = math.atan2(v[0], v[1]), GuidanceState(), None, []
    most_s = min(seconds, seen.composed.for_s or seconds)
    for t in range(int(most_s)):
        speed = _speed(habits, twd, heading)
        now = replace(
            seen.conditions.seen,
            t_s=float(t),
            en_m=here,
            heading_rad=heading,
            velocity_en_mps=(speed * math.sin(heading), speed * math.cos(heading)),
        )
        rows.append((float(t), *here, heading))
        if _is_over(seen, here):
            break
        if seen.tree.leaves is not None:
            way_out = way_out_rad(now, seen.tree.leaves, habits, way_out)
        conditions = replace(seen.conditions, seen=now, way_out_rad=way_out)
        if float(lengths(seen.tree, conditions, np.array([here]))[0]) >= LEAST:
            intent = Intent(
                field=field_of(seen.tree, conditions), zone=zone_of(seen.tree, conditions), clearance=clearance
            )
            state, setpoint = step(state, now, intent, habits)
            turn = difference_rad(setpoint.heading_rad, heading)
            heading = wrap_pi(heading + max(-habits.turn_rate_radps, min(habits.turn_rate_radps, turn)))
        here = here[0] + speed * math.sin(heading), here[1] + speed * math.cos(heading)
    return np.asarray(rows)


def _is_over(seen: FieldPreview, here: PointEn) -> bool:
    until, water = seen.composed.until, seen.composed.water_en
    if until is Until.PLACE:
        return math.dist(here, seen.place_en) <= seen.radius_m
    return until is Until.OUTSIDE and water is not None and not shapely.covers(water, shapely.points(here))


def _speed(habits: GuidanceSettings, twd: float | None, heading: float) -> float:
    if twd is None:
        return habits.polar_mps[-1]
    return float(np.interp(abs(difference_rad(twd, heading)), habits.polar_twa_rad, habits.polar_mps))


def _clearance(area: LocalArea) -> Clearance | None:
    return area.clearance_m if area.polygons or area.limits is not None else None


def without_value(seen: FieldPreview) -> float:
    """Return the share of the square in which the field says nothing of where to go."""
    side = np.linspace(-seen.half_m, seen.half_m, 25)
    east, north = np.meshgrid(side + seen.centre_en[0], side + seen.centre_en[1])
    points = np.column_stack([east.ravel(), north.ravel()])
    conditions = replace(seen.conditions, way_out_rad=0.0)
    return float(np.mean(lengths(seen.tree, conditions, points) < LEAST))
