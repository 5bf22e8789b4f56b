"""Parameters: read, set, list, and the names that changed in ArduPilot 4.7. Pure step machines.

A name that the autopilot does not have is simply not answered, so a read that times out while the link lives means
"no such parameter". Values are 32-bit floats on the wire whatever their type.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.microservices.command import Party, Retransmission, TransferOutcome
from companion.mavlink.wire.frames import Message
from companion.messages import float32

# 4.7 renamed these [ArduPilot PR #29617]; SRn_ numbered serial links from 0, MAVn_ numbers MAVLink links from 1.
_RENAMED = {"SYSID_THISMAV": "MAV_SYSID", "SYSID_MYGCS": "MAV_GCS_SYSID"}
_STREAMS = ("RAW_SENS", "EXT_STAT", "RC_CHAN", "RAW_CTRL", "POSITION", "EXTRA1", "EXTRA2", "EXTRA3", "PARAMS", "ADSB")
ALIASES: Mapping[str, str] = {
    **_RENAMED,
    **{f"SR{n}_{stream}": f"MAV{n + 1}_{stream}" for n in range(7) for stream in _STREAMS},
}
_OLD = {new: old for old, new in ALIASES.items()}

SILENCE_S = 1.5
MISSING_PER_ROUND = 20
MAX_SILENT_ROUNDS = 12


def names_of(name: str) -> tuple[str, ...]:
    """Return ``name`` and the name that the same parameter has in other versions.

    >>> names_of("MAV_SYSID")
    ('MAV_SYSID', 'SYSID_THISMAV')
    """
    other = ALIASES.get(name) or _OLD.get(name)
    return (name, other) if other else (name,)


def lookup(parameters: Mapping[str, float], name: str) -> float | None:
    """Return the value of ``name`` under any of its names, None when the autopilot has none of them."""
    return next((parameters[n] for n in names_of(name) if n in parameters), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class ParamAnswer:
    """How a read or a write ended; ``name`` is the one that the autopilot uses, ``value`` what it has now."""

    outcome: TransferOutcome
    name: str
    value: float | None = None
    param_type: int | None = None
    text: str = ""

    @property
    def is_ok(self) -> bool:
        """Read, or written and echoed."""
        return self.outcome is TransferOutcome.OK


@dataclass(frozen=True, slots=True, kw_only=True)
class ParamTable:
    """All parameters; by ``outcome`` some may never have come."""

    outcome: TransferOutcome
    values: Mapping[str, float]
    types: Mapping[str, int]
    text: str = ""

    def get(self, name: str) -> float | None:
        """Return a value under any name of the parameter."""
        return lookup(self.values, name)


class ParamRead:
    """Reads the first of several names that the autopilot answers."""

    def __init__(self, party: Party, names: Iterable[str]) -> None:
        self.result: ParamAnswer | None = None
        self._party, self._names = party, tuple(names)
        self._retry = Retransmission(first_s=0.6, give_up_s=5.0)

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._retry.wake_s

    def start(self, t_s: float) -> list[Message]:
        """Ask for every name; the one that exists answers."""
        self._retry.progress(t_s)
        return self._ask()

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take the value."""
        del t_s
        if (
            message.get_type() == "PARAM_VALUE"
            and self._party.is_from_target(message)
            and message.param_id in self._names
            and self.result is None
        ):
            self.result = ParamAnswer(
                outcome=TransferOutcome.OK,
                name=message.param_id,
                value=float(message.param_value),
                param_type=message.param_type,
            )
        return []

    def tick(self, t_s: float) -> list[Message]:
        """Ask again, or conclude that there is no such parameter."""
        if not self._retry.again(t_s):
            names = " or ".join(self._names)
            self.result = ParamAnswer(
                outcome=TransferOutcome.TIMEOUT,
                name=self._names[0],
                text=f"no answer for parameter {names} (it does not exist, or unsigned frames are ignored)",
            )
            return []
        return self._ask()

    def _ask(self) -> list[Message]:
        return [
            wire.MAVLink_param_request_read_message(*self._party.target, name.encode("ascii"), -1)
            for name in self._names
        ]


class ParamSet:
    """Writes one parameter until it is echoed with the value that was asked for."""

    def __init__(self, party: Party, name: str, value: float, param_type: int = wire.MAV_PARAM_TYPE_REAL32) -> None:
        self.result: ParamAnswer | None = None
        self._party, self._name, self._type = party, name, param_type
        self._value = float32(value)
        self._retry = Retransmission(first_s=0.6, give_up_s=5.0)
        self._other: float | None = None

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._retry.wake_s

    def start(self, t_s: float) -> list[Message]:
        """Write."""
        self._retry.progress(t_s)
        return [self._say()]

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take the echo."""
        del t_s
        if (
            message.get_type() == "PARAM_VALUE"
            and message.param_id == self._name
            and self._party.is_from_target(message)
            and self.result is None
        ):
            value = float(message.param_value)
            if abs(value - self._value) <= 1e-6 * max(1.0, abs(self._value)):
                self.result = ParamAnswer(
                    outcome=TransferOutcome.OK, name=self._name, value=value, param_type=message.param_type
                )
            else:
                self._other = value  # perhaps a late answer to an earlier read: let it be written again
        return []

    def tick(self, t_s: float) -> list[Message]:
        """Write again, or give up."""
        if self._retry.again(t_s) and not (self._other is not None and self._retry.tries > 2):
            return [self._say()]
        if self._other is not None:
            text = f"{self._name} stays {self._other:g} though {self._value:g} was written"
            self.result = ParamAnswer(outcome=TransferOutcome.REFUSED, name=self._name, value=self._other, text=text)
        else:
            self.result = ParamAnswer(
                outcome=TransferOutcome.TIMEOUT, name=self._name, text=f"no echo of parameter {self._name}"
            )
        return []

    def _say(self) -> Message:
        return wire.MAVLink_param_set_message(*self._party.target, self._name.encode("ascii"), self._value, self._type)


class ParamList:
    """Reads all parameters, and those that were lost again by their index."""

    def __init__(self, party: Party) -> None:
        self.result: ParamTable | None = None
        self._party = party
        self._by_index: dict[int, str] = {}
        self._values: dict[str, float] = {}
        self._types: dict[str, int] = {}
        self._count = 0
        self._wake_s = 0.0
        self._silent = 0

    @property
    def wake_s(self) -> float:
        """When ``tick`` is due [s]."""
        return self._wake_s

    def start(self, t_s: float) -> list[Message]:
        """Ask for all."""
        self._wake_s = t_s + SILENCE_S
        return [wire.MAVLink_param_request_list_message(*self._party.target)]

    def receive(self, t_s: float, message: Message) -> list[Message]:
        """Take a value."""
        if message.get_type() != "PARAM_VALUE" or not self._party.is_from_target(message) or self.result:
            return []
        self._values[message.param_id] = float(message.param_value)
        self._types[message.param_id] = message.param_type
        self._count = max(self._count, message.param_count)
        if message.param_index < self._count:
            self._by_index[message.param_index] = message.param_id
            self._wake_s = t_s + SILENCE_S
            self._silent = 0
        if self._count and len(self._by_index) == self._count:
            self.result = ParamTable(outcome=TransferOutcome.OK, values=self._values, types=self._types)
        return []

    def tick(self, t_s: float) -> list[Message]:
        """Ask for what is missing, or give up."""
        self._silent += 1
        self._wake_s = t_s + SILENCE_S
        missing = [i for i in range(self._count) if i not in self._by_index]
        if self._silent > MAX_SILENT_ROUNDS or (not self._by_index and self._silent > 4):
            text = (
                f"{len(missing)} of {self._count} parameters never came"
                if self._count
                else ("no parameter replies (is signing enabled on the autopilot?)")
            )
            self.result = ParamTable(outcome=TransferOutcome.TIMEOUT, values=self._values, types=self._types, text=text)
            return []
        if not self._by_index:
            return [wire.MAVLink_param_request_list_message(*self._party.target)]
        return [
            wire.MAVLink_param_request_read_message(*self._party.target, b"", i) for i in missing[:MISSING_PER_ROUND]
        ]
