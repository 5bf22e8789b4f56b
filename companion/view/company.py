"""Other vessels in the view: where they are, how near they come, what the rules ask of us."""

from __future__ import annotations

import math

from companion.fold import Step
from companion.messages import TrafficStatus
from companion.traffic import Alarm, Assessment
from companion.view import values
from companion.view.numbers import compass, metres, place, rounded

MOST = 40   # vessels in a view, the worst first


def vessels_of(step: Step) -> tuple[values.Vessel, ...]:
    """Return the vessels, the worst first; without our own position those heard last, with no approach."""
    if step.state.watch:
        return tuple(_seen(step, seen) for seen in step.state.watch[:MOST])
    picture = step.snapshot.traffic
    if picture is None:
        return ()
    newest = sorted(picture.vessels, key=picture.age_s)[:MOST]
    return tuple(values.Vessel(
        name=v.label, mmsi=v.mmsi, age_s=rounded(picture.age_s(v), 1), at_en_m=place(v.centre_en_m),
        course_deg=None if v.course_rad is None else compass(v.course_rad), speed_mps=rounded(v.speed_mps),
        length_m=metres(v.hull.length_m), beam_m=metres(v.hull.beam_m)) for v in newest)


def _seen(step: Step, seen: Assessment) -> values.Vessel:
    vessel, approach = seen.vessel, seen.approach
    ve, vn = vessel.velocity_en_mps
    east, north = vessel.centre_en_m
    at = (east + ve * seen.age_s, north + vn * seen.age_s)
    then_s = approach.time_s if approach.is_closing else None
    here, own = step.snapshot.position_en_m, step.snapshot.vehicle
    own_then = None
    if then_s is not None and here is not None and own is not None:
        own_then = place((here[0] + own.velocity_en_mps[0] * then_s, here[1] + own.velocity_en_mps[1] * then_s))
    return values.Vessel(
        name=vessel.label, mmsi=vessel.mmsi, age_s=rounded(seen.age_s, 1), at_en_m=place(at),
        course_deg=None if vessel.course_rad is None else compass(vessel.course_rad),
        speed_mps=rounded(vessel.speed_mps), heading_deg=None if vessel.bow_rad is None else compass(vessel.bow_rad),
        length_m=metres(vessel.hull.length_m), beam_m=metres(vessel.hull.beam_m),
        alarm=seen.alarm.name.lower(), role=seen.encounter.role.value, rule=seen.encounter.rule.value,
        range_m=metres(approach.now_m), bearing_deg=compass(approach.bearing_rad), cpa_m=metres(approach.distance_m),
        cpa_s=rounded(then_s, 0), own_cpa_en_m=own_then,
        cpa_en_m=None if then_s is None else place((at[0] + ve * then_s, at[1] + vn * then_s)))


def alarms_of(step: Step) -> tuple[values.Alarm, ...]:
    """Return the alarms of vessels that come too near."""
    levels: dict[Alarm, values.Level] = {Alarm.WARN: "warning", Alarm.ACT: "error", Alarm.TOUCH: "critical"}
    return tuple(
        values.Alarm(code="vessel", level=levels[seen.alarm], text=seen.sentence())
        for seen in step.state.watch if seen.alarm in levels)


def heard_vessel(traffic: TrafficStatus | None, age_s: float | None) -> tuple[values.Vessel, ...]:
    """Return the one vessel that a radio's status tells of, the worst."""
    if traffic is None or not traffic.alarm:
        return ()
    return (values.Vessel(
        name=traffic.name, age_s=rounded(age_s, 1), alarm=traffic.alarm, role=traffic.role, rule=traffic.rule,
        range_m=rounded(traffic.range_m, 1), cpa_m=rounded(traffic.cpa_m, 1), cpa_s=rounded(traffic.tcpa_s, 0),
        bearing_deg=None if traffic.bearing_rad is None or not math.isfinite(traffic.bearing_rad)
        else compass(traffic.bearing_rad)),)
