"""The table of regret: a row for each scenario and sailor, of the voyages that arrived without contact."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import Any

from sitl.campaigns.figures import TOLD

HEADS = ("scenario", "sailor", "runs", "clean", "median s", "tacks", "best s", "its tacks", "over best %", "10 %",
         "90 %", "gap to bound %", "refined %")


def figures_of(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return the figures: times [s], shares of the best time; what has no clean voyage has None.

    "regret" is time over the clairvoyant's, less 1; "gap" how far the best that was found is over the bound, "refined"
    what the search's finest grid gained: both say how well the best itself is known.
    """
    names = list(dict.fromkeys(r["scenario"] for r in records))
    return [_figures(name, who, rows) for name in names for who in TOLD
            if (rows := [r for r in records if r["scenario"] == name and r["who"] == who])]


def _figures(name: str, who: str, rows: Sequence[dict[str, Any]]) -> dict[str, Any]:
    clean = [r for r in rows if "best_s" in r and not r["contacts"]]
    regrets = sorted(r["time_s"] / r["best_s"] - 1.0 for r in clean)

    def median(values: Sequence[float]) -> float | None:
        return statistics.median(values) if values else None

    return {
        "scenario": name, "sailor": who, "runs": len(rows), "clean": len(clean),
        "time_s": median([r["time_s"] for r in clean]), "tacks": median([r["tacks"] for r in clean]),
        "best_s": median([r["best_s"] for r in clean]), "best_tacks": median([r["best_tacks"] for r in clean]),
        "regret": median(regrets), "regret_10": regrets[math.floor(0.1 * (len(regrets) - 1))] if regrets else None,
        "regret_90": regrets[math.ceil(0.9 * (len(regrets) - 1))] if regrets else None,
        "gap": median([r["best_s"] / r["bound_s"] - 1.0 for r in clean]),
        "refined": median([r["coarser_s"] / r["best_s"] - 1.0 for r in clean]),
    }


def told(records: Sequence[dict[str, Any]]) -> str:
    """Return the figures as a Markdown table."""
    lines = ["| " + " | ".join(HEADS) + " |", "|---|---|" + "--:|" * (len(HEADS) - 2)]
    for f in figures_of(records):
        cells = [
            f["scenario"], f["sailor"], str(f["runs"]), str(f["clean"]), _number(f["time_s"]), _number(f["tacks"], "g"),
            _number(f["best_s"]), _number(f["best_tacks"], "g"), *(_percent(f[k], 1) for k in ("regret", "regret_10",
            "regret_90")), _percent(f["gap"], 1), _percent(f["refined"], 2)]
        lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines)


def _number(value: float | None, kind: str = ".0f") -> str:
    return "-" if value is None else format(value, kind)


def _percent(share: float | None, digits: int) -> str:
    return "-" if share is None else f"{100.0 * share:.{digits}f}"
