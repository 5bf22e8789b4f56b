"""Wolsieffer's Figure 7, sailed: two channels, planned again at each waypoint; noise chooses the other one."""

import math

import numpy as np
import pytest
import shapely

from bench.papers import CHANNELS
from companion.skipper.step import actions as act
from companion.skipper.step.state import Phase
from companion.skipper.way.voyage import Goal
from tests.skipper.world import World, skipper, voyage

FROM_RAD = math.radians(-34.0)  # the right-hand channel can just be laid, with the margin kept
RHO_HZ = 0.036  # equation 17
START = (0.0, -20.0)


def unsteady(seed, sigma_rad):
    """Equation 17's wind about its mean."""
    rng, keep, off = np.random.default_rng(seed), 1.0 - RHO_HZ, [0.0]
    for _ in range(2000):
        off.append(keep * off[-1] + sigma_rad * math.sqrt(1.0 - keep * keep) * rng.standard_normal())
    return lambda t: (FROM_RAD + off[int(t)], 5.0)


def sail(seed, sigma_deg, **config):
    made = voyage(Goal(en_m=(10.0, 420.0), radius_m=4.0), obstacles=[shapely.from_wkt(w) for w in CHANNELS])
    rules = {"autopilot_beats": False, "delta_s": 0.75, "margin_m": 6.0, "margin_floor_m": 4.0, **config}
    sigma_rad = math.radians(sigma_deg)
    world = World(
        skipper=skipper(made, **rules), wind=unsteady(seed, sigma_rad), sigma=sigma_rad, position=START, expansions=3000
    )
    assert world.run(1500, lambda w: w.state.phase is Phase.DONE)
    assert world.clearance() > 4.0
    return world


def is_east_of_the_island(world):
    middle = [east for east, north in world.track if 190.0 < north < 210.0]
    assert min(middle) * max(middle) > 0.0
    return middle[0] > 0.0


@pytest.mark.parametrize("seed", range(3))
def test_figure_7_the_track_under_noise_takes_the_other_channel(seed):
    steady = sail(seed, 0.5)
    assert is_east_of_the_island(steady)
    for sigma_deg in (9.0, 14.0):
        noisy = sail(seed, sigma_deg)
        assert not is_east_of_the_island(noisy)
        assert noisy.count(act.RequestPlan) >= 2  # under way too
        assert noisy.t > steady.t - 5.0  # it is no short cut
