"""Tide tables: what is read, what is refused, what is said behind their ends."""

import math

import pytest

from companion.compose import water_of
from companion.current import Prior
from companion.errors import InputError
from companion.geofence import load_mission
from companion.mission_check import current_words_of

GOAL = "[start]\nlat = 50.8\nlon = -1.3\n[[goal]]\nlat = 50.805\nlon = -1.3\n"
TIDE = """# Solent, by the almanac
time, set_deg, drift_mps
2026-11-21T12:00:00Z, 90, 0.6
2026-11-21T13:00:00Z, 90, 0.2

2026-11-21T15:00:00+01:00, 270, 0.4
"""
NOON = 1795262400.0


def mission(tmp_path, current, tide=TIDE):
    (tmp_path / "tide.csv").write_text(tide)
    (tmp_path / "m.toml").write_text(f"{GOAL}\n[current]\n{current}\n")
    return load_mission(tmp_path / "m.toml")


def test_a_table_is_read_with_comments_headings_and_other_zones(tmp_path):
    prior = water_of(mission(tmp_path, 'table = "tide.csv"\nsigma_mps = 0.1'))
    assert [row.utc_s for row in prior.rows] == [NOON, NOON + 3600.0, NOON + 7200.0]
    half = prior.at(NOON + 1800.0)
    assert (half.east_mps, half.north_mps) == pytest.approx((0.4, 0.0), abs=1e-9)
    assert half.sigma_mps == 0.1
    assert not half.verdict


def test_behind_its_end_and_before_its_begin_a_table_is_widened_and_never_silent(tmp_path):
    prior = water_of(mission(tmp_path, 'table = "tide.csv"\nsigma_mps = 0.1'))
    for utc_s in (NOON - 7200.0, NOON + 3.0 * 3600.0):
        off = prior.at(utc_s)
        assert off.sigma_mps > 0.6
        assert "tide.csv" in off.verdict
        assert math.hypot(off.east_mps, off.north_mps) > 0.3, "its nearest row stays"
    assert prior.at(NOON - 60.0).sigma_mps == pytest.approx(0.1, abs=0.02), "no leap at its ends"
    assert prior.at(None).verdict
    assert prior.at(None).sigma_mps == pytest.approx(0.6)


def test_of_the_hours_between_rows_of_another_day_the_nearest_row_is_widened(tmp_path):
    """A straight line of two days was believed as the current of its noon."""
    rows = "2026-11-21T12:00Z, 90, 0.6\n2026-11-21T18:00Z, 270, 0.6\n2026-11-23T12:00Z, 90, 0.6\n"
    prior = water_of(mission(tmp_path, 'table = "tide.csv"\nsigma_mps = 0.1', rows))
    assert prior.at(NOON + 3.0 * 3600.0).verdict == ""
    gap = prior.at(NOON + 20.0 * 3600.0)
    assert gap.verdict == "tide.csv has rows 42 h apart here: its nearest row, widened"
    assert gap.sigma_mps == pytest.approx(math.hypot(0.6, 0.1))
    assert prior.at(NOON + 6.0 * 3600.0 + 60.0).sigma_mps == pytest.approx(0.1, abs=0.02), "no leap where it begins"


@pytest.mark.parametrize(
    ("current", "tide", "words"),
    [
        ('table = "tide.csv"', "2026-11-21T12:00:00, 90, 0.6\n2026-11-21T13:00:00Z, 90, 0.2\n", "line 1"),
        ('table = "tide.csv"', "2026-11-21T12:00:00Z, 90\n2026-11-21T13:00:00Z, 90, 0.2\n", "line 1"),
        ('table = "tide.csv"', "2026-11-21T12:00:00Z, 90, 0.6\n2026-11-21T11:00:00Z, 90, 0.2\n", "line 2"),
        ('table = "tide.csv"', "2026-11-21T12:00:00Z, 90, 60\n2026-11-21T13:00:00Z, 90, 0.2\n", "cannot be"),
        ('table = "tide.csv"', "2026-11-21T12:00:00Z, 90, nan\n2026-11-21T13:00:00Z, 90, 0.2\n", "cannot be"),
        ('table = "tide.csv"', "2026-11-21T12:00:00Z, 90, 0.6\n", "fewer than two rows"),
        ('table = "tide.csv"\nset_deg = 90.0\ndrift_mps = 0.3', TIDE, "exclude one another"),
        ("set_deg = 90.0", TIDE, "not both there"),
        ("drift_mps = 0.3", TIDE, "not both there"),
    ],
)
def test_what_is_wrong_is_one_line_with_its_place(tmp_path, current, tide, words):
    with pytest.raises(InputError, match=words):
        water_of(mission(tmp_path, current, tide))


def test_a_missing_table_is_said_when_the_mission_is_read(tmp_path):
    with pytest.raises(InputError, match=r"\[current\] table"):
        mission(tmp_path, 'table = "gone.csv"')


def test_a_check_tells_of_the_current_and_whether_she_can_stem_it(tmp_path):
    [weak] = current_words_of(mission(tmp_path, "set_deg = 180.0\ndrift_mps = 0.5"), NOON)
    assert "sets 180° 0.50 m/s" in weak
    told = current_words_of(mission(tmp_path, "set_deg = 180.0\ndrift_mps = 2.5"), NOON)
    assert "cannot make way against 2.50 m/s" in told[-1]
    table = current_words_of(mission(tmp_path, 'table = "tide.csv"'), NOON + 86400.0)
    assert "3 rows from 2026-11-21 12:00 to 2026-11-21 14:00 UTC" in table[0]
    assert "ended 22 h ago" in table[1]
    (tmp_path / "m.toml").write_text(GOAL)
    assert current_words_of(load_mission(tmp_path / "m.toml"), NOON) == ()


def test_nothing_said_of_the_water_is_wide_and_not_still():
    assert Prior().at(None).sigma_mps >= 0.5
