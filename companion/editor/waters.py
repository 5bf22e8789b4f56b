"""Charts under a drawing: read as pictures, opened by name or from the browser, and made into a mission's area."""

from __future__ import annotations

import base64
import binascii
import hashlib
import re
from collections.abc import Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import msgspec

from companion.chart import Chart, ChartArea, ChartPicture, Wanted, area_of, box_about, read_chart, read_picture
from companion.editor.base import SourceFiles, ground_of
from companion.editor.sketch import MOST_VERTICES, Sketch, Zone
from companion.errors import InputError, JobError
from companion.messages import GeoPoint

TOLERANCES_M = (3.0, 6.0, 12.0, 25.0, 50.0)  # the first with which the area can be edited
MOST_REACH_M = 20_000.0
MOST_OPEN = 12
MOST_OPENED = 64_000_000  # bytes of a request with files: a dozen cells of harbours
_TILE = re.compile(r"/water/([0-9a-f]{12})/([0-9]{1,2})/([0-9]{1,6})/([0-9]{1,6})")
_NAME = re.compile(r"[A-Za-z0-9][A-Za-z0-9 ._()-]{0,79}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Water:
    """A chart's file and its picture; ``tag`` is another one when the file is."""

    path: Path
    tag: str
    picture: ChartPicture

    def facts(self) -> dict[str, Any]:
        """Return what the page has to know of it."""
        return {**self.picture.facts(), "tag": self.tag}


def open_waters(paths: Sequence[Path]) -> tuple[Water, ...]:
    """Return the charts of files, the coarsest first. Raises InputError: one is none, or is not to be believed."""
    waters = []
    for path in paths:
        picture = read_picture(path)
        if not picture.marks:
            raise InputError(str(path), "", "shows nothing", "take another chart")
        stat = path.stat()
        name = f"{path.resolve()} {stat.st_size} {stat.st_mtime_ns}"
        waters.append(Water(path=path, tag=hashlib.sha256(name.encode()).hexdigest()[:12], picture=picture))
    return tuple(sorted(waters, key=lambda water: -water.picture.resolution_m))


def tile_of(waters: Sequence[Water], path: str) -> bytes | None:
    """Return the tile that a path names; None: there is none."""
    named = _TILE.fullmatch(path)
    water = next((w for w in waters if named is not None and w.tag == named[1]), None)
    if named is None or water is None or int(named[2]) >= int(str(water.picture.facts()["levels"])):
        return None
    return water.picture.tile(int(named[2]), int(named[3]), int(named[4]))


def laid_down(files: Sequence[tuple[str, str]], folder: Path) -> list[Path]:
    """Write files that a browser sent, as (name, base64), into a folder; return those that are charts by themselves.

    Raises:
        InputError: a name is none, or what came with it is not base64.
    """
    paths = []
    for name, text in files:
        if not _NAME.fullmatch(name):
            raise InputError(name[:80], "", "is no name of a file", "rename it: letters, digits, dots")
        try:
            data = base64.b64decode(text, validate=True)
        except binascii.Error:
            raise InputError(name, "", "has not come whole", "open it again") from None
        path = folder / name
        path.write_bytes(data)
        paths.append(path)
    is_beside = re.compile(r"\\.(shx|dbf|prj|cpg|00[1-9]|0[1-9]\\d|[1-9]\\d\\d)", re.IGNORECASE)
    return [path for path in paths if not is_beside.fullmatch(path.suffix)]


def charted(
    base: SourceFiles,
    sketch: Sketch,
    waters: Sequence[Water],
    center: GeoPoint,
    reach_m: float,
    depth_m: float,
    own: AbstractSet[Path] = frozenset(),
) -> tuple[SourceFiles, Sketch, str]:
    """Return base and sketch with what the charts say of the water in them, and that in words.

    What of an earlier chart is in the sketch is replaced; what was drawn by hand stays. Nothing is written.

    Raises:
        InputError: a chart cannot be believed; JobError: it is too much to be edited.
    """
    wanted = Wanted(safety_depth_m=depth_m)
    read = [read_chart(w.path, box_about(center, reach_m), wanted, without_depths=True) for w in waters]
    charts = [chart for chart in read if not chart.is_elsewhere]
    if not charts:
        raise JobError("the charts hold nothing of this water: choose a place that they cover")
    area, tolerance_m = _few_enough(charts, center, reach_m)
    shapes = [shape for shape in sketch.shapes if not _is_chart(shape.of, base)]
    grounds, data, texts = dict(base.grounds), dict(base.data), dict(base.texts)
    parts: list[tuple[str, bytes, Zone]] = [("chart", area.obstacles_json(), "exclusion")] if area.solids else []
    if not any(shape.zone == "inclusion" for shape in shapes):
        parts.append(("chart-fence", area.fence_json(), "inclusion"))
    for noun, content, zone in parts:
        name = _free(base, noun, own)
        grounds[name] = ground_of(name, content.decode(), "geojson", zone)
        data[base.path.parent / name] = content
        texts.pop(name, None)
        shapes += grounds[name].shapes
    made = replace(base, data=data, grounds=grounds, texts=texts)
    drawn = msgspec.structs.replace(sketch, revision=made.revision, shapes=tuple(shapes))
    depths = "" if all(chart.knows_depths for chart in charts) else "; not every chart tells depths"
    words = (
        f"{len(area.solids)} obstacles of {', '.join(str(chart.source) for chart in charts)}: what is less deep than "
        f"{depth_m:g} m within {reach_m:g} m, drawn {2.0 * tolerance_m:g} m too large at the most{depths}. "
        "Not fit for navigation: look at it before it is sailed by"
    )
    return made, drawn, words


def _few_enough(charts: Sequence[Chart], center: GeoPoint, reach_m: float) -> tuple[ChartArea, float]:
    """Return the finest area that can be edited, and its tolerance [m]."""
    for tolerance_m in TOLERANCES_M:
        area = area_of(charts, center, reach_m, tolerance_m)
        if area.positions() <= MOST_VERTICES:
            return area, tolerance_m
    raise JobError(
        f"the charts hold {area.positions()} corners in {len(area.solids)} obstacles there, and {MOST_VERTICES} are "
        "edited here: say a smaller radius, or make the area with `companion chart import`"
    )


def _stem(base: SourceFiles) -> str:
    return re.sub(r"[^\w-]+", "-", base.path.stem).strip("-").lower() or "mission"


def _is_chart(name: str, base: SourceFiles) -> bool:
    return re.fullmatch(rf"{re.escape(_stem(base))}-chart(-fence)?(-\d+)?\.geojson", name) is not None


def _free(base: SourceFiles, noun: str, own: AbstractSet[Path]) -> str:
    """Return the file of the area that a chart goes into: that of an earlier one, or one that is not there."""
    number = 1
    while True:
        name = f"{_stem(base)}-{noun}{'' if number == 1 else f'-{number}'}.geojson"
        path = base.path.parent / name
        if name in base.grounds or (name not in base.texts and (not path.exists() or path in own)):
            return name
        number += 1
