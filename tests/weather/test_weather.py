"""The value ``Weather``: what it says within its edges, and that it says nothing beyond them."""

import math

import numpy as np
import pytest

from companion.errors import InputError
from companion.weather import Cube, Weather, assemble, holes_of, iso, walk
from tests.weather.grib_file import CURRENT_EAST, CURRENT_NORTH, GUST, WIND_EAST, message_1, message_2, wind_2

LAT, LON = np.linspace(48.0, 52.0, 5), np.linspace(-8.0, 2.0, 11)
T0 = 1776643200.0  # 2026-04-20T00:00Z
HOUR = 3600.0


def weather_of(*messages, box=None):
    return assemble([f for n, m in enumerate(messages) for f in walk(m, f"{n}.grb")], box)


def test_the_base_time_of_these_tests():
    assert iso(T0) == "2026-04-20T00:00Z"


def test_components_are_interpolated_and_not_directions():
    """From a northerly to a southerly of 6 m/s: in the middle it is calm, and not 6 m/s from some side."""
    weather = weather_of(wind_2(LAT, LON, 0, 0.0, -6.0), wind_2(LAT, LON, 6, 0.0, 6.0))
    [[wind]] = weather.wind_en_mps([T0 + 3 * HOUR], 50.0, -3.0)
    assert np.hypot(*wind) == pytest.approx(0.0, abs=1e-3)


def test_it_is_linear_in_place_and_time():
    y, x = np.meshgrid(LAT, LON, indexing="ij")
    weather = weather_of(wind_2(LAT, LON, 0, y - 50.0, x), wind_2(LAT, LON, 3, y - 47.0, x))
    [[wind]] = weather.wind_en_mps([T0 + HOUR], 49.3, -4.4)
    assert wind == pytest.approx([-0.7 + 1.0, -4.4], abs=2e-3)


@pytest.mark.parametrize(
    ("hours", "lat", "lon", "why"),
    [
        (-0.1, 50.0, -3.0, "before the forecast's begin, 2026-04-20T00:00Z"),
        (12.1, 50.0, -3.0, "after the forecast's end, 2026-04-20T12:00Z"),
        (6.0, 52.1, -3.0, "outside the area of the forecast"),
        (6.0, 47.9, -3.0, "outside the area of the forecast"),
        (6.0, 50.0, -8.1, "outside the area of the forecast"),
        (6.0, 50.0, 2.1, "outside the area of the forecast"),
        (6.0, 50.0, 177.0, "outside the area of the forecast"),
        (6.0, 50.0, -3.0, ""),
        (12.0, 52.0, 2.0, ""),
    ],
)
def test_beyond_its_edges_nothing_is_known(hours, lat, lon, why):
    weather = weather_of(*(wind_2(LAT, LON, h, 1.0, 2.0) for h in (0, 6, 12)))
    wind = weather.wind_en_mps([T0 + hours * HOUR], lat, lon)
    assert np.isnan(wind).all() == bool(why)
    assert weather.why_unknown(T0 + hours * HOUR, lat, lon) == why


def test_a_step_that_is_missing_is_a_hole_and_longer_steps_are_none():
    hours = np.array([0.0, 3.0, 6.0, 12.0, 15.0, 18.0])
    assert holes_of(hours * HOUR) == ((6 * HOUR, 12 * HOUR),)
    assert holes_of(np.array([0.0, 1.0, 2.0, 5.0, 8.0, 11.0, 17.0, 23.0]) * HOUR) == ()
    assert holes_of(np.array([0.0, 24.0]) * HOUR) == ((0.0, 24 * HOUR),)
    weather = weather_of(*(wind_2(LAT, LON, h, float(h), 0.0) for h in hours.astype(int)))
    assert weather.why_unknown(T0 + 9 * HOUR, 50.0, -3.0) == "in a gap of the forecast"
    assert weather.why_unknown(T0 + 6 * HOUR, 50.0, -3.0) == ""
    assert weather.why_unknown(T0 + 12 * HOUR, 50.0, -3.0) == ""


def test_the_newest_run_counts_and_an_older_one_before_it_after_it_and_in_its_holes():
    old = [wind_2(LAT, LON, h, 1.0, 0.0) for h in range(0, 37, 2)]
    new = [wind_2(LAT, LON, h, 9.0, 0.0, base="2026-04-20T06:00") for h in (0, 3, 6, 15, 18, 21)]
    weather = weather_of(*new, *old)
    [cube] = weather.wind
    said = {(t - T0) / HOUR: (b - T0) / HOUR for t, b in zip(cube.utc_s, cube.base_utc_s, strict=True)}
    assert [h for h, base in said.items() if base == 6] == [6, 9, 12, 21, 24, 27]
    assert [h for h, base in said.items() if base == 0] == [0, 2, 4, 14, 16, 18, 20, 28, 30, 32, 34, 36]
    assert weather.wind_en_mps([T0 + 10.5 * HOUR], 50.0, -3.0)[0, 0, 0] == pytest.approx(9.0)


def test_members_are_kept_apart():
    messages = [wind_2(LAT, LON, h, float(m), 0.0, member=m) for h in (0, 6) for m in range(1, 6)]
    weather = weather_of(*messages)
    assert weather.members == (1, 2, 3, 4, 5)
    assert weather.wind_en_mps([T0 + HOUR], 50.0, 0.0)[:, 0, 0] == pytest.approx([1, 2, 3, 4, 5])


def test_a_member_that_lacks_a_time_is_unknown_then_and_the_others_are_not():
    messages = [wind_2(LAT, LON, h, 1.0, 0.0, member=m) for h in (0, 6, 12) for m in (1, 2) if (h, m) != (6, 2)]
    weather = weather_of(*messages)
    assert np.isnan(weather.wind_en_mps([T0 + 6 * HOUR], 50.0, 0.0)[:, 0, 0]).tolist() == [False, True]
    assert weather.why_unknown(T0 + 6 * HOUR, 50.0, 0.0) == ""


def test_a_component_alone_is_refused():
    with pytest.raises(
        InputError, match=r"^0.grb: message 1: is wind to the east without its wind to the north; fetch"
    ):
        weather_of(message_2(WIND_EAST, np.ones((5, 11)), LAT, LON))


@pytest.mark.parametrize("speed", [9999.0, 250.0])
def test_wind_that_no_wind_is_is_refused(speed):
    with pytest.raises(InputError, match=r"message 1: wind to the east is up to .* m/s; it is of another unit"):
        weather_of(wind_2(LAT, LON, 0, speed, 1.0))


def test_the_date_line_is_no_edge():
    lon = np.arange(170.0, 191.0)
    y, x = np.meshgrid(LAT, lon, indexing="ij")
    weather = weather_of(wind_2(LAT, lon, 0, x - 180.0, y))
    asked = np.array([179.5, 180.0, -180.0, -179.5, 180.5])
    assert weather.wind_en_mps(T0, 50.0, asked)[0, :, 0] == pytest.approx([-0.5, 0.0, 0.0, 0.5, 0.5], abs=1e-3)


def test_a_grid_round_the_earth_has_no_seam():
    lat, lon = np.linspace(-90.0, 90.0, 19), np.arange(0.0, 360.0, 10.0)
    _, x = np.meshgrid(lat, lon, indexing="ij")
    weather = weather_of(wind_2(lat, lon, 0, 5.0 * np.cos(np.radians(x)), 5.0 * np.sin(np.radians(x))))
    assert weather.wind[0].is_round
    got = weather.wind_en_mps(T0, 10.0, np.array([-5.0, 355.0, -1e-13, 359.999]))[0]
    assert got[:, 1] == pytest.approx([-0.434, -0.434, 0.0, 0.0], abs=2e-3)
    assert not np.isnan(got).any()


def test_a_box_is_read_with_a_cell_round_it_over_any_seam():
    lat, lon = np.linspace(-90.0, 90.0, 181), np.arange(0.0, 360.0)
    y, x = np.meshgrid(lat, lon, indexing="ij")
    whole = wind_2(lat, lon, 0, y / 10.0, np.where(x > 180.0, x - 360.0, x) / 10.0)
    part = weather_of(whole, box=(-10.5, 40.2, 5.5, 50.0))
    [cube] = part.wind
    assert (cube.lat_deg[0], cube.lat_deg[-1]) == (40.0, 51.0)
    assert (cube.lon_deg[0], cube.lon_deg[-1]) == (-11.0, 6.0)
    at = ([T0] * 3, [45.3, 40.2, 50.0], [-0.5, -10.5, 5.5])
    assert part.wind_en_mps(*at) == pytest.approx(weather_of(whole).wind_en_mps(*at))
    assert part.wind_en_mps(*at)[0, :, 1] == pytest.approx([-0.05, -1.05, 0.55], abs=1e-3)


def test_of_two_grids_the_finer_counts_where_it_knows():
    fine = np.linspace(-4.0, -2.0, 9)
    weather = weather_of(
        wind_2(LAT, LON, 0, 1.0, 0.0), wind_2(np.linspace(49.0, 50.0, 5), fine, 0, 2.0, 0.0, base="2026-04-20T00:00")
    )
    assert weather.wind_en_mps(T0, 49.5, np.array([-3.0, 0.0]))[0, :, 0] == pytest.approx([2.0, 1.0])


def test_land_under_a_current_is_unknown_and_poisons_no_place_of_water():
    """A weight of nothing times unknown is nothing: a place on the last column of water is known."""
    east = np.ones((5, 11))
    east[:, 6:] = np.nan
    data = b"".join(message_2(q, east, LAT, LON, level=(160, 0)) for q in (CURRENT_EAST, CURRENT_NORTH))
    weather = weather_of(wind_2(LAT, LON, 0, 1.0, 0.0), data)
    current = weather.current_en_mps(T0, 50.0, LON[[5, 6]] + [0.0, 0.0])
    assert np.isnan(current[:, 0]).tolist() == [False, True]
    assert np.isnan(weather.current_en_mps(T0, 50.0, [0.5 * (LON[5] + LON[6])])).all()


def test_gusts_are_their_own_members():
    gust = message_2(GUST, np.full((5, 11), 12.0), LAT, LON, 6, over_h=6, member=3)
    weather = weather_of(wind_2(LAT, LON, 6, 7.0, 0.0), gust)
    assert weather.gust_mps([T0 + 6 * HOUR], 50.0, -3.0).tolist() == [[12.0]]
    assert weather.gust[0].interval_s == 6 * HOUR


def test_more_than_memory_is_refused_before_it_is_taken():
    fields = list(walk(b"".join(wind_2(LAT, LON, h, 1.0, 2.0) for h in (0, 6, 9)), "0.grb"))
    with pytest.raises(InputError, match=r"GB unpacked; say a smaller area \(--box\)"):
        assemble(fields, most_bytes=1319)
    assert assemble(fields, most_bytes=1320).wind[0].values.nbytes == 1320


def test_a_cube_is_checked_and_cannot_be_changed():
    ok = {"utc_s": np.zeros(1), "base_utc_s": np.zeros(1), "members": (0,), "lat_deg": np.arange(2.0),
          "lon_deg": np.arange(2.0), "values": np.zeros((1, 1, 2, 2, 2), dtype=np.float32)}  # fmt: skip
    cube = Cube(**ok)
    with pytest.raises(ValueError, match="read-only"):
        cube.values[0, 0, 0, 0, 0] = math.nan
    with pytest.raises(ValueError, match="increase strictly"):
        Cube(**{**ok, "lat_deg": np.array([1.0, 0.0])})
    with pytest.raises(ValueError, match="are not of"):
        Cube(**{**ok, "members": (0, 1)})


def test_the_height_of_the_sea_of_both_editions():
    still = np.full((5, 11), 2.5)
    sea = [message_2((10, 0, 3), still + m, LAT, LON, level=(1, 0), member=m) for m in (1, 2)]
    weather = weather_of(*(wind_2(LAT, LON, 0, 0.0, -6.0, member=m) for m in (1, 2, 3)), *sea)
    assert weather.waves_m(T0, 50.0, -3.0).ravel() == pytest.approx([3.5, 4.5, 3.5], abs=1e-3)  # of 3 nothing is said
    for code in ({"parameter": 100}, {"parameter": 229, "center": 98, "table": 140}):
        old = weather_of(
            message_1(code.pop("parameter"), still, LAT, LON, level=(102, 0), **code), wind_2(LAT, LON, 0, 0.0, -6.0)
        )
        assert old.waves_m(T0, 50.0, -3.0) == pytest.approx([2.5], abs=1e-3)
        assert np.isnan(old.waves_m(T0, 53.0, -3.0)).all()
    with pytest.raises(InputError, match="wave height is up to 55 m; it is of another unit"):
        weather_of(message_2((10, 0, 3), np.full((5, 11), 55.0), LAT, LON, level=(1, 0)))


def test_one_member_or_their_mean():
    weather = weather_of(*(wind_2(LAT, LON, 0, 1.0, -6.0 - m, member=m) for m in (1, 2)),
                         wind_2(LAT, LON, 3, 1.0, -9.0, member=2))  # fmt: skip
    assert weather.only(2).members == (2,)
    assert weather.only(2).wind_en_mps(T0, 50.0, -3.0).ravel() == pytest.approx([1.0, -8.0], abs=1e-3)
    mean = weather.mean()
    assert mean.members == (0,)
    assert mean.wind_en_mps([T0, T0 + 3 * HOUR], 50.0, -3.0)[0, :, 1] == pytest.approx([-7.5, -9.0], abs=1e-3)


def test_many_times_at_once_are_what_each_of_them_says():
    """Over a finer grid that knows less, holes, edges, a bitmap and the date line; between times and on them."""
    draw = np.random.default_rng(3)
    lon = np.linspace(176.0, 184.0, 9)
    values = draw.normal(0.0, 8.0, (2, 5, 5, 9, 2)).astype(np.float32)
    values[0, 2, 1, 3] = math.nan
    times = T0 + HOUR * np.array([0.0, 6.0, 12.0, 30.0, 36.0])
    cube = Cube(utc_s=times, base_utc_s=np.full(5, T0), members=(0, 3), lat_deg=LAT.copy(), lon_deg=lon, values=values)
    fine = Cube(
        utc_s=times[1:3].copy(),
        base_utc_s=np.full(2, T0),
        members=(3,),
        lat_deg=LAT[:2].copy(),
        lon_deg=lon[:3].copy(),
        values=draw.normal(0.0, 8.0, (1, 2, 2, 3, 2)).astype(np.float32),
    )
    weather = Weather(wind=(fine, cube))
    lat = np.append(draw.uniform(47.5, 52.5, 60), [48.0, 50.0, 52.0])
    east = np.append(draw.uniform(175.5, 184.5, 60), [176.0, -180.0, -176.0])
    asked = T0 + HOUR * np.array([-1.0, 0.0, 1.5, 6.0, 9.0, 12.0, 20.0, 31.0, 36.0, 36.5])
    found = weather.wind_over(asked, lat, east)
    for k, t in enumerate(asked):
        assert found[:, k] == pytest.approx(weather.wind_en_mps(t, lat, east), abs=1e-4, nan_ok=True)
    assert 0.1 < np.isnan(found).mean() < 0.9
