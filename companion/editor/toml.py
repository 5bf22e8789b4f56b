"""A mission file with other options: what was not changed stays as it stands, byte for byte, comments included.

A block is a header, the comment right above it, and all up to the next block; tables inside a table belong to it
(``[goal.port_mark]`` to its ``[[goal]]``). The blocks' texts, one after another, are the text.
"""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import msgspec

from companion.errors import JobError
from companion.geofence.mission import TABLE_ORDER, MissionOptions, parse_options, without_defaults

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
        assert match is not None, text[at : at + 80]
        brackets, name, ending = match.groups()
        name = name.strip("\"'")
        if ending == "." and name == cuts[-1][1]:
            continue
        cuts.append((_with_comment(text, at, at_least=cuts[-1][0]), name, brackets == "[[" and ending != "."))
    ends = [cut[0] for cut in cuts[1:]] + [len(text)]
    return [
        Block(name=name, text=text[begin:end], is_one_of_many=many)
        for (begin, name, many), end in zip(cuts, ends, strict=True)
    ]


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


LISTS = ("goal", "refuge")
Keys = Sequence[int | None]


def rewritten(
    text: str, before: MissionOptions, after: MissionOptions, keys: Mapping[str, Keys], source: str = ""
) -> str:
    """Return the mission file ``text``, which says ``before``, so that it says ``after``.

    ``keys``: for ``goal`` and ``refuge``, of each entry of ``after`` its number in ``before`` (from 0), None: new.

    A table of one kind keeps what it says of keys that did not change, and its comments.

    Raises:
        JobError: the text cannot be changed in place.
    """
    blocks = blocks_of(text)
    for name in LISTS:
        blocks = _listed(blocks, name, getattr(before, name), getattr(after, name), keys[name])
    for field in MissionOptions.__struct_fields__:
        old, new = getattr(before, field), getattr(after, field)
        if old == new or field in LISTS:
            continue
        if isinstance(new, msgspec.Struct) and isinstance(old, msgspec.Struct):
            blocks = _in_table(blocks, field, _changes(old, new))
        elif isinstance(new, msgspec.Struct):
            blocks = _inserted(blocks, made(field, new))
        elif isinstance(old, msgspec.Struct):
            blocks = _without(blocks, field)
        else:
            blocks = _in_table(blocks, "", {field: new})
    out = text_of(blocks)
    if parse_options(out, source) != after:
        raise JobError(f"{source}: is written in a way that cannot be changed in place; change it by hand")
    return out


def _changes(old: msgspec.Struct, new: msgspec.Struct) -> dict[str, Any]:
    """Return the keys that differ with their new values; None: the key goes."""
    return {field: getattr(new, field) for field in new.__struct_fields__ if getattr(old, field) != getattr(new, field)}


def _edited(text: str, table: str, changes: Mapping[str, Any], *, is_one_of_many: bool = False) -> str:
    """Return the text of a block with other values; ``table`` is empty for the keys above all tables."""
    import tomlkit

    document = tomlkit.parse(text)
    place: Any = document
    if table:
        place = document[table]
        place = place[0] if is_one_of_many else place
    for key, value in changes.items():
        if isinstance(value, msgspec.Struct):
            for inner, number in _plain(value).items():
                place[key][inner] = number
        elif value is None or value == ():
            place.remove(key)
        elif not (isinstance(value, tuple) and key in place and _fits(place[key], value)):
            place[key] = _value(value)
    return tomlkit.dumps(document)


def _fits(array: Any, wanted: tuple[Any, ...]) -> bool:
    """Make an array what is wanted where entries only go or come at its end: its other lines stay as they are."""
    kept = [entry for entry in array if entry in wanted]
    if tuple(kept) != wanted[: len(kept)] or len(set(kept)) != len(kept):
        return False
    for n in reversed(range(len(array))):
        if array[n] not in wanted:
            array.pop(n)
    for entry in wanted[len(kept) :]:
        array.append(entry)
    return True


def _plain(struct: msgspec.Struct) -> dict[str, Any]:
    return {field: getattr(struct, field) for field in struct.__struct_fields__}


def _in_table(blocks: list[Block], table: str, changes: Mapping[str, Any]) -> list[Block]:
    """Return the blocks with keys of a table changed, wherever it stands; a table that is not there is made."""
    import tomlkit

    index = next((n for n, b in enumerate(blocks) if b.name == table), None)
    if index is None and table in tomlkit.parse(blocks[0].text):
        index = 0
    if index is not None:
        block = blocks[index]
        text = _edited(block.text, table, changes)
        return [*blocks[:index], _with_text(block, text), *blocks[index + 1 :]]
    body = "".join(
        f"{key} = {tomlkit.item(_value(value)).as_string()}\n" for key, value in changes.items() if value is not None
    )
    return _inserted(blocks, Block(name=table, text=f"[{table}]\n{body}"))


def _value(value: Any) -> Any:
    return list(value) if isinstance(value, tuple) else value


def _with_text(block: Block, text: str) -> Block:

    return Block(name=block.name, text=text, is_one_of_many=block.is_one_of_many)


def _without(blocks: list[Block], table: str) -> list[Block]:
    import tomlkit

    kept = [b for b in blocks if b.name != table]
    document = tomlkit.parse(kept[0].text)
    if table in document:
        document.remove(table)
        kept[0] = _with_text(kept[0], tomlkit.dumps(document))
    return kept


def _inserted(blocks: list[Block], *new: Block, at: int | None = None) -> list[Block]:
    """Return the blocks with new ones of one name, parted by empty lines from what is before and behind."""
    if at is None:
        # before the first of those that are written behind it
        rank = _rank(new[0].name)
        at = next((n for n, b in enumerate(blocks) if b.name and _rank(b.name) > rank), len(blocks))
    spaced = []
    before = text_of(blocks[:at])
    for block in new:
        gap = "" if not before or before.endswith("\n\n") else "\n" if before.endswith("\n") else "\n\n"
        before = gap + block.text
        spaced.append(_with_text(block, before))
    if at < len(blocks) and not spaced[-1].text.endswith("\n\n"):
        spaced[-1] = _with_text(spaced[-1], spaced[-1].text + "\n")
    return [*blocks[:at], *spaced, *blocks[at:]]


def _rank(name: str) -> int:
    return TABLE_ORDER.index(name) if name in TABLE_ORDER else len(TABLE_ORDER)


def _listed(
    blocks: list[Block], name: str, before: Sequence[msgspec.Struct], after: Sequence[msgspec.Struct], keys: Keys
) -> list[Block]:
    """Return the blocks with the entries of a list in their new order, changed, added and taken out."""
    if tuple(before) == tuple(after) and list(keys) == list(range(len(before))):
        return blocks
    places = [n for n, b in enumerate(blocks) if b.name == name]
    if before and len(places) != len(before):  # an array in one line: written as tables
        blocks = _without(blocks, name)
        return _inserted(blocks, *(made(name, entry, is_one_of_many=True) for entry in after)) if after else blocks
    entries = []
    for entry, key in zip(after, keys, strict=True):
        if key is None or type(entry) is not type(before[key]):  # a goal of another kind is written anew
            entries.append(made(name, entry, is_one_of_many=True))
        else:
            block, changes = blocks[places[key]], _changes(before[key], entry)
            entries.append(
                _with_text(block, _edited(block.text, name, changes, is_one_of_many=True)) if changes else block
            )
    if list(keys) == list(range(len(before))):
        out = list(blocks)
        for n, block in zip(places, entries, strict=True):
            out[n] = block
        return out
    rest = [b for b in blocks if b.name != name]
    if not entries:
        return rest
    at = sum(1 for b in blocks[: places[0]] if b.name != name) if places else None
    return _inserted(rest, *entries, at=at)


def made(name: str, entry: msgspec.Struct, *, is_one_of_many: bool = False) -> Block:
    """Return the block of a new table, what is in it in one line each; what has its default is left out."""
    import tomlkit

    lines = [f"[[{name}]]" if is_one_of_many else f"[{name}]"]
    for key, value in without_defaults(entry).items():
        item: Any = value
        if isinstance(value, dict):
            item = tomlkit.inline_table()
            item.update(value)
        lines.append(f"{key} = {tomlkit.item(item).as_string()}")
    return Block(name=name, text="\n".join(lines) + "\n", is_one_of_many=is_one_of_many)
