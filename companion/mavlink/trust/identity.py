"""Who the autopilot says it is, folded from its messages: type, board, frame. Pure.

A system id is no identity: every ArduPilot vehicle is delivered with id 1. The board's UID is one. It is asked for at
the start, again after a reboot or a gap in which the autopilot may have become another, and now and then.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

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
    other_uid: str | None = None      # a UID that differs, told once

    def told(self, system: int, uid: str) -> Identity:
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
            self, frame_class=self.frame_class if frame is None else int(frame),
            sails=self.sails if sails is None else sails != 0.0)
