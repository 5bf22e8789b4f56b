"""Options that campaigns share besides the runner's: which seeds, guidance and planner, and what a seed draws."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from types import MappingProxyType
from typing import TYPE_CHECKING

from companion.errors import InputError
from companion.planners import ALGORITHMS
from companion.program.arguments import out_file, out_folder, whole

if TYPE_CHECKING:
    from lab.methods import Method

ALL = "all"  # of what may be drawn


@dataclass(frozen=True, slots=True, kw_only=True)
class Seeds:
    """How many seeds are sailed, from which on; or the first alone, its voyage's folder kept in ``keep``."""

    runs: int
    first: int
    keep: Path | None


def add_seeds(parser: argparse.ArgumentParser, *, runs: int, of: str = "") -> None:
    """Add ``--runs`` (of ``of``, by default ``runs``), ``--first-seed``, ``--json`` and ``--keep``."""
    parser.add_argument(
        "--runs", type=whole(at_least=1), metavar="N", help=f"seeds to sail{of and ' '}{of} (default: {runs})"
    )
    parser.add_argument("--first-seed", type=whole(), default=0, metavar="S", help="the first of them (default: 0)")
    parser.add_argument("--json", type=out_file, metavar="FILE", help="write figures and voyages")
    parser.add_argument(
        "--keep", type=out_folder, metavar="DIR", help="sail only the first seed and keep its voyage folder"
    )
    parser.set_defaults(usual_runs=runs)


def seeds_of(args: argparse.Namespace) -> Seeds:
    """Return the seeds that were asked for. Raises InputError where one is to be kept and more are asked for."""
    if args.keep is not None:
        of_many = {"--runs": (args.runs or 1) > 1, "--json": args.json is not None, "--out": args.out is not None}
        several = next((option for option, is_given in of_many.items() if is_given), None)
        if several is not None:
            raise InputError("--keep", str(args.keep), "is for one voyage, of the first seed", f"leave out {several}")
    return Seeds(runs=args.runs or args.usual_runs, first=args.first_seed, keep=args.keep)


def add_draw(parser: argparse.ArgumentParser, more: Mapping[str, str] = MappingProxyType({})) -> None:
    """Add ``--draw``, of guidance, planner and station, and of ``more``: what each of them is, in words."""
    words = "".join(f", {name} ({told})" for name, told in more.items())
    parser.add_argument(
        "--draw",
        type=partial(_drawable, more=tuple(more)),
        default=(),
        metavar="WHAT[,WHAT]",
        help="draw from each seed, too: guidance (in AUTO, by heading, by field), planner ("
        f"{', '.join(ALGORITHMS)}), station (kept for a while at the last goal){words}; all: each of these; what else "
        "a seed is stays the same (default: as the mission says)",
    )


def add_methods(parser: argparse.ArgumentParser) -> None:
    """Add ``--guidance`` and ``--planner``."""
    parser.add_argument(
        "--guidance",
        type=_guidance,
        nargs="+",
        metavar="G",
        help="sail by each of these in place of the mission's own: plan (in AUTO), heading, field",
    )
    parser.add_argument(
        "--planner",
        type=_planner,
        nargs="+",
        metavar="P",
        help="and by the plans of each of these: " + ", ".join(ALGORITHMS),
    )


def methods_of(guidances: Sequence[str] | None, planners: Sequence[str] | None) -> list[Method]:
    """Return the methods that were asked for, one of the mission's own where none was."""
    from lab.methods import Method

    own: Sequence[None] = (None,)
    return [Method(guidance=guidance, planner=planner) for guidance in guidances or own for planner in planners or own]


def compile_planners(draws: Sequence[str]) -> None:
    """Compile what the voyages need, and the planners where they are drawn."""
    from lab.methods import PLANNERS
    from sitl.run.compiled import compile_ahead

    for planner in PLANNERS if "planner" in draws else PLANNERS[:1]:
        compile_ahead(planner)


def _drawable(text: str, more: tuple[str, ...] = ()) -> tuple[str, ...]:
    from lab.methods import DRAWABLE

    known = (*DRAWABLE, *more)
    wanted = tuple(_among(part.strip(), (*known, ALL)) for part in text.split(","))
    return tuple(part for part in known if part in wanted or ALL in wanted)


def _guidance(text: str) -> str:
    from lab.methods import GUIDANCES

    return _among(text, GUIDANCES)


def _planner(text: str) -> str:
    from lab.methods import PLANNERS

    return _among(text, PLANNERS)


def _among(text: str, known: Sequence[str]) -> str:
    if text not in known:
        raise argparse.ArgumentTypeError(f"{text!r} is none of {', '.join(known)}")
    return text
