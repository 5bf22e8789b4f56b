"""``companion field``: a field in words and as a picture, and what is refused."""

import math

import numpy as np
import pytest

from companion.cli import main
from companion.geofence import load_mission
from companion.mission_check import field_preview, field_track, heading_fan, without_value


def mission(name):
    return load_mission(f"sitl/missions/{name}.toml")


def test_a_field_in_words(capsys):
    assert main(["field", "missions/field-ring.toml", "--wind", "5@90"]) == 0
    told = capsys.readouterr().out
    assert "goal 1, The ring: ring + islet, for 420 s" in told
    assert "ring: round a circle of 60 m about 106 m east, 167 m north, clockwise" in told
    assert "islet: away from 106 m east, 167 m north, within about 20 m" in told
    assert "wind 5 m/s from 090°, no-go zone 47° to either side" in told
    assert "she is steered" in told


def test_a_field_as_a_picture(tmp_path, capsys):
    out = tmp_path / "field.png"
    assert main(["field", "sitl/missions/field-square.toml", "--goal", "2", "--fans", "--plot", str(out)]) == 0
    assert out.read_bytes().startswith(b"\x89PNG")
    assert "out of 4.0 ha of water" in capsys.readouterr().out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["sitl/missions/block.toml"], '[[goal]]: no goal is sailed by a field; write kind = "field" in one'),
        (["sitl/missions/field-lane.toml", "--goal", "2"], "[[goal]] 2: is not sailed by a field; name one that is: 1"),
        (["missions/none.toml"], "no such file"),
    ],
)
def test_what_is_refused_is_one_line(arguments, says, capsys):
    assert main(["field", *arguments]) == 2
    told = capsys.readouterr().err
    assert says in told
    assert len(told.strip().splitlines()) == 1


def test_the_track_by_a_field_comes_to_its_end_and_stays_off_what_is_solid():
    seen = field_preview(mission("field-rock"))
    track = field_track(seen)
    assert math.dist(track[-1, 1:3], seen.place_en) <= 12.0
    assert np.hypot(track[:, 1] - 120.0, track[:, 2]).min() > 15.0
    ring = field_preview(load_mission("missions/field-ring.toml"))
    assert ring.area.clearance_m(field_track(ring)[:, 1:3]).min() > 6.0
    assert len(field_track(ring, 50.0)) == 50


def test_the_fan_is_as_long_as_the_polar_and_shut_to_windward():
    fan = heading_fan(field_preview(mission("field-lane")))
    off = np.abs((fan.headings_rad + math.pi) % (2.0 * math.pi) - math.pi)
    assert (fan.speeds_mps[off < math.radians(46.0)] == 0.0).all()
    assert (fan.speeds_mps[off > math.radians(48.0)] > 1.0).all()
    assert fan.wanted_rad == pytest.approx(0.0, abs=1e-9)
    assert abs(fan.chosen_rad) == pytest.approx(math.radians(47.0))
    assert math.degrees(fan.headings_rad[int(np.argmax(fan.worth_mps))]) % 360.0 in {50.0, 310.0}


def test_a_mission_by_field_throughout_is_sailed_to_its_marks():
    seen = field_preview(mission("by-field"))
    assert seen.tree.text == "mark"
    assert without_value(seen) < 0.01
    out = field_preview(mission("field-square"), number=2)
    assert 0.5 < without_value(out) < 0.9  # outside of the square there is nowhere to go
