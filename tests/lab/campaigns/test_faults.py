"""Faults drawn from a seed: repeatable, of every kind, and judged by a judge that can say no."""

import math
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import get_args

import msgspec
import pytest
import shapely

from companion.boat import Hull
from companion.geo.frame import LocalFrame
from companion.guard import Auxiliary
from companion.messages import GeoPoint, Mode
from companion.telemetry.folder.recorder import read_jsonl
from lab.campaigns.drawn_faults import (
    BESIDE,
    CREEPS_MPS,
    KINDS,
    LONG_S,
    MODES,
    NEAR_M,
    SHORT_S,
    draw,
    draw_beside,
    draw_jump,
    draw_turned_vane,
)
from lab.campaigns.fault_judge import (
    EXCUSES,
    REACTION_S,
    RESUME_S,
    Watch,
    false_wind_spans,
    mission_key,
    operator_spans,
)
from lab.campaigns.faults import BASE, FaultCase, faults, job_of, jump_figures, sail, sail_faults
from sitl import cli
from sitl.autopilot import EPOCH_S
from sitl.faults.spoofing import forgery_named
from sitl.options import CampaignOptions
from sitl.runner import Job
from sitl.scenario.scenario import EventSpec, Outlet, load_scenario

SEEDS = Path(__file__).parent / "seeds"
ROCK = shapely.box(10.0, -5.0, 20.0, 5.0)


def sailed(path, seed):
    return sail_faults(load_scenario(path), Job(scenario=path, seed=seed, case=FaultCase()))


def sail_kept(seed, again=0):
    """Sail what a seed drew; ``again`` with other noise, for what it shows is no matter of one."""
    return sailed(SEEDS / f"{seed}.toml", seed + again)


def test_a_seed_draws_the_same_faults_and_another_seed_others():
    base = load_scenario(BASE)
    assert draw(5, base) == draw(5, base)
    assert draw(5, base) != draw(6, base)


def test_a_turned_vane_is_drawn_beside_the_others_by_a_stream_of_its_own():
    base = load_scenario(BASE)
    turned = [(draw(seed, base), draw_turned_vane(seed, base)) for seed in range(60)]
    assert all(set(plain.events) < set(more.events) for plain, more in turned)
    extra = [next(e for e in more.events if e not in plain.events) for plain, more in turned]
    assert {e.kind for e in extra} == {"vane", "parameter"}
    assert all(60.0 <= abs(e.value_deg or e.value) <= 180.0 and 45.0 <= e.at_s <= 90.0 for e in extra)
    assert all(plain.wind == more.wind and plain.parameters == more.parameters for plain, more in turned)


def beside(seed, what, base, drawn=None):
    jump = draw_jump(seed, base, start_en=(0.0, 0.0), goal_en=(0.0, 170.0), solids_en=((10.0, 90.0),))
    return draw_beside(seed, draw(seed, base) if drawn is None else drawn, what, jump)


def test_what_is_drawn_beside_a_seeds_own_faults_is_drawn_apart_and_leaves_them():
    base = load_scenario(BASE)
    together = [(draw(seed, base), beside(seed, BESIDE, base)) for seed in range(60)]
    assert together[:5] == [(draw(seed, base), beside(seed, BESIDE, base)) for seed in range(5)]
    extra = [[e for e in more.events if e not in plain.events] for plain, more in together]
    assert all(set(plain.events) <= set(more.events) and plain.wind == more.wind for plain, more in together)
    kinds = {e.kind for events in extra for e in events}
    assert kinds == {"gps_jump", "kill_companion", "vane", "parameter", "disk"}
    assert {outlet for _, more in together for outlet in more.broken} == set(get_args(Outlet))
    assert {e.state for events in extra for e in events if e.kind == "disk"} == {"full", "read_only"}
    assert any({"gps_jump", "vane", "disk"} <= {e.kind for e in events} for events in extra)
    assert any(not events for events in extra)
    assert all(
        e.at_s + (e.for_s or 0.0) < more.limit_s for _, more in together for e in more.events if e.kind == "gps_jump"
    )
    one_by_one = [draw(seed, base) for seed in range(20)]
    for name in BESIDE:
        one_by_one = [beside(seed, (name,), base, drawn) for seed, drawn in enumerate(one_by_one)]
    assert [sorted(one.events, key=str) for one in one_by_one] == [
        sorted(more.events, key=str) for _, more in together[:20]
    ]
    assert [beside(seed, ("guidance", "planner"), base) for seed in range(5)] == [plain for plain, _ in together[:5]]


def test_a_vane_that_is_turned_far_is_a_false_wind_while_it_is():
    turned = EventSpec(at_s=10.0, kind="vane", state="offset", value_deg=-90.0, for_s=20.0)
    written = [
        EventSpec(at_s=40.0, kind="parameter", parameter="WNDVN_DIR_OFS", value=70.0),
        EventSpec(at_s=60.0, kind="parameter", parameter="WNDVN_DIR_OFS", value=0.0),
    ]
    others = [
        EventSpec(at_s=5.0, kind="vane", state="offset", value_deg=40.0),
        EventSpec(at_s=5.0, kind="vane", state="spikes", value_deg=170.0),
        EventSpec(at_s=5.0, kind="parameter", parameter="FENCE_RADIUS", value=100.0),
    ]
    assert false_wind_spans([turned, *written, *others], 100.0) == [(10.0, 30.0), (40.0, 60.0)]
    assert false_wind_spans(written[:1], 100.0) == [(40.0, 100.0)]
    assert not any(false_wind_spans(draw(seed, load_scenario(BASE)).events, 300.0) for seed in range(50))


def test_a_voyage_whose_outlets_cannot_be_used_arrives_and_says_so(tmp_path):
    scenario = msgspec.structs.replace(load_scenario(BASE), broken=get_args(Outlet))
    record = sail_faults(scenario, job_of(1, keep=tmp_path / "v"))
    assert (record["passed"], record["arrived"], record["broken"]) == (True, True, list(get_args(Outlet)))
    records = read_jsonl(tmp_path / "v/decisions.jsonl")
    gone = {r["what"] for r in records if r["kind"] == "auxiliary" and r["gone"]}
    assert gone == {Auxiliary.PAGE, Auxiliary.ORDERS_BY_PAGE, Auxiliary.SOCKET}
    assert any("the folder of the satellite link" in r["text"] for r in records if r["kind"] == "far")


def test_what_is_drawn_beside_is_no_part_of_another_campaign(capsys):
    assert cli.main(["faults", "--jumps", "--draw", "all", "--runs", "1"]) == 2
    assert "--draw" in capsys.readouterr().err


@pytest.fixture(scope="module")
def drawn():
    base = load_scenario(BASE)
    return [draw(seed, base) for seed in range(400)]


def test_every_kind_of_fault_is_drawn_and_within_the_voyage(drawn):
    events = [e for scenario in drawn for e in scenario.events]
    assert {e.kind for e in events} == {
        "link_quality",
        "link_cut",
        "link_half",
        "vane",
        "compass",
        "gps_jump",
        "gps_lost",
        "wind_shift",
        "wind_speed",
        "current",
        "crew",
        "kill_planner",
        "planner_hang",
        "kill_companion",
        "disk",
        "reboot",
        "mode",
        "arm",
        "foreign_mission",
        "battery",
        "radio_lost",
        "station",
        "knockdown",
        "neighbour",
        "spoof",
        "parameter",
        "leak",
    }
    assert all(0.0 <= e.at_s < scenario.limit_s for scenario in drawn for e in scenario.events)
    assert {e.state for e in events if e.kind == "vane"} == {"frozen", "offset", "spikes"}
    assert {e.state for e in events if e.kind == "disk"} == {"full", "sick", "read_only"}
    assert {e.state for e in events if e.kind == "link_half"} == {"unheard", "deaf"}
    assert {e.saved for e in events if e.kind == "kill_companion"} == {"kept", "lost", "torn", "old"}
    assert min(e.clock_step_s for e in events) == -EPOCH_S
    assert max(abs(e.clock_step_s) for e in events if e.clock_step_s > -EPOCH_S) > 3600.0
    assert any(e.noise > 0.0 for e in events)
    assert {e.listens for e in events if e.kind == "spoof"} == {False, True}
    assert all(forgery_named(e.forgery) for e in events if e.kind == "spoof")
    assert all(0.1 <= e.drift_mps <= 0.8 for e in events if e.kind == "current")


def test_every_failsafe_of_the_autopilot_is_drawn_with_its_actions_and_without_the_permission(drawn):
    def actions(name):
        return {s.parameters[name] for s in drawn if name in s.parameters}

    for name in ("FENCE_ACTION", "FS_ACTION"):
        assert actions(name) == {0.0, 1.0, 2.0, 3.0, 4.0}, name
    assert actions("BATT_FS_LOW_ACT") >= {0.0, 1.0, 2.0, 6.0}
    assert actions("BATT_FS_CRT_ACT") >= {1.0, 2.0, 5.0}
    assert actions("FS_THR_ENABLE") == actions("FS_GCS_ENABLE") == actions("FS_CRASH_CHECK") == {1.0, 2.0}
    assert {s.set_auto for s in drawn} == {False, True}


def test_what_takes_long_is_rare_and_leaves_the_voyage_time(drawn):
    """A voyage that ends in the middle of half an hour's calm proves nothing; a campaign of them takes a day."""
    long = [
        (s, e) for s in drawn for e in s.events if e.kind in {"wind_speed", "link_cut"} and (e.for_s or 0.0) > 300.0
    ]
    assert all(s.limit_s >= e.at_s + e.for_s for s, e in long)
    assert max(e.for_s for _, e in long if e.kind == "wind_speed") > 1200.0
    assert max(e.for_s for _, e in long if e.kind == "link_cut") > 2400.0
    assert len(long) < 0.06 * len(drawn)
    assert {round(s.wind.tws_mps) for s in drawn} == set(range(2, 13))


@pytest.mark.parametrize("seed", [17, 5])
def test_a_voyage_with_faults_repeats_exactly(seed, tmp_path):
    first, second = (sail(job_of(seed, keep=tmp_path / name)) for name in "ab")
    assert first == second
    assert first["passed"], first
    for name in ("telemetry.tlog", "track.csv"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


def jumps(seeds, base):
    return [
        draw_jump(seed, base, start_en=(0.0, 0.0), goal_en=(0.0, 170.0), solids_en=((10.0, 90.0),)) for seed in seeds
    ]


def test_false_positions_are_drawn_of_every_kind_and_mode_and_within_their_bounds():
    base = load_scenario(BASE)
    drawn = jumps(range(200), base)
    assert drawn[:5] == jumps(range(5), base)
    assert {(d.kind, d.mode) for d in drawn} == {(kind, mode) for kind in KINDS for mode in MODES}
    for d in drawn:
        jump = next(e for e in d.scenario.events if e.kind == "gps_jump" and e.for_s is not None)
        assert SHORT_S <= d.for_s <= LONG_S
        assert math.hypot(jump.east_m, jump.north_m) == pytest.approx(d.size_m, abs=NEAR_M)
        assert jump.at_s + d.for_s < d.scenario.limit_s
        if d.kind == "creeping":
            assert CREEPS_MPS[0] - 0.1 < d.size_m / jump.over_s < CREEPS_MPS[1] + 0.1
    assert {d.size_class for d in drawn} == {"to 100 m", "to 500 m", "farther"}


def test_a_false_position_that_only_ours_touched_by_is_a_fault_of_its_class():
    plain = {"kind": "followed", "mode": "by plan", "size": "to 100 m", "arrived": True, "simulated_s": 1.0}
    table = jump_figures(
        [
            {**plain, "seed": 0, "passed": False, "touched_s": [80.0], "held_touched_s": []},
            {**plain, "seed": 5, "passed": True, "touched_s": [], "held_touched_s": [90.0]},
        ]
    )
    assert table["failed_seeds"] == [0]
    assert {(r["class"], r["touched"], r["held_touched"]) for r in table["classes"]} == {
        (name, 1, 1) for name in ("followed", "followed, to 100 m", "by plan", "all")
    }


# What the campaign found: a mission written one by one over a bad link (233), sails set on a position that had just
# jumped (362), a position that jumped back and was not believed in time (475), an upload left half done (602); since
# hulls and floors are judged, legs too short for the autopilot to follow (304) and a jump into a rock that LOITER was
# not allowed to wait out (673); and in the campaign a planner that hung and cost the margin (83), a contact in a gust
# (548), a corridor wider than the margin (808).
# They are kept as they were drawn: the draw has changed since.
@pytest.mark.parametrize("seed", [233, 304, 362, 475, 602, 673])
def test_a_seed_that_failed_once_does_not_again(seed):
    record = sail_kept(seed)
    assert record["passed"], record
    assert record["arrived"]


# A boat handed back 4 s before a rock (556), jumps of 17 and 18 m, less than two margins, that looked like fixes.
@pytest.mark.parametrize("seed", [556, 561738530, 799280087])
def test_nor_does_one_that_the_campaign_or_the_search_found(seed):
    record = sail_kept(seed)
    assert record["passed"], record


# Explained in docs/lab/campaigns.md and not mended; whoever mends one moves it up.
@pytest.mark.campaign
@pytest.mark.xfail(strict=True, reason="found and not mended")
@pytest.mark.parametrize("seed", [198, 106980778, 1261850702, 1494742110, 1632617857, 1896519915, 2045914046])
def test_what_was_found_and_is_not_mended_fails_still(seed):
    assert all(sail_kept(seed, again)["passed"] for again in range(6))


# They touched: a jump that the autopilot's filter takes late, and a fence of 49 m enabled under way.
@pytest.mark.campaign
@pytest.mark.parametrize("seed", [60496028, 1262423428])
def test_what_was_found_and_is_mended_passes_whatever_the_noise(seed):
    assert all(sail_kept(seed, again)["passed"] for again in range(6))


# Short legs in a gap of 30 m (1026825460).
@pytest.mark.campaign
def test_a_gap_between_rocks_is_sailed_clear_whatever_the_noise():
    assert min(sail_kept(1026825460, again)["clearance_m"] for again in range(6)) > 10.0


# Refused plans had her hold beside a rock when her position jumped (284); they are found since legs are long enough.
@pytest.mark.campaign
@pytest.mark.parametrize("seed", [83, 284, 548, 808])
def test_nor_does_one_of_those_that_came_too_near(seed):
    record = sail_kept(seed)
    assert record["passed"], record
    assert record["clearance_m"] > 6.0


def test_what_comes_below_the_floor_in_ordinary_weather_fails(tmp_path):
    """Plans keep a floor as high as the margin by themselves: so there is a rock beside the start, too."""
    ring = "-1.31013 50.8169, -1.31016 50.8169, -1.31016 50.8171, -1.31013 50.8171, -1.31013 50.8169"
    beside = f"\nStart|exclusion|POLYGON (({ring}))\n"
    for name in ("rocks.toml", "rocks.wkt"):
        text = (BASE.parents[3] / "missions" / name).read_text() + (beside if name == "rocks.wkt" else "")
        (tmp_path / name).write_text(text.replace("margin_floor_m = 6.0", "margin_floor_m = 12.0"))
    base = tmp_path / "s.toml"
    kept = (SEEDS / "9.toml").read_text()  # a gust, long after the rocks
    base.write_text(kept.replace("../../../../missions/rocks.toml", "rocks.toml"))
    record = sailed(base, 9)
    assert record["weather_only"]
    assert not record["passed"]
    assert record["faults"] == [
        f"{record['clearance_m']:.1f} m clear at {record['clearance_t_s']:.0f} s, in ordinary weather"
    ]


@dataclass
class Ghost:
    """What the watch reads of an autopilot."""

    watch: Watch
    t_s: float = 0.0
    items: list = field(default_factory=list)
    link: SimpleNamespace = field(default_factory=lambda: SimpleNamespace(is_up=True))

    def at(
        self,
        east,
        north,
        *,
        believed=None,
        mode=Mode.AUTO,
        for_s=0.25,
        is_armed=True,
        fails=False,
        stopped_by="",
        tws_mps=5.0,
        current_en_mps=(0.0, 0.0),
    ):
        geo = self.watch.frame.geo_from_en
        point, seen = geo(east, north), geo(*(believed or (east, north)))
        autopilot = SimpleNamespace(
            truth=SimpleNamespace(
                position=point, heading_rad=0.0, is_armed=is_armed, mode=mode, tws_mps=tws_mps, twd_from_rad=0.0
            ),
            core=SimpleNamespace(
                chart=SimpleNamespace(point=lambda _: seen),
                vehicle=SimpleNamespace(position=None, current_en_mps=current_en_mps),
            ),
            pilot=SimpleNamespace(
                failsafe=SimpleNamespace(is_active=fails, stopped_by=stopped_by),
                ekf=SimpleNamespace(is_ready=not fails),
                helm=SimpleNamespace(mission=SimpleNamespace(items=[None, *self.items])),
            ),
        )
        for _ in range(round(for_s / 0.25)):
            self.watch.truth(self.t_s, autopilot, self.link)
            self.t_s += 0.25


@pytest.fixture
def ghost():
    watch = Watch(solid=ROCK, hull=Hull(), frame=LocalFrame(GeoPoint(lat_deg=50.8, lon_deg=-1.3)))
    watch.lives = [(0.0, 1000.0)]
    return Ghost(watch)


def item(command, x, y):
    return SimpleNamespace(command=command, x=x, y=y)


def excuses(ghost):
    return [excuse for _, excuse in ghost.watch.contacts()]


def touch(ghost, clear_s=RESUME_S + 1.0, **how):
    """Go into the rock ``how``, out again, and wait."""
    ghost.at(15.0, 0.0, **how)
    ghost.at(30.0, 0.0, for_s=clear_s)


def test_a_contact_is_excused_only_by_what_nobody_could_help(ghost):
    ghost.at(0.0, 0.0)
    touch(ghost)
    touch(ghost, believed=(40.0, 0.0), clear_s=REACTION_S - 2.0)
    touch(ghost)  # right again, but only just
    touch(ghost, believed=(12.0, 0.0))  # wrong, but in the rock by its own belief
    touch(ghost, mode=Mode.HOLD)  # stopped, and free to be sailed
    touch(ghost, mode=Mode.HOLD, fails=True, clear_s=RESUME_S - 2.0)
    touch(ghost)  # just let go by the failsafe
    touch(ghost, mode=Mode.MANUAL, is_armed=False, fails=True)
    ghost.watch.operator_s = [(ghost.t_s, ghost.t_s + 20.0)]
    touch(ghost, mode=Mode.MANUAL, clear_s=20.0 + REACTION_S - 1.0)
    touch(ghost)  # just given back
    touch(ghost)
    assert excuses(ghost) == [
        "unexcused",
        "false position",
        "false position",
        "unexcused",
        "unexcused",
        "autopilot refuses",
        "autopilot refuses",
        "autopilot refuses",
        "operator",
        "operator",
        "unexcused",
    ]
    assert set(excuses(ghost)) < {*EXCUSES, "unexcused"}
    assert ghost.watch.clearance_m()[0] == 0.0


def test_a_corner_that_is_cut_between_two_looks_is_a_contact(ghost):
    ghost.at(9.5, 4.0)
    ghost.at(10.5, 5.5)
    assert excuses(ghost) == ["unexcused"]


def test_a_boat_that_was_stopped_is_excused_while_nobody_reaches_it(ghost):
    ghost.at(0.0, 0.0)
    ghost.link.is_up = False
    touch(ghost)  # under way: the mission on board must be safe
    touch(ghost, mode=Mode.HOLD)
    ghost.link.is_up = True
    ghost.watch.lives = [(0.0, ghost.t_s)]
    ghost.at(30.0, 0.0)
    touch(ghost, mode=Mode.HOLD)
    ghost.watch.lives.append((ghost.t_s, 1000.0))
    touch(ghost, mode=Mode.HOLD)
    assert excuses(ghost) == ["unexcused", "cut off", "cut off", "unexcused"]


def test_what_a_failsafe_stopped_is_told_from_what_was_stopped_by_nobody(ghost):
    ghost.at(0.0, 0.0)
    touch(ghost, mode=Mode.HOLD, stopped_by="action")
    touch(ghost, mode=Mode.HOLD, stopped_by="crash", clear_s=REACTION_S - 1.0)
    touch(ghost)  # just given back
    touch(ghost, stopped_by="action")  # in AUTO: it was ended
    assert excuses(ghost) == ["failsafe", "crash", "crash", "unexcused"]
    assert len(ghost.watch.reach().stopped_s) == 2


@pytest.mark.parametrize(
    ("carried_s", "called_s", "tws_mps", "excuse"),
    [
        (400.0, 250.0, 0.0, "drift"),  # two minutes and a half before
        (400.0, 300.0, 0.0, "unexcused"),  # too late for a crew
        (400.0, None, 0.0, "unexcused"),
        (90.0, 345.0, 0.0, "drift"),  # there was no more time, and it was said within a minute of its beginning
        (90.0, 375.0, 0.0, "unexcused"),
        (400.0, 250.0, 5.0, "unexcused"),  # there was wind to sail by
    ],
)
def test_a_drift_ashore_is_excused_where_the_crew_was_called_in_time(ghost, carried_s, called_s, tws_mps, excuse):
    ghost.at(0.0, 0.0, for_s=400.0 - carried_s)
    ghost.at(0.0, 0.0, for_s=carried_s, tws_mps=tws_mps, current_en_mps=(0.3, 0.0))
    ghost.watch.called_s = [] if called_s is None else [called_s]
    touch(ghost, tws_mps=tws_mps, current_en_mps=(0.3, 0.0))
    assert excuses(ghost) == [excuse]


def test_when_a_person_had_the_boat():
    def mode(at_s, name):
        return EventSpec(at_s=at_s, kind="mode", mode=name)

    events = [
        mode(10.0, "HOLD"),
        mode(15.0, "RTL"),
        mode(20.0, "AUTO"),
        mode(30.0, "AUTO"),
        mode(40.0, "LOITER"),
        EventSpec(at_s=12.0, kind="reboot"),
    ]
    assert operator_spans(events, 60.0) == [(10.0, 20.0), (40.0, 60.0)]
    assert operator_spans(events[:4], 60.0) == [(10.0, 20.0)]


def test_what_is_on_board_is_whole_or_a_beginning_that_ends_at_a_waypoint_of_its_own(ghost):
    a = [item(16, 1, 1), item(16, 2, 2), item(16, 3, 3), item(17, 4, 4)]
    b = [item(16, 1, 1), item(16, 6, 6), item(16, 7, 7), item(17, 8, 8)]
    stranger = [item(16, 9, 9)]
    ghost.watch.ours = {mission_key((i.command, i.x, i.y) for i in m) for m in (a, b)}
    ghost.watch.foreign = {mission_key((i.command, i.x, i.y) for i in stranger)}
    for items in ([], a[:2], a, [*a, b[2]], [a[0], item(17, 1, 1), *b[2:]], [a[0], item(17, 2, 2)], b, stranger):
        ghost.items = items
        ghost.at(0.0, 0.0, is_armed=items not in ([], a[:2]), for_s=5.0)
        assert ghost.watch.mixture_s() == 0.0, items
    assert 9.0 < ghost.watch.held_back_s() < 10.0
    ghost.link.is_up = False
    for items in ([a[0], *b[1:2], *a[2:]], a[:2], [item(17, 9, 9)], [*a[:3], *b[3:]], [a[0], item(17, 10, 10)]):
        ghost.items = items
        ghost.watch.missions.clear()
        ghost.watch.armed.clear()
        ghost.watch.t_s.clear()
        ghost.at(0.0, 0.0)
        assert ghost.watch.mixture_s() > 0.0, items


@pytest.mark.parametrize(
    ("for_s", "then", "is_mixture"),
    [(0.5, [item(16, 9, 9)], False), (3.0, [item(16, 9, 9)], True), (0.5, [item(16, 1, 1), item(17, 4, 4)], True)],
)
def test_what_a_stranger_s_upload_leaves_on_board_for_a_moment_is_his(ghost, for_s, then, is_mixture):
    """Seeds 744 and 949: his count had cut our mission to its first item, his own item was not written yet."""
    ours = [item(16, 1, 1), item(16, 2, 2), item(17, 4, 4)]
    ghost.watch.ours = {mission_key((i.command, i.x, i.y) for i in ours)}
    ghost.watch.foreign = {((16, 9, 9),)}
    for items, span_s in ((ours, 5.0), (ours[:1], for_s), (then, 5.0)):
        ghost.items = items
        ghost.at(0.0, 0.0, for_s=span_s)
    assert (ghost.watch.mixture_s() > 0.0) == is_mixture


def test_silence_counts_within_a_life_only(ghost):
    ghost.watch.lives = [(0.0, 10.0), (50.0, 70.0)]
    assert ghost.watch.silence_s([1.0, 2.0, 9.0, 51.0, 66.0, 69.0]) == 15.0


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_a_thousand_voyages_with_faults(tmp_path):
    assert faults(FaultCase(), runs=1000).run(CampaignOptions(), tmp_path / "faults.json") == 0
