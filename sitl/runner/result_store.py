"""The result store: a file of results, a line each as they come, by which a run goes on; what made them; their table.

The commit says where to look it up and is not compared: a checkout may be changed, an installed program has none. The
digest of the source says what runs. Libraries of arithmetic and the kind of machine count, because the last bit does.

The first line says which campaign it is and what it was made by. Each further one is ``{"key": ..., "result": ...}``:
the key tells the job (scenario, hash of its files, seed, ...), the result how it went, and neither when, where or
after what. So the lines are the same bytes wherever a job was done; a run that ends puts them in the order of their
keys, and then the files are the same too. Seconds, machines and attempts are in ``NAME.facts.jsonl`` beside it.

A column has one kind of value; what is a list or a table within a result is its JSON. The file's own words say which
columns are the key, so a table tells by itself what it is and can be held against another, years later.
"""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import json
import os
import platform
import subprocess
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import companion
import sitl
from companion.disk import Disk, reason
from companion.errors import InputError, JobError, unreadable
from companion.words import counted

LIBRARIES = ("numpy", "numba", "shapely", "pyproj", "pymavlink")
# The laboratory's lies beside them, or is not installed.
ROOTS = tuple(
    folder
    for folder in (
        *(Path(package.__path__[0]).resolve() for package in (companion, sitl)),
        Path(sitl.__path__[0]).resolve().with_name("lab"),
    )
    if folder.is_dir()
)


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeBy:
    """A program that sails: its ``source`` is a digest of all its modules; ``commit`` ends in + where they differ."""

    version: str
    commit: str
    source: str
    python: str
    machine: str
    libraries: tuple[tuple[str, str], ...]

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {**asdict(self), "libraries": dict(self.libraries)}

    @classmethod
    def from_dict(cls, plain: dict[str, Any]) -> MadeBy:
        """Return it from JSON; KeyError, TypeError or ValueError where it is none."""
        return cls(**{**plain, "libraries": tuple(dict(plain["libraries"]).items())})

    def unlike(self, other: MadeBy) -> str:
        """Return in words how ``other`` differs in what decides a result, "" where it does not."""
        pairs = [
            ("the project", self.version, other.version),
            ("its source", self.source, other.source),
            ("Python", self.python, other.python),
            ("the machine", self.machine, other.machine),
        ]
        theirs = dict(other.libraries)
        pairs += [(name, number, theirs.get(name, "none")) for name, number in self.libraries]
        return ", ".join(f"{name} is {there} there and {here} here" for name, here, there in pairs if here != there)


@cache
def made_by() -> MadeBy:
    """Return what this process is."""
    return MadeBy(
        version=companion.__version__,
        commit=_commit(),
        source=_source(),
        machine=platform.machine(),
        python=".".join(platform.python_version_tuple()[:2]),
        libraries=tuple((name, version(name)) for name in LIBRARIES),
    )


@cache
def processor() -> str:
    """Return what numpy makes of the processor: with other instructions the last bit of a sine may be another."""
    features = import_module("numpy._core._multiarray_umath").__cpu_features__
    return hashlib.sha256(repr(sorted(name for name, has in features.items() if has)).encode()).hexdigest()[:8]


def _source() -> str:
    digest = hashlib.sha256()
    for root in ROOTS:
        for path in sorted(root.rglob("*.py")):
            name = path.relative_to(root.parent).as_posix()
            if "/kernels/carried/" not in name:
                digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _commit() -> str:
    """Return the commit of the checkout that the packages lie in, "" where there is none or no git."""

    def git(*words: str) -> str:
        done = subprocess.run(  # noqa: S603 - the user's own git
            ["git", "-C", str(ROOTS[0].parent), *words],  # noqa: S607
            capture_output=True,
            text=True,
            check=True,
            timeout=10.0,
        )
        return done.stdout.strip()

    try:
        if not git("ls-files", *(str(root / "__init__.py") for root in ROOTS)):
            return ""  # installed somewhere below another project's checkout
        changed = git("status", "--porcelain", "--untracked-files=all", "--", *map(str, ROOTS))
        return git("rev-parse", "--short=12", "HEAD") + ("+" if changed else "")
    except (OSError, subprocess.SubprocessError):
        return ""


FORMAT = 1
# What a job is known by: words and numbers.
KeyValue = str | int | float | bool | None
Key = Mapping[str, KeyValue]


def text_of(value: Any) -> str:
    """Return the one way in which a value is written."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class StoredResults:
    """What a file holds: results by the text of their keys."""

    campaign: str
    by: MadeBy
    results: dict[str, dict[str, Any]] = field(default_factory=dict)

    def pairs(self) -> Iterator[tuple[dict[str, Any], dict[str, Any]]]:
        """Yield key and result of each, in the order of their keys."""
        for text in sorted(self.results, key=_order):
            yield json.loads(text), self.results[text]

    def to_bytes(self) -> bytes:
        """Return the file."""
        lines = [
            _head(self.campaign, self.by),
            *(_line(text, self.results[text]) for text in sorted(self.results, key=_order)),
        ]
        return "".join(lines).encode()


def _head(campaign: str, by: MadeBy) -> str:
    return text_of({"results": FORMAT, "campaign": campaign, "made_by": by.to_dict()}) + "\n"


def _line(key: str, result: dict[str, Any]) -> str:
    return f'{{"key":{key},"result":{text_of(result)}}}\n'


def _order(text: str) -> list[tuple[bool, float, str]]:
    """Return what to sort a key by: numbers as numbers."""
    return [
        (isinstance(v, str), float(v) if isinstance(v, int | float) else 0.0, str(v)) for v in json.loads(text).values()
    ]


def read_results(path: Path) -> StoredResults:
    """Return what a file of results holds; a last line that was cut short is left out.

    Raises:
        InputError: it cannot be read, or is no file of results; names file, line and remedy.
    """
    try:
        data = path.read_bytes()
    except OSError as error:
        raise unreadable(str(path), error) from error
    if not data:
        raise InputError(str(path), "", "is empty", "name another file")
    return _parsed(path, data)


def _parsed(path: Path, data: bytes) -> StoredResults:
    lines = data.split(b"\n")[:-1]
    number = 1
    try:
        head = json.loads(lines[0])
        held = StoredResults(campaign=head["campaign"], by=MadeBy.from_dict(head["made_by"]))
        is_known = head["results"] == FORMAT
        for line in lines[1:]:
            number += 1
            row = json.loads(line)
            held.results[text_of(row["key"])] = dict(row["result"])
    except (ValueError, KeyError, TypeError, IndexError) as error:
        raise InputError(str(path), f"line {number}", "is no line of a file of results", "name another file") from error
    if not is_known:
        raise InputError(str(path), "line 1", f"is of format {head['results']}, and {FORMAT} is known here", "update")
    return held


def require_free(path: Path) -> None:
    """Raise JobError where another process writes this file of results: what it sails by is not to be changed."""
    try:
        with path.open("rb") as file:
            _lock(file.fileno(), path)
    except OSError as error:
        raise JobError(f"{path}: {reason(error)}") from error


def _lock(fd: int, path: Path) -> None:
    try:
        fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except OSError as error:
        raise JobError(f"{path}: another run writes it; wait for it, or name another file") from error


class ResultStore:
    """A file of results that is open to be appended to, by one process at a time."""

    def __init__(self, path: Path, campaign: str) -> None:
        """Open or make it, take what it holds, cut off a last line that is not whole.

        Raises:
            InputError: it is another campaign's, made by another program, no file of results, or cannot be written.
            JobError: another process writes it, or the disk does not take it.
        """
        self.path = path
        self._disk = Disk()
        try:
            self._fd = self._disk.open_to_append(path)
        except OSError as error:
            raise InputError(str(path), "", f"cannot be written ({reason(error)})", "name another place") from error
        try:
            self.held = self._begin(campaign)
        except BaseException:
            os.close(self._fd)
            raise

    def _begin(self, campaign: str) -> StoredResults:
        _lock(self._fd, self.path)
        data = self.path.read_bytes()
        whole = data[: data.rfind(b"\n") + 1]
        if not whole:
            if data and not data.startswith(b'{"results":'[: len(data)]):  # somebody's file, and no head cut short
                raise InputError(str(self.path), "line 1", "is no line of a file of results", "name another file")
            os.ftruncate(self._fd, 0)
            self._append(_head(campaign, made_by()))
            return StoredResults(campaign=campaign, by=made_by())
        held = _parsed(self.path, whole)
        if held.campaign != campaign:
            raise InputError(str(self.path), "", f"holds results of sitl {held.campaign}", "name another file")
        unlike = made_by().unlike(held.by)
        if unlike:
            raise InputError(
                str(self.path),
                "",
                f"was begun by another program ({unlike})",
                "results are not mixed: name another file",
            )
        os.ftruncate(self._fd, len(whole))
        return held

    def add(self, key: str, result: dict[str, Any], facts: Mapping[str, Any]) -> None:
        """Append a result; JobError, which says what is safe, where the disk does not take it."""
        self._append(_line(key, result))
        self.held.results[key] = result
        with contextlib.suppress(OSError):  # they are about the run and not of it
            fd = self._disk.open_to_append(facts_beside(self.path))
            try:
                self._disk.append(fd, (f'{{"key":{key},' + text_of(facts)[1:] + "\n").encode())
            finally:
                os.close(fd)

    def _append(self, line: str) -> None:
        try:
            self._disk.append(self._fd, line.encode())
        except OSError as error:
            held = self.held.results if hasattr(self, "held") else ()
            raise JobError(
                f"{self.path}: {reason(error)}; it holds {counted(len(held), 'result')}: make room, and "
                "the same command goes on"
            ) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Put the lines in order, unless the run was broken off, and close."""
        if kind is None and self.path.is_file():
            with contextlib.suppress(OSError):  # unordered they say the same
                self._disk.replace(self.path, self.held.to_bytes())
        os.close(self._fd)


def facts_beside(path: Path) -> Path:
    """Return the file of what is not a result: when, where, how long."""
    return path.with_suffix(".facts.jsonl")


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


def table_of(held: StoredResults) -> Table:
    """Return a ledger's results as a table."""
    pairs = list(held.pairs())
    rows = tuple({**_flat(result), **key} for key, result in pairs)
    return Table(
        campaign=held.campaign,
        by=held.by,
        rows=rows,
        keys=tuple(dict.fromkeys(name for key, _ in pairs for name in key)),
    )


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
        what = "is no table of a campaign" if path.stat().st_size else "is empty"
        raise InputError(str(path), "", what, "name another file") from error
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
    parquet.write_table(
        pa.table(columns).replace_schema_metadata({META: text_of(meta).encode()}),
        sink,
        compression="zstd",
        write_statistics=False,
    )
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


def joined(paths: Iterable[Path]) -> StoredResults:
    """Return the results of several files of one campaign and program.

    Raises:
        InputError: one is of another campaign or program, or says otherwise of the same job.
    """
    whole: StoredResults | None = None
    for path in paths:
        part = read_results(path)
        if whole is None:
            whole = StoredResults(campaign=part.campaign, by=part.by)
        unlike = whole.by.unlike(part.by)
        if part.campaign != whole.campaign or unlike:
            raise InputError(
                str(path),
                "",
                f"is of sitl {part.campaign}, the first of sitl {whole.campaign}"
                if part.campaign != whole.campaign
                else f"was made by another program ({unlike})",
                "join what belongs together",
            )
        for key, result in part.results.items():
            if whole.results.setdefault(key, result) != result:
                raise InputError(
                    str(path),
                    key,
                    "has another result than in the files before",
                    "the same program must give the same: is the processor of another kind?",
                )
    if whole is None:
        raise InputError("sitl results join", "", "no file", "name the parts")
    return whole
