"""Options that rehearsals and campaigns share: who does the jobs, and where results stay."""

from __future__ import annotations

import argparse
from argparse import ArgumentTypeError
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from companion.errors import InputError
from companion.program.arguments import out_file, whole

JobT = TypeVar("JobT")


@dataclass(frozen=True, slots=True, kw_only=True)
class CampaignOptions:
    """Processes here (``workers``, None: one per core) or a cluster (``dask``); part I of N of the jobs (``array``).

    Results are appended to ``out`` as they come, and what it holds is not done again; None keeps them in memory.
    In the end all are written to ``table`` as Parquet.
    """

    workers: int | None = None
    dask: str | None = None
    array: tuple[int, int] = (1, 1)
    out: Path | None = None
    table: Path | None = None

    def part(self, jobs: Sequence[JobT]) -> Sequence[JobT]:
        """Return this part of the jobs: every N-th, so that parts take about as long."""
        number, of = self.array
        return jobs[number - 1 :: of]

    @property
    def file(self) -> Path | None:
        """Return the file of this part: parts that are done at a time do not write the same."""
        number, of = self.array
        if self.out is None or of == 1:
            return self.out
        return self.out.with_name(f"{self.out.stem}.{number}-of-{of}{self.out.suffix}")


def add_options(
    parser: argparse.ArgumentParser, *, workers: int | None = None, out: Path | None = None, has_out: bool = True
) -> None:
    """Add the options that every campaign has; ``workers`` and ``out`` are what it does without them.

    ``has_out`` is False where the results have their place in a folder of the campaign's own.
    """
    group = parser.add_argument_group("where it is sailed, and where results stay")
    group.add_argument(
        "--workers",
        type=whole(at_least=1),
        default=workers,
        metavar="W",
        help=f"voyages at a time (default: {workers or 'one per core'})",
    )
    group.add_argument(
        "--dask",
        type=_address,
        metavar="ADDRESS",
        help="by the workers of a Dask scheduler (tcp://HOST:8786, or its scheduler file), or of a "
        "'local' one; needs the extra [cluster]",
    )
    group.add_argument(
        "--array",
        type=_part,
        default=(1, 1),
        metavar="I/N",
        help="only part I of N, into a file of its own beside --out: join them by 'sitl results join'",
    )
    if has_out:
        group.add_argument(
            "--out",
            type=_results,
            default=out,
            metavar="FILE.jsonl",
            help="append each result as it comes; what it holds already is not sailed again"
            + (f" (default: {out})" if out else ""),
        )
    group.add_argument(
        "--table",
        type=_table,
        metavar="FILE.parquet",
        help="write all results as a table, for 'sitl results'; needs the extra [results]",
    )


def options_of(args: argparse.Namespace, *, out: Path | None = None) -> CampaignOptions:
    """Return what the options say; ``out`` is where results stay of a campaign that has its own folder."""
    out = out or args.out
    if args.array[1] > 1 and out is None:
        raise InputError("--array", "", "says a part, and nothing says where to keep it", "add --out FILE.jsonl")
    return CampaignOptions(workers=args.workers, dask=args.dask, array=args.array, out=out, table=args.table)


def _address(text: str) -> str:
    if not text.strip():
        raise ArgumentTypeError("an empty address; write tcp://HOST:8786, or local")
    return text


def _results(text: str) -> Path:
    path = out_file(text)
    if path.suffix != ".jsonl":
        raise ArgumentTypeError(f"{text}: results are lines of JSON; end the name in .jsonl")
    return path


def _table(text: str) -> Path:
    path = out_file(text)
    if path.suffix != ".parquet":
        raise ArgumentTypeError(f"{text}: tables are Parquet; end the name in .parquet")
    return path


def _part(text: str) -> tuple[int, int]:
    """Return part and number of parts of ``I/N``.

    >>> _part("3/100")
    (3, 100)
    """
    number, _, of = text.partition("/")
    if not (number.isascii() and number.isdigit() and of.isascii() and of.isdigit() and 1 <= int(number) <= int(of)):
        raise ArgumentTypeError(f"{text[:40]!r} is no part; write I/N with I from 1 to N, as 3/100")
    return int(number), int(of)
