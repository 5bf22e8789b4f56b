"""The autopilot's own fence, around home and drawn: when it counts, what it leaves, and what the boat does about it."""

import math

import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import AutopilotLimits
from companion.geofence import Circle as Ring
from companion.geofence import Zone, ZoneKind
from companion.messages import AutopilotStatus, Command, Mode
from companion.skipper.step import actions as act
from companion.skipper.step.state import Phase
from companion.skipper.way.autopilot_fence import OUTSIDE_M, Drawn, HomeCircle, circle_of, drawn_of
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal, outside_m, water_at
from tests.skipper.test_voyage import make, said
from tests.skipper.world import FRAME, area, voyage

HOME = FRAME.geo_from_en(0.0, 0.0)
FAR = Goal(en_m=(0.0, 300.0), radius_m=8.0, name="Far")
NEAR = Goal(en_m=(0.0, 120.0), radius_m=8.0, name="Near")
ON = {"FENCE_ENABLE": 1.0, "FENCE_TYPE": 6.0, "FENCE_RADIUS": 150.0, "FENCE_ACTION": 1.0}


def status(**shown):
    return AutopilotStatus(t_s=0.0, home=HOME, **shown)


@pytest.mark.parametrize(
    ("params", "shown", "counts"),
    [
        ({}, {}, True),
        ({}, {"fence_breached": False}, True),
        ({"FENCE_ENABLE": 0.0}, {"fence_breached": False}, True),  # switched on until the next reboot
        ({"FENCE_ENABLE": 0.0}, {}, False),
        ({"FENCE_TYPE": 4.0}, {}, False),
        ({"FENCE_ACTION": 0.0}, {}, False),  # only a report
    ],
)
def test_it_counts_where_the_autopilot_would_act(params, shown, counts):
    limits = AutopilotLimits.from_params({**ON, **params})
    assert (circle_of(voyage(), limits, status(**shown), (0.0, 0.0)) is not None) is counts
    assert circle_of(voyage(), limits, None, (0.0, 0.0)) is None


def test_a_circle_that_the_autopilot_does_not_complain_of_is_not_where_we_believe():
    limits, outside = AutopilotLimits.from_params(ON), (0.0, 150.0 + OUTSIDE_M + 1.0)
    assert circle_of(voyage(), limits, status(fence_breached=False), outside) is None
    assert circle_of(voyage(), limits, status(fence_breached=True), outside) is not None
    for north_m in (150.0 - 3.0, 150.0 + OUTSIDE_M - 2.0):  # at its edge a fix may err: it counts
        assert circle_of(voyage(), limits, status(fence_breached=False), (0.0, north_m)) is not None
    assert circle_of(voyage(), limits, status(fence_breached=False), None) is not None


@pytest.mark.parametrize(("radius_m", "is_kept"), [(0.4, False), (2.0, True)])
def test_a_circle_with_nothing_inside_is_none(radius_m, is_kept):
    limits = AutopilotLimits.from_params({**ON, "FENCE_RADIUS": radius_m})
    assert (circle_of(voyage(), limits, status(), (0.0, 0.0)) is not None) is is_kept


@settings(max_examples=60)
@given(st.floats(-300.0, 300.0), st.floats(-300.0, 300.0), st.floats(0.0, 2.0 * math.pi))
def test_home_wherever_it_is_the_circle_is_inside_of_the_autopilots_by_no_more_than_a_metre(east_m, north_m, course):
    home = AutopilotStatus(t_s=0.0, home=FRAME.geo_from_en(east_m, north_m))
    circle = circle_of(voyage(), AutopilotLimits.from_params(ON), home, (east_m, north_m))
    assert circle is not None
    for off_m, is_inside in ((151.0, False), (148.9, True)):
        place = (east_m + off_m * math.sin(course), north_m + off_m * math.cos(course))
        assert (circle.inside_m(place) >= 0.0) is is_inside
    assert circle.most_room_m == pytest.approx(75.0, abs=1.0)


@settings(max_examples=60)
@given(st.floats(20.0, 2000.0), st.floats(0.0, 2.0 * math.pi), st.floats(0.0, 3.0))
def test_what_it_leaves_is_inside_of_it_and_nearly_all_of_it(radius_m, course, share):
    circle = HomeCircle(en_m=(30.0, -20.0), radius_m=radius_m)
    place = (30.0 + share * radius_m * math.sin(course), -20.0 + share * radius_m * math.cos(course))
    left = area().within(circle.en_m, circle.radius_m, circle.words)
    room = float(left.clearance_m([place])[0])
    assert room <= circle.inside_m(place) + 1e-6
    assert room >= circle.inside_m(place) - 0.002 * radius_m
    assert left.nearest_name(place) == circle.words


def test_the_mission_s_own_fence_and_obstacles_still_count():
    plain = area(shapely.box(-10.0, 90.0, 10.0, 110.0), limits=shapely.box(-100.0, -100.0, 100.0, 400.0))
    both = plain.within((0.0, 0.0), 150.0, "the circle")
    assert float(both.clearance_m([(0.0, 100.0)])[0]) == float(plain.clearance_m([(0.0, 100.0)])[0])
    assert float(both.clearance_m([(95.0, 0.0)])[0]) == pytest.approx(5.0)
    assert float(both.clearance_m([(0.0, 145.0)])[0]) == pytest.approx(5.0, abs=0.3)
    assert both.nearest_name((0.0, 145.0)) == "the fence or the circle"
    assert both.buffered(5.0) is plain.buffered(5.0)  # what was computed of a coast is not computed again
    assert plain.within((0.0, 0.0), 150.0, "the circle") is both


def test_outside_the_limits_only_the_obstacles_are_in_the_way():
    water = area(shapely.box(-10.0, 190.0, 10.0, 210.0)).within((0.0, 0.0), 150.0, "the circle")
    assert outside_m(water, (0.0, 160.0)) == pytest.approx(10.0, abs=0.2)
    assert float(water_at(water, (0.0, 160.0)).clearance_m([(0.0, 160.0)])[0]) == pytest.approx(30.0)
    assert water_at(water, (0.0, 100.0)) is water
    assert outside_m(water, (0.0, 100.0)) == 0.0


def test_outside_the_autopilots_fence_the_missions_own_is_still_in_the_way():
    """It may be the shore: planned back from outside of a fence drawn anew she passed it by 2 m."""
    mission = area(shapely.box(-10.0, 190.0, 10.0, 210.0), limits=shapely.box(-200.0, -200.0, 200.0, 400.0))
    water = mission.within((0.0, 0.0), 150.0, "the circle")
    water = water.without(shapely.box(-40.0, -40.0, 0.0, 40.0), "the drawn")
    assert water_at(water, (170.0, 0.0)) is mission
    assert water_at(water, (-20.0, 0.0)) is mission.within((0.0, 0.0), 150.0, "the circle")
    assert water_at(water, (230.0, 0.0)) is mission.unfenced


def fenced(*goals, **made):
    world = make(*goals, obstacles=(), **made)
    world.shown = {"home": HOME, "fence_breached": False}
    return world


def test_she_does_not_set_sail_for_a_goal_outside_of_it_and_does_once_it_is_gone():
    world = fenced(NEAR, FAR, circle_m=150.0)
    world.run(90)
    assert not world.state.voyage.sailing
    assert world.state.phase is Phase.WAITING
    assert "Far is 300 m from home, outside the autopilot's fence of 150 m" in world.state.why
    assert "FENCE_TYPE 4" in said(world, "fenced off")[0][2]
    world.circle_m = None
    assert world.run(60, lambda w: w.state.voyage.sailing)


def test_set_under_way_she_waits_inside_and_sails_on_when_it_is_widened():
    world = fenced(NEAR, FAR)
    assert world.run(120, lambda w: w.state.progress.reached == (0,))
    world.circle_m = 200.0
    assert world.run(200, lambda w: "Far is 300 m" in w.state.why and w.mission[-1].command is Command.NAV_LOITER_UNLIM)
    world.run(300)
    assert max(distance_m(p, (0.0, 0.0)) for p in world.track[-250:]) < 200.0
    world.circle_m = 1000.0
    assert world.run(600, lambda w: w.state.progress.reached == (0, 1))


def test_outside_of_one_that_is_set_under_way_she_is_brought_back_in_and_kept_there():
    world = fenced(FAR)
    assert world.run(200, lambda w: w.position[1] > 200.0)
    world.circle_m = 150.0
    world.shown["fence_breached"] = True
    world.set_mode(Mode.RTL)
    world.run(3)
    assert world.state.operator.answering == "fence"
    assert world.run(200, lambda w: distance_m(w.position, (0.0, 0.0)) < 110.0)
    world.shown["fence_breached"] = False
    before = world.uploads
    world.run(300)
    assert world.state.phase is Phase.HOLDING
    assert distance_m(world.position, (0.0, 0.0)) < 150.0
    assert world.uploads - before <= 2


# ------------------------------------------------------------------------------------------------------ drawn
MARGIN_M = 15.0


def zone(kind, *corners):
    points = [FRAME.geo_from_en(*corner) for corner in corners]
    return Zone(kind=kind, shape=shapely.Polygon([(p.lon_deg, p.lat_deg) for p in points]))


def square(kind, x0, y0, x1, y1):
    return zone(kind, (x0, y0), (x1, y0), (x1, y1), (x0, y1))


IN, OUT = ZoneKind.INCLUSION, ZoneKind.EXCLUSION
BAY = {"limits": shapely.box(-200.0, -200.0, 200.0, 400.0)}
ROCK = shapely.box(-10.0, 190.0, 10.0, 210.0)


@pytest.mark.parametrize(
    ("zones", "takes"),
    [
        ((square(IN, -200, -200, 200, 400),), False),  # the mission's own edge ...
        ((square(IN, -190, -190, 190, 390),), False),  # ... or within the margin of it
        ((square(IN, -200, -200, 200, 400), square(OUT, -20, 180, 20, 220)), False),  # and round its rock
        ((square(IN, -900, -900, 900, 900),), False),
        ((square(IN, -170, -190, 190, 390),), True),
        ((square(IN, -200, -200, 200, 100),), True),
        ((square(IN, -200, -200, 200, 400), square(OUT, -60, 180, 20, 220)), True),
        ((square(OUT, 100, 100, 120, 120),), True),
        ((Zone(kind=IN, shape=Ring(HOME, 100.0)),), True),
    ],
)
def test_only_what_takes_water_that_the_margin_leaves_counts(zones, takes):
    drawn = drawn_of(area(ROCK, **BAY), zones, None, MARGIN_M, is_off=False)
    assert (drawn is not None) is takes
    assert drawn_of(area(ROCK, **BAY), zones, None, MARGIN_M, is_off=True) is None
    assert drawn_of(area(ROCK, **BAY), zones, AutopilotLimits(fence_polygons=False), MARGIN_M, is_off=False) is None


@pytest.mark.parametrize("limits", [BAY, {}])
def test_what_it_leaves_keeps_inside_of_it_and_all_else_as_it_was(limits):
    plain = area(ROCK, **limits)
    drawn = drawn_of(plain, (square(IN, -300, -300, 300, 150),), None, MARGIN_M, is_off=False)
    assert drawn is not None
    for place, inside_m in (((0.0, 100.0), 50.0), ((0.0, 145.0), 5.0), ((100.0, 160.0), -10.0)):
        assert drawn.inside_m(place) == pytest.approx(inside_m, abs=0.2)
        assert float(drawn.left.clearance_m([place])[0]) == pytest.approx(inside_m, abs=0.2)
    assert drawn.left.nearest_name((0.0, 145.0)).endswith(Drawn.words)
    assert drawn.left.buffered(5.0) is plain.buffered(5.0)
    if limits:
        assert float(drawn.left.clearance_m([(190.0, 0.0)])[0]) == float(plain.clearance_m([(190.0, 0.0)])[0])
        # nor is the band along the shore that the margin keeps out of a way round what was drawn
        assert float(drawn.left.clearance_m([(195.0, 160.0)])[0]) < 0.0
    assert outside_m(drawn.left, (0.0, 160.0)) == pytest.approx(10.0, abs=0.2)
    east, north = drawn.place_inside(drawn.left, (0.0, 160.0), 30.0)
    assert (east, north) == pytest.approx((0.0, 118.0), abs=4.0)
    assert drawn_of(plain, (square(IN, -300, -300, 300, 150),), None, MARGIN_M, is_off=False) is not drawn
    assert plain.without(drawn.taken, Drawn.words) is drawn.left  # which is worked out once


@pytest.mark.parametrize(
    ("way", "is_cut"),
    [
        ([(0.0, 100.0), (0.0, 300.0)], True),
        ([(0.0, 100.0), (100.0, 100.0), (100.0, 300.0)], True),
        ([(0.0, 100.0), (100.0, 100.0)], False),
        ([(0.0, 300.0), (0.0, 350.0)], False),  # from within what is taken she sails on her way out
        ([(0.0, 100.0)], False),
    ],
)
def test_a_way_is_cut_where_it_leads_into_what_is_taken(way, is_cut):
    drawn = drawn_of(area(**BAY), (square(IN, -300, -300, 300, 200),), None, MARGIN_M, is_off=False)
    assert drawn.cuts(way) is is_cut


def test_how_far_a_place_is_from_what_is_taken_counts_to_its_very_edge():
    taken = shapely.box(0.0, 0.0, 100.0, 50.0)
    drawn = Drawn(taken=taken, left=area(**BAY))
    assert [drawn.inside_m((x, 25.0)) for x in (-0.5, -3.0, 0.5, 3.0)] == pytest.approx([0.5, 3.0, -0.5, -3.0])


def test_she_does_not_set_sail_for_a_goal_outside_of_what_is_drawn():
    world = fenced(NEAR, FAR, extra={"fence": (square(IN, -300, -300, 300, 200),)})
    world.run(90)
    assert not world.state.voyage.sailing
    assert "Far is outside the fence that is drawn on the autopilot" in world.state.why
    assert said(world, "fence drawn")
    world.extra = {}
    assert world.run(60, lambda w: w.state.voyage.sailing)


def test_drawn_under_way_she_waits_inside_and_sails_on_when_it_is_drawn_wider():
    """A person's fence was never read: she sailed on to a mark outside of it."""
    world = fenced(NEAR, FAR)
    assert world.run(120, lambda w: w.state.progress.reached == (0,))
    world.extra = {"fence": (square(IN, -300, -300, 300, 240),)}
    assert world.run(200, lambda w: "Far is outside" in w.state.why)
    world.run(300)
    assert max(p[1] for p in world.track[-480:]) < 240.0
    world.extra = {"fence": (square(IN, -300, -300, 300, 400),)}
    assert world.run(600, lambda w: w.state.progress.reached == (0, 1))


def test_drawn_across_her_way_she_goes_round_and_a_fence_that_is_switched_off_is_forgotten():
    world = fenced(FAR)
    assert world.run(120, lambda w: w.state.voyage.sailing and w.position[1] > 40.0)
    keep_out = square(OUT, 100, 60, 160, 140)
    world.extra = {"fence": (keep_out,)}
    assert world.run(600, lambda w: w.state.progress.reached == (0,))
    solid = shapely.box(100.0, 60.0, 160.0, 140.0)
    assert min(shapely.distance(solid, shapely.points(p)) for p in world.track) > 5.0
    assert any("cuts the way" in a.text for _, a in world.actions if isinstance(a, act.RequestPlan))
    world = fenced(FAR, extra={"fence": (square(IN, -300, -300, 300, 200),)})
    world.run(20)
    assert "Far is outside" in world.state.why
    world.shown |= {"fence_breached": None, "fence_on": False}
    assert world.run(60, lambda w: w.state.voyage.sailing)


@pytest.mark.parametrize(
    ("rocks", "east_m"),
    [
        ((), 130.0),  # as far out as there is room of 20 m within a circle of 150
        ((shapely.box(100.0, -50.0, 300.0, 50.0),), 80.0),  # by steps of 5 m on the way home until a rock is 20 m off
        ((shapely.box(1.0, -50.0, 300.0, 50.0),), 0.0),  # no such place: home itself
    ],
)
def test_the_place_inside_is_on_the_way_home_with_room_about_it(rocks, east_m):
    circle = HomeCircle(en_m=(0.0, 0.0), radius_m=150.0)
    place = circle.place_inside(area(*rocks), (400.0, 0.0), 20.0)
    assert place == (pytest.approx(east_m, abs=1e-6), pytest.approx(0.0, abs=1e-6))
    assert circle.place_inside(area(*rocks), (30.0, 0.0), 20.0)[0] <= 10.0 + 1e-6  # not beyond where the boat is


@pytest.mark.parametrize(
    ("east_m", "says"),
    [
        (140.0, ""),
        (141.0, "less than 10 m inside"),
        (149.5, "less than 10 m inside"),
        (151.0, "151 m from home, outside"),
    ],
)
def test_a_place_too_near_to_the_circle_is_named_with_its_remedy(east_m, says):
    told = HomeCircle(en_m=(0.0, 0.0), radius_m=150.0).trouble("goal 1", (east_m, 0.0), 10.0)
    assert says in told
    assert bool(told) == bool(says)
    assert not told or "FENCE_RADIUS widens it" in told
