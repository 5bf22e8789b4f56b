"""A route in 270 bytes: there and back, sealed, in part where it is longer."""

import dataclasses

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.messages import GeoPoint
from companion.orders.far import MOST_BYTES, FarKey, FarPlace, FarRoute, pack_route, unpack_route
from companion.orders.far.route import MOST_PLACES

KEY = FarKey(bytes(range(32)), 1)
NOW = 1_776_643_200.0  # a whole minute


def route(count=5, **more):
    places = tuple(
        FarPlace(
            point=GeoPoint(lat_deg=47.0 + 0.1 * k, lon_deg=-6.0 - 0.2 * k),
            band_m=300.0 * k,
            middle_s=3000.0 * k,
            early_s=600.0 * k,
            late_s=2000.0 * k,
        )
        for k in range(count)
    )
    return FarRoute(departs_utc_s=NOW, base_utc_s=NOW - 21_600.0, members=31, places=places, **more)


def test_there_and_back():
    sent = route()
    data = pack_route(sent, KEY)
    assert len(data) == 10 + 5 * 11 + 8
    back = unpack_route(data, KEY)
    assert (back.departs_utc_s, back.base_utc_s, back.members, back.left_out) == (NOW, NOW - 21_600.0, 31, 0)
    for one, two in zip(sent.places, back.places, strict=True):
        assert two.point.lat_deg == pytest.approx(one.point.lat_deg, abs=1.3e-5)
        assert two.point.lon_deg == pytest.approx(one.point.lon_deg, abs=1.3e-5)
        assert one.band_m - 100.0 <= two.band_m <= one.band_m
        assert two.middle_s == one.middle_s
        assert one.early_s <= two.early_s <= one.early_s + 1800.0
        assert one.late_s <= two.late_s <= one.late_s + 1800.0


def test_a_long_route_is_sent_in_part_and_no_leg_is_made_up():
    data = pack_route(route(40), KEY)
    assert MOST_BYTES - 11 < len(data) <= MOST_BYTES
    back = unpack_route(data, KEY)
    assert (len(back.places), back.left_out) == (MOST_PLACES, 40 - MOST_PLACES)
    assert back.places[-1].point.lat_deg == pytest.approx(47.0 + 0.1 * (MOST_PLACES - 1), abs=1e-4)


@given(
    st.floats(-90.0, 90.0),
    st.floats(-180.0, 180.0),
    st.floats(0.0, 1e6),
    st.none() | st.floats(0.0, 1e8),
    st.floats(0, 1e9),
)
def test_what_does_not_fit_is_the_nearest_and_never_unknown(lat, lon, band, middle, late):
    place = FarPlace(point=GeoPoint(lat_deg=lat, lon_deg=lon), band_m=band, middle_s=middle, early_s=0.0, late_s=late)
    [back] = unpack_route(pack_route(dataclasses.replace(route(), places=(place,)), KEY), KEY).places
    assert back.point.lat_deg == pytest.approx(lat, abs=1.3e-5)
    assert back.point.lon_deg == pytest.approx(lon, abs=1.3e-5)
    assert back.band_m <= max(band, 0.0)
    assert (back.middle_s is None) == (middle is None)


def test_what_is_not_ours_is_refused():
    data = pack_route(route(), KEY)
    for wrong, said in (
        (bytes([data[0] ^ 1]) + data[1:], "code is wrong"),
        (data[:-1], "no route"),
        (data[:18], "no route"),
        (pack_route(route(), FarKey(bytes(32), 1)), "code is wrong"),
        (pack_route(route(), FarKey(KEY.key, 2)), "code is wrong"),
        (KEY.sealed("order", data[:-8]), "code is wrong"),
        (KEY.sealed("route", bytes([9]) + data[1:-8]), "of version 9"),
        (KEY.sealed("route", data[:8] + bytes([4]) + data[9:-8]), "says 4 places and has 5"),
    ):
        with pytest.raises(ValueError, match=said):
            unpack_route(wrong, KEY)
    with pytest.raises(ValueError, match="has places"):
        pack_route(dataclasses.replace(route(), places=()), KEY)


@pytest.mark.parametrize(
    ("band_m", "told_m"), [(99.0, 0.0), (100.0, 100.0), (199.0, 100.0), (300.0, 300.0), (500.0, 500.0)]
)
def test_a_band_is_rounded_down_and_a_whole_one_is_itself(band_m, told_m):
    place = FarPlace(point=GeoPoint(lat_deg=1.0, lon_deg=1.0), band_m=band_m)
    assert carried(place).band_m == told_m


@pytest.mark.parametrize(
    ("late_s", "told_s"), [(0.0, 0.0), (1.0, 1800.0), (1800.0, 1800.0), (5400.0, 5400.0), (5401.0, 7200.0)]
)
def test_doubt_is_rounded_up_and_a_whole_half_hour_is_itself(late_s, told_s):
    place = FarPlace(point=GeoPoint(lat_deg=1.0, lon_deg=1.0), band_m=0.0, middle_s=0.0, early_s=late_s, late_s=late_s)
    back = carried(place)
    assert (back.early_s, back.late_s) == (told_s, told_s)


def carried(place):
    """Return a place as it is read ashore."""
    route = FarRoute(departs_utc_s=1.9e9, base_utc_s=1.9e9, members=1, places=(place,))
    return unpack_route(pack_route(route, KEY), KEY).places[0]
