"""The rows of docs/lab/papers.md hold: code that a row names, spoiled in one place, fails a test that the row names.

``python -m pytest tests/house/test_papers_mutated.py -m campaign`` spoils a copy of the tree, one place after the other
(nightly: an hour of a core). What is always looked at is that each place is there and that its row names both.
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
        "companion/wind/estimators/time_series.py",
        "_GRID[best][1], self._next[best] - self._variance",
        "_GRID[best][1], 0.0",
        "tests/wind/test_time_series.py::test_garch_tells_a_restless_wind_from_a_quiet_one",
    ),
    Mutation(
        "companion/wind/estimators/kalman.py",
        "len(self._window)) @ kf.K.T",
        "len(self._window))",
        "tests/wind/test_papers.py::test_the_kalman_filter_is_equations_1_to_8",
    ),
    Mutation(
        "companion/wind/estimators/kalman.py",
        "wrap_pi(x_rad - kf.x[1, 0])",
        "(x_rad - kf.x[1, 0])",
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
        HEADINGS,
        "    if is_last or distance_m(*leg) < 1.0",
        "    if distance_m(*leg) < 1.0",
        T_HEADINGS + "test_near_the_destination_she_is_steered_at_it_and_before_that_along_her_leg",
    ),
    Mutation(
        HEADINGS,
        "along = wrap_pi(bearing_rad(*leg) + drift)",
        "along = wrap_pi(bearing_rad(boat, leg[1]) + drift)",
        T_HEADINGS + "test_near_the_destination_she_is_steered_at_it_and_before_that_along_her_leg",
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
    Mutation(
        KERNELS,
        "            if a * b < 0.0:  # eq. 4.5",
        "            if False:",
        T_ASTAR + "test_the_tack_cost_makes_fewer_tacks_and_the_tunnel_keeps_to_the_line",
    ),
    Mutation(
        ASTAR,
        "tunnel, border_m = 10.0 / settings.tunnel_width_m, 0.0",
        "tunnel, border_m = 5.0 / settings.tunnel_width_m, 0.0",
        T_ASTAR + "test_each_tack_and_each_gybe_costs_what_is_set_and_a_step_beside_the_line_what_equation_4_6_says",
    ),
    Mutation(
        "companion/planners.py",
        '_set_by("heuristic_kn", 7.0 * MPS_PER_KNOT',
        '_set_by("heuristic_kn", 6.0 * MPS_PER_KNOT',
        T_ASTAR + "test_the_numbers_are_those_that_he_ends_with_and_seven_knots_are_what_is_estimated",
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
        FIELDS,
        "rho: float = 0.1",
        "rho: float = 0.3",
        T_ALGEBRA + "test_circle_is_tangent_at_ten_metres_clockwise_and_leads_there",
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
        "return RUDDER_MAX_RAD * math.sin(off)",
        "return -math.sin(off)",
        "tests/lab/test_controllers.py::test_rudder_and_sheet",
    ),
    # The rest of the rows, of all three.
    Mutation(
        "companion/planner/reference/astar.py",
        "return int(np.argmin(np.where(sailable, off, np.inf)))",
        "return int(np.argmin(off))",
        "tests/planner/test_algorithms.py::test_each_finds_a_path_that_the_scorer_passes",
    ),
    Mutation(
        "companion/planner/reference/rrtstar_kernels.py",
        "return t + risk_number[WEIGHT] * risk + risk_number[STATE_WEIGHT] * most",
        "return t + risk_number[WEIGHT] * risk",
        "tests/planner/reference/test_rrtstar.py::test_the_weight_of_the_worst_state_buys_angle_to_the_wind",
    ),
    Mutation(
        "companion/planner/reference/rrtstar_kernels.py",
        "node[new, T], node[new, R], node[new, C], node[new, M] = best_t, best_r,",
        "node[new, T], node[new, R], node[new, C], node[new, M] = 0.9 * best_t, best_r,",
        "tests/planner/reference/test_rrtstar.py::test_every_state_s_time_is_the_scorer_s_time_of_its_path",
    ),
    Mutation(
        "companion/planner/reference/rrtstar_kernels.py",
        "            if keep <= 0.0:\n",
        "            if True:\n",
        T_RRT + "test_where_a_leg_would_hit_something_its_last_valid_state_is_taken",
    ),
    Mutation(
        "companion/planner/reference/rrtstar_kernels.py",
        "for m in range(found if risk_number[REWIRES] > 0.5 else 0):",
        "for m in range(0):",
        T_RRT + "test_a_later_state_becomes_the_parent_of_an_earlier_one_where_that_makes_it_cheaper",
    ),
    Mutation(
        "companion/wind/estimators/estimator.py",
        "self._predict(max(0.0, float(horizon_s)))",
        "self._predict(min(100.0, float(horizon_s)))",
        "tests/wind/test_estimators.py::test_the_kalman_filter_depends_on_the_rate_and_grows_without_bound",
    ),
    Mutation(
        "sitl/autopilot/boat/kernel.py",
        "drag = 0.5 * v * abs(v)",
        "drag = 0.6 * v * abs(v)",
        "tests/sitl/autopilot/boat/test_agreement.py::test_polar",
    ),
    Mutation(
        "companion/plots/wind.py",
        "axes.hist(off, bins=60, range=(-reach, reach), density=True,",
        "axes.hist(off, bins=60, range=(-reach, reach), density=False,",
        "tests/wind/test_picture.py::test_figure_4_is_the_share_of_the_readings_and_the_normal_beside_it",
    ),
    Mutation(
        "bench/papers.py",
        "wind=kalman(0.0, 0.0, growth),",
        "wind=kalman(0.0, 0.0, 0.5 * growth),",
        "tests/planner/test_figures.py::test_figure_6_b_at_66_percent_there_is_none_and_auto_proves_it",
    ),
    Mutation(
        "companion/traffic/nmea.py",
        "return float(speed_kn) * MPS_PER_KNOT",
        "return float(speed_kn)",
        "tests/traffic/test_nmea.py::test_a_position_report",
    ),
    Mutation(
        "companion/planner/worker.py",
        "        self.restarts += 1\n",
        "        self.restarts += 2\n",
        "tests/planner/test_worker.py::test_plans_dies_hangs_and_comes_back",
    ),
    Mutation(
        "sitl/world/boats.py",
        "p9: float = 300.0 ",
        "p9: float = 3.0 ",
        "tests/field/test_vaimos.py::test_inertia_she_takes_time_to_gather_and_to_lose_way",
    ),
    Mutation(
        "sitl/autopilot/boat/kernel.py",
        "s[S_SAIL] = clip(awa - p[P_IDEAL],",
        "s[S_SAIL] = clip(awa - 0.5 * p[P_IDEAL],",
        "tests/sitl/autopilot/boat/test_agreement.py::test_servos_of_the_sail",
    ),
    Mutation(
        "sitl/autopilot/boat/vehicle.py",
        "self.state[k.S_WANT_YAW], self.state[k.S_THRUST] = heading_rad, thrust",
        "self.state[k.S_WANT_YAW], self.state[k.S_THRUST] = 0.5 * heading_rad, thrust",
        "tests/sitl/autopilot/boat/test_agreement.py::test_heading_setpoints_go_through_the_wind",
    ),
    Mutation(
        "companion/geo/shift.py",
        "return self.after.en_from_geo(self.before.geo_from_en(*en_m))",
        "return en_m",
        "tests/voyages/passages/test_passage.py::test_it_arrives_over_the_date_line_with_three_restarts",
    ),
    Mutation(
        "companion/planner/reference/astar.py",
        "    way = plane.back(outcome.waypoints_en)",
        "    way = outcome.waypoints_en",
        "tests/planner/reference/test_flat.py::test_its_path_stands_in_the_true_frame_and_takes_about_as_long",
    ),
    Mutation(
        "companion/skipper/rules.py",
        "    watch(ctx)\n",
        "",
        "tests/skipper/test_walk.py::test_the_walk_covers_all_phases_and_all_watchdogs",
    ),
    Mutation(
        "companion/telemetry/folder/records.py",
        "            self.movements += way != self._way\n",
        "",
        "tests/telemetry/test_servos.py::test_a_voyage_tells_rudder_and_sheet_in_its_summary_and_in_words",
    ),
    Mutation(
        "sitl/run/embedded.py",
        "world.set_sail_s = now_s()",
        "pass",
        "tests/voyages/test_voyage.py::test_the_boat_reaches_a_mark_dead_upwind_behind_a_rock",
    ),
    Mutation(
        "companion/planner/reference/kernels.py",
        "seconds + weight[TURN] * turn",
        "seconds",
        "tests/planner/test_figures.py::test_figures_5_1_and_5_2_the_cost_of_turning_makes_a_staircase_smooth_in_any_wind",
    ),
    Mutation(
        "lab/tasks/wrsc2013.py",
        "left_after <= LEAVE_WITHIN_S",
        "left_after <= 1.01 * LEAVE_WITHIN_S",
        "tests/field/test_tasks.py::test_each_fault_is_seen_alone",
    ),
    Mutation(
        "lab/tasks/wrsc2013.py",
        "kept_clear=least >= APPROACH_M",
        "kept_clear=least >= 0.95 * APPROACH_M",
        "tests/field/test_tasks.py::test_each_fault_is_seen_alone",
    ),
    Mutation(
        "sitl/world/boats.py",
        "    drift = p[0] * tws_mps\n",
        "    drift = p[0] * tws_mps + 0.1 * math.sin(to)\n",
        "tests/field/test_vaimos.py::test_any_wind_and_any_command_stays_finite_and_symmetric",
    ),
    Mutation(
        "companion/field/guidance.py",
        "    wanted, _, q = projection.steer(situation.en_m, state.q)\n",
        "    wanted, _, q = projection.steer(situation.en_m, state.q)\n    wanted = -wanted\n",
        "tests/skipper/behaviors/test_field_guidance.py::test_a_voyage_by_field_alone",
    ),
    Mutation(
        "sitl/scenario/traffic.py",
        "            go_to(self.goal_en, seen.twd_from_rad or 0.0),\n",
        "            go_to((self.goal_en[0], self.goal_en[1] + 500.0), seen.twd_from_rad or 0.0),\n",
        "tests/voyages/test_by_field.py::test_two_boats_that_do_not_look_meet",
    ),
    Mutation(
        "companion/mission_check/fields.py",
        "twa < habits.no_go_half_rad - 1e-9, 0.0,",
        "twa < 0.5 * habits.no_go_half_rad, 0.0,",
        "tests/commands/test_field.py::test_the_fan_is_as_long_as_the_polar_and_shut_to_windward",
    ),
    Mutation(
        "companion/field/vector_fields.py",
        "REPULSIVE = 20.0",
        "REPULSIVE = 40.0",
        "tests/field/test_algebra.py::test_fields_are_finite_everywhere_their_centre_included",
    ),
    Mutation(
        "companion/skipper/planning/answers.py",
        'refused = "" if _keep_old(ctx, pending, plan) else',
        "refused =",
        "tests/skipper/test_voyage.py::test_an_old_plan_that_is_as_good_as_a_new_one_stays",
    ),
    Mutation(
        "companion/field/vector_fields.py",
        "pull = self.vr * np.arctan(self.rho * (CIRCLE_RADIUS_M - d))",
        "pull = -self.vr * np.arctan(self.rho * (CIRCLE_RADIUS_M - d))",
        "tests/field/test_algebra.py::test_figure_4_1",
    ),
    Mutation(
        "companion/field/vector_fields.py",
        "angle = -(2.0 * self.gamma_rad / math.pi)",
        "angle = (2.0 * self.gamma_rad / math.pi)",
        "tests/field/test_algebra.py::test_line_goes_along_and_inclines_by_45_degrees_at_most",
    ),
    Mutation(
        "companion/orders/far/order.py",
        "    left_s = unix_of(order.expires_min) - unix_s\n",
        "    left_s = 60.0\n",
        "tests/voyages/test_far.py::test_a_voyage_by_satellite_each_order_once_the_late_one_never_and_over_a_kill",
    ),
    Mutation(
        "companion/boat/l1.py",
        "return 4.0 * damping * damping * speed",
        "return 2.0 * damping * damping * speed",
        "tests/boat/test_l1.py::test_it_is_the_published_law",
    ),
    Mutation(
        "lab/greedy.py",
        "return across if other > mine * (1.0 + beating_m / max(distance_m, 1.0)) else steered",
        "return across if other > mine else steered",
        "tests/lab/test_greedy.py::test_she_goes_about_when_the_other_side_is_better_by_more_the_nearer_she_is",
    ),
    Mutation(
        "lab/greedy.py",
        "made_good = speeds * np.cos(headings - bearing_rad)",
        "made_good = speeds",
        "tests/lab/test_greedy.py::test_no_heading_makes_more_way_to_the_goal",
    ),
    Mutation(
        "companion/field/guidance.py",
        "field=line_between(a_en, b_en, half_m)",
        "field=line_between(a_en, b_en, 3.0 * half_m)",
        "tests/field/test_guidance.py::test_beside_a_line_she_settles_where_the_field_makes_up_for_her_leeway",
    ),
)


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


def test_every_row_has_a_mutation():
    held = {name for name, files, tests in ROWS if any(m.file in files and m.test in tests for m in MUTATIONS)}
    assert {name for name, _, _ in ROWS} - held == set()


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
