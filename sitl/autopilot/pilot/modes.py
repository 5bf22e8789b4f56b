"""The modes that the boat knows, and what it does within them."""

from __future__ import annotations

import enum

from companion.messages import Mode

# Entering one of these gives the navigation its limits of acceleration and jerk.
NAVIGATING = frozenset({Mode.AUTO, Mode.GUIDED, Mode.RTL, Mode.SMART_RTL})
POSITION_MODES = frozenset({Mode.AUTO, Mode.GUIDED, Mode.RTL, Mode.SMART_RTL, Mode.LOITER})
KNOWN = frozenset({
    Mode.MANUAL, Mode.ACRO, Mode.STEERING, Mode.HOLD, Mode.LOITER, Mode.AUTO, Mode.RTL, Mode.SMART_RTL, Mode.GUIDED,
})


class Task(enum.Enum):
    """What the boat is doing within its mode."""

    LEG = "leg"                # to a waypoint of the mission
    RTL = "rtl"
    GUIDED = "guided"          # to a position that was sent
    SETPOINT = "setpoint"      # a heading or turn rate that was sent
    LOITER = "loiter"
    HOLD = "hold"
