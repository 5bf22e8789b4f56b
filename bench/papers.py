"""The problems of the papers' figures: drawn by ``bench.figures``, asserted by ``tests/planner/test_figures.py``.

The papers' pictures give no coordinates: the polygons are drawn after them.
"""

from __future__ import annotations

import numpy as np

from companion.boat import Boat, avalon
from companion.geo import MPS_PER_KNOT
from companion.planner import Problem

FOUR = [
    "POLYGON((-110 95,-35 80,-20 130,-75 165,-110 95))",
    "POLYGON((25 60,95 75,80 130,30 120,25 60))",
    "POLYGON((-60 210,0 190,25 240,-25 275,-60 210))",
    "POLYGON((60 190,130 175,140 250,85 260,60 190))",
]
CHANNELS = [  # an island between two shores: a channel on its left, one on its right
    "POLYGON((-40 80,30 60,60 160,45 300,-20 320,-60 220,-40 80))",
    "POLYGON((-400 -50,-210 -50,-150 120,-165 260,-130 380,-170 480,-400 480,-400 -50))",
    "POLYGON((120 -50,400 -50,400 480,170 480,125 340,140 180,120 -50))",
]
WOLSIEFFER = {
    "no_go_half_deg": 45.0,
    "max_twa_deg": 180.0,
    "turn_rate_rad_s": 0.5,
    "speed": {"model": "constant", "v_mps": 1.5},
}


def problem(**parts):
    return Problem.from_json({"id": "", "title": "", "obstacles": [], "fence": None, "delta_s": 0.5, **parts})


def end(x, y, **more):
    return {"x": x, "y": y, **more}


def kalman(from_deg, sigma0, growth):
    return {
        "from_deg": from_deg,
        "speed_mps": 5.0,
        "sigma": {"model": "kalman", "sigma0_deg": sigma0, "growth_deg_per_sqrt_s": growth},
    }


# ------------------------------------------------------------------------------------- Wolsieffer
DELTA_6A, DELTA_6B = 0.60, 0.66


# [deg per root second] of the filter's spread. His text gives none. With the first the zone is 110 degrees wide at the
# end of (a), as his caption says, but then a path is found at 66 % too; with the second none is, and it is 133 wide.
AS_WIDE, AS_SHUT = 2.1, 3.82


def four_polygons(delta_s, *, is_up, growth=AS_SHUT):
    """Figure 6.

    With the half angle at 45 + c sqrt(t) degrees the boat gets 0.157 v / c^2 to windward (c in radians) before the
    zone is 180 degrees wide: with ``AS_SHUT`` at 66 % that is 311 m here, at 60 % 824 m.
    """
    low, high = end(0, 0, heading_deg=0), end(20, 330, heading_deg=180)
    start, goal = (low, high) if is_up else (high, low)
    return problem(
        start=start,
        goal=end(goal["x"], goal["y"], radius=4),
        obstacles=FOUR,
        boat=WOLSIEFFER,
        wind=kalman(0.0, 0.0, growth),
        delta_s=delta_s,
    )


def lee_rock(sigma0_deg):
    """Figure 2: a goal that the wind of the moment just lets be laid, close along a rock to leeward."""
    return problem(
        start=end(0, 0, heading_deg=45),
        goal=end(200, 203, radius=5),
        boat=WOLSIEFFER,
        delta_s=0.9,
        obstacles=["POLYGON((70 60,140 130,165 100,100 35,70 60))"],
        wind=kalman(0.0, sigma0_deg, 0.0),
    )


SHIFT_2_DEG, SIGMA_2_DEG = 10.0, 8.0


def fallen_off(p, waypoints_en, shift_rad):
    """Return where a path leads when the wind has shifted and the boat falls off to the edge of its no-go zone."""
    points = np.asarray(waypoints_en)
    track = [points[0]]
    for step in np.diff(points, axis=0):
        twd, course = p.wind.twd_from_rad + shift_rad, np.arctan2(step[0], step[1])
        twa = (course - twd + np.pi) % (2.0 * np.pi) - np.pi
        heading = twd + np.copysign(max(abs(twa), p.boat.no_go_half_rad), twa)
        track.append(track[-1] + np.hypot(*step) * np.array([np.sin(heading), np.cos(heading)]))
    return np.array(track)


WIND_7_DEG = -30.0
STEADY_DEG, NOISY_DEG = 0.5, 14.0


def two_channels(sigma0_deg, *, is_up):
    """Figure 7."""
    up = {"start": end(0, -20, heading_deg=0), "goal": end(10, 420, radius=4)}
    down = {"start": end(10, 420, heading_deg=180), "goal": end(0, -20, radius=4)}
    return problem(
        **(up if is_up else down),
        obstacles=CHANNELS,
        boat=WOLSIEFFER,
        wind=kalman(WIND_7_DEG, sigma0_deg, 0.05),
        delta_s=0.75,
    )


# ----------------------------------------------------------------------------------------- Büsser
def lake(wind_from, knots=10.0):
    """Figures 5.1 to 5.4: a square and a round obstacle."""
    boat = Boat(polar=avalon(), max_twa_rad=np.radians(160.0)).problem_boat(knots * MPS_PER_KNOT)
    angles = np.linspace(0.0, 2.0 * np.pi, 33)
    island = ", ".join(f"{120 + 90 * np.cos(a):.2f} {560 + 90 * np.sin(a):.2f}" for a in angles[:-1])
    first = f"{120 + 90:.2f} 560.00"
    return problem(
        start=end(0, 0, heading_deg=0),
        goal=end(40, 900, radius=10),
        boat=boat,
        obstacles=["POLYGON((-120 250,-20 250,-20 350,-120 350,-120 250))", f"POLYGON(({island}, {first}))"],
        wind={"from_deg": wind_from, "speed_mps": knots * MPS_PER_KNOT, "sigma": {"model": "none"}},
        fence="POLYGON((-450 -100,550 -100,550 1000,-450 1000,-450 -100))",
    )
