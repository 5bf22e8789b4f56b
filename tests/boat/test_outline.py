"""The hull's outline: where it is, and that a mission's length and beam reach what is judged by it."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely

from companion.boat import Hull, outline_en_m
from companion.compose import boat_of, voyage_of
from companion.errors import InputError
from companion.geofence import load_mission
from tests.skipper.world import area, voyage

LONG = Hull(length_m=8.0, beam_m=2.0)


@pytest.mark.parametrize(("heading_deg", "bow"), [(0, (0, 4)), (90, (4, 0)), (180, (0, -4)), (-90, (-4, 0))])
def test_the_bow_points_where_the_boat_does(heading_deg, bow):
    ring = outline_en_m(LONG, [(0.0, 0.0)], [math.radians(heading_deg)])[0]
    polygon = shapely.Polygon(ring)
    assert polygon.area == pytest.approx(16.0)
    assert polygon.distance(shapely.Point(bow)) == pytest.approx(0.0, abs=1e-9)
    assert tuple(ring[0]) == tuple(ring[-1])
    assert np.hypot(*ring.T).max() == pytest.approx(LONG.reach_m)


def test_the_voyages_clearance_is_the_hulls():
    made = voyage(obstacles=(shapely.box(-10.0, 10.0, 10.0, 20.0),), limits=shapely.box(-30.0, -30.0, 30.0, 30.0))
    made = replace(made, boat=replace(made.boat, hull=LONG))
    assert made.hull_clearance_m((0.0, 5.0), 0.0) == pytest.approx(1.0)
    assert made.hull_clearance_m((0.0, 5.0), math.pi / 2.0) == pytest.approx(4.0)
    assert made.hull_clearance_m((0.0, 7.0), 0.0) <= 0.0
    assert made.hull_clearance_m((27.0, 0.0), math.pi / 2.0) <= 0.0  # the bow is over the fence
    assert replace(made, area=area()).hull_clearance_m((0.0, 0.0), 0.0) == math.inf


def test_length_and_beam_come_from_the_mission(tmp_path):
    text = Path("sitl/missions/open-water.toml").read_text(encoding="utf-8")
    path = tmp_path / "m.toml"
    path.write_text(text + "\n[boat]\nlength_m = 4.2\nbeam_m = 1.1\nmotor = true\n", encoding="utf-8")
    mission = load_mission(path)
    assert boat_of(mission).hull == Hull(length_m=4.2, beam_m=1.1)
    assert boat_of(mission).has_motor
    assert voyage_of(mission).boat.hull.reach_m == pytest.approx(0.5 * math.hypot(4.2, 1.1))
    path.write_text(text + "\n[boat]\nlength_m = 0.0\n", encoding="utf-8")
    with pytest.raises(InputError, match="length_m"):
        load_mission(path)
