"""Stopped by the autopilot's position failsafe: nobody's wish, so the boat is ours to sail on.

ArduRover puts the boat in HOLD when its filter loses the position, says so, and never restores the mode. A sailboat in
HOLD drifts, at a speed of 1 to 2 m/s in a breeze. With the permission to set modes the skipper waits until the filter
is well and the position can be believed, plans from where the boat has drifted to, and asks for AUTO.
"""

from __future__ import annotations

from companion.messages import Mode, StatusText
from companion.skipper.turn import Turn

TEXTS = ("EKF variance", "EKF failsafe")   # said as it acts; on a bad link one of the two may arrive
OVER = "cleared"
CRITICAL = 5          # MAV_STATE of a heartbeat while a failsafe is active
TOLD_S = 5.0          # the mode changes in the same second; its heartbeat may be late


def note(turn: Turn, text: StatusText) -> None:
    """Remember that the autopilot said it has lost its position."""
    if text.source_component == 1 and text.text.startswith(TEXTS) and OVER not in text.text:
        turn.update(failsafe_s=turn.t_s)


def has_stopped(turn: Turn) -> bool:
    """Return whether HOLD is the failsafe's doing, and ours to end."""
    status = turn.autopilot
    return (
        status is not None and status.mode is Mode.HOLD and status.is_armed
        and turn.t_s - turn.state.failsafe_s <= TOLD_S and turn.snapshot.permissions.may_set_mode
    )


def waits_for(turn: Turn) -> str:
    """Return what is missing before the boat can be planned for; empty: nothing."""
    status = turn.autopilot
    if status is None or not status.ekf_ok or status.system_status == CRITICAL:
        return "stopped: waiting until the autopilot's position filter is well"
    if turn.boat_en is None:
        return "stopped: waiting for a position that can be believed"
    return ""
