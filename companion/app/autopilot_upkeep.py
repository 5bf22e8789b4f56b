"""What a voyage keeps right on its link: who the autopilot is, its parameters, its fence, and who else commands it."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from companion.app.options import Offload
from companion.clock import now_s
from companion.errors import LinkError
from companion.fold import VoyageFold
from companion.geofence import Mission
from companion.geofence.autopilot_fence import AutopilotFence, FenceStatus, fence_for_autopilot
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices import CommandAnswer
from companion.mavlink.reception import OWN_COMPONENT
from companion.mavlink.vehicle_identity import LISTEN_S, type_words, yields_to
from companion.mavlink.wire import RANGES
from companion.messages import MissionItem, Severity
from companion.skipper.step import is_given_up

LOOK_S = 1.0
# A parameter that is not answered is asked for again after this long [s].
PARAMETER_AGAIN_S = 10.0
# All are read again this often: what was changed, damaged or forged does not stay [s].
PARAMETERS_EVERY_S = 300.0
FENCE_TRIES = 5
FENCE_EVERY_S = 15.0  # between two looks at what is drawn on the autopilot
FENCE_AGAIN_S = 5.0  # ... when it could not be read
FENCE_READ_S = 3.0  # that one takes at the most
YIELDS_S = 0.1  # so soon an upload has the link to itself

Record = Callable[[dict[str, Any]], None]


async def keep_identity(fold: VoyageFold, autopilot: Autopilot) -> None:
    """Ask who the autopilot is, again after each gap and reboot; the fold hears the answer as a message."""
    while True:
        if autopilot.link.is_alive and fold.wants_uid(now_s()):
            await autopilot.read_version()
        await asyncio.sleep(LOOK_S)


async def keep_parameters(fold: VoyageFold, autopilot: Autopilot) -> None:
    """Read the parameters that matter, now and then and after each reboot; the fold hears them as messages."""
    asked_s: dict[str, float] = {}
    reboots = 0
    while True:
        if reboots != autopilot.link.stats.reboots:
            reboots = autopilot.link.stats.reboots
            asked_s.clear()
        unread = fold.unread
        for name in (*RANGES, *(name for name in unread if name not in RANGES)):
            again_s = PARAMETER_AGAIN_S if name in unread else PARAMETERS_EVERY_S
            if now_s() - asked_s.get(name, -math.inf) >= again_s and autopilot.link.is_alive:
                asked_s[name] = now_s()
                await autopilot.get_parameter(name)
                unread = fold.unread
        await asyncio.sleep(LOOK_S)


async def keep_fence(
    fold: VoyageFold,
    autopilot: Autopilot,
    mission: Mission,
    record: Record,
    take: Callable[[tuple[MissionItem, ...]], None],
    offload: Offload,
) -> None:
    """Upload the fence, where it may be, once the autopilot is known to be ours, and read what somebody draws there.

    ``take`` hears what is drawn on the autopilot when that has changed. What a chart has about the boat is made into
    the autopilot's fence by ``offload``: it takes seconds of a small computer, which the steps must not wait for.
    """
    await _place_fence(fold, autopilot, mission, record, offload)
    await _read_fence(fold, autopilot, take)


async def _read_fence(fold: VoyageFold, autopilot: Autopilot, take: Callable[[tuple[MissionItem, ...]], None]) -> None:
    """Read the fence now and then while there is one in force, and when the autopilot says anything new of it.

    Nothing on the link tells of a fence that is drawn anew.
    """
    told: tuple[MissionItem, ...] | None = None
    seen: tuple[bool | None, int | None] = None, None
    next_s = -math.inf
    while True:
        status = autopilot.status
        shown = (None, None) if status is None else (status.fence_breached, status.fence_breaches)
        if shown != seen:
            seen, next_s = shown, -math.inf
        if (
            shown[0] is not None
            and now_s() >= next_s
            and autopilot.link.is_alive
            and (fold.state.vehicle.is_ours and fold.state.pending.upload is None)
        ):
            items = await _fence_items(fold, autopilot)
            next_s = now_s() + (FENCE_EVERY_S if items is not None else FENCE_AGAIN_S)
            if items is not None and items != told:
                told = items
                take(items)
        await asyncio.sleep(LOOK_S)


async def _fence_items(fold: VoyageFold, autopilot: Autopilot) -> tuple[MissionItem, ...] | None:
    """Return what is drawn on the autopilot; None: it could not be read, or a plan is to be uploaded instead."""
    reading = asyncio.create_task(autopilot.read_fence(), name="fence read")
    end_s = now_s() + FENCE_READ_S
    try:
        while now_s() < end_s and fold.state.pending.upload is None:
            await asyncio.wait({reading}, timeout=YIELDS_S)
            if reading.done():
                return reading.result().items
        return None
    finally:
        reading.cancel()


async def _place_fence(
    fold: VoyageFold, autopilot: Autopilot, mission: Mission, record: Record, offload: Offload
) -> None:
    """Upload the fence, where it may be, once the autopilot is known to be ours; begun again when that was in doubt."""
    upload: asyncio.Task[None] | None = None
    try:
        while fold.permissions.may_upload_fence:
            is_ours = fold.state.vehicle.is_ours and not is_given_up(fold.state)
            if upload is None and is_ours:
                upload = asyncio.create_task(_upload_fence(autopilot, mission, record, offload), name="fence upload")
            elif upload is not None and upload.done():
                return upload.result()
            elif upload is not None and not is_ours:
                upload.cancel()
                upload = None
            await asyncio.sleep(LOOK_S)
    finally:
        if upload is not None:
            upload.cancel()


async def _upload_fence(autopilot: Autopilot, mission: Mission, record: Record, offload: Offload) -> None:
    """Put the fence of the mission's water on the autopilot and switch it on: its last line of defence."""
    places = [*([mission.start] if mission.start else []), *mission.places]
    made: list[AutopilotFence] = []
    await offload(lambda: made.append(fence_for_autopilot(mission.area, mission.margin_m, inside=places)))
    fence = made[0]
    done: dict[str, Any] = {"kind": "fence", "status": fence.status.name, "text": fence.reason}
    trouble = "" if fence.items or fence.status is FenceStatus.EMPTY else fence.reason
    if fence.items:
        sent = await autopilot.upload_fence(fence.items)
        done |= {"outcome": sent.outcome.value, "text": sent.text, "count": len(fence.items)}
        trouble = "" if sent.is_ok else sent.text or sent.outcome.value
        if sent.is_ok:
            enabled = await _enable_fence(autopilot)
            done["enabled"] = enabled.outcome.value
            trouble = "" if enabled.is_ok else enabled.text or enabled.outcome.value
    if fence.left_out:
        done["reach_m"] = round(fence.reach_m, 1)
    if trouble:
        autopilot.say(int(Severity.ERROR), f"the fence is not in force: {trouble}")
    elif fence.left_out:
        autopilot.say(int(Severity.WARNING), f"the autopilot's fence: {fence.left_out}")
    record(done)


async def _enable_fence(autopilot: Autopilot) -> CommandAnswer:
    """Switch the fence on; ArduRover refuses it for the moment in which it takes a new one in."""
    for _ in range(FENCE_TRIES - 1):
        answer = await autopilot.enable_fence()
        if answer.is_ok:
            return answer
        await asyncio.sleep(LOOK_S)
    return await autopilot.enable_fence()


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherStations:
    """Who else is heard: autopilots in words, where ours has no name, a companion at work, a ground station."""

    neighbours: tuple[str, ...] = ()
    has_company: bool = False
    has_shore: bool = False

    def to_record(self) -> dict[str, object]:
        """Return it as a record of the voyage."""
        return {
            "kind": "others",
            "neighbours": list(self.neighbours),
            "company": self.has_company,
            "shore": self.has_shore,
        }


NOBODY = OtherStations()


async def make_way(link: Link, *, named: int | None, token: int) -> None:
    """Listen for another companion on our autopilot, and give way to one that is at work.

    Raises:
        LinkError: there is one.
    """
    if named is not None:
        await asyncio.sleep(LISTEN_S)  # without a name the link has listened this long already
    other = link.other_companion()
    if other is not None and yields_to(token, other):
        raise LinkError(
            f"{link.transport.name}: another companion is at work on this boat (component {OWN_COMPONENT} of "
            f"system {link.party.target_system}): stop it first, two would give her different orders"
        )


def others_on(link: Link, *, named: int | None) -> OtherStations:
    """Return who else is heard at present."""
    other = link.other_companion()
    return OtherStations(
        neighbours=()
        if named is not None
        else tuple(f"system {s.system}, {type_words(s.vehicle_type)}" for s in link.neighbours()),
        has_company=other is not None and not other.is_starting,
        has_shore=link.hears_station,
    )
