"""The tide's heights between the rows of a table."""

from pathlib import Path

import pytest

from companion.compose import config_of
from companion.current import TideRow, TideTable
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
