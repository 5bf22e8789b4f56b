"""What of the frames on a link is ours to hear: who is who, repeats, echoes, forgeries. Pure."""

from __future__ import annotations

import enum
from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.trust.census import Census, Standing
from companion.mavlink.trust.link_stats import LinkStats
from companion.mavlink.trust.witness import Witness
from companion.mavlink.wire import codec
from companion.mavlink.wire.frames import Drop, Message

Objection = Callable[[float, Message], Drop | None]

OWN_COMPONENT = 191   # MAV_COMP_ID_ONBOARD_COMPUTER
TOOL_COMPONENT = 192  # ..._COMPUTER2: a tool that looks in beside a companion that sails
_DUPLICATE_WINDOW = 32
_COMMANDS = frozenset({"COMMAND_LONG", "COMMAND_INT"})


@dataclass(frozen=True, slots=True)
class LinkIdentity:
    """Who we are. ``system`` None: the autopilot's own, detected. ``token``: tells our heartbeat from another's."""

    system: int | None = None
    component: int = OWN_COMPONENT
    token: int = 0


# Who listens or gives orders through a link of its own, ashore. Not 255: the autopilot takes that for its ground
# station, whose silence afterwards sets off a failsafe.
SHORE = LinkIdentity(system=254, component=190)


class Heard(enum.Enum):
    """What a message is to us."""

    NOTHING = "nothing"    # not ours to hear; counted
    OURS = "ours"          # of the autopilot's system, and believed
    ORDER = "order"        # of another system: a command to us by our ids


class Reception:
    """Judges every good frame of one link, in the order of arrival.

    Args:
        identity: our ids.
        wanted: the autopilot's system id, None: the only one that is heard.
        objection: says what is wrong with a message of the autopilot's system, None: nothing; asked once for each.
        stats: where what is not heard is counted.
    """

    def __init__(
        self, identity: LinkIdentity, wanted: int | None, objection: Objection | None, stats: LinkStats,
    ) -> None:
        self.census = Census(wanted)
        self.own_system = identity.system or wanted or 1
        self.target: int | None = None
        self.refusal = ""
        self._identity, self._stats = identity, stats
        self._objection = objection or _of_the_autopilot(Witness())
        self.expects_burst = False   # more frames were asked for at once than a stream has: their numbers prove nothing
        self._unheard: Counter[int] = Counter()
        self._recent: dict[tuple[int, int, int, int, int], None] = {}   # the last frames, oldest first

    @property
    def is_decided(self) -> bool:
        """Our autopilot was found, or it cannot be told which it is."""
        return self.target is not None or bool(self.refusal)

    def unheard(self, system: int) -> int:
        """Return how many messages of ``system`` came before it was known to be ours."""
        return self._unheard[system]

    def is_repeat(self, message: Message) -> bool:
        """Return whether the very frame was here just now."""
        header = message.get_header()
        key = (header.srcSystem, header.srcComponent, header.seq, header.msgId, message.get_crc() or 0)
        if key in self._recent:
            self._stats.dropped[Drop.DUPLICATE] += 1
            return True
        self._recent[key] = None
        if len(self._recent) > _DUPLICATE_WINDOW:
            del self._recent[next(iter(self._recent))]
        return False

    def is_out_of_turn(self, message: Message) -> bool:
        """Return whether a message of the autopilot's carries no time and is not the very next after the last heard.

        That proves nothing of it while messages are lost. But where they only waited for us, they come in order.
        """
        system, component = message.get_srcSystem(), message.get_srcComponent()
        if system != self.target or component != codec.AUTOPILOT_COMPONENT:
            return False
        last = self._stats.last_seq.get((system, component))
        is_timed = getattr(message, "time_boot_ms", None) is not None
        return not is_timed and last is not None and message.get_seq() != (last + 1) % 256

    def choose(self, t_s: float) -> None:
        """Take the autopilot that is ours, once it is known."""
        if self.is_decided:
            return
        choice = self.census.choice(t_s)
        if choice.standing is Standing.LISTENING:
            return
        self.refusal, self.target = choice.reason, choice.system
        if choice.system is not None and self._identity.system is None:
            self.own_system = choice.system

    def hear(self, t_s: float, message: Message) -> Heard:
        """Return what ``message``, heard at ``t_s`` [s], is to us."""
        system, component, kind = message.get_srcSystem(), message.get_srcComponent(), message.get_type()
        if kind == "HEARTBEAT":
            self.census.take(t_s, message)
        if self.target is None:
            self.choose(t_s)
        if component == self._identity.component:
            self._notice_companion(t_s, message, kind)
            if system in {self.target, self.own_system}:
                self._stats.dropped[Drop.OWN_IDS] += 1   # an echo of what we said, or a second companion's
                return Heard.NOTHING
        if system != self.target:
            if self.target is None and component != self._identity.component:
                self._unheard[system] += 1
            return self._of_another(message, kind)
        objection = self._objection(t_s, message)
        if objection is not None and not (self.expects_burst and objection is Drop.OUT_OF_STEP):
            self._stats.dropped[objection] += 1
            return Heard.NOTHING
        self._stats.count(system, component, message.get_seq())
        return Heard.OURS

    def is_for_us_alone(self, message: Message) -> bool:
        """Return whether a message with a target means this component by name."""
        return bool(
            message.target_system == self.own_system and message.target_component == self._identity.component)

    def _notice_companion(self, t_s: float, message: Message, kind: str) -> None:
        """Tell a second companion from the echo of our own heartbeat."""
        if kind == "HEARTBEAT" and message.type == wire.MAV_TYPE_ONBOARD_CONTROLLER and (
            message.custom_mode != self._identity.token
        ):
            self.census.take_companion(t_s, message)

    def _of_another(self, message: Message, kind: str) -> Heard:
        """Other systems are not ours to listen to, except a ground station that commands us by our ids."""
        if kind in _COMMANDS and self.is_for_us_alone(message):
            return Heard.ORDER
        if kind != "HEARTBEAT" or message.type != wire.MAV_TYPE_GCS:
            self._stats.dropped[Drop.FOREIGN_SYSTEM] += 1
        return Heard.NOTHING


def _of_the_autopilot(witness: Witness) -> Objection:
    """Return the judgement of one who has no key: the autopilot's own messages must fit together."""
    def objection(t_s: float, message: Message) -> Drop | None:
        return witness.objection(t_s, message) if message.get_srcComponent() == codec.AUTOPILOT_COMPONENT else None

    return objection
