"""The companion's status as one value, from a step: for the radio, a satellite link, and whoever watches."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Sequence
from dataclasses import replace

from companion.clock import now_s
from companion.figures import figure_values
from companion.fold import Step
from companion.geo.angles import wrap_two_pi
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.wire import HIGH_LATENCY_S
from companion.messages import AisReport, CompanionStatus, Severity, TrafficStatus
from companion.orders.far import FarStatus, Reply, minutes_of
from companion.safety import BY_NAME
from companion.skipper import Voyage
from companion.skipper.planning import next_tack_s, on_leg
from companion.skipper.step import Announce, Phase, Route
from companion.skipper.way import gates_of
from companion.telemetry.folder.logbook import Logbook
from companion.telemetry.folder.records import VoyageFigures, sigma_ahead_mps, sigma_ahead_rad
from companion.traffic import TrafficCounts
from companion.traffic.feeds import Feed, Feeds


def companion_status(
    step: Step,
    voyage: Voyage,
    figures: VoyageFigures,
    clearance_m: float | None,
    bytes_out_per_s: float | None,
    feeds: Sequence[Feed[AisReport]] = (),
    ais_dropped: int = 0,
) -> CompanionStatus:
    """Return the status at ``step``. The wind's spread is that of a minute ahead, which the plan lives on."""
    snapshot, state = step.snapshot, step.state
    autopilot, wind, route, vehicle = snapshot.autopilot, snapshot.wind, state.mission.route, snapshot.vehicle
    legs, goal = voyage.legs, _goal(step, voyage)
    code, text = _alert(step)
    return CompanionStatus(
        t_s=snapshot.t_s,
        state=state.phase.value,
        goal_index=goal,
        goal_count=len(legs),
        waypoint_seq=state.mission.index + 1 if route is not None else None,
        waypoint_count=None if route is None else len(route.items),
        waypoint_distance_m=on_leg(step).left_m,
        goal_distance_m=goal_distance_m(step, voyage),
        cross_track_m=on_leg(step).off_m,
        clearance_m=clearance_m,
        twd_from_rad=None if wind.mean_twd_from_rad is None else wrap_two_pi(wind.mean_twd_from_rad),
        twd_sigma_rad=sigma_ahead_rad(snapshot),
        tws_mps=wind.mean_tws_mps,
        tws_sigma_mps=sigma_ahead_mps(snapshot),
        current_set_rad=snapshot.current.set_rad if snapshot.current.is_significant else None,
        current_drift_mps=snapshot.current.drift_mps if snapshot.current.is_significant else None,
        next_tack_s=next_tack_s(step, voyage.boat),
        figures=tuple(figure_values(step, "radio").items()),
        promised_risk=None if step.sailed is None else risk_of(step.sailed),
        plan_id=None if route is None else route.plan_id,
        plan_age_s=None if route is None else max(0.0, snapshot.t_s - route.plan_t_s),
        replans=state.plans.replans,
        tacks=figures.tacks,
        battery_v=None if autopilot is None else autopilot.battery_v,
        position=None if vehicle is None else vehicle.position,
        bytes_out_per_s=bytes_out_per_s,
        traffic=traffic_status(step, feeds, ais_dropped),
        order="" if state.orders.standing is None else state.orders.standing.verb.value,
        order_age_s=None if state.orders.standing is None else state.orders.standing.age_s(snapshot.t_s),
        plan_answer_s=state.plans.latency.said_p90_s if state.plans.latency.is_slow else None,
        alert_code=code,
        alert_text=text,
    )


def _goal(step: Step, voyage: Voyage) -> int:
    """Return the number of the goal that is next, of the last one behind it."""
    gates, progress = gates_of(voyage, step.state.progress.approaches), step.state.progress
    return gates[progress.gate].goal if progress.gate < len(gates) else len(voyage.legs) - 1


def goal_distance_m(step: Step, voyage: Voyage) -> float | None:
    """Return how far the next goal is [m].

    None: that is not known, or says nothing of home, a refuge or a place that was named.
    """
    here, route, progress = step.snapshot.position_en_m, step.state.mission.route, step.state.progress
    is_elsewhere = progress.gate >= len(gates_of(voyage, progress.approaches)) or (
        route is not None and not route.is_for_goals(step.state.mission.index)
    )
    return None if here is None or is_elsewhere else math.dist(here, voyage.legs[_goal(step, voyage)].en_m)


def traffic_status(step: Step, feeds: Sequence[Feed[AisReport]], dropped: int) -> TrafficStatus | None:
    """Return what is seen of other vessels, the worst one's figures; None when nobody was heard and no feed is open."""
    picture = step.snapshot.traffic
    if picture is None and not feeds:
        return None
    counts = TrafficCounts() if picture is None else picture.counts
    route = step.sailed
    seen = TrafficStatus(
        vessels=0 if picture is None else len(picture.vessels),
        refused=counts.stale + counts.far + dropped + sum(feed.counts.refused for feed in feeds),
        feeds=len(feeds),
        silent_feeds=sum(feed.is_silent for feed in feeds),
        shared_mmsi=counts.shared_mmsi,
        clock_jumps=counts.clock_jumps,
        silence_s=None if picture is None else picture.silence_s,
        promised_risk=None if route is None else route.vessels_part,
        path_risk=None if route is None else route.vessel_risk,
    )
    if not step.state.traffic.watch:
        return seen
    worst = step.state.traffic.watch[0]
    approach = worst.approach
    return replace(
        seen,
        name=worst.vessel.label,
        alarm=worst.alarm.name.lower(),
        role=worst.encounter.role.value,
        rule=worst.encounter.rule.value,
        range_m=approach.now_m,
        bearing_rad=approach.bearing_rad,
        cpa_m=approach.distance_m,
        tcpa_s=approach.time_s if approach.is_closing else None,
    )


def risk_of(route: Route) -> float:
    """Return what the plan promised: the probability, at each instant, of the no-go zone or a vessel too near."""
    return 1.0 - route.delta_s


def _alert(step: Step) -> tuple[str, str]:
    """Return the loudest thing said in this step, else the raised watchdog, else the sentence of the state."""
    said = [a for a in step.actions if isinstance(a, Announce) and a.severity <= Severity.WARNING]
    if said:
        worst = min(said, key=lambda a: a.severity)
        return worst.code, worst.text
    if step.state.alarms.raised:
        return step.state.alarms.raised[0].name, step.state.why
    if step.state.phase in {Phase.HOLDING, Phase.OPERATOR}:
        return step.state.phase.value, step.state.why
    return "", step.state.why


CLOCK_OFF_S = 10.0  # of this computer's clock against the autopilot's: from here on it is said


def worst_watchdog(step: Step) -> str:
    """Return the name of the most severe watchdog that is raised, empty: none is."""
    names = (raised.name for raised in step.state.alarms.raised)
    return min(names, key=lambda name: BY_NAME[name].severity, default="")


def far_status(
    status: CompanionStatus,
    step: Step,
    *,
    sequence: int,
    order: int | None,
    reply: Reply | None,
    has_trouble: bool,
    is_heard: bool,
) -> FarStatus:
    """Return what is told far away; ``order`` and ``reply`` are those of the order that came last."""
    snapshot, traffic = step.snapshot, status.traffic
    unix_s, autopilot, standing = snapshot.unix_s(status.t_s), snapshot.autopilot, step.state.orders.standing
    goal = None if status.goal_index is None else status.goal_index + 1
    return FarStatus(
        phase=status.state,
        sequence=sequence,
        minute=None if unix_s is None else minutes_of(unix_s),
        is_heard=is_heard,
        is_armed=autopilot is not None and autopilot.is_armed,
        is_under_way=step.state.voyage.sailing,
        has_trouble=has_trouble,
        standing=None if standing is None else standing.verb,
        position=status.position,
        goal_m=status.goal_distance_m,
        waypoint_m=status.waypoint_distance_m,
        speed_mps=None if snapshot.vehicle is None else snapshot.vehicle.speed_mps,
        twd_from_rad=status.twd_from_rad,
        tws_mps=status.tws_mps,
        twd_sigma_rad=status.twd_sigma_rad,
        goal=goal,
        goals=status.goal_count,
        plan_age_s=status.plan_age_s,
        promised_risk=status.promised_risk,
        clearance_m=status.clearance_m,
        cpa_m=None if traffic is None else traffic.cpa_m,
        alarm="" if traffic is None else traffic.alarm or "none",
        watchdog=worst_watchdog(step),
        battery_v=status.battery_v,
        order=order,
        reply=reply,
    )


# Status to the radio: a frame of it every so often [s]; see companion.mavlink.wire.companion_status for its bytes.
STATUS_EVERY_S = 2.0
TROUBLE_EVERY_S = 600.0  # trouble with the disk that lasts is said again


async def speak_high_latency(
    autopilot: Autopilot, seen: Callable[[], tuple[CompanionStatus, Step] | None], is_wanted: Callable[[], bool]
) -> None:
    """Send HIGH_LATENCY2 while it is asked for, until cancelled."""
    while True:
        now = seen() if is_wanted() else None
        if now is not None:
            status, step = now
            autopilot.send_high_latency(status, step.snapshot.vehicle, worst_watchdog(step))
        await asyncio.sleep(HIGH_LATENCY_S)


class TelemetrySender:
    """Speaks through ``autopilot``; ``status`` and ``trouble`` are asked for what there is to say."""

    def __init__(
        self,
        autopilot: Autopilot,
        feeds: Feeds[AisReport],
        log: Logbook,
        *,
        status: Callable[[], CompanionStatus | None],
        trouble: Callable[[], str],
    ) -> None:
        self._autopilot, self._feeds, self._log = autopilot, feeds, log
        self._status, self._trouble = status, trouble
        self._told, self._told_s = "", -math.inf

    async def run(self) -> None:
        """Speak until cancelled."""
        while True:
            status = self._status()
            if status is not None:
                self._autopilot.send_status(status)
            self._tell_silence()
            self._tell_trouble()
            await asyncio.sleep(STATUS_EVERY_S)

    def _tell_silence(self) -> None:
        """Say and record that a feed has fallen silent, and that it is heard again."""
        for feed in self._feeds.changed():
            text = f"AIS feed {'silent' if feed.is_silent else 'heard again'}: {feed.sentence()}"
            self._log.note(self._log.now_s(), {"kind": "feed", "silent": feed.is_silent, "text": text})
            self._autopilot.say(int(Severity.WARNING if feed.is_silent else Severity.NOTICE), text)

    def _tell_trouble(self) -> None:
        trouble = self._trouble()
        if trouble and (trouble != self._told or now_s() - self._told_s >= TROUBLE_EVERY_S):
            self._autopilot.say(int(Severity.WARNING), f"{trouble}; sailing on")
            self._told_s = now_s()
        elif self._told and not trouble:
            self._autopilot.say(int(Severity.NOTICE), "the disk is well again: everything is recorded")
        self._told = trouble
