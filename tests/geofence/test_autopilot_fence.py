"""The autopilot's fence: contains what it must, stays inside the margin, proved on the items that go up."""

import dataclasses
import math
import pathlib

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import LineString, Point, Polygon

from companion.geo.frame import LocalFrame
from companion.geofence import Area, Circle, Fence, Obstacle, Zone, ZoneKind, autopilot_fence, load_mission
from companion.geofence.autopilot_fence import (
    AUTOPILOT_METRES_PER_DEGREE,
    STEPS,
    AutopilotFence,
    FenceStatus,
    _meeting,
    _thinned,
    circle_round,
    enclosing_circle,
    fence_for_autopilot,
    metres_per_degree,
    plane_of,
    prove,
    reduce_ring,
    shape_in,
    shrunk_polygon,
)
from companion.geofence.formats.fence_items import MAX_FENCE_ITEMS, items_to_zones, zones_to_items
from companion.geofence.formats.rings import Findings
from companion.geofence.shapes import unwrapped
from companion.messages import Command, GeoPoint, MissionItem
from tests.geofence.strategies import QUIET

ROOT = pathlib.Path(__file__).parents[2]
CHARTED = {"rhode-river"}  # a real chart is more than a fence holds: what lies nearest to the way is in it, told apart
MISSIONS = sorted(
    path
    for folder in ("missions", "sitl/missions")
    for path in (ROOT / folder).glob("*.toml")
    if path.stem not in CHARTED
)


def ground(shape, frame: LocalFrame, sides: int = 360) -> Polygon:
    """A zone as it lies on the ground: polygon edges straight in longitude and latitude, cut fine; circles geodesic."""
    if isinstance(shape, Circle):
        x, y = frame.en_from_geo(shape.center)
        t = 2.0 * np.pi * np.arange(sides) / sides
        return Polygon(np.column_stack([x + shape.radius_m * np.cos(t), y + shape.radius_m * np.sin(t)]))
    fine = shapely.segmentize(shape, 0.0005)
    return Polygon(frame.array_en_from_lonlat(unwrapped(np.asarray(fine.exterior.coords)[:, :2])))


def check(result: AutopilotFence, area: Area, margin_m: float, inside: list[GeoPoint]) -> None:
    """The promise, checked in another frame than the code's: azimuthal equidistant metres."""
    frame = LocalFrame(inside[0])
    way = [frame.en_from_geo(p) for p in inside]
    band = shapely.box(-1e6, -1e6, 1e6, 1e6)
    if math.isfinite(result.reach_m):
        band = shapely.buffer(LineString(way) if len(way) > 1 else Point(way[0]), result.reach_m, quad_segs=90)
    zones, _ = items_to_zones(result.items, Findings())
    assert len(result.items) <= MAX_FENCE_ITEMS
    out = [ground(z.shape, frame) for z in zones if z.kind is ZoneKind.EXCLUSION]
    inside = [ground(z.shape, frame) for z in zones if z.kind is ZoneKind.INCLUSION]
    obstacles = [ground(o.shape, frame) for o in area.solids]
    limits = [ground(z.shape, frame) for z in area.fence.inclusions]
    keep_in = inside[0] if inside else None
    closed = shapely.buffer(shapely.union_all(out) if out else Polygon(), 0.02)
    for obstacle in obstacles:
        reach = shapely.intersection(obstacle, band)
        reach = reach if keep_in is None else shapely.intersection(reach, keep_in)
        assert shapely.difference(reach, closed).area < 0.02
    for limit in limits:
        assert shapely.covers(shapely.buffer(limit, 0.02), shapely.difference(keep_in, closed))
    slack = 0.02 + 0.002 * margin_m
    allowed = shapely.union_all([shapely.buffer(o, margin_m + slack, quad_segs=90) for o in obstacles] or [Polygon()])
    if limits:
        useful = shapely.buffer(shapely.intersection_all(limits), -margin_m - slack, quad_segs=90)
        allowed = shapely.union(allowed, shapely.difference(shapely.box(-2e4, -2e4, 2e4, 2e4), useful))
        here = shapely.points(0.0, 0.0)
        piece = [p for p in shapely.get_parts(useful) if shapely.covers(p, here)]
        assert all(shapely.covers(keep_in, p) for p in piece)
    for zone in out:
        assert shapely.covers(allowed, zone)


@pytest.mark.parametrize("path", MISSIONS, ids=lambda p: p.stem)
def test_every_example_fits(path):
    mission = load_mission(path)
    inside = [mission.start, *(g.point for g in mission.goals)]
    result = fence_for_autopilot(mission.area, mission.margin_m, inside=inside)
    if not mission.area.solids and not mission.area.fence.zones:
        assert result.status is FenceStatus.EMPTY
        return
    assert result.status is FenceStatus.OK, result.reason
    assert result.reach_m == math.inf
    check(result, mission.area, mission.margin_m, inside)


@st.composite
def areas(draw):
    """Islands round a start, some of them circles, perhaps inside a lake."""
    lat, lon = draw(st.sampled_from([(50.8, -1.3), (-33.0, 151.2), (0.0, 10.0), (68.0, 15.0), (20.0, 179.9995)]))
    origin = GeoPoint(lat_deg=lat, lon_deg=lon)
    frame = LocalFrame(origin)
    margin_m = draw(st.sampled_from([3.0, 8.0, 12.0, 25.0]))
    rng = np.random.default_rng(draw(st.integers(0, 10_000)))
    obstacles = []
    for i in range(draw(st.integers(0, 9))):
        angle, far = rng.uniform(0, 2 * math.pi), rng.uniform(120.0, 420.0)
        x, y = far * math.sin(angle), far * math.cos(angle)
        if rng.uniform() < 0.25:
            obstacles.append(Obstacle(shape=Circle(frame.geo_from_en(x, y), float(rng.uniform(4.0, 60.0)))))
            continue
        n = int(rng.integers(3, 40))
        t = 2.0 * math.pi * (np.arange(n) + rng.uniform(0.0, 0.8)) / n
        r = rng.uniform(8.0, 60.0) * rng.uniform(0.35, 1.0, n)
        en = np.column_stack([x + r * np.cos(t), y + r * np.sin(t)])
        own = float(rng.uniform(5.0, 40.0)) if rng.uniform() < 0.2 else None
        obstacles.append(Obstacle(shape=Polygon(unwrapped(frame.array_lonlat_from_en(en))), name=f"i{i}", margin_m=own))
    zones = []
    if draw(st.booleans()):
        n = int(rng.integers(4, 120))
        t = 2.0 * math.pi * np.arange(n) / n
        r = rng.uniform(300.0, 520.0, n) if n < 30 else 400.0 * (1.0 + 0.2 * np.sin(3 * t)) + rng.uniform(0.0, 12.0, n)
        lake = np.column_stack([r * np.cos(t), r * np.sin(t)])
        zones.append(Zone(kind=ZoneKind.INCLUSION, shape=Polygon(unwrapped(frame.array_lonlat_from_en(lake)))))
    elif draw(st.booleans()):
        zones.append(Zone(kind=ZoneKind.INCLUSION, shape=Circle(frame.geo_from_en(30.0, -20.0), 450.0)))
    return Area(obstacles=tuple(obstacles), fence=Fence(zones=tuple(zones))), margin_m, origin


@settings(**QUIET, max_examples=30)
@given(areas())
def test_simplified_zones_hold_the_true_ones_within_the_margin(case):
    area, margin_m, origin = case
    result = fence_for_autopilot(area, margin_m, inside=[origin])
    if result.status is FenceStatus.OK:
        check(
            result,
            area,
            margin_m
            if not any(o.margin_m for o in area.solids)
            else max(margin_m, *(o.margin_m or 0.0 for o in area.solids)),
            [origin],
        )
        assert 0.0 < result.used_m <= margin_m
        assert result == fence_for_autopilot(area, margin_m, inside=[origin])
    else:
        assert result.reason
        assert not result.items


def test_most_random_areas_do_fit():
    """The property above would also hold of a function that always refuses."""
    good = []

    @settings(**QUIET, max_examples=20)
    @given(areas())
    def count(case):
        area, margin_m, origin = case
        if area.solids or area.fence.zones:
            good.append(fence_for_autopilot(area, margin_m, inside=[origin]).status is FenceStatus.OK)

    count()
    assert sum(good) > 0.8 * len(good)


ORIGIN = GeoPoint(lat_deg=50.8, lon_deg=-1.3)


def island(x, y, radii, name="island") -> Obstacle:
    t = 2.0 * np.pi * np.arange(len(radii)) / len(radii)
    en = np.column_stack([x + np.array(radii) * np.cos(t), y + np.array(radii) * np.sin(t)])
    return Obstacle(shape=Polygon(LocalFrame(ORIGIN).array_lonlat_from_en(en)), name=name)


def test_circles_where_they_are_cheaper():
    round_ones = Area(obstacles=tuple(island(100.0 * i, 200.0, [20.0] * 30, f"r{i}") for i in range(40)))
    result = fence_for_autopilot(round_ones, 10.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK
    assert len(result.items) == 40


def test_thousands_of_vertices_fit():
    rng = np.random.default_rng(3)
    t = 2.0 * np.pi * np.arange(3_000) / 3_000
    radii = 800.0 + 60.0 * np.sin(3.0 * t) + rng.uniform(0.0, 3.0, 3_000)
    result = fence_for_autopilot(Area(obstacles=(island(0.0, 1200.0, radii),)), 15.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK, result.reason
    assert len(result.items) < 40
    check(result, Area(obstacles=(island(0.0, 1200.0, radii),)), 15.0, [ORIGIN])


def stars(count, of=(80.0, 20.0)):
    """Obstacles that no circle holds: each takes ten items."""
    return tuple(
        island(300.0 * (i % 6) - 700.0, 300.0 * (i // 6) + 200.0, list(of) * 5, f"star {i}") for i in range(count)
    )


def test_of_more_than_fits_the_nearest_to_the_way_are_held():
    """A chart has more rocks than the autopilot has room for: those at the way come first, the rest is told."""
    many = Area(obstacles=stars(30))
    inside = [ORIGIN, LocalFrame(ORIGIN).geo_from_en(50.0, 650.0)]  # between four of them
    result = fence_for_autopilot(many, 5.0, inside=inside)
    assert result.status is FenceStatus.OK, result.reason
    check(result, many, 5.0, inside)
    assert 100.0 < result.reach_m < 1000.0
    assert f"within {result.reach_m:.0f} m of the straight way" in result.left_out
    way = LineString([(0.0, 0.0), (50.0, 650.0)])
    ninth_m = sorted(ground(s.shape, LocalFrame(ORIGIN)).distance(way) for s in many.solids)[8]
    assert result.reach_m > 0.95 * ninth_m, "eight stars of ten items are within 84"
    elsewhere = [LocalFrame(ORIGIN).geo_from_en(-550.0, 1250.0), LocalFrame(ORIGIN).geo_from_en(-250.0, 1550.0)]
    other = fence_for_autopilot(many, 5.0, inside=elsewhere)
    check(other, many, 5.0, elsewhere)
    assert {z.name for z in other.zones}.isdisjoint({"star 2", "star 3"})
    wider = fence_for_autopilot(many, 60.0, inside=inside)
    assert (wider.status, wider.reach_m, wider.left_out) == (FenceStatus.OK, math.inf, "")


def test_of_a_coast_that_is_too_long_the_part_at_the_way_is_held():
    """A cell's land is one polygon of miles: it is cut where the items end, inside of the land."""
    rng = np.random.default_rng(5)
    x = np.arange(-6000.0, 6000.0, 40.0)
    shore = np.column_stack([x, 150.0 + 90.0 * (np.arange(len(x)) % 2) + rng.uniform(0.0, 20.0, len(x))])
    ring = np.vstack([shore, [(6000.0, 4000.0), (-6000.0, 4000.0)]])
    land = Obstacle(shape=Polygon(unwrapped(LocalFrame(ORIGIN).array_lonlat_from_en(ring))), name="land")
    rim = Zone(kind=ZoneKind.INCLUSION, shape=Circle(ORIGIN, 6500.0))
    area = Area(obstacles=(land,), fence=Fence(zones=(rim,)))
    inside = [ORIGIN, LocalFrame(ORIGIN).geo_from_en(400.0, 0.0)]
    result = fence_for_autopilot(area, 15.0, inside=inside)
    assert result.status is FenceStatus.OK, result.reason
    check(result, area, 15.0, inside)
    assert 300.0 < result.reach_m < 5000.0
    assert prove(area, result.items, 15.0, inside=inside, reach_m=result.reach_m) == ""
    assert "do not hold land" in prove(area, result.items, 15.0, inside=inside, reach_m=2.0 * result.reach_m)
    assert "do not hold land" in prove(area, result.items, 15.0, inside=inside)


def test_a_hole_of_the_limits_that_is_too_far_off_is_let_go():
    holes = [np.asarray(s.shape.exterior.coords) for s in stars(30)]
    rim = island(0.0, 900.0, [3000.0] * 60).shape
    area = Area(fence=Fence(zones=(keep_in(Polygon(rim.exterior, holes)),)))
    result = fence_for_autopilot(area, 5.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK, result.reason
    assert 200.0 < result.reach_m < 1500.0
    nearer = [z for z in result.zones if z.kind is ZoneKind.INCLUSION]
    items, _ = zones_to_items(nearer)
    assert "is not inside" in prove(area, items, 5.0, inside=[ORIGIN], reach_m=result.reach_m)
    assert prove(area, items, 5.0, inside=[ORIGIN], reach_m=100.0) == ""


def test_refusals_say_why():
    lake = Area(fence=Fence(zones=(keep_in(island(0.0, 0.0, [500.0, 440.0] * 60).shape),)))
    many = fence_for_autopilot(lake, 5.0, inside=[ORIGIN])
    assert many.status is FenceStatus.TOO_MANY_ITEMS
    assert "autopilot holds 84" in many.reason
    assert "limits" in many.reason
    none = fence_for_autopilot(Area(obstacles=stars(30)), 0.05, inside=[ORIGIN])
    assert none.status is FenceStatus.NO_MARGIN
    on_the_rock = fence_for_autopilot(Area(obstacles=(island(0.0, 0.0, [30.0] * 8),)), 10.0, inside=[ORIGIN])
    assert on_the_rock.status is FenceStatus.START_ENCLOSED
    dry = Area(fence=Fence(zones=(Zone(kind=ZoneKind.INCLUSION, shape=island(500.0, 0.0, [50.0] * 8).shape),)))
    assert fence_for_autopilot(dry, 10.0, inside=[ORIGIN]).status is FenceStatus.NO_WATER


def test_a_lake_given_as_land_with_a_hole():
    outer, inner = island(0.0, 0.0, [900.0] * 24), island(0.0, 0.0, [400.0] * 24)
    land = Obstacle(shape=Polygon(outer.shape.exterior, [inner.shape.exterior]), name="land")
    result = fence_for_autopilot(Area(obstacles=(land,)), 15.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK, result.reason
    assert {z.kind for z in result.zones} == {ZoneKind.INCLUSION}
    assert any("sails inside land" in note for note in result.notes)


def test_the_proof_finds_what_is_wrong():
    """prove() is no rubber stamp: a vertex pulled in, a circle too small, a zone too wide, a start shut out."""
    area = Area(obstacles=(island(0.0, 200.0, [40.0, 20.0, 40.0, 20.0, 40.0, 20.0]), island(150.0, 150.0, [20.0] * 30)))
    result = fence_for_autopilot(area, 10.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK
    assert prove(area, result.items, 10.0, inside=[ORIGIN]) == ""
    frame = LocalFrame(ORIGIN)
    for zones, words in (
        (tuple(Zone(kind=z.kind, shape=_scaled(z.shape, 0.9)) for z in result.zones), "do not hold"),
        (tuple(Zone(kind=z.kind, shape=_scaled(z.shape, 1.6)) for z in result.zones), "beyond the planner's margin"),
        (result.zones[:1], "do not hold"),
        (
            (*result.zones, Zone(kind=ZoneKind.INCLUSION, shape=Circle(frame.geo_from_en(0.0, 300.0), 200.0))),
            "start would be outside",
        ),
    ):
        items, _ = zones_to_items(zones)
        assert words in prove(area, items, 10.0, inside=[ORIGIN])


def keep_in(shape, margin_m=None):
    return Zone(kind=ZoneKind.INCLUSION, shape=shape, margin_m=margin_m)


def square(half_m, east_m=0.0):
    e, h = east_m, half_m
    return Polygon(
        LocalFrame(ORIGIN).array_lonlat_from_en(np.array([(e - h, -h), (e + h, -h), (e + h, h), (e - h, h)]))
    )


@pytest.mark.parametrize(
    ("half_m", "says"), [(200.5, "is not inside"), (199.5, ""), (190.5, ""), (189.0, "shuts out water")]
)
def test_a_keep_in_zone_is_inside_the_limits_by_no_more_than_the_margin(half_m, says):
    area = Area(fence=Fence(zones=(keep_in(square(200.0)),)))
    items, _ = zones_to_items((keep_in(square(half_m)),))
    assert says in (told := prove(area, items, 10.0, inside=[ORIGIN]))
    assert bool(told) == bool(says)


@pytest.mark.parametrize(
    ("radius_m", "off_m", "says"),
    [
        (200.0, 0.0, ""),  # the rim itself: both radii are drawn on one sphere
        (201.0, 0.0, "is not inside"),
        (190.0, 0.0, ""),
        (188.0, 0.0, "shuts out water"),
        (195.0, 4.0, ""),
        (198.0, 4.0, "is not inside"),
        (192.0, 6.0, "shuts out water"),
        (190.0, 9.99, "is not inside"),  # inside by a centimetre, where the plane's own error is three
    ],
)
def test_a_circle_to_keep_in_is_held_by_the_circle_of_the_limits(radius_m, off_m, says):
    rim, frame = Circle(ORIGIN, 200.0), LocalFrame(ORIGIN)
    area = Area(fence=Fence(zones=(keep_in(rim),)))
    items, _ = zones_to_items((keep_in(Circle(frame.geo_from_en(off_m, 0.0), radius_m)),))
    assert says in (told := prove(area, items, 10.0, inside=[ORIGIN]))
    assert bool(told) == bool(says)


def test_limits_without_a_keep_in_zone_are_no_fence_and_each_of_two_limits_counts():
    both = Area(fence=Fence(zones=(keep_in(square(200.0)), keep_in(square(200.0, east_m=100.0)))))
    assert "is not inside" in prove(both, (), 10.0, inside=[ORIGIN])
    whole, _ = zones_to_items((keep_in(square(199.9)),))
    assert "is not inside" in prove(both, whole, 10.0, inside=[ORIGIN])
    fitted, _ = zones_to_items((keep_in(square(199.9)), keep_in(square(199.9, east_m=100.0))))
    assert prove(both, fitted, 10.0, inside=[ORIGIN]) == ""


def test_a_limit_with_a_margin_of_its_own_is_narrower_by_it():
    area = Area(fence=Fence(zones=(keep_in(square(200.0), margin_m=30.0),)))
    assert prove(area, zones_to_items((keep_in(square(165.0)),))[0], 10.0, inside=[ORIGIN]) == ""
    assert "shuts out water" in prove(area, zones_to_items((keep_in(square(155.0)),))[0], 10.0, inside=[ORIGIN])


@pytest.mark.parametrize(("goal_m", "says"), [(150.0, ""), (195.0, ""), (205.0, "goal 1 would be outside")])
def test_a_goal_outside_of_the_fence_is_named(goal_m, says):
    area = Area(fence=Fence(zones=(keep_in(square(200.0)),)))
    items, _ = zones_to_items((keep_in(square(199.9)),))
    goal = LocalFrame(ORIGIN).geo_from_en(0.0, goal_m)
    assert says in (told := prove(area, items, 10.0, inside=[ORIGIN, goal]))
    assert bool(told) == bool(says)


def test_a_goal_on_a_keep_out_zone_is_named_and_a_rock_outside_of_the_keep_in_zones_needs_none():
    rock, far = island(0.0, 150.0, [20.0] * 12, "rock"), island(0.0, 400.0, [20.0] * 12, "far")
    area = Area(obstacles=(rock, far), fence=Fence(zones=(keep_in(square(200.0)),)))
    result = fence_for_autopilot(area, 10.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK
    assert [z.kind for z in result.zones].count(ZoneKind.EXCLUSION) == 1
    goal = LocalFrame(ORIGIN).geo_from_en(0.0, 150.0)
    assert "goal 1 would be outside" in prove(area, result.items, 10.0, inside=[ORIGIN, goal])
    only_in = tuple(z for z in result.zones if z.kind is ZoneKind.INCLUSION)
    assert "do not hold rock" in prove(area, zones_to_items(only_in)[0], 10.0, inside=[ORIGIN])
    assert any("1 obstacle(s) lie outside" in note for note in result.notes)


def test_a_keep_out_zone_may_reach_as_far_as_the_rocks_own_margin():
    rock = island(0.0, 150.0, [20.0] * 24, "rock")
    wide = Obstacle(shape=rock.shape, name="rock", margin_m=25.0)
    around = LocalFrame(ORIGIN).geo_from_en(0.0, 150.0)
    items, _ = zones_to_items((Zone(kind=ZoneKind.EXCLUSION, shape=Circle(around, 38.0)),))
    assert "beyond the planner's margin" in prove(Area(obstacles=(rock,)), items, 10.0, inside=[ORIGIN])
    assert prove(Area(obstacles=(wide,)), items, 10.0, inside=[ORIGIN]) == ""


def _scaled(shape, factor):
    if isinstance(shape, Circle):
        return Circle(shape.center, shape.radius_m * factor)
    return shapely.affinity.scale(shape, factor, factor)


def test_many_small_zones_fill_the_storage_before_there_are_84_items():
    """ArduRover: "Fence exceeds storage size", although every list of 84 items was announced as supported."""
    from companion.geofence.formats.fence_items import STORAGE_BYTES, storage_bytes

    circles = [MissionItem(command=Command.NAV_FENCE_CIRCLE_EXCLUSION, params=(5.0, 0, 0, 0)) for _ in range(60)]
    assert storage_bytes(circles) == 5 + 60 * 13 > STORAGE_BYTES
    polygon = [MissionItem(command=Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION, params=(83.0, 0, 0, 0))] * 83
    assert storage_bytes(polygon) == 5 + 2 + 83 * 8
    assert storage_bytes(polygon) <= STORAGE_BYTES


def test_the_steps_of_the_margin_begin_with_the_least_and_end_with_all_of_it():
    assert tuple(sorted(STEPS)) == STEPS
    assert STEPS[-1] == 1.0


@pytest.mark.parametrize("lat_deg", [0.0, 20.0, 50.8, -68.0])
@pytest.mark.parametrize("radius_m", [50.0, 3000.0, 40_000.0])
def test_a_plane_is_wrong_by_no_more_than_it_says_on_the_earth_and_on_the_autopilots_sphere(lat_deg, radius_m):
    """All that is proved in the plane allows for its error: were it more, a fence would let a rock through."""
    middle = GeoPoint(lat_deg=lat_deg, lon_deg=10.0)
    plane, frame = plane_of(Area(obstacles=(Obstacle(shape=Circle(middle, radius_m)),)), middle), LocalFrame(middle)
    rng = np.random.default_rng(7)
    for course, share, far in rng.uniform((0.0, 0.0, 0.05), (2.0 * math.pi, 0.9, 0.1), (60, 3)):
        x, y = share * radius_m * math.cos(course), share * radius_m * math.sin(course)
        a = frame.geo_from_en(x, y)
        there = LocalFrame(a)
        for turn in (0.0, 0.5 * math.pi, 1.0):
            b = there.geo_from_en(far * radius_m * math.sin(turn), far * radius_m * math.cos(turn))
            drawn_m = math.dist(plane.point(a), plane.point(b))
            assert abs(drawn_m / (far * radius_m) - 1.0) <= plane.error
            east_deg = (b.lon_deg - a.lon_deg) * math.cos(math.radians(0.5 * (a.lat_deg + b.lat_deg)))
            sphere_m = AUTOPILOT_METRES_PER_DEGREE * math.hypot(east_deg, b.lat_deg - a.lat_deg)
            assert abs(drawn_m / sphere_m - 1.0) <= plane.error
    assert plane.error < 0.0075 + 3.0 * radius_m / 6.0e6


def test_a_plane_is_as_wrong_of_what_lies_to_the_south_as_of_what_lies_to_the_north():
    equator = GeoPoint(lat_deg=0.0, lon_deg=10.0)
    south, north = (
        plane_of(Area(obstacles=(Obstacle(shape=Circle(GeoPoint(lat_deg=lat, lon_deg=10.0), 10_000.0)),)), equator)
        for lat in (-0.2, 0.2)
    )
    assert south.error == pytest.approx(north.error)


@pytest.mark.parametrize("radius", [2.0, 40.0, 900.0, 40_000.0])
def test_a_circle_is_drawn_around_or_inside_of_it_to_5_mm(radius):
    for inside in (False, True):
        ring = circle_round(30.0, -20.0, radius, inside=inside)
        corners = np.asarray(ring.exterior.coords)
        far = np.hypot(*(corners - (30.0, -20.0)).T)
        near = np.hypot(*((corners[1:] + corners[:-1]) / 2.0 - (30.0, -20.0)).T)  # the middles of its sides
        assert far.max() <= radius + (1e-9 * radius if inside else 0.005)
        assert near.min() >= radius - (0.005 if inside else 1e-9 * radius)
    plane = plane_of(Area(obstacles=(Obstacle(shape=Circle(ORIGIN, radius)),)), ORIGIN)
    around, _ = shape_in(Circle(ORIGIN, radius), plane, cover=True)
    within, _ = shape_in(Circle(ORIGIN, radius), plane, cover=False)
    exact = np.linspace(0.0, 2.0 * np.pi, 1000)[:, None]
    for share, ring, holds in ((1.0 + plane.error, around, True), (1.0 - plane.error, within, False)):
        rim = shapely.points(share * radius * np.hstack([np.sin(exact), np.cos(exact)]))
        held = shapely.intersects(shapely.buffer(ring, 1e-6), rim)
        assert np.all(held) if holds else not np.all(shapely.contains_properly(ring, rim))
        assert (
            holds
            or float(
                np.max(shapely.distance(shapely.points((0.0, 0.0)), shapely.points(np.asarray(ring.exterior.coords))))
            )
            <= share * radius + 1e-6
        )


@settings(**QUIET, max_examples=40)
@given(st.integers(0, 10_000), st.integers(4, 40), st.booleans())
def test_a_ring_of_fewer_corners_still_holds_all_that_the_ring_held(seed, corners, grows):
    """A corner that cut into a rock would be let through by the autopilot."""
    rng = np.random.default_rng(seed)
    t = 2.0 * math.pi * np.arange(corners) / corners
    r = 60.0 * rng.uniform(0.35, 1.0, corners)
    ring = np.column_stack([r * np.cos(t), r * np.sin(t)])[:: 1 if grows else -1]
    allowed = Polygon(ring).buffer(15.0) if grows else Polygon(ring).difference(Polygon(ring).buffer(-15.0))
    reduced = Polygon(reduce_ring(ring, lambda triangle: bool(shapely.covers(allowed, triangle))))
    small, large = (Polygon(ring), reduced) if grows else (reduced, Polygon(ring))
    assert shapely.covers(large.buffer(1e-9), small)
    assert reduced.is_valid
    assert len(reduced.exterior.coords) - 1 <= corners
    beyond = shapely.difference(large, small)
    assert beyond.is_empty or shapely.covers(allowed.buffer(1e-9), beyond)


@settings(**QUIET, max_examples=20)
@given(st.integers(0, 10_000))
def test_the_move_that_gives_away_least_is_tried_first(seed):
    rng = np.random.default_rng(seed)
    t = 2.0 * math.pi * np.arange(12) / 12
    r = 60.0 * rng.uniform(0.35, 1.0, 12)
    tried: list[float] = []
    reduce_ring(np.column_stack([r * np.cos(t), r * np.sin(t)]), lambda tri: tried.append(tri.area))  # none may be
    assert len(tried) > 1
    assert tried == pytest.approx(sorted(tried))


@pytest.mark.parametrize("grows", [True, False])
def test_a_move_is_reckoned_once_and_again_only_beside_one_that_was_taken(monkeypatch, grows):
    """All moves of 600 corners after each that is taken are 150 000 turns: seconds of a core for a chart."""
    rng = np.random.default_rng(4)
    t = 2.0 * math.pi * np.arange(600) / 600
    r = 800.0 * rng.uniform(0.99, 1.0, 600)
    ring = np.column_stack([r * np.cos(t), r * np.sin(t)])[:: 1 if grows else -1]
    turns = []
    monkeypatch.setattr(
        autopilot_fence, "_cross", lambda a, b, c, of=autopilot_fence._cross: turns.append(b) or of(a, b, c)
    )
    assert len(reduce_ring(ring, lambda triangle: triangle.area < 200.0)) < 150
    assert len(turns) < 20 * len(ring)


def plainly_reduced(ring, most_area):
    """All moves anew after each: what ``reduce_ring`` is to be, without what it remembers."""
    points, refused = [(float(x), float(y)) for x, y in ring], set()
    while len(points) > 3:
        n, found = len(points), []
        for i in range(n):
            a, b, c, d = (points[(i + k) % n] for k in (-1, 0, 1, 2))
            move = autopilot_fence._move(a, b, c, d)
            if move is not None and move[1] not in refused:
                found.append((*move[:2], i, move[2]))
        for _, key, i, meet in sorted(found, key=lambda move: move[:2]):
            changed = list(points)
            changed[i : i + 1] = [] if meet is None else [meet]
            if meet is not None:
                del changed[(i + 1) % n]
            triangle = Polygon(key if meet is None else (key[1], meet, key[2]))
            if triangle.area <= most_area and Polygon(changed).is_valid:
                points = changed
                break
            refused.add(key)
        else:
            break
    return np.array(points)


@settings(**QUIET, max_examples=60)
@given(st.integers(0, 10_000), st.integers(4, 40), st.sampled_from([20.0, 100.0, 500.0]), st.booleans())
def test_what_is_remembered_of_moves_changes_nothing(seed, corners, most_area, grows):
    rng = np.random.default_rng(seed)
    t = 2.0 * math.pi * np.arange(corners) / corners
    r = 60.0 * rng.uniform(0.35, 1.0, corners)
    ring = np.column_stack([r * np.cos(t), r * np.sin(t)])[:: 1 if grows else -1]
    reduced = reduce_ring(ring, lambda triangle: triangle.area <= most_area)
    assert np.array_equal(reduced, plainly_reduced(ring, most_area))


def test_of_more_than_fits_no_corner_is_reduced_that_cannot_count(monkeypatch):
    """30 stars of three corners at the least are 90 items: that is known before any is reduced."""
    reduced = []
    of = autopilot_fence.reduce_ring
    monkeypatch.setattr(autopilot_fence, "reduce_ring", lambda ring, may_add: reduced.append(1) or of(ring, may_add))
    inside = [ORIGIN, LocalFrame(ORIGIN).geo_from_en(50.0, 650.0)]
    result = fence_for_autopilot(Area(obstacles=stars(30)), 5.0, inside=inside)
    assert result.status is FenceStatus.OK
    assert result.reach_m < math.inf
    assert len(reduced) < 100  # each of them at each share of the margin and each reach is 272


def test_of_water_that_falls_apart_where_it_is_narrow_the_largest_part_is_thinned():
    t = 2.0 * np.pi * np.arange(400) / 400
    lake = Polygon(np.column_stack([(500.0 + 2.0 * np.sin(40 * t)) * np.cos(t), 500.0 * np.sin(t)]))
    pond = shapely.Point(555.0, 0.0).buffer(60.0, quad_segs=60)
    both = shapely.union(lake, pond)
    both = both.difference(shapely.box(493.0, 1.0, 506.0, 90.0)).difference(shapely.box(493.0, -90.0, 506.0, -1.0))
    assert both.geom_type == "Polygon"
    core = shapely.Point(0.0, 0.0).buffer(470.0)
    found = shrunk_polygon(both, 0.03, 20.0, core)
    assert found is not None
    assert shapely.covers(both, found)
    assert shapely.covers(found, core)
    assert len(found.exterior.coords) < 60


def test_water_that_is_narrower_than_the_tolerance_is_not_thinned():
    """Less a quarter or 3 % of the tolerance nothing of it is left, and with fewer corners it would reach onto land."""
    x = np.arange(0.0, 400.0, 2.0)
    shore = np.column_stack([x, 0.3 * (np.arange(len(x)) % 2)])
    creek = Polygon(np.vstack([shore, shore[::-1] + np.array([0.0, 0.5])]))
    assert _thinned(creek, 20.0, inward=True) == creek


def test_a_fence_that_holds_less_than_all_says_how_much():
    part = AutopilotFence(status=FenceStatus.OK, reason="", margin_m=10.0, reach_m=120.0)
    assert "within 120 m of the straight way" in part.left_out
    assert dataclasses.replace(part, reach_m=math.inf).left_out == ""


def test_the_smallest_circle_round_a_polygon_holds_all_its_corners():
    assert enclosing_circle(shapely.box(10.0, 0.0, 40.0, 40.0)) == pytest.approx((25.0, 20.0, 25.0))


@pytest.mark.parametrize("radius_m", [449.96, 450.0, 450.02, 450.049])
def test_limits_that_are_a_circle_give_a_circle_that_rounding_never_makes_larger(radius_m):
    area = Area(fence=Fence(zones=(keep_in(Circle(ORIGIN, radius_m)),)))
    result = fence_for_autopilot(area, 10.0, inside=[ORIGIN])
    [zone] = result.zones
    assert radius_m - 0.2 < zone.shape.radius_m <= radius_m - 0.03


def test_limits_narrower_than_the_margin_have_no_keep_in_zone():
    area = Area(fence=Fence(zones=(keep_in(square(8.0)),)))
    result = fence_for_autopilot(area, 10.0, inside=[ORIGIN])
    assert result.status is FenceStatus.NO_MARGIN
    assert "no keep-in zone fits" in result.reason


@pytest.mark.parametrize(("radius_deg", "is_too_large"), [(3.6, False), (4.6, True)])
def test_an_area_that_no_plane_holds_is_refused(radius_deg, is_too_large):
    area = Area(fence=Fence(zones=(keep_in(Circle(ORIGIN, radius_deg * 1.1e5)),)))
    result = fence_for_autopilot(area, 500.0, inside=[ORIGIN])
    assert (result.status is FenceStatus.TOO_LARGE) == is_too_large
    assert ("cut it up" in result.reason) == is_too_large


def test_a_refusal_names_what_most_items_go_to_with_how_many_each():
    rock = Obstacle(shape=Circle(LocalFrame(ORIGIN).geo_from_en(0.0, 100.0), 20.0), name="rock")
    lake = Area(obstacles=(rock,), fence=Fence(zones=(keep_in(island(0.0, 0.0, [500.0, 440.0] * 60).shape),)))
    result = fence_for_autopilot(lake, 5.0, inside=[ORIGIN])
    assert result.status is FenceStatus.TOO_MANY_ITEMS
    assert "limits (120), rock (1)" in result.reason


def test_what_fits_only_into_an_obstacles_own_margin_is_put_there():
    """At the mission's 5 m the stars do not fit; the planner keeps 60 m off each of them anyway."""
    roomy = tuple(Obstacle(shape=s.shape, name=s.name, margin_m=60.0) for s in stars(30))
    result = fence_for_autopilot(Area(obstacles=roomy), 5.0, inside=[ORIGIN])
    assert (result.status, result.reach_m) == (FenceStatus.OK, math.inf), result.reason
    check(result, Area(obstacles=roomy), 60.0, [ORIGIN])
    narrow = tuple(Obstacle(shape=s.shape, name=s.name, margin_m=1.0) for s in stars(8))
    result = fence_for_autopilot(Area(obstacles=narrow), 20.0, inside=[ORIGIN])
    assert (result.status, result.reach_m) == (FenceStatus.OK, math.inf), result.reason
    check(result, Area(obstacles=narrow), 20.0, [ORIGIN])


@pytest.mark.parametrize(("east_m", "says"), [(2998.0, "do not hold rock"), (3040.0, "")])
@pytest.mark.parametrize("turn", [0.0, 0.7, 1.6, 3.0, 4.5])
def test_a_rock_just_within_reach_of_the_way_is_missed_and_one_beyond_it_is_not(east_m, turn, says):
    frame = LocalFrame(ORIGIN)
    x, y = (east_m + 1.0) * math.sin(turn), (east_m + 1.0) * math.cos(turn)
    area = Area(obstacles=(Obstacle(shape=Circle(frame.geo_from_en(x, y), 1.0), name="rock"),))
    told = prove(area, (), 10.0, inside=[ORIGIN], reach_m=3000.0)
    assert says in told
    assert bool(told) == bool(says)


@pytest.mark.parametrize(
    ("radius_m", "says"),
    [
        (490.0, "do not hold"),
        (500.2, "do not hold"),  # a degree of latitude has 111 251 m there, on the autopilot's sphere 111 319
        (506.0, ""),
        (540.0, "beyond the planner"),
    ],
)
def test_a_circle_round_a_circle_allows_for_the_autopilots_other_earth(radius_m, says):
    """Its sphere has metres of another length: a circle of the very radius may leave some of the rock outside."""
    center = LocalFrame(ORIGIN).geo_from_en(0.0, 700.0)
    area = Area(obstacles=(Obstacle(shape=Circle(center, 500.0), name="bank"),))
    items, _ = zones_to_items((Zone(kind=ZoneKind.EXCLUSION, shape=Circle(center, radius_m)),))
    told = prove(area, items, 30.0, inside=[ORIGIN])
    assert says in told
    assert bool(told) == bool(says)


@pytest.mark.parametrize(("radius_m", "says"), [(1000.0, "is not inside"), (994.0, ""), (980.0, "shuts out water")])
def test_a_circle_inside_of_a_ring_allows_for_the_autopilots_other_earth(radius_m, says):
    area = Area(fence=Fence(zones=(keep_in(island(0.0, 0.0, [1000.0] * 360).shape),)))
    items, _ = zones_to_items((keep_in(Circle(ORIGIN, radius_m)),))
    told = prove(area, items, 15.0, inside=[ORIGIN])
    assert says in told
    assert bool(told) == bool(says)


@pytest.mark.parametrize(("goal_m", "says"), [(2995.0, ""), (3005.0, "goal 1 would be outside")])
@pytest.mark.parametrize("turn", [0.0, 1.6, 4.0])
def test_a_goal_a_few_metres_outside_of_a_large_circle_is_named(goal_m, turn, says):
    """A circle of 3 km was asked with the plane's error on top, ten metres: a goal that it shuts out was proved."""
    area = Area(fence=Fence(zones=(keep_in(island(0.0, 0.0, [3015.0] * 360).shape),)))
    items, _ = zones_to_items((keep_in(Circle(ORIGIN, 3000.0)),))
    along = GeoPoint(lat_deg=50.8 + math.cos(turn) * goal_m / AUTOPILOT_METRES_PER_DEGREE, lon_deg=-1.3)
    cosine = math.cos(math.radians(0.5 * (along.lat_deg + 50.8)))
    east_deg = math.sin(turn) * goal_m / AUTOPILOT_METRES_PER_DEGREE / cosine
    goal = GeoPoint(lat_deg=along.lat_deg, lon_deg=-1.3 + east_deg)
    told = prove(area, items, 40.0, inside=[ORIGIN, goal])
    assert says in told
    assert bool(told) == bool(says)


def test_a_fence_holds_a_long_shore_as_it_is_on_the_ground_too():
    """The planner's straight line of 8 km is a metre and a half from the one in degrees, which the autopilot draws."""
    frame, t = LocalFrame(ORIGIN), 8000.0
    for south_m, north_m in ((200.0, 900.0), (-900.0, -200.0)):
        ring = np.array([(-t / 2, south_m), (t / 2, south_m), (t / 2, north_m), (-t / 2, north_m)])
        area = Area(obstacles=(Obstacle(shape=Polygon(frame.array_lonlat_from_en(ring)), name="land"),))
        result = fence_for_autopilot(area, 15.0, inside=[ORIGIN])
        assert result.status is FenceStatus.OK, result.reason
        [zone] = result.zones
        assert shapely.covers(ground(zone.shape, frame), Polygon(ring))


def test_what_is_no_fence_at_all_is_told_as_the_fault_that_it_is():
    """A fault among sound items is not proved away, and what is only remarked upon is no fault."""
    rock = Obstacle(shape=Circle(LocalFrame(ORIGIN).geo_from_en(0.0, 100.0), 20.0), name="rock")
    items = fence_for_autopilot(Area(obstacles=(rock,)), 10.0, inside=[ORIGIN]).items
    none = MissionItem(command=Command.NAV_FENCE_CIRCLE_EXCLUSION, params=(0.0, 0.0, 0.0, 0.0))
    assert "radius is 0 m" in prove(Area(obstacles=(rock,)), (*items, none), 10.0, inside=[ORIGIN])
    crossing = Polygon([(179.9, -0.1), (180.1, -0.1), (180.1, 0.1), (179.9, 0.1)])
    wide = Polygon([(179.89, -0.11), (180.11, -0.11), (180.11, 0.11), (179.89, 0.11)])
    area = Area(fence=Fence(zones=(keep_in(wide),)))
    items, _ = zones_to_items((keep_in(crossing),))
    assert prove(area, items, 1500.0, inside=[GeoPoint(lat_deg=0.0, lon_deg=179.99)]) == ""


@pytest.mark.parametrize(("goal_deg", "says"), [(-179.995, ""), (-179.985, "goal 1 would be outside")])
@pytest.mark.parametrize("middle_deg", [179.999, -179.999])
def test_a_goal_over_the_date_line_is_as_near_as_it_is(middle_deg, goal_deg, says):
    """From 179.999 degrees to -179.995 are 6 thousandths of a degree, 668 m at the equator."""
    circle = keep_in(Circle(GeoPoint(lat_deg=0.0, lon_deg=middle_deg), 1000.0))
    inside = [GeoPoint(lat_deg=0.0, lon_deg=lon_deg) for lon_deg in (179.995, goal_deg)]
    area = Area(fence=Fence(zones=(keep_in(Circle(circle.shape.center, 1005.0)),)))
    told = prove(area, zones_to_items((circle,))[0], 15.0, inside=inside)
    assert says in told
    assert bool(told) == bool(says)


@pytest.mark.parametrize(
    ("lat_deg", "east_m", "north_m"),
    [(0.0, 111_320, 110_574), (30.0, 96_486, 110_852), (-45.0, 78_847, 111_132), (75.0, 28_902, 111_618)],
)
def test_a_degree_is_as_long_as_the_tables_of_wgs_84_have_it(lat_deg, east_m, north_m):
    assert metres_per_degree(lat_deg) == pytest.approx((east_m, north_m), abs=0.6)


def test_two_rocks_with_no_water_between_are_one_zone_that_holds_both():
    frame = LocalFrame(ORIGIN)
    rocks = tuple(
        Obstacle(shape=Circle(frame.geo_from_en(0.0, y), r), name=f"r{r:g}") for y, r in ((200.0, 20.0), (212.0, 15.0))
    )
    result = fence_for_autopilot(Area(obstacles=rocks), 10.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK, result.reason
    assert [z.name for z in result.zones] == ["r20 + r15"]
    assert result.used_m <= 4.0
    check(result, Area(obstacles=rocks), 10.0, [ORIGIN])


def test_a_circle_is_on_the_wires_lattice_and_no_larger_than_it_has_to_be():
    """Of 20 m and the 3 cm for rounding, 0.2 % for the other sphere, up to the next 5 cm."""
    for east_m in (0.0, 0.004, 0.008, 0.012):
        rock = Obstacle(shape=Circle(LocalFrame(ORIGIN).geo_from_en(east_m, 100.0), 20.0), name="rock")
        result = fence_for_autopilot(Area(obstacles=(rock,)), 10.0, inside=[ORIGIN])
        assert result.zones[0].shape.center == result.items[0].point
        assert result.zones[0].shape.radius_m == pytest.approx(20.1, abs=0.051)


def test_round_limits_are_one_circle_inside_of_them():
    area = Area(fence=Fence(zones=(keep_in(island(0.0, 0.0, [1000.0] * 360).shape),)))
    result = fence_for_autopilot(area, 20.0, inside=[ORIGIN])
    assert result.status is FenceStatus.OK, result.reason
    [zone] = result.zones
    assert isinstance(zone.shape, Circle)
    assert 980.0 < zone.shape.radius_m < 1000.0
    check(result, area, 20.0, [ORIGIN])


@pytest.mark.parametrize("margin_m", [6.0, 8.0, 10.0, 20.0])
def test_a_circle_sticks_out_no_more_than_is_said_where_the_autopilot_draws_it(margin_m):
    """Its sphere's metre is 1.002 m of easting at 50.8 degrees: 111 543 m by the ellipsoid, 111 319 by it."""
    result = fence_for_autopilot(Area(obstacles=(island(0.0, 1500.0, [600.0] * 360),)), margin_m, inside=[ORIGIN])
    assert result.status is FenceStatus.OK, result.reason
    [zone] = result.zones
    if isinstance(zone.shape, Circle):
        assert 1.002 * zone.shape.radius_m <= 600.0 + result.used_m
    assert isinstance(zone.shape, Circle) == (margin_m == 20.0)


@pytest.mark.parametrize(
    ("c", "d", "meet"),
    [
        ((2.0, 1.0), (2.0, 2.0), (2.0, 0.0)),
        ((0.5, 1.0), (0.5, 2.0), None),  # behind b
        ((2.0, 1.0), (2.0, 0.5), None),  # behind c
        ((2.0, 1.0), (0.0, 1.0), None),  # never
        ((2.0, 1.0), (4.0, 1.0), None),
        ((3.0, 1.0), (4.0, 2.0), (2.0, 0.0)),
    ],
)
def test_two_edges_meet_beyond_the_one_between_them_or_not_at_all(c, d, meet):
    assert _meeting((0.0, 0.0), (1.0, 0.0), c, d) == (meet if meet is None else pytest.approx(meet))


@pytest.mark.parametrize("inward", [True, False])
@pytest.mark.parametrize("tolerance", [0.5, 4.0, 20.0])
@pytest.mark.parametrize("seed", range(6))
def test_a_thinned_shape_is_between_the_shape_and_two_thirds_of_the_tolerance_beyond(seed, tolerance, inward):
    rng = np.random.default_rng(seed)
    t = 2.0 * np.pi * np.arange(700) / 700
    r = 300.0 + 60.0 * np.sin(5.0 * t + seed) + rng.uniform(0.0, 4.0, 700)
    shape = Polygon(np.column_stack([r * np.cos(t), r * np.sin(t)]))
    thin = _thinned(shape, tolerance, inward=inward)
    small, large = (thin, shape) if inward else (shape, thin)
    assert shapely.covers(large, small)
    most = shapely.buffer(shape, (-1.0 if inward else 1.0) * tolerance / 1.5, quad_segs=30)
    assert shapely.covers(thin, max(shapely.get_parts(most), key=lambda p: p.area)) if inward else most.covers(thin)
    assert thin.is_valid
    assert len(thin.exterior.coords) < (701 if tolerance < 4.0 else 600 if tolerance < 20.0 else 150)
