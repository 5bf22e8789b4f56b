"""What an order to sail somewhere would lead to: the plan that would be asked for, and nothing is done."""

from __future__ import annotations

from companion.frozen import changed
from companion.orders import Verb, Wanted
from companion.skipper.deeds.ordered_places import goal_place, home_place, refuge_place
from companion.skipper.planning.asking import lacks, request
from companion.skipper.step.actions import ReplanReason, RequestPlan
from companion.skipper.step.standing import Standing
from companion.skipper.step.turn import Turn


def preview(turn: Turn, wanted: Wanted) -> RequestPlan | str:
    """Return the request for a plan that the order would make, or why it would make none. The turn is used up."""
    if wanted.verb is Verb.GOAL:
        found = goal_place(turn, wanted)
    elif wanted.verb is Verb.REFUGE:
        found = refuge_place(turn, wanted)
    elif wanted.verb is Verb.HOME:
        found = home_place(turn)
    else:
        return f"{wanted.words} leads nowhere that could be shown"
    if isinstance(found, str):
        return found
    name, en_m = found
    turn.set(
        pending=changed(turn.state.pending, plan=None),
        orders=changed(turn.state.orders, standing=Standing(
            verb=wanted.verb, by="a preview", name=name, en_m=en_m, since_s=turn.t_s)))
    missing = lacks(turn)
    if missing:
        return f"for a plan there is no {missing}"
    turn.actions.clear()
    request(turn, ReplanReason.ORDER)
    return next((a for a in turn.actions if isinstance(a, RequestPlan)), "no plan can be asked for from where she is")
