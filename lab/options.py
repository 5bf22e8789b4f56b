"""Options that campaigns share besides the runner's: by which guidance and planner, and what a seed draws."""

from __future__ import annotations

import argparse
from collections.abc import Mapping, Sequence
from functools import partial
from types import MappingProxyType
from typing import TYPE_CHECKING

from companion.planners import ALGORITHMS

if TYPE_CHECKING:
    from lab.methods import Method

ALL = "all"  # of what may be drawn


def add_draw(parser: argparse.ArgumentParser, more: Mapping[str, str] = MappingProxyType({})) -> None:
    """Add ``--draw``, of guidance and planner and of ``more``: what each of them is, in words."""
    words = "".join(f", {name} ({told})" for name, told in more.items())
    parser.add_argument(
        "--draw",
        type=partial(_drawable, more=tuple(more)),
        default=(),
        metavar="WHAT[,WHAT]",
        help="draw from each seed, too: guidance (in AUTO, by heading, by field), planner ("
        f"{', '.join(ALGORITHMS)}){words}; all: each of these; what else a seed is stays the same "
        "(default: as the mission says)",
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
