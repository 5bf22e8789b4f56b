"""The desk: what the page asks for and is answered, with the token only; what it writes are the mission's own files."""

from __future__ import annotations

import asyncio
import base64
import contextlib
import logging
import math
import re
import secrets
import tempfile
import time
from collections.abc import AsyncIterator, Awaitable, Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import h11
import msgspec
import numpy as np
import shapely
from msgspec import Meta, Struct
from numpy.typing import NDArray

from companion import __version__
from companion.compose import drying_of, planner_of, tide_of
from companion.current import closed_spans
from companion.disk import Disk, reason, what_is_there
from companion.editor.base import SourceFiles, area_files, read_base
from companion.editor.draft import Draft, draft_of, looked_at
from companion.editor.sketch import Place, Sketch
from companion.editor.waters import (
    MOST_OPEN,
    MOST_OPENED,
    MOST_REACH_M,
    Water,
    charted,
    laid_down,
    open_waters,
    tile_of,
)
from companion.errors import CompanionError, InputError, JobError
from companion.geo import DEGREE_M
from companion.geofence import Circle, Document, Mission, Zone, load_mission
from companion.geofence.formats import FORMATS
from companion.geofence.mission import MissionOptions, read_options
from companion.geofence.shapes import center_of
from companion.messages import GeoPoint
from companion.mission_check import AssumedWind, continued_plans, leg_names, legs
from companion.page import (
    Address,
    HttpRefusal,
    HttpReply,
    Stream,
    TileChart,
    files,
    listening,
    plan_figures,
    read_planned,
    require_token,
    tile_at,
)
from companion.planner import Plan, Problem
from companion.planner.worker import PlannerWorker
from companion.view import AreaView
from companion.view.area import drawn as area_drawn
from companion.view.passage import passage_view
from companion.words import counted, expected, listed

SIMPLER_DEG = 2e-6  # 0.2 m
SIDES, FEW_SIDES = 48, 8  # of a circle, and of one of many
MANY = 500
MOST_SIBLINGS = 200  # missions in the folder that are asked whether they share a file
PARTS = {"waypoints": ("mission", "fence", "rally")}
_UNKNOWN = GeoPoint(lat_deg=50.817, lon_deg=-1.31)  # where a mission without any place begins: where the examples are
_DRAWN = {"name", "goal", "refuge", "start", "area"}


def state_of(base: SourceFiles) -> dict[str, Any]:
    """Return what the page begins with."""
    sketch = base.sketch()
    frame = area_drawn("", _origin(base, sketch), [], [], [], None)
    wind = base.options.wind
    return {
        "version": __version__,
        "file": base.path.name,
        "folder": str(base.path.parent),
        "is_new": base.is_new,
        "called": base.options.name or base.path.stem,
        "disk": base.revision,
        "sketch": sketch,
        "frame": {"lat": frame.origin_lat_deg, "lon": frame.origin_lon_deg, "lat_m": frame.lat_m, "lon_m": frame.lon_m},
        "is_placed": _places(base, sketch) != [],
        "files": [
            {
                "name": n,
                "zone": zone,
                "why": next((o.why for o in base.locked if o.name == n), ""),
                "shared_by": _sharing(base, n),
            }
            for n, zone in area_files(base.options)
        ],
        "locked": [part for other in base.locked for part in _shown(other.name, other.document, base)],
        **drying_of_base(base),
        **passage_of_base(base, frame),
        "wind": {"from_deg": wind.preview_from_deg, "speed_mps": wind.preview_speed_mps},
        "formats": [
            {"ending": row.endings[0][1:], "said": row.said, "part": part}
            for row in FORMATS
            for part in PARTS.get(row.name, ("",))
        ],
        "kept": [
            t
            for t in MissionOptions.__struct_fields__
            if t not in _DRAWN and getattr(base.options, t) != getattr(MissionOptions(), t)
        ],
        "said": "",
        "free_m": base.options.boat.draft_m + base.options.area.under_keel_m if base.options.boat.draft_m else None,
    }


def drying_of_base(base: SourceFiles) -> dict[str, Any]:
    """Return the saved mission's water that dries as (lat, lon) rings with when it is solid, and the moment shown.

    That is now, or when the table of the tide begins where it does not hold for now. Nothing of a mission that cannot
    be read: the check says why.
    """
    waters: list[dict[str, Any]] = []
    shown_s = time.time()
    if not base.is_new and base.options.area.drying:
        with contextlib.suppress(InputError):
            mission = load_mission(base.path)
            table = tide_of(mission)
            if table is not None:
                shown_s = table.near_s(shown_s)
            for water, timed in zip(mission.drying, drying_of(mission, mission.frame()), strict=True):
                spans = closed_spans(table, timed.opens_at_m)
                solid = [[round(t) if math.isfinite(t) else None for t in span] for span in spans]
                waters.append({"name": timed.name, "rings": _rings(water.zone(), SIDES), "solid_unix_s": solid})
    return {"drying": waters, "shown_unix_s": shown_s}


def passage_of_base(base: SourceFiles, frame: AreaView) -> dict[str, Any]:
    """Return the passage that the saved mission was planned as, on the editor's chart; where it cannot be read, why."""
    try:
        planned = read_planned(base.path)
    except InputError as error:
        return {"passage": None, "passage_said": f"{error}; it is not shown"}

    def to_en(lonlat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
        east_deg = np.mod(lonlat_deg[:, 0] - frame.origin_lon_deg + 180.0, 360.0) - 180.0
        north_deg = lonlat_deg[:, 1] - frame.origin_lat_deg
        return np.column_stack([east_deg * frame.lon_m, north_deg * frame.lat_m])

    return {"passage": None if planned is None else passage_view(planned, to_en), "passage_said": ""}


def _origin(base: SourceFiles, sketch: Sketch) -> GeoPoint:
    places = _places(base, sketch)
    return GeoPoint(lat_deg=places[0][0], lon_deg=places[0][1]) if places else _UNKNOWN


def _places(base: SourceFiles, sketch: Sketch) -> list[tuple[float, float]]:
    """Return places of a mission, the best to begin its metres at first."""
    out = [sketch.start.at] if sketch.start is not None else []
    out += [p for g in sketch.goals for p in (g.at, g.port_mark, g.ring[0] if g.ring else None) if p is not None]
    out += [r.at for r in sketch.refuges] + [ring[0] for s in sketch.shapes for ring in s.rings if ring]
    for other in base.locked:
        out += [(c.lat_deg, c.lon_deg) for c in (center_of(z.shape) for z in other.document.zones[:1])]
        out += [(m.geometry.coords[0][1], m.geometry.coords[0][0]) for m in other.document.marks[:1]]
    return out


def _sharing(base: SourceFiles, name: str) -> list[str]:
    """Return the names of other missions in the folder that name the same file."""
    out = []
    siblings = sorted(base.path.parent.glob("*.toml"))[:MOST_SIBLINGS] if Path(name).name == name else []
    for path in siblings:
        if path == base.path:
            continue
        with contextlib.suppress(InputError, OSError):
            if name in {n for n, _ in area_files(read_options(path))}:
                out.append(path.name)
    return out


def _shown(name: str, document: Document, base: SourceFiles) -> list[dict[str, Any]]:
    """Return the zones of a file that is shown and not edited, as (lat, lon) rings."""
    marks = document.without_zones().as_obstacles(base.options.area.point_radius_m)
    zones = [*document.zones, *(o.zone() for o in marks)]
    sides = SIDES if len(zones) <= MANY else FEW_SIDES
    return [{"of": name, "zone": zone.kind.value, "rings": _rings(zone, sides)} for zone in zones]


def _rings(zone: Zone, sides: int) -> list[list[list[float]]]:
    """Return a zone as it is drawn: nothing is decided by the picture."""
    if isinstance(zone.shape, Circle):
        center, turns = zone.shape.center, 2.0 * np.pi * np.arange(sides) / sides
        high_deg = zone.shape.radius_m / DEGREE_M
        wide_deg = high_deg / max(0.01, math.cos(math.radians(center.lat_deg)))
        ring = [center.lat_deg + high_deg * np.cos(turns), center.lon_deg + wide_deg * np.sin(turns)]
        return [np.round(np.column_stack(ring), 7).tolist()]
    polygon = shapely.simplify(zone.shape, SIMPLER_DEG)
    return [
        np.round(shapely.get_coordinates(ring)[:-1, ::-1], 7).tolist()
        for ring in (polygon.exterior, *polygon.interiors)
    ]


def changed_meanwhile(expected: Mapping[Path, bytes], files: Mapping[Path, bytes]) -> list[Path]:
    """Return which of the ``files`` that are to be written are not what they are expected to be on the disk.

    A file that is not among ``expected`` is expected not to be there.
    """
    out = []
    for path in files:
        try:
            now: bytes | None = path.read_bytes()
        except FileNotFoundError:
            now = None
        except OSError as error:
            raise JobError(f"{path}: cannot be read ({reason(error)}); nothing is saved") from None
        if now != expected.get(path):
            out.append(path)
    return out


def save(files: Mapping[Path, bytes], disk: Disk) -> None:
    """Write all files or none, as ``Disk.replace_all`` does.

    Raises:
        JobError: one cannot be written.
    """
    try:
        disk.replace_all(files)
    except OSError as error:
        raise JobError(f"{error.filename}: cannot be written ({reason(error)}); {what_is_there(error)}") from None


BUDGET_S = 0.5  # for a leg: near the best, and while one looks
MOST_LEGS = 60


class Superseded(Exception):  # noqa: N818
    """A newer request has come."""


class PlanPreviews:
    """Plans with one worker; of requests that come meanwhile the newest is answered, the others are given up."""

    def __init__(self, worker: PlannerWorker) -> None:
        self._worker, self._newest = worker, 0
        self._turn = asyncio.Lock()

    def arrived(self) -> int:
        """Return the number of a request that has just come: those before it are given up."""
        self._newest += 1
        return self._newest

    async def make(self, mission: Mission, wind: AssumedWind, mine: int) -> dict[str, Any]:
        """Return the plans of all legs in words and figures; ``error`` says why there is none.

        ``mine``: the request's number.

        Raises:
            Superseded: a newer request has come before this was done.
        """
        if mission.start is None:
            return {"error": "a plan begins somewhere: put the start on the chart", "legs": []}
        async with self._turn:
            by = planner_of(mission).about(mission.frame().origin)
            words, walk = leg_names(mission), legs(mission, wind, unix_s=time.time())
            made: list[dict[str, Any]] = []
            error = ""
            try:
                problem: Problem | None = next(walk, None)
                while problem is not None and len(made) < MOST_LEGS:
                    if mine != self._newest:
                        raise Superseded
                    budget_s = min(BUDGET_S, mission.skipper.planning_budget_s)
                    # Whoever hangs up must not end the worker's work, which would end the worker.
                    plan = await asyncio.shield(
                        self._worker.plan(
                            problem, budget_s=budget_s, seed=0, algorithm=by.algorithm, settings=by.settings
                        )
                    )
                    to = words[len(made)]
                    if not plan.has_path:
                        error = f"no way to {to} was found: {plan.reason}"
                        break
                    made.append(_in_figures(plan, to, mission))
                    problem = continued_plans(walk, plan)
            except (InputError, ValueError) as trouble:
                error = str(trouble)
            if len(made) == MOST_LEGS < len(words):
                error = f"only the first {MOST_LEGS} legs are planned here"
            return {"error": error, "legs": made, **_together(made)}


def _in_words(problem: str) -> str:
    """Return what was found wrong with what the page sent, with its place.

    >>> _in_words("Expected `float` > 0.0 - at `$.sketch.shapes[0].radius_m`")
    'shape 1 radius_m: expected a number above 0.0'
    """
    what, _, path = problem.partition(" - at `")
    place = re.sub(r"s?\[(\d+)\]", lambda m: f" {int(m[1]) + 1}", re.sub(r"^\$\.?(sketch\.)?", "", path.rstrip("`")))
    return f"{place.replace('.', ' ')}: {expected(what)}".removeprefix(": ")


def _in_figures(plan: Plan, to: str, mission: Mission) -> dict[str, Any]:
    way = mission.frame().array_lonlat_from_en(plan.waypoints_en)[:, ::-1]
    return {"to": to, "why": plan.why.text, "way": np.round(way, 7).tolist(), **plan_figures(plan)}


def _together(made: list[dict[str, Any]]) -> dict[str, Any]:
    clear = [leg["clearance_m"] for leg in made if leg["clearance_m"] is not None]
    return {
        "time_s": round(sum(leg["time_s"] for leg in made), 1),
        "length_m": round(sum(leg["length_m"] for leg in made), 1),
        "tacks": sum(leg["tacks"] for leg in made),
        "gybes": sum(leg["gybes"] for leg in made),
        "clearance_m": min(clear) if clear else None,
    }


MOST_BODY = 4_000_000  # bytes: 20,000 vertices are 0.6 MB
MOST_BASES = 40  # that a sketch may be drawn upon: so often saved and undone
_LOG = logging.getLogger(__name__)

Degrees = Annotated[float, Meta(ge=-360.0, le=360.0)]


class _Asked(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """What comes with a request; each uses its part of it."""

    sketch: Sketch
    from_deg: Degrees | None = None
    speed_mps: Annotated[float, Meta(gt=0.0, le=50.0)] = 5.0
    spread_deg: Annotated[float, Meta(ge=0.0, le=60.0)] = 0.0
    disk: str = ""
    is_forced: bool = False
    format: str = ""
    part: str = ""


class _AskedWater(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The water of a chart that is to be the mission's: about a place, free where it is so deep."""

    sketch: Sketch
    at: Place
    reach_m: Annotated[float, Meta(ge=50.0, le=MOST_REACH_M)]
    depth_m: Annotated[float, Meta(ge=0.0, le=100.0)]


class _Opened(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Files of charts from the browser: name and base64 of each."""

    files: Annotated[list[tuple[str, str]], Meta(min_length=1, max_length=200)]


class EditorApi:
    """Serves the editor of one mission file; see ``companion.page.connections.App``.

    ``folder`` is where charts are laid down that come from the browser; None: none are taken.
    """

    def __init__(
        self,
        base: SourceFiles,
        token: str,
        previews: PlanPreviews,
        charts: Sequence[TileChart] = (),
        disk: Disk | None = None,
        *,
        waters: Sequence[Water] = (),
        folder: Path | None = None,
    ) -> None:
        self._path, self._token, self._previews, self._disk = base.path, token, previews, disk or Disk()
        self._waters, self._folder = tuple(waters), folder
        self._files = {**files(), **files("companion.editor")}
        self._charts = {chart.tag: chart for chart in charts}
        self._bases: dict[str, SourceFiles] = {}
        self._own: dict[Any, bytes] = {}  # files that were made here, as they were written
        self._turn, self._newest = asyncio.Lock(), 0
        self._keep(base)

    def admit(self, request: h11.Request, path: str) -> int:
        """Let in who may ask for it; return how many bytes are read. Raises HttpRefusal."""
        if request.method != b"POST":
            if path.startswith("/water/"):
                require_token(request, self._token)
            return 0
        if path not in {"/api/mission", "/api/open", "/api/water"} and path not in self._acts():
            raise HttpRefusal(404, "there is nothing to post to here")
        require_token(request, self._token)
        return MOST_OPENED if path == "/api/open" else MOST_BODY

    async def reply(self, request: h11.Request, path: str, body: bytes) -> HttpReply | Stream:
        """Answer a request. Raises HttpRefusal."""
        if request.method != b"POST":
            file, tile = self._files.get(path), await tile_at(self._charts, path)
            if tile is not None:
                return tile
            if path.startswith("/water/"):
                return await self._water_tile(path)
            if file is None:
                raise HttpRefusal(404, "there is nothing here")
            return HttpReply(kind=file.kind, data=file.data, tag=file.tag, packed=file.packed)
        act = self._acts().get(path)
        try:
            if path == "/api/open":
                return HttpReply(data=msgspec.json.encode(await self._open(msgspec.json.decode(body, type=_Opened))))
            if path == "/api/water":
                asked_water = msgspec.json.decode(body, type=_AskedWater)
                return HttpReply(data=msgspec.json.encode(await self._charted(asked_water)))
            if act is None:
                return HttpReply(data=msgspec.json.encode(await self._load()))
            asked = msgspec.json.decode(body, type=_Asked)
            return HttpReply(data=msgspec.json.encode(await act(asked)))
        except (msgspec.ValidationError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise HttpRefusal(400, f"this is no sketch: {_in_words(str(error))}") from None
        except Superseded:
            raise HttpRefusal(409, "a newer request has come") from None
        except CompanionError as error:
            raise HttpRefusal(422, str(error)) from None
        except HttpRefusal:
            raise
        except ModuleNotFoundError as error:
            raise HttpRefusal(
                422, f"{error.name} is missing, which reads such charts: pip install '.[chart]'"
            ) from None
        except Exception as error:
            _LOG.exception("%s failed", path)
            raise HttpRefusal(500, f"the editor failed at this: {type(error).__name__}; nothing is written") from None

    def _acts(self) -> dict[str, Callable[[_Asked], Awaitable[dict[str, Any]]]]:
        return {
            "/api/check": self._check,
            "/api/plan": self._plan,
            "/api/save": self._save,
            "/api/export": self._export,
        }

    def _keep(self, base: SourceFiles) -> str:
        revision = base.revision
        self._bases.pop(revision, None)
        self._bases[revision] = base
        while len(self._bases) > MOST_BASES:
            self._bases.pop(next(iter(self._bases)))
        return revision

    def _base(self, revision: str) -> SourceFiles:
        base = self._bases.get(revision)
        if base is None:
            raise HttpRefusal(410, "the mission was read too long ago: reload the page")
        return base

    def _draft(self, sketch: Sketch) -> Draft:
        return draft_of(self._base(sketch.revision), sketch, frozenset(self._own))

    async def _load(self) -> dict[str, Any]:
        base = await asyncio.to_thread(read_base, self._path)
        self._keep(base)
        return await self._state(base)

    async def _state(self, base: SourceFiles) -> dict[str, Any]:
        charts = [chart.facts() for chart in self._charts.values()]
        waters = [water.facts() for water in self._waters]
        return {**await asyncio.to_thread(state_of, base), "charts": charts, "waters": waters}

    async def _water_tile(self, path: str) -> HttpReply:
        data = await asyncio.to_thread(tile_of, self._waters, path)
        if data is None:
            raise HttpRefusal(404, "there is no such chart, or no such tile")
        return HttpReply(data=data, is_fixed=True)

    async def _open(self, asked: _Opened) -> dict[str, Any]:
        """Take charts from the browser; they are gone when the editor ends."""
        if self._folder is None:
            raise HttpRefusal(403, "no charts are taken here")
        folder = self._folder / secrets.token_hex(4)

        def work(folder: Path) -> tuple[Water, ...]:
            folder.mkdir()
            return open_waters(laid_down(asked.files, folder))

        async with self._turn:
            opened = await asyncio.to_thread(work, folder)
            waters = tuple(sorted((*self._waters, *opened), key=lambda w: -w.picture.resolution_m))
            if len(waters) > MOST_OPEN:
                raise HttpRefusal(413, f"at most {MOST_OPEN} charts are open at once")
            self._waters = waters
        return {"waters": [water.facts() for water in self._waters]}

    async def _charted(self, asked: _AskedWater) -> dict[str, Any]:
        """Return the sketch with what the charts say of the water; nothing is written."""
        if not self._waters:
            raise HttpRefusal(409, "no chart is open")
        base, center = self._base(asked.sketch.revision), GeoPoint(lat_deg=asked.at[0], lon_deg=asked.at[1])
        async with self._turn:
            base, sketch, words = await asyncio.to_thread(
                charted, base, asked.sketch, self._waters, center, asked.reach_m, asked.depth_m, frozenset(self._own)
            )
        self._keep(base)
        return {"sketch": sketch, "said": words}

    async def _check(self, asked: _Asked) -> dict[str, Any]:
        self._newest += 1
        mine = self._newest
        async with self._turn:  # one at a time, and of those that wait the newest
            if mine != self._newest:
                raise Superseded
            return await asyncio.to_thread(lambda: looked_at(self._draft(asked.sketch), asked.from_deg)[1])

    async def _plan(self, asked: _Asked) -> dict[str, Any]:
        mine = self._previews.arrived()
        judged, _ = await asyncio.to_thread(lambda: looked_at(self._draft(asked.sketch), asked.from_deg))
        if judged.mission is None or judged.refusals:
            first = judged.refusals[0]
            return {"error": ": ".join(p for p in (first.place, first.problem) if p), "legs": []}
        wind = judged.mission.wind
        from_deg = wind.preview_from_deg if asked.from_deg is None else asked.from_deg
        return await self._previews.make(
            judged.mission,
            AssumedWind(from_deg=from_deg % 360.0, speed_mps=asked.speed_mps, spread_deg=asked.spread_deg),
            mine,
        )

    async def _save(self, asked: _Asked) -> dict[str, Any]:
        on_disk = self._base(asked.disk)

        def work() -> tuple[SourceFiles, list[str], dict[str, Any]]:
            draft = self._draft(asked.sketch)
            _, found = looked_at(draft, asked.from_deg)
            known = {**self._own, **on_disk.data}
            changed = changed_meanwhile(known, {**draft.files, self._path: b""})
            if changed and not asked.is_forced:
                names = listed([path.name for path in changed])
                raise HttpRefusal(409, f"{names}: changed by another program since it was read")
            files = {path: data for path, data in draft.files.items() if path in changed or known.get(path) != data}
            save(files, self._disk)
            self._own.update({path: data for path, data in files.items() if path in self._own or path not in known})
            return read_base(self._path), [path.name for path in files], found

        async with self._turn:
            base, names, found = await asyncio.to_thread(work)
        self._keep(base)
        bad = [row for row in found["findings"] if row["severity"] == "error"]
        words = f"{listed(names)} saved" if names else "nothing had changed"
        words += f": NOT in order, {counted(len(bad), 'error')}" if bad else ": in order"
        return {**await self._state(base), "said": words}

    async def _export(self, asked: _Asked) -> dict[str, Any]:
        return await asyncio.to_thread(self._exported, asked)

    def _exported(self, asked: _Asked) -> dict[str, Any]:
        from companion.geofence import FindingLevel
        from companion.geofence.formats import write
        from companion.geofence.mission import document_of, goal_losses

        draft = self._draft(asked.sketch)
        judged, _ = looked_at(draft, asked.from_deg)
        if judged.mission is None:
            raise judged.refusals[0]
        name = f"{self._path.stem}{asked.part and f'-{asked.part}'}.{asked.format}"
        try:
            made = write(document_of(judged.mission), name, part=asked.part)
        except ValueError as error:
            raise InputError(name, "", str(error)) from None
        losses = [*goal_losses(judged.mission), *made.losses]
        if made.is_empty:
            raise InputError(name, "", "would be empty: there is nothing in the mission that this format carries")
        return {
            "name": name,
            "data": base64.b64encode(made.data).decode(),
            "is_lossy": any(f.severity is FindingLevel.ERROR for f in made.losses),
            "losses": [{"severity": f.severity.value, "text": f.text} for f in losses],
        }


@dataclass(frozen=True, slots=True, kw_only=True)
class EditorAddress:
    """Where the editor is: its address with the token behind ``#``, which no browser sends on."""

    url: str
    token: str


@contextlib.asynccontextmanager
async def editing(
    base: SourceFiles, address: Address, charts: Sequence[TileChart] = (), waters: Sequence[Water] = ()
) -> AsyncIterator[EditorAddress]:
    """Serve the editor of a mission while the body runs. An address without a token gets one.

    ``charts`` lie under the drawing, the lowest first; ``waters`` are those that obstacles can be made of.

    Raises:
        JobError: the port is in use, or it cannot be listened there.
    """
    token = address.token or secrets.token_urlsafe(24)
    with tempfile.TemporaryDirectory(prefix="companion-charts-") as folder:
        async with (
            PlannerWorker(algorithm=base.options.skipper.planner) as worker,
            listening(
                address, EditorApi(base, token, PlanPreviews(worker), charts, waters=waters, folder=Path(folder))
            ) as server,
        ):
            yield EditorAddress(url=f"{server.address.url}#{token}", token=token)
