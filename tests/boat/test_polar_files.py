"""Polar files: every trap of the format, and errors that name file and line."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.boat import Boat, ardurover_sitl, orc_text, parse_polar, polar_of_table, read_polar
from companion.errors import InputError
from companion.geo import MPS_PER_KNOT

GRID = (
    "TWA\\TWS;4;6;8;10;12\n0;0.0;0.0;0.0;0.0;0.0\n45;2.1;3.0;3.6;3.9;4.0\n"
    "90;2.8;3.8;4.4;4.8;5.0\n150;2.0;2.9;3.6;4.2;4.6\n"
)


def knots(polar, twa_deg, tws_kn):
    return polar.speed_mps(math.radians(twa_deg), tws_kn * MPS_PER_KNOT) / MPS_PER_KNOT


@pytest.mark.parametrize(
    "change",
    [
        lambda s: s,
        lambda s: s.replace(";", ","),
        lambda s: s.replace(";", "\t"),
        lambda s: s.replace(";", " "),
        lambda s: s.replace("\n", "\r\n"),
        lambda s: "\ufeff" + s,
        lambda s: "A description of the boat\n" + s,
        lambda s: "# comment\n! another\n" + s,
        lambda s: s.replace("TWA\\TWS", "twa/tws"),
        lambda s: s.replace("TWA\\TWS", "Twa"),
        lambda s: s.replace("TWA\\TWS", "0"),
        lambda s: s.replace(".", ","),  # decimal commas, ; between
        lambda s: s.replace("2.1", "2.1:3"),  # a sail named after the speed
        lambda s: s.replace("\n", ";\n"),  # trailing separators
        lambda s: s + "\n\n",
    ],
    ids=range(15),
)
def test_one_grid_in_many_dresses_is_one_polar(change):
    polar = parse_polar(change(GRID)).polar
    assert np.degrees(polar.twa_rad) == pytest.approx([0, 45, 90, 150])
    assert polar.tws_mps / MPS_PER_KNOT == pytest.approx([4, 6, 8, 10, 12])
    assert knots(polar, 45, 4) == pytest.approx(2.1)
    assert knots(polar, 150, 12) == pytest.approx(4.6)
    assert knots(polar, 67.5, 5) == pytest.approx((2.1 + 3.0 + 2.8 + 3.8) / 4)


def test_a_blank_is_interpolated_along_the_wind_first():
    read = parse_polar(GRID.replace("45;2.1;3.0;3.6", "45;2.1;;3.6"))
    assert knots(read.polar, 45, 6) == pytest.approx((2.1 + 3.6) / 2)
    assert read.warnings == ()


def test_a_blank_at_the_end_of_a_row_is_interpolated_along_the_angle():
    polar = parse_polar(GRID.replace("3.9;4.0\n", "3.9;\n")).polar
    assert knots(polar, 45, 12) == pytest.approx(2.5)


def test_a_bare_zero_is_unknown_and_warned_but_zero_point_zero_cannot_sail():
    read = parse_polar("TWA/TWS;4;8\n0;0;0\n30;0.0;0.01\n45;0;3.0\n90;2.0;4.0\n")
    assert knots(read.polar, 30, 4) == 0.0
    assert knots(read.polar, 30, 8) == 0.0  # OpenCPN saves "cannot sail" as 0.01
    assert knots(read.polar, 45, 4) == pytest.approx(0.5)
    assert sum("bare 0" in w for w in read.warnings) == 1  # head to wind a boat does not sail: no gap
    assert "line 4, column 2" in read.warnings[0]


def test_missing_and_surplus_cells_are_warned_of():
    read = parse_polar("TWA;4;8\n45;2.0\n90;3.0;4.0;9.0\n")
    assert len(read.warnings) == 2
    assert knots(read.polar, 45, 4) == pytest.approx(2.0)
    assert knots(read.polar, 90, 8) == pytest.approx(4.0)


def test_beat_and_gybe_rows_are_left_out_and_said_so():
    read = parse_polar("twa/tws;6;8\nBeat angle;43;42\nBeat VMG;3.1;3.6\n52;4.0;4.5\n90;5;6\nRun VMG;3;4\n")
    assert np.degrees(read.polar.twa_rad) == pytest.approx([52, 90])
    assert len(read.warnings) == 3


@pytest.mark.parametrize("swapped", [False, True])
def test_expedition_pairs_in_either_order(swapped):
    rows = [(4, [(30, 1.0), (60, 3.0), (110, 3.5), (180, 2.0)]), (10, [(32, 2.0), (60, 5.0), (120, 6.0), (180, 4.0)])]
    text = "!Expedition\n" + "\n".join(
        "\t".join([str(w)] + [f"{b}\t{a}" if swapped else f"{a}\t{b}" for a, b in pairs]) for w, pairs in rows
    )
    polar = parse_polar(text).polar
    assert knots(polar, 60, 4) == pytest.approx(3.0)
    assert knots(polar, 180, 10) == pytest.approx(4.0)
    assert knots(polar, 120, 10) == pytest.approx(6.0)


@pytest.mark.parametrize(
    ("text", "where", "what"),
    [
        ("", "", "no polar"),
        ("hello\nworld\n", "line 1", "no header"),
        ("TWA/TWS;4;6\n45;2;x\n", "line 2, column 3", "'x'"),
        ("TWA/TWS;6;4\n45;2;3\n", "line 1", "increase"),
        ("TWA/TWS;4;6\n90;2;3\n45;2;3\n", "line 3", "increase"),
        ("TWA/TWS;4;6\n190;2;3\n", "line 2", "0 to 180"),
        ("TWA/TWS;4;6\n45;2;-3\n", "line 2, column 3", "-3"),
        ("TWA/TWS;4;6\n45;2;nan\n", "line 2, column 3", "'nan'"),
        ("TWA/TWS;4;6\n45;2;1e9\n", "line 2, column 3", "speeds are"),
        ("TWA/TWS;4;600\n45;2;3\n", "line 1", "200"),
        ("TWA/TWS;4;6\n", "line 1", "no rows"),
        ("TWA/TWS;4;6\n45;;\n90;;\n", "", "no boat speed"),
        ("TWA/TWS\n45;2\n", "line", "wind speed"),
    ],
)
def test_what_cannot_be_read_is_one_line_with_its_place(text, where, what, tmp_path):
    path = tmp_path / "boat.pol"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError) as caught:
        read_polar(path)
    message = str(caught.value)
    assert message.startswith(str(path))
    assert where in message
    assert what in message
    assert "\n" not in message


def test_a_file_that_is_not_there_and_one_that_is_no_text(tmp_path):
    with pytest.raises(InputError, match="no such file"):
        read_polar(tmp_path / "nowhere.pol")
    blob = tmp_path / "blob.pol"
    blob.write_bytes(bytes(range(256)) * 9)
    with pytest.raises(InputError):
        read_polar(blob)


@given(st.text(alphabet="TWAtws/\\;,\t \n0123456789.:-#", max_size=200))
@settings(max_examples=200)
def test_any_text_is_a_sound_polar_or_an_input_error(text):
    try:
        polar = parse_polar(text).polar
    except InputError:
        return
    assert np.all(polar.speed_mps_table >= 0.0)
    assert polar.speed_mps(1.0, 5.0) <= polar.speed_mps_table.max()


@pytest.mark.parametrize("head", ["0;0;0;0", "0;0;0;0\n30;0;0;0"])
def test_bare_zeros_before_the_first_speed_are_no_gap(head):
    """As most programs write them: head to wind a boat makes no way."""
    file = parse_polar(f"TWA\\TWS;0;6;10\n{head}\n45;0;3.0;4.0\n90;0;4.0;5.0\n150;0;3.5;4.5\n")
    assert file.warnings == ()
    assert file.polar.speed_mps(0.0, 6.0 * MPS_PER_KNOT) == 0.0
    assert file.polar.speed_mps(math.radians(90.0), 6.0 * MPS_PER_KNOT) == pytest.approx(4.0 * MPS_PER_KNOT)
    assert file.polar.speed_mps(math.radians(90.0), 0.0) == 0.0


def test_a_bare_zero_between_speeds_is_still_a_gap():
    file = parse_polar("TWA\\TWS;6;10\n0;0;0\n45;3.0;4.0\n90;0;5.0\n150;3.5;4.5\n")
    assert len(file.warnings) == 1
    assert "line 4, column 2" in file.warnings[0]


def test_a_column_that_ends_early_is_no_promise_of_a_run():
    polar = parse_polar("TWA\\TWS;6;10\n45;3.0;3.5\n90;4.0;5.0\n150;3.0;4.0\n180;2.5;\n").polar
    assert math.degrees(polar.best_run(10.0 * MPS_PER_KNOT).twa_rad) == pytest.approx(150.0)
    assert knots(polar, 180.0, 10.0) < 4.0 * math.cos(math.radians(30.0))


def test_speeds_far_above_the_wind_are_no_polar():
    """Columns were shifted: 20 knots in 4 of wind were taken, and sailed by."""
    with pytest.raises(InputError, match=r"20\.1 kn .* more than 3 times the wind; are its columns shifted"):
        parse_polar("TWA\\TWS;4;6\n45;2.1;2.2\n90;20.1;30.2\n")
    with pytest.raises(InputError, match="knots and m/s mixed"):
        polar_of_table([45.0, 90.0], [2.0, 4.0], [[1.0, 2.0], [7.0, 2.0]], name="x", source="x.toml")


def test_an_orc_table_is_in_knots_and_holds_no_wind_that_the_polar_does_not_reach():
    polar = ardurover_sitl()
    rows = [line.split(",") for line in orc_text(Boat(polar=polar, no_go_half_rad=0.0), 0.9).splitlines()]
    winds = [float(w) for w in rows[0][1:]]
    reached = polar.tws_mps / MPS_PER_KNOT
    assert winds == [w for w in (4, 6, 8, 10, 12, 14, 16, 20, 24) if reached.min() <= w <= reached.max()]
    table = {row[0]: [float(v) for v in row[1:]] for row in rows[1:]}
    assert next(iter(table)) == "beat angle"
    for j, wind in enumerate(winds):
        mps = wind * MPS_PER_KNOT
        assert table["90"][j] == pytest.approx(0.9 * polar.speed_mps(math.radians(90.0), mps) / MPS_PER_KNOT, abs=0.01)
        beat, run = polar.best_beat(mps), polar.best_run(mps)
        assert table["beat angle"][j] == pytest.approx(math.degrees(beat.twa_rad), abs=0.06)
        assert table["beat VMG"][j] == pytest.approx(0.9 * beat.vmg_mps / MPS_PER_KNOT, abs=0.01)
        assert table["run VMG"][j] == pytest.approx(0.9 * run.vmg_mps / MPS_PER_KNOT, abs=0.01)
