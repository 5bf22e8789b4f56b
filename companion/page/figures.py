"""A plan in figures, as a page is told of one that is only looked at."""

from __future__ import annotations

import math
from typing import Any

from companion.planner import Plan


def plan_figures(plan: Plan) -> dict[str, Any]:
    """Return time [s], length and clearance [m], risks and manoeuvres of a plan that has a path.

    ``late_s``: there by then in nine winds of ten; None: it does not say, or not in any time.
    """
    clear = [leg.clearance_m for leg in plan.legs if leg.clearance_m is not None]
    late_s = None if plan.arrival is None or not math.isfinite(plan.arrival.late_s) else round(plan.arrival.late_s)
    return {
        "time_s": round(plan.cost_s, 1), "late_s": late_s, "length_m": round(sum(leg.length_m for leg in plan.legs), 1),
        "risk": None if plan.risk is None or not math.isfinite(plan.risk) else round(plan.risk, 4),
        "risks": [None if leg.risk is None else round(leg.risk, 4) for leg in plan.legs],
        "tacks": sum(leg.manoeuvre == "tack" for leg in plan.legs),
        "gybes": sum(leg.manoeuvre == "gybe" for leg in plan.legs),
        "clearance_m": round(min(clear), 1) if clear else None,
    }
