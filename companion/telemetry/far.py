"""The boat as she is told far away, and her clock: from a step and the status that the radio gets."""

from __future__ import annotations

from companion.fold import Step
from companion.messages import CompanionStatus
from companion.orders.far import FarStatus, Reply, minutes_of
from companion.skipper.step import Snapshot
from companion.skipper.watch.watchdogs import BY_NAME


def unix_of_boat(snapshot: Snapshot, t_s: float) -> float | None:
    """Return the time at ``t_s`` [s since 1970] by the autopilot's clock, which GPS sets; None: it has not told one.

    Our own clock is not asked: a board without a battery begins somewhere in the past.
    """
    autopilot = snapshot.autopilot
    if autopilot is None or autopilot.utc_at_boot_s is None or autopilot.boot_s is None:
        return None
    return autopilot.utc_at_boot_s + autopilot.boot_s + t_s - autopilot.t_s


def worst_watchdog(step: Step) -> str:
    """Return the name of the most severe watchdog that is raised, empty: none is."""
    return min((raised.name for raised in step.state.raised), key=lambda name: BY_NAME[name].severity, default="")


def far_status(
    status: CompanionStatus, step: Step, *, sequence: int, order: int | None, reply: Reply | None, has_trouble: bool,
    is_heard: bool,
) -> FarStatus:
    """Return what is told far away; ``order`` and ``reply`` are those of the order that came last."""
    snapshot, traffic = step.snapshot, status.traffic
    unix_s, autopilot, standing = unix_of_boat(snapshot, status.t_s), snapshot.autopilot, step.state.standing
    goal = None if status.goal_index is None else status.goal_index + 1
    return FarStatus(
        phase=status.state, sequence=sequence, minute=None if unix_s is None else minutes_of(unix_s),
        is_heard=is_heard, is_armed=autopilot is not None and autopilot.is_armed, is_under_way=step.state.sailing,
        has_trouble=has_trouble, standing=None if standing is None else standing.verb, position=status.position,
        goal_m=status.goal_distance_m, waypoint_m=status.waypoint_distance_m,
        speed_mps=None if snapshot.vehicle is None else snapshot.vehicle.speed_mps,
        twd_from_rad=status.twd_from_rad, tws_mps=status.tws_mps, twd_sigma_rad=status.twd_sigma_rad,
        goal=goal, goals=status.goal_count, plan_age_s=status.plan_age_s, promised_risk=status.promised_risk,
        clearance_m=status.clearance_m, cpa_m=None if traffic is None else traffic.cpa_m,
        alarm="" if traffic is None else traffic.alarm or "none", watchdog=worst_watchdog(step),
        battery_v=status.battery_v, order=order, reply=reply,
    )
