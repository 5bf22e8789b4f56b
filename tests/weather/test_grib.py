"""GRIB files read: headers, packings, scanning; what is not understood is refused by name."""

import numpy as np
import pytest

from companion.errors import InputError
from companion.weather import Quantity, iso, values_of, walk
from tests.weather.grib_file import CURRENT_EAST, GUST, WIND_EAST, WIND_NORTH, message_1, message_2

LAT, LON = np.linspace(-2.0, 3.0, 6), np.linspace(170.0, 190.0, 9)
VALUES = np.random.default_rng(3).normal(0.0, 8.0, (6, 9))
STEP = np.ptp(VALUES) / 2**14  # of 16 bits, whose scale is a power of two


def one(data):
    [field] = walk(data, "f.grb")
    return field


def read(data):
    return [values_of(field) for field in walk(data, "f.grb")]


def refusal(data):
    with pytest.raises(InputError) as caught:
        read(data)
    return str(caught.value)


@pytest.mark.parametrize("make", [lambda **k: message_2(WIND_EAST, VALUES, LAT, LON, 6, **k),
                                  lambda **k: message_1(33, VALUES, LAT, LON, 6, **k)])  # fmt: skip
@pytest.mark.parametrize("scan", [0x00, 0x40, 0x80, 0x20, 0xE0, 0x10, 0x50, 0x30])
def test_a_field_is_read_however_it_is_scanned(make, scan):
    field = one(make(scan=scan))
    assert field.quantity is Quantity.WIND_EAST
    assert iso(field.valid_utc_s) == "2026-04-20T06:00Z"
    assert values_of(field) == pytest.approx(VALUES, abs=STEP)
    assert field.grid.latitudes_deg() == pytest.approx(LAT)
    assert field.grid.longitudes_deg() == pytest.approx(LON)


@pytest.mark.parametrize("bits", [8, 11, 12, 16, 24])
@pytest.mark.parametrize("edition", [1, 2])
def test_any_number_of_bits_is_unpacked(bits, edition):
    make = message_1 if edition == 1 else message_2
    field = one(make(33 if edition == 1 else WIND_EAST, VALUES, LAT, LON, bits=bits))
    assert values_of(field) == pytest.approx(
        VALUES, abs=1.01 * np.ptp(VALUES) / 2 ** (bits - 1) + 2e-5
    )  # a float of IBM's has 21 bits


@pytest.mark.parametrize("edition", [1, 2])
def test_what_a_bitmap_leaves_out_is_unknown(edition):
    holed = np.where(VALUES > 8.0, np.nan, VALUES)
    assert 0 < np.isnan(holed).sum() < holed.size
    found = values_of(one(message_1(33, holed, LAT, LON) if edition == 1 else message_2(WIND_EAST, holed, LAT, LON)))
    assert (np.isnan(found) == np.isnan(holed)).all()
    assert found[~np.isnan(found)] == pytest.approx(holed[~np.isnan(holed)], abs=STEP)


def test_time_range_10_of_edition_1_is_of_two_octets():
    """A reader that takes one octet gives the base time, or 44 h for 300."""
    assert iso(one(message_1(33, VALUES, LAT, LON, 300, kind=10)).valid_utc_s) == "2026-05-02T12:00Z"


def test_a_century_ends_with_its_hundredth_year():
    assert (
        iso(one(message_1(33, VALUES, LAT, LON, base="2000-12-31T18:00", hours=12)).valid_utc_s) == "2001-01-01T06:00Z"
    )


def test_members_of_both_editions():
    assert one(message_2(WIND_EAST, VALUES, LAT, LON, member=17)).member == 17
    assert one(message_2(GUST, VALUES - VALUES.min(), LAT, LON, 6, member=18, over_h=3)).member == 18
    data = message_1(165, VALUES, LAT, LON, center=98, table=128, level=(1, 0), member=19)
    assert (one(data).member, one(data).quantity) == (19, Quantity.WIND_EAST)


def test_a_gust_is_of_the_hours_before_its_time():
    field = one(message_2(GUST, VALUES - VALUES.min(), LAT, LON, 9, over_h=3))
    assert (iso(field.valid_utc_s), field.interval_s) == ("2026-04-20T09:00Z", 10_800.0)


def test_one_number_means_different_things_in_different_tables():
    assert one(message_1(49, VALUES, LAT, LON, level=(1, 0))).quantity is Quantity.CURRENT_EAST
    assert one(message_1(49, VALUES, LAT, LON, center=98, table=128, level=(1, 0))).quantity is Quantity.GUST
    assert one(message_1(33, VALUES, LAT, LON, center=98, table=128)).quantity is None


def test_wind_at_another_height_is_not_wind_of_10_m():
    assert one(message_2(WIND_EAST, VALUES, LAT, LON, level=(103, 80))).quantity is None
    assert one(message_2(WIND_EAST, VALUES, LAT, LON, level=(100, 85000))).quantity is None
    assert one(message_1(33, VALUES, LAT, LON, level=(100, 850))).quantity is None
    assert one(message_2(CURRENT_EAST, VALUES, LAT, LON, level=(160, 0))).quantity is Quantity.CURRENT_EAST


def test_two_fields_of_one_message_are_two():
    """Sections 4 to 7 come again; what does not come again holds on (NCEP's pairs of components)."""
    first, second = message_2(WIND_EAST, VALUES, LAT, LON, 3), message_2(WIND_NORTH, -VALUES, LAT, LON, 3)
    again = second[16 + 21 + 72 : -4]
    body = first[16:-4] + again + b"7777"
    data = first[:8] + (16 + len(body)).to_bytes(8, "big") + body
    east, north = walk(data, "f.grb")
    assert (east.quantity, north.quantity, north.number) == (Quantity.WIND_EAST, Quantity.WIND_NORTH, 1)
    assert values_of(north) == pytest.approx(-VALUES, abs=STEP)
    assert north.valid_utc_s == east.valid_utc_s


def test_bytes_between_messages_are_skipped():
    data = b"FQUS51 KWBC\r\n" + message_1(33, VALUES, LAT, LON) + b"\0\r\n" + message_1(34, VALUES, LAT, LON)
    assert [f.number for f in walk(data, "f.grb")] == [1, 2]


MESSAGE = message_2(WIND_EAST, VALUES, LAT, LON)


@pytest.mark.parametrize(
    ("data", "said"),
    [
        (b"", "f.grb: is empty; fetch it again, or name another file"),
        (b"?", "f.grb: holds no GRIB message; name a GRIB file (.grb, .grib2)"),
        (b"BZh91AY", "f.grb: is compressed; unpack it first (bunzip2)"),
        (
            MESSAGE + MESSAGE[:100],
            f"f.grb: message 2: is cut off: 100 of its {len(MESSAGE)} bytes are there; fetch the file again",
        ),
        (MESSAGE + b"GRIB", "f.grb: message 2: is cut off; fetch the file again"),
        (
            MESSAGE[:-4] + b"7778",
            "f.grb: message 1: does not end where it says (no 7777); it is damaged: fetch it again",
        ),
        (MESSAGE[:7] + b"\3" + MESSAGE[8:], "f.grb: message 1: is of GRIB edition 3; only 1 and 2 are known"),
        (
            message_2(WIND_EAST, VALUES, LAT, LON, template=30),
            "f.grb: message 1: has a grid that is not read (Lambert); ask for latitudes and longitudes",
        ),
        (
            message_1(33, VALUES, LAT, LON, grid_type=4),
            "f.grb: message 1: has a grid that is not read (Gaussian); ask for latitudes and longitudes",
        ),
        (
            message_2(WIND_EAST, VALUES, LAT, LON, product=60),
            "f.grb: message 1: is a product that is not read (4.60); ask for one of 4.0, 4.1, 4.8, 4.11",
        ),
        (
            message_1(33, VALUES, LAT, LON, 6, kind=3),
            "f.grb: message 1: is over an interval (indicator 3), where it should be of a time; leave it out",
        ),
        (
            MESSAGE[: 16 + 14] + b"\x0d" + MESSAGE[16 + 15 :],
            "f.grb: message 1: 2026-13-20 00:00 is no time; it is damaged: fetch it again",
        ),
    ],
)  # fmt: skip
def test_what_is_not_understood_is_refused_by_name(data, said):
    assert refusal(data) == said


@pytest.mark.parametrize("edition", [1, 2])
def test_a_damaged_file_is_refused_or_read_and_never_ends_in_a_traceback(edition):
    good = message_1(33, VALUES, LAT, LON) if edition == 1 else MESSAGE
    rng = np.random.default_rng(8)
    refused = []
    for _ in range(400):
        bad = bytearray(good)
        for at in rng.integers(8 if edition == 1 else 16, len(good) - 4, 3):
            bad[at] = rng.integers(256)
        try:
            for field in walk(bytes(bad), "f.grb"):
                if field.quantity is not None:
                    assert values_of(field).shape == (field.grid.rows, field.grid.columns)
        except InputError as error:
            refused.append(str(error))
    assert len(refused) > 50
    assert all(line.startswith("f.grb: message ") for line in refused)
