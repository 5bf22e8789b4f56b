"""The leaderboard: results, which are Parquet, as one page that asks for nothing else."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from html import escape
from pathlib import Path
from typing import Any

from companion.errors import InputError, unreadable
from sailbench import plan_bench, sailors
from sailbench.problem_set import answers

STYLE = (
    "body{font:15px/1.5 system-ui,sans-serif;margin:2rem auto;max-width:68rem;padding:0 1rem;color:#1b2a38}"
    "table{border-collapse:collapse;width:100%;margin:1rem 0}th,td{padding:.3rem .6rem;border-bottom:1px solid #cfdae2;"
    "text-align:right;white-space:nowrap}th:first-child,td:first-child,.w{text-align:left}th{background:#dcecf5}"
    "p{max-width:48rem}"
)
PLANS = (
    "Every answer is judged by the exact scorer. Solved: a feasible path in every seed. Known: where there is no path, "
    "said to be so in every seed. Wrong: a path that the scorer refuses, or an untrue claim. Over the bound: above a "
    "time that no path can be faster than. Over best: above the best path that is known. Median / 90th percentile / "
    "worst."
)
VOYAGES = (
    "The same boat in the same weather by seed, steered once a second. Times are of voyages that arrived and touched "
    "nothing, from setting sail to the last goal."
)


def read(paths: Iterable[Path]) -> list[dict[str, Any]]:
    """Return the rows of result files. Raises InputError: one is not there, or none of ours."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    rows: list[dict[str, Any]] = []
    for path in paths:
        if path.is_dir():  # read as one table of all that is in it
            raise InputError(str(path), "", "is a folder", "name a file in it, as --out wrote")
        try:
            table = pq.read_table(path)
        except OSError as error:
            raise unreadable(str(path), error, remedy="name what --out wrote") from error
        except pa.ArrowInvalid as error:  # in words of its own, which name the file and a format that is none of ours
            what = "is no table of results" if path.stat().st_size else "is empty"
            raise InputError(str(path), "", what, "name what --out wrote") from error
        if not {"planner", "sailor"} & set(table.column_names):
            raise InputError(str(path), "", "holds neither planners nor sailors", "name what --out wrote")
        rows += table.to_pylist()
    return rows


def write(path: Path, rows: Sequence[Mapping[str, Any]]) -> None:
    """Write rows as Parquet, whole or not at all."""
    import pyarrow as pa
    import pyarrow.parquet as pq

    beside = path.with_name(path.name + ".new")
    try:
        pq.write_table(pa.Table.from_pylist([dict(row) for row in rows]), beside)
        beside.replace(path)
    except OSError as error:
        raise InputError(
            str(path), "", f"cannot be written ({error.strerror or error})", "name a folder that is there"
        ) from error


def page(rows: Sequence[Mapping[str, Any]], *, stamp: str) -> str:
    """Return the leaderboard as HTML; ``stamp`` says when and of which version it is."""
    plans: list[Any] = [row for row in rows if "planner" in row]
    sailed: list[Any] = [row for row in rows if "sailor" in row]
    parts = []
    if plans:
        lines = plan_bench.summary(plans, answers())
        parts += [f"<h2>Planners</h2><p>{PLANS}</p>", _table(plan_bench.HEADS, [plan_bench.cells(n) for n in lines], 1)]
    if sailed:
        parts += [f"<h2>Sailors</h2><p>{VOYAGES}</p>", _table(sailors.HEADS, sailors.lines(sailed), 2)]
    return (
        '<!doctype html><html lang="en"><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
        f"<title>sailbench</title><style>{STYLE}</style><h1>sailbench</h1>{''.join(parts)}<p>{escape(stamp)}</p></html>\n"
    )


def _table(heads: Sequence[str], rows: Iterable[Sequence[str]], words: int) -> str:
    def line(cells: Sequence[str], tag: str) -> str:
        ends = [f'<{tag} class="w">' if n < words else f"<{tag}>" for n in range(len(cells))]
        return "<tr>" + "".join(f"{e}{escape(c)}</{tag}>" for e, c in zip(ends, cells, strict=True)) + "</tr>"

    return f"<table>{line(heads, 'th')}{''.join(line(cells, 'td') for cells in rows)}</table>"
