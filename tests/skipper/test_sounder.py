"""The sounder's watchdogs: told in time to turn, by depth and rate, and not at all where nobody knows the keel."""

import pytest

from tests.skipper.test_voyage import make, said


def alarms(depth_m, rate_mps, *, sounds=True, least_m=2.0):
    world = make(config={"least_depth_m": least_m})
    world.run(20)
    world.shown |= {"sounds": sounds, "depth_m": depth_m, "depth_rate_mps": rate_mps}
    world.run(15)
    return {code for code in ("shoaling", "depth lost") if said(world, code)}


@pytest.mark.parametrize(
    ("depth_m", "rate_mps", "told"),
    [
        (9.0, 0.0, set()),
        (2.2, 0.0, set()),
        (1.9, None, {"shoaling"}),
        (1.9, 0.5, {"shoaling"}),
        (6.0, -0.15, set()),
        (6.0, -0.25, {"shoaling"}),
        (None, None, set()),
    ],
)
def test_shoaling_is_told_twenty_seconds_before_there_is_no_room(depth_m, rate_mps, told):
    assert alarms(depth_m, rate_mps) == told


def test_a_sounder_that_falls_silent_is_told_and_one_that_never_was_there_is_not():
    assert alarms(None, None, sounds=False) == {"depth lost"}
    assert alarms(None, None, sounds=None) == set()


def test_without_a_keel_nothing_is_watched():
    assert alarms(0.5, -1.0, least_m=None) == set()
    assert alarms(None, None, sounds=False, least_m=None) == set()
