"""From drawn items to a voyage: what ArduPilot would sail, in that order, and everything else refused by name."""

import math
from dataclasses import replace
from pathlib import Path

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from companion.errors import InputError
from companion.geofence import ZoneKind, load_mission, read
from companion.geofence.mission import (
    MissionOptions,
    drawing_of,
    drawn_mission,
    load_settings,
    mission_files,
    offer,
    read_stored,
    stored_text,
)
from companion.geofence.mission.autopilot_mission import MAX_GOALS, course_of, tag
from companion.messages import Command, GeoPoint, MissionItem

LAT, LON = 50.82, -1.31


def item(north=0.0, east=0.0, command=16, p1=0.0, p2=0.0, frame=3):
    """An item, in hundredths of a degree from the place where all is drawn."""
    return MissionItem(
        command=command,
        lat_e7=round((LAT + north / 100) * 1e7),
        lon_e7=round((LON + east / 100) * 1e7),
        frame=frame,
        params=(p1, p2, 0.0, 0.0),
    )


def order(command, p1=0.0, p2=0.0):
    return MissionItem(command=command, frame=2, params=(float(p1), float(p2), 0.0, 0.0))


A, B, C = item(0.1), item(0.2), item(0.2, 0.1)
RTL = order(20)
RING = [item(n, e, 5001, 4.0, frame=0) for n, e in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
ROCK = item(0.15, 0.05, 5004, 20.0, frame=0)


def numbers(*items):
    course = course_of(items)
    assert course.findings == ()
    return [s.number for s in course.stops] * course.laps


def refusals(*items):
    return [f.line("drawing") for f in course_of(items).refusals]


def test_waypoints_are_goals_in_order_and_the_last_item_is_the_end():
    assert numbers(A, B, C) == [1, 2, 3]
    assert course_of([A, B]).end is None
    assert course_of([A, B, RTL]).end == "home"
    assert numbers(A, B, RTL) == [1, 2]
    stay = item(0.3, command=17)
    assert course_of([A, stay]).end == "loiter"
    assert numbers(A, stay) == [1, 2]


def test_a_loiter_for_a_time_at_the_end_is_a_station_and_said_to_last():
    course = course_of([A, item(0.3, command=19, p1=60.0)])
    assert (course.end, course.station_s, course.refusals) == ("loiter", 60.0, ())
    assert "stays until told" in course.findings[0].text


def test_jumps_are_laps_as_ardupilot_counts_them():
    course = course_of([A, B, order(177, 1, 3)])
    assert (len(course.stops), course.laps) == (2, 4)
    assert numbers(A, B, order(177, 1, 1), C) == [1, 2, 1, 2, 4]
    assert numbers(A, B, order(177, 2, 2), C, RTL) == [1, 2, 2, 2, 4]
    assert numbers(A, order(177, 1, 0), B) == [1, 3]
    # the inner one is used up when the outer one comes by again
    assert numbers(A, order(177, 1, 2), B, order(177, 1, 1)) == [1, 1, 1, 3, 1, 3]


@pytest.mark.parametrize(
    ("items", "stays"),
    [
        ([item(0.1, command=19, p1=30.0), B], [30.0, 0.0]),
        ([A, item(0.2, p1=5.0), RTL], [0.0, 5.0]),
        ([A, item(0.2, command=19, p1=30.0)], [0.0, 0.0]),  # the end keeps her
        ([A, item(0.2, command=19, p1=30.0), order(177, 1, 1)], [0.0, 30.0]),  # of each lap
        ([A, item(0.2, command=19, p1=-5.0), B], [0.0, 0.0, 0.0]),
    ],
)
def test_a_loiter_for_a_time_and_a_hold_are_a_stay(items, stays):
    course = course_of(items)
    assert not course.refusals
    assert [stop.stay_s for stop in course.stops] == stays
    for stop in course.stops:
        goal = stop.goal("x")
        assert getattr(goal, "for_s", None) == (stop.stay_s or None)
        if stop.stay_s:
            box = shapely.from_wkt(goal.polygon)
            assert box.covers(shapely.Point(stop.point.lon_deg, stop.point.lat_deg))
            area_m2 = box.area * 111_320.0**2 * math.cos(math.radians(stop.point.lat_deg))
            assert area_m2 == pytest.approx(2500.0, rel=0.02)


@pytest.mark.parametrize(
    ("items", "words"),
    [
        (
            [A, order(178, 1, 3), B, order(183), item(0.1, command=82), order(30000)],
            [
                "item 2: error: DO_CHANGE_SPEED is nothing",
                "item 4: error: DO_SET_SERVO is nothing",
                "item 5: error: NAV_SPLINE_WAYPOINT is nothing",
                "item 6: error: command 30000 is nothing",
            ],
        ),
        ([A, order(177, 2, 1)], ["item 2: error: DO_JUMP jumps to itself"]),
        ([A, order(177, 1, -1)], ["item 2: error: DO_JUMP repeats without end (-1); write how often"]),
        ([A, order(177, 9, 1)], ["item 2: error: DO_JUMP jumps to item 9, which is not there"]),
        ([A, order(177, 0, 1)], ["item 2: error: DO_JUMP jumps to item 0, which is not there"]),
        ([order(177, 3, 1), A, B], ["item 1: error: DO_JUMP jumps forward to item 3"]),
        ([A, order(177, 1, 5000)], ["item 2: error: DO_JUMP repeats 5000 times; write fewer"]),
        (
            [A, order(177, 1, 900), order(177, 1, 900)],
            ["item 3: error: with this DO_JUMP the voyage has more than 1000"],
        ),
        ([replace(order(16), frame=3), A], ["item 1: error: NAV_WAYPOINT has no place (0, 0)"]),
        ([A, replace(B, frame=1)], ["item 2: error: NAV_WAYPOINT is in frame 1"]),
        ([item(0.1, command=18, p1=2.0)], ["item 1: error: NAV_LOITER_TURNS: a sailboat does not sail circles"]),
        ([A, item(0.2, command=17), B], ["item 3: error: stands behind item 2 (NAV_LOITER_UNLIM)"]),
        ([A, RTL, B], ["item 3: error: stands behind item 2 (NAV_RETURN_TO_LAUNCH)"]),
    ],
)
def test_what_cannot_be_sailed_is_refused_by_name_and_number_all_of_it(items, words):
    said = refusals(*items)
    assert len(said) == len(words)
    for line, word in zip(said, words, strict=True):
        assert line.startswith("drawing: " + word)
        assert "; " in line, "a remedy"


_ANY = st.floats(allow_nan=False, allow_infinity=False, width=32)
_ITEMS = st.builds(
    lambda command, p1, p2, north, frame: MissionItem(
        command=command,
        lat_e7=north and 508_000_000 + north,
        lon_e7=-13_000_000 if north else 0,
        frame=frame,
        params=(p1, p2, 0.0, 0.0),
    ),
    st.sampled_from([16, 16, 16, 17, 18, 19, 20, 177, 177, 178, 93]),
    st.one_of(st.integers(-2, 12).map(float), _ANY),
    st.one_of(st.integers(-1, 1100).map(float), _ANY),
    st.integers(0, 1000),
    st.sampled_from([0, 1, 2, 3, 6]),
)


@given(st.lists(_ITEMS, max_size=12))
def test_any_list_ends_in_bounded_goals_or_a_refusal(items):
    course = course_of(items)
    assert len(course.stops) * course.laps <= max(MAX_GOALS, len(items)) + 1
    assert all(f.place.startswith("item ") for f in course.findings)
    if not course.refusals and not any(i.command == Command.DO_JUMP for i in items):
        drawn = [n for n, i in enumerate(items, start=1) if i.command != Command.NAV_RETURN_TO_LAUNCH]
        assert [s.number for s in course.stops] == drawn, "nothing is passed over in silence"
    offer(items, adopts=True)


# ---------------------------------------------------------------------------------------- the whole drawing
def judged(items, fence=(), rally=(), settings=None, path=Path("plan.plan")):
    return drawn_mission(
        drawing_of(items, fence, rally), settings or MissionOptions(from_autopilot=True), path, Path("plan.plan")
    )


def lines(drawn):
    assert drawn.mission is None
    return [f.line("drawing") for f in drawn.refusals]


def test_fence_and_rally_points_are_area_and_refuges():
    drawn = judged([A, B, RTL], [*RING, ROCK], [item(0.05, command=5100)])
    mission = drawn.mission
    assert [(g.name, g.point) for g in mission.goals] == [("item 1", A.point), ("item 2", B.point)]
    assert mission.skipper.end == "home"
    assert [r.name for r in mission.refuges] == ["rally 1"]
    assert [z.kind for z in mission.area.fence.zones] == [ZoneKind.INCLUSION]
    assert len(mission.area.obstacles) == 1
    assert drawn.notes == ()
    assert mission.operator == MissionOptions().operator, "nothing is permitted that nobody has permitted"


def test_without_a_fence_it_is_said_that_nothing_limits_the_water():
    drawn = judged([A])
    assert drawn.mission is not None
    assert "there is no fence to stay inside of" in drawn.notes[0].text


@pytest.mark.parametrize(
    ("items", "fence", "rally", "words"),
    [
        ([], [], [], ["there is no mission on the autopilot; draw"]),
        ([], RING, [], ["there is no mission on the autopilot, only a fence; draw"]),
        ([RTL], [], [], ["it leads nowhere: there is no waypoint"]),
        (
            [A, item(3.0), item(0.15, 0.05)],
            [*RING, ROCK],
            [item(2.0, command=5100)],
            [
                "item 2: error: 50.850000, -1.310000 is outside the fence; change the drawing and upload",
                "item 3: error: 50.821500, -1.309500 is inside the obstacle",
                "rally point 1: error: 50.840000",
            ],
        ),
        ([A, item(1000.0)], [], [], ["item 2: error: is 111"]),
        (
            [A, order(178)],
            [*RING[:2], ROCK],
            [order(5100)],
            [
                "fence item 1: error: the polygon announces 4 vertices and 2 follow",
                "item 2: error: DO_CHANGE_SPEED",
                "rally point 1: error: has no place",
            ],
        ),
    ],
)
def test_a_drawing_is_refused_line_by_line(items, fence, rally, words):
    said = lines(judged(items, fence, rally))
    assert len(said) == len(words), said
    for line, word in zip(said, words, strict=True):
        assert word in line


def test_the_settings_of_a_file_hold_and_its_own_obstacles_stand(tmp_path):
    (tmp_path / "rock.wkt").write_text(
        "POLYGON ((-1.3105 50.8205, -1.3095 50.8205, -1.3095 50.8215, -1.3105 50.8215, -1.3105 50.8205))"
    )
    path = tmp_path / "boat.toml"
    path.write_text(
        'from_autopilot = true\n[area]\nobstacles = ["rock.wkt"]\nmargin_m = 7.0\n[operator]\n'
        'set_auto = true\n[skipper]\nend = "home"\n'
    )
    settings = load_settings(path)
    drawn = judged([A, B], settings=settings, path=path)
    (line,) = lines(drawn)
    assert line == (
        "drawing: item 1: error: 50.821000, -1.310000 is inside the obstacle 'obstacle 1'; "
        "change the drawing and upload it again"
    )
    mission = judged([B, C], settings=settings, path=path).mission
    assert mission.name.startswith("boat ")
    assert (mission.margin_m, mission.operator.set_auto, mission.skipper.end) == (7.0, True, "home")
    assert judged([B, item(0.3, command=17)], settings=settings, path=path).mission.skipper.end == "loiter"


def test_a_drawn_mission_has_no_goals_of_its_own_and_says_how_it_is_sailed(tmp_path):
    path = tmp_path / "m.toml"
    path.write_text("from_autopilot = true\n[[goal]]\nlat = 50.0\nlon = 1.0\n")
    with pytest.raises(InputError, match=r"\[\[goal\]\]: the goals are those that are drawn on the autopilot; take"):
        load_settings(path)
    path.write_text("from_autopilot = true\n")
    with pytest.raises(InputError, match=r"from_autopilot: the goals of this mission are drawn .*companion run"):
        load_mission(path)


def test_what_is_kept_is_the_drawing_and_two_drawings_are_two_voyages(tmp_path):
    document = drawing_of(
        [A, B, order(177, 1, 2), C, RTL], [*RING, ROCK], [item(0.05, command=5100)], GeoPoint(lat_deg=LAT, lon_deg=LON)
    )
    written = stored_text(document)
    back = read_stored(written.data.decode(), "kept.plan")
    assert back.items == document.items
    assert back.home == document.home
    assert tag(back) == tag(document)
    assert tag(back) != tag(drawing_of([A, B, C], [], []))
    (tmp_path / "d.plan").write_bytes(written.data)
    again = drawn_mission(back, MissionOptions(), tmp_path, tmp_path / "d.plan").mission
    first = drawn_mission(document, MissionOptions(), tmp_path, tmp_path / "d.plan").mission
    assert again == first
    assert read(tmp_path / "d.plan").zones == back.zones


def test_a_plan_from_a_file_and_from_the_autopilot_are_one_voyage(tmp_path):
    """One conversion: what ``mission new --from`` makes of the kept .plan is what is sailed."""
    document = drawing_of([A, B, order(177, 1, 2), item(0.3, command=17)], [*RING, ROCK], [item(0.05, command=5100)])
    made = mission_files(document, "m")
    (tmp_path / "m.toml").write_bytes(made.toml)
    for name, data in made.files.items():
        (tmp_path / name).write_bytes(data)
    from_file, drawn = load_mission(tmp_path / "m.toml"), judged(document.items, [*RING, ROCK], document.rally).mission
    assert [g.point for g in from_file.goals] == [g.point for g in drawn.goals]
    assert from_file.skipper == drawn.skipper
    assert [r.point for r in from_file.refuges] == [r.point for r in drawn.refuges]


def test_the_offer_says_how_many_items_and_what_is_in_the_way():
    assert offer([A, B, C, A, B], adopts=True) == "a mission of 5 items was drawn: adopt it by the order adopt"
    assert offer([A], adopts=False) == "a mission of 1 item was drawn: companion run --from-autopilot sails such"
    assert offer([A, order(178)], adopts=True) == (
        "a mission of 2 items was drawn that cannot be adopted: item 2: DO_CHANGE_SPEED is nothing that a voyage does"
    )
    assert offer([RTL], adopts=True) == "a mission of 1 item was drawn that cannot be adopted: it leads nowhere"
