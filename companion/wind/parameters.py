"""What the autopilot's WNDVN_ parameters say about its wind.

ArduRover's AP_WindVane measures apparent wind (low-passed by WNDVN_DIR_FILT and WNDVN_SPEED_FILT), adds the
ground velocity of its EKF and low-passes the result again by WNDVN_TRUE_FILT: 0.05 Hz by default, a time constant
of 3.2 s. With no speed sensor the "true" wind is vane plus heading at speed 0; with a vane of type 1 or 2 it is a
direction remembered from arming or from the RC; below WNDVN_SPEED_MIN it is held.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

VANE_TYPE = "WNDVN_TYPE"
VANE_OFFSET = "WNDVN_DIR_OFS"  # [deg] that the autopilot adds to what the vane says ...
OFFSET_TYPES = (3.0, 4.0)  # ... where that is an analog or an NMEA one, and to no other


@dataclass(frozen=True, slots=True, kw_only=True)
class VaneParameters:
    """The vane's set-up; ``None`` is not known. The filter is its corner frequency [Hz]; at most 0 is none."""

    vane_type: int | None = None
    speed_type: int | None = None
    speed_min_mps: float | None = None
    true_filter_hz: float | None = 0.05

    @classmethod
    def from_mapping(cls, parameters: Mapping[str, float]) -> VaneParameters:
        """Read ``{"WNDVN_TYPE": 3.0, ...}``; other names are ignored, missing ones stay at the firmware's default."""

        def number(name: str, default: float | None) -> float | None:
            value = parameters.get(name)
            return float(value) if value is not None and math.isfinite(value) else default

        vane, speed = number(VANE_TYPE, None), number("WNDVN_SPEED_TYPE", None)
        return cls(
            vane_type=None if vane is None else round(vane),
            speed_type=None if speed is None else round(speed),
            speed_min_mps=number("WNDVN_SPEED_MIN", None),
            true_filter_hz=number("WNDVN_TRUE_FILT", 0.05),
        )

    @property
    def true_tau_s(self) -> float:
        """Time constant of the low pass on WIND [s], 0 without one."""
        hz = self.true_filter_hz
        return 1.0 / (2.0 * math.pi * hz) if hz is not None and hz > 0.0 else 0.0

    @property
    def is_direction_invented(self) -> bool:
        """Whether there is no vane behind the direction (none, home heading, RC)."""
        return self.vane_type in {0, 1, 2}

    @property
    def has_no_speed_sensor(self) -> bool:
        """Whether the speed is known to be unmeasured."""
        return self.speed_type == 0
