"""Guidance and planner of a campaign's voyages: given, or drawn apart from all else that a seed is."""

import argparse
from pathlib import Path

import pytest

from companion.errors import InputError
from lab.campaigns.campaign import campaign
from lab.campaigns.drawn_faults import draw
from lab.campaigns.faults import BASE, FaultCase, event_text, faults, job_of, method_of, sail
from lab.campaigns.mismatch import MismatchCase, mismatch
from lab.methods import DRAWABLE, GUIDANCES, PLANNERS, Method, why_not
from lab.options import add_draw, add_methods, methods_of
from sitl import cli
from sitl.run.embedded import mission_of
from sitl.run.variation import Variation
from sitl.runner import CampaignResults, made_by
from sitl.runner.result_store import StoredResults
from sitl.scenario import load_scenario

HERE = Path("sitl/scenarios")


def mission(name):
    path = HERE / f"{name}.toml"
    return mission_of(load_scenario(path), path)


def drawn_of(seed, scenario, draws=DRAWABLE):
    return method_of(job_of(seed, FaultCase(draws=draws)), scenario)


@pytest.fixture(scope="module")
def methods():
    scenario = load_scenario(BASE)
    return [drawn_of(seed, scenario) for seed in range(40)]


def test_each_guidance_with_each_planner_comes_and_a_seed_is_one_of_them(methods):
    assert {(m.guidance, m.planner) for m in methods} == {(g, p) for g in GUIDANCES for p in PLANNERS}
    assert {m.station_s is None for m in methods} == {True, False}
    assert drawn_of(7, load_scenario(BASE)) == methods[7]


def test_what_is_not_asked_for_is_the_missions_own():
    scenario = load_scenario(BASE)
    assert drawn_of(7, scenario, ()) == Method()
    assert Method().variation(mission("demo")) is None
    assert drawn_of(7, scenario, ("guidance",)).station_s is None
    assert drawn_of(7, scenario, ("planner",)).guidance is None


def test_who_may_not_steer_is_sailed_by_plan():
    drawn = next(s for s in (draw(seed, load_scenario(BASE)) for seed in range(100)) if not s.set_auto)
    assert {drawn_of(seed, drawn).guidance for seed in range(20)} == {"plan"}


def test_a_method_is_a_missions_keys_and_guided_is_permitted_for_it():
    demo = mission("demo")
    planned = Variation(tables={"skipper": {"autopilot_beats": False}})
    method = Method(guidance="heading", planner="astar", station_s=30.0)
    assert method.description == "by heading, planner astar, 30 s on a station"
    changed = method.variation(demo, planned).mission(demo)
    assert changed.options.skipper.station_s == 30.0
    assert (changed.skipper.guidance, changed.skipper.planner, changed.skipper.autopilot_beats) == (
        "heading",
        "astar",
        False,
    )
    assert changed.operator.guided
    assert not demo.operator.guided


def test_another_planner_leaves_the_numbers_of_the_missions_own():
    own = mission("by-astar")
    assert Method(planner="rrtstar").variation(own).mission(own).options.planner.grid_m is None
    assert Method(planner="astar").variation(own).mission(own).options.planner.grid_m == 8.0


def test_what_a_mission_cannot_be_sailed_by_is_not_drawn():
    assert why_not(mission("demo"), "field") == ""
    assert "gate" in why_not(mission("gates"), "field")


def test_a_campaign_says_what_a_mission_cannot_be_sailed_by():
    gates, demo = HERE / "gates.toml", HERE / "demo.toml"
    by_heading = [Method(guidance="heading")]
    both = campaign([gates, demo], runs=1, methods=by_heading)
    assert [job.scenario for job in both.jobs] == [demo]
    held = StoredResults(campaign="campaign", by=made_by())
    none = CampaignResults(records=[], held=held, lost=[], now=0, wall_s=0.0, cpu_s=0.0)
    told = both.sum_up(none).lines
    assert any(line.startswith("left out: gates, by heading: ") for line in told)
    with pytest.raises(InputError, match=r"left out: gates, by heading: .*gate"):
        campaign([gates], runs=1, methods=by_heading)


def test_a_faulty_voyage_is_the_same_but_for_what_is_drawn_of_the_boat(methods):
    seed = next(
        n for n, m in enumerate(methods) if m.guidance == "heading" and m.planner == "auto" and m.station_s is None
    )
    record, plain = sail(job_of(seed, FaultCase(draws=DRAWABLE))), draw(seed, load_scenario(BASE))
    assert record["method"] == "by heading, planner auto"
    assert record["events"] == [event_text(event) for event in plain.events]
    assert (record["parameters"], record["limit_s"]) == (plain.parameters, plain.limit_s)
    assert record["passed"], record


def test_results_of_the_default_keep_their_keys():
    def key(experiment):
        return experiment.key(experiment.jobs[0])

    plain, drawn = (key(faults(FaultCase(draws=draws), runs=1)) for draws in ((), DRAWABLE))
    assert "draws" not in plain
    assert drawn == {**plain, "draws": "guidance, planner, station"}
    plain, drawn = (key(mismatch(MismatchCase(draws=draws), runs=1, first_seed=3)) for draws in ((), DRAWABLE))
    assert "draws" not in plain
    assert drawn == {**plain, "draws": "guidance, planner, station"}
    assert set(key(campaign([HERE / "demo.toml"], runs=1))) == {"scenario", "hash", "seed"}


def test_the_options():
    parser = argparse.ArgumentParser()
    add_draw(parser)
    add_methods(parser)
    assert parser.parse_args([]).draw == ()
    assert parser.parse_args(["--draw", "planner, guidance"]).draw == ("guidance", "planner")
    assert parser.parse_args(["--draw", "all"]).draw == DRAWABLE
    assert methods_of(None, None) == [Method()]
    args = parser.parse_args(["--guidance", "plan", "heading", "--planner", "astar"])
    told = [m.description for m in methods_of(args.guidance, args.planner)]
    assert told == ["in AUTO, planner astar", "by heading, planner astar"]


@pytest.mark.parametrize(
    "words",
    [["faults", "--draw", "weather"], ["mismatch", "--draw", "guidance,"], ["campaign", "x.toml", "--planner", "mine"]],
)
def test_what_cannot_be_drawn_is_refused(words, capsys):
    assert cli.main(words) == 2
    assert "is none of" in capsys.readouterr().err
