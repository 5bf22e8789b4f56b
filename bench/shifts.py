"""What tacking on the wind's shifts gains: ``python -m bench.shifts``, the table of docs/lab/regret.md.

    python -m bench.shifts                                   500 m, 24 seeds of each wind: two minutes
    python -m bench.shifts --length 2000                     a longer beat
    python -m bench.shifts --corridor 50                     a narrower corridor
    python -m bench.shifts --winds 9,28 18.6,28 --seeds 4    spread [deg] and correlation time [s] of each wind

The vehicle of the simulated autopilot beats dead to windward by itself, in a corridor of 30 m, in a wider one, and in
that one asked for tacks as the companion asks for them: the forecast of the forecaster on board, the table and the
rules of the skipper. It has nothing else of the companion: no plan, no replanning, no link; whole voyages are sailed
by ``sitl baselines`` and ``sitl regret``. Every voyage of a seed has the same wind. Printed: time against the corridor
of 30 m, mean over pairs with its standard error; the tacks and the worst pair are those by shifts.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections import deque

import numpy as np

from companion.boat.polar import ardurover_sitl
from companion.geo.angles import difference_rad, mean_direction_rad
from companion.skipper.behaviors.sailing import LAST_S, LEAST_MPS, TURNING
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.wind_shifts import shifts_of
from companion.wind import Forecaster
from lab.commands.baselines import STEADY, wind_of
from sitl.autopilot.boat.kernel import LOOP_S, S_TACKING, S_TACKS, S_TWD_COS, S_TWD_SIN, S_TWS, S_V, S_YAW
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import Vehicle
from sitl.world import AR1, Constant

HALF_RAD = math.radians(45.0)
RADIUS_M = 10.0
LISTENS_S, READY_S = 8, 35  # moored: the vane is heard from, she sets sail
NOW_S = 5  # what the wind is now: the mean of so long
BASE_M = 30.0


def sail(seed, wind, length_m, corridor_m, *, by_shifts, tack_s):
    """Return (time [s], tacks) of one beat."""
    spread_deg, tau_s = wind
    weather = (
        Constant(0.0, 5.0)
        if spread_deg == 0.0
        else AR1(0.0, 5.0, seed=seed, sd_rad=math.radians(spread_deg), rho_hz=1.0 / tau_s, tws_sd_mps=0.3)
    )
    vehicle = Vehicle(
        weather, Parameters({"SAIL_XTRACK_MAX": corridor_m}), heading_rad=math.radians(60.0), is_moored=True, seed=seed
    )
    forecaster, state, heard = Forecaster(), vehicle.state, deque(maxlen=NOW_S)
    asked_s, apart_s = -math.inf, SkipperConfig().shift_tacks_apart_s
    for t in range(1, READY_S + 3 * round(length_m)):
        loops = round(1.0 / LOOP_S)
        while loops > 0:
            loops -= vehicle.advance(loops)[0]
        if t >= LISTENS_S:
            heard.append(math.atan2(state[S_TWD_SIN], state[S_TWD_COS]))
            forecaster.update(float(t), heard[-1], max(0.1, state[S_TWS]))
        if t == READY_S:
            vehicle.set_armed(armed=True)
            vehicle.sail_leg((0.0, 0.0), (0.0, length_m), None, is_corner=False, goes_on=False)
        x, y = vehicle.true_position
        to_go_m = math.hypot(x, length_m - y)
        if to_go_m <= RADIUS_M:
            return t - READY_S - (RADIUS_M - to_go_m) / max(0.1, state[S_V]), int(state[S_TACKS])
        if by_shifts and t > READY_S and t - asked_s >= apart_s and state[S_V] >= LEAST_MPS and not state[S_TACKING]:
            now_rad = mean_direction_rad(np.array(heard))
            if pays(forecaster.table(float(t)), now_rad, state, (x, length_m - y), corridor_m, tack_s):
                vehicle.ask_tack()
                asked_s = t
    raise RuntimeError(f"seed {seed} did not arrive")


def pays(forecast, now_rad, state, to_goal, corridor_m, tack_s):
    """Does a tack now pay, by the skipper's rules?"""
    x, ahead_m = to_goal
    off_rad = difference_rad(now_rad, state[S_YAW])
    if abs(difference_rad(now_rad, math.atan2(-x, ahead_m))) >= HALF_RAD or (
        abs(abs(off_rad) - HALF_RAD) > TURNING * HALF_RAD
    ):
        return False
    beat = shifts_of(
        forecast,
        corridor_m=corridor_m,
        speed_mps=ardurover_sitl().speed_mps(HALF_RAD, state[S_TWS]),
        half_rad=HALF_RAD,
        tack_s=tack_s,
        leg_rad=0.0,
        ahead_m=ahead_m,
    )
    if beat is None or math.hypot(x, ahead_m) / beat.table.made_good_mps < LAST_S:
        return False
    return beat.table.gain_s(x, difference_rad(now_rad, beat.mean_rad), is_port=off_rad < 0.0) > 0.0


def row(wind, args):
    """Sail every seed of a wind and return its line."""
    seeds = range(1 if wind[0] == 0.0 else args.seeds)

    def sailed(corridor_m, *, by_shifts):
        return np.array(
            [sail(seed, wind, args.length, corridor_m, by_shifts=by_shifts, tack_s=args.tack) for seed in seeds]
        )

    told = "steady" if wind[0] == 0.0 else f"{wind[0]:g}°, {wind[1]:g} s"
    base = sailed(BASE_M, by_shifts=False)[:, 0]
    cells = [told, f"{np.median(base):.0f}"]
    for by_shifts in (False, True):
        wide = sailed(args.corridor, by_shifts=by_shifts)
        over = 100.0 * (wide[:, 0] / base - 1.0)
        error = f" ± {over.std(ddof=1) / math.sqrt(len(over)):.1f}" if len(over) > 1 else ""
        cells.append(f"{over.mean():+.1f}{error} %")
    return [*cells, f"{np.median(wide[:, 1]):.0f}", f"{over.max():+.0f} %"]


def main(argv=None):
    parser = argparse.ArgumentParser(
        prog="python -m bench.shifts", description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--seeds", type=int, default=24)
    parser.add_argument("--length", type=float, default=500.0, metavar="M")
    parser.add_argument("--corridor", type=float, default=200.0, metavar="M", help="the wider one's")
    parser.add_argument(
        "--winds",
        nargs="+",
        type=wind_of,
        metavar="DEG,S",
        default=[STEADY, (9.0, 28.0), (18.6, 28.0), (9.0, 120.0), (9.0, 600.0)],
    )
    parser.add_argument("--tack", type=float, default=1.0, metavar="S", help="what a tack is believed to cost")
    args = parser.parse_args(argv)
    wide = f"{args.corridor:g} m"
    print(
        f"| wind | {BASE_M:g} m, s | {wide}, edges alone | {wide}, by shifts | tacks | worst pair |\n"
        "|---|--:|--:|--:|--:|--:|",
        flush=True,
    )
    for wind in args.winds:
        print(f"| {' | '.join(row(wind, args))} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
