"""The greedy sailor: the heading of the best projected speed, kept by the side that she is on."""

import math

import pytest

from companion.boat import ardurover_sitl
from companion.geo.angles import difference_rad
from lab.campaigns.baselines import sail_alone
from lab.greedy import best_heading
from sitl.runner import SCENARIO_FOLDER
from sitl.scenario import load_scenario

POLAR = ardurover_sitl()


def steered(way, *, twd_deg=0.0, heading_deg=45.0, **more):
    return best_heading(
        POLAR,
        twd_from_rad=math.radians(twd_deg),
        tws_mps=5.0,
        way_en_m=way,
        heading_rad=math.radians(heading_deg),
        **more,
    )


@pytest.mark.parametrize("bearing_deg", [0.0, 20.0, 60.0, 90.0, 140.0, 180.0, -75.0])
@pytest.mark.parametrize("twd_deg", [0.0, 170.0])
def test_no_heading_makes_more_way_to_the_goal(bearing_deg, twd_deg):
    way = (
        1000.0 * math.sin(math.radians(bearing_deg + twd_deg)),
        1000.0 * math.cos(math.radians(bearing_deg + twd_deg)),
    )
    mine = steered(way, twd_deg=twd_deg, beating_m=0.0)

    def made_good(heading):
        off = difference_rad(heading, math.radians(twd_deg))
        return POLAR.speed_mps(abs(off), 5.0) * math.cos(heading - math.radians(bearing_deg + twd_deg))

    assert made_good(mine) >= max(made_good(math.radians(d)) for d in range(360)) - 1e-3


def test_dead_to_windward_she_stays_on_the_side_that_she_is_on():
    for heading in (40.0, -40.0):
        assert math.copysign(1.0, steered((0.0, 500.0), heading_deg=heading)) == math.copysign(1.0, heading)


def test_she_goes_about_when_the_other_side_is_better_by_more_the_nearer_she_is():
    # the goal is to the left of the wind's eye: the other side is better by a part that the angle gives
    def stays(distance, off_deg):
        off = math.radians(-off_deg)
        return steered((distance * math.sin(off), distance * math.cos(off)), heading_deg=45.0) > 0.0

    assert stays(60.0, 12.0)
    assert not stays(600.0, 12.0)
    assert not stays(60.0, 40.0)


def test_in_open_water_she_is_there_and_behind_rocks_she_is_not():
    upwind, block = (SCENARIO_FOLDER / f"{name}.toml" for name in ("upwind", "figures/block"))
    free = sail_alone(load_scenario(upwind), upwind, 0, "greedy").record
    assert (free["who"], free["arrived"], free["contacts"]) == ("greedy, embedded", True, 0)
    assert free["tacks"] >= 2
    assert sail_alone(load_scenario(block), block, 0, "greedy").record["contacts"] > 0
