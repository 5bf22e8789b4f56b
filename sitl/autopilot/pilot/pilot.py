"""The pilot: all that decides aboard, made anew at every power-up."""

from __future__ import annotations

import math
from collections.abc import Callable

from companion.messages import Mode
from sitl.autopilot.pilot.arming import Arming
from sitl.autopilot.pilot.core import Core
from sitl.autopilot.pilot.ekf import Ekf
from sitl.autopilot.pilot.failsafe import Failsafe
from sitl.autopilot.pilot.fence import Fence
from sitl.autopilot.pilot.helm import Helm
from sitl.autopilot.pilot.radio import Radio
from sitl.autopilot.pilot.rally import Rally
from sitl.autopilot.pilot.startup import Startup
from sitl.autopilot.pilot.storage import Storage
from sitl.world import Constant


class Pilot:
    """The parts, each made of those it needs. ``tell_mode`` sends a heartbeat at once."""

    def __init__(self, core: Core, tell_mode: Callable[[], None]) -> None:
        self.core = core
        self._tell_mode = tell_mode
        self.fence = Fence(core)
        self.rally = Rally(core)
        self.helm = Helm(core, self.fence, self.rally, self._mode_changed)
        self.ekf = Ekf(core, self.helm)
        self.radio = Radio(core, self.helm)
        self.arming = Arming(core, self.helm, self.fence, self.ekf)
        self.failsafe = Failsafe(core, self.helm, self.arming, self.fence, self.radio, self.ekf)
        self.storage = Storage(core, self.helm.mission, self.fence, self.rally)
        self.startup = Startup(core, self.ekf)

    def _mode_changed(self) -> None:
        self._tell_mode()
        self.failsafe.mode_changed()

    @property
    def due_s(self) -> float:
        """When there is something to do."""
        return min(self.startup.due_s, self.helm.due_s, self.failsafe.due_s, self.fence.due_s)

    def refuse(self, what: str) -> None:
        """Refuse to arm ("arm"), or a mode by its name, from now on; empty: neither."""
        self.arming.is_refused = what == "arm"
        self.helm.refused = Mode[what] if what and what != "arm" else None

    def parameter_changed(self, name: str) -> None:
        """Act on a parameter that somebody set."""
        core, get = self.core, self.core.parameters.get
        if name in {"SIM_WIND_SPD", "SIM_WIND_DIR"}:
            core.vehicle.wind = Constant(math.radians(get("SIM_WIND_DIR")), max(0.0, get("SIM_WIND_SPD")))
        elif name == "FENCE_ENABLE":
            self.fence.switch(enabled=core.parameters.flag(name) == 1)
        core.vehicle.load_parameters()
