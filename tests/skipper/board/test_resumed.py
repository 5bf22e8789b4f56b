"""A saved state of a mission whose goals were changed: what was reached stays reached, and nothing else is."""

from dataclasses import replace

import pytest

from companion.skipper.board.resumed import resumed
from companion.skipper.rules import Skipper
from companion.skipper.step import SkipperConfig
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import saved_of
from companion.skipper.way import Side, gates_of
from companion.skipper.way.voyage import Goal
from tests.skipper.moments import route
from tests.skipper.world import voyage, with_parts

A, B, C = (Goal(en_m=(0.0, 300.0 * n), name=name) for n, name in enumerate("ABC", start=1))
X, N = Goal(en_m=(400.0, 0.0), name="X"), Goal(en_m=(-400.0, 0.0), name="N")
BUOY = Goal(en_m=(200.0, 300.0), name="Buoy", side=Side.PORT)


def skipper(*goals, laps=1):
    return Skipper(voyage=replace(voyage(*goals), laps=laps), config=SkipperConfig())


def saved(*goals, gate, laps=1, arrived=False):
    """Return what a voyage of ``goals`` saved on the way to a gate, through its file's text."""
    sails = skipper(*goals, laps=laps)
    state = with_parts(
        sails.initial(),
        progress={"gate": gate},
        voyage={"arrived": arrived, "sailing": True},
        mission={"route": route((0.0, 300.0), (0.0, 600.0), gate_of=(0, 1))},
    )
    return Persisted.from_dict(sails.persisted(state).to_dict())


@pytest.mark.parametrize(
    ("now", "gate", "next_name", "words"),
    [
        ((A, B, C), 1, "B", ""),
        ((X, B, C), 0, "X", "none of the 1 goal reached counts, on to X"),
        ((A, N, B, C), 1, "N", "1 of the 1 goal reached counts, on to N"),
        ((N, A, B, C), 0, "N", "none of the 1 goal reached counts, on to N"),
        ((B, C), 0, "B", "none of the 1 goal reached counts, on to B"),
        ((A, B, X), 1, "B", "1 of the 1 goal reached counts, on to B"),
        ((A,), 1, None, "1 of the 1 goal reached counts, nothing is left to sail to"),
        ((A, replace(B, en_m=(0.5, 600.0)), C), 1, "B", ""),  # as a station rounds a place
        ((A, replace(B, side=Side.PORT), C), 1, "B", "1 of the 1 goal reached counts, on to B"),
    ],
)
def test_reached_are_the_goals_at_the_head_of_the_list_that_were_reached(now, gate, next_name, words):
    before = saved(A, B, C, gate=1)
    kept, said = resumed(skipper(*now).voyage, before)
    gates = gates_of(skipper(*now).voyage, kept.approaches)
    assert kept.gate == gate
    assert (gates[gate].name if gate < len(gates) else None) == next_name
    assert said.endswith(words)
    assert (said == "") is (words == "")
    assert (kept.route is None) is (words != "")  # what is on board leads to goals that are none any more


def test_the_list_on_board_is_known_as_an_earlier_one_of_ours_and_not_adopted():
    before, sails = saved(A, B, C, gate=1), skipper(A, X)
    state = sails.initial(before, ("hash",))
    assert state.mission.known == ("hash", *before.names)
    assert state.mission.adoptable.lists == ()
    assert sails.change_of(before)
    again = sails.persisted(state)  # killed once more, before the list on board was looked at
    assert sails.change_of(again) == ""
    assert (again.gate, again.leg) == (1, 1)


def test_beside_a_strangers_mission_the_state_that_is_kept_says_of_which_goals_it_is():
    sails = skipper(A, B, C)
    state = with_parts(sails.initial(), progress={"gate": 2}, voyage={"sailing": True})
    kept = saved_of(state, sails.voyage.name)  # what the step puts aside has no goals of its own
    state = with_parts(state, mission={"foreign": "a stranger's", "adoptable": kept})
    again = Persisted.from_dict(sails.persisted(state).to_dict())
    assert (again.goals, again.leg) == (saved(A, B, C, gate=2).goals, 2)
    assert skipper(A, X, C).change_of(again).endswith("1 of the 2 goals reached counts, on to X")


@pytest.mark.parametrize(
    ("now", "reached", "skipped"),
    [
        ((A, B, C), (0,), 1),
        ((A, B, X), (0,), 1),  # B stays given up
        ((A, X, C), (0,), 0),  # what is in its place is sailed to
        ((X, B, C), (), 0),
    ],
)
def test_what_was_reached_and_what_given_up_is_known_of_the_goals_that_count(now, reached, skipped):
    sails = skipper(A, B, C)
    state = with_parts(sails.initial(), progress={"gate": 2, "reached": (0,)}, orders={"skipped": 1})
    before = Persisted.from_dict(sails.persisted(state).to_dict())
    kept, _ = resumed(skipper(*now).voyage, before)
    assert (kept.reached, kept.skipped) == (reached, skipped)


def test_what_had_arrived_has_arrived_no_more_with_a_goal_behind_the_last():
    before = saved(A, B, gate=2, arrived=True)
    assert skipper(A, B).has_arrived(before)
    assert not skipper(A, B, C).has_arrived(before)
    assert resumed(skipper(A, B, C).voyage, before)[0].gate == 2
    assert not skipper(A, B, laps=2).has_arrived(before)
    assert skipper(A).has_arrived(before)


def test_half_way_round_a_buoy_she_goes_on_round_it_only_where_it_leads_on_to_the_same_place():
    gates = gates_of(skipper(A, BUOY, B, C).voyage)
    half = next(i for i, gate in enumerate(gates) if gate.goal == 1) + 1
    before = saved(A, BUOY, B, C, gate=half)
    assert resumed(skipper(A, BUOY, B, X).voyage, before)[0].gate == half
    assert resumed(skipper(A, BUOY, X, C).voyage, before)[0].gate == half - 1


def test_a_state_that_says_nothing_of_its_goals_is_taken_as_it_is():
    before = replace(saved(A, B, C, gate=1), goals=())
    assert resumed(skipper(X, N).voyage, before) == (before, "")


def test_a_stay_at_the_last_goal_is_not_counted_on_at_another_one():
    before = replace(saved(A, B, gate=2), station_utc_s=77.0)
    assert resumed(skipper(A, B).voyage, before)[0].station_utc_s == 77.0
    assert resumed(skipper(A, C).voyage, before)[0].station_utc_s is None
    assert resumed(skipper(A, B, C).voyage, before)[0].station_utc_s is None
