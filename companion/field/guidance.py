"""Steering by a field: (state, situation) -> (state, setpoint), once a second.

The field says where to go. What the boat can do and what is safe is decided here, because a heading setpoint has
neither no-go protection nor tack logic of its own: headings are projected out of the no-go zone, a change of tack
goes through the wind only with way enough and otherwise round by the stern, and a boat in irons is got out. With
``look_ahead`` (the default) the heading is chosen from a fan of sailable ones: the nearest to the field's that
keeps its distance from every obstacle for the next minute and a half. Without it this is Schmitt's guidance.

Angles are house angles: ``twa_rad`` is positive with the wind on the starboard side, so heading = twd - twa.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.field.algebra import ZONE_M, AttractivePoint, Field, RepulsivePoint, Uniform, line_between
from companion.field.projection import Projection, Zone, near_and_ahead
from companion.geo.angles import wrap_pi

SETPOINT_LIFE_S = 3.0
"""ArduRover's GUIDED stops a boat whose heading setpoint is older."""
RESEND_S = 1.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Obstacle:
    """A moving disc to keep out of: centre, velocity, radius ``keep_m`` growing by ``growth_mps``."""

    en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float] = (0.0, 0.0)
    keep_m: float = 10.0
    growth_mps: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What the guidance sees; ``twd_from_rad`` None: the wind is not known (a motorboat need not know)."""

    t_s: float
    en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float]
    heading_rad: float
    twd_from_rad: float | None
    tws_mps: float = 5.0
    obstacles: tuple[Obstacle, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Intent:
    """Where to go: a field, its hysteresis zone, and a box (west, south, east, north) not to leave, if any."""

    field: Field
    zone: Zone | None = None
    stay_in: tuple[float, float, float, float] | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Habits:
    """What the boat can do, and how careful to be.

    ``polar_mps`` is the speed at ``polar_twa_rad`` (rising, 0..π) in the present wind. ``tack_s`` is how long a tack
    takes and ``tack_min_mps`` the way it needs; ``lag_s`` how long the boat takes to gather the new speed.
    ``comfort_m`` outside an obstacle's disc still costs a little, and so does crossing ahead of it (``ahead_cost``).
    """

    is_sailing: bool = True
    no_go_half_rad: float = math.pi / 4.0
    polar_twa_rad: tuple[float, ...] = (0.0, math.pi)
    polar_mps: tuple[float, ...] = (2.0, 2.0)
    turn_rate_radps: float = math.radians(20.0)
    tack_s: float = 8.0
    tack_min_mps: float = 0.7
    lag_s: float = 5.0
    leeway_share: float = 0.0
    look_ahead: bool = True
    horizon_s: float = 90.0
    comfort_m: float = 15.0
    ahead_cost: float = 0.6
    repulsive_sigma_m: float = 100.0
    near_m: float = 300.0


class Manoeuvre(enum.Enum):
    """What the boat is doing."""

    SAIL = "sail"
    TACK = "tack"
    WEAR = "wear"          # round by the stern
    IRONS = "irons"        # caught head to wind: bear away


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidanceState:
    """The memory of the step machine."""

    q: int = 1
    manoeuvre: Manoeuvre = Manoeuvre.SAIL
    since_s: float = 0.0
    wanted_rad: float | None = None
    stuck_since_s: float | None = None
    failed_tacks: int = 0
    irons: int = 0
    irons_side: int = 1


@dataclass(frozen=True, slots=True, kw_only=True)
class Setpoint:
    """A heading for GUIDED: resend every ``RESEND_S``, it dies after ``SETPOINT_LIFE_S``.

    ``margin_m`` is the least distance outside every obstacle's disc that is foreseen, None without look-ahead.
    """

    t_s: float
    heading_rad: float
    thrust: float = 1.0
    reason: str = ""
    margin_m: float | None = None


def avoiding(field: Field, situation: Situation, habits: Habits) -> Field:
    """Return the field with a repulsive point at every obstacle that is near and ahead (Schmitt, section 4.2)."""
    for obstacle in situation.obstacles:
        if near_and_ahead(situation.en_m, situation.heading_rad, obstacle.en_m, near_m=habits.near_m):
            # The Gaussian starts at the disc's edge: it is as wide as the obstacle is.
            width = math.hypot(habits.repulsive_sigma_m, obstacle.keep_m)
            field = field + RepulsivePoint(sigma_m=width).shifted(*obstacle.en_m)
    return field


def step(
    state: GuidanceState, situation: Situation, intent: Intent, habits: Habits
) -> tuple[GuidanceState, Setpoint]:
    """Return the next state and the heading to send."""
    field = avoiding(intent.field, situation, habits)
    if not habits.is_sailing or situation.twd_from_rad is None:
        v = field(situation.en_m)[0]
        wanted = math.atan2(v[0], v[1])
        margin: float | None = None
        if habits.look_ahead:
            wanted, margin = _choose(wanted, None, situation, intent, habits, state)
        return replace(state, wanted_rad=wanted), Setpoint(
            t_s=situation.t_s, heading_rad=wrap_pi(wanted), reason="field", margin_m=margin
        )
    twd = situation.twd_from_rad
    projection = Projection(field=field, twd_from_rad=twd, no_go_half_rad=habits.no_go_half_rad, zone=intent.zone)
    wanted, _, q = projection.steer(situation.en_m, state.q)
    margin = None
    state = replace(state, q=q)
    if habits.look_ahead:
        wanted, margin = _choose(wanted, twd, situation, intent, habits, state)
    state, heading, reason = helm(state, situation, wanted, habits)
    return state, Setpoint(t_s=situation.t_s, heading_rad=wrap_pi(heading), reason=reason, margin_m=margin)


# ------------------------------------------------------------------------------- no-go protection
def helm(
    state: GuidanceState, situation: Situation, wanted_rad: float, habits: Habits
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
            # Away from the wind by steps of less than half a turn, so that the short way round is the stern's.
            away = wrap_pi(situation.heading_rad - side * math.radians(80.0))
            if abs(twa) > math.radians(100.0):
                away = twd - goal_side * math.radians(150.0)
            return replace(state, wanted_rad=wanted), outside_no_go(away, twd, habits.no_go_half_rad, state.q), "wear"
    return replace(state, wanted_rad=wanted), wanted, "field"


def _out_of_irons(state: GuidanceState, situation: Situation, twa: float, way_mps: float, habits: Habits) -> float:
    """Return the heading that gets a boat out of irons: to the side it was caught on, by the rudder that works.

    With way on, the heading wanted is the one to bear away to. With sternway the rudder works in reverse: asking for
    the other side makes the autopilot put it over the way that swings the bow to the wanted one. Half a minute
    without success changes sides.
    """
    assert situation.twd_from_rad is not None
    t = situation.t_s - state.since_s
    side = state.irons_side * (-1 if int(t / 30.0) % 2 else 1)
    # Over the ground she drifts to leeward even at rest: the rudder feels the water.
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


def _watch_irons(state: GuidanceState, t_s: float, twa: float, way_mps: float, habits: Habits) -> GuidanceState:
    caught = abs(twa) < habits.no_go_half_rad - math.radians(8.0) and way_mps < 0.25
    if not caught or state.manoeuvre is Manoeuvre.IRONS:
        return replace(state, stuck_since_s=None)
    since = t_s if state.stuck_since_s is None else state.stuck_since_s
    patience = habits.tack_s if state.manoeuvre is Manoeuvre.TACK else 4.0
    if t_s - since >= patience:
        return replace(
            state, manoeuvre=Manoeuvre.IRONS, since_s=t_s, stuck_since_s=None, failed_tacks=state.failed_tacks + 1,
            irons=state.irons + 1, irons_side=1 if twa > 0.0 else -1,
        )
    return replace(state, stuck_since_s=since)


# ------------------------------------------------------------------------------------- look-ahead
_FAN_TWA = np.radians(np.arange(0.0, 181.0, 6.0))
_STEP_S = 2.5


def _choose(
    wanted_rad: float, twd: float | None, situation: Situation, intent: Intent, habits: Habits, state: GuidanceState
) -> tuple[float, float | None]:
    """Return the heading of the fan with the least cost, and its margin [m]."""
    if not situation.obstacles and intent.stay_in is None:
        return wanted_rad, None
    if twd is None:
        headings = np.concatenate([[wanted_rad], wanted_rad + np.radians(np.arange(6.0, 360.0, 6.0))])
    else:
        open_twa = _FAN_TWA[habits.no_go_half_rad < _FAN_TWA]
        edges = np.concatenate([[habits.no_go_half_rad], open_twa])
        headings = np.concatenate([[wanted_rad], twd - edges, twd + edges])
    track, lost_s = foresee(headings, twd, situation, habits)
    cost = 1.0 - np.cos(headings - wanted_rad) + 0.02 * lost_s
    last = state.wanted_rad
    if last is not None:
        cost += 0.1 * (1.0 - np.cos(headings - last))
    margin = margins(track, situation.obstacles)
    if situation.obstacles:
        cost += np.where(margin < 0.0, 10.0 - 0.2 * margin, 0.0)
        cost += np.maximum(0.0, 1.0 - np.maximum(margin, 0.0) / habits.comfort_m)
        cost += habits.ahead_cost * crosses_ahead(track, situation.obstacles)
    if intent.stay_in is not None:
        cost += 4.0 * _leaving(track, intent.stay_in, habits)
    best = int(np.argmin(cost))
    return wrap_pi(float(headings[best])), float(margin[best]) if situation.obstacles else None


def foresee(
    headings: NDArray[np.float64], twd: float | None, situation: Situation, habits: Habits
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where each heading (k,) takes the boat: (k, t, 2) [m], and the time each loses by turning (k,) [s].

    The present velocity dies away while the boat turns, that of the new heading grows after it.
    """
    t = np.arange(0.0, habits.horizon_s + 1e-9, _STEP_S)
    if twd is None:
        speed = np.full(len(headings), habits.polar_mps[-1])
        lost = np.abs(_wrap(headings - situation.heading_rad)) / habits.turn_rate_radps
        leeway = np.zeros(2)
    else:
        twa = _wrap(twd - headings)
        now = wrap_pi(twd - situation.heading_rad)
        speed = np.interp(np.abs(twa), habits.polar_twa_rad, habits.polar_mps)
        turn = np.abs(twa - now)
        tacks = (twa * now < 0.0) & (turn < math.pi)
        turn = np.where(turn > math.pi, 2.0 * math.pi - turn, turn)
        lost = turn / habits.turn_rate_radps + np.where(tacks, habits.tack_s, 0.0)
        drift = habits.leeway_share * situation.tws_mps
        leeway = -drift * np.array([math.sin(twd), math.cos(twd)])
    unit = np.column_stack([np.sin(headings), np.cos(headings)])
    velocity = speed[:, None] * unit + leeway
    lag = max(habits.lag_s, 0.1)
    coast = lag * (1.0 - np.exp(-t / lag))
    after = np.maximum(0.0, t[None, :] - 0.5 * lost[:, None])
    go = after - lag * (1.0 - np.exp(-after / lag))
    present = np.asarray(situation.velocity_en_mps)
    track = np.asarray(situation.en_m) + coast[None, :, None] * present + go[:, :, None] * velocity[:, None, :]
    return track, lost


def margins(track: NDArray[np.float64], obstacles: Sequence[Obstacle]) -> NDArray[np.float64]:
    """Return the least distance outside all discs along each track (k,) [m]; inf without obstacles."""
    t = np.arange(track.shape[1]) * _STEP_S
    least = np.full(track.shape[0], math.inf)
    for o in obstacles:
        x, y = o.en_m[0] + o.velocity_en_mps[0] * t, o.en_m[1] + o.velocity_en_mps[1] * t
        # Between samples the closest approach is that of straight motion: use the segment's minimum.
        dx, dy = track[:, :, 0] - x, track[:, :, 1] - y
        ex, ey = np.diff(dx, axis=1), np.diff(dy, axis=1)
        share = np.clip(-(dx[:, :-1] * ex + dy[:, :-1] * ey) / np.maximum(ex * ex + ey * ey, 1e-9), 0.0, 1.0)
        d = np.hypot(dx[:, :-1] + share * ex, dy[:, :-1] + share * ey) - (o.keep_m + o.growth_mps * t[:-1])
        least = np.minimum(least, d.min(axis=1))
    return least


def crosses_ahead(track: NDArray[np.float64], obstacles: Sequence[Obstacle]) -> NDArray[np.float64]:
    """Return how near ahead of a moving obstacle each track crosses its course line, (k,): 0 not, to 1 at the bow.

    A crossing ahead at a minute's run or more of the other counts nothing: a cost, not a veto (COLREGs 15, by habit).
    """
    t = np.arange(track.shape[1]) * _STEP_S
    worst = np.zeros(track.shape[0])
    for o in obstacles:
        speed = math.hypot(*o.velocity_en_mps)
        if speed < 0.3:
            continue
        ux, uy = o.velocity_en_mps[0] / speed, o.velocity_en_mps[1] / speed
        dx = track[:, :, 0] - o.en_m[0] - o.velocity_en_mps[0] * t
        dy = track[:, :, 1] - o.en_m[1] - o.velocity_en_mps[1] * t
        ahead, right = dx * ux + dy * uy, dx * uy - dy * ux
        crossing = (right[:, :-1] * right[:, 1:] < 0.0) & (ahead[:, :-1] > 0.0)
        near = np.maximum(0.0, 1.0 - ahead[:, :-1] / (60.0 * speed + o.keep_m))
        worst = np.maximum(worst, np.where(crossing, near, 0.0).max(axis=1))
    return worst


def _leaving(
    track: NDArray[np.float64], box: tuple[float, float, float, float], habits: Habits
) -> NDArray[np.float64]:
    """Return how soon each track leaves the box, 0 (not within half the horizon) to 1 (now)."""
    x, y = track[:, :, 0], track[:, :, 1]
    inside = (x > box[0]) & (x < box[2]) & (y > box[1]) & (y < box[3])
    steps = np.where(inside.all(axis=1), track.shape[1], np.argmin(inside, axis=1)) * _STEP_S
    return np.asarray(np.maximum(0.0, 1.0 - steps / (0.5 * habits.horizon_s)), dtype=np.float64)


def _wrap(angles: NDArray[np.float64]) -> NDArray[np.float64]:
    return (angles + math.pi) % (2.0 * math.pi) - math.pi


# ------------------------------------------------------------------------------------ last resort
@dataclass(frozen=True, slots=True, kw_only=True)
class LastResort:
    """Is the field steering instead of the plan? A target too near to plan for takes over, clear water hands back."""

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
    return Intent(field=AttractivePoint().shifted(*point_en), zone=Zone.of_point(point_en, twd_from_rad, half_m))


def follow_line(a_en: tuple[float, float], b_en: tuple[float, float], half_m: float = ZONE_M) -> Intent:
    """Return the intent to follow a line."""
    return Intent(field=line_between(a_en, b_en, half_m), zone=Zone.of_line(a_en, b_en, half_m))


def hold_heading(heading_rad: float) -> Intent:
    """Return the intent to keep a heading."""
    return Intent(field=Uniform(heading_rad))
