"""Problems for the planner's tests: the repository's own set, and random ones."""

from __future__ import annotations

import math
from pathlib import Path

from hypothesis import strategies as st

from companion.planner import Problem

FOLDER = Path(__file__).parents[2] / "sailbench" / "problems"
CONSTANT = {"model": "constant", "v_mps": 1.5}
POLAR = {"model": "polar", "twa_deg": [0, 40, 60, 90, 120, 150, 180], "v_mps": [0.1, 1.0, 1.6, 2.0, 2.1, 1.7, 1.2]}


def load(name: str) -> Problem:
    return Problem.from_json(FOLDER / f"{name}.json")


def box(x0, y0, x1, y1):
    return f"POLYGON (({x0} {y0}, {x1} {y0}, {x1} {y1}, {x0} {y1}, {x0} {y0}))"


def simple(**changes):
    """Return the JSON of a plain problem: 100 m up wind, with ``changes`` at the top level."""
    base = {
        "id": "simple",
        "title": "",
        "start": {"x": 0, "y": 0, "heading_deg": 0},
        "goal": {"x": 0, "y": 100, "radius": 2},
        "obstacles": [],
        "fence": None,
        "wind": {"from_deg": 0, "speed_mps": 5, "sigma": {"model": "none"}},
        "boat": {"no_go_half_deg": 45, "max_twa_deg": 180, "turn_rate_rad_s": 0.5, "speed": CONSTANT},
        "delta_s": 0.6,
    }
    return base | changes


sigmas = st.one_of(
    st.just({"model": "none"}),
    st.builds(
        lambda s, g: {"model": "kalman", "sigma0_deg": s, "growth_deg_per_sqrt_s": g},
        st.floats(0, 6),
        st.floats(0, 0.6),
    ),
    st.builds(
        lambda s, i, r: {"model": "ar1", "sigma0_deg": s, "sigma_inf_deg": i, "rho_hz": r},
        st.floats(0, 8),
        st.floats(0, 8),
        st.floats(0.001, 0.1),
    ),
)


@st.composite
def random_problems(draw):
    """Return the JSON of a problem with up to six obstacles, any wind, any of three sigma models."""
    obstacles = []
    for _ in range(draw(st.integers(0, 6))):
        x, y = draw(st.floats(-120, 120)), draw(st.floats(40, 260))
        r, n = draw(st.floats(8, 40)), draw(st.integers(3, 8))
        phase = draw(st.floats(0, 6))
        ring = [
            (x + r * math.cos(phase + 2 * math.pi * k / n), y + r * math.sin(phase + 2 * math.pi * k / n))
            for k in range(n)
        ]
        obstacles.append("POLYGON ((" + ", ".join(f"{a} {b}" for a, b in [*ring, ring[0]]) + "))")
    return simple(
        start={"x": 0, "y": 0, "heading_deg": draw(st.floats(-180, 180))},
        goal={"x": draw(st.floats(-60, 60)), "y": 310, "radius": draw(st.floats(1, 20))},
        obstacles=obstacles,
        fence=draw(st.sampled_from([None, box(-200, -60, 200, 400)])),
        wind={"from_deg": draw(st.floats(0, 360)), "speed_mps": 5, "sigma": draw(sigmas)},
        boat={
            "no_go_half_deg": draw(st.floats(20, 60)),
            "max_twa_deg": draw(st.sampled_from([180, 160, 150])),
            "turn_rate_rad_s": draw(st.floats(0.1, 2)),
            "speed": draw(st.sampled_from([CONSTANT, POLAR])),
        },
        delta_s=draw(st.floats(0.5, 0.9)),
    )
