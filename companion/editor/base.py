"""The base: a mission file and its area's files as they were read, which a sketch is drawn upon."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from companion.editor.ground import Ground, NotEditable, ground_of
from companion.editor.sketch import MOST_VERTICES, Sketch, Zone, sketched
from companion.errors import InputError, unreadable
from companion.geofence import Document, ZoneKind
from companion.geofence.formats import decode, parse, read_bytes
from companion.geofence.mission import AreaOptions, MissionOptions, WindOptions, parse_options

EMPTY = ""           # the text of a file that is not there yet
_DIGITS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A file's content as text, and how it is written back: what is not changed is the same bytes."""

    text: str
    mark: bytes = b""        # a byte order mark
    line_end: str = "\n"

    def data(self, text: str) -> bytes:
        """Return another text as this file would have it."""
        return self.mark + (text if self.line_end == "\n" else text.replace("\n", self.line_end)).encode()


@dataclass(frozen=True, slots=True, kw_only=True)
class Locked:
    """A file of the area that is shown and not edited: why, and what is in it."""

    name: str
    why: str
    document: Document


@dataclass(frozen=True, slots=True, kw_only=True)
class Base:
    """What was read. ``data`` holds the bytes of each file that is there; ``order`` the area's files as named."""

    path: Path
    data: Mapping[Path, bytes]
    toml: Text
    options: MissionOptions
    grounds: Mapping[str, Ground] = field(default_factory=dict)
    texts: Mapping[str, Text] = field(default_factory=dict)
    locked: tuple[Locked, ...] = ()

    @property
    def is_new(self) -> bool:
        """Whether there is no file yet."""
        return self.path not in self.data

    @property
    def revision(self) -> str:
        """The name of what was read: another where a byte is another."""
        digest = hashlib.sha256()
        for path in sorted(self.data):
            digest.update(f"{path}\0{len(self.data[path])}\0".encode() + self.data[path])
        return digest.hexdigest()[:_DIGITS]

    def sketch(self) -> Sketch:
        """Return what is drawn of it."""
        return sketched(self.options, [s for g in self.grounds.values() for s in g.shapes], self.revision)


def _empty() -> MissionOptions:
    """Return a mission with nothing in it but the margin that the doctor will find enough."""
    from companion.boat import AutopilotLimits, Boat, ardurover_sitl, proposed_margin

    boat = Boat(polar=ardurover_sitl())
    proposed = proposed_margin(
        AutopilotLimits(), speed_mps=boat.polar.max_speed_mps(WindOptions().preview_speed_mps), hull=boat.hull)
    return MissionOptions(area=AreaOptions(margin_m=proposed.margin_m, margin_floor_m=proposed.floor_m))


def text_of(data: bytes, source: str) -> Text:
    """Return the text of a file's bytes. Raises InputError for what is none."""
    text = decode(data, source)
    line_end = "\r\n" if b"\r\n" in data else "\n"
    mark = b"\xef\xbb\xbf" if data.startswith(b"\xef\xbb\xbf") else b""
    return Text(text=text, mark=mark, line_end=line_end)


def read_base(path: Path) -> Base:
    """Read a mission file with its area's files, or begin an empty one where there is none.

    Raises:
        InputError: it, or a file that it names, cannot be read.
    """
    path = path.absolute()
    if path.is_symlink():
        path = path.resolve()
    if not path.exists():
        if not path.parent.is_dir():
            raise InputError(str(path), "", "its folder is not there", "make the folder first")
        return Base(path=path, data={}, toml=Text(text=EMPTY), options=_empty())
    data = {path: read_bytes(path)}
    toml = text_of(data[path], str(path))
    options = parse_options(toml.text, str(path))
    if options.from_autopilot:
        raise InputError(str(path), "from_autopilot", "the goals of this mission are drawn on the autopilot, not here",
                         "draw them in a ground station and upload them")
    grounds: dict[str, Ground] = {}
    texts: dict[str, Text] = {}
    locked: list[Locked] = []
    for name, stands_for in area_files(options):
        where = path.parent / name
        if name in grounds or any(other.name == name for other in locked):
            raise InputError(str(path), f"[area] {name}", "is named twice", "name it once")
        try:
            data[where] = read_bytes(where)
        except InputError as error:
            if isinstance(error.__context__, OSError):
                raise unreadable(str(path), error.__context__, f"[area] {where}",
                                 "paths are relative to the mission file") from None
            raise
        texts[name] = text = Text(text="") if data[where].startswith(b"PK") else text_of(data[where], str(where))
        document = parse(data[where], str(where), kind=ZoneKind(stands_for), axis=options.area.axis, areas=True,
                         extension=where.suffix.lower())
        why = _locked_because(name, where, path, options) or (
            "" if text.data(text.text) == data[where] else "is not written in UTF-8 throughout: shown, not edited")
        try:
            if not why:
                grounds[name] = ground_of(name, text.text, document.format, stands_for)
                _within_bounds(grounds)
        except NotEditable as reason:
            grounds.pop(name, None)
            why = str(reason)
        if why:
            locked.append(Locked(name=name, why=why, document=document))
    return Base(path=path, data=data, toml=toml, options=options, grounds=grounds, texts=texts, locked=tuple(locked))


def area_files(options: MissionOptions) -> list[tuple[str, Zone]]:
    """Return the names of the area's files, and what a geometry in each is that does not say so."""
    files: list[tuple[str, Zone]] = [(name, "exclusion") for name in options.area.obstacles]
    return [*files, (options.area.fence, "inclusion")] if options.area.fence is not None else files


def _locked_because(name: str, where: Path, path: Path, options: MissionOptions) -> str:
    """Return why a file of the area is not edited whatever is in it, empty: it is."""
    if where.is_symlink():
        return "is a link to another file: shown, not edited"
    if not where.absolute().is_relative_to(path.parent) or ".." in Path(name).parts:
        return "lies outside of the mission's folder: shown, not edited"
    if options.area.axis == "latlon":
        return 'has latitude first (axis = "latlon"): shown, not edited'
    return ""


def _within_bounds(grounds: Mapping[str, Ground]) -> None:
    vertices = sum(len(ring) for g in grounds.values() for shape in g.shapes for ring in shape.rings)
    if vertices > MOST_VERTICES:
        raise NotEditable(f"and the others have more than {MOST_VERTICES} vertices: shown, not edited")
