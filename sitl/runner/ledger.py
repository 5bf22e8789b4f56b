"""The ledger: one file of results, a line each as they come, by which a run goes on where it was.

The first line says which campaign it is and what it was made by. Each further one is ``{"key": ..., "result": ...}``:
the key tells the job (scenario, hash of its files, seed, ...), the result how it went, and neither when, where or
after what. So the lines are the same bytes wherever a job was done; a run that ends puts them in the order of their
keys, and then the files are the same too. Seconds, machines and attempts are in ``NAME.facts.jsonl`` beside it.
"""

from __future__ import annotations

import contextlib
import fcntl
import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from companion.disk import Disk, reason
from companion.errors import InputError, JobError, unreadable
from companion.words import counted
from sitl.runner.identity import MadeBy, made_by

FORMAT = 1
# What a job is known by: words and numbers.
Key = Mapping[str, str | int | float | bool | None]


def text_of(value: Any) -> str:
    """Return the one way in which a value is written."""
    return json.dumps(value, separators=(",", ":"), ensure_ascii=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Held:
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
        lines = [_head(self.campaign, self.by), *(_line(text, self.results[text])
                                                  for text in sorted(self.results, key=_order))]
        return "".join(lines).encode()


def _head(campaign: str, by: MadeBy) -> str:
    return text_of({"results": FORMAT, "campaign": campaign, "made_by": by.to_dict()}) + "\n"


def _line(key: str, result: dict[str, Any]) -> str:
    return f'{{"key":{key},"result":{text_of(result)}}}\n'


def _order(text: str) -> list[tuple[bool, float, str]]:
    """Return what to sort a key by: numbers as numbers."""
    return [(isinstance(v, str), float(v) if isinstance(v, int | float) else 0.0, str(v))
            for v in json.loads(text).values()]


def read_results(path: Path) -> Held:
    """Return what a file of results holds; a last line that was cut short is left out.

    Raises:
        InputError: it cannot be read, or is no file of results; names file, line and remedy.
    """
    try:
        return _parsed(path, path.read_bytes())
    except OSError as error:
        raise unreadable(str(path), error) from error


def _parsed(path: Path, data: bytes) -> Held:
    lines = data.split(b"\n")[:-1]
    number = 1
    try:
        head = json.loads(lines[0])
        held = Held(campaign=head["campaign"], by=MadeBy.from_dict(head["made_by"]))
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


class Ledger:
    """A file of results that is open to be appended to, by one process at a time."""

    def __init__(self, path: Path, campaign: str) -> None:
        """Open or make it, take what it holds, cut off a last line that is not whole.

        Raises:
            InputError: it is another campaign's, made by another program, or no file of results.
            JobError: another process writes it, or the disk does not take it.
        """
        self.path = path
        self._disk = Disk()
        try:
            self._fd = self._disk.open_to_append(path)
        except OSError as error:
            raise JobError(f"{path}: {reason(error)}") from error
        try:
            self.held = self._begin(campaign)
        except BaseException:
            os.close(self._fd)
            raise

    def _begin(self, campaign: str) -> Held:
        try:
            fcntl.flock(self._fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError as error:
            raise JobError(f"{self.path}: another run writes it; wait for it, or name another file") from error
        data = self.path.read_bytes()
        whole = data[:data.rfind(b"\n") + 1]
        if not whole:
            if data and not data.startswith(b'{"results":'[:len(data)]):   # somebody's file, and no head cut short
                raise InputError(str(self.path), "line 1", "is no line of a file of results", "name another file")
            os.ftruncate(self._fd, 0)
            self._append(_head(campaign, made_by()))
            return Held(campaign=campaign, by=made_by())
        held = _parsed(self.path, whole)
        if held.campaign != campaign:
            raise InputError(str(self.path), "", f"holds results of sitl {held.campaign}", "name another file")
        unlike = made_by().unlike(held.by)
        if unlike:
            raise InputError(str(self.path), "", f"was begun by another program ({unlike})",
                             "results are not mixed: name another file")
        os.ftruncate(self._fd, len(whole))
        return held

    def add(self, key: str, result: dict[str, Any], facts: Mapping[str, Any]) -> None:
        """Append a result; JobError, which says what is safe, where the disk does not take it."""
        self._append(_line(key, result))
        self.held.results[key] = result
        with contextlib.suppress(OSError):   # they are about the run and not of it
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
            raise JobError(f"{self.path}: {reason(error)}; it holds {counted(len(held), 'result')}: make room, and "
                           "the same command goes on") from error

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None,
                 traceback: TracebackType | None) -> None:
        """Put the lines in order, unless the run was broken off, and close."""
        if kind is None and self.path.is_file():
            with contextlib.suppress(OSError):   # unordered they say the same
                self._disk.replace(self.path, self.held.to_bytes())
        os.close(self._fd)


def facts_beside(path: Path) -> Path:
    """Return the file of what is not a result: when, where, how long."""
    return path.with_suffix(".facts.jsonl")
