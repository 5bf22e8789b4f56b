"""Tides by harmonic constants: NOAA's own predictions, node factors over 18 years, stations, streams and tables."""

import math
from datetime import datetime

import numpy as np
import pytest

from companion import cli
from companion.current import read_table, read_tide
from companion.current.prior import table_lines
from companion.errors import InputError
from companion.weather import KNOWN, Tides, Weather, constituent_named, iso, phasors, read_stations
from tests.passage.world import LAT as LAT0
from tests.passage.world import LON as LON0
from tests.passage.world import T0, cube, steady

# NOAA, station 1612340 (Honolulu), harmonic constants [m, deg GMT]; public domain. Fetched in 2023.
HONOLULU = """M2 .171 59.4, S2 .056 54.7, N2 .033 48.8, K1 .149 226.8, M4 .001 195.3, O1 .081 215.9, M6 .001 229.7,
MK3 .001 342.6, MN4 .001 92.9, NU2 .007 56, MU2 .004 7.8, 2N2 .004 39.9, OO1 .005 251.7, LAM2 .001 76.2, S1 .002 210,
M1 .005 232.5, J1 .01 238.3, MM .005 43.4, SA .048 177.7, MF .006 44.3, RHO .002 195.4, Q1 .014 209.6, T2 .004 43.6,
R2 .001 357.3, 2Q1 .001 231, P1 .045 224.9, 2SM2 .001 199.8, M3 .001 164.1, L2 .004 49.3, K2 .016 45.7, MS4 .001 104"""
# What NOAA predicted with them, metres above MLLW, every third hour from 2023-08-30T00:00Z.
PREDICTED = (0.712, 0.661, 0.192, 0.062, 0.306, 0.295, 0.019, 0.123)
PREDICTED_31 = (0.606, 0.709, 0.261, 0.031, 0.286, 0.405, 0.12, 0.059)
# NOAA, station 9413450 (Monterey) [ft, deg GMT].
MONTEREY = """M2 1.61 181.3, S2 .43 180.1, N2 .37 155, K1 1.2 219.6, O1 .75 203.5, NU2 .07 160.9, MU2 .04 114.7,
2N2 .05 125.4, OO1 .04 246.4, LAM2 .01 213.6, S1 .03 317.1, M1 .04 224.9, J1 .07 232.3, SSA .07 264.6, SA .2 198.5,
MF .04 138.1, RHO .02 197, Q1 .13 194.8, T2 .02 165.3, 2Q1 .02 191.7, P1 .38 215.8, M3 .01 7, L2 .04 213.4, K2 .12
170.6"""


def constants(text):
    rows = [row.split() for row in text.replace("\n", " ").split(",")]
    values = np.array([float(a) * np.exp(-1j * math.radians(float(g))) for _, a, g in rows])
    return [constituent_named(name) for name, _, _ in rows], values


def row_times(text):
    return tuple(unix(line.split(",")[0]) for _, line in table_lines(text))


def unix(text):
    return datetime.fromisoformat(text).timestamp()


def test_what_noaa_predicts_to_half_a_centimetre():
    """Constants have three digits; the level of the datum is not among them."""
    names, values = constants(HONOLULU)
    t = unix("2023-08-30T00:00Z") + 3.0 * 3600.0 * np.arange(16)
    off = np.array([*PREDICTED, *PREDICTED_31]) - (phasors(names, t) @ values).real
    assert off.mean() == pytest.approx(0.251, abs=0.002)
    assert np.abs(off - off.mean()).max() < 0.005


def test_a_high_and_a_low_of_another_coast():
    """Monterey, 13 February 2026: 5.271 ft at 15:06, -0.361 ft at 22:44; mean sea level is 2.83 ft above MLLW."""
    names, values = constants(MONTEREY)
    found = 2.83 + (phasors(names, [unix("2026-02-13T15:06Z"), unix("2026-02-13T22:44Z")]) @ values).real
    assert found == pytest.approx([5.271, -0.361], abs=0.04)  # a hundredth of a foot is the digit of the constants


def test_arguments_and_nodes_of_another_program():
    """By pyfes 2026.5.2 (CNES), Schureman's formulas there too: within a hundredth and a half over a node's round."""
    pyfes = pytest.importorskip("pyfes")
    t = np.arange(np.datetime64("2005-01-01"), np.datetime64("2024-01-01"), np.timedelta64(997, "h"))
    theirs = {name.upper(): name for name in pyfes.known_constituents()}
    settings = pyfes.FESSettings().with_compute_long_period_equilibrium(False)
    # With those that a model has, it adds others by admittance: they are in the compounds; M1 and 2MN2 differ.
    infers = {"M2", "N2", "K1", "O1", "Q1", "K2", "2N2", "M1", "2MN2", "MSF", "2MK6"}
    tried = [name for name in KNOWN if name in theirs and name not in infers]
    assert len(tried) > 45
    for name in tried:
        there = sum(pyfes.evaluate_tide_from_constituents({theirs[name]: (100.0, 30.0)}, t, 21.3, settings=settings))
        here = (
            phasors([name], t.astype("datetime64[s]").astype(float))[:, 0] * 100.0 * np.exp(-1j * math.radians(30))
        ).real
        assert np.abs(here - there).max() < 1.5, name


def test_a_node_takes_eighteen_years():
    t = unix("2006-06-15T00:00Z") + 86_400.0 * 365.25 * np.arange(0.0, 18.7, 0.1)
    f = np.abs(phasors(["M2", "O1", "K1", "K2", "S2"], t))
    low, high = f.min(axis=0), f.max(axis=0)
    assert low == pytest.approx([0.963, 0.806, 0.882, 0.748, 1.0], abs=0.003)  # Schureman, table 14
    assert high == pytest.approx([1.038, 1.183, 1.113, 1.317, 1.0], abs=0.003)


STATIONS = """reach_km = 30.0
[[station]]
name = "west"
lat = 50.0
lon = -6.0
height = { mean_m = 3.0, waves = { M2 = [2.0, 350.0], S2 = [0.7, 20.0] } }
[[station.stream]]
towards_deg = 90.0
mean_mps = 0.1
waves = { M2 = [1.0, 60.0] }
[[station]]
name = "east"
lat = 50.0
lon = -5.7
height = { mean_m = 3.0, waves = { M2 = [2.0, 10.0], S2 = [0.7, 40.0] } }
"""
NOON = T0 + 43_200.0


def tides(text=STATIONS):
    return read_stations(text, "s.toml")


def test_between_stations_constants_are_interpolated_and_beyond_them_unknown():
    height, stream = tides()
    t = NOON + 600.0 * np.arange(150)
    at = [height.at(t, 50.0, lon)[:, 0] for lon in (-6.0, -5.85, -5.7)]
    assert at[1] == pytest.approx(0.5 * (at[0] + at[2]), abs=1e-6)  # midway; not half of 350 and 10 degrees
    assert at[1].max() - 3.0 > 2.3
    assert np.isnan(height.at(NOON, 50.0, -6.5)).all()
    assert not np.isnan(height.at(NOON, 50.0, -6.4)).any()
    assert np.isnan(stream.at(NOON, 50.0, -5.5)).all()
    assert np.ptp(stream.at(t, 50.0, -6.0)[:, 1]) < 1e-9
    assert np.mean(stream.at(NOON + 600.0 * np.arange(5 * 447), 50.0, -6.0)[:, 0]) == pytest.approx(0.1, abs=0.01)


def test_a_grid_is_bilinear_and_a_node_that_is_land_makes_its_cells_unknown():
    lat, lon = np.meshgrid([50.0, 51.0], [359.0, 360.0, 361.0], indexing="ij")
    values = np.array([1.0, 2.0, 3.0, 1.0, 2.0, np.nan]).reshape(6, 1, 1).astype(complex)
    grid = Tides(
        what="height", names=("M2",), lat_deg=lat.ravel(), lon_deg=lon.ravel(), constants=values,
        mean=np.zeros((6, 1)), source="", shape=(2, 3),
    )  # fmt: skip
    one = phasors(["M2"], [NOON])[0, 0].real
    found = grid.at(NOON, [50.5, 50.0, 51.0, 50.5, 52.0], [-0.5, 1.0, -1.0, 0.5, 0.0])[:, 0]
    assert found == pytest.approx([1.5 * one, 3.0 * one, one, math.nan, math.nan], nan_ok=True)


def test_a_tide_is_not_added_to_a_current_that_has_one():
    wind, times = steady(0.0, -5.0), {"hourly": np.arange(0.0, 49.0, 1.0), "mean": np.arange(0.0, 49.0, 12.0)}
    here = STATIONS.replace("50.0", "0.0").replace("-6.0", "0.0")
    for name, hours in times.items():
        weather = Weather(
            wind=(cube(LAT0, LON0, [0.0, 48.0], wind),),
            current=(cube(LAT0, LON0, hours, steady(0.3, 0.0)),),
            tides=tides(here),
        )
        tide = tides(here)[1].at(T0 + 7200.0, 0.0, 0.0)
        added = tide if name == "mean" else 0.0 * tide
        assert weather.current_en_mps(T0 + 7200.0, 0.0, 0.0) == pytest.approx([0.3 + added[0], added[1]], abs=1e-6)
        assert weather.current_en_mps(T0 + 7200.0, 1.5, 1.5) == pytest.approx([0.3, 0.0], abs=1e-6)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (
            ("M2 = [2.0, 350.0]", "M22 = [2.0, 350.0]"),
            "s.toml: station 'west': 'M22' is no constituent that is known here",
        ),
        (
            ("M2 = [2.0, 350.0]", "M2 = [-2.0, 350.0]"),
            "s.toml: station[0].height.waves.M2[0]: expected a number of at least 0.0",
        ),
        (("lat = 50.0", "latt = 50.0"), "s.toml: station[0]: unknown key `latt`; see docs/reference/formats.md"),
        (("[[station]]", "[[stations]]"), "s.toml: "),
        (("[[station]]", "[station"), "s.toml: line 2, column 9: is not TOML"),
    ],
)
def test_what_is_wrong_with_a_station_is_said(words, said):
    with pytest.raises(InputError) as caught:
        tides(STATIONS.replace(*words))
    assert str(caught.value).startswith(said)


def test_a_table_for_a_mission(tmp_path, monkeypatch, capsys):

    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(STATIONS)
    span = ["--at", "50.0,-6.0", "--from", "2026-04-20T00:00Z", "--to", "2026-04-20T06:00Z"]
    assert cli.main(["weather", "tide", "s.toml", *span, "--every", "30m", "--out", "t.csv"]) == 0
    assert capsys.readouterr().out == "t.csv: written, 13 rows: name it in [area] tide of a mission\n"
    text = (tmp_path / "t.csv").read_text()
    rows = read_tide(text, "t.csv", row_times(text))
    assert [row.height_m for row in rows] == pytest.approx(
        tides()[0].at([row.utc_s for row in rows], 50.0, -6.0)[:, 0].tolist(), abs=6e-4
    )
    assert cli.main(["weather", "tide", "s.toml", "--stream", *span, "--every", "30m"]) == 0
    text = capsys.readouterr().out
    rows = read_table(text, "t.csv", row_times(text))
    flows = tides()[1].at([row.utc_s for row in rows], 50.0, -6.0)
    assert np.array([(r.east_mps, r.north_mps) for r in rows]) == pytest.approx(flows, abs=2e-3)
    assert len(table_lines(text)) == 13
    assert cli.main(["weather", "tide", "s.toml", *span, "--every", "1.5m"]) == 0
    assert capsys.readouterr().out.splitlines()[2].startswith("2026-04-20T00:01:30Z, ")  # and not 00:01Z
    far = [*span[:1], "48.0,-6.0", *span[2:]]
    assert cli.main(["weather", "tide", "s.toml", *span[:4], "--to", "2026-04-19T00:00Z"]) == 2
    assert capsys.readouterr().err.startswith("companion weather tide: --to: is not later than --from; ")
    assert cli.main(["weather", "tide", "s.toml", *far]) == 2
    assert "no height of a tide is known there" in capsys.readouterr().err


def test_stations_beside_a_forecast_are_told(tmp_path, monkeypatch, capsys):
    from tests.weather.grib_file import wind_2

    monkeypatch.chdir(tmp_path)
    (tmp_path / "s.toml").write_text(STATIONS)
    lat, lon = np.linspace(48.0, 52.0, 5), np.linspace(-8.0, 2.0, 11)
    (tmp_path / "f.grb2").write_bytes(b"".join(wind_2(lat, lon, h, 0.0, -4.0) for h in (0, 6)))
    assert cli.main(["weather", "show", "f.grb2", "s.toml", "--at", "50.0,-6.0"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert "tide, height, by 2 constituents: M2 S2" in lines
    assert "  2 stations, 50.00 N to 50.00 N, 6.00 W to 5.70 W; within 30 km of one" in lines
    assert "  1 station, 50.00 N, 6.00 W; within 30 km of one" in lines
    [height], stream = (tide.at(T0, 50.0, -6.0) for tide in tides())
    assert lines[-2].endswith(f"{abs(stream[0]):.2f} to {90 if stream[0] > 0.0 else 270:03d}  {height:.2f}")
    assert cli.main(["weather", "show", "s.toml"]) == 0
    assert iso(T0) == "2026-04-20T00:00Z"
