"""The active plan against the traffic: where it meets a target, and whether another plan should replace it."""

from __future__ import annotations

import enum
import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.geo.kernels import first_met
from companion.messages import Target

# A plan may be this deep in a disc [m]: numerical slack.
SLACK_M = 1e-3
# A safe plan is replaced only by one that is better by this share of its time and by this much ...
BETTER_SHARE, BETTER_S = 0.15, 20.0
# ... and by twice as much where the new path does not look like it: farther apart than this [m], see path_distance_m.
ALIKE_M = 150.0
STEP_M = 5.0  # at which they are compared
# A meeting later than this is left to later reports: a degree of course moves a fast ship by hundreds of metres.
PRESSING_S = 300.0
# So far ahead of a meeting its depth is looked for where neither leg nor disc ends.
_LOOKED_S = 1e9
# Plans are made again for traffic at most this often (Büsser 2009, section 5.2).
MIN_INTERVAL_S = 20.0


class TimedLeg(Protocol):
    """A leg in time; ``companion.planner.Leg`` is one. Times count from the plan's t = 0."""

    @property
    def from_en(self) -> tuple[float, float]:
        """Begin [m]."""

    @property
    def to_en(self) -> tuple[float, float]:
        """End [m]."""

    @property
    def start_s(self) -> float:
        """When it begins [s]."""

    @property
    def end_s(self) -> float:
        """When it ends [s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlainLeg:
    """A leg in time of one's own making: of a route, from now on [s]."""

    from_en: tuple[float, float]
    to_en: tuple[float, float]
    start_s: float
    end_s: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Conflict:
    """The plan enters a target's disc: on which leg, when first, and how deep at worst, on any leg [m]."""

    mmsi: int
    name: str
    leg: int
    time_s: float
    depth_m: float


def check_legs(legs: Sequence[TimedLeg], discs: Sequence[Target]) -> tuple[Conflict, ...]:
    """Return where the plan meets the discs: each vessel's earliest meeting, with its greatest depth, in order of time.

    Args:
        legs: of the plan, their times on the discs' scale; what was sailed before 0, which is now, is not looked at.
        discs: made for now.

    """
    found: dict[int, Conflict] = {}
    rows = [np.array([replace(disc, from_s=max(disc.from_s, 0.0)).row(-SLACK_M)]) for disc in discs]
    for i, leg in enumerate(legs):
        for disc, row in zip(discs, rows, strict=True):
            hit, time_s = first_met(*leg.from_en, *leg.to_en, leg.start_s, leg.end_s, row)
            if hit < 0:
                continue
            assert disc.mmsi is not None, "a vessel's disc says whose it is"
            depth_m = _depth_m(leg, disc, time_s, min(leg.end_s, disc.until_s, time_s + _LOOKED_S))
            met = Conflict(mmsi=disc.mmsi, name=disc.name, leg=i, time_s=time_s, depth_m=depth_m)
            before = found.get(disc.mmsi)
            if before is not None:
                met = replace(min(before, met, key=lambda c: c.time_s), depth_m=max(before.depth_m, depth_m))
            found[disc.mmsi] = met
    return tuple(sorted(found.values(), key=lambda c: (c.time_s, c.mmsi)))


def _depth_m(leg: TimedLeg, disc: Target, lo: float, hi: float) -> float:
    """Return how deep the leg is in the disc at worst, between lo and hi [m]."""
    span = leg.end_s - leg.start_s
    ux, uy = (0.0, 0.0)
    if span > 0.0 and math.isfinite(span):
        ux, uy = (leg.to_en[0] - leg.from_en[0]) / span, (leg.to_en[1] - leg.from_en[1]) / span
    ax, ay = leg.from_en

    def depth(t: float) -> float:  # concave in t: its maximum by golden section
        s = t - leg.start_s
        return disc.radius_at_m(t) - SLACK_M - math.dist((ax + ux * s, ay + uy * s), disc.centre_en_m(t))

    ratio = 0.5 * (math.sqrt(5.0) - 1.0)
    for _ in range(60):
        p, q = hi - ratio * (hi - lo), lo + ratio * (hi - lo)
        if depth(p) < depth(q):
            lo = p
        else:
            hi = q
    return max(0.0, depth(0.5 * (lo + hi)))


def pressing(conflicts: Sequence[Conflict]) -> tuple[Conflict, ...]:
    """Return the meetings that a plan is given up for: those within ``PRESSING_S``."""
    return tuple(c for c in conflicts if c.time_s < PRESSING_S)


class Decision(enum.Enum):
    """What to do with the active plan, seen from the traffic."""

    KEEP = "keep"
    REPLAN = "replan"  # it has become unsafe: look for another
    WAIT = "wait"  # unsafe, but the last plan for traffic is too young and the meeting not near
    REPLACE_UNSAFE = "replace: the active plan meets a target"
    REPLACE_BETTER = "replace: clearly better"


def decide(
    conflicts: Sequence[Conflict],
    *,
    since_replan_s: float,
    urgent_s: float = 60.0,
    active_cost_s: float | None = None,
    new_cost_s: float | None = None,
    apart_m: float | None = None,
) -> Decision:
    """Return whether to replan (no new plan yet) or to replace (``new_cost_s`` given).

    A plan that stays safe is kept unless the new one is better by 15 % and 20 s, or by twice that where the new path
    is ``apart_m`` > ``ALIKE_M`` from it. Replanning for traffic keeps 20 s apart unless the meeting is nearer than
    ``urgent_s``.
    """
    if new_cost_s is not None:
        if conflicts:
            return Decision.REPLACE_UNSAFE
        times = 2.0 if apart_m is not None and apart_m > ALIKE_M else 1.0
        if active_cost_s is not None and (
            active_cost_s - new_cost_s > times * max(BETTER_S, BETTER_SHARE * active_cost_s)
        ):
            return Decision.REPLACE_BETTER
        return Decision.KEEP
    if not conflicts:
        return Decision.KEEP
    if since_replan_s < MIN_INTERVAL_S and conflicts[0].time_s > urgent_s:
        return Decision.WAIT
    return Decision.REPLAN


def path_distance_m(a_en: ArrayLike, b_en: ArrayLike) -> float:
    """Return how different two paths look: the discrete Fréchet distance of their common future [m].

    Both are resampled every ``STEP_M`` (error at most half of it). The older path may begin further back: it is
    cut at the point nearest to the newer one's start first, so that what was sailed since does not count.

    Args:
        a_en: (n, 2) the older path.
        b_en: (m, 2) the newer path.

    """
    a, b = _resample(np.asarray(a_en, dtype=np.float64)), _resample(np.asarray(b_en, dtype=np.float64))
    if len(a) == 0 or len(b) == 0:
        return math.inf
    a = a[int(np.argmin(np.hypot(*(a - b[0]).T))) :]
    distance = np.hypot(a[:, None, 0] - b[None, :, 0], a[:, None, 1] - b[None, :, 1])
    reach = np.empty_like(distance)
    reach[0] = np.maximum.accumulate(distance[0])
    for i in range(1, len(a)):
        best = np.minimum(reach[i - 1], np.concatenate([[math.inf], reach[i - 1, :-1]]))
        row = reach[i]
        last = math.inf
        for j in range(len(b)):
            last = max(distance[i, j], min(best[j], last))
            row[j] = last
    return float(reach[-1, -1])


def _resample(path: NDArray[np.float64]) -> NDArray[np.float64]:
    points = path.reshape(-1, 2)
    if len(points) < 2:
        return points
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    count = max(2, math.ceil(float(run[-1]) / STEP_M) + 1)
    at = np.linspace(0.0, float(run[-1]), count)
    return np.column_stack([np.interp(at, run, points[:, 0]), np.interp(at, run, points[:, 1])])
