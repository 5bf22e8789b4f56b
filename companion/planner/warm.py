"""What is planned once so that every kernel is compiled or loaded, and the first real plan is as quick as the next."""

from __future__ import annotations

from typing import Any

from companion.planner.problem.value import Problem


def warm_problems() -> tuple[Problem, Problem]:
    """Return two small ones: round an obstacle with uncertain wind and a vessel, by gybes alone, and by tacks."""
    base: dict[str, Any] = {
        "id": "warm",
        "title": "warm",
        "start": {"x": 0, "y": 0, "heading_deg": 10},
        "goal": {"x": 5, "y": 120, "radius": 4},
        "obstacles": ["POLYGON ((-15 40, 15 40, 15 60, -15 60, -15 40))"],
        "fence": "POLYGON ((-80 -40, 80 -40, 80 180, -80 180, -80 -40))",
        "wind": {
            "from_deg": 5,
            "speed_mps": 5,
            "sigma": {"model": "kalman", "sigma0_deg": 2, "growth_deg_per_sqrt_s": 0.2},
        },
        "boat": {
            "can_tack": False,
            "gybe_room_m": 5,
            "no_go_half_deg": 42,
            "max_twa_deg": 165,
            "turn_rate_rad_s": 0.5,
            "speed": {"model": "polar", "twa_deg": [0, 45, 90, 180], "v_mps": [0, 1, 1.6, 1.2]},
        },
        "delta_s": 0.6,
        "targets": [
            {
                "x": 500,
                "y": 500,
                "radius_m": 1,
                "spread": {
                    "vessel": 1,
                    "x": 500,
                    "y": 500,
                    "course_deg": 0,
                    "keep_m": 1,
                    "along_m": 1,
                    "across_m": 1,
                    "sigma_m": 1,
                },
            }
        ],
        "tracking": {"floor_m": 1.0, "solids": ["POLYGON ((-14 41, 14 41, 14 59, -14 59, -14 41))"]},
    }
    tacks = base["boat"] | {"can_tack": True, "tack_loss_s": 2.0}
    return Problem.from_json(base), Problem.from_json(base | {"boat": tacks, "fence": None, "targets": []})
