"""A layered drawing: boxes on floors, arrows that run down only, as an SVG that depends on nothing but its input.

The usual steps (Sugiyama): a long arrow gets a slot on every floor that it passes, the boxes of a floor are ordered by
where their neighbours are, and places are the least squares towards the neighbours under that order and the room each
box needs.
"""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise

NAME_PX, TEXT_PX = 13.0, 10.5  # sizes of type
CHARACTER = 0.52  # mean width of a character, as a share of its size
PAD, GAP_X, GAP_Y = 8.0, 10.0, 34.0  # inside a box, between boxes of a floor, between floors [px]
SLOT_PX = 4.0  # what an arrow takes where it passes a floor
SWEEPS = 24  # the drawings here stand still after a dozen


@dataclass(frozen=True, slots=True, kw_only=True)
class Chip:
    """A small box inside a box, with words that show under the mouse."""

    name: str
    words: str
    kind: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Box:
    """A room: its name, what it is for, what is in it; ``kind`` is a class of the style sheet."""

    name: str
    words: str
    kind: str
    chips: tuple[Chip, ...] = ()

    @property
    def width_px(self) -> float:
        """As wide as its words want in about four lines, and no narrower than its name or its widest chip."""
        lines = len(self.words) / 4.0 * TEXT_PX * CHARACTER
        rows = 1 + len(self.chips) // 4
        chips = sum(map(_chip_px, self.chips)) / rows * (1.0 if rows == 1 else 1.2) + 4.0 * len(self.chips)
        return round(max(104.0, len(self.name) * NAME_PX * 0.62, lines, chips) + 2.0 * PAD)

    @property
    def lines(self) -> list[str]:
        """Its words, broken."""
        return textwrap.wrap(self.words, max(12, int((self.width_px - 2.0 * PAD) / (TEXT_PX * CHARACTER))))

    @property
    def chip_rows(self) -> list[list[Chip]]:
        """Its chips, row by row."""
        rows: list[list[Chip]] = []
        left = 0.0
        for chip in self.chips:
            if not rows or _chip_px(chip) > left:
                rows.append([])
                left = self.width_px - 2.0 * PAD
            rows[-1].append(chip)
            left -= _chip_px(chip) + 4.0
        return rows

    @property
    def height_px(self) -> float:
        """As high as what is written in it."""
        return 2.0 * PAD + NAME_PX + 13.0 * len(self.lines) + 20.0 * len(self.chip_rows)


def _chip_px(chip: Chip) -> float:
    return len(chip.name) * TEXT_PX * 0.56 + 12.0


@dataclass(slots=True)
class _Slot:
    """A place on a floor: a box, or where an arrow passes."""

    floor: int
    width: float
    box: Box | None = None
    x: float = 0.0
    rank: float = 0.0


@dataclass(frozen=True, slots=True)
class Drawing:
    """SVG elements in a frame of ``width_px`` by ``height_px``."""

    elements: tuple[str, ...]
    width_px: float
    height_px: float


def implied(edges: Mapping[str, Iterable[str]]) -> set[tuple[str, str]]:
    """Return the edges that a longer way implies (the rest is the transitive reduction).

    Raises:
        ValueError: the edges run in a circle.
    """
    below: dict[str, set[str]] = {}

    def reach(name: str, way: tuple[str, ...]) -> set[str]:
        if name in way:
            raise ValueError("a circle: " + " -> ".join((*way[way.index(name) :], name)))
        if name not in below:
            below[name] = {far for near in edges.get(name, ()) for far in {near} | reach(near, (*way, name))}
        return below[name]

    for name in edges:
        reach(name, ())
    return {(a, c) for a in edges for c in edges[a] if any(c in below[b] for b in edges[a])}


def draw(floors: Sequence[Sequence[Box]], edges: Iterable[tuple[str, str]]) -> Drawing:
    """Draw boxes on floors, top first, and an arrow for each edge (from a higher floor to a lower one)."""
    slots, ways = _slots(floors, edges)
    _order(slots, ways)
    _place(slots, ways)
    left = min(slot.x - slot.width / 2.0 for slot in slots)
    right = max(slot.x + slot.width / 2.0 for slot in slots)
    heights = [max(box.height_px for box in floor) for floor in floors]
    tops = [sum(heights[:i]) + GAP_Y * i for i in range(len(floors))]
    lines = [_arrow([(slot, tops[slot.floor], heights[slot.floor]) for slot in way], left) for way in ways]
    boxes = [
        _box(slot.box, slot.x - left, tops[slot.floor] + (heights[slot.floor] - slot.box.height_px) / 2.0)
        for slot in slots
        if slot.box is not None
    ]
    return Drawing((*lines, *boxes), right - left, tops[-1] + heights[-1])


def _slots(floors: Sequence[Sequence[Box]], edges: Iterable[tuple[str, str]]) -> tuple[list[_Slot], list[list[_Slot]]]:
    of = {box.name: _Slot(i, box.width_px, box) for i, floor in enumerate(floors) for box in floor}
    slots = list(of.values())
    ways = []
    for above, below in sorted(edges):
        passing = [_Slot(i, SLOT_PX) for i in range(of[above].floor + 1, of[below].floor)]
        slots += passing
        ways.append([of[above], *passing, of[below]])
    return slots, ways


def _neighbours(ways: list[list[_Slot]]) -> dict[int, list[_Slot]]:
    near: dict[int, list[_Slot]] = {}
    for way in ways:
        for a, b in pairwise(way):
            near.setdefault(id(a), []).append(b)
            near.setdefault(id(b), []).append(a)
    return near


def _by_floor(slots: list[_Slot]) -> list[list[_Slot]]:
    rows: list[list[_Slot]] = [[] for _ in range(1 + max(slot.floor for slot in slots))]
    for slot in slots:
        rows[slot.floor].append(slot)
    return rows


def _order(slots: list[_Slot], ways: list[list[_Slot]]) -> None:
    near, rows = _neighbours(ways), _by_floor(slots)
    for row in rows:
        for i, slot in enumerate(row):
            slot.rank = (i + 0.5) / len(row)
    for sweep in range(SWEEPS):
        step = 1 if sweep % 2 == 0 else -1
        for row in rows[::step]:
            for slot in row:
                seen = [n.rank for n in near.get(id(slot), ()) if (slot.floor - n.floor) * step > 0]
                slot.rank = sum(seen) / len(seen) if seen else slot.rank
            row.sort(key=lambda slot: slot.rank)
            for i, slot in enumerate(row):
                slot.rank = (i + 0.5) / len(row)


def _place(slots: list[_Slot], ways: list[list[_Slot]]) -> None:
    near, rows = _neighbours(ways), _by_floor(slots)
    for row in rows:
        row.sort(key=lambda slot: slot.rank)
    for sweep in range(4 * SWEEPS):
        for row in rows if sweep % 2 == 0 else rows[::-1]:
            wanted = [sum(n.x for n in seen) / len(seen) if (seen := near.get(id(slot))) else slot.x for slot in row]
            for slot, x in zip(row, _apart(wanted, row), strict=True):
                slot.x = x


def _apart(wanted: list[float], row: list[_Slot]) -> list[float]:
    """Return the places nearest to the wanted ones (least squares) at which nothing overlaps, in the same order."""
    offsets, x = [], 0.0
    for i, slot in enumerate(row):
        x += (row[i - 1].width + slot.width) / 2.0 + GAP_X if i else 0.0
        offsets.append(x)
    pools: list[list[float]] = []  # sum, count: neighbours that push each other share one mean
    for want, offset in zip(wanted, offsets, strict=True):
        pools.append([want - offset, 1.0])
        while len(pools) > 1 and pools[-2][0] / pools[-2][1] >= pools[-1][0] / pools[-1][1]:
            total, count = pools.pop()
            pools[-1][0] += total
            pools[-1][1] += count
    means = [total / count for total, count in pools for _ in range(int(count))]
    return [mean + offset for mean, offset in zip(means, offsets, strict=True)]


def _arrow(way: list[tuple[_Slot, float, float]], left: float) -> str:
    (first, top, height), *rest = way
    x, y = first.x - left, top + (height + first.box.height_px) / 2.0 if first.box else top + height
    path = [f"M{x:.0f} {y:.0f}"]
    for slot, top, height in rest:
        to_x = slot.x - left
        to_y = top + (height - slot.box.height_px) / 2.0 - 3.0 if slot.box else top
        bend = (to_y - y) / 2.0
        path.append(f"C{x:.0f} {y + bend:.0f} {to_x:.0f} {to_y - bend:.0f} {to_x:.0f} {to_y:.0f}")
        x, y = to_x, to_y
        if slot.box is None:
            y += height
            path.append(f"V{y:.0f}")
    return f'<path class="arrow" d="{"".join(path)}"/>'


def _box(box: Box, x: float, y: float) -> str:
    left, width, height = x - box.width_px / 2.0, box.width_px, box.height_px
    parts = [f'<rect class="box {box.kind}" x="{left:.0f}" y="{y:.0f}" width="{width:.0f}" height="{height:.0f}"/>']
    y += PAD + NAME_PX - 2.0
    parts.append(f'<text class="name" x="{x:.0f}" y="{y:.0f}">{escape(box.name)}</text>')
    for line in box.lines:
        y += 13.0
        parts.append(f'<text class="words" x="{x:.0f}" y="{y:.0f}">{escape(line)}</text>')
    for row in box.chip_rows:
        at = x - (sum(map(_chip_px, row)) + 4.0 * (len(row) - 1)) / 2.0
        for chip in row:
            wide = _chip_px(chip)
            parts.append(
                f"<g><title>{escape(chip.words)}</title>"
                f'<rect class="chip {chip.kind}" x="{at:.0f}" y="{y + 7.0:.0f}" width="{wide:.0f}" height="16"/>'
                f'<text class="words" x="{at + wide / 2.0:.0f}" y="{y + 18.5:.0f}">{escape(chip.name)}</text></g>'
            )
            at += wide + 4.0
        y += 20.0
    return "".join(parts)
