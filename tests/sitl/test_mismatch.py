"""A scenario's tables of what the plan does not know: read, refused with place and remedy, and there in the voyage."""

import math
from pathlib import Path

import msgspec
import pytest

from companion.clock import run_virtual
from companion.errors import InputError, JobError
from sitl.run.boats import RealBoat, SimulatedBoat
from sitl.run.embedded import run_embedded
from sitl.run.live import run_live
from sitl.scenario import load_scenario, scenario_departures, scenario_waters, scenario_wind
from sitl.scenario.scenario import CurrentSpec, HullSpec, LeeSpec, SensorsSpec, WavesSpec

OTHER = Path("sitl/scenarios/other-boat.toml")
BOTH = Path("sitl/scenarios/tide-and-lee.toml")


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        ("[boat]\ntack_fails=1.5", "boat.tack_fails", "at most 1.0"),
        ("[boat]\nbeat=-0.2", "boat.beat", "at least 0.2"),
        ("[boat]\nleeway_deg=nan", "boat.leeway_deg", "0"),
        ("[boat]\nleeway=4", "boat", "did you mean `leeway_deg`?"),
        ("[current]\ndrift_mps=-1", "current.drift_mps", "at least 0.0"),
        ("[current]\ntide_s=0", "current.tide_s", "above 0.0"),
        ("[current]\nset=3", "current", "set_deg"),
        ("[waves]\nheight_m=1", "waves", "known:"),
        ("[waves]\nperiod_s='long'", "waves.period_s", "expected a number, got a text"),
        ("[sensors]\ngps_noise_m=inf", "sensors.gps_noise_m", "at most 100.0"),
        ("[sensors]\nvane=10", "sensors", "did you mean `vane_deg`?"),
        ("[[wind.lees]]\neast_m=0\nnorth_m=0", "wind.lees[0]", "radius_m"),
        ("[[wind.lees]]\neast_m=0\nnorth_m=0\nradius_m=5\nlos=1", "wind.lees[0]", "did you mean `loss`?"),
        ("[wind]\ngust_spread=2.0", "wind.gust_spread", "at most 1.0"),
    ],
)
def test_what_cannot_be_is_one_line_with_its_place(tmp_path, text, place, words):
    path = tmp_path / "s.toml"
    path.write_text(f"name='x'\nmission='m.toml'\n{text}\n")
    (tmp_path / "m.toml").write_text("")
    with pytest.raises(InputError) as caught:
        load_scenario(path)
    line = str(caught.value)
    assert "\n" not in line
    assert line.startswith(f"{path}: {place}")
    assert words in line


LEAST = {LeeSpec: {"east_m": 0.0, "north_m": 0.0, "radius_m": 1.0}}


def scenario_with(**tables):
    return msgspec.structs.replace(load_scenario(Path("sitl/scenarios/upwind.toml")), **tables)


def waters_of(**tables):
    scenario = scenario_with(**tables)
    return scenario_waters(scenario, scenario_wind(scenario, Path("sitl/scenarios/upwind.toml"), 1), (10.0, 20.0))


MADE = {
    HullSpec: lambda spec: scenario_departures(scenario_with(boat=spec)),
    WavesSpec: lambda spec: scenario_departures(scenario_with(waves=spec)),
    SensorsSpec: lambda spec: scenario_departures(scenario_with(sensors=spec)),
    CurrentSpec: lambda spec: waters_of(current=spec).stream,
    LeeSpec: lambda spec: waters_of(wind=msgspec.structs.replace(load_scenario(OTHER).wind, lees=(spec,))).lees,
}


@pytest.mark.parametrize("struct", [HullSpec, WavesSpec, SensorsSpec, CurrentSpec, LeeSpec])
def test_every_key_is_something_in_the_simulator(struct):
    for key in struct.__struct_fields__:
        one, other = (MADE[struct](struct(**(LEAST.get(struct, {}) | {key: value}))) for value in (0.31, 0.53))
        assert one != other, key


def test_where_nothing_is_said_nothing_is_made():
    assert scenario_departures(scenario_with()) is None
    assert waters_of() is None


def test_the_polar_errs_by_scale_and_angle():
    boat = scenario_departures(scenario_with(boat=HullSpec(speed=0.9, beat=0.8, run=1.1)))
    assert (boat.beat, boat.reach, boat.run) == pytest.approx((0.72, 0.9, 0.99))


def test_waves_come_from_where_the_wind_does_where_nothing_else_is_said():
    wind = msgspec.structs.replace(load_scenario(OTHER).wind, from_deg=70.0)
    said = scenario_departures(scenario_with(wind=wind, waves=WavesSpec(loss=0.1)))
    assert said.waves.from_rad == pytest.approx(math.radians(70.0))
    said = scenario_departures(scenario_with(wind=wind, waves=WavesSpec(from_deg=10.0)))
    assert said.waves.from_rad == pytest.approx(math.radians(10.0))


def test_a_seed_sails_another_boat_twice_the_same(tmp_path):
    scenario = msgspec.structs.replace(load_scenario(OTHER), limit_s=150.0)
    figures = [run_virtual(run_embedded(scenario, OTHER, 5, tmp_path / str(n))).figures for n in range(2)]
    assert figures[0] == figures[1]
    tracks = [(tmp_path / str(n) / "track.csv").read_bytes() for n in range(2)]
    assert tracks[0] == tracks[1]
    plain = msgspec.structs.replace(scenario, boat=None, sensors=None, waves=None, current=None)
    assert run_virtual(run_embedded(plain, OTHER, 5, tmp_path / "plain")).figures != figures[0]


def test_what_the_real_autopilot_cannot_be_is_refused_before_anything_is_started(tmp_path):
    assert RealBoat.cannot_be(load_scenario(OTHER)) == ["[boat]", "[waves]", "[sensors]"]
    assert RealBoat.cannot_be(load_scenario(BOTH)) == []
    assert SimulatedBoat.cannot_be(load_scenario(OTHER)) == ["[sensors]"]
    with pytest.raises(JobError, match=r"other-boat: \[boat\], \[waves\], \[sensors\] can be had of the embedded"):
        run_live(load_scenario(OTHER), OTHER, 0, tmp_path, autopilot="ardurover", program=None, speedup=None)
    assert list(tmp_path.iterdir()) == []
