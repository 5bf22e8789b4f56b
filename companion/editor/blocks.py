"""A TOML text in blocks, each table with its own comment: what is put in order, added or taken out without a new text.

A block is a header, the comment right above it, and all up to the next block; tables inside a table belong to it
(``[goal.port_mark]`` to its ``[[goal]]``). The blocks' texts, one after another, are the text.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

_HEADER = re.compile(r"[ \t]*(\[\[?)[ \t]*(\"[^\"\n]*\"|'[^'\n]*'|[A-Za-z0-9_-]+)[ \t]*(\.|\]\]?)")
_STRINGS = ('"""', "'''", '"', "'")


@dataclass(frozen=True, slots=True, kw_only=True)
class Block:
    """A piece of the text: ``name`` of its table, empty above the first; ``is_one_of_many``: its header has [[ ]]."""

    name: str
    text: str
    is_one_of_many: bool = False


def blocks_of(text: str) -> list[Block]:
    """Return the blocks of a text that is TOML; the first has no name and may be empty."""
    cuts: list[tuple[int, str, bool]] = [(0, "", False)]
    for at in _headers(text):
        match = _HEADER.match(text, at)
        assert match is not None, text[at:at + 80]
        brackets, name, ending = match.groups()
        name = name.strip("\"'")
        if ending == "." and name == cuts[-1][1]:
            continue
        cuts.append((_with_comment(text, at, at_least=cuts[-1][0]), name, brackets == "[[" and ending != "."))
    ends = [cut[0] for cut in cuts[1:]] + [len(text)]
    return [Block(name=name, text=text[begin:end], is_one_of_many=many)
            for (begin, name, many), end in zip(cuts, ends, strict=True)]


def text_of(blocks: list[Block]) -> str:
    """Return the text; where a block does not end with a line's end, or a new one follows without a gap, both come."""
    out = ""
    for block in blocks:
        if out and block.text and not out.endswith("\n"):
            out += "\n"
        out += block.text
    return out


def _with_comment(text: str, at: int, *, at_least: int) -> int:
    """Return where the comment right above a header begins; what stands at the top of the file is about the file."""
    begin = at
    while begin > at_least:
        above = text.rfind("\n", 0, begin - 1) + 1
        if not text[above:begin].lstrip(" \t").startswith("#"):
            break
        begin = above
    return at if begin == 0 else begin


def _headers(text: str) -> list[int]:
    """Return where the lines begin that are headers: not those within strings or arrays."""
    found, at, depth, is_fresh, line = [], 0, 0, True, 0
    while at < len(text):
        char = text[at]
        if char == "\n":
            is_fresh, line = True, at + 1
        elif char == "#":
            at = _end(text, "\n", at)
            continue
        elif char in "\"'":
            mark = next(m for m in _STRINGS if text.startswith(m, at))
            at = _closed(text, mark, at + len(mark))
            is_fresh = False
            continue
        elif char == "[" and is_fresh and depth == 0:
            found.append(line)
            at = _end(text, "\n", at)
            continue
        elif char in "[{":
            depth += 1
        elif char in "]}":
            depth -= 1
        if char not in " \t\n":
            is_fresh = False
        at += 1
    return found


def _end(text: str, mark: str, at: int) -> int:
    found = text.find(mark, at)
    return len(text) if found < 0 else found


def _closed(text: str, mark: str, at: int) -> int:
    """Return where a string ends that has begun before ``at``; of three quotes up to five may end it."""
    while at < len(text):
        if mark[0] == '"' and text[at] == "\\":
            at += 2
        elif text.startswith(mark, at):
            at += len(mark)
            while len(mark) == 3 and at < len(text) and text[at] == mark[0]:
                at += 1
            return at
        else:
            at += 1
    return at
