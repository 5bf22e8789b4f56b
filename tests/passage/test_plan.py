"""``companion passage plan``: a file asks, a route answers in lines; what cannot be believed is refused in one."""

import importlib
import re
import tomllib

import numpy as np
import pytest

from companion import cli
from companion.geofence import load_mission
from companion.page import read_planned
from tests.weather.grib_file import CURRENT_EAST, CURRENT_NORTH, message_2, wind_2

LAT, LON = np.linspace(48.0, 52.0, 9), np.linspace(-8.0, -2.0, 13)
ASKED = """name = "across"
[start]
lat = 50.0
lon = -6.0
[goal]
lat = 50.0
lon = -5.0
[depart]
at = 2026-04-20T06:00:00Z
[weather]
files = ["f.grb2"]
[boat]
polar = "avalon"
[area]
obstacles = ["rock.wkt"]
margin_m = 500.0
"""
A_POLAR = 'write "ardurover", "avalon", a polar file beside the mission, or a speed in m/s'
ANOTHER = "say another time, or give a forecast of it"
ROCK = "POLYGON ((-5.6 49.98, -5.5 49.98, -5.5 50.05, -5.6 50.05, -5.6 49.98))"


@pytest.fixture
def shell(tmp_path, monkeypatch, capsys):
    """A folder with a passage round a rock in a northerly of 7 m/s for two days; and what the command answers."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("companion.commands.passage.NODES", 30)
    (tmp_path / "f.grb2").write_bytes(b"".join(wind_2(LAT, LON, h, 0.0, -7.0) for h in range(0, 49, 6)))
    (tmp_path / "rock.wkt").write_text(ROCK)

    def run(*words, text=ASKED, **changes):
        for old, new in changes.values():
            assert old in text
            text = text.replace(old, new)
        (tmp_path / "p.toml").write_text(text)
        code = cli.main(["passage", "plan", "p.toml", *map(str, words)])
        said = capsys.readouterr()
        lines = said.err.splitlines(keepends=True)
        return code, said.out, "".join(line for line in lines if not line.startswith("note: "))  # a loaded machine

    return run


def test_a_route_is_told_drawn_and_written_as_a_mission(shell, tmp_path):
    code, out, err = shell("--out", "m.toml", "--plot", "p.png")
    assert (code, err) == (0, "")
    lines = out.splitlines()
    assert lines[0].startswith("departs 2026-04-20T06:00Z, arrives 2026-04-20T1")
    hours = re.fullmatch(r"departs .*T06:00Z, arrives .*T(1\d):(\d\d)Z, (\d+) h (\d+) min later: .*", lines[0])
    there_h, there_min, took_h, took_min = map(int, hours.groups())
    assert 60 * (there_h - 6) + there_min == 60 * took_h + took_min  # 06:00 and 04:20 are not 10:19
    assert lines[1].startswith("no way is faster than about ")
    assert lines[2] == "wind 7.0 to 7.0 m/s, mean 7.0; 0 h by night, 0 h beating, 0 h waiting"
    assert (tmp_path / "p.png").stat().st_size > 20_000
    mission = load_mission(tmp_path / "m.toml")
    assert mission.is_passage
    assert (mission.goals[-1].point.lat_deg, mission.goals[-1].point.lon_deg) == (50.0, -5.0)
    assert len(mission.goals) > 1
    tables = tomllib.loads((tmp_path / "m.toml").read_text())
    assert tables["boat"]["polar"] == "avalon"
    assert all(200.0 <= goal["bandwidth_m"] < 10_000.0 for goal in tables["goal"])
    assert shell("--out", "m.toml")[2] == "companion passage: m.toml: exists; say --force to overwrite it\n"
    drawn = read_planned(tmp_path / "m.toml")
    assert [w.at for w in drawn.waypoints[1:]] == [(g["lat"], g["lon"]) for g in tables["goal"]]
    assert [w.band_m for w in drawn.waypoints[1:]] == [g["bandwidth_m"] for g in tables["goal"]]
    assert (drawn.members, drawn.members_m, drawn.name) == (1, (), "across")
    (tmp_path / "m.toml").unlink()
    assert shell("--out", "m.toml")[2] == "companion passage: m.passage.json: exists; say --force to overwrite it\n"
    assert not (tmp_path / "m.toml").exists()
    assert shell("--out", "m.toml", "--force")[0] == 0


def test_what_is_written_is_checked_without_a_warning():
    """Each place is reached behind the one before it: a last turn within the goal's radius was a warning."""
    from companion.passage.mission import goals_of
    from tests.passage.world import place

    points = (place(0.0, 0.0), place(0.0, 0.3), place(0.0, 0.301), place(0.002, 0.308))
    made = goals_of(points, (200.0, 200.0, 200.0), 1000.0)["goal"]
    assert [goal["radius_m"] for goal in made] == [200.0, 89.0, 648.0]


def test_the_members_fan_is_drawn(tmp_path):
    import matplotlib.pyplot as plt

    from companion.passage import plan
    from companion.plots.passage import passage_figure
    from tests.passage.world import HOURS, T0, cube, passage, place, steady
    from tests.passage.world import LAT as LAT0
    from tests.passage.world import LON as LON0

    wind = cube(LAT0, LON0, HOURS, [steady(0.0, -5.0), steady(0.0, -6.0), steady(0.0, -7.0)])
    asked = passage(place(0.0, 0.0), place(0.0, 0.4), wind=wind)
    figure = passage_figure(asked, plan(asked, T0, nodes=20), "fan")
    assert figure.axes[1].get_title(loc="right") == "thin: the wind in 3 members; ticks: the 3 that arrive"
    assert {float(line.get_ydata()[0]) for line in figure.axes[1].lines[::2][:3]} == {5.0, 6.0, 7.0}
    plt.close(figure)


def test_band_currents_and_arrivals_are_drawn():
    import matplotlib.pyplot as plt

    from companion.passage import sweep
    from companion.plots.passage import passage_figure
    from tests.passage.world import HOURS, T0, cube, passage, place, steady
    from tests.passage.world import LAT as LAT0
    from tests.passage.world import LON as LON0

    wind = cube(LAT0, LON0, HOURS, [steady(0.0, -5.0), steady(0.0, -6.0), steady(0.0, -14.0)])
    stream = cube(LAT0, LON0, HOURS, steady(0.4, 0.3))
    asked = passage(place(0.0, 0.0), place(0.0, 0.4), wind=wind, stream=stream, max_tws_mps=12.0)
    [found] = sweep(asked, [T0], 0.0, nodes=20)
    figure = passage_figure(asked, found.route, "all", found)
    chart, _, arrivals = figure.axes
    words = [text.get_text() for text in chart.get_legend().get_texts()]
    assert words == ["route", "band", "waypoints", "current as she passes, up to 0.5 m/s"]
    assert arrivals.get_title(loc="right").startswith("2 of 3 runs arrive; 1 do not: 14.0 m/s of wind is more")
    assert sum(patch.get_height() for patch in arrivals.patches) == 2
    assert figure.get_suptitle().endswith("so in member 1, of 3 the middle one")  # a bound would be of that one alone
    plt.close(figure)


@pytest.mark.parametrize("lat_deg", [-1.0, 1.0])
def test_barbs_have_their_feathers_on_the_side_of_the_low(lat_deg):
    """In a northerly the low, and they, lie to the east in the north, to the west in the south."""
    import matplotlib.pyplot as plt
    from matplotlib.quiver import Barbs

    from companion.passage import plan
    from companion.plots.passage import passage_figure
    from tests.passage.world import T0, passage, place

    asked = passage(place(lat_deg, 0.0), place(lat_deg, 0.4))
    figure = passage_figure(asked, plan(asked, T0, nodes=20), "south")
    [barbs] = [one for one in figure.axes[0].collections if isinstance(one, Barbs)]
    x = barbs.get_paths()[0].vertices[:, 0]
    assert (x.min() < 0.0) == (lat_deg < 0.0)
    assert (x.max() > 0.0) == (lat_deg > 0.0)
    plt.close(figure)


def test_a_current_of_another_file_and_grid_is_sailed_in(shell, tmp_path):
    """Another program read the second file's current wrong: 0.5 m/s fair, of cells of its own and every three hours."""
    lat, lon = np.linspace(49.0, 51.0, 21), np.linspace(-7.0, -4.0, 16)
    flows = (
        message_2(q, np.full((21, 16), v), lat, lon, h, level=(160, 0))
        for h in range(0, 31, 3)
        for q, v in ((CURRENT_EAST, 0.5), (CURRENT_NORTH, 0.0))
    )
    (tmp_path / "c.grb2").write_bytes(b"".join(flows))

    def speed(**changes):
        out = shell(obstacles=('obstacles = ["rock.wkt"]', ""), **changes)[1]
        return float(out.split(" NM at ")[1].split()[0])

    assert speed(files=('["f.grb2"]', '["f.grb2", "c.grb2"]')) - speed() == pytest.approx(0.5, abs=0.1)


def test_the_way_and_its_legs_are_as_long_as_each_other(shell):
    """ "203 NM" stood over the only leg, of 204.6 NM: she is there at the edge of the goal."""
    out = shell(obstacles=('obstacles = ["rock.wkt"]', ""))[1]
    way, short = re.search(r" (\d+) NM at [\d.]+ m/s to within ([\d.]+) NM of the goal", out).groups()
    legs = [float(found) for found in re.findall(r"  ([\d.]+) NM on ", out)]
    assert float(way) + float(short) == pytest.approx(sum(legs), abs=0.6)


def test_the_area_of_a_mission_has_its_margin_and_no_less(shell, tmp_path):
    assert shell("--out", "m.toml", margin=("margin_m = 500.0\n", ""))[0] == 0
    assert load_mission(tmp_path / "m.toml").margin_m == 12.0


def test_a_forecast_that_ends_too_soon_is_no_way(shell):
    code, out, err = shell(at=("2026-04-20T06", "2026-04-21T23"))
    assert (code, err) == (1, "")
    assert out == "no way: the forecast ends before she is there, or does not reach so far\n"


def test_departures_are_compared(shell):
    code, out, err = shell(
        "--depart", "2026-04-20T00:00Z..2026-04-21T18:00Z", "--every", "18h", "--explain", "--plot", "d.png"
    )
    assert (code, err) == (0, "")
    assert out.endswith("d.png: written\n")
    lines = out.splitlines()
    assert [line[:17] for line in lines[1:4]] == ["2026-04-20T00:00Z", "2026-04-20T18:00Z", "2026-04-21T12:00Z"]
    assert lines[4].startswith("of 1 member of the forecast: ")
    assert lines[5].startswith("none of these departures is surer or faster than another: each is there in ")


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ["--by", "2026-04-20T06:00Z"],
            "--by: 2026-04-20T06:00Z is not after 2026-04-20T06:00Z, when she departs; say a later time",
        ),
        (["--explain"], "companion passage plan: --explain: is of a --depart FROM..TO; say it, too"),
        (
            ["--depart", "2026-04-20T00:00Z..2026-04-28T00:00Z", "--every", "10m"],
            "companion passage plan: --every: makes 1153 departures of it; say a longer time",
        ),
        (
            ["--depart", "2026-04-20T00:00Z..2026-04-21T00:00Z", "--out", "m.toml"],
            "companion passage plan: --depart: writes no mission; plan the best of them with --out",
        ),
    ],
)
def test_an_option_that_goes_with_another(shell, words, said):
    code, _, err = shell(*words)
    assert (code, err) == (2, f"{said}\n" if said.startswith("companion ") else f"companion passage: {said}\n")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (
            ("at = 2026-04-20T06", "at = 2026-04-19T06"),
            "p.toml: [depart] at: the wind at [start] is not known at 2026-04-19T06:00Z: before the forecast's begin, "
            "2026-04-20T00:00Z; " + ANOTHER,
        ),
        (
            ("at = 2026-04-20T06:00:00Z", "at = 2026-04-20T06:00:00Z\nby = 2026-04-20T05:00:00Z"),
            "p.toml: [depart] by: is not after at, when she departs; write a later time",
        ),
        (
            ("at = 2026-04-20T06:00:00Z", "at = 2026-04-20T06:00:00"),
            "p.toml: [depart] at: expected a date with its time with a timezone component",
        ),
        (
            ("[area]", "[limits]\nmax_wave_m = 3.0\n[area]"),
            "p.toml: [limits] max_wave_m: f.grb2 says nothing of waves; add a forecast of them",
        ),
        (
            ('obstacles = ["rock.wkt"]\nmargin_m = 500.0', "[limits]\nlee_shore_m = 3000.0"),
            "p.toml: [limits] lee_shore_m: there is no shore; name one in [area] obstacles",
        ),
        (("lon = -6.0", "lon = -9.0"), "p.toml: [start]: is outside the area of f.grb2; ask for a larger area"),
        (
            ("lon = -6.0", "lon = -5.55"),
            "p.toml: [start]: is on land, in closed water or within [area] margin_m of it; move it out to sea",
        ),
        (
            ("lon = -6.0", "lon = -5.0"),
            "p.toml: [goal]: start and goal are one place, or lie opposite each other; look at both",
        ),
        (("lat = 50.0", "lat = 95.0"), "p.toml: [start] lat: expected a number of at most 90.0"),
        (("lat = 50.0", "lat = nan"), "p.toml: [start] lat: nan is not a finite number"),
        (("files =", "file ="), "p.toml: [weather] file: unknown key; did you mean 'files'?"),
        (
            ("[goal]", "[[goal]]"),
            "p.toml: is a mission, not a passage: it has [[goal]]; check it by: companion mission check p.toml",
        ),
        (("[goal]", "[gaol]"), "p.toml: gaol: unknown key; did you mean 'goal'?"),
        (
            ('"rock.wkt"', '"rocks.wkt"'),
            "p.toml: [area] obstacles rocks.wkt: no such file; paths are relative to this file",
        ),
        (('"f.grb2"', '"g.grb2"'), "g.grb2: no such file; check the path"),
        (('"avalon"', '"avalanche"'), f"p.toml: [boat] polar: there is no polar 'avalanche'; {A_POLAR}"),
        (("margin_m = 500.0", "margin_m = 500.0\n]"), "p.toml: line 17, column 1: is not TOML: invalid statement"),
    ],
)
def test_what_is_wrong_is_one_line(shell, change, said):
    assert shell(change=change)[::2] == (2, f"companion passage: {said}\n")


def test_a_way_that_the_finer_search_cannot_sail_is_not_made_a_straight_line(shell, monkeypatch):
    module = importlib.import_module("companion.passage.plan")  # the room's ``plan`` is its function
    real, ways = module.arrivals, []

    def never(waters, craft, points, depart_s, step_s):
        ways.append(points)
        return np.append(real(waters, craft, points, depart_s, step_s)[:-1], np.inf)

    monkeypatch.setattr(module, "arrivals", never)
    _, out, err = shell()
    assert err == ""
    assert len(ways) == 1
    assert out.count("\n  ") == len(ways[0]) - 1 > 2
