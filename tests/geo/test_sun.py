"""The sun's height, against times and heights that almanacs print."""

import datetime as dt
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.skipper.watch.measures import sun_height_rad


def height_deg(lat_deg, lon_deg, *when):
    unix_s = dt.datetime(*when, tzinfo=dt.UTC).timestamp()
    return math.degrees(sun_height_rad(math.radians(lat_deg), math.radians(lon_deg), unix_s))


@pytest.mark.parametrize(
    ("place", "when", "expected_deg"),
    [
        ((51.478, 0.0), (2026, 6, 21, 12, 2), 90.0 - 51.478 + 23.44),  # noon of the longest day at Greenwich
        ((51.478, 0.0), (2026, 12, 21, 11, 58), 90.0 - 51.478 - 23.44),
        ((51.507, -0.128), (2026, 3, 20, 18, 14), -0.83),  # London's sunset: half a disc and refraction
        ((-33.868, 151.209), (2026, 12, 22, 1, 53), 90.0 - 33.868 + 23.44),  # noon at Sydney
        ((0.0, 0.0), (2026, 3, 20, 14, 46), 90.0 - 39.6),  # the equinox, 0.2 h + 2.44 h past noon
    ],
)
def test_it_stands_where_an_almanac_has_it(place, when, expected_deg):
    assert height_deg(*place, *when) == pytest.approx(expected_deg, abs=0.3)


@given(st.floats(-1.57, 1.57), st.floats(-3.2, 3.2), st.floats(1.6e9, 2.4e9))
def test_it_is_a_height_and_the_other_side_of_the_earth_has_its_opposite(lat_rad, lon_rad, unix_s):
    here = sun_height_rad(lat_rad, lon_rad, unix_s)
    assert -0.5 * math.pi <= here <= 0.5 * math.pi
    assert sun_height_rad(-lat_rad, lon_rad + math.pi, unix_s) == pytest.approx(-here, abs=1e-6)
