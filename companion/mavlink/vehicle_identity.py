"""Who speaks on a link: the autopilots heard, which of them is ours, and a second companion beside us. Pure.

The first autopilot heard is nobody's choice: every ArduPilot vehicle in range may be on the link. One that is named
is taken; without a name there must be one alone, and it must be a rover (which ArduRover's boats are).
"""

from __future__ import annotations

import enum
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire import codec
from companion.mavlink.wire.frames import Message
from companion.messages import Mode

# Heartbeats come once a second: in this time two of everybody who speaks are heard [s].
LISTEN_S = 2.5
# Who was not heard for this long has gone [s].
GONE_S = 10.0
# Heartbeats of another companion before it counts: one may be the last word of a life that has just ended.
COMPANION_BEATS = 2
ROVERS = frozenset({wire.MAV_TYPE_GROUND_ROVER, wire.MAV_TYPE_SURFACE_BOAT})


def type_words(vehicle_type: int) -> str:
    """Return a MAV_TYPE in words.

    >>> type_words(11)
    'surface boat'
    """
    entry = wire.enums["MAV_TYPE"].get(vehicle_type)
    return entry.name.removeprefix("MAV_TYPE_").replace("_", " ").lower() if entry else f"type {vehicle_type}"


def is_rover(vehicle_type: int, autopilot: int) -> bool:
    """Return whether a heartbeat's type and autopilot are ArduRover's."""
    return vehicle_type in ROVERS and autopilot == wire.MAV_AUTOPILOT_ARDUPILOTMEGA


@dataclass(frozen=True, slots=True, kw_only=True)
class Speaker:
    """An autopilot by its heartbeats; ``mode`` is the number of its own firmware."""

    system: int
    vehicle_type: int
    autopilot: int
    mode: int
    is_armed: bool
    first_s: float
    last_s: float

    @property
    def is_rover(self) -> bool:
        """It says that it is an ArduRover."""
        return is_rover(self.vehicle_type, self.autopilot)

    def describe(self) -> str:
        """Return it in words: system, type, autopilot, mode, armed or not."""
        entry = wire.enums["MAV_AUTOPILOT"].get(self.autopilot)
        maker = entry.name.removeprefix("MAV_AUTOPILOT_") if entry else str(self.autopilot)
        maker = {"ARDUPILOTMEGA": "ArduPilot"}.get(maker, maker)
        names = {m.value: m.name for m in Mode} if self.is_rover else {}
        mode = names.get(self.mode, f"mode {self.mode}")
        armed = "armed" if self.is_armed else "disarmed"
        return f"system {self.system} ({type_words(self.vehicle_type)}, {maker}, {mode}, {armed})"


class CensusState(enum.Enum):
    """What the census says."""

    LISTENING = "listening"  # nobody yet, or not long enough
    CHOSEN = "chosen"
    REFUSED = "refused"  # what is heard cannot be ours; the reason says what to do


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotChoice:
    """The census's answer: ``system`` when CHOSEN, ``reason`` when REFUSED."""

    standing: CensusState = CensusState.LISTENING
    system: int | None = None
    reason: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class OtherCompanion:
    """Another program that speaks with our ids: the ``token`` of its heartbeat is not ours."""

    token: int
    is_starting: bool
    beats: int
    last_s: float


class Census:
    """Everybody heard on one link.

    Args:
        wanted: the system id of our autopilot, None: the only one there is.
    """

    def __init__(self, wanted: int | None = None) -> None:
        self.wanted = wanted
        self._speakers: dict[int, Speaker] = {}
        self._companions: dict[int, OtherCompanion] = {}
        self._station_s = -math.inf

    def take(self, t_s: float, message: Message) -> None:
        """Take the HEARTBEAT of an autopilot or a ground station; anything else is nothing to a census."""
        if message.get_type() != "HEARTBEAT":
            return
        system = message.get_srcSystem()
        if message.type == wire.MAV_TYPE_GCS:
            self._station_s = t_s
        if system == 0 or not codec.is_autopilot_heartbeat(message):
            return
        before = self._speakers.get(system)
        self._speakers[system] = Speaker(
            system=system,
            vehicle_type=int(message.type),
            autopilot=int(message.autopilot),
            mode=int(message.custom_mode),
            is_armed=codec.is_armed(message),
            first_s=before.first_s if before else t_s,
            last_s=t_s,
        )

    def take_companion(self, t_s: float, message: Message) -> None:
        """Take a HEARTBEAT from our own component id that is not an echo of ours."""
        before = self._companions.get(message.get_srcSystem())
        is_same = before is not None and before.token == message.custom_mode and t_s - before.last_s <= GONE_S
        self._companions[message.get_srcSystem()] = OtherCompanion(
            token=int(message.custom_mode),
            is_starting=message.system_status == wire.MAV_STATE_BOOT,
            beats=before.beats + 1 if is_same and before is not None else 1,
            last_s=t_s,
        )

    def hears_station(self, t_s: float) -> bool:
        """Return whether a ground station was heard lately."""
        return t_s - self._station_s <= GONE_S

    def heard(self, t_s: float) -> tuple[Speaker, ...]:
        """Return the autopilots heard lately, by system id."""
        return tuple(s for _, s in sorted(self._speakers.items()) if t_s - s.last_s <= GONE_S)

    def neighbours(self, t_s: float, system: int) -> tuple[Speaker, ...]:
        """Return the autopilots heard lately beside ``system``."""
        return tuple(s for s in self.heard(t_s) if s.system != system)

    def companion(self, t_s: float, system: int) -> OtherCompanion | None:
        """Return the other companion of ``system``, None when none is heard."""
        other = self._companions.get(system)
        return other if other is not None and other.beats >= COMPANION_BEATS and t_s - other.last_s <= GONE_S else None

    def choice(self, t_s: float) -> AutopilotChoice:
        """Return which autopilot is ours, by what was heard until ``t_s``."""
        heard = self.heard(t_s)
        if self.wanted is not None:
            ours = [s for s in heard if s.system == self.wanted]
            if not ours:
                return AutopilotChoice()
        else:
            if not heard or t_s - min(s.first_s for s in heard) < LISTEN_S:
                return AutopilotChoice()
            if len(heard) > 1:
                return AutopilotChoice(
                    standing=CensusState.REFUSED,
                    reason=(
                        f"{len(heard)} autopilots are heard: {listed(heard)}: say which is yours, with --system N or "
                        "[autopilot] system in the mission"
                    ),
                )
            ours = list(heard)
        if not ours[0].is_rover:
            return AutopilotChoice(
                standing=CensusState.REFUSED, reason=f"{ours[0].describe()} is not a rover: no boat of ours"
            )
        return AutopilotChoice(standing=CensusState.CHOSEN, system=ours[0].system)


def listed(speakers: Iterable[Speaker]) -> str:
    """Return autopilots in one line."""
    return "; ".join(s.describe() for s in speakers)


def yields_to(token: int, other: OtherCompanion) -> bool:
    """Return whether a companion that starts gives way to ``other``: to one that sails always, else by lot."""
    return not other.is_starting or other.token < token


# Who the autopilot says it is, folded from its messages: type, board, frame. Pure.
#
# A system id is no identity: every ArduPilot vehicle is delivered with id 1. The board's UID is one. It is asked for at
# the start, again after a reboot or a gap in which the autopilot may have become another, and now and then.

# Without a heartbeat for longer than this the next one may be another autopilot's, or a reboot's [s].
GAP_S = 5.0
# A UID that is known is asked for again this often [s].
UID_EVERY_S = 30.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Identity:
    """The autopilot of one system id.

    Attributes:
        system: its MAVLink system id.
        uid: the board's, "" of a board that has none, None before it was told.
        is_confirmed: the UID was told since the last reboot and gap, and nothing has contradicted it since.
        is_contested: two autopilots speak with these ids.
        vehicle_type: MAV_TYPE of its heartbeats.
        frame_class: FRAME_CLASS, None before it was read.
        sails: SAIL_ENABLE, None before it was read.
    """

    system: int | None = None
    uid: str | None = None
    is_confirmed: bool = False
    is_contested: bool = False
    vehicle_type: int | None = None
    frame_class: int | None = None
    sails: bool | None = None
    other_uid: str | None = None  # a UID that differs, told once

    def with_uid(self, system: int, uid: str) -> Identity:
        """Take an AUTOPILOT_VERSION. One that differs is believed when it is told twice running."""
        if self.uid is None or uid in {self.uid, self.other_uid}:
            return replace(self, system=system, uid=uid, is_confirmed=True, other_uid=None)
        return replace(self, is_confirmed=False, other_uid=uid)

    def doubted(self) -> Identity:
        """Take a reboot or a gap."""
        return replace(self, is_confirmed=False)

    def with_parameters(self, values: Mapping[str, float]) -> Identity:
        """Take parameters; others than the frame's do not matter."""
        frame, sails = values.get("FRAME_CLASS"), values.get("SAIL_ENABLE")
        return replace(
            self,
            frame_class=self.frame_class if frame is None else int(frame),
            sails=self.sails if sails is None else sails != 0.0,
        )
