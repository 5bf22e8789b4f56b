"""Sailors held against one of them, seed by seed: each pair met the same wind."""

from __future__ import annotations

import statistics
from collections.abc import Sequence
from typing import Any

from sitl.campaigns.ablation import interval

HEADS = ("scenario", "sailor", "pairs", "median s", "against s", "median %", "mean % (95 %)", "worst pair %", "tacks",
         "of the possible %")


def pairs(records: Sequence[dict[str, Any]], against: str) -> str:
    """Return a Markdown table: a row for each scenario and sailor but ``against``, as it is told in records.

    Pairs of clean arrivals count; how many seeds both sailed is said where it is more. "median %" is of the medians,
    the mean geometric over pairs with the bootstrap's interval. "of the possible" is the sum of what was gained over
    that of what a clairvoyant gains in the same winds, where he is known.
    """
    lines = ["| " + " | ".join(HEADS) + " |", "|---|---|" + "--:|" * (len(HEADS) - 2)]
    base = {(r["scenario"], r["seed"]): r for r in records if r["who"] == against}
    for scenario in dict.fromkeys(scenario for scenario, _ in base):
        for who in dict.fromkeys(r["who"] for r in records if r["scenario"] == scenario and r["who"] != against):
            both = [(r, base[key]) for r in records
                    if (key := (scenario, r["seed"])) in base and (r["scenario"], r["who"]) == (scenario, who)]
            lines.append("| " + " | ".join((scenario, who, *_cells(both))) + " |")
    return "\n".join(lines)


def _cells(both: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> list[str]:
    clean = [(a, b) for a, b in both if all(r["arrived"] and not r["contacts"] for r in (a, b))]
    count = str(len(clean)) if len(clean) == len(both) else f"{len(clean)} of {len(both)}"
    if not clean:
        return [count, *("-" for _ in HEADS[3:])]
    shares = [a["time_s"] / b["time_s"] for a, b in clean]
    mine, other = (statistics.median(r["time_s"] for r in rows) for rows in zip(*clean, strict=True))
    middle, low, high = (100.0 * (share - 1.0) for share in interval(shares))
    known = [(a["time_s"], b["time_s"], b["best_s"]) for a, b in clean if "best_s" in b]
    possible_s = sum(other_s - best_s for _, other_s, best_s in known)
    gained_s = sum(other_s - mine_s for mine_s, other_s, _ in known)
    return [count, f"{mine:.0f}", f"{other:.0f}", f"{100.0 * (mine / other - 1.0):+.1f}",
            f"{middle:+.1f} ({low:+.1f} to {high:+.1f})", f"{100.0 * (max(shares) - 1.0):+.1f}",
            f"{statistics.median(a['tacks'] for a, _ in clean):g}",
            f"{100.0 * gained_s / possible_s:.0f}" if possible_s > 0.0 else "-"]
