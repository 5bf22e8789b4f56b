"""Currents, winds and atlases of netCDF and Zarr: units, times, depths, seams, what is refused and by what remedy."""

import subprocess
import sys

import numpy as np
import pytest

from companion import cli
from companion.errors import InputError
from companion.weather import phasors, read_weather
from companion.weather.gridded import Stored, _unix_s
from tests.passage.world import T0

h5py = pytest.importorskip("h5py")
zarr = pytest.importorskip("zarr")

LAT, LON = np.linspace(50.0, 52.0, 5), np.linspace(-2.0, 2.0, 9)
HOURS = np.arange(0.0, 25.0, 6.0)


def variables(
    lat=LAT, lon=LON, hours=HOURS, *, units="m s-1", since="hours since 2026-04-20 00:00:00", depths=(0.5, 5.0)
):
    """A current of 0.1 m/s to the east and a hundredth of the latitude to the north, half of it below."""
    shape = (len(hours), len(depths), len(lat), len(lon))
    east = np.full(shape, 0.1)
    north = np.broadcast_to(0.01 * np.asarray(lat)[:, None], shape).copy()
    below = np.where(np.arange(len(depths)) == int(np.argmin(depths)), 1.0, 0.5)[:, None, None]
    packed = {"scale_factor": 0.001, "add_offset": 0.0, "_FillValue": np.int16(-32767), "units": units}
    dims = ("time", "depth", "latitude", "longitude")
    east, north = (np.rint(v * below * 1000.0).astype(np.int16) for v in (east, north))
    east[:, :, 0, 0] = -32767
    return {
        "time": (("time",), np.asarray(hours, dtype=float), {"units": since, "standard_name": "time"}),
        "depth": (("depth",), np.asarray(depths, dtype=float), {"units": "m", "positive": "down"}),
        "latitude": (("latitude",), np.asarray(lat, dtype=np.float32), {"units": "degrees_north"}),
        "longitude": (("longitude",), np.asarray(lon, dtype=np.float32), {"units": "degrees_east"}),
        "uo": (dims, east, {**packed, "standard_name": "eastward_sea_water_velocity"}),
        "vo": (dims, north, {**packed, "standard_name": "northward_sea_water_velocity"}),
    }


def netcdf(path, found):
    with h5py.File(path, "w") as file:
        for name, (dims, values, attrs) in found.items():
            data = file.create_dataset(
                name, data=values, compression="gzip" if values.ndim > 1 else None, shuffle=values.ndim > 1
            )
            data.attrs.update(attrs)
            if dims == (name,):
                data.make_scale(name)
        for name, (dims, _, _) in found.items():
            for k, dim in enumerate(dims):
                if dim != name and dim in found:
                    file[name].dims[k].attach_scale(file[dim])
    return path


def stored(path, found, version):
    group = zarr.open_group(str(path), mode="w", zarr_format=version)
    for name, (dims, values, attrs) in found.items():
        more = {"dimension_names": dims} if version == 3 else {}
        data = group.create_array(name, data=values, **more)
        data.attrs.update({k: v.item() if isinstance(v, np.generic) else v for k, v in attrs.items()})
        if version == 2:
            data.attrs["_ARRAY_DIMENSIONS"] = list(dims)
    return path


@pytest.fixture(params=["nc", "zarr2", "zarr3"])
def written(request, tmp_path):
    def write(found, name="c"):
        if request.param == "nc":
            return netcdf(tmp_path / f"{name}.nc", found)
        return stored(tmp_path / f"{name}.zarr", found, int(request.param[-1]))

    return write


def test_the_uppermost_current_is_read_and_unpacked(written):
    weather = read_weather([written(variables())])
    assert weather.current_en_mps(T0 + 3600.0, 51.25, 0.3) == pytest.approx([0.1, 0.5125], abs=2e-4)
    assert np.isnan(weather.current_en_mps(T0, 50.1, -1.9)).any()  # land
    assert np.isnan(weather.current_en_mps(T0 + 25.0 * 3600.0, 51.0, 0.0)).all()


def test_a_box_over_the_first_meridian_of_a_grid_that_counts_to_360(written):
    lon = np.arange(0.0, 360.0, 2.0)
    weather = read_weather([written(variables(lon=lon, lat=LAT[::-1]))], (-3.0, 50.4, 3.0, 51.0))
    [cube] = weather.current
    assert cube.lon_deg.tolist() == [-4.0, -2.0, 0.0, 2.0, 4.0]
    assert (cube.lat_deg[0], cube.lat_deg[-1]) == (50.0, 51.5)
    assert weather.current_en_mps(T0, 50.75, -0.5)[1] == pytest.approx(0.5075, abs=2e-4)


@pytest.mark.parametrize(
    "lon", [(-180.0, -179.0, -178.0, 178.0, 179.0), (178.0, 179.0, -180.0, -179.0, -178.0), (-178.0, 178.0)]
)
def test_a_grid_on_both_sides_of_the_date_line_knows_nothing_of_the_rest_of_the_earth(lon, tmp_path):
    """Of -180 to -178 and 178 to 179 the 356 degrees between were taken for one wide cell."""
    [cube] = read_weather([netcdf(tmp_path / "c.nc", variables(lon=np.array(lon)))]).current
    assert (cube.lon_deg[0], cube.lon_deg[-1]) == (178.0, 182.0)
    assert cube.covers(51.0, -179.5)
    assert cube.covers(51.0, 178.5)
    assert not cube.covers(51.0, 0.0)


def test_files_of_one_grid_are_one_and_the_last_counts(tmp_path):
    one = netcdf(tmp_path / "a.nc", variables())
    two = netcdf(tmp_path / "b.nc", variables(hours=HOURS + 24.0))
    weather = read_weather([one, two])
    [cube] = weather.current
    assert cube.utc_s.size == 9
    assert not np.isnan(weather.current_en_mps(T0 + 25.0 * 3600.0, 51.0, 0.0)).any()


def test_means_of_days_are_linear_between_them_and_have_no_tide(tmp_path):
    weather = read_weather([netcdf(tmp_path / "a.nc", variables(hours=(0.0, 24.0, 48.0)))])
    assert weather.current[0].is_tideless
    assert not np.isnan(weather.current_en_mps(T0 + 12.0 * 3600.0, 51.0, 0.0)).any()


def test_a_wind_of_members(tmp_path):
    found = variables()
    for name, of in (("u10", "uo"), ("v10", "vo")):
        _, values, attrs = found.pop(of)
        found[name] = (
            ("time", "number", "latitude", "longitude"),
            values,
            {**attrs, "standard_name": "", "units": "m s**-1"},
        )
    del found["depth"]
    found["number"] = (("number",), np.array([0.0, 1.0]), {"units": "1"})
    weather = read_weather([netcdf(tmp_path / "w.nc", found)])
    assert weather.members == (0, 1)
    assert weather.wind_en_mps(T0, 51.0, 0.0) == pytest.approx(np.array([[0.1, 0.51], [0.05, 0.255]]), abs=6e-4)


@pytest.mark.parametrize(
    ("since", "ahead_h"),
    [
        ("2026-04-20 00:00:00 +11:00", 11.0),
        ("2026-04-20T00:00:00+11:00", 11.0),
        ("2026-04-20 00:00 -3:30", -3.5),
        ("2026-04-20 +1100", 11.0),
        ("2026-04-20 00:00:00.0 +9", 9.0),
        ("2026-04-20 00:00:00 UTC", 0.0),
        ("2026-04-20T00:00:00Z", 0.0),
        ("2026-4-20", 0.0),
    ],
)
def test_hours_since_a_time_of_another_zone_are_counted_from_there(since, ahead_h):
    """What stands behind the hour was left out: a wind of Hobart's clock came eleven hours late."""
    dims, values, attrs = variables(since=f"hours since {since}")["time"]
    times = Stored(
        source="f.nc", name="time", dims=dims, shape=values.shape, attrs=attrs, read=lambda part: values[part]
    )
    assert _unix_s(times, "c.nc")[1] == T0 + (6.0 - ahead_h) * 3600.0


def changed(**more):
    found = variables()
    for name, change in more.items():
        dims, values, attrs = found[name]
        found[name] = change(dims, values, attrs)
    return found


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (variables(units="knots"), "c.nc: uo: is in 'knots'; fetch it in m s-1"),
        (variables(since="months since 2026-04-20"), "c.nc: time: is in 'months since 2026-04-20'"),
        (variables(since="hours since 2026-13-20"), "c.nc: time: counts from '2026-13-20', which is no date"),
        (variables(since="hours since 2026-04-20 00:00:00 AEDT"), "c.nc: time: counts from '2026-04-20 00:00:00 aedt'"),
        (variables(since="hours since 2026-04-20 00:00:00 +27:00"), "c.nc: time: counts from '2026-04-20 00:00:00 +27"),
        ({k: v for k, v in variables().items() if k != "vo"}, "c.nc: uo: is there without its other component"),
        ({k: v for k, v in variables().items() if k not in {"uo", "vo"}}, "c.nc: holds no current and no wind: "),
        (
            changed(latitude=lambda d, v, a: (d, v, {"units": "m"})),
            "c.nc: uo: is on no grid of latitudes and longitudes",
        ),
        (changed(depth=lambda d, v, a: (d, v, {"units": "1"})), "c.nc: uo: has a dimension 'depth' of 2"),
        (changed(uo=lambda d, v, a: (d, v, {**a, "scale_factor": 1.0})), "c.nc: uo: is up to 100 m/s"),
    ],
)
def test_what_is_wrong_is_said(found, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    netcdf(tmp_path / "c.nc", found)
    with pytest.raises(InputError) as caught:
        read_weather([(tmp_path / "c.nc").relative_to(tmp_path)])
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    ("name", "data", "said"),
    [
        ("c.nc", b"CDF\x01" + bytes(40), "c.nc: is netCDF 3; convert it: nccopy -k nc4 IN OUT"),
        ("c.nc", b"\x89HDF\r\n\x1a\n" + bytes(40), "c.nc: is no netCDF 4"),
        ("c.zip", b"PK", "c.zip: is no group of Zarr"),
    ],
)
def test_what_is_no_container_is_said(name, data, said, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    (tmp_path / name).write_bytes(data)
    assert cli.main(["weather", "show", name]) == 2
    assert capsys.readouterr().err.startswith(f"companion weather: {said}")


@pytest.mark.parametrize(("library", "name"), [("h5py", "c.nc"), ("zarr", "c.zarr")])
def test_without_the_extra_it_is_named(library, name, tmp_path):
    netcdf(tmp_path / "c.nc", variables())
    (tmp_path / "c.zarr").mkdir()
    alone = f"import sys; sys.modules[{library!r}] = None; from companion.cli import main; sys.exit(main())"
    done = subprocess.run(
        [sys.executable, "-c", alone, "weather", "show", name],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 1
    assert "pip install '.[currents]'" in done.stderr


def test_an_atlas_of_one_file_a_constituent(tmp_path, monkeypatch, capsys):
    """As FES2014 has them: Ua, Ug, Va, Vg in cm/s, heights in cm; land is missing."""
    grid = {k: v for k, v in variables(lon=np.arange(0.0, 360.0, 2.0)).items() if k in {"latitude", "longitude"}}
    shape, dims = (5, 180), ("latitude", "longitude")
    lag = np.broadcast_to(350.0 + 10.0 * np.arange(180) % 360.0, shape)  # 350 at the first meridian, 0 at the next
    for name, size in (("m2", 80.0), ("s2", 30.0)):
        stream = {
            k: (
                dims,
                np.full(shape, v) if np.ndim(v) == 0 else np.array(v),
                {"units": "cm/s" if k[1] == "a" else "degrees"},
            )
            for k, v in (("Ua", size), ("Ug", lag), ("Va", 0.0), ("Vg", 0.0))
        }
        stream["Ua"][1][0, 0] = np.nan
        (tmp_path / "eastward").mkdir(exist_ok=True)
        netcdf(tmp_path / "eastward" / f"{name}.nc", {**grid, **stream})
    monkeypatch.chdir(tmp_path)
    weather = read_weather([tmp_path / "eastward" / f"{name}.nc" for name in ("m2", "s2")])
    h = (0.8 * phasors(["M2"], [T0])[0, 0] + 0.3 * phasors(["S2"], [T0])[0, 0]) * np.exp(-1j * np.radians([350.0, 0.0]))
    assert weather.current_en_mps(T0, 51.0, 1.0) == pytest.approx([h.real.mean(), 0.0], abs=1e-5)
    assert np.isnan(weather.current_en_mps(T0, 50.1, -0.5)).any()
    assert cli.main(["weather", "show", "eastward/m2.nc", "eastward/s2.nc"]) == 0
    assert "tide, stream, by 2 constituents: M2 S2" in capsys.readouterr().out


@pytest.mark.parametrize(("rows", "columns"), [(1, 4), (4, 1)])
def test_an_atlas_without_an_area_is_refused(tmp_path, rows, columns):
    """A cut along one parallel ended in an IndexError at its first use; one along a meridian knew nothing."""
    dims, degrees = ("latitude", "longitude"), {"units": "degrees"}
    found = {
        "latitude": (("latitude",), 50.0 + np.arange(rows), {"units": "degrees_north"}),
        "longitude": (("longitude",), np.arange(columns) * 1.0, {"units": "degrees_east"}),
        "amplitude": (dims, np.ones((rows, columns)), {"units": "cm"}),
        "phase": (dims, np.zeros((rows, columns)), degrees),
    }
    netcdf(tmp_path / "m2.nc", found)
    told = f"m2.nc: amplitude: is a grid of {rows} x {columns}: no place lies between its points; cut a wider piece"
    with pytest.raises(InputError, match=told):
        read_weather([tmp_path / "m2.nc"])


def with_axis(name, values):
    found = variables(lat=[50.0, 50.5, 51.0], lon=[-2.0, -1.5, -1.0])
    return {**found, name: (found[name][0], np.array(values), found[name][2])}


@pytest.mark.parametrize(
    ("found", "said"),
    [
        (variables(hours=[0.0, 6.0, 6.0, 12.0]), "time: has the same value twice"),
        (variables(hours=[0.0, np.nan, 12.0]), "time: has values that are no numbers"),
        (variables(hours=[0.0, 1e300]), "time: has times that no forecast has"),
        (variables(lat=[50.0, 50.0, 51.0]), "latitude: has the same value twice"),
        (with_axis("latitude", [50.0, np.nan, 51.0]), "latitude: has values that are no numbers"),
        (with_axis("longitude", [-2.0, np.inf, -1.0]), "longitude: has values that are no numbers"),
    ],
)
def test_an_axis_that_cannot_be_is_one_line(found, said, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    with pytest.raises(InputError) as caught:
        read_weather([netcdf(tmp_path / "f.nc", found)])
    assert said in str(caught.value)
    assert "fetch it again" in str(caught.value)


def test_a_part_that_is_damaged_is_one_line(tmp_path):
    path = netcdf(tmp_path / "f.nc", variables())
    with h5py.File(path) as file:
        at = file["uo"].id.get_chunk_info(0).byte_offset
    data = bytearray(path.read_bytes())
    data[at : at + 16] = bytes(16)
    path.write_bytes(data)
    with pytest.raises(InputError, match="uo: cannot be read") as caught:
        read_weather([path])
    assert "\n" not in str(caught.value)
