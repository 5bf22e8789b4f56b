"""The table of a campaign: a row for each result, flat, and what it was made by; as Parquet, or of a ledger.

A column has one kind of value; what is a list or a table within a result is its JSON. The file's own words say which
columns are the key, so a table tells by itself what it is and can be held against another, years later.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from companion.disk import Disk, reason
from companion.errors import InputError, JobError, unreadable
from sitl.runner.identity import MadeBy
from sitl.runner.ledger import FORMAT, Held, read_results, text_of

META = b"sitl"
# What a campaign of scenarios has its figures in: they are columns by their own names.
NESTED = "figures"
SUFFIX = ".parquet"


@dataclass(frozen=True, slots=True, kw_only=True)
class Table:
    """Rows of a campaign; ``keys`` are the columns that tell a job."""

    campaign: str
    by: MadeBy
    keys: tuple[str, ...]
    rows: tuple[dict[str, Any], ...]


def table_of(held: Held) -> Table:
    """Return a ledger's results as a table."""
    pairs = list(held.pairs())
    rows = tuple({**_flat(result), **key} for key, result in pairs)
    return Table(campaign=held.campaign, by=held.by, rows=rows, keys=tuple(dict.fromkeys(
        name for key, _ in pairs for name in key)))


def _flat(result: Mapping[str, Any]) -> dict[str, Any]:
    flat: dict[str, Any] = {}
    for name, value in result.items():
        if name == NESTED and isinstance(value, dict):
            flat |= {inner: _cell(v) for inner, v in value.items()}
        else:
            flat[name] = _cell(value)
    return flat


def _cell(value: Any) -> Any:
    return text_of(value) if isinstance(value, list | dict) else value


def read_table(path: Path) -> Table:
    """Read a table from Parquet or from a file of results.

    Raises:
        InputError: it is neither; names the file and the remedy.
        ModuleNotFoundError: of pyarrow, which Parquet needs.
    """
    if path.suffix != SUFFIX:
        return table_of(read_results(path))
    import pyarrow as pa
    from pyarrow import parquet

    try:
        found = parquet.read_table(path)
        meta = json.loads(found.schema.metadata[META])
        by = MadeBy.from_dict(meta["made_by"])
        keys, campaign, number = tuple(meta["keys"]), meta["campaign"], meta["results"]
    except OSError as error:
        raise unreadable(str(path), error) from error
    except (pa.ArrowException, KeyError, TypeError, ValueError) as error:
        raise InputError(str(path), "", "is no table of a campaign", "name another file") from error
    if number != FORMAT:
        raise InputError(str(path), "", f"is of format {number}, and {FORMAT} is known here", "update")
    ours = set(_made(by))
    rows = tuple({name: value for name, value in row.items() if name not in ours} for row in found.to_pylist())
    return Table(campaign=campaign, by=by, keys=keys, rows=rows)


def _made(by: MadeBy) -> dict[str, str]:
    plain = by.to_dict()
    return {f"made_by_{name}": value if isinstance(value, str) else text_of(value) for name, value in plain.items()}


def write_table(table: Table, path: Path) -> None:
    """Write a table as Parquet, whole or not at all.

    Raises:
        JobError: the disk does not take it.
        ModuleNotFoundError: of pyarrow.
    """
    import pyarrow as pa
    from pyarrow import parquet

    names = list(table.keys) + sorted({name for row in table.rows for name in row} - set(table.keys))
    made = _made(table.by)
    columns: dict[str, Any] = {name: pa.array(_column([row.get(name) for row in table.rows])) for name in names}
    columns |= {name: pa.array([value] * len(table.rows)) for name, value in made.items()}
    meta = {"results": FORMAT, "campaign": table.campaign, "made_by": table.by.to_dict(), "keys": table.keys}
    sink = pa.BufferOutputStream()
    parquet.write_table(pa.table(columns).replace_schema_metadata({META: text_of(meta).encode()}), sink,
                        compression="zstd", write_statistics=False)
    try:
        Disk().replace(path, sink.getvalue().to_pybytes())
    except OSError as error:
        raise JobError(f"{path}: {reason(error)}") from error


def _column(values: Sequence[Any]) -> list[Any]:
    """Return values of one kind: numbers as one, and as text what is of several."""
    kinds = {type(value) for value in values if value is not None}
    if kinds == {int, float}:
        return [None if value is None else float(value) for value in values]
    if len(kinds) > 1:
        return [None if value is None else value if isinstance(value, str) else text_of(value) for value in values]
    return list(values)


def joined(paths: Iterable[Path]) -> Held:
    """Return the results of several files of one campaign and program.

    Raises:
        InputError: one is of another campaign or program, or says otherwise of the same job.
    """
    whole: Held | None = None
    for path in paths:
        part = read_results(path)
        if whole is None:
            whole = Held(campaign=part.campaign, by=part.by)
        unlike = whole.by.unlike(part.by)
        if part.campaign != whole.campaign or unlike:
            raise InputError(str(path), "", f"is of sitl {part.campaign}, the first of sitl {whole.campaign}"
                             if part.campaign != whole.campaign else f"was made by another program ({unlike})",
                             "join what belongs together")
        for key, result in part.results.items():
            if whole.results.setdefault(key, result) != result:
                raise InputError(str(path), key, "has another result than in the files before",
                                 "the same program must give the same: is the processor of another kind?")
    if whole is None:
        raise InputError("sitl results join", "", "no file", "name the parts")
    return whole
