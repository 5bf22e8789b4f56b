"""The tide's heights between the rows of a table."""

import datetime as dt
from pathlib import Path

import pytest

from companion.compose import config_of
from companion.current import TideRow, TideTable, closed_spans, lowest_m, read_tide, span_words
from companion.errors import InputError
from companion.geofence import load_mission

HIGH_LOW = TideTable(rows=(TideRow(utc_s=0.0, height_m=4.0), TideRow(utc_s=22_000.0, height_m=1.0)))


@pytest.mark.parametrize(
    ("utc_s", "height_m"),
    [
        (0.0, 4.0),
        (11_000.0, 2.5),  # half tide
        (22_000.0, 1.0),
        (22_000.0 / 6.0, 4.0 - 3.0 * 0.0669873),  # nearly a twelfth of the range in the first sixth of the time
        (-1.0, None),
        (22_001.0, None),
        (None, None),
    ],
)
def test_from_high_to_low_water_it_falls_as_half_a_wave(utc_s, height_m):
    assert HIGH_LOW.height_m(utc_s) == (None if height_m is None else pytest.approx(height_m, abs=1e-3))


def test_a_table_of_one_row_holds_for_its_moment():
    one = TideTable(rows=(TideRow(utc_s=5.0, height_m=2.0),))
    assert [one.height_m(t) for t in (4.0, 5.0, 6.0)] == [None, 2.0, None]


def test_the_missions_table_is_read_and_what_is_none_is_refused(tmp_path):
    text = Path("sitl/missions/shoaling.toml").read_text().replace("[area]\n", '[area]\ntide = "heights.csv"\n')
    (tmp_path / "m.toml").write_text(text)
    with pytest.raises(InputError, match=r"\[area\] tide"):
        load_mission(tmp_path / "m.toml")
    (tmp_path / "heights.csv").write_text("time, height_m\n2026-11-24T06:00Z, 4.0\n2026-11-24T12:00Z, 1.0\n")
    config = config_of(load_mission(tmp_path / "m.toml"))
    assert config.tide.height_m(1_795_510_800.0) == pytest.approx(2.5)
    (tmp_path / "heights.csv").write_text("2026-11-24T06:00Z, 90, 4.0\n")
    with pytest.raises(InputError, match="one height"):
        config_of(load_mission(tmp_path / "m.toml"))


def table(*rows):
    return TideTable(rows=tuple(TideRow(utc_s=h * 3600.0, height_m=m) for h, m in rows), name="t.csv")


HIGH_WATERS = ((6.3, 1.4), (18.7, 1.5), (31.0, 1.45))
EACH_THREE = ((0, 1.0), (3, 1.7), (6, 1.0), (9, 0.3), (12, 1.0), (15, 1.7))


@pytest.mark.parametrize(
    ("rows", "known", "unknown"),
    [
        (((0, 0.4), (462, 1.4)), (), (1.0, 231.0)),  # two rows 19 days apart
        (HIGH_WATERS, (), (12.5, 25.0)),
        (EACH_THREE, (), (1.5, 4.5, 10.5)),
        (((0, 0.4), (6, 1.4), (12, 0.4), (18, 1.4), (24, 0.4)), (), (3.0, 21.0)),  # each six hours, as a model has it
        (((0.2, 0.4), (6.3, 1.4), (12.5, 0.3), (18.7, 1.5)), (3.0, 9.0, 15.0), ()),
        (((0.2, 0.4), (6.3, 1.4), (18.7, 1.5), (24.9, 0.4)), (3.0, 20.0), (12.5,)),  # a low water is left out
        (((0, 1.0), (1, 1.1), (2, 1.15), (7, 0.6), (8, 0.7)), (0.5, 7.5), (4.5,)),  # a hole in a table by the hour
        (((0.2, 1.4), (6.3, 1.4)), (), (3.0,)),
    ],
)
def test_between_rows_it_is_known_only_where_half_a_wave_is_right(rows, known, unknown):
    """High waters alone opened a bar at the low water between them."""
    heights = table(*rows)
    assert all(heights.height_m(h * 3600.0) is not None for h in known)
    assert all(heights.height_m(h * 3600.0) is None for h in unknown)
    closed = closed_spans(heights, -5.0)
    for h in (*known, *unknown):
        assert any(a < h * 3600.0 < b for a, b in closed) == (h in unknown)
    assert all(any(a < h * 3600.0 < b for a, b in heights.gaps()) == (h in unknown) for h in (*known, *unknown))


def test_a_row_is_known_at_its_own_time_and_gaps_are_told():
    heights = table((0.2, 0.4), (6.3, 1.4), (18.7, 1.5), (24.9, 0.4))
    assert heights.height_m(18.7 * 3600.0) == 1.5
    assert span_words(heights) == (
        "t.csv holds from 1970-01-01T00:12Z to 1970-01-02T00:54Z, but not between its rows of 1970-01-01T06:18Z and "
        "1970-01-01T18:42Z"
    )


@pytest.mark.parametrize(
    ("lines", "told"),
    [
        (
            ("2026-12-01T00:10Z, 0.4", "2026-12-20T06:20Z, 1.4"),
            "t.csv: line 2: is 462 h 10 min after the row before, more than high and low water are apart: nothing",
        ),
        (
            ("2026-12-01T06:20Z, 1.4", "2026-12-01T18:40Z, 1.5", "2026-12-02T07:00Z, 1.45"),
            "t.csv: line 2: is 12 h 20 min after the row before",
        ),
        (
            ("2026-12-01T00:00Z, 0.4", "2026-12-01T02:00Z, 1.0", "2026-12-01T04:00Z, 1.4"),
            "t.csv: line 2: is 2 h 00 min after the row before, and the two are not high and low water that follow",
        ),
    ],
)
def test_a_table_that_tells_of_no_hour_is_refused(lines, told):
    text = "\n".join(lines)
    times = tuple(dt.datetime.fromisoformat(line.split(",")[0]).timestamp() for line in lines)
    with pytest.raises(InputError) as refused:
        read_tide(text, "t.csv", times)
    assert str(refused.value).startswith(told)
    assert str(refused.value).endswith("write each high and each low water, or a row for each hour")


def test_the_lowest_of_hours_that_a_table_leaves_out_is_not_told():
    rows = table((0.2, 0.4), (6.3, 1.4), (18.7, 1.5), (24.9, 0.4)).rows
    assert lowest_m(rows, 1.0 * 3600.0, 5.0 * 3600.0, "t.csv") == 0.4
    with pytest.raises(InputError, match=r"t.csv: row of 1970-01-01T18:42Z: is 12 h 24 min after the row before"):
        lowest_m(rows, 11.0 * 3600.0, 14.0 * 3600.0, "t.csv")
