"""Options that campaigns share: who does the jobs, where results stay, and by which guidance and planner."""

from __future__ import annotations

import argparse
from argparse import ArgumentTypeError
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING, TypeVar

from companion.errors import InputError
from companion.planners import ALGORITHMS
from companion.program.arguments import out_file, whole

if TYPE_CHECKING:
    from sitl.run.variation import Method


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
        return jobs[number - 1::of]

    @property
    def file(self) -> Path | None:
        """Return the file of this part: parts that are done at a time do not write the same."""
        number, of = self.array
        if self.out is None or of == 1:
            return self.out
        return self.out.with_name(f"{self.out.stem}.{number}-of-{of}{self.out.suffix}")


def add_options(
    parser: argparse.ArgumentParser, *, workers: int | None = None, out: Path | None = None, has_out: bool = True,
) -> None:
    """Add the options that every campaign has; ``workers`` and ``out`` are what it does without them.

    ``has_out`` is False where the results have their place in a folder of the campaign's own.
    """
    group = parser.add_argument_group("where it is sailed, and where results stay")
    group.add_argument("--workers", type=whole(at_least=1), default=workers, metavar="W",
                       help=f"voyages at a time (default: {workers or 'one per core'})")
    group.add_argument("--dask", type=_address, metavar="ADDRESS",
                       help="by the workers of a Dask scheduler (tcp://HOST:8786, or its scheduler file), or of a "
                            "'local' one; needs the extra [cluster]")
    group.add_argument("--array", type=_part, default=(1, 1), metavar="I/N",
                       help="only part I of N, into a file of its own beside --out: join them by 'sitl results join'")
    if has_out:
        group.add_argument("--out", type=_results, default=out, metavar="FILE.jsonl",
                           help="append each result as it comes; what it holds already is not sailed again"
                                + (f" (default: {out})" if out else ""))
    group.add_argument("--table", type=_table, metavar="FILE.parquet",
                       help="write all results as a table, for 'sitl results'; needs the extra [results]")


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


ALL = "all"   # of what may be drawn


def add_draw(parser: argparse.ArgumentParser, more: Mapping[str, str] = MappingProxyType({})) -> None:
    """Add ``--draw``, of guidance and planner and of ``more``: what each of them is, in words."""
    words = "".join(f", {name} ({told})" for name, told in more.items())
    parser.add_argument("--draw", type=partial(_drawable, more=tuple(more)), default=(), metavar="WHAT[,WHAT]",
                        help="draw from each seed, too: guidance (in AUTO, by heading, by field), planner ("
                        f"{', '.join(ALGORITHMS)}){words}; all: each of these; what else a seed is stays the same "
                        "(default: as the mission says)")


def add_methods(parser: argparse.ArgumentParser) -> None:
    """Add ``--guidance`` and ``--planner``."""
    parser.add_argument("--guidance", type=_guidance, nargs="+", metavar="G",
                        help="sail by each of these in place of the mission's own: plan (in AUTO), heading, field")
    parser.add_argument("--planner", type=_planner, nargs="+", metavar="P",
                        help="and by the plans of each of these: " + ", ".join(ALGORITHMS))


def methods_of(guidances: Sequence[str] | None, planners: Sequence[str] | None) -> list[Method]:
    """Return the methods that were asked for, one of the mission's own where none was."""
    from sitl.run.variation import Method

    own: Sequence[None] = (None,)
    return [Method(guidance=guidance, planner=planner) for guidance in guidances or own for planner in planners or own]


def compile_planners(draws: Sequence[str]) -> None:
    """Compile what the voyages need, and the planners where they are drawn."""
    from sitl.run.compiled import compile_ahead
    from sitl.run.variation import PLANNERS

    for planner in PLANNERS if "planner" in draws else PLANNERS[:1]:
        compile_ahead(planner)


def _drawable(text: str, more: tuple[str, ...] = ()) -> tuple[str, ...]:
    from sitl.run.variation import DRAWABLE

    known = (*DRAWABLE, *more)
    wanted = tuple(_among(part.strip(), (*known, ALL)) for part in text.split(","))
    return tuple(part for part in known if part in wanted or ALL in wanted)


def _guidance(text: str) -> str:
    from sitl.run.variation import GUIDANCES

    return _among(text, GUIDANCES)


def _planner(text: str) -> str:
    from sitl.run.variation import PLANNERS

    return _among(text, PLANNERS)


def _among(text: str, known: Sequence[str]) -> str:
    if text not in known:
        raise argparse.ArgumentTypeError(f"{text!r} is none of {', '.join(known)}")
    return text
