"""The end of a voyage, and of an errand: she loiters, and is watched.

A voyage is over when all goals are reached (and home, where the mission ends there), or its time is up. From then on
nothing is planned but the way back to her place, should she be dragged off it and the straight way not be clear; the
watch goes on until somebody ends the program.
"""

from __future__ import annotations

from companion.frozen import changed
from companion.skipper.deeds.by_field import keeps_station
from companion.skipper.deeds.failsafe import waits_for
from companion.skipper.deeds.helm import hand_back, repair
from companion.skipper.planning.ends import HOW_LONG, OUT_OF_TIME, end_of
from companion.skipper.planning.errands import home_trouble, is_at_rest, pressing
from companion.skipper.step.actions import CancelPlan, Severity
from companion.skipper.step.causes import SHORE, STOPPING
from companion.skipper.step.config import End, SafeEnd
from companion.skipper.step.route import Errand, Kind
from companion.skipper.step.state import Phase
from companion.skipper.step.turn import Turn

ANSWERED = {
    "": "for a person",
    SHORE: "until the link to the shore is back, or a person gives AUTO",
}
TAKEN = "until a person takes her and gives AUTO back"
UNTIL_TOLD = "until told to go on"


def comes_to_rest(turn: Turn, bound: Errand) -> bool:
    """Lie at the end of an errand; True while she does."""
    if not is_at_rest(turn) or turn.state.steering.own_mode in STOPPING:
        return False
    if turn.is_raised(OUT_OF_TIME) and end_of(turn.config, OUT_OF_TIME) is not End.SAY and not (
        turn.state.operator.answering or pressing(turn) is not None or bound.is_ordered
    ):
        reached = len(turn.state.progress.reached)
        _end(turn, f"out of time: {reached} of {len(turn.voyage.legs)} goals reached", arrived=False)
        return True
    if bound.kind is Kind.HOME and turn.gate is None and not turn.state.operator.answering and not bound.is_ordered:
        turn.set(voyage=changed(turn.state.voyage, home_reached=True))
        rest(turn)
        return True
    if bound.kind is Kind.REST:
        return False
    _let_go_of_plans(turn)
    if repair(turn):
        return True
    hand_back(turn)
    where = "staying near by" if bound.kind is Kind.STAY else f"at {bound.name}"
    how_long = UNTIL_TOLD if bound.is_ordered else bound.until or _how_long(turn)
    turn.phase(Phase.HOLDING, f"{where}: {bound.why}; waiting {how_long}")
    return True


def _how_long(turn: Turn) -> str:
    """Return how long an errand that nobody ordered keeps her."""
    raised = next((name for name in HOW_LONG if turn.is_raised(name) and end_of(turn.config, name) is not End.SAY), "")
    return HOW_LONG.get(raised) or ANSWERED.get(turn.state.operator.answering, TAKEN)


def rest(turn: Turn) -> None:
    """Keep station for as long as the mission asks, then lie in the mission's safe end."""
    if not turn.state.voyage.over:
        if keeps_station(turn):
            return
        ends_home = turn.config.safe_end is SafeEnd.RETURN and not turn.state.voyage.home_reached
        trouble = home_trouble(turn) if ends_home else ""
        home = f"; not home: {trouble}" if trouble else "; home" if turn.state.voyage.home_reached else ""
        route = turn.state.mission.route
        end = f"; the mission ends with {route.why}" if route is not None and route.rung == "hold" else ""
        goals = len(turn.voyage.legs)
        reached = "the goal is reached" if goals == 1 else f"all {goals} goals reached"
        if turn.state.orders.skipped:
            skipped = turn.state.orders.skipped
            reached = f"{goals - skipped} of {goals} goals reached, {skipped} given up by order"
        before = " before this start" if turn.state.voyage.arrived else ""
        _end(turn, f"{reached}{before}{home}{end}", arrived=not trouble)
        return
    stopped = turn.state.steering.own_mode in STOPPING and turn.autopilot is not None and (
        turn.autopilot.mode is turn.state.steering.own_mode)
    # the loiter's place is the same wherever she has been
    turn.set(operator=changed(turn.state.operator, is_back=False))
    why = waits_for(turn) if stopped else ""
    if why:
        turn.phase(Phase.HOLDING, why)
    elif not repair(turn):
        hand_back(turn)
        turn.phase(Phase.DONE, turn.state.voyage.over + ("; waiting for AUTO" if stopped else _raised(turn)))


def _raised(turn: Turn) -> str:
    names = ", ".join(r.name for r in turn.state.alarms.raised if r.name != OUT_OF_TIME)
    return f"; {names}" if names else ""


def _end(turn: Turn, why: str, *, arrived: bool) -> None:
    """The voyage is over: remember where she is to rest."""
    _let_go_of_plans(turn)
    route = turn.state.mission.route
    place = route.points_en_m[-1] if route is not None and route.points_en_m else turn.boat_en
    turn.set(voyage=changed(turn.state.voyage, over=why, arrived=arrived, rest_en_m=place))
    hand_back(turn)
    turn.phase(Phase.DONE, why)
    turn.say(Severity.NOTICE if arrived else Severity.WARNING, "done", why, every_s=0.0)


def _let_go_of_plans(turn: Turn) -> None:
    if turn.state.pending.plan is not None:
        turn.act(CancelPlan(request_id=turn.state.pending.plan.request_id))
        turn.set(pending=changed(turn.state.pending, plan=None))
