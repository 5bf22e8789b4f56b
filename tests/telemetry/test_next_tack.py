"""The next tack as it is shown against the tacks that were sailed: the autopilot's own beats, ways without tacks."""

import itertools
import statistics
from pathlib import Path

import pytest

from companion.clock import run_virtual
from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.step.state import Phase
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import ExpectSpec, Scenario, WindSpec

MISSIONS = Path(__file__).parents[2] / "sitl/missions"


def sailed(tmp_path, *, from_deg, sd_deg=0.1, mission="open-water.toml", seed=1):
    """Return (t_s, shown, on starboard tack) of each step under way, and the times of the tacks sailed."""
    shown = []

    def see(status, step):
        snapshot = step.snapshot
        if (
            snapshot.autopilot is None
            or snapshot.autopilot.mode is not Mode.AUTO
            or not snapshot.autopilot.is_armed
            or step.state.phase is Phase.DONE
            or snapshot.vehicle is None
            or snapshot.vehicle.speed_mps < 1.0
        ):
            return
        off_rad = difference_rad(snapshot.wind.present_twd_from_rad, snapshot.vehicle.heading_rad)
        shown.append((snapshot.t_s, status.next_tack_s, off_rad > 0.0))

    scenario = Scenario(
        name="tacks",
        mission=mission,
        limit_s=500.0,
        expect=ExpectSpec(),
        wind=WindSpec(tws_mps=5.0, from_deg=from_deg, sd_deg=sd_deg),
    )
    run_virtual(
        run_embedded(scenario, MISSIONS / "scenario.toml", seed, tmp_path / "v", expansions=3000, on_status=see)
    )
    tacks = [b[0] for a, b in itertools.pairwise(shown) if a[2] != b[2]]
    return shown, tacks


def test_the_autopilots_own_beats_are_foreseen(tmp_path):
    shown, tacks = sailed(tmp_path, from_deg=0.0, sd_deg=5.0, mission="archipelago.toml")
    assert len(tacks) >= 4
    errors = []
    for before, after in itertools.pairwise(tacks):
        # from when the boat has way again on the new board until the autopilot has the next waypoint, 5 m before it
        board = [(t, s) for t, s, _ in shown if before + 3.0 < t < after - 3.0]
        assert all(s is not None for _, s in board)
        errors += [abs(t + s - after) for t, s in board]
    assert statistics.median(errors) < 2.0
    assert max(s for t, s, _ in shown if s is not None and t > tacks[0]) < 60.0


def test_a_tack_that_the_waypoint_before_it_has_begun_is_now(tmp_path):
    """The leg is the next one already, the boat still on the old tack: the next tack is not the one after this."""
    turning = []
    for seed in (1, 2):
        folder = tmp_path / str(seed)
        shown, tacks = sailed(folder, from_deg=0.0, sd_deg=5.0, mission="archipelago.toml", seed=seed)
        found = [s for t, s, _ in shown if any(tack - 1.5 < t < tack for tack in tacks)]
        assert len(found) >= len(tacks) >= 4
        turning += found
    assert sum(s is not None and s <= 5.0 for s in turning) >= 0.8 * len(turning)


@pytest.mark.parametrize("from_deg", [90.0, 180.0, 250.0])
def test_a_way_without_tacks_shows_none(tmp_path, from_deg):
    shown, tacks = sailed(tmp_path, from_deg=from_deg)
    assert len(shown) > 60
    settled = [s for t, s, _ in shown if not tacks or t > tacks[-1] + 5.0]
    assert set(settled) == {None}
