"""Against other readers of GRIB: gribberish, and eccodes where it is installed, on made files and on real ones.

Real files are named by ``COMPANION_GRIB``, a folder; none are kept here.
"""

import os
from pathlib import Path

import numpy as np
import pytest

from companion.weather import values_of, walk
from tests.weather.grib_file import WIND_EAST, message_1, message_2

LAT, LON = np.linspace(-2.0, 3.0, 6), np.linspace(170.0, 190.0, 9)
VALUES = np.random.default_rng(5).normal(0.0, 8.0, (6, 9))
HOLED = np.where(VALUES > 9.0, np.nan, VALUES)
MADE = [message_2(WIND_EAST, HOLED, LAT, LON, 6), message_1(33, HOLED, LAT, LON, 6)]
REAL = sorted(p for p in Path(os.environ.get("COMPANION_GRIB", "nowhere")).glob("*") if p.is_file())


@pytest.mark.parametrize("data", MADE, ids=["2", "1"])
def test_gribberish_unpacks_the_same(data):
    gribberish = pytest.importorskip("gribberish")
    [field] = walk(data, "f.grb")
    theirs = np.asarray(gribberish.parse_grib_array(data, 0)).reshape(6, 9)[::-1]
    assert values_of(field) == pytest.approx(theirs, abs=1e-5, nan_ok=True)


@pytest.mark.parametrize("data", [*MADE, *REAL], ids=lambda d: getattr(d, "name", None))
def test_eccodes_reads_the_same(data):
    eccodes = pytest.importorskip("eccodes")
    if isinstance(data, Path):
        data = data.read_bytes()
    compared = 0
    for field in walk(data, "f.grb"):
        if field.quantity is None:
            continue
        handle = eccodes.codes_new_from_message(field.message)
        eccodes.codes_set(handle, "missingValue", 1e30)
        theirs = eccodes.codes_get_values(handle)
        rows = np.unique(eccodes.codes_get_array(handle, "latitudes"), return_inverse=True)[1]
        lon = eccodes.codes_get_array(handle, "longitudes")
        columns = np.unique((lon - field.grid.west_deg + 1e-4) % 360.0, return_inverse=True)[1]
        mine = values_of(field)[rows, columns]
        assert mine == pytest.approx(np.where(theirs == 1e30, np.nan, theirs), abs=1e-5, nan_ok=True)
        day, time = (eccodes.codes_get(handle, key) for key in ("validityDate", "validityTime"))
        utc = np.datetime64(f"{day // 10000:04}-{day // 100 % 100:02}-{day % 100:02}", "s").astype(int)
        assert field.valid_utc_s == utc + time // 100 * 3600 + time % 100 * 60
        if eccodes.codes_is_defined(handle, "perturbationNumber"):
            assert field.member == eccodes.codes_get(handle, "perturbationNumber")
        eccodes.codes_release(handle)
        compared += 1
    assert compared > 0 or isinstance(data, bytes)
