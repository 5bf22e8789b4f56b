"""Look-ahead: a fan of sailable headings, where each would take the boat, and what it would cost.

The cheapest is the one nearest to the field's that keeps its distance from vessels for the next minute and a half
and from the shore for as long as it needs to turn away from it, and after which there is still a way out.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import Polygon

from companion.field.values import Clearance, GuidanceSettings, GuidanceState, Intent, MovingObstacle, Situation
from companion.field.vector_fields import NOMINAL, Field, Vectors
from companion.geo.angles import wrap_pi, wrap_pi_array

OTHER_SIDE_COST = 2.0  # of changing one's mind about the side on which to pass what stands in the way
KEPT_LEAST, KEPT_MOST, KEPT_SHARE = 0.1, 1.0, 0.25  # of a change by a right angle; the share of the best one's cost
TURNS_RAD = math.radians(25.0)  # farther off the heading that was chosen she is turning to it
OTHER_TURN_COST = 4.0  # of turning back in the middle of a turn
PINCHED = 2.0  # of the shore's cost: so much, wherever she keeps out of the vessels' discs, and she is between both
RING_COST = 2.0  # of all of a disc's ring, then
TOUCH_M = 3.0  # nearer is touching: the hull, and where she is within it
TOUCH_COST = 1000.0
TURNS_SPARE_S = 3.0
QUICK_RADPS = math.radians(60.0)  # what a boat turns at, at the most
LEFT_AFTER_S = 5.0  # so much later there is still a way out: wind and turn may differ from what is foreseen
ALIKE_RAD = math.radians(17.0)  # headings that are nearer to each other lead to the same ways out
_FAN_TWA = np.radians(np.arange(0.0, 181.0, 6.0))
_STEP_S = 2.5
_FINE_S = 0.5
_BETWEEN = np.array([0.25, 0.5, 0.75])  # of the way from step to step
STEERAGE_MPS = 0.3  # slower she goes wherever she is set


def choose(
    wanted_rad: float,
    twd: float | None,
    situation: Situation,
    intent: Intent,
    habits: GuidanceSettings,
    state: GuidanceState,
) -> tuple[float, float | None, int]:
    """Return the heading of the fan with the least cost, its margin [m], and the side to pass what stands still on."""
    if not situation.obstacles and intent.stay_in is None and intent.clearance is None:
        return wanted_rad, None, 0
    if state.failed_tacks:
        habits = replace(habits, tack_min_mps=math.inf)
    headings = _fan(wanted_rad, twd, habits)
    track, lost_s = foresee(headings, twd, situation, habits)
    cost = 1.0 - np.cos(headings - wanted_rad) + 0.02 * lost_s
    margin, blocked = margins(track, situation.obstacles), False
    shore, clear, ashore = intent.clearance, None, None
    if shore is not None:
        clear = _clear(track, shore, habits)
        if float(clear[0, 0]) > _reach_m(situation, habits):
            shore = None  # all that is looked at is open water
        ashore = _ashore(clear, habits)
    if situation.obstacles:
        cost += _inside(track, margin, ashore, situation.obstacles)
        cost += np.maximum(0.0, 1.0 - np.maximum(margin, 0.0) / habits.comfort_m)
        cost += habits.ahead_cost * crosses_ahead(track, situation.obstacles)
    if intent.stay_in is not None:
        cost += 4.0 * _leaving(track, intent.stay_in, habits)
    if ashore is not None:
        # headings[0] is the field's own. On a beat the tack the boat is on is the side that is kept, by q.
        beats = twd is not None and abs(wrap_pi(wanted_rad - twd)) < habits.no_go_half_rad + 1e-6
        blocked = bool(ashore[0] > 0.0) and not beats
        side = wrap_pi_array(headings - wanted_rad) * state.round_side
        cost += ashore + np.where(blocked & (side < 0.0), OTHER_SIDE_COST, 0.0)
    if clear is not None:
        if shore is not None:
            # Hers may turn much faster than is stated of her: what she is led into by that counts as touching, too.
            quick, _ = foresee(headings, twd, situation, _quick(habits))
            clear = np.minimum(clear, _clear(quick, shore, habits))
        cost += _touches(clear, habits)
    cost += _changing(headings, cost, situation.heading_rad, state.wanted_rad)
    best = int(np.argmin(cost))
    if shore is not None and clear is not None:
        touch_m = min(TOUCH_M, float(clear[:, 0].min()) - 0.5)
        near_m = clear[:, : int(_turns_round_s(habits) / _STEP_S) + 2].min(axis=1)
        if near_m[best] >= touch_m:
            # The shore is certain, a vessel's disc is not; but no way out leads through one that could be kept out of.
            may = margin >= min(0.0, float(margin[best]))
            order = [int(k) for k in np.argsort(cost, kind="stable") if may[k]]
            best = _with_way_out(order, headings, near_m, (track, lost_s), twd, situation, shore, habits, touch_m)
    round_side = state.round_side
    if not blocked:
        round_side = 0
    elif round_side == 0:
        round_side = 1 if wrap_pi(float(headings[best]) - wanted_rad) > 0.0 else -1
    return wrap_pi(float(headings[best])), float(margin[best]) if situation.obstacles else None, round_side


def _fan(wanted_rad: float, twd: float | None, habits: GuidanceSettings, every: int = 1) -> NDArray[np.float64]:
    """Return the headings to choose from [rad], (k,): the field's own, then those that can be sailed, ``every`` one."""
    if twd is None:
        return np.concatenate([[wanted_rad], wanted_rad + np.radians(np.arange(6.0, 360.0, 6.0))[::every]])
    edges = np.concatenate([[habits.no_go_half_rad], _FAN_TWA[habits.no_go_half_rad < _FAN_TWA][every - 1 :: every]])
    return np.concatenate([[wanted_rad], twd - edges, twd + edges])


def _reach_m(situation: Situation, habits: GuidanceSettings) -> float:
    """Return how far off the shore has no part in what is chosen [m]: farther than all that is looked at."""
    fastest = max(*habits.polar_mps, math.hypot(*situation.velocity_en_mps))
    carried = habits.leeway_share * situation.tws_mps + math.hypot(*situation.current_en_mps)
    looked_s = max(habits.shore_s, LEFT_AFTER_S + _turns_round_s(habits)) + 3.0 * _STEP_S
    return (fastest + carried) * looked_s + max(1.5 * habits.keep_m, TOUCH_M)


def _with_way_out(
    order: Sequence[int],
    headings: NDArray[np.float64],
    near_m: NDArray[np.float64],
    foreseen: tuple[NDArray[np.float64], NDArray[np.float64]],
    twd: float | None,
    situation: Situation,
    shore: Clearance,
    habits: GuidanceSettings,
    touch_m: float,
) -> int:
    """Return the first heading of ``order`` after which there is still a way out, the roomiest where none has.

    Into a wedge the way straight on is clear for longer than there is room to turn round, so that a heading is clear
    is not enough: ``LEFT_AFTER_S`` later some heading must be clear for as long as turning round takes.
    """
    track, lost_s = foreseen
    after, closed = round(LEFT_AFTER_S / _STEP_S), np.empty(0)
    roomiest, most_m = order[0], -math.inf
    look = replace(habits, horizon_s=_turns_round_s(habits) + 2.0 * _STEP_S)
    for k in order:
        if near_m[k] <= most_m or bool((np.abs(wrap_pi_array(closed - headings[k])) < ALIKE_RAD).any()):
            continue
        turned = wrap_pi(float(headings[k]) - situation.heading_rad) * min(1.0, LEFT_AFTER_S / max(lost_s[k], _FINE_S))
        east, north = (track[k, after] - track[k, after - 1]) / _STEP_S
        then = replace(
            situation,
            en_m=(float(track[k, after, 0]), float(track[k, after, 1])),
            velocity_en_mps=(float(east), float(north)),
            heading_rad=wrap_pi(situation.heading_rad + turned),
        )
        ways, _ = foresee(_fan(float(headings[k]), twd, habits, every=2), twd, then, look)
        room_m = min(float(near_m[k]), float(_clear(ways, shore, look).min(axis=1).max()))
        if room_m >= touch_m:
            return k
        if room_m > most_m:
            roomiest, most_m = k, room_m
        closed = np.append(closed, headings[k])
    return roomiest


def _changing(
    headings: NDArray[np.float64], cost: NDArray[np.float64], heading_rad: float, last_rad: float | None
) -> NDArray[np.float64]:
    """Return what changing one's mind costs, (k,): what was chosen is kept while it is about as good.

    About as good is a share of what the best heading costs: in a corner, where each costs much, two alike ways differ
    by more than two in open water do. A turn that is begun is finished, unless another is better by much.
    """
    if last_rad is None:
        return np.zeros(len(headings))
    keen = max(KEPT_LEAST, min(KEPT_MOST, KEPT_SHARE * float(cost.min())))
    changed = keen * (1.0 - np.cos(headings - last_rad))
    turn_rad = wrap_pi(last_rad - heading_rad)
    if abs(turn_rad) > TURNS_RAD:
        turns_back = wrap_pi_array(headings - heading_rad) * turn_rad < 0.0
        is_another = np.cos(headings - last_rad) < math.cos(TURNS_RAD)
        changed = changed + np.where(turns_back & is_another, OTHER_TURN_COST, 0.0)
    return np.asarray(changed, dtype=np.float64)


def _inside(
    track: NDArray[np.float64],
    margin: NDArray[np.float64],
    ashore: NDArray[np.float64] | None,
    obstacles: Sequence[MovingObstacle],
) -> NDArray[np.float64]:
    """Return what entering a disc costs each track, (k,): 10 and more, less in its ring where the shore presses.

    The shore is solid and certain, the ring of a vessel's disc is distance kept beside her: where every heading that
    keeps out of the discs leads towards the shore, the ring is entered by degrees, the disc within it not.
    """
    if ashore is None or bool(((margin >= 0.0) & (ashore < PINCHED)).any()):
        return np.asarray(np.where(margin < 0.0, 10.0 - 0.2 * margin, 0.0), dtype=np.float64)
    worst = np.zeros(len(margin))
    for o in obstacles:
        depth = np.maximum(0.0, -margins(track, (o,)))
        ring = RING_COST * np.minimum(1.0, depth / max(o.ring_m, 1e-9))
        beyond = depth - o.ring_m
        worst = np.maximum(worst, np.where(beyond > 0.0, RING_COST + 10.0 + 0.2 * beyond, ring))
    return worst


def foresee(
    headings: NDArray[np.float64], twd: float | None, situation: Situation, habits: GuidanceSettings
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return where each heading (k,) takes the boat: (k, t, 2) [m], and the time each loses by turning (k,) [s].

    The way through the water turns with the bow, evenly over that time, and its speed becomes that of the new heading:
    so a turn looks the same from the middle of it as from its beginning. Who does not tack turns by the stern.
    """
    way = wrap_pi_array(headings - situation.heading_rad)
    lost = np.abs(way) / habits.turn_rate_radps
    if twd is None:
        speed = np.full(len(headings), habits.polar_mps[-1])
        leeway = np.zeros(2)
    else:
        twa = wrap_pi_array(twd - headings)
        now = wrap_pi(twd - situation.heading_rad)
        speed = np.interp(np.abs(twa), habits.polar_twa_rad, habits.polar_mps)
        tacks = (twa * now < 0.0) & (np.abs(twa - now) < math.pi)
        if math.isinf(habits.tack_min_mps):
            way = np.where(tacks, way - np.copysign(2.0 * math.pi, way), way)
            lost = np.abs(way) / habits.turn_rate_radps
        else:
            lost = lost + np.where(tacks, habits.tack_s, 0.0)
        drift = habits.leeway_share * situation.tws_mps
        leeway = -drift * np.array([math.sin(twd), math.cos(twd)])
    carried = leeway + np.asarray(situation.current_en_mps)
    through = np.asarray(situation.velocity_en_mps) - carried
    present = float(np.hypot(*through))
    course = math.atan2(through[0], through[1]) if present > STEERAGE_MPS else situation.heading_rad
    turn = way + wrap_pi(situation.heading_rad - course)  # of the way through the water, to the bow's side
    t = np.arange(0.5 * _FINE_S, habits.horizon_s, _FINE_S)
    share = np.minimum(1.0, t / np.maximum(lost, _FINE_S)[:, None])
    heading = course + turn[:, None] * share
    runs = speed[:, None] + (present - speed)[:, None] * np.exp(-t / max(habits.lag_s, 0.1))
    steps = _FINE_S * (runs[:, :, None] * np.stack([np.sin(heading), np.cos(heading)], axis=2) + carried)
    run = np.concatenate([np.zeros((len(headings), 1, 2)), np.cumsum(steps, axis=1)], axis=1)
    return np.asarray(situation.en_m) + run[:, :: round(_STEP_S / _FINE_S)], lost


def margins(track: NDArray[np.float64], obstacles: Sequence[MovingObstacle]) -> NDArray[np.float64]:
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


def crosses_ahead(track: NDArray[np.float64], obstacles: Sequence[MovingObstacle]) -> NDArray[np.float64]:
    """Return how near ahead of a moving obstacle each track crosses its course line, (k,): 0 not, to 1 at the bow.

    A crossing ahead at a minute's run or more of the other counts nothing: a cost, not a veto (COLREGs 15, by habit).
    """
    t = np.arange(track.shape[1]) * _STEP_S
    worst = np.zeros(track.shape[0])
    for o in obstacles:
        if not o.moves:
            continue
        speed = math.hypot(*o.velocity_en_mps)
        ux, uy = o.velocity_en_mps[0] / speed, o.velocity_en_mps[1] / speed
        dx = track[:, :, 0] - o.en_m[0] - o.velocity_en_mps[0] * t
        dy = track[:, :, 1] - o.en_m[1] - o.velocity_en_mps[1] * t
        ahead, right = dx * ux + dy * uy, dx * uy - dy * ux
        crossing = (right[:, :-1] * right[:, 1:] < 0.0) & (ahead[:, :-1] > 0.0)
        near = np.maximum(0.0, 1.0 - ahead[:, :-1] / (60.0 * speed + o.keep_m))
        worst = np.maximum(worst, np.where(crossing, near, 0.0).max(axis=1))
    return worst


def _leaving(
    track: NDArray[np.float64], box: tuple[float, float, float, float], habits: GuidanceSettings
) -> NDArray[np.float64]:
    """Return how soon each track leaves the box, 0 (not within half the horizon) to 1 (now)."""
    x, y = track[:, :, 0], track[:, :, 1]
    inside = (x > box[0]) & (x < box[2]) & (y > box[1]) & (y < box[3])
    steps = np.where(inside.all(axis=1), track.shape[1], np.argmin(inside, axis=1)) * _STEP_S
    return np.asarray(np.maximum(0.0, 1.0 - steps / (0.5 * habits.horizon_s)), dtype=np.float64)


def _turns_round_s(habits: GuidanceSettings) -> float:
    """Return how long turning round takes at most, to be sure [s]."""
    return math.pi / habits.turn_rate_radps + habits.tack_s + TURNS_SPARE_S


def _quick(habits: GuidanceSettings) -> GuidanceSettings:
    """Return the habits of a boat that turns at once: hers may turn much faster than is stated of her."""
    return replace(habits, turn_rate_radps=max(QUICK_RADPS, habits.turn_rate_radps), tack_s=0.0)


def _clear(track: NDArray[np.float64], clearance: Clearance, habits: GuidanceSettings) -> NDArray[np.float64]:
    """Return how far off what stands still each track is, step by step as far as anything here looks: (k, t) [m]."""
    near = track[:, : max(int(habits.shore_s / _STEP_S) + 1, int(_turns_round_s(habits) / _STEP_S) + 2)]
    clear = clearance(near.reshape(-1, 2)).reshape(near.shape[:2])
    # Between two steps lie ten metres at 4 m/s, and in these a rock's corner: looked at where both ends leave it open.
    runs = np.diff(near, axis=1)
    k, t = np.nonzero(clear[:, :-1] + clear[:, 1:] - np.hypot(runs[:, :, 0], runs[:, :, 1]) < 2.0 * TOUCH_M)
    if k.size:
        between = near[k, t] + _BETWEEN[:, None, None] * runs[k, t]
        least = clearance(between.reshape(-1, 2)).reshape(between.shape[:2]).min(axis=0)
        clear[k, t + 1] = np.minimum(clear[k, t + 1], least)
    return clear


def _ashore(clear: NDArray[np.float64], habits: GuidanceSettings) -> NDArray[np.float64]:
    """Return what each track's way towards what stands still costs, (k,): 0 clear, to 40 where it touches now.

    Nearer than ``keep_m`` counts by how soon, and so does touching, again; how near counts from half as far again on,
    so that of two ways past a corner the wider is taken. A boat that is within that distance already is let out of it:
    what counts then is coming nearer still.
    """
    clear = clear[:, : int(habits.shore_s / _STEP_S) + 1]
    now = float(clear[:, 0].min())
    soon = 1.0 - np.arange(clear.shape[1]) * _STEP_S / habits.shore_s
    depth = np.clip((1.5 * habits.keep_m - clear) / max(habits.keep_m, 1.0), 0.0, 2.5)
    cost = np.asarray(3.0 * np.max((depth * np.maximum(soon, 0.0))[:, 1:], axis=1, initial=0.0), dtype=np.float64)
    for keep in (min(habits.keep_m, now - 0.5), min(0.5, now - 0.5)):
        hit = clear < keep
        first = np.where(hit.any(axis=1), np.argmax(hit, axis=1), clear.shape[1]) * _STEP_S
        cost += 12.0 * np.maximum(0.0, 1.0 - first / habits.shore_s)
    return cost


def _touches(clear: NDArray[np.float64], habits: GuidanceSettings) -> NDArray[np.float64]:
    """Return what touching what stands still costs within the time that turning round takes, (k,): more than all else.

    Nothing where every heading does: the shore is certain, a vessel's disc is not, and what is left then is to choose.
    """
    clear = clear[:, : int(_turns_round_s(habits) / _STEP_S) + 2]
    hits = (clear < min(TOUCH_M, float(clear[:, 0].min()) - 0.5)).any(axis=1)
    return np.where(hits & ~hits.all(), TOUCH_COST, 0.0)


# Out of some water: the heading by which a boat is soonest outside, clear of who is in the way (WRSC 2013).

AHEAD_S = 25.0  # what crossing ahead of a vessel is held to cost, at its bow
AGAIN_S = 8.0  # what changing one's mind costs: half a turn twice as much
CLEAR_M = 10.0  # outside every vessel's disc nothing is added
LOOK_S, MOST_LOOK_S = 150.0, 1800.0
BEYOND_M = 5.0  # outside is so far outside
FAN_RAD = np.radians(np.arange(0.0, 360.0, 10.0))
PINCH_RAD = math.radians(4.0)


def way_out_rad(seen: Situation, water: Polygon, habits: GuidanceSettings, last_rad: float | None = None) -> float:
    """Return the heading by which the boat is soonest outside of ``water``, on a course that keeps clear of vessels.

    ``last_rad`` is the one that was chosen before: another must be better by more than a trifle.
    """
    fan: NDArray[np.float64] = FAN_RAD
    if habits.is_sailing and seen.twd_from_rad is not None:
        twa = np.abs(wrap_pi_array(seen.twd_from_rad - fan))
        fan = fan[twa > habits.no_go_half_rad + PINCH_RAD]
    size_m = math.hypot(water.bounds[2] - water.bounds[0], water.bounds[3] - water.bounds[1])
    look_s = min(MOST_LOOK_S, max(LOOK_S, 1.5 * size_m / max(*habits.polar_mps, 0.3)))
    track, _ = foresee(fan, seen.twd_from_rad if habits.is_sailing else None, seen, replace(habits, horizon_s=look_s))
    outside = ~shapely.contains_xy(shapely.buffer(water, BEYOND_M, join_style="mitre"), track[:, :, 0], track[:, :, 1])
    step_s = look_s / max(1, track.shape[1] - 1)
    cost = np.where(outside.any(axis=1), outside.argmax(axis=1), outside.shape[1]) * step_s
    if seen.obstacles:
        margin = margins(track, seen.obstacles)
        cost = cost + np.where(margin < CLEAR_M, 20.0 * (CLEAR_M - np.maximum(margin, -20.0)) / CLEAR_M, 0.0)
        cost = cost + AHEAD_S * crosses_ahead(track, seen.obstacles)
    if last_rad is not None:
        cost = cost + AGAIN_S * (1.0 - np.cos(fan - last_rad))
    return wrap_pi(float(fan[int(np.argmin(cost))]))


@dataclass(frozen=True, slots=True)
class WayOut(Field):
    """The way out of some water from each place in it, a nominal field: as ``way_out_rad`` finds it for a boat there.

    With ``at_rad`` the same heading everywhere: the one that was found for the boat. Outside it has no value.
    """

    water: Polygon
    seen: Situation
    habits: GuidanceSettings
    at_rad: float | None = None

    def evaluate(self, p: Vectors) -> Vectors:
        """Return the vectors (n, 2)."""
        inside = shapely.contains_xy(shapely.buffer(self.water, BEYOND_M), p[:, 0], p[:, 1])
        headings = np.zeros(len(p)) if self.at_rad is None else np.full(len(p), self.at_rad)
        for i in np.flatnonzero(inside) if self.at_rad is None else ():
            here = replace(self.seen, en_m=(float(p[i, 0]), float(p[i, 1])), velocity_en_mps=(0.0, 0.0))
            headings[i] = way_out_rad(here, self.water, self.habits)
        return np.where(inside[:, None], NOMINAL * np.column_stack([np.sin(headings), np.cos(headings)]), 0.0)
