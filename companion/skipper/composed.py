"""Goals that are sailed by a field of their own: when it steers, when it is over, and when it leads nowhere.

A field that says nothing of where to go, or that cannot be steered by, is given up by name: she makes for the goal's
place by plan, in AUTO, and loiters there until it says something again. From a field to a plan she is steered on by
the plain one to where she is bound for, until a plan from where she has come to is on board.
"""

from __future__ import annotations

import math
from dataclasses import replace

import shapely

from companion.field.tree import LEAST
from companion.frozen import changed
from companion.skipper.deeds.by_field import situation, strength
from companion.skipper.planning.errands import errand
from companion.skipper.planning.waits import stay_left_s, utc_s
from companion.skipper.step.actions import Severity
from companion.skipper.step.config import Guidance
from companion.skipper.step.state import Inside
from companion.skipper.step.turn import Turn
from companion.skipper.way.gates import Gate
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Composed, PointEn, Until
from companion.traffic import predict

PATIENCE_S = 5.0      # without a heading ArduRover's GUIDED stops her after 3 s: a field that is weak keeps its last
BACK_S = 10.0         # a field that was given up has said something for so long
LEAVE_S = 45.0        # a plan from here takes a few seconds; one that is not found is the ladder's
STEP_S = 1.5          # what made her leave, an order or the end, is seen a step after it asked for the plan
INSIDE_M = 1.5        # a vessel is in the water when it is so far in: its position is noisy


def follow_field(turn: Turn) -> None:
    """See whether the goal that is next is sailed by its field, and let go of one that is over or leads nowhere."""
    gate, memory = turn.gate, turn.state.by_field
    has_field = gate is not None and gate.field is not None and turn.state.voyage.sailing and not turn.state.voyage.over
    if gate is not None and gate.field is not None and has_field:
        _weigh(turn, gate.name, gate.field)
        memory = turn.state.by_field
    elif memory.lost:
        memory = replace(memory, lost="", weak_since_s=None, strong_since_s=None)
        turn.set(by_field=memory)
    if has_field and errand(turn) is None:
        if gate is not None and gate.field is not None and not (memory.composed and memory.left_s is None):
            turn.say(Severity.NOTICE, "field", f"{gate.name}: steered by {gate.field.tree.text}, "
                     f"{gate.field.until_words}", every_s=0.0)
        turn.set(by_field=replace(memory, composed=True, left_s=None))
    elif memory.composed:
        left_s = turn.t_s if memory.left_s is None else memory.left_s
        turn.set(by_field=replace(memory, composed=not _is_left(turn, left_s), left_s=left_s))
        if not turn.state.by_field.composed:
            turn.set(by_field=replace(turn.state.by_field, left_s=None, way_out_rad=None))


def _is_left(turn: Turn, since_s: float) -> bool:
    """Return whether she need not be steered on: a plan asked for since then is in place, or none can be waited for."""
    state, bound = turn.state, errand(turn)
    goes_on = state.voyage.sailing and not state.voyage.over and (
        bound.has_place if bound is not None else turn.gate is not None)
    if not goes_on or turn.config.guidance is Guidance.FIELD or situation(turn) is None:
        return True
    is_planned = state.plans.last_s >= since_s - STEP_S and state.pending.plan is None and state.pending.upload is None
    return is_planned or turn.t_s - since_s > LEAVE_S


def _weigh(turn: Turn, name: str, field: Composed) -> None:
    """Give a field up that says nothing for a while, and take it again when it does."""
    memory, seen = turn.state.by_field, situation(turn)
    if seen is None:
        lacks = "no position is known" if turn.boat_en is None else "no wind is known"
        why, is_weak = f"it cannot be sailed by its field, for {lacks}", True
    else:
        found = strength(turn, seen, field)
        is_weak = found < LEAST
        why = f"its field {field.tree.text} has no value here ({found:.2f} of 10)"
    weak = (memory.weak_since_s if memory.weak_since_s is not None else turn.t_s) if is_weak else None
    strong = None if is_weak else memory.strong_since_s if memory.strong_since_s is not None else turn.t_s
    lost = memory.lost
    if lost and strong is not None and turn.t_s - strong >= BACK_S:
        lost = ""
        turn.say(Severity.NOTICE, "field", f"{name}: its field leads on again", every_s=0.0)
    elif not lost and weak is not None and turn.t_s - weak >= PATIENCE_S:
        lost = why
        turn.say(Severity.WARNING, "no field", f"{name}: {why}: by plan to its place, and a loiter there", every_s=0.0)
    turn.set(by_field=replace(memory, weak_since_s=weak, strong_since_s=strong, lost=lost))


def has_sailed(turn: Turn, gate: Gate, boat: PointEn) -> bool:
    """Count the time by a goal's field; True when it is over, which is said."""
    field, inside = gate.field, turn.state.progress.inside
    assert field is not None
    if inside is None or inside.goal != gate.goal:
        inside = Inside(goal=gate.goal, t_s=turn.t_s, utc_s=utc_s(turn))
        turn.set(progress=changed(turn.state.progress, inside=inside))
    why = _over(turn, gate, field, boat)
    if not why:
        return False
    turn.set(progress=changed(
        turn.state.progress, gate=turn.state.progress.gate + 1, reached=(*turn.state.progress.reached, gate.goal),
        closest_m=math.inf, inside=None))
    turn.say(Severity.NOTICE, "goal", f"{gate.name}: {why} after {inside.age_s(turn.t_s, utc_s(turn)):.0f} s by field",
             every_s=0.0)
    return True


def _over(turn: Turn, gate: Gate, field: Composed, boat: PointEn) -> str:
    """Return why a goal's field is over, empty: it is not."""
    if turn.state.progress.released == gate.goal:
        return "told to go on"
    if stay_left_s(turn, gate) <= 0.0:
        return "her time is over"
    if field.until is Until.PLACE and turn.state.progress.closest_m <= gate.radius_m:
        return f"{distance_m(boat, gate.en_m):.1f} m from its place"
    if field.water_en is None:
        return ""
    if field.until is Until.OUTSIDE and not shapely.covers(field.water_en, shapely.points(boat)):
        return "she is outside"
    picture = turn.snapshot.traffic
    if field.until is Until.VESSEL and picture is not None:
        well_inside = shapely.buffer(field.water_en, -INSIDE_M)
        for vessel in picture.vessels:
            if shapely.covers(well_inside, shapely.points(predict(vessel, turn.t_s).mean_en_m)):
                return f"{vessel.label} is in its water"
    return ""
