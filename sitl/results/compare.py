"""Two tables, paired by seed: what changed in each figure, how sure that is, and which seeds it was worst for.

A pair has the same weather, so what differs is the program. Intervals are the bootstrap's, over pairs. Whether a change
for the worse is more than luck: for shares the exact test of McNemar (of the pairs that changed, how many for the
worse), for the others the signs of the pairs' changes flipped at random (Fisher's test for pairs). Judged are the
figures of all pairs together, at a level that is divided by their number (Bonferroni): a program like before is called
worse one time in twenty at most. The groups show where a change comes from.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from companion.errors import InputError
from sitl.results.measures import MEASURES, Measure, Row
from sitl.runner import Table

LEVEL = 0.05
DRAWS = 20_000
ALL = "all"
# The hash of the files is not of the pair: a mission that was changed is what one may want to compare.
UNPAIRED = frozenset({"hash", "from", "speedup"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """A figure of a group of pairs, before and after. ``low`` to ``high`` is the 95 % interval of ``change``."""

    group: str
    measure: Measure
    pairs: int
    before: float
    after: float
    change: float
    low: float
    high: float
    p_worse: float
    is_worse: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """A job in both tables, and how much worse it went: pass and contact before time."""

    name: str
    before: Row
    after: Row
    worse: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """What came of a comparison: changes by group, ALL first where there are several, and pairs, the worst first."""

    changes: tuple[Change, ...]
    pairs: tuple[Pair, ...]
    same: int
    only: tuple[int, int]
    other_water: tuple[str, ...]

    @property
    def worse(self) -> tuple[Change, ...]:
        """Return the changes for the worse that are more than luck and worth a word."""
        return tuple(change for change in self.changes if change.is_worse)

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "changes": [{
                "group": c.group, "measure": c.measure.name, "kind": c.measure.kind, "pairs": c.pairs,
                "before": c.before, "after": c.after, "change": c.change, "low": c.low, "high": c.high,
                "p_worse": c.p_worse, "worse": c.is_worse} for c in self.changes],
            "pairs": len(self.pairs), "same": self.same, "only_before": self.only[0], "only_after": self.only[1],
            "other_water": list(self.other_water), "worst": [p.name for p in self.pairs[:20]]}


def compare(before: Table, after: Table) -> Comparison:
    """Hold ``after`` against ``before``.

    Raises:
        InputError: they are of different campaigns, or have no job in common.
    """
    if before.campaign != after.campaign:
        raise InputError("results", "", f"sitl {before.campaign} and sitl {after.campaign} have no pairs",
                         "compare two files of one campaign")
    first, second = _by_job(before), _by_job(after)
    both = [job for job in first if job in second]
    if not both:
        raise InputError("results", "", "no job is in both files", "compare files with the same scenarios and seeds")
    names = [name for name in before.keys if name not in UNPAIRED and name != "seed"]
    groups: dict[str, list[tuple[Row, Row]]] = {}
    for job in both:
        pair = first[job], second[job]
        groups.setdefault(", ".join(str(pair[0].get(name)) for name in names), []).append(pair)
    if len(groups) > 1:
        groups = {ALL: [pair for pairs in groups.values() for pair in pairs], **groups}
    changes = [change for group, pairs in groups.items() for measure in MEASURES
               if (change := _change(group, measure, pairs)) is not None]
    judged = next(iter(groups))
    asked = max(1, sum(change.group == judged and change.measure.worse != 0 for change in changes))
    pairs = sorted((_pair(job, first[job], second[job]) for job in both), key=lambda p: p.worse, reverse=True)
    return Comparison(
        changes=tuple(_judged(c, LEVEL / asked) if c.group == judged else c for c in changes), pairs=tuple(pairs),
        same=sum(_is_same(pair.before, pair.after) for pair in pairs),
        only=(len(first) - len(both), len(second) - len(both)),
        other_water=tuple(dict.fromkeys(str(first[job].get("scenario")) for job in both
                                        if first[job].get("hash") != second[job].get("hash"))))


def _by_job(table: Table) -> dict[tuple[Any, ...], Row]:
    names = [name for name in table.keys if name not in UNPAIRED]
    return {tuple(row.get(name) for name in names): row for row in table.rows}


def _is_same(before: Row, after: Row) -> bool:
    """Return whether all that both tell is the same; a program of another day may count other things, too."""
    return all(before[name] == after[name] for name in before.keys() & after.keys() - {"hash"})


def _pair(job: tuple[Any, ...], before: Row, after: Row) -> Pair:
    worse = []
    for measure in MEASURES:
        if measure.worse:
            was, now = measure.of(before), measure.of(after)
            worse.append(0.0 if was is None or now is None else measure.worse * (
                now / was - 1.0 if measure.kind == "ratio" else now - was))
    *words, seed = job
    return Pair(name=f"{', '.join(map(str, words))} seed {seed}", before=before, after=after, worse=tuple(worse))


def _change(group: str, measure: Measure, pairs: Sequence[tuple[Row, Row]]) -> Change | None:
    """Return a figure's change, None where no pair has it."""
    found = [(was, now) for before, after in pairs
             if (was := measure.of(before)) is not None and (now := measure.of(after)) is not None]
    if not found:
        return None
    values = np.array(found, dtype=np.float64)
    if measure.kind == "ratio":
        values = np.log(values)
    steps = values[:, 1] - values[:, 0]
    rng = np.random.default_rng(0)
    means = steps[rng.integers(0, len(steps), (DRAWS // 10, len(steps)))].mean(axis=1)
    low, high = (float(x) for x in np.quantile(means, (0.025, 0.975)))
    before, after, change = float(values[:, 0].mean()), float(values[:, 1].mean()), float(steps.mean())
    if measure.kind == "ratio":
        before, after, change, low, high = (math.exp(x) for x in (before, after, change, low, high))
    return Change(group=group, measure=measure, pairs=len(found), before=before, after=after, change=change, low=low,
                  high=high, p_worse=_p_worse(measure, steps, rng) if measure.worse else 1.0)


def _p_worse(measure: Measure, steps: NDArray[np.float64], rng: np.random.Generator) -> float:
    """Return how likely as much for the worse is by luck."""
    bad = steps * measure.worse
    if measure.kind == "share":
        worse, better = int((bad > 0).sum()), int((bad < 0).sum())
        of = worse + better
        return sum(math.comb(of, k) for k in range(worse, of + 1)) / 2.0 ** of if of else 1.0
    moved = bad[bad != 0.0]
    if not moved.size:
        return 1.0
    if 2 ** moved.size <= DRAWS:
        signs = 1.0 - 2.0 * ((np.arange(2 ** moved.size)[:, None] >> np.arange(moved.size)) & 1)
        return float(((signs @ moved) >= moved.sum() - 1e-12).mean())
    signs = rng.choice((-1.0, 1.0), (DRAWS, moved.size))
    return float((((signs @ moved) >= moved.sum() - 1e-12).sum() + 1) / (DRAWS + 1))


def _judged(change: Change, level: float) -> Change:
    measure = change.measure
    moved = (change.change - 1.0 if measure.kind == "ratio" else change.change) * measure.worse
    return replace(change, is_worse=bool(measure.worse) and change.p_worse <= level and moved > measure.least)
