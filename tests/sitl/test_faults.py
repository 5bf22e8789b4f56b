"""Faults drawn from a seed: repeatable, of every kind, and judged by a judge that can say no."""

from dataclasses import dataclass, field
from types import SimpleNamespace

import pytest
import shapely

from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint, Mode
from sitl.fault_draw import draw
from sitl.fault_watch import AFTER_ERROR_S, AFTER_OPERATOR_S, MAX_MIXTURE_S, Watch, mission_key
from sitl.faults import BASE, run_faults, sail_seed
from sitl.scenario import load_scenario

ROCK = shapely.box(10.0, -5.0, 20.0, 5.0)


def test_a_seed_draws_the_same_faults_and_another_seed_others():
    base = load_scenario(BASE)
    assert draw(5, base) == draw(5, base)
    assert draw(5, base) != draw(6, base)


def test_every_kind_of_fault_is_drawn_and_within_the_voyage():
    base = load_scenario(BASE)
    events = [e for seed in range(300) for e in draw(seed, base).events]
    assert {e.kind for e in events} == {
        "link_quality", "link_cut", "vane", "gps_jump", "gps_lost", "wind_shift", "wind_speed", "kill_planner",
        "planner_hang", "kill_companion", "reboot", "mode", "foreign_mission", "battery",
    }
    assert all(0.0 < e.at_s < base.limit_s for e in events)
    assert {e.state for e in events if e.kind == "vane"} == {"frozen", "offset", "spikes"}


@pytest.mark.parametrize("seed", [3, 17])
def test_a_voyage_with_faults_repeats_exactly(seed, tmp_path):
    first, second = sail_seed(seed, keep=tmp_path / "a"), sail_seed(seed, keep=tmp_path / "b")
    for record in (first, second):
        del record["cpu_s"]
    assert first == second
    assert first["passed"], first
    for name in ("telemetry.tlog", "track.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


# What the campaign found: sails set on a position that had just jumped (362), an upload left half done (602).
@pytest.mark.parametrize("seed", [362, 602])
def test_a_seed_that_failed_once_does_not_again(seed):
    record = sail_seed(seed)
    assert record["passed"], record
    assert record["arrived"]


@dataclass
class Ghost:
    """What the watch reads of an autopilot."""

    watch: Watch
    t_s: float = 0.0
    items: list = field(default_factory=list)
    link: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(is_cut=False))

    def at(self, east, north, *, believed=None, mode=Mode.AUTO, for_s=0.25):
        geo = self.watch.frame.geo_from_en
        point, seen = geo(east, north), geo(*(believed or (east, north)))
        pilot = SimpleNamespace(
            truth=SimpleNamespace(position=point, is_armed=True, mode=mode),
            chart=SimpleNamespace(point=lambda _: seen), vehicle=SimpleNamespace(position=None),
            helm=SimpleNamespace(mission=SimpleNamespace(items=[None, *self.items])),
        )
        for _ in range(round(for_s / 0.25)):
            self.watch.truth(self.t_s, pilot, self.link)
            self.t_s += 0.25


@pytest.fixture
def ghost():
    watch = Watch(solid=ROCK, frame=LocalFrame(GeoPoint(lat_deg=50.8, lon_deg=-1.3)))
    watch.lives = [(0.0, 1000.0)]
    return Ghost(watch)


def item(command, x, y):
    return SimpleNamespace(command=command, x=x, y=y)


def test_a_contact_is_excused_only_by_what_nobody_could_know(ghost):
    ghost.at(0.0, 0.0)
    ghost.at(15.0, 0.0)
    ghost.at(30.0, 0.0)
    ghost.at(15.0, 0.0, believed=(40.0, 0.0))
    ghost.at(30.0, 0.0)
    ghost.at(15.0, 0.0)                          # right again, but sailed here by the error
    ghost.at(30.0, 0.0, for_s=AFTER_ERROR_S + 1.0)
    ghost.at(15.0, 0.0, believed=(12.0, 0.0))    # wrong, but in the rock by its own belief
    ghost.at(30.0, 0.0, for_s=AFTER_ERROR_S + 1.0)
    ghost.at(15.0, 0.0, mode=Mode.HOLD)
    ghost.at(30.0, 0.0)
    ghost.at(15.0, 0.0)                          # just given back
    ghost.at(30.0, 0.0, for_s=AFTER_OPERATOR_S + 1.0)
    ghost.at(15.0, 0.0)
    assert ghost.watch.contacts() == {"unexcused": 3, "position": 2, "operator": 2}
    assert ghost.watch.clearance_m() == 0.0


def test_a_mixture_is_seen_while_it_can_be_put_right(ghost):
    a = [item(16, 1, 1), item(16, 2, 2), item(17, 3, 3)]
    b = [item(16, 5, 5), item(16, 6, 6), item(17, 7, 7)]
    ghost.watch.ours = {mission_key((i.command, i.x, i.y) for i in m) for m in (a, b)}
    ghost.items = [*a, b[2]]                      # behind the end: dead
    ghost.at(0.0, 0.0, for_s=60.0)
    assert ghost.watch.mixture_s() == (0.0, False)
    ghost.items = [b[0], *a[1:]]
    ghost.link.is_cut = True
    ghost.at(0.0, 0.0, for_s=60.0)
    assert ghost.watch.mixture_s() == (0.0, True)
    ghost.link.is_cut = False
    ghost.at(0.0, 0.0, for_s=MAX_MIXTURE_S + 1.0)
    assert ghost.watch.half_written_s() > 60.0
    longest_s, at_last = ghost.watch.mixture_s()
    assert longest_s > MAX_MIXTURE_S
    assert at_last


def test_silence_counts_within_a_life_only(ghost):
    ghost.watch.lives = [(0.0, 10.0), (50.0, 70.0)]
    assert ghost.watch.silence_s([1.0, 2.0, 9.0, 51.0, 66.0, 69.0]) == 15.0


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_a_thousand_voyages_with_faults(tmp_path):
    assert run_faults(runs=1000, json_path=tmp_path / "faults.json") == 0
