"""The best time that a clairvoyant makes: from coarse to fine, each search bounded by what the one before it found."""

from __future__ import annotations

import math

import numpy as np

from companion.errors import JobError
from sitl.clairvoyant.chart import Chart, chart_of
from sitl.clairvoyant.front import march
from sitl.clairvoyant.race import Best, Floats, Race
from sitl.clairvoyant.rungs import bound_s, directions, made_good_m, most_m
from sitl.clairvoyant.steps import PARTS, PORT, Steps, steps_of

# Step [s] and cell [m] of the searches, each finer than the one before.
GRIDS = ((3.0, 4.0), (1.5, 4.0), (1.5, 2.0))
CHART_M = 2.0
# The first search asks for so much more than the bound, and for more by the second factor until it finds a track.
FIRST, MORE = 1.03, 1.15


def best(race: Race, until_s: float, grids: tuple[tuple[float, float], ...] = GRIDS) -> Best:
    """Return the best of a race that can be sailed in ``until_s`` [s].

    Raises:
        JobError: no track was found: the way is shut, or takes longer.
    """
    units = directions()
    chart = chart_of(race, CHART_M, until_s)
    by_step = {wanted_s: steps_of(race, wanted_s, until_s) for wanted_s, _ in grids}
    gains = {wanted_s: made_good_m(steps, units) for wanted_s, steps in by_step.items()}
    finest_s = grids[-1][0]
    least_s = bound_s(race, by_step[finest_s], gains[finest_s], units)
    found: list[tuple[float, Floats]] = []
    ask_s = min(until_s, FIRST * least_s)
    for wanted_s, cell_m in grids:
        steps = by_step[wanted_s]
        while True:
            sailed = _search(race, chart, steps, gains[wanted_s], units, cell_m, ask_s)
            if sailed is not None or found or ask_s >= until_s:
                break
            ask_s = min(until_s, MORE * ask_s)
        if sailed is not None:
            ask_s = sailed[0]
        if sailed is not None or found:
            found.append(sailed or found[-1])
    if not found:
        raise JobError(f"no track was found that is at the goal within {until_s:.0f} s")
    return Best(time_s=found[-1][0], bound_s=least_s, coarser_s=found[max(0, len(found) - 2)][0], track=found[-1][1])


def _search(
    race: Race, chart: Chart, steps: Steps, gain: Floats, units: Floats, cell_m: float, until_s: float,
) -> tuple[float, Floats] | None:
    """Return time and track, None where nothing is faster than ``until_s``."""
    last = min(steps.count - steps.board, math.ceil(until_s / steps.step_s))
    most = most_m(gain, last, steps.step_s / PARTS, steps.tack_s, steps.board)
    goals = np.array([[*goal.en_m, goal.radius_m] for goal in race.goals])
    time_s, places, about, node = march(
        np.array(race.start_en_m), goals, steps.twd_rad, steps.speed_mps, steps.angle_rad, steps.step_s, steps.tack_s,
        steps.board, np.array(chart.corner_m), chart.cell_m, max(1, round(chart.cell_m / cell_m)), chart.off_m,
        race.clear_m, chart.to_go_s, units, most, until_s)
    if node < 0:
        return None
    rows: list[tuple[float, float, float, float]] = []
    while node >= 0:
        parent, step, state = (int(x) for x in about[node, :3])
        t_s = time_s if not rows else step * steps.step_s
        rows.append((t_s, *places[node].tolist(), 1.0 if state % 2 == PORT else -1.0))
        node = parent
    return time_s, np.array(rows[::-1])
