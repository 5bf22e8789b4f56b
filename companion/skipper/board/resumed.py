"""What of a saved state still holds where the mission's goals were changed between two starts. Pure."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

from companion.skipper.step.saved import Persisted, SavedGoal
from companion.skipper.way import Goal, Side, Voyage, gates_of
from companion.words import counted

SAME_M = 1.0  # goals that are nearer to each other than this are one


@lru_cache(maxsize=8)  # asked for at every step
def saved_goals(voyage: Voyage) -> tuple[SavedGoal, ...]:
    """Return a voyage's goals as a saved state knows them again."""
    return tuple(SavedGoal(place=voyage.frame.geo_from_en(*goal.en_m), kind=_kind(goal)) for goal in voyage.goals)


def leg_under_way(voyage: Voyage, saved: Persisted) -> int:
    """Return which of ``Voyage.legs`` a saved state sails; their number when all are passed."""
    gates = gates_of(voyage, saved.approaches)
    return gates[saved.gate].goal if saved.gate < len(gates) else len(voyage.legs)


def resumed(voyage: Voyage, saved: Persisted) -> tuple[Persisted, str]:
    """Return the saved state as it holds for the voyage's goals, and what is to be said of it, "" if they are the same.

    Reached are those goals at the head of the list that are the ones that were reached. The lists on the autopilot lead
    to goals that are none any more: they are no longer ours to adopt.
    """
    before = saved.goals * saved.laps
    now = saved_goals(voyage) * voyage.laps
    if not before or before == now:
        return saved, ""
    alike = [_is_one(voyage, a, b) for a, b in zip(before, now, strict=False)]
    same = alike.index(False) if False in alike else len(alike)
    if same == len(before) == len(now):
        return saved, ""
    leg = min(saved.leg, same)
    stays = leg == saved.leg and same > leg + 1  # the leg that is sailed is the same, and so is where it leads on to
    approaches = tuple(a for a in saved.approaches if a.goal < leg or stays)
    gates = gates_of(voyage, approaches)
    first = next((i for i, gate in enumerate(gates) if gate.goal >= leg), len(gates))
    is_there = saved.inside is not None and saved.inside[0] < same
    reached = tuple(goal for goal in saved.reached if goal < leg)
    kept = replace(
        saved,
        goals=saved_goals(voyage),
        laps=voyage.laps,
        leg=leg,
        gate=saved.gate if stays else first,
        route=None,
        pending=None,
        unsure=None,
        arrived=saved.arrived and leg == len(now),
        reached=reached,
        skipped=min(saved.skipped, leg - len(reached)),  # what is sailed to anew was not given up
        approaches=approaches,
        quarters=saved.quarters if stays else 0,
        inside=saved.inside if is_there else None,
        station_utc_s=None,  # the last goal is another one
        searched=saved.searched if same > saved.leg else (),
        covered=tuple(c for c in saved.covered if c[0] < same),
    )
    return kept, _words(voyage, leg, saved.leg)


def _is_one(voyage: Voyage, a: SavedGoal, b: SavedGoal) -> bool:
    frame = voyage.frame
    return a.kind == b.kind and math.dist(frame.en_from_geo(a.place), frame.en_from_geo(b.place)) < SAME_M


def _kind(goal: Goal) -> str:
    """Return what is done at a goal."""
    if goal.line is not None:
        return "line"
    if goal.side is not Side.NONE:
        return goal.side.name.lower()
    return next((kind for kind in ("box", "search", "field") if getattr(goal, kind) is not None), "")


def _words(voyage: Voyage, leg: int, reached: int) -> str:
    legs = voyage.legs
    still = f"{leg or 'none'} of the {counted(reached, 'goal')} reached {'count' if leg > 1 else 'counts'}, "
    onward = f"on to {legs[leg].name or f'goal {leg + 1}'}" if leg < len(legs) else "nothing is left to sail to"
    return f"the mission's goals were changed since it was saved: {still if reached else ''}{onward}"
