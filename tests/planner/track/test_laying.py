"""What a change to a path may cost, where corners are pushed to, what another search may spend: number by number."""

import math
import sys
from dataclasses import dataclass, field, replace
from types import SimpleNamespace

import numpy as np
import pytest
import shapely

from companion.boat.tracking import SHORT_S
from companion.planner.effort import Effort, Outcome
from companion.planner.problem.evaluate import evaluate
from companion.planner.track import kept
from companion.planner.track.expected import (
    ExpectedTrack,
    _boards,
    _nearest_of_each,
    _worst_boards,
    curve_mps,
    expected,
)
from companion.planner.track.kept import (
    AT_MOST,
    FOR_AN_ARC,
    _on,
    _pushed,
    _pushes,
    _sailed_s,
    _straighter,
    laid,
    meeting,
    roomier,
    with_track,
)
from tests.planner.track.test_track import BEAT, FLOOR_M, channel, problem

OPEN = problem([])
LEAST_M = SHORT_S * float(np.max(curve_mps(OPEN)))  # a leg that is shorter cannot be followed
SAILED = evaluate(OPEN, [(0.0, 0.0), (0.0, 190.0)])


class Times:
    """A judge that knows how long each path takes, by its count of waypoints or as a whole; all others are no paths."""

    def __init__(self, times_s):
        self.times_s, self.asked = times_s, []

    def __call__(self, path):
        self.asked.append(tuple(path))
        took_s = self.times_s.get(tuple(path), self.times_s.get(len(path)))
        return replace(SAILED, is_feasible=took_s is not None, time_s=math.inf if took_s is None else took_s, legs=())


# ------------------------------------------------------------------------------------ what a change may cost
CORNER = ((0.0, 0.0), (2.0, 95.0), (0.0, 190.0))


@pytest.mark.parametrize(("took_s", "goes"), [(100.99, True), (101.01, False)])
def test_a_corner_between_long_legs_goes_for_six_thousandths_of_the_time_and_four_tenths(took_s, goes):
    path, _ = laid(OPEN, list(CORNER), Times({CORNER: 100.0, 2: took_s}))
    assert len(path) == (2 if goes else 3)


@pytest.mark.parametrize(("took_s", "goes"), [(104.98, True), (105.02, False)])
def test_a_leg_that_cannot_be_followed_goes_for_three_hundredths_of_the_time_and_two_seconds(took_s, goes):
    path = ((0.0, 0.0), (0.0, 95.0), (5.0, 100.0), (5.0, 190.0))
    found, _ = laid(OPEN, list(path), Times({path: 100.0, 3: took_s}))
    assert len(found) == (3 if goes else 4)


def staircase(arcs):
    """North, and a short leg to the right; of legs as long as that they are two hundred metres."""
    path = [(0.0, 0.0)]
    for _ in range(arcs):
        east, north = path[-1]
        path += [(east, north + 200.0), (east + 5.0, north + 205.0)]
    return (*path, (path[-1][0], path[-1][1] + 200.0))


@pytest.mark.parametrize(("took_s", "left"), [(106.98, 4), (107.02, 5)])
def test_for_each_arc_of_short_legs_there_are_two_seconds_more(took_s, left):
    path = staircase(2)
    found, _ = laid(OPEN, list(path), Times({path: 100.0, 5: 104.9, 4: took_s}))
    assert len(found) == left


def test_short_legs_on_end_are_one_arc():
    path = ((0.0, 0.0), (0.0, 95.0), (3.0, 100.0), (6.0, 105.0), (6.0, 190.0))
    found, _ = laid(OPEN, list(path), Times({path: 100.0, 4: 105.02, 3: 105.02}))
    assert len(found) == 5


def test_none_of_the_changes_makes_a_path_longer_than_it_may_be():
    found, _ = laid(OPEN, list(CORNER), Times({CORNER: 100.0, 2: 100.5}), within_s=100.4)
    assert len(found) == 3


def test_a_path_is_changed_so_many_times_at_the_most_and_more_often_for_its_arcs():
    long = [(30.0 * (n % 2), 100.0 * n) for n in range(120)]
    asked = Times({tuple(long): 100.0})
    laid(OPEN, long, asked)
    assert len(asked.asked) == 1 + AT_MOST
    stairs = staircase(12)
    asked = Times({stairs: 100.0})
    laid(OPEN, list(stairs), asked)
    assert AT_MOST + 1 < len(asked.asked) <= 1 + AT_MOST + 12 * FOR_AN_ARC


def test_what_is_no_path_stays_as_it_is():
    judge = Times({})
    assert laid(OPEN, list(CORNER), judge)[0] == list(CORNER)
    assert len(judge.asked) == 1


def test_the_time_of_legs_by_the_polar_is_not_less_than_drifting():
    speed = OPEN.boat.speed_mps(math.radians(90.0))
    assert _sailed_s(OPEN, [(0.0, 0.0), (30.0, 0.0), (10.0, 0.0)]) == pytest.approx(50.0 / speed)
    assert _sailed_s(OPEN, [(0.0, 0.0), (0.0, -30.0)]) == pytest.approx(30.0 / 0.3)  # into the wind
    assert _sailed_s(OPEN, [(0.0, 0.0)]) == 0.0
    away = OPEN.boat.speed_mps(math.radians(135.0))  # with the wind from the south, a leg to the north-east
    assert _sailed_s(OPEN, [(5.0, 40.0), (35.0, 70.0)]) == pytest.approx(math.hypot(30.0, 30.0) / away)


def test_a_leg_is_sailed_on_in_its_own_direction():
    assert _on((1.0, 2.0), (4.0, 6.0), 5.0) == pytest.approx((7.0, 10.0))
    assert _on((1.0, 2.0), (1.0, 2.0), 5.0) == (1.0, 2.0)


def test_legs_meet_away_from_the_frames_origin_too():
    assert meeting((100.0, 50.0), (110.0, 50.0), (120.0, 60.0), (120.0, 90.0)) == pytest.approx((120.0, 50.0))
    assert meeting((50.0, 100.0), (50.0, 110.0), (60.0, 120.0), (90.0, 120.0)) == pytest.approx((50.0, 120.0))
    assert meeting((0.0, 0.0), (0.0, 10.0), (60.0, 20.0), (80.0, 20.0)) == pytest.approx((0.0, 20.0))  # 60 m, the most


# ------------------------------------------------------------------------------------------------- pushes
BENT = [(0.0, 0.0), (4.0, 60.0), (8.0, 120.0), (0.0, 190.0)]


def near(leg, lack_m=2.04):
    """Something solid to the east of a place on a leg: corners are pushed to the west."""
    return ExpectedTrack(is_kept=False, lack_m=lack_m, worst_en=(6.0, 70.0), near_en=(9.0, 70.0), worst_leg=leg)


def moved(path, corners, push_m):
    return [(east - push_m, north) if n in corners else (east, north) for n, (east, north) in enumerate(path)]


def put_in(path, leg, push_m):
    (a, b), (c, d) = path[leg : leg + 2]
    return [*path[: leg + 1], (0.5 * (a + c) - push_m, 0.5 * (b + d)), *path[leg + 1 :]]


@pytest.mark.parametrize(
    ("leg", "corners"),
    [
        (0, [(1,)]),  # the start stays where it is
        (1, [(1,), (2,), (1, 2)]),
        (2, [(2,), (3,), (2, 3), (1, 2)]),
        (7, [(2,), (3,), (2, 3), (1, 2)]),  # the last leg that there is
    ],
)
def test_the_corners_about_the_worst_leg_are_pushed_away_and_one_is_put_into_it(leg, corners):
    pushes_m = (1.0, 2.2, 2.5, 5.0)  # what is lacking and a little, among the steps
    wanted = [moved(BENT, which, push_m) for which in corners for push_m in pushes_m]
    wanted += [put_in(BENT, min(leg, 2), push_m) for push_m in (1.0, 2.5, 5.0)]
    options = list(_pushes(OPEN, BENT, near(leg)))
    assert len(options) == len(wanted)
    for option, expected_path in zip(options, wanted, strict=True):
        assert np.asarray(option) == pytest.approx(np.asarray(expected_path))


def test_the_last_corner_is_pushed_no_farther_than_the_goal_reaches():
    small = replace(OPEN, goal_radius_m=2.5)
    ends = [option[-1][0] for option in _pushes(small, BENT, near(2)) if option[-1] != BENT[-1]]
    assert ends == pytest.approx([-1.0, -2.2, -2.5] * 2)


def test_without_a_place_or_a_direction_nothing_is_pushed():
    for seen in (
        replace(near(1), worst_en=None),
        replace(near(1), near_en=None),
        replace(near(1), near_en=near(1).worst_en),
    ):
        assert list(_pushes(OPEN, BENT, seen)) == []


@pytest.mark.parametrize(
    ("lack_m", "then_m", "is_taken"),
    [
        (2.0, 1.94, True),
        (2.0, 1.96, False),  # five centimetres less are nothing
        (0.06, 0.02, True),  # of little, half of it is enough
        (0.06, 0.04, False),
    ],
)
def test_a_push_is_taken_where_it_takes_away_enough_of_what_is_lacking(monkeypatch, lack_m, then_m, is_taken):
    option = [BENT[0], (0.0, 60.0), *BENT[2:]]
    monkeypatch.setattr(kept, "_pushes", lambda _problem, path, _seen: [option] if path is BENT else [])
    monkeypatch.setattr(kept, "expected", lambda *_: replace(near(1), lack_m=then_m))
    path, seen = _pushed(OPEN, Times({4: 100.0}), BENT, near(1, lack_m), Effort(None, None))
    assert (path == option) is is_taken
    assert seen.lack_m == (then_m if is_taken else lack_m)


def test_without_time_nothing_is_pushed():
    judge = Times({4: 100.0})
    path, seen = _pushed(OPEN, judge, BENT, near(1), Waiting(10.0, None, times=0))
    assert (path, seen, judge.asked) == (BENT, near(1), [])


def test_what_is_pushed_loses_the_corners_that_it_no_longer_needs(monkeypatch):
    """A corner that was put into a leg of a path, and one more that the push has made straight."""
    pushed = [(0.0, 0.0), (5.0, 95.0), (5.0, 120.0), (0.0, 190.0)]
    monkeypatch.setattr(kept, "_pushed", lambda _problem, _judge, _path, _seen, _effort: (pushed, near(1)))
    straight = ((0.0, 0.0), (1.0, 190.0))
    judge = Times({straight: 100.0, tuple(pushed): 103.0, (pushed[0], pushed[1], pushed[3]): 102.0})
    path, seen = laid(OPEN, list(straight), judge)
    assert path == [pushed[0], pushed[1], pushed[3]]
    assert seen.is_kept


# ------------------------------------------------------------------------------------------ another search
@dataclass
class Asked:
    """A search that hands back what it is given, one after the other, and notes what it was asked."""

    paths: list
    problems: list = field(default_factory=list)
    efforts: list = field(default_factory=list)

    def __call__(self, p, effort, seed):
        self.problems.append(p)
        self.efforts.append(effort)
        effort.spend(10)
        path = self.paths.pop(0)
        return Outcome(waypoints_en=None if path is None else np.asarray(path, dtype=float))


class Waiting(Effort):
    """An effort that has time for so many questions, and notes for how much it was asked."""

    def __init__(self, budget_s, expansions, times=99):
        super().__init__(budget_s, expansions)
        self.times, self.seconds = times, []

    def has_time(self, seconds):
        self.seconds.append(seconds)
        return len(self.seconds) <= self.times


class Hurried(Waiting):
    """... that has time for another search, and for no change to a path."""

    def has_time(self, seconds):
        self.seconds.append(seconds)
        return seconds > 0.0


def curve(bends, spread=1.0):
    """A path of legs of 200 m that turns by two degrees at each of its bends."""
    courses = np.radians(spread * 2.0 * np.arange(bends + 1))
    steps = 200.0 * np.column_stack([np.sin(courses), np.cos(courses)])
    return tuple((float(x), float(y)) for x, y in np.vstack([(0.0, 0.0), np.cumsum(steps, axis=0)]))


@pytest.mark.parametrize(
    ("bends", "found", "asked"),
    [
        (4, (curve(2),), 1),  # half of the bends is few enough
        (4, (None, curve(2)), 2),
        (4, (curve(3), curve(3)), 2),
        (5, (curve(3), curve(2)), 2),
        (3, (None, None), 2),
        (2, (), 0),  # two bends are not many
    ],
)
def test_a_path_of_many_bends_is_looked_for_again_with_a_zone_that_is_wider(bends, found, asked):
    path, wanted = curve(bends), next((f for f in found if f == curve(2)), None)
    search, effort = Asked(list(found)), Effort(None, 1000)
    judge = Times({path: 100.0, **{f: 104.9 for f in found if f is not None}})
    assert tuple(_straighter(search, OPEN, list(path), effort, 1, judge)) == (wanted or path)
    zones = [math.degrees(p.boat.no_go_half_rad - OPEN.boat.no_go_half_rad) for p in search.problems]
    assert zones == pytest.approx([0.5, 1.0][:asked])
    assert [e.limit for e in search.efforts] == [300] * asked
    assert effort.used == 10 * asked


@pytest.mark.parametrize(("took_s", "is_taken"), [(104.98, True), (105.02, False), (None, False)])
def test_a_path_of_fewer_bends_may_take_three_hundredths_and_two_seconds_more(took_s, is_taken):
    path, straight = curve(4), curve(1)
    judge = Times({path: 100.0, straight: took_s})
    found = _straighter(Asked([straight, straight]), OPEN, list(path), Effort(None, 1000), 1, judge)
    assert tuple(found) == (straight if is_taken else path)


def test_a_path_of_fewer_bends_is_not_looked_for_without_time():
    judge, search, effort = Times({5: 100.0}), Asked([None]), Waiting(10.0, None, times=0)
    assert tuple(_straighter(search, OPEN, list(curve(4))[:-1], effort, 1, judge)) == curve(4)[:-1]
    assert search.problems == []
    assert effort.seconds == [pytest.approx(0.8)]  # eight hundredths of the seconds


WALL = [shapely.box(-40.0, 90.0, 150.0, 95.0)]
NEAR, WEST = [(0.0, 0.0), (-55.0, 92.0), (0.0, 190.0)], [(0.0, 0.0), (-70.0, 92.0), (0.0, 190.0)]


def test_a_roomier_path_has_its_share_of_the_expansions_or_of_the_seconds():
    tracked = problem(WALL)
    for effort, of in ((Effort(None, 1000), "limit"), (Effort(100.0, None), "budget_s")):
        search = Asked([None, None, WEST])
        assert roomier(search, tracked, NEAR, effort, 1) is not None
        assert [getattr(e, of) for e in search.efforts] == pytest.approx([150 if of == "limit" else 6.0] * 3)
        assert effort.used == 30
    effort, search = Waiting(100.0, None, times=1), Asked([None])
    assert roomier(search, tracked, NEAR, effort, 1) is None  # there was time for one
    assert effort.seconds == pytest.approx([6.0, 6.0])


def test_a_path_that_takes_longer_than_it_may_is_no_roomier_one():
    tracked = problem(WALL)
    took_s = evaluate(tracked, WEST).time_s
    for within_s, is_found in ((1.1 * took_s, True), (0.99 * took_s, False)):
        found = roomier(Asked([WEST] * 3), tracked, NEAR, Effort(None, 1000), 1, within_s=within_s)
        assert (found is not None) is is_found


def test_a_beat_whose_boards_come_too_near_is_looked_for_with_so_much_more_room_and_a_metre():
    narrow, path = channel(18.0), [(0.0, 0.0), (0.0, 298.0)]
    lack_m = expected(narrow, path).lack_m
    assert lack_m > 0.0
    search, effort = Asked([path, None, None, None, None]), Hurried(100.0, None)
    outcome = with_track(search)(narrow, effort, 1)
    assert outcome.waypoints_en is None
    assert outcome.reason.startswith("a beat left to the autopilot comes to")
    assert search.problems[0].beat.clearance_m == narrow.beat.clearance_m
    assert search.problems[1].beat.clearance_m == pytest.approx(narrow.beat.clearance_m + lack_m + 1.0)
    assert 0.04 in effort.seconds  # with less no search is begun


def test_where_there_was_no_time_to_judge_another_path_there_is_none():
    class Late(Effort):
        is_late = True

    outcome = with_track(Asked([WEST]))(problem(WALL), Late(1.0, None), 1)
    assert outcome.waypoints_en is None
    assert "no time" in outcome.reason
    none = with_track(Asked([None]))(problem(WALL), Late(1.0, None), 1)
    assert (none.waypoints_en, none.reason) == (None, "")


# --------------------------------------------------------------------------------------------- the boards
def test_of_each_group_of_places_the_nearest_is_found_and_none_is_measured_twice():
    rng = np.random.default_rng(4)
    for _ in range(20):
        courses = np.cumsum(rng.normal(0.0, 0.1, 400))
        en = np.cumsum(0.8 * np.column_stack([np.sin(courses), np.cos(courses)]), axis=0)
        group = np.unique(np.cumsum(rng.random(400) < 0.02), return_inverse=True)[1]
        rock, measured = rng.uniform(-60.0, 60.0, 2), []

        def distance_m(places, rock=rock, measured=measured):
            measured.extend(map(tuple, places))
            return np.hypot(*(places - rock).T)

        found = _nearest_of_each(SimpleNamespace(distance_m=distance_m), en, group)
        far_m = np.hypot(*(en - rock).T)
        assert [d for _, d in found] == pytest.approx([far_m[group == g].min() for g in range(group.max() + 1)])
        assert [far_m[i] for i, _ in found] == pytest.approx([d for _, d in found])
        assert [group[i] for i, _ in found] == list(range(group.max() + 1))
        assert len(set(measured)) == len(measured) < 300


def test_a_leg_that_no_wind_brings_the_boat_to_has_no_boards():
    track = SimpleNamespace(en_m=np.zeros((3, 2)), leg=np.zeros(3, dtype=np.int64))
    assert _boards(channel(20.0).tracking, [track, track], np.array([(0.0, 0.0), (0.0, 9.0), (0.0, 90.0)]), 1) == []


@pytest.mark.parametrize(("delta_s", "rank"), [(0.5, 5), (0.75, 2), (0.9, 1), (0.95, 0)])
def test_of_a_boards_winds_the_one_that_is_as_likely_as_the_mission_asks_counts(monkeypatch, delta_s, rank):
    """A board that fewer than a quarter of the winds bring the boat to is none; those are sorted, the nearest first."""
    module, drawn = sys.modules[expected.__module__], []

    def winds(twd, *, sigma_rad, tau_s, length_s):
        drawn.append((sigma_rad, tau_s, length_s))
        return np.full((40, 3), twd)

    rows = [(float(room), (0.0, float(room))) for room in range(10)]
    monkeypatch.setattr(module, "drawn_winds", winds)
    monkeypatch.setattr(module, "predict", lambda *_args, **_more: None)
    monkeypatch.setattr(module, "_boards", lambda *_: [rows[::-1], rows[:9]])
    beaten = replace(channel(20.0, tracking={"correlation_s": 28.0}), delta_s=delta_s)
    path = np.array([(0.0, 0.0), (0.0, 100.0), (0.0, 298.0)])
    found = _worst_boards(beaten, path.tobytes(), (False, True), None)
    assert found == ((1, float(rank), (0.0, float(rank))),)
    [(sigma_rad, tau_s, length_s)] = drawn
    assert sigma_rad == beaten.wind.sigma.at(60.0)
    assert tau_s == 28.0
    assert length_s == pytest.approx(4.0 * 298.0 / float(np.max(curve_mps(beaten))) + 60.0)


def test_a_beat_in_a_part_of_a_path_is_the_one_that_it_is_in_the_whole():
    walls = [shapely.box(14.0, 60.0, 19.0, 240.0), shapely.box(-19.0, 60.0, -14.0, 240.0)]
    wind = {"from_deg": 0.0, "speed_mps": 5.0, "sigma": {"model": "none"}}
    narrow = replace(problem(walls, margin=FLOOR_M, goal=(0.0, 300.0), beat=BEAT, wind=wind), start_en=(-60.0, 0.0))
    path = [(-60.0, 0.0), (0.0, 0.0), (0.0, 298.0), (90.0, 298.0)]
    legs = evaluate(narrow, path).legs
    assert [leg.is_beat for leg in legs] == [False, True, False]
    for part in (None, slice(1, 3), slice(0, 3), slice(1, 4)):
        seen = expected(narrow, path, legs, part=part)
        assert (seen.is_beat, seen.worst_leg, seen.leg) == (True, 1, 1)
    assert not expected(narrow, path, legs, part=slice(2, 4)).is_beat
