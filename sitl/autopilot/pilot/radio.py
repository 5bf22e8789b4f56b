"""The remote control in somebody's hand: sticks, mode switch, and the receiver's silence."""

from __future__ import annotations

import math

from companion.messages import Mode
from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.helm import Helm

# Sticks at rest and the mode switch in its highest place, as SITL's 16 channels [us].
CHANNELS_US = (1500, 1500, 1500, 1500, 1800, 1000, 1000, 1800, *([1500] * 8))
# The middle of each of the mode switch's six places [us]: MODE1 to MODE6.
SWITCH_US = (1165, 1295, 1425, 1555, 1685, 1800)
SILENT_S = 0.5   # without pulses for longer than this the receiver has lost its transmitter


class Radio:
    """What the receiver hears. A receiver that hears nothing holds its last values."""

    def __init__(self, core: Core, helm: Helm) -> None:
        self._core = core
        self._helm = helm
        self.channels_us: list[int] = list(CHANNELS_US)
        self._lost_s = math.inf

    @property
    def is_switched_off(self) -> bool:
        """Whether the transmitter is silent, noticed or not."""
        return self._lost_s < math.inf

    @property
    def has_failed(self) -> bool:
        """Whether the autopilot counts the radio as lost."""
        return self._core.t_s - self._lost_s > SILENT_S

    def switch(self, *, is_on: bool) -> None:
        """Switch the transmitter on or off, or carry it out of range."""
        if is_on:
            self._lost_s = math.inf
        elif not self.is_switched_off:
            self._lost_s = self._core.t_s

    def select(self, mode: Mode) -> bool:
        """Move the mode switch to ``mode``; False when the transmitter is off or no place of the switch has it."""
        get = self._core.parameters.flag
        places = [n for n in range(6) if get(f"MODE{n + 1}") == mode]
        channel = get("MODE_CH")
        if self.is_switched_off or not places or not 1 <= channel <= len(self.channels_us):
            return False
        self.channels_us[channel - 1] = SWITCH_US[places[0]]
        return self._helm.set_mode(int(mode))
