"""The desk: what the page asks for and is answered, with the token only; what it writes are the mission's own files."""

from __future__ import annotations

import asyncio
import base64
import logging
from collections.abc import Awaitable, Callable, Sequence
from typing import Annotated, Any

import h11
import msgspec
from msgspec import Meta, Struct

from companion.disk import Disk
from companion.editor.base import Base, read_base
from companion.editor.draft import Draft, draft_of
from companion.editor.findings import looked_at
from companion.editor.plans import Previews, Superseded
from companion.editor.saving import changed_meanwhile, save
from companion.editor.sketch import Sketch
from companion.editor.state import state_of
from companion.errors import CompanionError, InputError
from companion.page import Chart, Refused, Reply, Stream, files, require_token, tile_at
from companion.sailable.previews import Wind
from companion.words import counted, listed

MOST_BODY = 4_000_000     # bytes: 20,000 vertices are 0.6 MB
MOST_BASES = 40           # that a sketch may be drawn upon: so often saved and undone
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


class Desk:
    """Serves the editor of one mission file; see ``companion.page.connections.App``."""

    def __init__(
        self, base: Base, token: str, previews: Previews, charts: Sequence[Chart] = (), disk: Disk | None = None,
    ) -> None:
        self._path, self._token, self._previews, self._disk = base.path, token, previews, disk or Disk()
        self._files = {**files(), **files("companion.editor")}
        self._charts = {chart.tag: chart for chart in charts}
        self._bases: dict[str, Base] = {}
        self._own: dict[Any, bytes] = {}      # files that were made here, as they were written
        self._turn, self._newest = asyncio.Lock(), 0
        self._keep(base)

    def admit(self, request: h11.Request, path: str) -> int:
        """Let in who may ask for it; return how many bytes are read. Raises Refused."""
        if request.method != b"POST":
            return 0
        if path != "/api/mission" and path not in self._acts():
            raise Refused(404, "there is nothing to post to here")
        require_token(request, self._token)
        return MOST_BODY

    async def reply(self, request: h11.Request, path: str, body: bytes) -> Reply | Stream:
        """Answer a request. Raises Refused."""
        if request.method != b"POST":
            file, tile = self._files.get(path), await tile_at(self._charts, path)
            if tile is not None:
                return tile
            if file is None:
                raise Refused(404, "there is nothing here")
            return Reply(kind=file.kind, data=file.data, tag=file.tag, packed=file.packed)
        act = self._acts().get(path)
        try:
            if act is None:
                return Reply(data=msgspec.json.encode(await self._load()))
            asked = msgspec.json.decode(body, type=_Asked)
            return Reply(data=msgspec.json.encode(await act(asked)))
        except (msgspec.ValidationError, msgspec.DecodeError, UnicodeDecodeError, RecursionError) as error:
            raise Refused(400, f"this is no sketch: {error}") from None
        except Superseded:
            raise Refused(409, "a newer request has come") from None
        except CompanionError as error:
            raise Refused(422, str(error)) from None
        except Refused:
            raise
        except Exception as error:
            _LOG.exception("%s failed", path)
            raise Refused(500, f"the editor failed at this: {type(error).__name__}; nothing is written") from None

    def _acts(self) -> dict[str, Callable[[_Asked], Awaitable[dict[str, Any]]]]:
        return {"/api/check": self._check, "/api/plan": self._plan, "/api/save": self._save,
                "/api/export": self._export}

    def _keep(self, base: Base) -> str:
        revision = base.revision
        self._bases.pop(revision, None)
        self._bases[revision] = base
        while len(self._bases) > MOST_BASES:
            self._bases.pop(next(iter(self._bases)))
        return revision

    def _base(self, revision: str) -> Base:
        base = self._bases.get(revision)
        if base is None:
            raise Refused(410, "the mission was read too long ago: reload the page")
        return base

    def _draft(self, sketch: Sketch) -> Draft:
        return draft_of(self._base(sketch.revision), sketch, frozenset(self._own))

    async def _load(self) -> dict[str, Any]:
        base = await asyncio.to_thread(read_base, self._path)
        self._keep(base)
        return await self._state(base)

    async def _state(self, base: Base) -> dict[str, Any]:
        charts = [chart.facts() for chart in self._charts.values()]
        return {**await asyncio.to_thread(state_of, base), "charts": charts}

    async def _check(self, asked: _Asked) -> dict[str, Any]:
        self._newest += 1
        mine = self._newest
        async with self._turn:   # one at a time, and of those that wait the newest
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
        return await self._previews.make(judged.mission, Wind(
            from_deg=from_deg % 360.0, speed_mps=asked.speed_mps, spread_deg=asked.spread_deg), mine)

    async def _save(self, asked: _Asked) -> dict[str, Any]:
        on_disk = self._base(asked.disk)

        def work() -> tuple[Base, list[str], dict[str, Any]]:
            draft = self._draft(asked.sketch)
            _, found = looked_at(draft, asked.from_deg)
            known = {**self._own, **on_disk.data}
            changed = changed_meanwhile(known, {**draft.files, self._path: b""})
            if changed and not asked.is_forced:
                names = listed([path.name for path in changed])
                raise Refused(409, f"{names}: changed by another program since it was read")
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
        from companion.geofence import Severity
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
        return {"name": name, "data": base64.b64encode(made.data).decode(),
                "is_lossy": any(f.severity is Severity.ERROR for f in made.losses),
                "losses": [{"severity": f.severity.value, "text": f.text} for f in losses]}
