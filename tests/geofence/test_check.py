"""``companion fence check``: each fault of an area is found and named with its place."""

import math

import numpy as np
import pytest
from shapely.geometry import Polygon

from companion.geo.frame import LocalFrame
from companion.geofence import Area, Circle, Code, Fence, FindingLevel, Obstacle, Zone, ZoneKind
from companion.geofence.check import AreaConditions, check_area
from companion.messages import GeoPoint

ORIGIN = GeoPoint(lat_deg=50.8, lon_deg=-1.3)
FRAME = LocalFrame(ORIGIN)


def box(west, south, east, north):
    en = [(west, south), (east, south), (east, north), (west, north)]
    return Polygon(FRAME.array_lonlat_from_en(en))


def rock(west, south, east, north, name):
    return Obstacle(shape=box(west, south, east, north), name=name)


def keep_in(shape, name="lake"):
    return Zone(kind=ZoneKind.INCLUSION, shape=shape, name=name)


def goal(east, north):
    return FRAME.geo_from_en(east, north)


def found(area, **conditions):
    return {(f.code, f.severity): f for f in check_area(area, AreaConditions(**conditions))}


@pytest.mark.parametrize(
    ("area", "conditions", "why"),
    [
        (Area((rock(-99, -99, 99, 99, ""),)), {"drawing": "shore"}, "called like the edge of the water"),
        (Area((rock(-99, -99, 99, 99, "north-lake"),)), {}, "called like the edge of the water"),
        (Area((rock(-99, -99, 99, 99, ""),)), {"near": goal(5, 5)}, "a place that should lie on the water lies in it"),
        (
            Area(
                (rock(-99, -99, 99, 99, ""), rock(5, 5, 9, 9, "a"), rock(500, 5, 509, 9, "b"), rock(15, 5, 19, 9, "c"))
            ),
            {},
            "2 of 3 other obstacles lie in it",
        ),
        (Area((rock(-99, -99, 99, 99, "island"), rock(200, 5, 209, 9, "a"))), {"near": goal(150, 5)}, None),
        (Area((rock(-99, -99, 99, 99, ""), rock(200, 5, 209, 9, "a"))), {"drawing": "shore"}, None),  # rocks of a shore
        (Area((rock(-99, -99, 99, 99, "shore"),)), {"near": goal(150, 5)}, None),  # a lee shore, and the boat off it
        (Area((rock(5, 5, 9, 9, "shore"),), Fence((keep_in(box(-99, -99, 99, 99)),))), {}, None),
    ],
)
def test_a_shore_that_is_drawn_round_the_water_is_mentioned(area, conditions, why):
    """It was "1 keep-out zone: in order"."""
    finding = found(area, **conditions).get((Code.ROUND_THE_WATER, FindingLevel.NOTE))
    assert (finding is None) == (why is None)
    if why is not None:
        assert why in finding.text
        assert "--kind inclusion" in finding.remedy


def test_a_good_area_has_no_findings():
    area = Area(obstacles=(rock(50, 50, 80, 80, "a"),), fence=Fence((keep_in(box(-200, -200, 200, 200)),)))
    assert (
        check_area(area, AreaConditions(start=ORIGIN, goals=(goal(0.0, 150.0),), margin_m=10.0, twd_from_rad=0.0)) == ()
    )
    assert check_area(Area(), AreaConditions(start=ORIGIN)) == ()


def test_inclusions_that_ardupilot_would_intersect():
    apart = Area(fence=Fence((keep_in(box(-200, -200, 0, 200), "w"), keep_in(box(50, -200, 200, 200), "e"))))
    fault = found(apart)[Code.DISJOINT_INCLUSIONS, FindingLevel.ERROR]
    assert "no water is left" in fault.text
    assert fault.place == "w, e"
    lapping = Area(fence=Fence((keep_in(box(-200, -200, 50, 200), "w"), keep_in(box(0, -200, 200, 200), "e"))))
    assert "2 ha is left" in found(lapping)[Code.INTERSECTED_INCLUSIONS, FindingLevel.WARNING].text


def test_holes():
    ring = Polygon(box(-100, 100, 100, 200).exterior, [box(-20, 130, 20, 160).exterior])
    area = Area(obstacles=(Obstacle(shape=ring, name="atoll"),))
    assert found(area)[Code.HOLE, FindingLevel.WARNING].place == "atoll"
    assert (Code.HOLE, FindingLevel.NOTE) in found(Area(fence=Fence((keep_in(ring),))))
    # what no chart covers lies all round the water of an import, in which she starts
    assert found(area, start=goal(0, 145), goals=(goal(5, 140),)).keys().isdisjoint({(Code.HOLE, FindingLevel.WARNING)})


def test_places_in_the_wrong_place():
    area = Area(obstacles=(rock(-10, -10, 10, 10, "under"),), fence=Fence((keep_in(box(-200, -200, 200, 200)),)))
    faults = found(area, start=ORIGIN, goals=(goal(0, 500), goal(15, 0)), margin_m=10.0)
    assert "inside the obstacle 'under'" in faults[Code.START_OUTSIDE, FindingLevel.ERROR].text
    assert faults[Code.GOAL_OUTSIDE, FindingLevel.ERROR].place == "goal 1"
    assert "has 5.0 m of free water" in faults[Code.GOAL_OUTSIDE, FindingLevel.WARNING].text


def test_gaps_too_narrow_for_the_margin_and_the_wind():
    area = Area(obstacles=(rock(-100, 50, -12, 80, "west"), rock(12, 50, 100, 80, "east")))
    closed = found(area, margin_m=13.0)[Code.NARROW_GAP, FindingLevel.WARNING]
    assert "24.0 m is closed at a margin of 13 m" in closed.text
    assert closed.place.startswith("west / east at 50.800")
    assert found(area, margin_m=10.0) == {}
    # wind straight through the gap: close-hauled at 47 degrees the same margin needs 20 / cos 47 = 29.3 m
    beating = found(area, margin_m=10.0, twd_from_rad=0.0)[Code.NARROW_GAP, FindingLevel.WARNING]
    assert "needs 29.3 m" in beating.text
    assert found(area, margin_m=10.0, twd_from_rad=math.radians(90.0)) == {}
    between = Area(obstacles=(*area.obstacles, rock(-5, 30, 5, 100, "plug")))
    assert all("west / east" not in f.place for f in check_area(between, AreaConditions(margin_m=13.0)))


def test_no_way_through_names_the_margin_that_opens_one():
    wall = (rock(-600, 50, -12, 80, "west"), rock(12, 50, 600, 80, "east"))
    area = Area(obstacles=wall, fence=Fence((keep_in(box(-300, -100, 300, 300)),)))
    fault = found(area, start=ORIGIN, goals=(goal(0, 200),), margin_m=15.0)[Code.UNREACHABLE, FindingLevel.ERROR]
    assert "at a margin of 15 m" in fault.text
    # the gap of 24 m holds twice 12 m; margins are drawn up to 5 % wide, and the search stops at 0.1 m
    assert 11.3 <= float(fault.remedy.removeprefix("there is one at ").removesuffix(" m")) <= 12.0
    shut = Area(obstacles=(rock(-600, 50, 600, 80, "bar"),), fence=area.fence)
    fault = found(shut, start=ORIGIN, goals=(goal(0, 200),), margin_m=15.0)[Code.UNREACHABLE, FindingLevel.ERROR]
    assert "no water between" in fault.text


def test_obstacles_that_stick_out_of_the_fence():
    fence = Fence((keep_in(box(-200, -200, 200, 200)),))
    area = Area(obstacles=(rock(150, 50, 250, 80, "spit"), rock(300, 0, 320, 20, "far")), fence=fence)
    faults = found(area)
    assert faults[Code.OBSTACLE_OUTSIDE_FENCE, FindingLevel.WARNING].place == "spit"
    assert "0.15 ha" in faults[Code.OBSTACLE_OUTSIDE_FENCE, FindingLevel.WARNING].text
    assert faults[Code.OBSTACLE_OUTSIDE_FENCE, FindingLevel.NOTE].place == "far"


def test_what_was_cut_along_the_fence_does_not_stick_out_of_it():
    """Of a chart that was imported it was said of 20 shapes: by 9.45e-06 ha, a centimetre of rounding."""
    fence = Fence((keep_in(box(-200, -200, 200, 200)),))
    area = Area(obstacles=(rock(150, 50, 200.05, 80, "shore"),), fence=fence)
    assert not [code for code, _ in found(area) if code is Code.OBSTACLE_OUTSIDE_FENCE]


def test_more_vertices_than_the_autopilot_holds():
    t = 2.0 * np.pi * np.arange(200) / 200
    en = np.column_stack([150.0 * np.cos(t), 300.0 + 150.0 * np.sin(t)])
    area = Area(obstacles=(Obstacle(shape=Polygon(FRAME.array_lonlat_from_en(en)), name="big"),))
    assert "200 fence items" in found(area)[Code.TOO_MANY_ITEMS, FindingLevel.WARNING].text
    simpler = found(area, start=ORIGIN, margin_m=10.0)[Code.TOO_MANY_ITEMS, FindingLevel.NOTE]
    assert "simplified it takes 1" in simpler.text
    tight = found(area, start=ORIGIN, margin_m=0.05)
    assert "cannot be simplified" in tight[Code.TOO_MANY_ITEMS, FindingLevel.WARNING].text
    comb = [(x, 60.0 + 40.0 * (n % 2)) for n, x in enumerate(range(-2000, 2000, 25))]
    land = Polygon(FRAME.array_lonlat_from_en(np.array([*comb, (2000.0, 900.0), (-2000.0, 900.0)])))
    coast = found(Area(obstacles=(Obstacle(shape=land, name="coast"),)), start=ORIGIN, margin_m=3.0)
    assert "of the straight way is in it" in coast[Code.TOO_MANY_ITEMS, FindingLevel.WARNING].text


@pytest.mark.parametrize("radius_m", [30.0])
def test_circles_count_too(radius_m):
    area = Area(
        obstacles=(
            Obstacle(shape=Circle(goal(-20 - radius_m, 100), radius_m), name="c"),
            Obstacle(shape=Circle(goal(20 + radius_m, 100), radius_m), name="d"),
        )
    )
    assert "the gap of 39" in found(area, margin_m=25.0)[Code.NARROW_GAP, FindingLevel.WARNING].text
