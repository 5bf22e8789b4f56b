"""What to give up, and in which order, when no plan is found.

The first thing is a planner of somebody's choice: what it does not find is looked for by ``auto``.

Each rung is named in the status and in the decision record. The old plan is looked at before anything is given up, a
repaired start belongs to every rung, and after the last the boat holds in a safe loiter and waits, longer each time.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from companion.planners import AUTO, PlannerChoice
from companion.skipper.step.config import SkipperConfig

PINCHES = "closer to the wind than the autopilot keeps to a line"


@dataclass(frozen=True, slots=True, kw_only=True)
class Rung:
    """One step: margin [m], delta_s, the path's limit of risk, a nearer safe place as the goal, and the planner."""

    name: str
    margin_m: float
    delta_s: float
    max_path_risk: float | None = None
    nearer_goal: bool = False
    planner: PlannerChoice = AUTO
    pinches: bool = False


def first_of_auto(config: SkipperConfig) -> int:
    """Return the number of the first step by ``auto``: up to it nothing is given up."""
    return int(config.planner.algorithm != AUTO.algorithm)


def rungs(config: SkipperConfig, *, track_m: float = 0.0, in_current: bool = False) -> tuple[Rung, ...]:
    """Return the steps in order; the first is what was asked for, none is below the margin's floor and ``track_m``.

    ``track_m`` is what the boat may be beside a straight leg: a margin that leaves less would be planned for nothing,
    and where the mission's own leaves less, the first thing is a wider one.
    ``in_current``: planned with one. What is given up first there are the courses that the autopilot keeps to as lines
    (``pinches``): closer to the wind it steers for the waypoint, and the current sets it off the line by metres.
    With delta_s the limit on the whole path's risk is given up.
    """
    limit = config.max_path_risk
    floor = min(config.margin_floor_m + track_m, config.margin_m)
    room = config.margin_m - floor
    out = [Rung(name="", margin_m=config.margin_m, delta_s=config.delta_s, max_path_risk=limit, planner=config.planner)]
    if first_of_auto(config):
        out.append(replace(out[0], name=f"planner {AUTO.algorithm}", planner=AUTO))
    needed = min(config.margin_floor_m, config.margin_m) + track_m
    if needed > config.margin_m:
        out.append(replace(out[-1], name=f"margin {needed:.1f} m for her track", margin_m=needed))
    first = len(out)
    if in_current:
        out.append(replace(out[-1], name=PINCHES, pinches=True))
    for share in (*config.margin_ladder, 0.0):
        margin = floor + share * room
        if margin < out[-1].margin_m - 1e-9:
            out.append(
                Rung(name=f"margin {margin:.1f} m", margin_m=margin, delta_s=config.delta_s, max_path_risk=limit)
            )
    if limit is not None:
        out.append(Rung(name=f"margin {floor:.1f} m, path's risk not bounded", margin_m=floor, delta_s=config.delta_s))
    for delta in config.delta_s_ladder:
        if delta < config.delta_s:
            out.append(Rung(name=f"margin {floor:.1f} m, delta_s {delta:g}", margin_m=floor, delta_s=delta))
    last = out[-1]
    out.append(Rung(name="a nearer safe place", margin_m=floor, delta_s=last.delta_s, nearer_goal=True))
    return tuple(replace(rung, pinches=in_current and n >= first) for n, rung in enumerate(out))
