"""The simulated bottom: depths by place and tide, a sounder that errs, and the judge of a keel."""

import math
from pathlib import Path

import msgspec
import numpy as np
import pytest

from companion.boat import Hull
from companion.chart import parse_ascii_grid
from companion.clock import run_virtual
from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint
from sitl.run.boats import RealBoat, SimulatedBoat
from sitl.run.embedded import mission_of, run_embedded
from sitl.scenario import load_scenario, scenario_seabed, scenario_sounder, under_keel_m, verdict_line
from sitl.scenario.scenario import BankSpec, BottomSpec, ExpectSpec
from sitl.scenario.true_track import TrueTrack
from sitl.world import Bank, Seabed, SimulatedSounder, Tide
from tests.sitl.judged import judged

FRAME = LocalFrame(GeoPoint(lat_deg=50.8, lon_deg=-1.3))
HERE = FRAME.geo_from_en(0.0, 0.0)
SOURCE = Path("sitl/scenarios/shoaling.toml")
GRID = "ncols 3\nnrows 3\nxllcenter -1.301\nyllcenter 50.799\ncellsize 0.001\n-4 -4 -4\n-4 -2 -6\n-4 -4 -4\n"


def at(seabed, east_m, north_m=0.0, t_s=0.0):
    return float(seabed.depth_m([(east_m, north_m)], t_s)[0])


def scenario_with(**bottom):
    return msgspec.structs.replace(load_scenario(SOURCE), bottom=BottomSpec(**bottom))


def test_a_bank_rises_to_its_top_and_ends_where_it_says():
    bank = Bank(en_m=(100.0, 0.0), along_m=50.0, across_m=20.0, bearing_rad=math.radians(90.0), top_m=-1.0)
    seabed = Seabed(frame=FRAME, level_m=9.0, banks=(bank,))
    assert at(seabed, 100.0) == pytest.approx(-1.0)
    assert at(seabed, 151.0) == at(seabed, 100.0, 21.0) == 9.0
    assert 0.0 < at(seabed, 130.0) < 9.0
    assert at(seabed, 130.0) == pytest.approx(at(seabed, 100.0, 12.0))  # as far out on either axis, by its share


def test_a_bank_in_shoaler_water_digs_no_hole():
    bank = Bank(en_m=(0.0, 0.0), along_m=50.0, across_m=50.0, bearing_rad=0.0, top_m=4.0)
    assert at(Seabed(frame=FRAME, level_m=3.0, banks=(bank,)), 0.0) == 3.0


def test_the_bottom_rises_the_way_it_is_said_to_and_the_tide_over_it():
    tide = Tide(mean_m=2.0, range_m=3.0, period_s=1000.0, high_s=100.0)
    seabed = Seabed(frame=FRAME, level_m=5.0, rises_per_km=10.0, rises_to_rad=math.radians(90.0), tide=tide)
    assert at(seabed, 200.0, 70.0, 100.0) == pytest.approx(5.0 - 2.0 + 3.5)
    assert at(seabed, 200.0, 70.0, 600.0) == pytest.approx(5.0 - 2.0 + 0.5)


def test_a_grid_is_straight_between_its_middles_and_holds_where_it_is_known():
    grid = parse_ascii_grid(GRID, "x").northwards()
    seabed = Seabed(frame=FRAME, level_m=30.0, grid=grid)
    assert at(seabed, 0.0) == pytest.approx(2.0)
    east_m = FRAME.en_from_geo(GeoPoint(lat_deg=50.8, lon_deg=-1.2995))[0]
    assert at(seabed, east_m) == pytest.approx(4.0, abs=0.01)
    assert at(seabed, 500.0) == 30.0


def test_a_sounder_errs_as_it_is_said_to():
    seabed = Seabed(frame=FRAME, level_m=8.0)
    pings = [
        SimulatedSounder(seabed=seabed, seed=3, below_m=0.5, noise_m=0.1, dropouts=0.2, false_bottoms=0.1).ping_m(
            HERE, t
        )
        for t in np.arange(0.0, 2000.0, 0.5).tolist()
    ]
    heard = np.array([p for p in pings if p is not None])
    assert 0.17 < 1.0 - len(heard) / len(pings) < 0.23
    good = heard[heard > 7.0]
    assert 0.88 < len(good) / len(heard) < 0.93
    assert np.mean(good) == pytest.approx(7.5, abs=0.02)
    assert np.std(good) == pytest.approx(0.1, abs=0.03)
    assert heard[heard <= 7.0].min() < 1.0


def test_a_sounder_repeats_by_seed_and_tells_nothing_beyond_its_reach():
    deep = SimulatedSounder(seabed=Seabed(frame=FRAME, level_m=80.0), seed=1, noise_m=0.2)
    assert deep.ping_m(HERE, 3.0) == 50.0
    one, other = (SimulatedSounder(seabed=Seabed(frame=FRAME, level_m=8.0), seed=seed, noise_m=0.2) for seed in (1, 2))
    assert one.ping_m(HERE, 3.0) == one.ping_m(HERE, 3.0) != other.ping_m(HERE, 3.0)


def test_a_keel_that_strikes_between_two_samples_has_struck():
    seabed = Seabed(
        frame=FRAME, level_m=9.0, banks=(Bank(en_m=(50.0, 0.0), along_m=8.0, across_m=8.0, bearing_rad=0.0, top_m=0.0),)
    )
    truth = TrueTrack()
    for t_s, east_m in ((0.0, 0.0), (30.0, 100.0), (60.0, 100.0)):
        truth.add(t_s, (east_m, 0.0), 0.0, 3.0, (0.0, 5.0))
    keel_m = under_keel_m(truth, seabed, 1.5)
    assert keel_m.min() < -1.4

    def held_against(expect):
        return judged(
            scenario="x",
            seed=1,
            expect=expect,
            truth=truth,
            solid=scenario_solid(),
            hull=Hull(length_m=1.0, beam_m=0.3),
            goal_en_m=(100.0, 0.0),
            summary={"arrived": True, "replans": 0},
            status_times_s=None,
            alerts=[],
            keel_m=keel_m,
        )

    verdict = held_against(ExpectSpec())
    assert not verdict.passed
    assert verdict.figures["groundings"] == 1
    assert "1 grounding" in verdict_line(verdict.to_dict())
    assert held_against(ExpectSpec(groundings=1)).passed


def scenario_solid():
    import shapely

    return shapely.Polygon()


def test_the_tide_of_a_track_is_that_of_its_hours():
    seabed = Seabed(frame=FRAME, level_m=2.0, tide=Tide(range_m=2.0, period_s=200.0))
    truth = TrueTrack()
    for t_s in (1000.0, 1100.0):
        truth.add(t_s, (0.0, 0.0), 0.0, 0.0, (0.0, 5.0))
    assert under_keel_m(truth, seabed, 1.5, began_s=1000.0).tolist() == pytest.approx([1.5, -0.5])


# nmea is how the sounder speaks, not what it hears: the scenario nmea-sounder sails by it
AS_IT_IS = {"file", "banks", "sounder", "nmea"}


@pytest.mark.parametrize("key", [k for k in BottomSpec.__struct_fields__ if k not in AS_IT_IS])
def test_every_key_is_something_in_the_simulator(key):
    def made(value):
        scenario = scenario_with(**{key: value})
        seabed = scenario_seabed(scenario, SOURCE, FRAME)
        return seabed, scenario_sounder(scenario, seabed, 1)

    assert made(0.31) != made(0.53)


def test_every_key_of_a_bank_is_something_too():
    least = {"east_m": 0.0, "north_m": 0.0, "top_m": 1.0}
    for key in BankSpec.__struct_fields__:
        one, other = (
            scenario_seabed(scenario_with(banks=(BankSpec(**(least | {key: v})),)), SOURCE, FRAME) for v in (0.3, 0.5)
        )
        assert one != other, key


def test_a_boat_may_have_no_sounder():
    scenario = scenario_with(sounder=False)
    assert scenario_sounder(scenario, scenario_seabed(scenario, SOURCE, FRAME), 1) is None


def test_what_cannot_be_read_or_grounds_nothing_is_one_line(tmp_path):
    with pytest.raises(InputError, match="name an Esri ASCII grid"):
        scenario_seabed(scenario_with(file="none.asc"), SOURCE, FRAME)
    (tmp_path / "b.asc").write_text(GRID)
    assert at(scenario_seabed(scenario_with(file="b.asc"), tmp_path / "s.toml", FRAME), 0.0) == pytest.approx(2.0)
    other = msgspec.structs.replace(
        load_scenario(Path("sitl/scenarios/upwind.toml")), bottom=BottomSpec(), mission="../../missions/bay.toml"
    )
    with pytest.raises(InputError, match="draft_m"):
        mission_of(other, Path("sitl/scenarios/upwind.toml"))


@pytest.mark.parametrize("boat", [RealBoat, SimulatedBoat])
def test_every_boat_has_a_bottom(boat):
    assert boat.cannot_be(scenario_with()) == []


def test_a_boat_that_runs_onto_a_bank_fails_her_scenario(tmp_path):
    """Nobody hears of it: she has no sounder."""
    bank = BankSpec(east_m=0.0, north_m=200.0, top_m=1.0, along_m=4000.0, across_m=80.0, bearing_deg=90.0)
    scenario = msgspec.structs.replace(
        scenario_with(depth_m=9.0, banks=(bank,), sounder=False),
        events=(),
        limit_s=400.0,
        expect=ExpectSpec(arrived=None),
    )
    verdict = run_virtual(run_embedded(scenario, SOURCE, 1, tmp_path))
    assert [c.name for c in verdict.checks if not c.passed] == ["groundings"]
    assert verdict.figures["min_under_keel_m"] < 0.0
