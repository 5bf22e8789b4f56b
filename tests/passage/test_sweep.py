"""When to go: departures, members and chances that are no more than the members show."""

import math

import numpy as np
import pytest

from companion.boat import Polar
from companion.passage import at_least, at_most, best, sweep
from companion.passage.told import explained, told_of, told_of_chances, told_of_departures
from companion.weather import iso
from tests.passage.world import EAST_DEG_M, HOURS, LAT, LON, T0, cube, passage, place, steady

# As fast as two fifths of the wind up to 10 m/s, on every course.
POLAR = Polar(
    twa_rad=np.array([0.0, math.pi]), tws_mps=np.array([0.0, 10.0]), speed_mps_table=np.array([[0.0, 4.0]] * 2)
)
A, B = place(0.0, 0.0), place(0.0, 72_000.0 / EAST_DEG_M)  # ten hours at 2 m/s


def asked(*winds, **more):
    return passage(A, B, polar=POLAR, wind=cube(LAT, LON, HOURS, [steady(0.0, -w) for w in winds]), **more)


def test_a_chance_is_a_share_of_members():
    [d] = sweep(asked(5.0, 5.0, 2.5, 10.0), [T0], 0.0, nodes=20)
    assert d.members == 4
    assert [round(d.hours(q), 1) for q in (0.0, 0.5, 0.99)] == [5.0, 10.0, 20.0]
    assert [d.chance(T0 + 3600.0 * h) for h in (4.9, 5.1, 10.1, 20.1)] == [0.0, 0.25, 0.75, 1.0]


def test_her_own_speed_is_not_known_either():
    [d] = sweep(asked(5.0), [T0], 0.1, nodes=20)
    assert d.members == 1
    hours = sorted(run.time_s / 3600.0 for run in d.runs)
    assert hours == pytest.approx([10.0 * math.exp(0.1 * z) for z in (-1.2816, -0.5244, 0.0, 0.5244, 1.2816)], rel=2e-3)


def test_too_much_wind_ends_a_run_and_is_counted():
    [d] = sweep(asked(5.0, 5.0, 5.0, 14.0, max_tws_mps=12.0), [T0], 0.0, nodes=20)
    assert (d.chance_of_too_much(), d.chance()) == (0.25, 0.75)


def test_of_the_members_own_routes_the_one_that_serves_all_counts():
    """In the first member a way to the north is fast; in the others there is next to nothing there."""
    south = lambda t, y, x: (0.0 * x, np.where(y > 0.15, -1.0, -5.0))  # noqa: E731
    north = lambda t, y, x: (0.0 * x, np.where(y > 0.15, -10.0, -4.5))  # noqa: E731
    wind = cube(LAT, LON, HOURS, [north, south, south, south, south])
    [d] = sweep(passage(A, B, polar=POLAR, wind=wind), [T0], 0.0, nodes=30)
    assert max(abs(p.lat_deg) for p in d.route.waypoints) < 0.1
    assert d.mean_s() < 11.0 * 3600.0


def test_a_calm_is_waited_for_in_port_or_at_sea():
    blows = lambda t, y, x: (0.0 * x, np.where(t < 12.0 * 3600.0, 0.0, -5.0) + 0.0 * y)  # noqa: E731
    ready = passage(A, B, polar=POLAR, wind=cube(LAT, LON, np.arange(0.0, 97.0, 1.0), blows))
    found = sweep(ready, [T0 + 3600.0 * h for h in (0, 6, 12)], 0.0, nodes=20)
    there = [d.utc_s + d.hours(0.5) * 3600.0 - T0 for d in found]
    assert there == pytest.approx([22.0 * 3600.0] * 3, abs=1900.0)
    assert best(found) is found[2]


def test_a_way_that_is_faster_in_the_mean_and_fails_too_often_is_not_taken():
    """Straight on there are 14 m/s in one member of four, and she is not to be out in more than 12."""
    calm = steady(0.0, -5.0)
    gale = lambda t, y, x: (0.0 * x, np.where((np.abs(y) < 0.12) & (x > 0.2) & (x < 0.4), -14.0, -5.0))  # noqa: E731
    ready = passage(A, B, polar=POLAR, wind=cube(LAT, LON, HOURS, [calm, calm, calm, gale]), max_tws_mps=12.0)
    bold, careful = (sweep(ready, [T0], 0.0, nodes=30, sure=sure)[0] for sure in (0.7, 0.9))
    assert (bold.chance(), careful.chance()) == (0.75, 1.0)
    assert bold.mean_s() < careful.mean_s()
    assert max(abs(p.lat_deg) for p in careful.route.waypoints) > 0.11


def test_the_mean_of_the_members_is_a_way_to_try():
    """In either member a wind blows on one side of the way only; on the way there is half of both."""
    winds = [lambda t, y, x, s=s: (0.0 * x, -2.0 - 4.0 * np.clip(1.0 + s * y / 0.1, 0.0, 2.0)) for s in (-1.0, 1.0)]
    [d] = sweep(passage(A, B, polar=POLAR, wind=cube(LAT, LON, HOURS, winds)), [T0], 0.0, nodes=30)
    assert max(abs(p.lat_deg) for p in d.route.waypoints) < 0.02


def test_a_quantile_is_none_that_so_few_members_cannot_show():
    [d] = sweep(asked(5.0, 5.0, 2.5, 10.0), [T0], 0.0, nodes=20)
    lines = told_of_chances(d, None, 0.9)
    assert lines == (
        "arrives in 100 % of 4 runs in 4 members: in at least 47 %, with 95 % confidence",
        "hours: 10.0 as often as not, 5.0 to 20.0 in 6 of 10",
        "[depart] sure asks for 90 %: 4 members that all arrive would show no more than 47 %, 29 members would do",
    )
    assert "hours (middle 6 of 10)" in told_of_departures([d], None)[0]
    assert told_of_chances(d, None, 1.0)[-1].endswith("no more than 47 %, and nothing shows that")
    assert at_least(1.0, 28) < 0.9 <= at_least(1.0, 29)
    late = told_of_chances(d, T0 + 3600.0 * 15.0, 0.9)
    assert late[-1] == "not as sure as 90 %: no route that was tried is"
    [one] = sweep(asked(5.0), [T0], 0.0, nodes=20)
    assert "middle" not in told_of_departures([one], None)[0]


def test_a_place_is_reached_by_the_median_of_all_runs():
    """The command told the middle member's hour, the route over the radio and the page that of all runs."""
    [d] = sweep(asked(5.0, 4.0, 2.5, 10.0), [T0], 0.4, nodes=20)
    often, middle = T0 + d.hours(0.5) * 3600.0, T0 + d.middle().time_s
    assert abs(often - middle) > 600.0
    first, second, *_, leg = told_of(d.route, d)
    assert f"arrives {iso(middle)}" in first
    assert second.startswith("so in member ")
    assert leg.endswith(f" by {iso(often)} as often as not")
    [one] = sweep(asked(5.0), [T0], 0.0, nodes=20)
    assert told_of(one.route, one)[-1].endswith(f" by {iso(T0 + one.middle().time_s)}")


@pytest.mark.parametrize(("share", "members", "least"), [(1.0, 31, 0.908), (0.0, 31, 0.0), (30 / 31, 31, 0.856)])
def test_a_chance_is_at_least_what_members_show(share, members, least):
    assert at_least(share, members) == pytest.approx(least, abs=1e-3)


def test_what_is_said_of_departures():
    found = sweep(asked(5.0, 14.0, max_tws_mps=12.0), [T0, T0 + 43_200.0, T0 + 90.0 * 3600.0], 0.0, nodes=20)
    lines = told_of_departures(found, None)
    assert lines[1].split()[-6:] == ["50", "%", "50", "%", "0", "%"]
    assert lines[3] == "2026-04-23T18:00Z   no way: the forecast ends before she is there, or does not reach so far"
    assert lines[4] == "of 2 members of the forecast: what none of them shows may still come in 78 %"
    said = explained(found, None)
    assert len(said) == 1
    assert said[0].startswith(
        "none of those that have a way is surer or faster than another: each is there in 50 % of all, "
    )
    assert said[0].endswith("in 50 % 14.0 m/s of wind is more than she is to be out in")
    sure = explained(sweep(asked(5.0), [T0, T0 + 3600.0], 0.0, nodes=20), None)
    assert sure == (
        "none of these departures is surer or faster than another: each is there in 10.0 h as often as not",
    )
    grows = lambda t, y, x: (0.0 * x, 0.0 * y - np.where(t < 6.0 * 3600.0, 5.0, 10.0))  # noqa: E731
    ready = passage(A, B, polar=POLAR, wind=cube(LAT, LON, HOURS, grows))
    told = explained(sweep(ready, [T0 + 3600.0 * h for h in (0, 20, 24)], 0.0, nodes=20), None)
    assert told[0].startswith("best, of the surest the least long under way: 2026-04-20")
    assert told[1] == "20 h earlier: there 17.8 h earlier, 2.2 h longer under way"
    assert told[2] == "4 h later: there 4.0 h later, as good"
    assert explained(found, T0 + 3600.0) == ("none of these departures arrives by 2026-04-20T01:00Z",)


@pytest.mark.parametrize(
    ("share", "members", "most"), [(0.0, 31, 0.0921), (0.0, 51, 0.0570), (0.5, 2, 0.9747), (1.0, 9, 1.0)]
)
def test_no_more_is_claimed_than_members_show(share, members, most):
    assert at_most(share, members) == pytest.approx(most, abs=1e-4)
