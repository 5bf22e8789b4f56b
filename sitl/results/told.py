"""Results in words: a table's figures by group, and a comparison with the worst seeds first."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from companion.words import counted
from sitl.results.compare import UNPAIRED, Change, Comparison
from sitl.results.measures import MEASURES, Measure, Row
from sitl.runner import MadeBy, Table


def told_by(by: MadeBy) -> str:
    """Return what made results."""
    return f"{by.version}, commit {by.commit or 'unknown'}, source {by.source}, Python {by.python} on {by.machine}"


def told_table(table: Table) -> str:
    """Return what a table holds: who made it, and each group's figures."""
    names = [name for name in table.keys if name not in UNPAIRED and name != "seed"]
    groups: dict[str, list[Row]] = {}
    for row in table.rows:
        groups.setdefault(", ".join(str(row.get(name)) for name in names), []).append(row)
    rows = [("", "voyages", *(m.name + (f" {m.unit}" if m.unit else "") for m in MEASURES))]
    for name, found in groups.items():
        rows.append((name, str(len(found)), *(_figure(measure, found) for measure in MEASURES)))
    return f"sitl {table.campaign}: {counted(len(table.rows), 'result')} by {told_by(table.by)}\n" + _columns(rows)


def _figure(measure: Measure, rows: Sequence[Row]) -> str:
    values = [value for row in rows if (value := measure.of(row)) is not None]
    if not values:
        return "-"
    if measure.kind == "share":
        return f"{sum(values):.0f}/{len(values)}"
    return f"{statistics.median(values):.1f}"


def told(comparison: Comparison, *, most: int = 10) -> str:
    """Return a comparison: what was worse first, then the table of changes, then the seeds."""
    lines = [f"{counted(len(comparison.pairs), 'pair')}, {comparison.same} of them the same in every figure"
             + "".join(f"; {n} only in the {where}"
                       for n, where in zip(comparison.only, ("first", "second"), strict=True) if n)]
    lines += [f"the files of {name} are not the same in both" for name in comparison.other_water]
    rows = [("", "figure", "pairs", "first", "second", "change (95 %)", "by luck", "")]
    rows += [(c.group, c.measure.name, str(c.pairs), *_values(c), f"{c.p_worse:.2g}" if c.measure.worse else "-",
              "WORSE" if c.is_worse else "") for c in comparison.changes if c.change != (c.measure.kind == "ratio")]
    lines.append(_columns(rows).rstrip() if len(rows) > 1 else "no figure that is measured here changed")
    worst = [pair for pair in comparison.pairs if any(x > 0.0 for x in pair.worse)][:most]
    if worst:
        lines.append("worse, the worst first:")
        lines += [f"  {pair.name}: {_pair(pair.before, pair.after)}" for pair in worst]
    found = [f"{c.measure.name} ({c.group})" for c in comparison.worse]
    lines.append("WORSE: " + ", ".join(found) if found else "not worse, as far as these pairs can tell")
    return "\n".join(lines) + "\n"


def _values(change: Change) -> tuple[str, str, str]:
    """Return before, after and change."""
    c, kind = change, change.measure.kind
    if kind == "ratio":
        return f"{c.before:.1f}", f"{c.after:.1f}", f"x {c.change:.3f} ({c.low:.3f} to {c.high:.3f})"
    if kind == "share":
        return (f"{100 * c.before:.1f} %", f"{100 * c.after:.1f} %",
                f"{100 * c.change:+.1f} % ({100 * c.low:+.1f} to {100 * c.high:+.1f})")
    return f"{c.before:.2f}", f"{c.after:.2f}", f"{c.change:+.2f} ({c.low:+.2f} to {c.high:+.2f})"


def _pair(before: Row, after: Row) -> str:
    parts = []
    for measure in MEASURES:
        was, now = measure.of(before), measure.of(after)
        if was is not None and now is not None and was != now:
            parts.append(f"{measure.name} {'no' if not was else 'yes'} -> {'no' if not now else 'yes'}"
                         if measure.kind == "share" else f"{measure.name} {was:.1f} -> {now:.1f}")
    return ", ".join(parts)


def _columns(rows: Sequence[Sequence[str]]) -> str:
    widths = [max(len(row[n]) for row in rows) for n in range(len(rows[0]))]
    return "".join("  ".join(cell.rjust(w) if n > 1 else cell.ljust(w) for n, (cell, w) in enumerate(
        zip(row, widths, strict=True))).rstrip() + "\n" for row in rows)
