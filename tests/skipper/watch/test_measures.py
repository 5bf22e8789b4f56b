"""The figures that the watchdogs watch, from a boat at one moment."""

import math
from dataclasses import replace

import pytest

from companion.skipper.step.context import StepContext
from companion.skipper.watch.measures import measure
from tests.skipper.test_voyage import make


@pytest.fixture(scope="module")
def moment():
    """A boat under way in 5 m/s, at whatever heading and velocity."""
    world = make()
    world.run(60)
    snapshot = world.snapshot()

    def at(heading_deg, east_mps, north_mps, *, turned_rad=0.0):
        """By the compass, or all of it turned by an angle."""
        c, s = math.cos(turned_rad), math.sin(turned_rad)
        vehicle = replace(
            snapshot.vehicle,
            heading_rad=math.radians(heading_deg) + turned_rad,
            velocity_en_mps=(c * east_mps + s * north_mps, c * north_mps - s * east_mps),
        )
        seen = replace(snapshot, vehicle=vehicle)
        return StepContext(world.skipper.voyage, world.skipper.config, world.state, seen)

    return at


@pytest.mark.parametrize(
    ("heading_deg", "east_mps", "north_mps", "off_deg"),
    [
        (90, 1.0, 0.0, 0.0),
        (90, 1.0, 1.0, 45.0),  # made good to port of the bow
        (0, 1.0, 1.0, 45.0),  # and to starboard
        (350, 0.174, 0.985, 20.0),  # over north
        (180, 0.0, 1.0, 180.0),  # astern
        (180, 0.0, 0.4, 0.0),  # below half a metre a second a course is nothing
    ],
)
def test_the_angle_between_bow_and_course_counts_on_either_side(moment, heading_deg, east_mps, north_mps, off_deg):
    here = moment(heading_deg, east_mps, north_mps)
    assert measure(here, "heading against course") == pytest.approx(off_deg, abs=0.1)


@pytest.mark.parametrize(
    ("heading_deg", "east_mps", "north_mps", "ahead_mps"),
    [
        (0, 0.1, 0.2, 0.2),  # the way ahead alone, not to lee
        (30, 0.3, 0.0, 0.15),
        (-30, -0.3, 0.0, 0.15),
        (0, 0.0, -0.5, 0.0),  # blown back
    ],
)
def test_in_irons_it_is_the_way_ahead_that_counts(moment, heading_deg, east_mps, north_mps, ahead_mps):
    wind_rad = moment(0, 0.0, 0.0).wind_now[0]
    here = moment(heading_deg, east_mps, north_mps, turned_rad=wind_rad)
    assert measure(here, "in irons") == pytest.approx(ahead_mps)


@pytest.mark.parametrize("heading_deg", [36, -36, 90, 180])
def test_who_points_more_than_35_degrees_off_the_wind_is_not_in_irons(moment, heading_deg):
    wind_rad = moment(0, 0.0, 0.0).wind_now[0]
    assert measure(moment(heading_deg, 0.0, 0.0, turned_rad=wind_rad), "in irons") == 0.8
