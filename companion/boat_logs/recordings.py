"""Recordings of an autopilot, message by message: .tlog and .BIN, by the autopilot's own clock, of one boat."""

from __future__ import annotations

import contextlib
from collections.abc import Collection, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat_logs.rows import REBOOT_BACK_S, UnusableLogError
from companion.mavlink.tlog import read_tlog
from companion.mavlink.wire import Dialect, since_boot_s

JUMP_S = 5.0  # the logger's clock against the autopilot's
_BIN_HEAD = bytes([0xA3, 0x95, 0x80])  # a log describes its own format first
DAMAGED = "it is cut off or damaged: what is before that is used"


@dataclass(slots=True)
class Tlog:
    """The autopilot's messages of a .tlog in its parts, those of ``numbers`` alone.

    Iterated over it yields (time, message): the autopilot's own clock, set once by that of whoever wrote the log and
    again after a reboot [Unix s]. Raises UnusableLogError in the middle of it: a second boat was heard.
    """

    files: list[Path]
    numbers: AbstractSet[int]
    systems: set[int] = field(default_factory=set)
    jumps: int = 0  # of the logger's clock, by up to ``most_s``
    most_s: float = 0.0

    @property
    def system(self) -> int | None:
        """The autopilot's system number; None: it never said that it is one."""
        return next(iter(self.systems), None)

    def __iter__(self) -> Iterator[tuple[float, Any]]:
        """Yield when each message was sent [Unix s], and the message."""
        offset_s, last_boot_s, last_heard_s = None, 0.0, 0.0
        for heard_s, message in self._heard():
            kind = message.get_type()
            if kind == "HEARTBEAT" and message.autopilot != wire.MAV_AUTOPILOT_INVALID:
                self._is_of(message.get_srcSystem())
            boot_ms = getattr(message, "time_boot_ms", None)
            if boot_ms is not None:
                boot_s = since_boot_s(boot_ms, None if offset_s is None else last_boot_s + heard_s - last_heard_s)
                if offset_s is None or boot_s < last_boot_s - REBOOT_BACK_S:
                    offset_s = heard_s - boot_s
                elif kind == "GLOBAL_POSITION_INT" and abs(heard_s - boot_s - offset_s) > JUMP_S:
                    self.jumps, self.most_s = self.jumps + 1, max(self.most_s, abs(heard_s - boot_s - offset_s))
                last_boot_s, last_heard_s = boot_s, heard_s
            yield heard_s if offset_s is None else last_boot_s + offset_s, message

    def _is_of(self, system: int) -> None:
        self.systems.add(system)
        if len(self.systems) > 1:
            said = " and ".join(str(s) for s in sorted(self.systems))
            raise UnusableLogError(f"it tells of two boats, systems {said}: record them apart")

    def _heard(self) -> Iterator[tuple[float, Any]]:
        dialect = Dialect(None)
        for record in (r for file in self.files for r in read_tlog(file)):
            frame = record.frame
            number = frame[5] if frame[0] == 0xFE else frame[7] | frame[8] << 8 | frame[9] << 16
            if number not in self.numbers:
                continue
            try:
                message = dialect.decode(bytearray(frame))
            except wire.MAVError:
                continue
            if message.get_srcComponent() == 1:
                yield record.unix_us / 1e6, message


@contextlib.contextmanager
def dataflash(path: Path, data: bytes) -> Iterator[Any]:
    """Open an autopilot's own log. Raises UnusableLogError: it is none, or lacks columns that are read."""
    from pymavlink import DFReader

    if data[:3] != _BIN_HEAD:
        raise UnusableLogError("it is no .BIN log: it does not begin as one")
    try:
        log = DFReader.DFReader_binary(str(path))
    except Exception as error:  # it raises what its parsing happens to meet
        raise UnusableLogError(f"it is no .BIN log ({str(error)[:60] or type(error).__name__})") from None
    try:
        yield log
    except AttributeError as missing:
        raise UnusableLogError(f"its messages are another release's: they have no column {missing}") from None
    finally:
        log.close()


def messages_of(log: Any, kinds: Collection[str], notes: list[str]) -> Iterator[tuple[float, str, Any]]:
    """Yield (time since boot [s], kind, message). What is cut off at its end is left out, and noted."""
    while True:
        try:
            message = log.recv_match(type=list(kinds))
        except Exception:  # as above
            notes.append(DAMAGED)
            return
        if message is None:
            return
        yield message.TimeUS / 1e6, message.get_type(), message


@dataclass(slots=True)
class State:
    """Whether an autopilot is armed, and its mode, as a .BIN tells them."""

    is_armed: bool = True
    mode: int = -1

    def take(self, kind: str, message: Any) -> None:
        """Take an ARM or a MODE."""
        if kind == "ARM":
            self.is_armed = bool(message.ArmState)
        elif kind == "MODE":
            self.mode = int(message.ModeNum)
