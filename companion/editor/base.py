"""The base: a mission file and its area's files as they were read, which a sketch is drawn upon."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from companion.editor.sketch import MOST_VERTICES, Place, Ring, Shape, Sketch, Zone, number, sketched
from companion.errors import InputError, unreadable
from companion.geofence import Document, ZoneKind
from companion.geofence.formats import decode, drawings_of, parse, read_bytes
from companion.geofence.mission import AreaOptions, MissionOptions, WindOptions, parse_options

KINDS = ("wkt", "geojson")  # of files that are edited; those of other programs are shown
_SINGLE = {"Polygon": "polygon", "Point": "point", "LineString": "line"}
_NO_NAME = re.compile(r"[|()#\s]+")  # what ends a name in a WKT file
_GEOMETRY = {"polygon": "Polygon", "point": "Point", "circle": "Point", "line": "LineString"}


@dataclass(frozen=True, slots=True, kw_only=True)
class Piece:
    """A stretch of a file's text, [begin, end), and the numbers of the shapes that it holds."""

    begin: int
    end: int
    shapes: tuple[int, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Ground:
    """An area file that can be edited. ``stands_for`` is what a geometry that does not say so is."""

    name: str
    kind: str
    text: str
    stands_for: Zone
    pieces: tuple[Piece, ...] = ()
    shapes: tuple[Shape, ...] = ()


class NotEditable(Exception):  # noqa: N818
    """A file is shown and not edited; the text says why."""


def new_ground(name: str, stands_for: Zone) -> Ground:
    """Return a file that is not there yet."""
    if name.endswith(".wkt"):
        return Ground(
            name=name, kind="wkt", text="# name|kind|WKT, longitude before latitude (WGS 84)\n", stands_for=stands_for
        )
    return Ground(
        name=name, kind="geojson", text='{"type": "FeatureCollection", "features": []}\n', stands_for=stands_for
    )


def ground_of(name: str, text: str, kind: str, stands_for: Zone) -> Ground:
    """Return an area file in its pieces. ``kind``: its format.

    Raises:
        NotEditable: it is in a format, or holds something, that is not drawn here.
        InputError: it is no file of its kind at all.
    """
    if kind not in KINDS:
        raise NotEditable(f"is a {kind} file: edit it where it was drawn, or convert it: companion fence convert")
    ground = (_wkt if kind == "wkt" else _geojson)(name, text, stands_for)
    if sum(len(ring) for shape in ground.shapes for ring in shape.rings) > MOST_VERTICES:
        raise NotEditable(f"has more than {MOST_VERTICES} vertices: shown, not edited")
    return ground


def can_hold(kind: str, shape: Shape) -> bool:
    """Return whether a format has words for a shape: WKT has none for a radius or a margin."""
    return kind == "geojson" or (shape.type != "circle" and shape.margin_m is None)


def written(ground: Ground, shapes: Sequence[Shape]) -> str:
    """Return the file's text with these shapes in it: as they were by their keys, changed, or new."""
    kept = {shape.key: shape for shape in shapes if shape.key is not None}
    new = [shape for shape in shapes if shape.key is None]
    return (_written_wkt if ground.kind == "wkt" else _written_geojson)(ground, kept, new)


def _is_untouched(ground: Ground, piece: Piece, kept: dict[int, Shape]) -> bool:
    return all(n in kept and kept[n].content == ground.shapes[n].content for n in piece.shapes)


def _open(ring: Sequence[tuple[float, float]]) -> Ring:
    """Return a ring as (lat, lon) places without its last one where that is its first."""
    places: tuple[Place, ...] = tuple((y, x) for x, y in ring)
    return places[:-1] if len(places) > 1 and places[0] == places[-1] else places


# ------------------------------------------------------------------------------------------------------------ WKT
def _wkt(name: str, text: str, stands_for: Zone) -> Ground:
    lines = text.split("\n")
    begins = [0]
    for line in lines:
        begins.append(begins[-1] + len(line) + 1)
    pieces: list[Piece] = []
    shapes: list[Shape] = []
    for drawing in drawings_of(text, name):
        zone: Zone = stands_for if drawing.kind is None else drawing.kind.value
        first = len(shapes)
        for kind, body in drawing.geometries:
            if not isinstance(body, list) or not body or not all(body):
                raise NotEditable(f"line {drawing.line}: holds an empty geometry: correct it in the file")
            rings = tuple(_open(ring) for ring in body) if kind == "POLYGON" else (tuple((y, x) for x, y in body),)
            shapes.append(
                _valid(
                    Shape(
                        type="polygon" if kind == "POLYGON" else "point" if kind == "POINT" else "line",
                        zone=zone,
                        rings=rings,
                        name=drawing.name,
                        of=name,
                        key=len(shapes),
                    ),
                    f"line {drawing.line}",
                )
            )
        pieces.append(
            Piece(
                begin=begins[drawing.line - 1],
                end=min(begins[drawing.last], len(text)),
                shapes=tuple(range(first, len(shapes))),
            )
        )
    return Ground(name=name, kind="wkt", text=text, stands_for=stands_for, pieces=tuple(pieces), shapes=tuple(shapes))


def _written_wkt(ground: Ground, kept: dict[int, Shape], new: Sequence[Shape]) -> str:
    out, at = "", 0
    for piece in ground.pieces:
        out += ground.text[at : piece.begin]
        at = piece.end
        if _is_untouched(ground, piece, kept):
            out += ground.text[piece.begin : piece.end]
        else:
            out += "".join(wkt_line(kept[n]) for n in piece.shapes if n in kept)
    out += ground.text[at:]
    if new and out and not out.endswith("\n"):
        out += "\n"
    return out + "".join(wkt_line(shape) for shape in new)


def wkt_line(shape: Shape) -> str:
    """Return a shape as a line of a WKT file."""
    rings = [
        "("
        + ", ".join(
            f"{number(lon)} {number(lat)}" for lat, lon in ((*ring, *ring[:1]) if shape.type == "polygon" else ring)
        )
        + ")"
        for ring in shape.rings
    ]
    body = (
        f"POLYGON ({', '.join(rings)})"
        if shape.type == "polygon"
        else (f"{'POINT' if shape.type == 'point' else 'LINESTRING'} {rings[0]}")
    )
    name = _NO_NAME.sub(" ", shape.name).strip()
    return f"{name}|{shape.zone}|{body}\n"


# -------------------------------------------------------------------------------------------------------- GeoJSON
def _geojson(name: str, text: str, stands_for: Zone) -> Ground:
    try:
        root = msgspec.json.decode(text, type=dict[str, msgspec.Raw])
        features = msgspec.json.decode(root["features"], type=list[msgspec.Raw])
        is_collection = msgspec.json.decode(root["type"]) == "FeatureCollection"
    except (msgspec.DecodeError, msgspec.ValidationError, KeyError, RecursionError):
        is_collection, features = False, []
    if not is_collection:
        raise NotEditable("is GeoJSON, but no collection of features")
    at = _array(text, root["features"])[0]
    pieces: list[Piece] = []
    shapes: list[Shape] = []
    for raw in features:
        feature = bytes(raw).decode()
        begin = text.index(feature, at)
        at, first = begin + len(feature), len(shapes)
        shapes += _of_feature(json.loads(feature), name, len(shapes), stands_for)
        pieces.append(Piece(begin=begin, end=at, shapes=tuple(range(first, len(shapes)))))
    return Ground(
        name=name, kind="geojson", text=text, stands_for=stands_for, pieces=tuple(pieces), shapes=tuple(shapes)
    )


def _of_feature(feature: Any, name: str, first: int, stands_for: Zone) -> list[Shape]:
    """Return the shapes of a feature; none of one that says that it has another role. Raises NotEditable."""
    from companion.geofence.formats import KINDS as WORDS

    try:
        properties, geometry = feature.get("properties") or {}, feature["geometry"]
        if "role" in properties:
            return []
        kind, coordinates = geometry["type"], geometry["coordinates"]
        many = coordinates if kind.startswith("Multi") else [coordinates]
        single = _SINGLE[kind.removeprefix("Multi")]
        word = WORDS[str(properties.get("kind", "")).strip().lower()]
        zone: Zone = stands_for if word is None else word.value
        radius_m = properties.get("radius_m")
        out = []
        for n, body in enumerate(many):
            rings = (
                [_open([(p[0], p[1]) for p in ring]) for ring in body]
                if single == "polygon"
                else [tuple((p[1], p[0]) for p in ([body] if single == "point" else body))]
            )
            out.append(
                _valid(
                    msgspec.convert(
                        {
                            "type": "circle" if single == "point" and radius_m is not None else single,
                            "zone": zone,
                            "rings": rings,
                            "name": str(properties.get("name", "")),
                            "margin_m": properties.get("margin_m"),
                            "radius_m": radius_m if single == "point" else None,
                            "of": name,
                            "key": first + n,
                        },
                        Shape,
                    ),
                    f"feature {first + n + 1}",
                )
            )
    except (KeyError, TypeError, IndexError, AttributeError, ValueError) as error:
        if isinstance(error, InputError):
            raise
        raise NotEditable("holds a feature that is not drawn here: shown, not edited") from None
    return out


def _valid(shape: Shape, place: str) -> Shape:
    """Return the shape if every place of it is on the globe. Raises NotEditable."""
    for ring in shape.rings:
        if any(not (abs(lat) <= 90.0 and abs(lon) <= 180.0) for lat, lon in ring):
            raise NotEditable(f"{place}: has longitudes or latitudes beyond ±180 and ±90: shown, not edited")
    return shape


def _written_geojson(ground: Ground, kept: dict[int, Shape], new: Sequence[Shape]) -> str:
    features, is_same_count = [], not new
    for piece in ground.pieces:
        text = ground.text[piece.begin : piece.end]
        if _is_untouched(ground, piece, kept):
            features.append(text)
            continue
        left = [kept[n] for n in piece.shapes if n in kept]
        is_same_count = is_same_count and len(left) == 1
        features += [_feature(shape, json.loads(text)) for shape in left]
    features += [_feature(shape, {"type": "Feature", "properties": {}}) for shape in new]
    if is_same_count:
        out, at = "", 0
        for piece, feature in zip(ground.pieces, features, strict=True):
            out += ground.text[at : piece.begin] + feature
            at = piece.end
        return out + ground.text[at:]
    root = msgspec.json.decode(ground.text, type=dict[str, msgspec.Raw])
    begin, end = _array(ground.text, root["features"])
    return ground.text[:begin] + "[\n " + ",\n ".join(features) + "\n]" + ground.text[end:]


def _array(text: str, raw: msgspec.Raw) -> tuple[int, int]:
    """Return where the array of the features begins and ends in a text."""
    array = bytes(raw).decode()
    begin = next(m.end() for m in re.finditer(r'"features"\s*:\s*', text) if text.startswith(array, m.end()))
    return begin, begin + len(array)


def _feature(shape: Shape, feature: dict[str, Any]) -> str:
    """Return a feature with the shape's geometry and words; what else it says stays."""
    said = {"kind": shape.zone, "name": shape.name, "radius_m": shape.radius_m, "margin_m": shape.margin_m}
    properties = {**(feature.get("properties") or {}), **said}
    rings = [[[lon, lat] for lat, lon in ring] for ring in shape.rings]
    coordinates: Any = (
        [[*ring, ring[0]] for ring in rings]
        if shape.type == "polygon"
        else (rings[0] if shape.type == "line" else rings[0][0])
    )
    return json.dumps(
        {
            **feature,
            "properties": {k: v for k, v in properties.items() if v is not None and not (k in said and v == "")},
            "geometry": {"type": _GEOMETRY[shape.type], "coordinates": coordinates},
        },
        ensure_ascii=False,
    )


EMPTY = ""  # the text of a file that is not there yet
_DIGITS = 20


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """A file's content as text, and how it is written back: what is not changed is the same bytes."""

    text: str
    mark: bytes = b""  # a byte order mark
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
class SourceFiles:
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
        AutopilotLimits(), speed_mps=boat.polar.max_speed_mps(WindOptions().preview_speed_mps), hull=boat.hull
    )
    return MissionOptions(area=AreaOptions(margin_m=proposed.margin_m, margin_floor_m=proposed.floor_m))


def text_of(data: bytes, source: str) -> Text:
    """Return the text of a file's bytes. Raises InputError for bytes that are not text."""
    text = decode(data, source)
    line_end = "\r\n" if b"\r\n" in data else "\n"
    mark = b"\xef\xbb\xbf" if data.startswith(b"\xef\xbb\xbf") else b""
    return Text(text=text, mark=mark, line_end=line_end)


def read_base(path: Path) -> SourceFiles:
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
        return SourceFiles(path=path, data={}, toml=Text(text=EMPTY), options=_empty())
    data = {path: read_bytes(path)}
    toml = text_of(data[path], str(path))
    options = parse_options(toml.text, str(path))
    if options.from_autopilot:
        raise InputError(
            str(path),
            "from_autopilot",
            "the goals of this mission are drawn on the autopilot, not here",
            "draw them in a ground station and upload them",
        )
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
                raise unreadable(
                    str(path), error.__context__, f"[area] {where}", "paths are relative to the mission file"
                ) from None
            raise
        texts[name] = text = Text(text="") if data[where].startswith(b"PK") else text_of(data[where], str(where))
        document = parse(
            data[where],
            str(where),
            kind=ZoneKind(stands_for),
            axis=options.area.axis,
            areas=True,
            extension=where.suffix.lower(),
        )
        why = _locked_because(name, where, path, options) or (
            "" if text.data(text.text) == data[where] else "is not written in UTF-8 throughout: shown, not edited"
        )
        try:
            if not why:
                grounds[name] = ground_of(name, text.text, document.format, stands_for)
                _within_bounds(grounds)
        except NotEditable as reason:
            grounds.pop(name, None)
            why = str(reason)
        if why:
            locked.append(Locked(name=name, why=why, document=document))
    return SourceFiles(
        path=path, data=data, toml=toml, options=options, grounds=grounds, texts=texts, locked=tuple(locked)
    )


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
