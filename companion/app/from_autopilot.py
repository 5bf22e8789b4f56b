"""A mission drawn in a ground station: found on the autopilot before a voyage, adopted under way.

Our plan takes the place of the drawing on the autopilot, so the drawing is kept on the disk before anything is sent:
beside the state for a restart, as a .plan that a ground station opens again. A list of ours on board is known by its
content, and the drawing that was kept is the one that is sailed on.

The drawing is on board the autopilot meanwhile and nobody touches it: it is on the disk before the next voyage does.
"""

from __future__ import annotations

import asyncio
from collections.abc import Awaitable, Callable
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path

from companion.disk import Disk, read_regular, reason
from companion.errors import CompanionError, InputError, TransferError, UnreadableError
from companion.geofence import Document
from companion.geofence.mission import DrawnMission, MissionOptions, drawing_of, drawn_mission, read_stored, stored_text
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.mission_lists import ReadResult
from companion.mavlink.reception import TOOL_COMPONENT, LinkIdentity
from companion.mavlink.signing import SigningStore
from companion.mavlink.transports import Transport
from companion.mavlink.wire import mission_hash
from companion.messages import GeoPoint, MissionItem, Severity
from companion.mission_check import require_sailable
from companion.skipper.board.mark import are_marked, is_remnant
from companion.telemetry.state_file import known_beside, read_state

READ_TRIES = 5  # of one list; each has a patience of its own
RETRY_S = 3.0
SETTLE_S = 3.0  # between two readings that must agree: a ground station uploads one list after the other
MOST_READINGS = 10
PLAN = ".drawn.plan"
MOST_SAID = 5  # of the refusals, on the radio; the console has them all
RADIO_WARNING = 4  # MAV_SEVERITY

Say = Callable[[str], None]


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnLists:
    """What the autopilot holds; the mission is without its home."""

    mission: tuple[MissionItem, ...]
    fence: tuple[MissionItem, ...] = ()
    rally: tuple[MissionItem, ...] = ()
    home: GeoPoint | None = None

    def document(self) -> Document:
        """Return the lists as a drawing."""
        return drawing_of(self.mission, self.fence, self.rally, self.home)


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundMission:
    """What is to be sailed.

    Attributes:
        document: the drawing.
        drawn: what it was judged to be.
        plan: where it is kept, or is to be.
        is_new: it is on board now: the voyage begins with it; else a list of ours is, and the voyage goes on.
        board: the hash of the mission on board, which our plan may take the place of.
        text: which drawing it is, in words.
    """

    document: Document
    drawn: DrawnMission
    plan: Path
    is_new: bool
    board: str
    text: str


async def read_lists(autopilot: Autopilot, say: Say) -> DrawnLists:
    """Read mission, fence and rally points until two readings agree.

    Raises:
        TransferError: one of them cannot be read, or they do not come to rest.
    """
    before: DrawnLists | None = None
    for _ in range(MOST_READINGS):
        mission = await _read("mission", autopilot.read_mission, say)
        lists = DrawnLists(
            mission=mission.items or (),
            home=_place_of(mission.home),
            fence=(await _read("fence", autopilot.read_fence, say)).items or (),
            rally=(await _read("rally points", autopilot.read_rally, say)).items or (),
        )
        if lists == before:
            return lists
        if before is not None:
            say("the drawing on the autopilot is changing: it is read again")
        before = lists
        await asyncio.sleep(SETTLE_S)
    raise TransferError(
        f"the drawing on the autopilot did not come to rest in {MOST_READINGS} readings; end the upload and start again"
    )


async def _read(what: str, ask: Callable[[], Awaitable[ReadResult]], say: Say) -> ReadResult:
    result = await ask()
    for _ in range(READ_TRIES - 1):
        if result.is_ok:
            break
        say(f"the {what} could not be read from the autopilot: {result.text}; trying again")
        await asyncio.sleep(RETRY_S)
        result = await ask()
    if result.is_ok:
        return result
    raise TransferError(
        f"the {what} could not be read from the autopilot, {READ_TRIES} times: {result.text}; "
        "nothing was sent to the boat"
    )


def _place_of(home: MissionItem | None) -> GeoPoint | None:
    return home.point if home is not None and (home.lat_e7 or home.lon_e7) else None


def plan_path(state_path: Path) -> Path:
    """Return where the drawing is kept whose voyage has its state at ``state_path``."""
    return state_path.with_name(state_path.name.removesuffix(".json").removesuffix(".state") + PLAN)


def find(
    lists: DrawnLists, settings: MissionOptions, path: Path | None, state_path: Path, keep_at: Path
) -> FoundMission:
    """Return what is to be sailed: the drawing on board, or the one that was kept where the list on board is ours.

    Args:
        lists: what is on board.
        settings: all but the goals.
        path: of the mission file that has them; None: there is none, all is as by default.
        state_path: of the voyage's state: beside it the drawing was kept.
        keep_at: where a new drawing will be kept.

    Raises:
        InputError: the list on board is ours and its drawing is not here any more, or the settings cannot be believed.
    """
    board, plan = mission_hash(lists.mission), plan_path(state_path)
    before = _kept_before(plan)
    own, others = _names(state_path)
    is_ours = bool(lists.mission) and (
        board in {*own, *others}
        or are_marked(lists.mission)
        or (before is not None and is_remnant(lists.mission, before.items))
    )
    if not is_ours:
        document = lists.document()
        return FoundMission(
            document=document,
            drawn=drawn_mission(document, settings, path or keep_at, keep_at),
            plan=keep_at,
            is_new=True,
            board=board,
            text="the drawing on the autopilot",
        )
    if before is None or (board in others and board not in own):
        where = "of another voyage" if before is not None else f"and no drawing is kept at {plan}"
        raise UnreadableError(
            "the autopilot", "", f"the mission on board is one of ours, {where}", "draw a mission and upload it"
        )
    day = datetime.fromtimestamp(plan.stat().st_mtime, UTC)
    return FoundMission(
        document=before,
        drawn=drawn_mission(before, settings, path or plan, plan),
        plan=plan,
        is_new=False,
        board=board,
        text=f"the drawing kept at {plan} ({day:%d %b %Y %H:%M} UTC): the list on board is ours",
    )


def _names(state_path: Path) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the hashes of the lists that this voyage, and that others of ours, may have put on board."""
    try:
        own = read_state(state_path).names
    except (OSError, ValueError):
        own = ()
    return own, known_beside(state_path)


def _kept_before(plan: Path) -> Document | None:
    try:
        return read_stored(read_regular(plan).decode("utf-8"), str(plan))
    except (OSError, ValueError, InputError):
        return None


def keep(document: Document, plan: Path, disk: Disk, *, is_durable: bool = True) -> None:
    """Put a drawing on the disk, before our plan takes its place on the autopilot.

    Raises:
        UnreadableError: the disk does not take it.
    """
    try:
        disk.make_folder(plan.parent)
        disk.replace(plan, stored_text(document).data, is_durable=is_durable)
    except OSError as error:
        raise UnreadableError(
            str(plan),
            "",
            f"the drawing cannot be kept: {reason(error)}; our plan takes its place",
            "make room, or name another place with --state",
        ) from error


async def find_on(
    transport: Transport,
    settings: MissionOptions,
    path: Path | None,
    state_path: Path,
    keep_at: Path,
    say: Say,
    *,
    wait_s: float,
    signing: SigningStore | None = None,
) -> FoundMission:
    """Read what is drawn on the autopilot behind ``transport``, and find what is to be sailed; see ``find``.

    What is refused is also said on the radio, to who drew it.

    Raises:
        LinkError: no autopilot was heard, or its lists cannot be read.
        InputError: as of ``find``.
    """
    own = LinkIdentity(component=TOOL_COMPONENT)  # by ours a companion that sails would take this for a second one
    async with Link(
        transport, identity=own, target_system=settings.autopilot.system, streams=(), signing=signing
    ) as link:
        await link.wait_autopilot(wait_s)
        autopilot = Autopilot(link)
        try:
            found = find(await read_lists(autopilot, say), settings, path, state_path, keep_at)
        except UnreadableError as error:
            autopilot.say(RADIO_WARNING, f"nothing to sail: {error.problem}")
            raise
        for refusal in found.drawn.refusals[:MOST_SAID]:
            autopilot.say(RADIO_WARNING, f"the drawing is refused: {refusal.place}: {refusal.text}")
    return found


ADOPTED = "adopted"  # how a voyage ends that gives way to what was drawn under way


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnSettings:
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

    def __init__(self, autopilot: Autopilot, settings: DrawnSettings | None, done: Callable[[], None]) -> None:
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
