"""A forecast as the wind of scenarios and rehearsals: place and hour, members, its edges, and when to set sail."""

import datetime as dt
import json
import math
import random
import shutil
from argparse import ArgumentTypeError
from pathlib import Path

import msgspec
import numpy as np
import pytest

from companion import cli
from companion.errors import InputError
from companion.weather import read_weather
from sitl.rehearse.departures import Span, advice, departure
from sitl.rehearse.estimates import estimates_of
from sitl.rehearse.sampling import forecast_wind
from sitl.run.embedded import mission_of
from sitl.runner import ScenarioBundle
from sitl.scenario import WindSpec, load_scenario, scenario_text, scenario_waters, scenario_wind
from sitl.world import Later, Scripted, WindEvent, beneath
from tests.weather.grib_file import CURRENT_EAST, CURRENT_NORTH, message_2, wind_2

LAT, LON = np.linspace(50.0, 51.5, 4), np.linspace(-2.0, -0.5, 4)
BEGINS = dt.datetime(2026, 4, 20, 6, tzinfo=dt.UTC)
ROCKS = Path("missions/rocks.toml").resolve()
ANY = {"sd_deg": 0.0, "tws_sd_mps": 0.0}


@pytest.fixture
def files(tmp_path):
    """Two members: a northerly that grows by the hour and a westerly that grows to the east; a stream to the north."""
    (tmp_path / "f.grb2").write_bytes(
        b"".join(
            wind_2(LAT, LON, h, 0.0, -5.0 - h / 6.0, member=0)
            + wind_2(LAT, LON, h, 6.0 + 2.0 * (LON + 1.3), 0.0, member=1)
            for h in range(0, 25, 6)
        )
    )
    still = np.zeros((4, 4))
    flows = [message_2(q, still + v, LAT, LON, h, level=(1, 0)) for h in (0, 24)
             for q, v in ((CURRENT_EAST, 0.0), (CURRENT_NORTH, 0.4))]  # fmt: skip
    (tmp_path / "c.grb2").write_bytes(b"".join(flows))
    return tmp_path


def scenario(folder, *, begins=BEGINS, **wind):
    plain = msgspec.structs.replace(
        load_scenario(ROCKS), mission=str(ROCKS), begins=begins,
        wind=WindSpec(**({"model": "forecast", "files": ("f.grb2",)} | ANY | wind)),
    )  # fmt: skip
    path = folder / "s.toml"
    path.write_text(scenario_text(plain))
    return load_scenario(path), path


def test_the_wind_is_the_forecasts_of_the_hour(files):
    wind = scenario_wind(*scenario(files), 0)
    assert wind.at(0.0) == pytest.approx((0.0, 6.0), abs=1e-3)
    assert wind.at(3.0 * 3600.0) == pytest.approx((0.0, 6.5), abs=1e-3)
    assert wind.at(-1.0)[1] < 6.0
    later = scenario_wind(*scenario(files, begins=BEGINS + dt.timedelta(hours=6)), 0)
    assert later.at(0.0)[1] == pytest.approx(7.0, abs=1e-3)


def test_after_its_end_the_last_wind_holds_on(files):
    wind = scenario_wind(*scenario(files), 0)
    assert wind.at(40.0 * 3600.0) == pytest.approx((0.0, 9.0), abs=1e-3)


def test_it_varies_over_the_water_and_the_stream_runs(files):
    made, path = scenario(files, files=("f.grb2", "c.grb2"), member=1)
    wind = scenario_wind(made, path, 0)
    waters = scenario_waters(made, wind, (0.0, 0.0))
    weather = read_weather([files / "f.grb2"])
    frame = mission_of(made, path).frame()
    for place in ((0.0, 0.0), (9000.0, -4000.0), (21_500.0, 3000.0)):
        here = frame.geo_from_en(*place)
        east, north = weather.wind_en_mps(BEGINS.timestamp() + 5000.0, here.lat_deg, here.lon_deg)[1].ravel()
        twd, tws = waters.wind_at(5000.0, place)
        assert twd == pytest.approx(1.5 * math.pi, abs=1e-3)
        assert tws == pytest.approx(math.hypot(east, north), abs=2e-3)
        assert waters.stream_at(5000.0, place) == pytest.approx((0.0, 0.4), abs=1e-3)
    assert waters.wind_at(0.0, (20_000.0, 0.0))[1] > waters.wind_at(0.0, (0.0, 0.0))[1] + 0.4


def test_beyond_its_edge_the_nearest_that_is_known_holds_on(files):
    waters = scenario_waters(*_of(scenario(files, member=1)))
    assert waters.wind_at(0.0, (300_000.0, 0.0))[1] == pytest.approx(6.0 + 2.0 * 0.8, abs=2e-2)


def _of(made):
    return made[0], scenario_wind(*made, 0), (0.0, 0.0)


def test_what_wanders_about_it_and_by_how_much_it_is_off(files):
    wind = scenario_wind(*scenario(files, sd_deg=9.0, tws_sd_mps=0.3, off_deg=20.0, off_mps=1.0), 3)
    told = np.array([wind.at(30.0 * n) for n in range(600)])
    off = np.degrees(np.angle(np.exp(1j * told[:, 0])))
    assert (off.mean(), off.std()) == pytest.approx((20.0, 9.0), abs=1.5)
    assert (told[:, 1] - 6.0 - 30.0 * np.arange(600) / 21_600.0).mean() == pytest.approx(1.0, abs=0.1)


def test_events_are_over_it(files):
    made, path = scenario(files)
    wind = Scripted(Later(scenario_wind(made, path, 0), 0.0), (WindEvent(at_s=100.0, veer_rad=0.5),))
    assert beneath(wind) is not None
    waters = scenario_waters(made, wind, (0.0, 0.0))
    assert waters.wind_at(200.0, (5000.0, 5000.0))[0] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        ({"files": ()}, "model forecast names no files; write files = "),
        ({"member": 7}, "f.grb2 has no member 7; known: 0, 1"),
        ({"files": ("g.grb2",)}, "no such file"),
        ({"files": ("c.grb2",)}, "holds no wind of 10 m where the mission is"),
        (
            {"begins": dt.datetime(2026, 4, 22, tzinfo=dt.UTC)},
            "not known at 2026-04-22 00:00 UTC: after the forecast's end, 2026-04-21T00:00Z; sail at another time",
        ),
    ],
)
def test_what_is_no_weather_for_it_is_one_line(files, words, said):
    with pytest.raises(InputError, match=r"wind|file") as caught:
        scenario_wind(*scenario(files, **words), 0)
    assert said in str(caught.value)
    assert "\n" not in str(caught.value)


def test_a_scenario_is_carried_to_another_machine_with_its_forecasts(files):
    bundle = ScenarioBundle.of(scenario(files, files=("f.grb2", "c.grb2"))[1])
    assert {"f.grb2", "c.grb2"} <= {Path(name).name for name, _ in bundle.packed}


# ------------------------------------------------------------------------------------------------ rehearsals
def blown(files, depart=None, hour=BEGINS, error=None):
    mission = mission_of(load_scenario(ROCKS), ROCKS)
    return forecast_wind([files / "f.grb2"], mission, depart, hour, WindSpec(), error)


def test_each_voyage_of_a_rehearsal_is_in_a_member(files):
    given, begins = blown(files)
    drawn = [given.drawn(random.Random(seed), 600.0) for seed in range(60)]
    assert (begins, {spec.member for spec in drawn}, {spec.off_deg for spec in drawn}) == (BEGINS, {0, 1}, {0.0})
    assert 20 < sum(spec.member for spec in drawn) < 40
    assert given.told.startswith("2 members of ")
    given, _ = blown(files, error=(10.0, 0.5))
    off = [given.drawn(random.Random(seed), 600.0).off_deg for seed in range(200)]
    assert np.std(off) == pytest.approx(10.0, abs=1.5)


def test_she_sets_sail_when_the_wind_is_known(files):
    now = dt.datetime(2027, 1, 1, tzinfo=dt.UTC)
    assert blown(files, hour=now)[1] == dt.datetime(2026, 4, 20, tzinfo=dt.UTC)
    with pytest.raises(InputError, match="2027-01-01 00:00 UTC: after the forecast's end"):
        blown(files, depart=now)


def test_a_span_of_departures():
    hours = departure("06:00..18:00").hours(BEGINS, 7200.0)
    assert (len(hours), hours[0], hours[-1]) == (7, BEGINS, BEGINS + dt.timedelta(hours=12))
    assert departure("22:00..02:00").hours(BEGINS, 7200.0)[-1] == dt.datetime(2026, 4, 21, 2, tzinfo=dt.UTC)
    assert len(departure("2026-04-20T06:00Z..2026-04-21T06:00Z").hours(BEGINS, 43_200.0)) == 3
    assert departure("2026-04-20T06:00Z") == BEGINS
    for text in ("06:00..2026-04-20T06:00Z", "6..18", "2026-04-20T06:00"):
        with pytest.raises(ArgumentTypeError):
            departure(text)
    for span, every, said in (
        (Span(BEGINS, BEGINS - dt.timedelta(hours=1)), 60.0, "ends before it begins"),
        (Span(BEGINS, BEGINS + dt.timedelta(days=9)), 60.0, "makes 12961 departures"),
    ):
        with pytest.raises(InputError, match=said):
            span.hours(BEGINS, every)


def known(arrived, of, time_s=200.0):
    return estimates_of(
        [{"seed": n, "arrived": n < arrived, "below_floor": False, "time_s": time_s, "alerts": {}} for n in range(of)]
    )


def test_the_best_departure_is_the_surest_and_others_may_be_as_good():
    hours = [BEGINS + dt.timedelta(hours=2 * n) for n in range(3)]
    rows = list(zip(hours, (known(10, 60), known(60, 60), known(58, 60)), strict=True))
    assert advice(rows) == ["best: 2026-04-20 08:00; as good for all that 60 voyages tell: 2026-04-20 10:00"]
    one = [(hour, known(1, 1)) for hour in hours[:2]]
    assert advice(one) == ["none of these departures is better than another, for all that 1 voyage tells"]
    assert advice(one[:1]) == ["best: 2026-04-20 06:00, surely"]
    assert advice(rows[:2]) == ["best: 2026-04-20 08:00, surely"]
    fast = [(hours[0], known(60, 60, 300.0)), (hours[1], known(60, 60))]
    assert advice(fast)[0].startswith("best: 2026-04-20 08:00; ")
    assert advice([(hours[0], known(0, 60))]) == ["none of these departures arrives"]
    assert advice([(hours[0], known(0, 0))])[0].startswith("no chances yet")


def test_departures_of_a_day_are_rehearsed_in_the_forecast(files, monkeypatch, capsys):
    monkeypatch.chdir(files)
    for name in ("rocks.toml", "rocks.wkt"):
        shutil.copy(ROCKS.with_name(name), files)
    words = ["--wind", "f.grb2", "--doubt", "0", "--runs", "1", "--workers", "1", "--depart"]
    assert cli.main(["rehearse", "rocks.toml", *words, "06:00..18:00", "--every", "12h"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert [line[:27] for line in lines[1:3]] == ["2026-04-20 06:00         1 ", "2026-04-20 18:00         1 "]
    assert lines[3].startswith("best: 2026-04-20 ")
    folder = files / "rehearsals" / "rocks"
    early, late = (json.loads((folder / f"2026-04-20T{h}00" / "results.jsonl").read_text().splitlines()[-1])["result"]
                   for h in ("06", "18"))  # fmt: skip
    assert early["arrived"]
    assert late["arrived"]
    assert late["time_s"] != early["time_s"]
    assert cli.main(["rehearse", "rocks.toml", *words, "06:00..18:00", "--try", "later=1h"]) == 2
    assert "compares departures, and tries no change" in capsys.readouterr().err
