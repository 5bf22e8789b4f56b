"""The table of a campaign of mismatch: by kind and by water, what was promised beside what came."""

from __future__ import annotations

import math
import statistics
from collections.abc import Sequence
from typing import Any

Z95 = 1.959964    # of a normal's 95 % interval


def share_interval(hits: int, of: int) -> tuple[float, float]:
    """Return Wilson's 95 % interval of a share (Wilson 1927); 0 to 1 of nothing.

    >>> [round(x, 4) for x in share_interval(0, 100)]
    [0.0, 0.037]
    """
    if of == 0:
        return 0.0, 1.0
    p, z2 = hits / of, Z95 * Z95
    middle = (p + z2 / (2.0 * of)) / (1.0 + z2 / of)
    half = Z95 * math.sqrt(p * (1.0 - p) / of + z2 / (4.0 * of * of)) / (1.0 + z2 / of)
    return max(0.0, middle - half), min(1.0, middle + half)


def figures_of(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    """Return what was counted over all voyages, by kind of mismatch and by water."""
    sailed = [r for r in records if "arrived" in r]
    kinds = sorted({kind for r in records for kind in r["kinds"]})
    waters = sorted({r["scenario"] for r in records})
    ratios = [r["time_s"] / r["promised_s"] for r in sailed if r["arrived"] and r["promised_s"]]
    legs = [leg for r in sailed for leg in r["legs"] if not leg["is_beat"]]
    return {
        **_row(records),
        "failed_seeds": [r["seed"] for r in records if not r["passed"]],
        "below_floor_seeds": [r["seed"] for r in sailed if r["below_floor"]],
        "silence_max_s": max((r["silence_s"] or 0.0 for r in sailed), default=0.0),
        "time_share": [float(q) for q in _quantiles(ratios)], "timed": len(ratios),
        "later_than_promised": sum(ratio > 1.0 for ratio in ratios),
        "legs": len(legs), "legs_in_no_go": sum(leg["came"] for leg in legs),
        "legs_in_no_go_promised": sum(leg["promised"] for leg in legs),
        "kinds": {kind: _row([r for r in records if kind in r["kinds"]]) for kind in kinds},
        "waters": {water: _row([r for r in records if r["scenario"] == water]) for water in waters},
    }


def _quantiles(values: Sequence[float]) -> list[float]:
    """Return what a tenth, half and nine tenths are below; nothing of too few."""
    if len(values) < 2:
        return []
    cuts = statistics.quantiles(values, n=10, method="inclusive")
    return [cuts[0], cuts[4], cuts[8]]


def _row(records: Sequence[dict[str, Any]]) -> dict[str, Any]:
    sailed = [r for r in records if "arrived" in r]
    clear = [r["min_clearance_m"] for r in sailed if r["min_clearance_m"] is not None]
    return {
        "voyages": len(records), "passed": sum(r["passed"] for r in records),
        "arrived": sum(r["arrived"] for r in sailed), "touched": sum(r["contacts"] > 0 for r in sailed),
        "below_floor": sum(r["below_floor"] for r in sailed), "with_solids": len(clear),
        "clearance_min_m": min(clear, default=None),
        "clearance_median_m": statistics.median(clear) if clear else None,
    }


def told(table: dict[str, Any]) -> str:
    """Return what was counted, for a terminal."""
    low, high = share_interval(table["below_floor"], table["with_solids"])
    lines = [
        (f"{table['voyages']} voyages: {table['passed']} passed, {table['arrived']} arrived in time, "
         f"{table['touched']} touched"),
        (f"below the margin's floor: {table['below_floor']} of {table['with_solids']} with something to be clear of "
         f"({_percent(low)} to {_percent(high)}); longest silence {table['silence_max_s']:.1f} s")]
    if table["time_share"]:
        lines.append(
            f"time, share of what the first plan promised: {' / '.join(f'{q:.2f}' for q in table['time_share'])} "
            f"(10, 50, 90 % of {table['timed']}); later than promised {table['later_than_promised']}")
    if table["legs"]:
        lines.append(
            f"legs in the no-go zone half way, of {table['legs']} that the plan sails itself: "
            f"{table['legs_in_no_go']}, promised {table['legs_in_no_go_promised']:.1f}")
    for name in ("kinds", "waters"):
        rows = table[name]
        width = max((len(row) for row in rows), default=0)
        lines.append(f"{name[:-1].ljust(width)}  voyages  arrived  touched  below floor  least m  median m")
        lines += [
            f"{row.ljust(width)}  {r['voyages']:7}  {r['arrived']:7}  {r['touched']:7}  {r['below_floor']:11}  "
            f"{_metres(r['clearance_min_m'])}  {_metres(r['clearance_median_m']):>8}" for row, r in rows.items()]
    return "\n".join(lines)


def _percent(share: float) -> str:
    return f"{100.0 * share:.1f} %"


def _metres(value: float | None) -> str:
    return f"{'-':>7}" if value is None else f"{value:7.1f}"
