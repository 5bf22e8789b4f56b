"""Manual pages and shell completion, made of the command lines' own parsers.

    python packaging/pages.py DIR       writes DIR/man1/*.1 and DIR/{bash,zsh}/{companion,sitl}

A page for each program and for each of its commands: what ``--help`` says, so they cannot tell of an option that is not
there.
"""

import argparse
import re
import sys
from collections.abc import Iterator
from pathlib import Path

import shtab

import companion.cli
import sitl.cli
from companion import __version__
from companion.program import Parser

PROGRAMS = (companion.cli.PROGRAM, sitl.cli.PROGRAM)
SHELLS = ("bash", "zsh")


def escaped(text: str) -> str:
    """Return text as roff has it."""
    text = text.replace("\\", r"\e").replace("-", r"\-")
    return re.sub(r"^([.'])", r"\\&\1", text, flags=re.MULTILINE)


def page(parser: Parser, summary: str) -> str:
    """Return the manual page of a program or a command."""
    name = parser.prog.replace(" ", "-")
    usage = parser.format_usage().partition(":")[2]
    lines = [
        f'.TH "{name.upper()}" "1" "" "sailboat-companion {__version__}" "Sailboat companion"',
        ".SH NAME",
        f"{escaped(name)} \\- {escaped(summary)}",
        ".SH SYNOPSIS",
        escaped(" ".join(usage.split())),
    ]
    if parser.description:
        lines += [".SH DESCRIPTION", *paragraphs(parser.description)]
    for title, entries in groups(parser):
        lines.append(f'.SH "{title.upper()}"')
        for words, text in entries:
            lines += [".TP", f".B {escaped(words)}", escaped(text) or "\\&"]
    if parser.epilog:
        lines += [".SH NOTES", ".nf" if "\n" in parser.epilog else "", *paragraphs(parser.epilog)]
    return "\n".join(line for line in lines if line) + "\n"


def paragraphs(text: str) -> list[str]:
    """Return lines of roff; an empty line begins a paragraph."""
    return [escaped(line.strip()) or ".PP" for line in text.strip().splitlines()]


def groups(parser: Parser) -> Iterator[tuple[str, list[tuple[str, str]]]]:
    """Yield what a parser takes: commands, arguments, options, with their texts."""
    formatter = parser._get_formatter()
    for group in parser._action_groups:
        entries = []
        for action in group._group_actions:
            if action.help is argparse.SUPPRESS:
                continue
            if isinstance(action, argparse._SubParsersAction):
                entries += [(choice.dest, choice.help or "") for choice in action._choices_actions]
            else:
                entries.append(
                    (formatter._format_action_invocation(action), formatter._expand_help(action) if action.help else "")
                )
        if entries:
            yield group.title or "options", entries


def main(folder: Path) -> None:
    """Write all of them."""
    pages = folder / "man1"
    for place in (pages, *(folder / shell for shell in SHELLS)):
        place.mkdir(parents=True, exist_ok=True)
    for program in PROGRAMS:
        parser = program.parser()
        pages.joinpath(f"{program.name}.1").write_text(page(parser, program.description.rstrip(".")))
        for name, inner in parser.commands.items():
            pages.joinpath(f"{program.name}-{name}.1").write_text(page(inner, program.summary(name)))
            for within, parsed in inner.commands.items():
                told = parsed.description or f"a command of {program.name} {name}"
                pages.joinpath(f"{program.name}-{name}-{within}.1").write_text(
                    page(parsed, told.splitlines()[0].rstrip("."))
                )
        for shell in SHELLS:
            folder.joinpath(shell, program.name).write_text(shtab.complete(parser, shell))


if __name__ == "__main__":
    main(Path(sys.argv[1]))
