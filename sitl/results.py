"""Results of campaigns compared: two tables paired by seed, which figures changed, how sure that is, in words.

A pair has the same weather, so what differs is the program. Intervals are the bootstrap's, over pairs. Whether a change
for the worse is more than luck: for shares the exact test of McNemar (of the pairs that changed, how many for the
worse), for the others the signs of the pairs' changes flipped at random (Fisher's test for pairs). Judged are the
figures of all pairs together, at a level that is divided by their number (Bonferroni): a program like before is called
worse one time in twenty at most. The groups show where a change comes from.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from companion.errors import InputError
from companion.words import counted
from sitl.runner import MadeBy, Table

Row = Mapping[str, Any]


@dataclass(frozen=True, slots=True, kw_only=True)
class Measure:
    """A figure of a voyage. ``worse`` is the sign of a change for the worse, 0 where neither way is.

    A ``share`` is of voyages, of 0 and 1; a ``ratio`` is the geometric mean of the pairs' ratios; a ``difference`` the
    mean of theirs. Less than ``least`` is no worsening, however sure.
    """

    name: str
    of: Callable[[Row], float | None]
    kind: Literal["share", "ratio", "difference"]
    worse: int
    least: float = 0.0
    unit: str = ""


def _number(name: str, *others: str) -> Callable[[Row], float | None]:
    def read(row: Row) -> float | None:
        found = next((row[n] for n in (name, *others) if row.get(n) is not None), None)
        return float(found) if isinstance(found, int | float) else None

    return read


def _time_s(row: Row) -> float | None:
    value = row.get("time_s")
    return float(value) if row.get("arrived") and isinstance(value, int | float) and value > 0.0 else None


def _touched(row: Row) -> float | None:
    """Return whether something was touched: contacts are counted, or listed (as JSON)."""
    value = row.get("contacts")
    return None if value is None else float(value not in {0, "[]"})


# Of a boat that did as well as before, one voyage's time is within a per cent, its clearance within a hand's breadth.
MEASURES = (
    Measure(name="passed", of=_number("passed"), kind="share", worse=-1),
    Measure(name="touched", of=_touched, kind="share", worse=1),
    Measure(name="below floor", of=_number("below_floor"), kind="share", worse=1),
    Measure(name="arrived", of=_number("arrived"), kind="share", worse=-1),
    Measure(name="time", of=_time_s, kind="ratio", worse=1, least=0.005),
    Measure(
        name="clearance",
        of=_number("min_clearance_m", "clearance_m"),
        kind="difference",
        worse=-1,
        least=0.25,
        unit="m",
    ),
    Measure(name="silence", of=_number("silence_s"), kind="difference", worse=1, least=0.5, unit="s"),
    Measure(name="tacks", of=_number("tacks"), kind="difference", worse=0),
    Measure(name="replans", of=_number("replans"), kind="difference", worse=0),
)


LEVEL = 0.05
DRAWS = 20_000
ALL = "all"
# The hash of the files is not of the pair: a mission that was changed is what one may want to compare.
UNPAIRED = frozenset({"hash", "from", "speedup"})


@dataclass(frozen=True, slots=True, kw_only=True)
class FigureChange:
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
class SeedPair:
    """A job in both tables, and how much worse it went: pass and contact before time."""

    name: str
    before: Row
    after: Row
    worse: tuple[float, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """What came of a comparison: changes by group, ALL first where there are several, and pairs, the worst first."""

    changes: tuple[FigureChange, ...]
    pairs: tuple[SeedPair, ...]
    same: int
    only: tuple[int, int]
    other_water: tuple[str, ...]

    @property
    def worse(self) -> tuple[FigureChange, ...]:
        """Return the changes for the worse that are more than luck and worth a word."""
        return tuple(change for change in self.changes if change.is_worse)

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {
            "changes": [
                {
                    "group": c.group,
                    "measure": c.measure.name,
                    "kind": c.measure.kind,
                    "pairs": c.pairs,
                    "before": c.before,
                    "after": c.after,
                    "change": c.change,
                    "low": c.low,
                    "high": c.high,
                    "p_worse": c.p_worse,
                    "worse": c.is_worse,
                }
                for c in self.changes
            ],
            "pairs": len(self.pairs),
            "same": self.same,
            "only_before": self.only[0],
            "only_after": self.only[1],
            "other_water": list(self.other_water),
            "worst": [p.name for p in self.pairs[:20]],
        }


def compare(before: Table, after: Table) -> Comparison:
    """Hold ``after`` against ``before``. Of one scenario each, they may be two: what pairs them then is the seed.

    Raises:
        InputError: they are of different campaigns, or have no job in common.
    """
    if before.campaign != after.campaign:
        raise InputError(
            "results",
            "",
            f"sitl {before.campaign} and sitl {after.campaign} have no pairs",
            "compare two files of one campaign",
        )
    first, second = _by_job(before), _by_job(after)
    both = [job for job in first if job in second]
    if not both:  # two settings of one thing: scenario, guidance, planner are one in each file
        first, second = (_by_job(table, *_settings(table)) for table in (before, after))
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
    changes = [
        change
        for group, pairs in groups.items()
        for measure in MEASURES
        if (change := _change(group, measure, pairs)) is not None
    ]
    judged = next(iter(groups))
    asked = max(1, sum(change.group == judged and change.measure.worse != 0 for change in changes))
    pairs = sorted((_pair(job, first[job], second[job]) for job in both), key=lambda p: p.worse, reverse=True)
    return Comparison(
        changes=tuple(_judged(c, LEVEL / asked) if c.group == judged else c for c in changes),
        pairs=tuple(pairs),
        same=sum(_is_same(pair.before, pair.after) for pair in pairs),
        only=(len(first) - len(both), len(second) - len(both)),
        other_water=tuple(
            dict.fromkeys(
                str(first[job].get("scenario")) for job in both if first[job].get("hash") != second[job].get("hash")
            )
        ),
    )


def _settings(table: Table) -> list[str]:
    """Return the keys that have one value in all of a table."""
    return [name for name in table.keys if name != "seed" and len({row.get(name) for row in table.rows}) == 1]


def _by_job(table: Table, *unpaired: str) -> dict[tuple[Any, ...], Row]:
    names = [name for name in table.keys if name not in UNPAIRED and name not in unpaired]
    return {tuple(row.get(name) for name in names): row for row in table.rows}


def _is_same(before: Row, after: Row) -> bool:
    """Return whether all that both tell is the same; a program of another day may count other things, too."""
    return all(before[name] == after[name] for name in before.keys() & after.keys() - {"hash"})


def _pair(job: tuple[Any, ...], before: Row, after: Row) -> SeedPair:
    worse = []
    for measure in MEASURES:
        if measure.worse:
            was, now = measure.of(before), measure.of(after)
            worse.append(
                0.0
                if was is None or now is None
                else measure.worse * (now / was - 1.0 if measure.kind == "ratio" else now - was)
            )
    *words, seed = job
    name = f"{', '.join(map(str, words))} seed {seed}".strip()
    return SeedPair(name=name, before=before, after=after, worse=tuple(worse))


def _change(group: str, measure: Measure, pairs: Sequence[tuple[Row, Row]]) -> FigureChange | None:
    """Return a figure's change, None where no pair has it."""
    found = [
        (was, now)
        for before, after in pairs
        if (was := measure.of(before)) is not None and (now := measure.of(after)) is not None
    ]
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
    return FigureChange(
        group=group,
        measure=measure,
        pairs=len(found),
        before=before,
        after=after,
        change=change,
        low=low,
        high=high,
        p_worse=_p_worse(measure, steps, rng) if measure.worse else 1.0,
    )


def _p_worse(measure: Measure, steps: NDArray[np.float64], rng: np.random.Generator) -> float:
    """Return how likely as much for the worse is by luck."""
    bad = steps * measure.worse
    if measure.kind == "share":
        worse, better = int((bad > 0).sum()), int((bad < 0).sum())
        of = worse + better
        return sum(math.comb(of, k) for k in range(worse, of + 1)) / 2.0**of if of else 1.0
    moved = bad[bad != 0.0]
    if not moved.size:
        return 1.0
    if 2**moved.size <= DRAWS:
        signs = 1.0 - 2.0 * ((np.arange(2**moved.size)[:, None] >> np.arange(moved.size)) & 1)
        return float(((signs @ moved) >= moved.sum() - 1e-12).mean())
    signs = rng.choice((-1.0, 1.0), (DRAWS, moved.size))
    return float((((signs @ moved) >= moved.sum() - 1e-12).sum() + 1) / (DRAWS + 1))


def _judged(change: FigureChange, level: float) -> FigureChange:
    measure = change.measure
    moved = (change.change - 1.0 if measure.kind == "ratio" else change.change) * measure.worse
    return replace(change, is_worse=bool(measure.worse) and change.p_worse <= level and moved > measure.least)


def made_by_text(by: MadeBy) -> str:
    """Return what made results."""
    return f"{by.version}, commit {by.commit or 'unknown'}, source {by.source}, Python {by.python} on {by.machine}"


def table_text(table: Table) -> str:
    """Return what a table holds: who made it, and each group's figures."""
    names = [name for name in table.keys if name not in UNPAIRED and name != "seed"]
    groups: dict[str, list[Row]] = {}
    for row in table.rows:
        groups.setdefault(", ".join(str(row.get(name)) for name in names), []).append(row)
    rows = [("", "voyages", *(m.name + (f" {m.unit}" if m.unit else "") for m in MEASURES))]
    for name, found in groups.items():
        rows.append((name, str(len(found)), *(_figure(measure, found) for measure in MEASURES)))
    head = f"sitl {table.campaign}: {counted(len(table.rows), 'result')} by {made_by_text(table.by)}"
    return "\n".join([head, *columns(rows, left=2)]) + "\n"


def _figure(measure: Measure, rows: Sequence[Row]) -> str:
    values = [value for row in rows if (value := measure.of(row)) is not None]
    if not values:
        return "-"
    if measure.kind == "share":
        return f"{sum(values):.0f}/{len(values)}"
    return f"{statistics.median(values):.1f}"


def comparison_text(comparison: Comparison, *, most: int = 10) -> str:
    """Return a comparison: what was worse first, then the table of changes, then the seeds."""
    lines = [
        f"{counted(len(comparison.pairs), 'pair')}, {comparison.same} of them the same in every figure"
        + "".join(
            f"; {n} only in the {where}" for n, where in zip(comparison.only, ("first", "second"), strict=True) if n
        )
    ]
    lines += [f"the files of {name} are not the same in both" for name in comparison.other_water]
    rows = [("", "figure", "pairs", "first", "second", "change (95 %)", "by luck", "")]
    rows += [
        (
            c.group,
            c.measure.name,
            str(c.pairs),
            *_values(c),
            f"{c.p_worse:.2g}" if c.measure.worse else "-",
            "WORSE" if c.is_worse else "",
        )
        for c in comparison.changes
        if c.change != (c.measure.kind == "ratio")
    ]
    lines += columns(rows, left=2) if len(rows) > 1 else ["no figure that is measured here changed"]
    worst = [pair for pair in comparison.pairs if any(x > 0.0 for x in pair.worse)][:most]
    if worst:
        lines.append("worse, the worst first:")
        lines += [f"  {pair.name}: {_figure_pair(pair.before, pair.after)}" for pair in worst]
    found = [f"{c.measure.name} ({c.group})" for c in comparison.worse]
    lines.append("WORSE: " + ", ".join(found) if found else "not worse, as far as these pairs can tell")
    return "\n".join(lines) + "\n"


def _values(change: FigureChange) -> tuple[str, str, str]:
    """Return before, after and change."""
    c, kind = change, change.measure.kind
    if kind == "ratio":
        return f"{c.before:.1f}", f"{c.after:.1f}", f"x {c.change:.3f} ({c.low:.3f} to {c.high:.3f})"
    if kind == "share":
        return (
            f"{100 * c.before:.1f} %",
            f"{100 * c.after:.1f} %",
            f"{100 * c.change:+.1f} % ({100 * c.low:+.1f} to {100 * c.high:+.1f})",
        )
    return f"{c.before:.2f}", f"{c.after:.2f}", f"{c.change:+.2f} ({c.low:+.2f} to {c.high:+.2f})"


def _figure_pair(before: Row, after: Row) -> str:
    parts = []
    for measure in MEASURES:
        was, now = measure.of(before), measure.of(after)
        if was is not None and now is not None and was != now:
            parts.append(
                f"{measure.name} {'no' if not was else 'yes'} -> {'no' if not now else 'yes'}"
                if measure.kind == "share"
                else f"{measure.name} {was:.1f} -> {now:.1f}"
            )
    return ", ".join(parts)


def columns(rows: Sequence[Sequence[str]], *, left: int) -> list[str]:
    """Return rows under each other, a line each; all columns but the first ``left`` are flush right.

    >>> columns([("sailor", "s"), ("alone", "301")], left=1)
    ['sailor    s', 'alone   301']
    """
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
    return [
        "  ".join(
            cell.rjust(w) if n >= left else cell.ljust(w) for n, (cell, w) in enumerate(zip(row, widths, strict=True))
        ).rstrip()
        for row in rows
    ]


def markdown(heads: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return a Markdown table whose first two columns are words and all others numbers."""
    lines = [" | ".join(row) for row in (heads, *rows)]
    return "\n".join(
        ["| " + lines[0] + " |", "|---|---|" + "--:|" * (len(heads) - 2), *("| " + line + " |" for line in lines[1:])]
    )
