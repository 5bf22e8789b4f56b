"""Measures again what the pages show of a command's output: ``python -m bench.measured [WORD ...]`` (make measured).

A page says it by a mark before a block, ``<!-- measured: COMMAND -->``: the command is run by a shell from the root,
the block becomes what it printed, and behind it stand date, commit of the code and how long it took. One that fails
leaves its block as it was. With words only the commands that contain one of them. All together take less than an hour
of two quiet cores.

What takes longer is marked where its figures stand, ``<!-- by hand: DATE: COMMAND -->``, and listed with its age in
docs/lab/figures.md.
"""

from __future__ import annotations

import argparse
import datetime as dt
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FIGURES = ROOT / "docs" / "lab" / "figures.md"
CODE = ("companion", "sitl", "lab", "sailbench", "bench")
_BLOCK = re.compile(r"<!-- measured: (?P<command>[^\n]+) -->\n\n```text\n.*?```\n\n\*[^\n]*\*\n", re.DOTALL)
_BY_HAND = re.compile(r"<!-- by hand: (?P<date>\d{4}-\d\d-\d\d): (?P<command>.+?) -->")
_AGES = re.compile(r"(?<=<!-- ages -->\n).*?(?=<!-- end of the ages -->)", re.DOTALL)

# A command's output and the seconds that it took; None where it failed.
Run = Callable[[str], tuple[str, float] | None]


def again(text: str, run: Run, stamp: str, words: tuple[str, ...] = ()) -> str:
    """Return a page with its blocks measured again, ``stamp`` (date and commit) behind each."""

    def block(found: re.Match[str]) -> str:
        command = found["command"]
        if (words and not any(word in command for word in words)) or (answer := run(command)) is None:
            return found[0]
        printed, took_s = answer
        return (
            f"<!-- measured: {command} -->\n\n```text\n$ {command}\n{printed.rstrip()}\n```\n\n"
            f"*{stamp}, {took_s:.0f} s.*\n"
        )

    return _BLOCK.sub(block, text)


def ages(pages: dict[str, str], today: dt.date) -> str:
    """Return the table of what is measured by hand, the oldest first; ``pages``: text by name, seen from figures.md."""
    rows = sorted(
        (dt.date.fromisoformat(found["date"]), found["command"], name)
        for name, text in pages.items()
        for found in _BY_HAND.finditer(text)
    )
    lines = [
        f"| `{command}` | [{Path(name).stem}]({name}) | {date} | {(today - date).days} |"
        for date, command, name in rows
    ]
    return "\n".join(["\n| command | figures in | measured | days old |", "|---|---|---|--:|", *lines, "\n"])


def _shell(command: str) -> tuple[str, float] | None:
    print(command, end=" ", flush=True)
    begun_s = time.monotonic()
    path = f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}"
    done = subprocess.run(
        ["bash", "-o", "pipefail", "-c", command],
        cwd=ROOT,
        check=False,
        text=True,
        capture_output=True,
        env={**os.environ, "PATH": path},
    )
    took_s = time.monotonic() - begun_s
    # 1: a voyage failed, and is told of.
    if done.returncode > 1 or "Traceback" in done.stderr or not done.stdout.strip():
        print(f"failed ({done.returncode}): {done.stderr[-500:]}")
        return None
    print(f"{took_s:.0f} s")
    return done.stdout, took_s


def _pages() -> Iterator[tuple[str, Path]]:
    for path in sorted((ROOT / "docs").rglob("*.md")):
        yield os.path.relpath(path, FIGURES.parent), path


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.measured", description=__doc__.splitlines()[0])
    parser.add_argument("words", nargs="*", metavar="WORD", help="only commands that contain one of these")
    words = tuple(parser.parse_args().words)
    commit = subprocess.run(
        ["git", "log", "-1", "--format=%h", "--", *CODE], cwd=ROOT, check=True, text=True, capture_output=True
    ).stdout.strip()
    today = dt.datetime.now(dt.UTC).date()
    for _, path in _pages():
        for block in _BLOCK.finditer(path.read_text(encoding="utf-8")):  # each is written as it comes
            made = again(block[0], _shell, f"{today}, commit {commit}", words)
            path.write_text(path.read_text(encoding="utf-8").replace(block[0], made), encoding="utf-8")
    table = ages({name: path.read_text(encoding="utf-8") for name, path in _pages()}, today)
    text = FIGURES.read_text(encoding="utf-8")
    FIGURES.write_text(_AGES.sub(lambda _: table, text), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
