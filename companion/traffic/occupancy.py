"""Where not to be, and when: predicted vessels as moving discs for a planner that plans in time.

A ``Target``'s radius grows linearly; the radius that is needed, hull and clearance and k sigma(t), is convex
in time and its centre straight, so the chord over a window covers it all through the window. A turning vessel's
arc adds its own sagitta.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable
from dataclasses import dataclass, replace

from companion.messages import Spread, Target
from companion.traffic.predict import TURN_HOLD_S, MotionUncertainty, Prediction, motion_of, predict, turn_rate
from companion.traffic.vessel import STILL_MPS, Vessel

# Predictions beyond this are not worth avoiding: the plan is made again long before.
HORIZON_S = 900.0
# Windows of one disc each, as shares of the horizon: short where the spread bends most.
_SHARES = (0.0, 0.12, 0.4, 1.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Keep:
    """How far to keep away.

    Attributes:
        sigmas: the disc's radius is hulls and clearance and this many standard deviations of the larger axis.
            ``risk_factor(r)``: the hull is outside its disc with probability r at most. ``tail_factor(r)``: a boat
            outside the disc meets the vessel with probability r at most. 0: the disc that uncertainty is added to.
        clearance_m: between hulls, beyond that.
        own_radius_m: half our length.
        own_timing_mps: how fast our own place along the plan becomes uncertain [m/s]: speed error, tacks.
        ahead_m: each disc is lengthened by this much ahead of a moving vessel (its centre moves forward by half
            of it): crossing astern becomes the shorter way round.
        horizon_s: how far the discs reach.
        settled_m: windows that begin with a standard deviation above this keep radius and spread of their begin all
            through: by then there are new reports, and who had to keep out of everywhere that a vessel might be later
            would flee from all of them.

    """

    sigmas: float = 3.717
    clearance_m: float = 5.0
    own_radius_m: float = 1.0
    own_timing_mps: float = 0.1
    ahead_m: float = 0.0
    horizon_s: float = HORIZON_S
    settled_m: float = math.inf


def needed_radius_m(there: Prediction, t_s: float, keep: Keep) -> float:
    """Return the radius to keep out of about the predicted centre, ``t_s`` into the plan [m]."""
    sigma = _sigma_m(there, t_s, keep)
    return there.reach_m + keep.own_radius_m + keep.clearance_m + keep.sigmas * sigma


def _sigma_m(there: Prediction, t_s: float, keep: Keep) -> float:
    return math.hypot(max(there.sigma_along_m, there.sigma_across_m), keep.own_timing_mps * t_s)


def planning_discs(
    vessels: Iterable[Vessel], t_s: float, keep: Keep | None = None, *, motion: MotionUncertainty | None = None
) -> tuple[Target, ...]:
    """Return the discs of all vessels for a plan that starts at ``t_s``.

    Args:
        vessels: of the traffic picture, those that matter.
        t_s: when the plan starts (its t = 0).
        keep: distances and risk.
        motion: how surely they keep course; by class where None.

    """
    rules = keep or Keep()
    return tuple(disc for vessel in vessels for disc in _discs(vessel, t_s, rules, motion))


def _discs(vessel: Vessel, t_s: float, keep: Keep, motion: MotionUncertainty | None) -> list[Target]:
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
    if vessel.is_stopped and out:
        out.append(_lasting(out[-1]))
    return out


def _lasting(disc: Target) -> Target:
    """Return the disc that takes the place of a vessel's last one for ever: who lies still has not gone by then.

    Without it a plan to a place beside her came there late on purpose, and was made again each time.
    """
    end_s, spread = disc.until_s, disc.spread
    assert spread is not None
    own_m = spread.own_mps * end_s
    return replace(
        disc,
        radius_m=disc.radius_at_m(end_s),
        growth_mps=0.0,
        from_s=end_s,
        until_s=math.inf,
        spread=replace(
            spread,
            along_m=math.hypot(spread.along_m + spread.along_mps * end_s, own_m),
            along_mps=0.0,
            across_m=math.hypot(spread.across_m + spread.across_mps * end_s, own_m),
            across_mps=0.0,
            own_mps=0.0,
            sigma_m=spread.sigma_m + spread.sigma_mps * end_s,
            sigma_mps=0.0,
        ),
    )


def _disc(
    vessel: Vessel, t_s: float, begin: float, end: float, keep: Keep, motion: MotionUncertainty, turn: float
) -> Target:
    a, b = predict(vessel, t_s + begin, motion), predict(vessel, t_s + end, motion)
    span = end - begin
    vx, vy = (b.mean_en_m[0] - a.mean_en_m[0]) / span, (b.mean_en_m[1] - a.mean_en_m[1]) / span
    # An arc of angle turn * span and length v * span is never further than this from its chord's moving point.
    speed = math.hypot(*a.velocity_en_mps)
    arc = min(abs(turn) * span, math.pi) if t_s + begin < vessel.t_s + TURN_HOLD_S else 0.0
    sagitta = speed * span * arc / 8.0 * 1.2
    is_settled = max(a.sigma_along_m, a.sigma_across_m) >= keep.settled_m
    if is_settled:
        b = replace(b, sigma_along_m=a.sigma_along_m, sigma_across_m=a.sigma_across_m)
    late = begin if is_settled else end
    ra, rb = needed_radius_m(a, begin, keep) + sagitta, needed_radius_m(b, late, keep) + sagitta
    growth = (rb - ra) / span
    x, y = a.mean_en_m

    def line(first: float, last: float) -> tuple[float, float]:
        slope = (last - first) / span
        return first - slope * begin, slope

    along, across = line(a.sigma_along_m, b.sigma_along_m), line(a.sigma_across_m, b.sigma_across_m)
    sigma = line(_sigma_m(a, begin, keep), _sigma_m(b, late, keep))
    spread = Spread(
        vessel=10 * vessel.mmsi + vessel.branch,
        x_m=x - vx * begin,
        y_m=y - vy * begin,
        course_rad=b.course_rad,
        keep_m=a.reach_m + keep.own_radius_m + keep.clearance_m + sagitta,
        along_m=along[0],
        along_mps=along[1],
        across_m=across[0],
        across_mps=across[1],
        own_mps=keep.own_timing_mps,
        sigma_m=sigma[0],
        sigma_mps=sigma[1],
    )
    if keep.ahead_m > 0.0 and math.hypot(vx, vy) > STILL_MPS:
        ahead = 0.5 * keep.ahead_m
        x, y = x + ahead * vx / math.hypot(vx, vy), y + ahead * vy / math.hypot(vx, vy)
        ra += ahead
    return Target(
        x_m=x - vx * begin,
        y_m=y - vy * begin,
        vx_mps=vx,
        vy_mps=vy,
        radius_m=ra - growth * begin,
        growth_mps=growth,
        from_s=begin,
        until_s=end,
        name=vessel.label,
        mmsi=vessel.mmsi,
        spread=spread,
    )
