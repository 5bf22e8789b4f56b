"""Steering by a field: (state, situation) -> (state, setpoint), once a second.

The field says where to go. What the boat can do and what is safe is decided here, because a heading setpoint has
neither no-go protection nor tack logic of its own: headings are projected out of the no-go zone, a change of tack
goes through the wind only with way enough and otherwise round by the stern, and a boat in irons is got out. With
``look_ahead`` (the default) the heading is chosen from a fan of sailable ones: the nearest to the field's that
keeps its distance from every obstacle for the next minute and a half. Without it this is Schmitt's guidance.

Angles are house angles: ``twa_rad`` is positive with the wind on the starboard side, so heading = twd - twa.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from companion.field.look_ahead import choose
from companion.field.projection import HysteresisZone, Projection, near_and_ahead
from companion.field.values import (
    Clearance,
    GuidanceSettings,
    GuidanceState,
    Intent,
    Manoeuvre,
    MovingObstacle,
    Setpoint,
    Situation,
)
from companion.field.vector_fields import (
    REPULSIVE,
    ZONE_M,
    AttractivePoint,
    Field,
    RepulsivePoint,
    Uniform,
    Vectors,
    line_between,
)
from companion.geo.angles import wrap_pi

AWAY_RAD = math.radians(80.0)  # a step of a turn by the stern ...
BROAD_RAD, RUNS_RAD = math.radians(100.0), math.radians(150.0)  # ... from so far off the wind onto the new tack


def avoiding(field: Field, situation: Situation, habits: GuidanceSettings) -> Field:
    """Return the field with a repulsive point at every obstacle that is near and ahead (Schmitt, section 4.2).

    One that comes nearer by itself counts from all sides: by the bow alone, a boat that turns away from it would be
    led back to it at once, and away again.
    """
    for obstacle in situation.obstacles:
        bow_rad = None if _comes(obstacle, situation) else situation.heading_rad
        if near_and_ahead(situation.en_m, bow_rad, obstacle.en_m, near_m=habits.near_m):
            # The Gaussian starts at the disc's edge: it is as wide as the obstacle is.
            width = math.hypot(habits.repulsive_sigma_m, obstacle.keep_m)
            field = field + RepulsivePoint(sigma_m=width).shifted(*obstacle.en_m)
    return field


def _comes(obstacle: MovingObstacle, situation: Situation) -> bool:
    """Return whether an obstacle's own motion brings it nearer to where the boat is now."""
    (east, north), (here_e, here_n), (ve, vn) = obstacle.en_m, situation.en_m, obstacle.velocity_en_mps
    return obstacle.moves and ve * (here_e - east) + vn * (here_n - north) > 0.0


def step(
    state: GuidanceState, situation: Situation, intent: Intent, habits: GuidanceSettings
) -> tuple[GuidanceState, Setpoint]:
    """Return the next state and the heading to send."""
    field = avoiding(intent.field, situation, habits)
    if intent.clearance is not None:
        field = field + RepulsiveShore(intent.clearance, sigma_m=habits.keep_m)
    if not habits.is_sailing or situation.twd_from_rad is None:
        v = field(situation.en_m)[0]
        wanted = math.atan2(v[0], v[1])
        margin: float | None = None
        if habits.look_ahead:
            wanted, margin, side = choose(wanted, None, situation, intent, habits, state)
            state = replace(state, round_side=side)
        return replace(state, wanted_rad=wanted), Setpoint(
            t_s=situation.t_s, heading_rad=wrap_pi(wanted), reason="field", margin_m=margin
        )
    twd = situation.twd_from_rad
    projection = Projection(field=field, twd_from_rad=twd, no_go_half_rad=habits.no_go_half_rad, zone=intent.zone)
    wanted, _, q = projection.steer(situation.en_m, state.q)
    margin = None
    state = replace(state, q=q)
    if habits.look_ahead:
        chosen, margin, side = choose(wanted, twd, situation, intent, habits, state)
        state = replace(state, round_side=side)
        off = wrap_pi(chosen - twd)
        if abs(wrap_pi(wanted - twd)) < habits.no_go_half_rad + 1e-6 and abs(off) < math.pi / 2.0:
            # Beating: the tack that something in the way made the boat take is kept, else it would tack back at once.
            state = replace(state, q=1 if off > 0.0 else -1)
        wanted = chosen
    state, heading, reason = helm(state, situation, wanted, habits)
    return state, Setpoint(t_s=situation.t_s, heading_rad=wrap_pi(heading), reason=reason, margin_m=margin)


# ------------------------------------------------------------------------------- no-go protection
def wearing_rad(heading_rad: float, twd_from_rad: float, side: int) -> float:
    """Return the next heading of a turn by the stern onto the tack ``side``, 1: with the wind on the starboard side.

    An autopilot turns the short way: it is led away from the wind by steps of less than half a turn.
    """
    off = wrap_pi(heading_rad - twd_from_rad)
    if abs(off) > BROAD_RAD:
        return wrap_pi(twd_from_rad - side * RUNS_RAD)
    return wrap_pi(heading_rad + math.copysign(AWAY_RAD, off))


def helm(
    state: GuidanceState, situation: Situation, wanted_rad: float, habits: GuidanceSettings
) -> tuple[GuidanceState, float, str]:
    """Return (state, heading to send, why): tack, wear round, get out of irons, never point into the no-go zone.

    What is returned is outside the no-go zone of ``situation.twd_from_rad``, whatever was wanted.
    """
    twd, t = situation.twd_from_rad, situation.t_s
    if twd is None:
        return replace(state, wanted_rad=wanted_rad), wanted_rad, "no wind known"
    wanted = outside_no_go(wanted_rad, twd, habits.no_go_half_rad, state.q)
    twa = wrap_pi(twd - situation.heading_rad)
    way = situation.velocity_en_mps[0] * math.sin(situation.heading_rad) + situation.velocity_en_mps[1] * math.cos(
        situation.heading_rad
    )
    state = _watch_irons(state, t, twa, way, habits)
    side = 1 if twa > 0.0 else -1
    goal_side = 1 if wrap_pi(twd - wanted) > 0.0 else -1
    if state.manoeuvre is Manoeuvre.IRONS:
        if abs(twa) > habits.no_go_half_rad and way > 0.3:
            state = replace(state, manoeuvre=Manoeuvre.SAIL, stuck_since_s=None)
        else:
            return replace(state, wanted_rad=wanted), _out_of_irons(state, situation, twa, way, habits), "in irons"
    if state.manoeuvre is Manoeuvre.TACK:
        over = side == goal_side and abs(twa) > 0.6 * habits.no_go_half_rad
        if over:
            state = replace(state, manoeuvre=Manoeuvre.SAIL, failed_tacks=0)
        elif t - state.since_s > 2.5 * habits.tack_s:
            state = replace(state, manoeuvre=Manoeuvre.WEAR, since_s=t, failed_tacks=state.failed_tacks + 1)
        else:
            return replace(state, wanted_rad=wanted), wanted, "tack"
    if state.manoeuvre is Manoeuvre.SAIL and side != goal_side:
        through_wind = abs(wrap_pi(twd - wanted) - twa) < math.pi
        if through_wind:
            can_tack = way >= habits.tack_min_mps and state.failed_tacks == 0
            state = replace(state, manoeuvre=Manoeuvre.TACK if can_tack else Manoeuvre.WEAR, since_s=t)
            if can_tack:
                return replace(state, wanted_rad=wanted), wanted, "tack"
    if state.manoeuvre is Manoeuvre.WEAR:
        done = side == goal_side
        if done or t - state.since_s > 60.0:
            state = replace(state, manoeuvre=Manoeuvre.SAIL, failed_tacks=0)
        else:
            away = wearing_rad(situation.heading_rad, twd, goal_side)
            return replace(state, wanted_rad=wanted), outside_no_go(away, twd, habits.no_go_half_rad, state.q), "wear"
    return replace(state, wanted_rad=wanted), wanted, "field"


def _out_of_irons(
    state: GuidanceState, situation: Situation, twa: float, way_mps: float, habits: GuidanceSettings
) -> float:
    """Return the heading that gets a boat out of irons: to the side it was caught on, by the rudder that works.

    With way on, the heading wanted is the one to bear away to. With sternway the rudder works in reverse: asking for
    the other side makes the autopilot put it over the way that swings the bow to the wanted one. Half a minute
    without success changes sides.
    """
    assert situation.twd_from_rad is not None
    t = situation.t_s - state.since_s
    side = state.irons_side * (-1 if int(t / 30.0) % 2 else 1)
    # Over the ground the boat drifts to leeward even at rest: the rudder feels the water.
    water = way_mps + habits.leeway_share * situation.tws_mps * math.cos(twa)
    if water < 0.0:
        side = -side
    return situation.twd_from_rad - side * math.radians(100.0)


def outside_no_go(heading_rad: float, twd_from_rad: float, half_rad: float, q: int = 1) -> float:
    """Return the heading, or the nearer edge of the no-go zone where it is inside (q decides dead upwind)."""
    off = wrap_pi(heading_rad - twd_from_rad)
    if abs(off) >= half_rad:
        return wrap_pi(heading_rad)
    sign = q if abs(off) < 1e-9 else (1 if off > 0.0 else -1)
    return wrap_pi(twd_from_rad + sign * half_rad)


def _watch_irons(
    state: GuidanceState, t_s: float, twa: float, way_mps: float, habits: GuidanceSettings
) -> GuidanceState:
    caught = abs(twa) < habits.no_go_half_rad - math.radians(8.0) and way_mps < 0.25
    if not caught or state.manoeuvre is Manoeuvre.IRONS:
        return replace(state, stuck_since_s=None)
    since = t_s if state.stuck_since_s is None else state.stuck_since_s
    patience = habits.tack_s if state.manoeuvre is Manoeuvre.TACK else 4.0
    if t_s - since >= patience:
        return replace(
            state,
            manoeuvre=Manoeuvre.IRONS,
            since_s=t_s,
            stuck_since_s=None,
            failed_tacks=state.failed_tacks + 1,
            irons=state.irons + 1,
            irons_side=1 if twa > 0.0 else -1,
        )
    return replace(state, stuck_since_s=since)


# ------------------------------------------------------------------------------------ last resort
@dataclass(frozen=True, slots=True, kw_only=True)
class LastResort:
    """Tell if the field steers, not the plan: a target too near to plan for takes over, clear water hands back."""

    engaged: bool = False
    since_s: float = 0.0
    clear_since_s: float | None = None

    def step(self, t_s: float, *, too_near: bool, can_plan: bool, clear_s: float = 10.0) -> LastResort:
        """Return the next state.

        Args:
            t_s: now.
            too_near: a target's disc holds the boat already, or its ACT alarm is on.
            can_plan: the planner has a plan that keeps clear.
            clear_s: how long the water must have been clear before AUTO and the plan take over again.

        """
        danger = too_near or not can_plan
        if not self.engaged:
            return LastResort(engaged=True, since_s=t_s) if too_near and not can_plan else self
        if danger:
            return replace(self, clear_since_s=None)
        since = t_s if self.clear_since_s is None else self.clear_since_s
        if t_s - since >= clear_s:
            return LastResort(engaged=False, since_s=t_s)
        return replace(self, clear_since_s=since)


def go_to(point_en: tuple[float, float], twd_from_rad: float, half_m: float = ZONE_M) -> Intent:
    """Return the intent to sail to a point: Schmitt's attractive point with its zone along the wind."""
    return Intent(
        field=AttractivePoint().shifted(*point_en), zone=HysteresisZone.of_point(point_en, twd_from_rad, half_m)
    )


def follow_line(a_en: tuple[float, float], b_en: tuple[float, float], half_m: float = ZONE_M) -> Intent:
    """Return the intent to follow a line."""
    return Intent(field=line_between(a_en, b_en, half_m), zone=HysteresisZone.of_line(a_en, b_en, half_m))


def hold_heading(heading_rad: float) -> Intent:
    """Return the intent to keep a heading."""
    return Intent(field=Uniform(heading_rad))


# Away from what stands still: a repulsive field about the mission's obstacles and its fence, whatever their shape.

STEP_M = 0.5  # of the difference quotient
FAR_M = 1e5


@dataclass(frozen=True, slots=True)
class RepulsiveShore(Field):
    """Away from the nearest shore: length 20 exp(-(c / sigma)²) at the clearance c, Schmitt's repulsive line bent.

    The direction is the clearance's slope, of length 1 everywhere but on the lines that are equally far from two
    shores, where the two cancel.
    """

    clearance: Clearance
    sigma_m: float

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        n = len(p)
        east, north = np.array([STEP_M, 0.0]), np.array([0.0, STEP_M])
        # Open water has no shore and an endless clearance.
        places = np.vstack([p, p + east, p - east, p + north, p - north])
        c = np.minimum(self.clearance(places), FAR_M).reshape(5, n)
        slope = np.column_stack([c[1] - c[2], c[3] - c[4]]) / (2.0 * STEP_M)
        force = REPULSIVE * np.exp(-((np.maximum(c[0], 0.0) / self.sigma_m) ** 2))
        return np.asarray(force[:, None] * slope, dtype=np.float64)
