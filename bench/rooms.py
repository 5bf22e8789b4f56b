"""The rooms, drawn and listed as the code has them: ``python -m bench.rooms`` (make figures).

docs/figures/rooms-*.svg and the list in docs/architecture.md are made of three things that cannot lie: the imports
(grimp, which import-linter reads too), the purity that import-linter holds (pyproject.toml), and the first line of each
package. A test checks that they are current.
"""

from __future__ import annotations

import ast
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import grimp

from bench.layered import Box, Chip, draw, implied

ROOT = Path(__file__).resolve().parents[1]
PICTURES = {root: ROOT / "docs" / "figures" / f"rooms-{root}.svg" for root in ("companion", "sitl", "lab", "sailbench")}
PAGE = ROOT / "docs" / "architecture.md"
BEGIN, END = "<!-- rooms: made by python -m bench.rooms -->\n", "<!-- end of rooms -->\n"

STYLE = """
text{font-family:system-ui,-apple-system,"Segoe UI","DejaVu Sans",sans-serif;text-anchor:middle;fill:#1b2a38}
.name{font-size:13px;font-weight:600}.words{font-size:10.5px}
.note{font-size:11.5px;text-anchor:start}
.box{stroke:#33566f;stroke-width:1.2;rx:5}.chip{stroke:#33566f;stroke-width:.7;rx:3}
.pure{fill:#dcecf5}.shell{fill:#fbf3e0}.arrow{fill:none;stroke:#7c8d9a;stroke-width:1.1;marker-end:url(#head)}
.paper{fill:#fff}
"""
HEAD = (
    '<defs><marker id="head" viewBox="0 0 8 8" refX="6" refY="4" markerWidth="7" markerHeight="7" orient="auto">'
    '<path d="M0 0L8 4L0 8z" fill="#7c8d9a"/></marker></defs>'
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Laws:
    """What import-linter holds: rooms floor by floor, who owns no clock, socket or file, and the exceptions."""

    floors: tuple[tuple[str, ...], ...]
    pure: frozenset[str]
    shells: frozenset[str]

    def kind(self, module: str) -> str:
        """Whether a module is held pure: ``pure`` or ``shell``."""
        return "pure" if module not in self.shells and _upwards(module) & self.pure else "shell"


def laws() -> Laws:
    """Read them from pyproject.toml."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    layers = next(c["layers"] for c in contracts if c["type"] == "layers" and "companion.cli" in c["layers"])
    purity = next(c for c in contracts if c["type"] == "forbidden" and "socket" in c["forbidden_modules"])
    return Laws(
        floors=tuple(tuple(name.strip() for name in floor.split("|")) for floor in layers),
        pure=frozenset(purity["source_modules"]),
        shells=frozenset(line.split(" -> ")[0] for line in purity["ignore_imports"]),
    )


def _upwards(module: str) -> set[str]:
    parts = module.split(".")
    return {".".join(parts[:i]) for i in range(1, len(parts) + 1)}


@cache
def first_line(module: str) -> str:
    """Return the first line of a module's docstring, its literals in single backticks."""
    path = ROOT.joinpath(*module.split("."))
    file = path / "__init__.py" if path.is_dir() else path.with_suffix(".py")
    return (ast.get_docstring(ast.parse(file.read_text())) or "").splitlines()[0].replace("``", "`")


def inner(room: str) -> list[str]:
    """Name the packages inside a room."""
    return [f"{room}.{file.parent.name}" for file in sorted(ROOT.joinpath(*room.split(".")).glob("*/__init__.py"))]


def imports(root: str) -> dict[str, set[str]]:
    """Return which rooms of a root package import which others of it."""
    graph = grimp.build_graph(root, cache_dir=None)
    edges: dict[str, set[str]] = {}
    for module in sorted(graph.modules - {root}):
        for other in graph.find_modules_directly_imported_by(module) - {root}:
            here, there = (".".join(name.split(".")[:2]) for name in (module, other))
            if here != there:
                edges.setdefault(here, set()).add(there)
    return edges


def ranked(edges: dict[str, set[str]], rooms: list[str]) -> list[tuple[str, ...]]:
    """Return the floors that the imports ask for, top first: as low as what a room imports lets it be.

    What nobody imports (the command lines) is at the top.
    """
    level: dict[str, int] = {}

    def depth(room: str) -> int:
        if room not in level:
            level[room] = 1 + max((depth(below) for below in edges.get(room, ())), default=-1)
        return level[room]

    top = max(map(depth, rooms))
    imported = set().union(*edges.values())
    at = {room: depth(room) if room in imported else top for room in rooms}
    return [tuple(room for room in rooms if at[room] == i) for i in range(top, -1, -1)]


def _room(room: str, held: Laws) -> Box:
    apart = [shell for shell in sorted(held.shells) if shell.startswith(room + ".")]
    chips = [
        Chip(name=name.split(".")[-1], words=first_line(name), kind=held.kind(name)) for name in inner(room) + apart
    ]
    words = first_line(room).replace("`", "").rstrip(".")
    return Box(name=room.split(".")[1], words=words, kind=held.kind(room), chips=tuple(chips))


def picture(root: str) -> str:
    """Return the SVG of the rooms of a root package."""
    held, edges = laws(), imports(root)
    left_out = implied(edges)
    arrows = [(a.split(".")[1], b.split(".")[1]) for a in edges for b in edges[a] if (a, b) not in left_out]
    drawing = draw([[_room(room, held) for room in floor] for floor in ranked(edges, rooms(root))], arrows)
    margin, below = 14.0, 40.0
    width, height = max(drawing.width_px, 600.0) + 2 * margin, drawing.height_px + 2 * margin + below
    return "\n".join(
        [
            (
                f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
                f'role="img" aria-label="The rooms of {root}, floor above floor, and the imports between them">'
            ),
            f"<style>{STYLE}</style>",
            HEAD,
            f'<rect class="paper" width="{width:.0f}" height="{height:.0f}"/>',
            f'<g transform="translate({(width - drawing.width_px) / 2.0:.0f} {margin:.0f})">',
            *drawing.elements,
            "</g>",
            *_legend(margin, height - 26.0),
            "</svg>\n",
        ]
    )


def rooms(root: str) -> list[str]:
    """Name the rooms of a root package: what stands directly inside it."""
    found = [
        path.stem if path.suffix else path.name
        for path in sorted((ROOT / root).iterdir())
        if (path.suffix == ".py" and path.stem != "__init__") or (path / "__init__.py").exists()
    ]
    return [f"{root}.{name}" for name in found]


def _legend(x: float, y: float) -> list[str]:
    return [
        f'<rect class="chip pure" x="{x:.0f}" y="{y:.0f}" width="22" height="14"/>',
        f'<text class="note" x="{x + 28:.0f}" y="{y + 11:.0f}">pure: no clock, socket, file, thread</text>',
        f'<rect class="chip shell" x="{x + 238:.0f}" y="{y:.0f}" width="22" height="14"/>',
        f'<text class="note" x="{x + 266:.0f}" y="{y + 11:.0f}">shell</text>',
        f'<path class="arrow" d="M{x + 318:.0f} {y + 7:.0f}h20"/>',
        f'<text class="note" x="{x + 346:.0f}" y="{y + 11:.0f}">imports, less what a longer way implies</text>',
    ]


def listing() -> str:
    """Return the list of rooms in docs/architecture.md."""
    held = laws()
    rows = [*(room for floor in held.floors for room in floor), *rooms("sitl"), *rooms("lab"), *rooms("sailbench")]
    lines = ["| room | what it owns | pure |\n|---|---|---|\n"]
    for room in rows:
        lines.append(f"| **`{room}`** | {first_line(room)} | {_purity(room, held)} |\n")
        for name in inner(room):
            lines.append(f"| &emsp;`{name.split('.')[-1]}` | {first_line(name)} | {_purity(name, held)} |\n")
    return "".join(lines)


def _purity(room: str, held: Laws) -> str:
    if held.kind(room) == "shell":
        return ""
    apart = [f"`{shell.split('.')[-1]}`" for shell in sorted(held.shells) if shell.startswith(room + ".")]
    return "all but " + ", ".join(apart) if apart else "yes"


def page(text: str) -> str:
    """Return docs/architecture.md with its list of rooms as the code has it."""
    before, _, rest = text.partition(BEGIN)
    return before + BEGIN + "\n" + listing() + "\n" + END + rest.partition(END)[2]


if __name__ == "__main__":
    for root, file in PICTURES.items():
        file.write_text(picture(root))
    PAGE.write_text(page(PAGE.read_text()))
