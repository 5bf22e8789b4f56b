"""Is the promised risk of vessels true? 6,000 futures of ships and of our own pace against plans among them.

    python -m bench.vessels                 each scene: sailed straight on, as planned, and under a limit of 1 %

The futures are drawn here from what is stated of vessels (``companion.traffic.predict.MotionUncertainty``: each error
one draw for the whole future, the course followed as ``predict`` does) and of our own timing, without any code of the
planner; the winds as in ``bench.winds.simulate_entries``. "Met" is a boat nearer to a
ship's middle than both hulls and the clearance asked for. The share of voyages that are met, or forced into the no-go
zone, must be at most what was promised, and where it binds (1 %) at least a third of it.
"""

from __future__ import annotations

import argparse
import math
from dataclasses import replace

import numpy as np

from bench.winds import simulate_entries
from companion.planner import Problem, plan
from companion.planner.problem import BoatLimits, ProblemWind, RiskLimit, Sigma, evaluate
from companion.planner.risk import path_risk
from companion.traffic import Vessel
from companion.traffic.occupancy import Keep, planning_discs
from companion.traffic.predict import manoeuvre_s2, motion_of, predict
from companion.traffic.vessel import hull_of

HORIZON_S = 450.0
FUTURES = 6000
LEAST_PROMISE = 0.01
SHOWN_RATIO = 0.002  # below it 6,000 futures do not tell a third from nothing


def ship(en, course_deg, speed_mps, half_m=50.0, **more):
    """Return a vessel at t = 0, ``half_m`` from its middle to its bow."""
    course = math.radians(course_deg)
    values = {
        "mmsi": 211000001,
        "t_s": 0.0,
        "heard_s": 0.0,
        "antenna_en_m": en,
        "course_rad": course,
        "speed_mps": speed_mps,
        "heading_rad": course,
        "hull": hull_of(half_m, half_m, 0.2 * half_m, 0.2 * half_m, is_class_b=False),
    }
    return Vessel(**(values | more))


SCENES = {
    "crossing": (ship((450.0, 1125.0), 180.0, 5.0),),
    "crossing slowly": (ship((450.0, 225.0), 180.0, 1.0, 5.0, is_class_b=True),),
    "overtaking": (ship((-900.0, 0.0), 90.0, 6.0),),
    "overtaken": (ship((150.0, 0.0), 90.0, 1.0, 5.0),),
    "two": (ship((450.0, 1125.0), 180.0, 5.0), ship((600.0, -900.0), 0.0, 3.0, mmsi=5)),
    "turning": (ship((450.0, 300.0), 180.0, 2.0, 5.0, turn_rate_radps=math.radians(0.5)),),
}


def keep_of(clearance_m=0.0):
    """Return the distances of the scenes."""
    return Keep(sigmas=0.0, clearance_m=clearance_m, own_radius_m=1.0, own_timing_mps=0.1, horizon_s=HORIZON_S)


def problem(ships, keep, delta_s=0.7, **change):
    """Return 900 m to the east across the wind, among ships."""
    targets = planning_discs(ships, 0.0, keep)
    values = {
        "start_en": (0.0, 0.0),
        "start_heading_rad": math.pi / 2,
        "goal_en": (900.0, 0.0),
        "goal_radius_m": 10.0,
        "wind": ProblemWind(
            twd_from_rad=0.0, tws_mps=5.0, sigma=Sigma(model="ar1", sigma0_rad=0.05, sigma_inf_rad=0.1, rho_hz=0.03)
        ),
        "boat": BoatLimits(
            no_go_half_rad=math.radians(45.0), turn_rate_radps=0.5, polar_twa_rad=(0.0, math.pi), polar_mps=(2.0, 2.0)
        ),
        "delta_s": delta_s,
        "targets": targets,
    }
    return Problem(**(values | change))


def met(ships, legs, keep, n=FUTURES, seed=3):
    """Return in which of ``n`` futures the boat comes nearer than ``keep`` to a ship."""
    rng = np.random.default_rng(seed)
    hit, late = np.zeros(n, dtype=bool), rng.standard_normal(n) * keep.own_timing_mps
    t = np.arange(0.0, min(HORIZON_S, legs[-1].end_s), 1.0)
    when = np.array([0.0, *(s for leg in legs for s in (leg.start_s, leg.end_s))])
    place = np.array([legs[0].from_en, *(p for leg in legs for p in (leg.from_en, leg.to_en))])
    run = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(place, axis=0).T))])
    sailed = np.clip(np.interp(t, when, run)[None, :] + late[:, None] * t[None, :], 0.0, run[-1])
    way, first = np.unique(run, return_index=True)
    east, north = np.interp(sailed, way, place[first, 0]), np.interp(sailed, way, place[first, 1])
    for other in ships:
        m, draw = motion_of(other), rng.standard_normal((6, n))
        near_m = other.reach_m + keep.own_radius_m + keep.clearance_m
        for k, at in enumerate(t):
            there, tau = predict(other, at, m), max(0.0, at - other.t_s)
            held = manoeuvre_s2(tau, m.hold_s)
            along = m.position_m * draw[0] + m.speed_mps * tau * draw[1] + m.accel_mps2 * held * draw[2]
            across = m.position_m * draw[3] + other.speed_mps * (
                m.course_rad * tau * draw[4] + m.turn_radps * held * draw[5]
            )
            s, c = math.sin(there.course_rad), math.cos(there.course_rad)
            x, y = there.mean_en_m[0] + along * s + across * c, there.mean_en_m[1] + along * c - across * s
            hit |= np.hypot(east[:, k] - x, north[:, k] - y) < near_m
    return hit


def holds(promised, share):
    """Say whether a share is at most what was promised, and where that binds not less than a third of it."""
    noise = 3.0 * math.sqrt(max(promised, 1.0 / FUTURES) / FUTURES)
    binds = promised >= LEAST_PROMISE
    return share <= promised + (0.0 if binds else noise) and (not binds or share >= promised / 3.0)


def main():
    """Print the table."""
    argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter).parse_args()
    print(f"{FUTURES} futures each")
    print(
        f"{'scene':16} {'clearance':>9} {'way':>9} {'time s':>7} {'promised':>9} {'met':>7} {'ratio':>6}   "
        f"{'with wind':>9} {'either':>7}"
    )
    for clearance_m in (0.0, 50.0):
        keep = keep_of(clearance_m)
        for name, ships in SCENES.items():
            p = problem(ships, keep)
            limited = replace(p, risk=RiskLimit(max_path_risk=0.01))
            ways = {
                "straight": evaluate(p, [(0.0, 0.0), (900.0, 0.0)]).legs,
                "planned": plan(p, expansions=4000, seed=1).legs,
                "limit 1 %": plan(limited, expansions=40_000, seed=1).legs,
            }
            for way, legs in ways.items():
                if not legs:
                    print(f"{name:16} {clearance_m:7.0f} m {way:>9}  no path")
                    continue
                risk, hit = path_risk(p, legs), met(ships, legs, keep)
                either = float(np.mean(hit | (simulate_entries(p, legs, winds=FUTURES, seed=4) >= 0)))
                share = float(np.mean(hit))
                ratio = share / risk.vessels.total if risk.vessels.total >= SHOWN_RATIO else math.nan
                good = holds(risk.vessels.total, share) and holds(risk.total, either)
                print(
                    f"{name:16} {clearance_m:7.0f} m {way:>9} {legs[-1].end_s:7.0f} "
                    f"{100 * risk.vessels.total:7.2f} % {100 * share:5.2f} % {ratio:6.2f}   "
                    f"{100 * risk.total:7.2f} % {100 * either:5.2f} %"
                    f"{'' if good else '  BROKEN'}"
                )


if __name__ == "__main__":
    main()
