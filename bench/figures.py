"""Reproduce the papers' figures into docs/figures: ``python -m bench.figures [name ...]`` (make figures).

- wolsieffer-2: a rock to leeward, and a shift: the path of the moment's wind collides, that of its spread does not.
- wolsieffer-6: four polygons; up wind at 60 and 66 % by two growths of the Kalman filter's variance, the second of
  which leaves no solution at 66 %, down wind at both. The tree is the reference RRT*'s.
- wolsieffer-7: two channels; the wind just lets the right-hand one be sailed, noise closes it, down wind.
- busser-5-1 .. busser-5-4: AVALON's costs added one by one: sailing time alone; turning; estimate and tunnel;
  other winds.
- field-atoms, field-trees: Schmitt's figures 6.1 to 6.5, and her trees 4.2 and 4.3; wrsc2013-field: her task;
  field-composed: missions/field-ring.toml, as `companion field --plot` draws it.
- wind-filter: Wolsieffer's filter by its noise R and window N over simulated wind; wind-filter-recorded: over the
  records in $COMPANION_WIND_DATA, left as it is without them.
- risk: the promise of a path against simulated winds, as its limit is tightened.

The problems are in ``bench.papers``.
"""

from __future__ import annotations

import io
import os
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib as mpl

from bench.fields import atoms_figure, encounter_figure, trees_figure
from bench.papers import (
    AS_SHUT,
    AS_WIDE,
    DELTA_6A,
    DELTA_6B,
    NOISY_DEG,
    SHIFT_2_DEG,
    SIGMA_2_DEG,
    STEADY_DEG,
    fallen_off,
    four_polygons,
    lake,
    lee_rock,
    two_channels,
)
from companion.planner.problem import evaluate

mpl.use("Agg")

import matplotlib.pyplot as plt
import numpy as np
from PIL import Image

from bench.winds import simulate_entries
from companion.errors import InputError
from companion.geofence import load_mission
from companion.mission_check import field_preview, field_track, heading_fan
from companion.planner import Problem, plan
from companion.planner.effort import Effort
from companion.planner.plan import Plan, PlanStatus
from companion.planner.reference.astar import search as search_astar
from companion.planners import AstarSettings
from companion.plots.field import field_figure
from companion.plots.plan import draw_plan
from companion.plots.wind import filter_figure
from companion.wind.study import characterise, parse_csv
from lab.simulated_wind import weather
from lab.tasks.wrsc2013 import HALF_M
from lab.tasks.wrsc2013 import run as run_wrsc2013
from sailbench.problem_set import FOLDER

OUT = Path(__file__).resolve().parents[1] / "docs" / "figures"


def save(figure, name):
    OUT.mkdir(parents=True, exist_ok=True)
    raw = io.BytesIO()
    figure.savefig(raw, dpi=80)
    plt.close(figure)
    # 128 colours are enough for drawings and a quarter of the size.
    picture = Image.open(raw).convert("RGB").quantize(128, Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
    picture.save(OUT / f"{name}.png", optimize=True)
    print(f"docs/figures/{name}.png")


# ------------------------------------------------------------------------------------- Wolsieffer
def wolsieffer_2():
    figure, axes = plt.subplots(1, 2, figsize=(11.0, 5.6), layout="constrained")
    shift = np.radians(SHIFT_2_DEG)
    for ax, sigma_deg, text in ((axes[0], 0.0, "the wind of the moment"), (axes[1], SIGMA_2_DEG, "the wind's spread")):
        p = lee_rock(sigma_deg)
        answer = plan(p, expansions=4000)
        draw_plan(ax, p, answer, title=f"planned in {text}; dashed: the wind {SHIFT_2_DEG:.0f}° to the right")
        ax.plot(*fallen_off(p, answer.waypoints_en, shift).T, "--", color="tab:red")
    save(figure, "wolsieffer-2")


def wolsieffer_6():
    figure, axes = plt.subplots(3, 2, figsize=(11.0, 18.4), layout="constrained")
    for ax, letter, is_up, delta, growth in (
        (axes[0, 0], "a, as wide as his", True, DELTA_6A, AS_WIDE),
        (axes[0, 1], "b", True, DELTA_6B, AS_WIDE),
        (axes[1, 0], "a, so that b is shut", True, DELTA_6A, AS_SHUT),
        (axes[1, 1], "b", True, DELTA_6B, AS_SHUT),
        (axes[2, 0], "c", False, DELTA_6A, AS_SHUT),
        (axes[2, 1], "d", False, DELTA_6B, AS_SHUT),
    ):
        p = four_polygons(delta, is_up=is_up, growth=growth)
        answer = plan(p, algorithm="rrtstar", expansions=6000, seed=1)
        way = "up" if is_up else "down"
        result = f"{answer.cost_s:.0f} s"
        if not answer.has_path:
            proved = plan(p, budget_s=1.0).status is PlanStatus.INFEASIBLE
            result = "no solution" + (", proved by auto" if proved else "")
        if answer.has_path:
            first, last = (2.0 * np.degrees(p.no_go_half_rad(t)) for t in (0.0, answer.legs[-1].end_s))
            result += f", no-go zone {first:.0f}° wide, at the end {last:.0f}°"
        title = f"({letter}) {way} wind, {100 * delta:.0f} %, {growth:g}°/√s:\n{result}"
        draw_plan(ax, p, answer, title=title, fans=answer.has_path)
    save(figure, "wolsieffer-6")


def wolsieffer_7():
    figure, axes = plt.subplots(1, 3, figsize=(13.0, 5.6), layout="constrained")
    for ax, letter, is_up, sigma0_deg, text in (
        (axes[0], "a", True, STEADY_DEG, "steady wind"),
        (axes[1], "b", True, NOISY_DEG, "noisy wind"),
        (axes[2], "c", False, NOISY_DEG, "down wind"),
    ):
        p = two_channels(sigma0_deg, is_up=is_up)
        answer = plan(p, budget_s=2.0)
        result = f"{answer.cost_s:.0f} s" if answer.has_path else answer.reason
        draw_plan(ax, p, answer, title=f"({letter}) {text}: {result}")
        ax.set(xlim=(-270, 210), ylim=(-80, 490))
    save(figure, "wolsieffer-7")


# ----------------------------------------------------------------------------------------- Büsser
def sail(p, **settings):
    outcome = search_astar(p, Effort(60.0, None), 0, AstarSettings(grid_m=20.0, **settings))
    if outcome.waypoints_en is None:
        return Plan(status=PlanStatus.TIMEOUT, reason=outcome.reason, waypoints_en=np.empty((0, 2))), outcome
    judged = evaluate(p, outcome.waypoints_en)
    return Plan(
        status=PlanStatus.FOUND,
        reason="",
        waypoints_en=outcome.waypoints_en,
        legs=judged.legs,
        cost_s=judged.time_s,
        algorithm="astar",
    ), outcome


def panel(ax, p, letter, text, **settings):
    answer, outcome = sail(p, **settings)
    turns = max(0, len(answer.legs) - 1)
    result = (
        outcome.reason
        if not answer.has_path
        else f"{answer.cost_s:.0f} s, {turns} turns, {outcome.trace['expanded']} nodes"
    )
    draw_plan(ax, p, answer, title=f"({letter}) {text}\n{result}", fans=False)


def busser_5_1():
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 6.2), layout="constrained")
    for ax, letter, knots in ((axes[0], "a", 10.0), (axes[1], "b", 20.0)):
        panel(
            ax,
            lake(0.0, knots),
            letter,
            f"sailing time only, {knots:.0f} kn from 0°",
            turn_s_per_rad=0.0,
            heuristic_mps=None,
        )
    save(figure, "busser-5-1")


def busser_5_2():
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 6.2), layout="constrained")
    for ax, letter, knots in ((axes[0], "a", 10.0), (axes[1], "b", 20.0)):
        panel(ax, lake(0.0, knots), letter, f"and heading changes, f = 8, {knots:.0f} kn", heuristic_mps=None)
    save(figure, "busser-5-2")


def busser_5_3():
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 6.2), layout="constrained")
    panel(axes[0], lake(0.0), "a", "and the estimate at 7 kn")
    panel(axes[1], lake(0.0), "b", "and the tunnel cost, width 200 m", tunnel_width_m=200.0)
    save(figure, "busser-5-3")


def busser_5_4():
    figure, axes = plt.subplots(1, 3, figsize=(14.0, 6.2), layout="constrained")
    for ax, letter, wind in ((axes[0], "a", 45.0), (axes[1], "b", 100.0), (axes[2], "c", 182.0)):
        panel(ax, lake(wind), letter, f"wind from {wind:.0f}°")
    save(figure, "busser-5-4")


def wind_filter():
    found = characterise([weather(1), weather(2, speed_mps=8.0)])
    title = "Wolsieffer's filter over simulated wind, by R and N: two records of 2 h at 1 Hz, noise of a reading 2.9°"
    save(filter_figure(found, title=title), "wind-filter")


def wind_filter_recorded():
    folder = os.environ.get("COMPANION_WIND_DATA", "")
    if not folder:
        print("docs/figures/wind-filter-recorded.png stays: no recorded wind, COMPANION_WIND_DATA names no folder")
        return
    paths = sorted(Path(folder).glob("*.csv"))
    if not paths:
        raise InputError("COMPANION_WIND_DATA", folder, "no CSV records in the folder", "name another or none")
    found = characterise([parse_csv(path.read_text().splitlines(), path.name) for path in paths])
    save(filter_figure(found), "wind-filter-recorded")


# ------------------------------------------------------------------------------------------- risk
def risk():
    base = Problem.from_json(FOLDER / "trap-beat.json")
    from companion.planner.problem import RiskLimit

    limits = [0.5, 0.3, 0.2, 0.1, 0.05, 0.02, 0.01]
    promised, share, cost = [], [], []
    for limit in limits:
        p = replace(base, risk=RiskLimit(max_path_risk=limit))
        answer = plan(p, budget_s=3.0)
        if answer.has_path:
            promised.append(answer.risk)
            share.append(float(np.mean(simulate_entries(p, answer, winds=20_000, step_s=0.5) >= 0)))
            cost.append(answer.cost_s)
    figure, axes = plt.subplots(1, 2, figsize=(10.0, 4.4), layout="constrained")
    line = np.array([0.004, 0.6])
    axes[0].fill_between(line, line / 3.0, line, color="#cfe3cf", label="allowed: a third to all of the promise")
    axes[0].loglog(promised, share, "o-", color="#c1272d", label="forced into the no-go zone, of 20,000 winds")
    axes[0].set(xlabel="promised risk of the path", ylabel="share of voyages", title="Is the promise true? (trap-beat)")
    axes[0].legend(fontsize=8)
    axes[1].semilogx(promised, cost, "o-", color="#1f4e79")
    axes[1].set(xlabel="promised risk of the path", ylabel="time [s]", title="What safety costs")
    for ax in axes:
        ax.grid(visible=True, which="both", alpha=0.3)
    save(figure, "risk")


# ---------------------------------------------------------------------------------------- Schmitt
def field_atoms():
    save(atoms_figure(), "field-atoms")


def field_trees():
    save(trees_figure(), "field-trees")


def field_composed():
    mission = load_mission("missions/field-ring.toml")
    seen = field_preview(mission)
    figure = field_figure(seen, heading_fan(seen), field_track(seen), title=f"{mission.name}: {seen.tree.text}")
    save(figure, "field-composed")


def wrsc2013():
    sailed = run_wrsc2013(WRSC_SEED)
    course, score = sailed.course, sailed.score
    title = (
        f"WRSC 2013, seed {WRSC_SEED}, by field: nearest hulls {score.least_m:.0f} m, "
        f"out after {score.left_after_s:.0f} s"
    )
    save(
        encounter_figure(
            sailed.track,
            sailed.intruder,
            half_m=HALF_M,
            twd_from_rad=course.twd_from_rad,
            tws_mps=course.tws_mps,
            title=title,
            entered_s=course.entry_s,
        ),
        "wrsc2013-field",
    )


WRSC_SEED = 9


FIGURES = {
    "wolsieffer-2": wolsieffer_2,
    "wolsieffer-6": wolsieffer_6,
    "wolsieffer-7": wolsieffer_7,
    "busser-5-1": busser_5_1,
    "busser-5-2": busser_5_2,
    "busser-5-3": busser_5_3,
    "busser-5-4": busser_5_4,
    "risk": risk,
    "wind-filter": wind_filter,
    "wind-filter-recorded": wind_filter_recorded,
    "field-atoms": field_atoms,
    "field-trees": field_trees,
    "field-composed": field_composed,
    "wrsc2013-field": wrsc2013,
}


def main(argv=None):
    names = sys.argv[1:] if argv is None else argv
    unknown = [n for n in names if n not in FIGURES]
    if unknown:
        print(f"bench.figures: unknown figure {unknown[0]!r}; choose from {', '.join(FIGURES)}", file=sys.stderr)
        return 2
    try:
        for name in names or FIGURES:
            FIGURES[name]()
    except InputError as error:
        print(f"bench.figures: {error}", file=sys.stderr)
        return error.exit_code
    return 0


if __name__ == "__main__":
    sys.exit(main())
