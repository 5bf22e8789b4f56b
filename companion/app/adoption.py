"""Adopting a drawing under way: it is read and judged; then this voyage ends, and its caller begins the drawn one.

The drawing is on board the autopilot meanwhile and nobody touches it: it is on the disk before the next voyage does.
"""

from __future__ import annotations

import asyncio
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from companion.app.drawn import find, plan_path, read_lists
from companion.errors import CompanionError
from companion.geofence.mission import MissionOptions
from companion.mavlink.autopilot import Autopilot
from companion.sailable import require_sailable
from companion.skipper.step import Severity

ADOPTED = "adopted"   # how a voyage ends that gives way to what was drawn under way


@dataclass(frozen=True, slots=True, kw_only=True)
class Settings:
    """What a drawing is sailed with: the options of the mission file at ``path``, and where the state is kept."""

    options: MissionOptions
    path: Path | None
    state_path: Path


class Adoption:
    """The order to adopt what is drawn on board. ``run`` lives in the voyage's task group.

    Args:
        settings: of the voyage; None: its goals are not drawn, and no drawing is adopted.
        done: called when the drawing can be sailed: the voyage is to end.
    """

    def __init__(self, autopilot: Autopilot, settings: Settings | None, done: Callable[[], None]) -> None:
        self._autopilot, self._settings, self._done = autopilot, settings, done
        self._asked = asyncio.Event()

    def ask(self) -> None:
        """Take the order; never waits."""
        self._asked.set()

    async def run(self) -> None:
        """Carry the order out whenever it is given, and say what is in the way."""
        while True:
            await self._asked.wait()
            self._asked.clear()
            trouble = await self._trouble()
            if not trouble:
                self._done()
                return
            self._autopilot.say(int(Severity.WARNING), f"the drawing is not adopted: {trouble}")

    async def _trouble(self) -> str:
        """Return why what is on board cannot be sailed, empty when it can be."""
        settings = self._settings
        if settings is None:
            return "the goals of this voyage are in its mission file"
        try:
            lists = await read_lists(self._autopilot, lambda text: self._autopilot.say(int(Severity.NOTICE), text))
            found = find(lists, settings.options, settings.path, settings.state_path, plan_path(settings.state_path))
            if found.drawn.mission is not None:
                require_sailable(found.drawn.mission)
        except CompanionError as error:
            return str(error)
        if not found.is_new:
            return "the mission on board is ours"
        return "; ".join(f"{r.place}: {r.text}" for r in found.drawn.refusals)
