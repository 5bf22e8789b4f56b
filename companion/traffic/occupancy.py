"""Where not to be, and when: predicted vessels as moving discs for a planner that plans in time.

A ``Disc`` has the fields of ``companion.planner.problem.Target`` (the planner sits above this room and makes one
from the other). Its radius grows linearly; the radius that is needed, hull and clearance and k sigma(t), is convex
in time and its centre straight, so the chord over a window covers it all through the window. A turning vessel's
arc adds its own sagitta.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from companion.traffic.approach import OwnShip
from companion.traffic.predict import (
    TURN_HOLD_S,
    Motion,
    Prediction,
    motion_of,
    predict,
    risk_factor,
    turn_rate,
)
from companion.traffic.vessel import Vessel

# Predictions beyond this are not worth avoiding: the plan is made again long before.
HORIZON_S = 900.0
# Windows of one disc each, as shares of the horizon: short where the spread bends most.
_SHARES = (0.0, 0.12, 0.4, 1.0)
BUSSER_WINDOW_S = 20.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Disc:
    """A moving disc: at (x + vx t, y + vy t), radius ``radius_m + growth_mps t``, for from_s <= t <= until_s.

    Times count from the moment for which the disc was made. ``mmsi`` says whose it is.
    """

    x_m: float
    y_m: float
    vx_mps: float
    vy_mps: float
    radius_m: float
    growth_mps: float
    from_s: float
    until_s: float
    name: str
    mmsi: int

    def centre_en_m(self, t_s: float) -> tuple[float, float]:
        """Return the centre at ``t_s``."""
        return self.x_m + self.vx_mps * t_s, self.y_m + self.vy_mps * t_s

    def radius_at_m(self, t_s: float) -> float:
        """Return the radius at ``t_s``."""
        return self.radius_m + self.growth_mps * t_s


@dataclass(frozen=True, slots=True, kw_only=True)
class Keep:
    """How far to keep away.

    Attributes:
        risk: probability, per vessel and instant, that its hull is outside its disc.
        clearance_m: between hulls, beyond that.
        own_radius_m: half our length.
        own_timing_mps: how fast our own place along the plan becomes uncertain [m/s]: speed error, tacks.
        ahead_m: each disc is lengthened by this much ahead of a moving vessel (its centre moves forward by half
            of it): crossing astern becomes the shorter way round.
        horizon_s: how far the discs reach.

    """

    risk: float = 1e-3
    clearance_m: float = 5.0
    own_radius_m: float = 1.0
    own_timing_mps: float = 0.1
    ahead_m: float = 0.0
    horizon_s: float = HORIZON_S


def needed_radius_m(there: Prediction, t_s: float, keep: Keep) -> float:
    """Return the radius to keep out of about the predicted centre, ``t_s`` into the plan [m]."""
    sigma = math.hypot(max(there.sigma_along_m, there.sigma_across_m), keep.own_timing_mps * t_s)
    return there.reach_m + keep.own_radius_m + keep.clearance_m + risk_factor(keep.risk) * sigma


def planning_discs(
    vessels: Iterable[Vessel], t_s: float, keep: Keep | None = None, *, motion: Motion | None = None
) -> tuple[Disc, ...]:
    """Return the discs of all vessels for a plan that starts at ``t_s``.

    Args:
        vessels: of the traffic picture, those that matter.
        t_s: when the plan starts (its t = 0).
        keep: distances and risk.
        motion: how surely they keep course; by class where None.

    """
    rules = keep or Keep()
    return tuple(disc for vessel in vessels for disc in _discs(vessel, t_s, rules, motion))


def _discs(vessel: Vessel, t_s: float, keep: Keep, motion: Motion | None) -> list[Disc]:
    model = motion if motion is not None else motion_of(vessel)
    turn = turn_rate(vessel)
    cuts = [share * keep.horizon_s for share in _SHARES]
    if turn != 0.0:
        # Inside the turn: three chords of the arc; each cut is a corner of the path.
        over = max(0.0, vessel.t_s + TURN_HOLD_S - t_s)
        cuts = sorted({*cuts, *(share * over for share in (1 / 3, 2 / 3, 1.0) if over > 0.0)})
    out = []
    for begin, end in itertools.pairwise(cuts):
        if end - begin < 1e-6:
            continue
        out.append(_disc(vessel, t_s, begin, end, keep, model, turn))
    return out


def _disc(
    vessel: Vessel, t_s: float, begin: float, end: float, keep: Keep, motion: Motion, turn: float
) -> Disc:
    a, b = predict(vessel, t_s + begin, motion), predict(vessel, t_s + end, motion)
    span = end - begin
    vx, vy = (b.mean_en_m[0] - a.mean_en_m[0]) / span, (b.mean_en_m[1] - a.mean_en_m[1]) / span
    # An arc of angle turn * span and length v * span is never further than this from its chord's moving point.
    speed = math.hypot(*a.velocity_en_mps)
    arc = min(abs(turn) * span, math.pi) if t_s + begin < vessel.t_s + TURN_HOLD_S else 0.0
    sagitta = speed * span * arc / 8.0 * 1.2
    ra, rb = needed_radius_m(a, begin, keep) + sagitta, needed_radius_m(b, end, keep) + sagitta
    growth = (rb - ra) / span
    x, y = a.mean_en_m
    if keep.ahead_m > 0.0 and math.hypot(vx, vy) > 0.3:
        ahead = 0.5 * keep.ahead_m
        x, y = x + ahead * vx / math.hypot(vx, vy), y + ahead * vy / math.hypot(vx, vy)
        ra += ahead
    return Disc(
        x_m=x - vx * begin, y_m=y - vy * begin, vx_mps=vx, vy_mps=vy, radius_m=ra - growth * begin, growth_mps=growth,
        from_s=begin, until_s=end, name=vessel.label, mmsi=vessel.mmsi,
    )


def too_near(discs: Sequence[Disc], own: OwnShip) -> tuple[Disc, ...]:
    """Return the discs that our boat is already in: no plan can start, steer by field (or by hand) first."""
    out = []
    for disc in discs:
        if disc.from_s > 0.0:
            continue
        x, y = disc.centre_en_m(0.0)
        if math.hypot(own.en_m[0] - x, own.en_m[1] - y) < disc.radius_at_m(0.0):
            out.append(disc)
    return tuple(out)


def time_matched_discs(
    vessels: Iterable[Vessel], t_s: float, own: OwnShip, radius_m: float, *, mean_speed_mps: float,
    window_s: float = BUSSER_WINDOW_S, horizon_s: float = HORIZON_S, step_s: float = 5.0,
) -> tuple[tuple[float, float, float], ...]:
    """Return Büsser's static obstacles (x, y, radius) [m]: where a ship and we could meet.

    Along each ship's future track, the points at which |t - d(t) / v| < 20 s, d(t) being our distance to the ship
    then and v our mean speed (Büsser 2009, condition 4.7; the printed form has no absolute value, which would turn
    every early point into an obstacle).
    """
    out = []
    for vessel in vessels:
        for i in range(int(horizon_s / step_s) + 1):
            t = i * step_s
            x, y = predict(vessel, t_s + t).mean_en_m
            if abs(t - math.hypot(x - own.en_m[0], y - own.en_m[1]) / mean_speed_mps) < window_s:
                out.append((x, y, radius_m + vessel.reach_m))
    return tuple(out)
