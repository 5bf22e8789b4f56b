"""A boat learned from what was sailed: the companion's voyages in a hull that is not the plan's, real ArduRover's."""

import math
from pathlib import Path

import msgspec
import pytest

from companion.boat import ardurover_sitl, guessed, lesson_of
from companion.boat_logs import logs_under, read_logs
from companion.cli import main
from companion.clock import run_virtual
from lab.simulated_logs import SIZES
from sitl.autopilot import tack_loss_s
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import CurrentSpec, HullSpec, load_scenario

# Recorded from ArduRover SITL 4.7.0-dev, 5 m/s of wind from north; what learning reads of it, once a second.
RECORDED = [Path(f"tests/boat/data/ardurover-{name}.tlog.gz") for name in ("beat", "reach")]
HULL = HullSpec(speed=0.7, beat=0.95, run=1.05, leeway_deg=6.0)
SHARES = {
    45.0: 0.665,
    60.0: 0.677,
    90.0: 0.7,
    150.0: 0.735,
}  # of the polar's speed; straight between 45, 90 and 150 degrees


@pytest.fixture(scope="module")
def voyages(tmp_path_factory):
    """Sail the archipelago and the bay, two seeds each, with a hull three tenths slower than planned, in a stream."""
    folder = tmp_path_factory.mktemp("voyages")
    for name, mission in (("archipelago", "archipelago"), ("bay", "bay")):
        path = Path("sitl/scenarios/demo.toml")
        scenario = msgspec.structs.replace(
            load_scenario(path),
            mission=f"../../missions/{mission}.toml",
            limit_s=1800.0,
            boat=HULL,
            current=CurrentSpec(set_deg=120.0, drift_mps=0.15),
            parameters={"FENCE_TYPE": 4.0},
        )
        for seed in (1, 2):
            run_virtual(run_embedded(scenario, path, seed, folder / f"{name}-{seed}"))
    return folder


def test_voyages_of_another_hull_tell_which_it_is(voyages):
    """Speeds, stream, leeway, no-go zone and a tack's cost, from four folders: an hour is not needed."""
    read, skipped = read_logs(logs_under([voyages]))
    assert (len(read), skipped) == (4, [])
    lesson = lesson_of([one.log for one in read], ardurover_sitl(), 0.35, no_go_half_rad=math.radians(47.0))
    boat = lesson.boat
    for angle, share in SHARES.items():
        true = share * ardurover_sitl().speed_mps(math.radians(angle), 5.0)
        assert boat.polar.speed_mps(math.radians(angle), 5.0) == pytest.approx(true, rel=0.08), angle
    assert abs(math.degrees(boat.leeway.mean) - 6.0) < 2.5 * math.degrees(boat.leeway.sd) < 5.0
    for east, north in boat.currents:
        assert math.hypot(east.mean - 0.13, north.mean + 0.075) < 0.1
    assert abs(math.degrees(boat.vane.mean)) < 2.5 * math.degrees(boat.vane.sd)
    assert lesson.no_go_is_sailed
    assert abs(math.degrees(lesson.no_go.mean) - 45.0) < 4.0
    assert lesson.tacks.failed <= 0.1 * lesson.tacks.tried
    assert lesson.tacks.loss_s == pytest.approx(tack_loss_s({}, None, 5.0), abs=0.5)


def test_real_ardurover_is_learned_from_five_minutes_of_beat_and_five_of_reach():
    """Its polar was measured apart (companion/boat/data/ardurover_sitl.csv); the guess is of half as fast a boat."""
    read, skipped = read_logs(RECORDED)
    assert skipped == []
    prior = guessed(SIZES).polar
    lesson = lesson_of([one.log for one in read], prior, 0.35, no_go_half_rad=math.radians(45.0))
    true = ardurover_sitl()
    assert prior.speed_mps(math.radians(90.0), 5.0) < 0.65 * true.speed_mps(math.radians(90.0), 5.0)
    for angle in (45.0, 60.0, 90.0):
        learned = lesson.boat.polar.speed_mps(math.radians(angle), 5.0)
        assert learned == pytest.approx(true.speed_mps(math.radians(angle), 5.0), rel=0.05), angle
    assert abs(math.degrees(lesson.no_go.mean) - 45.0) < 0.05 * 45.0
    assert lesson.tacks.loss_s == pytest.approx(tack_loss_s({}, None, 5.0), abs=0.15)
    assert (lesson.tacks.tried, lesson.tacks.failed) == (6, 0)
    # It makes no leeway, its vane and compass are right, and there is no stream.
    for known in (lesson.boat.vane, lesson.boat.compass, lesson.boat.leeway):
        assert abs(known.mean) < 2.0 * known.sd


SLOW_LAKE = """\
name = "lake"
[start]
lat = 50.8170000
lon = -1.3100000
[[goal]]
lat = 50.8200563
lon = -1.3094324
[area]
fence = "lake.wkt"
margin_m = 15.0
margin_floor_m = 8.0
[operator]
arm = true
set_auto = true
"""


def sailed_in(mission, from_deg, folder, seeds):
    path = Path("sitl/scenarios/demo.toml")
    scene = load_scenario(path)
    scene = msgspec.structs.replace(
        scene,
        mission=str(mission),
        limit_s=1800.0,
        wind=msgspec.structs.replace(scene.wind, from_deg=from_deg),
        boat=HULL,
        current=CurrentSpec(set_deg=120.0, drift_mps=0.15),
        parameters={"FENCE_TYPE": 4.0},
    )
    for seed in seeds:
        run_virtual(run_embedded(scene, path, seed, folder / f"{seed}"))
    read, skipped = read_logs(logs_under([folder]))
    assert skipped == []
    return lesson_of([one.log for one in read], ardurover_sitl(), 0.35, no_go_half_rad=math.radians(47.0))


def test_a_trial_settles_what_a_reach_leaves_open(tmp_path, capsys):
    """Sailed like any mission: what the first voyage could not tell apart, ten minutes of trial do."""
    (tmp_path / "lake.wkt").write_bytes(Path("missions/lake.wkt").read_bytes())
    (tmp_path / "lake.toml").write_text(SLOW_LAKE)
    before = sailed_in(tmp_path / "lake.toml", 90.0, tmp_path / "reach", (3, 4))
    assert main(["boat", "trial", str(tmp_path / "lake.toml"), "--from-deg", "0"]) == 0
    capsys.readouterr()
    after = sailed_in(tmp_path / "lake-trial.toml", 0.0, tmp_path / "trial", (3,))
    opened = ("reciprocal reach", "tacks seen", "nobody sailed a beat", "close-hauled on each tack", "a circle")
    said = " ".join(before.findings)
    assert [what for what in opened if what not in said] == []
    for seed in (3, 8):  # leeway and the wind's swing may turn a reach into a close reach there and back
        after = sailed_in(tmp_path / "lake-trial.toml", 0.0, tmp_path / f"trial-{seed}", (seed,))
        said = " ".join(after.findings)
        assert [what for what in opened if what in said] == []
        assert "nobody sailed" not in said
        assert after.tacks.tried >= 6
        assert after.tacks.loss_s is not None
        assert after.boat.common < 0.6 * before.boat.common
