"""``sitl results``: what campaigns left: shown, joined, kept as tables, held against each other."""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

from companion.disk import Disk, reason
from companion.errors import JobError
from companion.program.arguments import out_file, whole


def add_parser(subparsers: Any, summary: str) -> None:
    """Add the command."""
    parser = subparsers.add_parser(
        "results",
        help=summary,
        description="Files of results (FILE.jsonl of a campaign's --out) and tables of them (FILE.parquet of its "
        "--table; needs the extra [results]).",
        epilog="Example: sitl results compare before.parquet after.jsonl",
    )
    verbs = parser.add_subparsers(dest="verb", metavar="VERB", required=True)
    show = verbs.add_parser("show", help="what a file holds: by which program, and the figures of each group")
    show.add_argument("file", type=Path, metavar="FILE")
    held = verbs.add_parser(
        "compare",
        help="two files of one campaign, paired by seed: changes, how sure, the worst seeds first",
        description="Pair two files by seed and say what changed: shares of voyages, the ratio of times of those that "
        "arrived in both, clearance, silence, tacks, replans. Each with its 95 % interval and how likely as much for "
        "the worse would be by luck.",
    )
    held.add_argument("first", type=Path, metavar="A")
    held.add_argument("second", type=Path, metavar="B")
    held.add_argument(
        "--fail-on-worse",
        action="store_true",
        help="exit 1 where B is worse, and by more than luck explains (at 5 %% for all figures together)",
    )
    held.add_argument("--most", type=whole(), default=10, metavar="N", help="seeds to name (default: 10)")
    held.add_argument("--json", type=out_file, metavar="FILE", help="write the changes")
    join = verbs.add_parser("join", help="one file of several, as --array leaves them")
    join.add_argument("parts", type=Path, nargs="+", metavar="PART.jsonl")
    join.add_argument("--out", type=out_file, required=True, metavar="FILE", help="FILE.jsonl or FILE.parquet")
    parser.set_defaults(run=run)


def run(args: argparse.Namespace) -> int:
    """Run the command."""
    from sitl.results import compare, comparison_text, table_text
    from sitl.runner import joined, read_table, table_of, write_table

    if args.verb == "show":
        sys.stdout.write(table_text(read_table(args.file)))
        return 0
    if args.verb == "join":
        whole_file = joined(args.parts)
        if args.out.suffix == ".parquet":
            write_table(table_of(whole_file), args.out)
        else:
            _write(args.out, whole_file.to_bytes())
        sys.stdout.write(f"{args.out}: {len(whole_file.results)} results\n")
        return 0
    found = compare(read_table(args.first), read_table(args.second))
    sys.stdout.write(comparison_text(found, most=args.most))
    if args.json is not None:
        _write(args.json, (json.dumps(found.to_dict(), indent=1) + "\n").encode())
    return 1 if args.fail_on_worse and found.worse else 0


def _write(path: Path, data: bytes) -> None:
    try:
        Disk().replace(path, data)
    except OSError as error:
        raise JobError(f"{path}: {reason(error)}") from error
