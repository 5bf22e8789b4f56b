"""How to sail, beside the mission: what the caller of a voyage decides."""

from __future__ import annotations

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from dataclasses import dataclass, field
from pathlib import Path

from companion.app.from_autopilot import DrawnSettings
from companion.disk import Disk
from companion.mavlink.signing import SigningStore
from companion.page import Address, TileChart
from companion.telemetry.folder import VoyageArchive
from companion.view.passage import PlannedPassage
from companion.wind import Estimator, WindTracker

Offload = Callable[[Callable[[], None]], Awaitable[None]]


async def in_thread(work: Callable[[], None]) -> None:
    """Do disk work in a thread: a slow card must not hold the loop. Who is cancelled ends when the work has."""
    working = asyncio.ensure_future(asyncio.to_thread(work))
    try:
        await asyncio.shield(working)
    finally:  # a thread cannot be ended, and what it works on must not be closed, or another's, before it is
        while not working.done():
            with contextlib.suppress(asyncio.CancelledError):
                await asyncio.wait({working})
        if not working.cancelled():
            working.exception()  # heard: who was cancelled has nothing more to do with it


async def at_once(work: Callable[[], None]) -> None:
    """Do disk work here: for the virtual clock, which has no threads."""
    work()


def wind_room(estimator: Estimator) -> WindTracker:
    """Return the wind room of an estimator."""
    return WindTracker(estimator=estimator)


@dataclass(frozen=True, slots=True, kw_only=True)
class SatelliteLink:
    """The link far away: ``out`` and ``in`` of ``folder``, the ``key`` (32 bytes), a status every ``every_s`` [s]."""

    folder: Path
    key: bytes = field(repr=False)
    every_s: float = 600.0


@dataclass(frozen=True, slots=True, kw_only=True)
class SailOptions:
    """How to sail, beside the mission.

    Attributes:
        seed: of the planner.
        dry_run: look, plan, speak, touch nothing.
        epoch_s: Unix time [s] of the loop's time 0, for stamps only.
        clock_epoch_s: what this computer's clock showed at the loop's time 0 [s since 1970], where the loop is faster
            than the clock; None: ``epoch_s``.
        expansions: plan with this effort instead of the mission's time budget (repeatable).
        state_path: where the state for a restart is kept; None: in the voyage folder.
        limit_s: end after this long [s].
        exit_on_arrival: end when the voyage is over, for harnesses; on the water the loiter is watched until told.
        wait_s: how long to wait for the autopilot's first heartbeat [s].
        offload: where what takes long is done: disk work, the autopilot's fence.
        is_durable: force files to the disk, against power cuts; a simulation has none.
        disk: what is written to.
        archive: the older voyages beside this one and what all may take together; None: they are left alone.
        is_again: sail the mission again although the saved state says that it has arrived.
        settings: what a drawing that is adopted under way is sailed with; None: drawings are not adopted.
        known: hashes of missions on the autopilot that ours may take the place of: the drawing that is sailed.
        socket: where orders from on board are taken; None: nowhere.
        http: where the live page is served; None: nowhere.
        charts: the user's, under the page's own water.
        planned: the passage that the mission was planned as, for the page.
        far: the folder that a satellite modem's program shares with us; None: there is none.
        signing: key and timestamp for a signed link.
        room: makes the wind room of the mission's estimator; a study may know more of the wind, or less.
        token: 32 bits that tell our heartbeat from a second companion's; on the boat they are drawn by lot.
        budget_scale: computing seconds for each second of the loop's time: 1 / speedup beside a hurried simulator.
        command: what was typed, for the record.
    """

    seed: int = 0
    dry_run: bool = False
    epoch_s: float = 0.0
    clock_epoch_s: float | None = None
    expansions: int | None = None
    state_path: Path | None = None
    limit_s: float | None = None
    exit_on_arrival: bool = False
    wait_s: float = 30.0
    offload: Offload = in_thread
    is_durable: bool = True
    disk: Disk = field(default_factory=Disk)
    archive: VoyageArchive | None = None
    is_again: bool = False
    settings: DrawnSettings | None = None
    socket: Path | None = None
    http: Address | None = None
    charts: tuple[TileChart, ...] = ()
    planned: PlannedPassage | None = None
    far: SatelliteLink | None = None
    known: tuple[str, ...] = ()
    signing: SigningStore | None = None
    room: Callable[[Estimator], WindTracker] = field(default=wind_room, repr=False)
    token: int = 1
    budget_scale: float = 1.0
    command: str = ""
