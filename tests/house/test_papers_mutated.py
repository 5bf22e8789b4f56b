"""The rows of docs/lab/papers.md hold: code that a row names, spoiled in one place, fails a test that the row names.

``python -m pytest tests/house/test_papers_mutated.py -m campaign`` spoils a copy of the tree, one place after the other
(nightly: half an hour of a core). What is always looked at is that each place is there and that its row names both.
"""

import os
import shutil
import subprocess
import sys
from typing import NamedTuple

import pytest

from tests.house.test_papers import FILE, PAPERS, ROOT, TEST, chapter, parts


class Mutation(NamedTuple):
    """Code that stands once in a file, what is put in its place, and the test that must fail then."""

    file: str
    code: str
    spoiled: str
    test: str


VALUE, EVALUATE = "companion/planner/problem/value.py", "companion/planner/problem/evaluate.py"
ASTAR, KERNELS = "companion/planner/reference/astar.py", "companion/planner/reference/kernels.py"
TRIGGERS, HEADINGS = "companion/skipper/planning/triggers.py", "companion/skipper/behaviors/headings.py"
GEOMETRY = "companion/skipper/way/geometry.py"
FIELDS, PROJECTION = "companion/field/vector_fields.py", "companion/field/projection.py"
T_ASTAR, T_VOYAGE = "tests/planner/reference/test_astar.py::", "tests/skipper/test_voyage.py::"
T_HEADINGS, T_FIGURES = "tests/skipper/behaviors/test_headings.py::", "tests/planner/test_figures.py::"
T_ALGEBRA, T_RRT = "tests/field/test_algebra.py::", "tests/planner/reference/test_rrtstar.py::"

MUTATIONS = (
    # Wolsieffer
    Mutation(
        "companion/wind/true_wind.py",
        "sample.tws_mps * math.sin(sample.twd_from_rad) + ve",
        "sample.tws_mps * math.sin(sample.twd_from_rad) - ve",
        "tests/wind/test_true_wind.py::test_apparent_and_true_are_inverses",
    ),
    Mutation(
        EVALUATE,
        "half, sigma = worst_no_go(p, t, min(t1, 1e12))",
        "half, sigma = worst_no_go(p, 0.0, 0.0)",
        "tests/planner/problem/test_evaluate.py::test_late_legs_meet_a_wider_zone",
    ),
    Mutation(
        EVALUATE,
        "spent = abs(turn) / p.boat.turn_rate_radps",
        "spent = 0.0",
        "tests/planner/problem/test_evaluate.py::test_one_tack_by_hand",
    ),
    Mutation(
        "companion/wind/estimators/time_series.py",
        "psi1, psi2 = psi, psi1",
        "psi1, psi2 = 1.0, psi1",
        "tests/wind/test_time_series.py::test_arma_tells_the_spread_of_the_process_that_it_sees",
    ),
    Mutation(
        "companion/wind/estimators/kalman.py",
        "len(self._window)) @ kf.K.T",
        "len(self._window))",
        "tests/wind/test_papers.py::test_the_kalman_filter_is_equations_1_to_8",
    ),
    Mutation(
        VALUE,
        "return self.boat.no_go_half_rad + self.widening_rad(t_s)",
        "return self.boat.no_go_half_rad - self.widening_rad(t_s)",
        "tests/planner/problem/test_problem.py::test_the_zone_widens_with_probability_and_time",
    ),
    Mutation(
        KERNELS,
        "angle = half + EDGE_PAD if side < 2",
        "angle = 1.2 * half if side < 2",
        T_RRT + "test_inside_it_takes_the_edge_nearer_the_target_to_the_foot_of_the_perpendicular",
    ),
    Mutation(
        "lab/simulated_wind.py",
        "rate_hz = -math.log(1.0 - RHO_HZ)",
        "rate_hz = -math.log(1.0 - RHO_HZ) * 2.0",
        "tests/wind/test_papers.py::test_ar1_is_recovered_within_its_errors",
    ),
    Mutation(
        TRIGGERS,
        "left_s <= ctx.config.lead_s + ctx.late_s",
        "left_s <= 0.0",
        T_VOYAGE + "test_replans_at_each_waypoint_from_the_next_one_and_before_it_is_reached",
    ),
    Mutation(
        TRIGGERS,
        "now_rad > max(FORECAST_WIDTH * then_rad, then_rad + FORECAST_WIDTH_RAD)",
        "False",
        T_VOYAGE + "test_by_forecast_policy_a_wind_that_becomes_less_certain_means_a_plan_at_once",
    ),
    Mutation(
        "bench/papers.py",
        "wind=kalman(WIND_7_DEG, sigma0_deg, 0.05)",
        "wind=kalman(WIND_7_DEG, 0.5, 0.05)",
        T_FIGURES + "test_figure_7_noise_moves_the_path_to_the_other_channel",
    ),
    # Büsser
    Mutation(
        HEADINGS,
        "drift, half, twd = drift_correction_rad",
        "drift, half, twd = 0.0 * drift_correction_rad",
        T_HEADINGS + "test_a_leg_is_made_good_across_a_current_and_leeway_by_equation_3",
    ),
    Mutation(
        HEADINGS,
        "return wrap_pi(twd + side * max(half, side * off_wind + side * back))",
        "return wrap_pi(twd)",
        T_VOYAGE + "test_by_headings_under_guided_it_arrives_and_hands_back",
    ),
    Mutation(
        HEADINGS,
        "return 1.0 if side is Side.PORT else -1.0",
        "return -1.0 if side is Side.PORT else 1.0",
        T_HEADINGS + "test_the_buoy_is_left_on_its_side",
    ),
    Mutation(
        TRIGGERS,
        "turned > config.wind_change_rad and",
        "turned > 3.0 * config.wind_change_rad and",
        T_VOYAGE + "test_the_mean_of_the_wind_has_turned_by_twenty_degrees",
    ),
    Mutation(
        TRIGGERS,
        'if ctx.is_raised("off the corridor"):',
        'if ctx.is_raised("off the corridor") and False:',
        T_VOYAGE + "test_off_the_leg_by_more_than_is_allowed",
    ),
    Mutation(
        TRIGGERS,
        "route.plan_t_s > config.plan_age_s:",
        "route.plan_t_s > 10.0 * config.plan_age_s:",
        T_VOYAGE + "test_a_plan_is_made_anew_when_it_is_old",
    ),
    Mutation(
        GEOMETRY,
        "    if is_past(boat, before, current):\n        return True\n",
        "",
        "tests/skipper/way/test_geometry.py::test_double_conditions",
    ),
    Mutation(
        "companion/wind/estimators/means.py",
        "weight * math.sin(x_rad), weight * math.cos(x_rad), speed_weight",
        "weight * x_rad, weight, speed_weight",
        "tests/wind/test_papers.py::test_buesser_means_are_vector_means_of_their_window",
    ),
    Mutation(
        ASTAR, "if (i, j) != (0, 0)]", "if abs(i) + abs(j) == 1]", T_ASTAR + "test_there_are_24_steps_on_16_headings"
    ),
    Mutation(
        ASTAR,
        "return int(np.argmin(np.where(sailable, off, np.inf)))",
        "return int(np.argmin(off))",
        T_ASTAR + "test_the_goal_heading_is_the_bearing_turned_out_of_the_wind",
    ),
    Mutation(
        ASTAR,
        "np.abs(times - away / mean_mps) < match_s",
        "np.abs(times) < match_s",
        T_ASTAR + "test_a_ship_is_a_disc_where_it_would_be_met",
    ),
    Mutation(KERNELS, "seconds + weight[TURN] * turn", "seconds", T_ASTAR + "test_the_turning_cost_makes_fewer_turns"),
    Mutation(
        "companion/boat/polar.py",
        "(-0.0048, 0.0335,",
        "(-0.0480, 0.0335,",
        "tests/boat/test_polar.py::test_avalon_is_equation_4_1_in_radians_and_knots",
    ),
    Mutation(
        "sitl/scenarios/four-ships.toml",
        "at_s = 100.0",
        "at_s = 30.0",
        "tests/voyages/test_traffic.py::test_four_ships_at_once_and_the_paths_look_alike",
    ),
    Mutation(
        "companion/skipper/planning/statement.py",
        "if gate.bandwidth_m is None:",
        "if True:",
        T_VOYAGE + "test_a_band_bounds_the_way",
    ),
    Mutation(
        KERNELS,
        "/ weight[FAST] if weight[FAST] > 0.0 else 0.0",
        "/ weight[FAST] * 0.0",
        T_ASTAR + "test_it_is_dijkstra_s_optimum_with_less_work",
    ),
    Mutation(
        KERNELS,
        "cost += weight[TUNNEL] * off",
        "cost += 0.0 * off",
        T_FIGURES + "test_figure_5_3_b_the_tunnel_makes_the_path_worse",
    ),
    Mutation(
        ASTAR,
        "<= twa <= deepest + 1e-9",
        "<= twa <= 4.0",
        T_FIGURES + "test_figure_5_4_c_160_degrees_is_as_deep_as_it_goes",
    ),
    Mutation(
        ASTAR,
        "if grid.memory_bytes > settings.memory_bytes:",
        "if False:",
        T_ASTAR + "test_the_grid_refuses_to_grow_past_its_memory_and_says_what_would_fit",
    ),
    Mutation(
        ASTAR,
        "between = max(round(apart / grid_m), int(apart >= LEAST_SHARE * grid_m))",
        "between = int(apart / grid_m / 2.0) + 1",
        T_ASTAR + "test_start_and_goal_are_nodes_and_the_spacing_is_near_what_was_asked",
    ),
    Mutation(
        "companion/skipper/watch/measures.py",
        "return DETOUR * min(",
        "return 0.0 * min(",
        "tests/skipper/watch/test_charge.py::test_it_is_critical_while_it_still_covers_the_way_to_the_refuge",
    ),
    Mutation(
        "companion/skipper/planning/statement.py",
        "if left_m <= config.horizon_m:",
        "if True:",
        "tests/skipper/way/test_judge.py::test_the_local_plan_covers_the_next_miles_only",
    ),
    Mutation(
        EVALUATE,
        "if shore_of(p).hits(shapely.LineString([a, b])):",
        "if False:",
        "tests/planner/problem/test_evaluate.py::test_what_breaks_a_rule_is_named",
    ),
    Mutation(
        "lab/tasks/controllers.py",
        "return 0.5 * (1.0 + share), 0.5 * (1.0 - share)",
        "return 0.5 * (1.0 - share), 0.5 * (1.0 + share)",
        "tests/lab/test_controllers.py::test_motors",
    ),
    Mutation(
        "sitl/world/boats.py",
        "hull_mps: float = 2.4 ",
        "hull_mps: float = 9.9 ",
        "tests/field/test_vaimos.py::test_polar_has_a_no_go_zone_and_hull_speed",
    ),
    # Schmitt
    Mutation(
        FIELDS,
        "return self.left.evaluate(p) + self.right.evaluate(p)",
        "return self.left.evaluate(p) - self.right.evaluate(p)",
        T_ALGEBRA + "test_sum",
    ),
    Mutation(
        FIELDS,
        "force = REPULSIVE * np.exp(-(p[:, 0] ** 2 + p[:, 1] ** 2) / self.sigma_m**2)",
        "force = REPULSIVE * np.exp(-np.hypot(p[:, 0], p[:, 1]) / self.sigma_m)",
        T_ALGEBRA + "test_repulsive_atoms_are_gaussians_of_a_hundred_metres",
    ),
    Mutation(
        PROJECTION,
        "chosen = np.where(self._needs_projection(p, heading), edge, heading)",
        "chosen = heading",
        T_ALGEBRA + "test_the_trees_steer_to_sailable_directions_only",
    ),
    Mutation(
        PROJECTION, "<= _AHEAD_HALF_RAD", "<= 7.0 * _AHEAD_HALF_RAD", T_ALGEBRA + "test_obstacles_behind_do_not_matter"
    ),
    Mutation(
        "sitl/world/boats.py",
        "p1: float = 0.03 ",
        "p1: float = 0.10 ",
        "tests/field/test_vaimos.py::test_leeway_is_three_percent_of_the_wind",
    ),
    Mutation(
        "sitl/world/boats.py",
        "p9: float = 300.0 ",
        "p9: float = 30.0 ",
        "tests/field/test_vaimos.py::"
        "test_she_gathers_way_like_300_kg_under_a_small_sail_and_the_published_set_does_not",
    ),
    Mutation(
        "lab/tasks/controllers.py",
        "return rudder_max_rad * math.sin(off)",
        "return -math.sin(off)",
        "tests/lab/test_controllers.py::test_rudder_and_sheet",
    ),
)


# Rows of which no place has been spoiled yet: a name leaves this list for a mutation, none is added.
NONE_YET = {
    "Wolsieffer fig. 6",
    "Büsser 3.2.2",
    "Schmitt fig. 4.1",
    "Büsser 2.III.B",
    "Büsser 2.III.C",
    "Büsser 2.III.D",
    "Büsser 2.IV.C",
    "Büsser 2.IV.D",
    "Büsser 2.IV.E",
    "Büsser 2.V.C",
    "Büsser 2.V.G",
    "Büsser 2.VI",
    "Büsser 5.1",
    "Büsser 5.3",
    "Büsser eq. 4",
    "Schmitt 1.1",
    "Schmitt 2.1.3",
    "Schmitt 3.3",
    "Schmitt 4.1.1",
    "Schmitt 4.1.3",
    "Schmitt 5.1",
    "Schmitt 5.3",
    "Schmitt 6.1",
    "Wolsieffer 2.2",
    "Wolsieffer 3.2",
    "Wolsieffer 4",
    "Wolsieffer 4.1",
    "Wolsieffer eq. 10",
    "Wolsieffer eq. 9",
}


def rows():
    """Return the rows of all three papers that name code and a test: their name, the files, the tests."""
    for paper in PAPERS:
        for part, where, tested, _ in chapter(paper)[1]:
            files, tests = set(FILE.findall(where)), {f"{file}::{name}" for file, name in TEST.findall(tested)}
            if files and tests:
                yield f"{paper.split()[0]} {parts(part)[0]}", files, tests


ROWS = tuple(rows())


@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda m: m.test.split("::")[1])
def test_each_place_stands_once_and_a_row_names_it_with_its_test(mutation):
    assert (ROOT / mutation.file).read_text().count(mutation.code) == 1
    assert any(mutation.file in files and mutation.test in tests for _, files, tests in ROWS)


def test_every_row_has_a_mutation_but_those_that_are_known_to_have_none():
    held = {name for name, files, tests in ROWS if any(m.file in files and m.test in tests for m in MUTATIONS)}
    assert {name for name, _, _ in ROWS} - held == NONE_YET


@pytest.fixture(scope="module")
def tree(tmp_path_factory):
    """Return a copy of the tree as it stands, to be spoiled."""
    told = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=True,
        capture_output=True,
        text=True,
    )
    copy = tmp_path_factory.mktemp("spoiled")
    for name in told.stdout.splitlines():
        (copy / name).parent.mkdir(parents=True, exist_ok=True)
        shutil.copyfile(ROOT / name, copy / name)
    return copy


def ends(tree, test):
    """Return the exit code of a test in the tree: 0 passed, 1 failed, others that it could not be run."""
    words = [sys.executable, "-m", "pytest", "-x", "-q", "-n0", "-p", "no:cacheprovider", test]
    done = subprocess.run(
        words,
        cwd=tree,
        capture_output=True,
        check=False,
        text=True,
        env={**os.environ, "PYTHONPATH": str(tree), "PYTHONSAFEPATH": "1"},
    )
    return done.returncode, done.stdout[-3000:]


@pytest.mark.campaign
@pytest.mark.timeout(1800)
@pytest.mark.parametrize("mutation", MUTATIONS, ids=lambda m: m.test.split("::")[1])
def test_the_spoiled_code_fails_the_row_s_test(mutation, tree):
    file = tree / mutation.file
    sound = file.read_text()
    assert ends(tree, mutation.test)[0] == 0
    file.write_text(sound.replace(mutation.code, mutation.spoiled))
    try:
        code, said = ends(tree, mutation.test)
    finally:
        file.write_text(sound)
    assert code == 1, f"{mutation.file}: {mutation.spoiled!r} in place of {mutation.code!r} was not noticed\n{said}"
