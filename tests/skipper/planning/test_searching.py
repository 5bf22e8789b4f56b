"""A search in the small world of the skipper's tests: laid, sailed, laid anew, taken up again."""

import math

import pytest
import shapely

from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Phase
from companion.skipper.way.sweeps import coverage
from companion.skipper.way.voyage import Goal, Search
from tests.skipper.world import World, restarted, skipper, voyage

WATER = shapely.box(20.0, 20.0, 140.0, 90.0)
END = Goal(en_m=(0.0, 0.0), radius_m=10.0, name="end")


def world(*goals, swath=24.0, share=0.9, **changes):
    search = Goal(en_m=(80.0, 55.0), name="area", search=Search(area_en=WATER, swath_m=swath, coverage=share))
    changes.setdefault("wind", lambda t: (0.0, 5.0))
    return World(skipper=skipper(voyage(search, *(goals or (END,))), min_replan_interval_s=10.0), **changes)


def seen(w, swath=24.0):
    return coverage(WATER, tuple(w.track[::5]), swath)


def said(w, code):
    return [entry[2] for entry in w.log if entry[1] == code]


def test_an_area_is_searched_and_the_voyage_goes_on():
    w = world()
    assert w.run(900.0, lambda w: bool(w.state.progress.reached))
    assert seen(w) >= 0.9
    assert w.state.progress.covered[0] == (0, pytest.approx(seen(w), abs=0.02))
    assert any("sweep 2 of 4" in entry[2] for entry in w.log)
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)


def test_a_wind_that_turns_has_the_rest_laid_anew():
    w = world(wind=lambda t: (0.0 if t < 150.0 else 1.1, 5.0))
    assert w.run(1200.0, lambda w: bool(w.state.progress.reached))
    assert any("the wind has turned" in text for text in said(w, "sweeps"))
    assert seen(w) >= 0.9


def test_what_the_sweeps_left_is_sailed_again_and_not_for_ever():
    w = world(share=0.999)
    assert w.run(2500.0, lambda w: bool(w.state.progress.reached))
    laid = said(w, "sweeps")
    assert 1 <= len(laid) <= 4


@pytest.mark.parametrize("at_s", [60.0, 120.0, 180.0])
def test_killed_in_the_middle_it_goes_on_where_it_was(at_s):
    w = world()
    w.run(at_s)
    before = w.state
    restarted(w)
    w.run(10.0)
    then, now = before.progress, w.state.progress
    assert (now.gate, now.approaches) == (then.gate, then.approaches) or now.gate == then.gate + 1
    assert len(w.state.progress.searched) >= len(before.progress.searched) - 1
    assert w.run(900.0, lambda w: bool(w.state.progress.reached))
    assert seen(w) >= 0.9
    assert len(said(w, "sweeps")) == 1


def test_what_is_saved_of_a_search_is_read_again():
    w = world()
    w.run(160.0)
    saved = w.skipper.persisted(w.state)
    assert saved.searched
    assert saved.approaches[0].sweeps
    assert Persisted.from_dict(saved.to_dict()) == saved
    bad = saved.to_dict()
    bad["approaches"][0][4][0][0] = math.inf
    with pytest.raises(ValueError, match="damaged"):
        Persisted.from_dict(bad)


def test_a_search_is_given_up_by_order_and_held():
    w = world()
    w.run(100.0)
    w.order("hold")
    w.run(60.0)
    assert w.state.phase is Phase.HOLDING
    w.order("go_on")
    w.run(20.0)
    w.order("skip_goal")
    assert w.run(300.0, lambda w: w.state.phase is Phase.DONE)
    assert w.state.progress.reached == (1,)
    assert w.state.progress.task == ""
