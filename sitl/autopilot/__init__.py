"""The simulated autopilot: a stand-in for ArduRover's sailboat, with the boat and the sea it floats on.

A pure core and a thin shell. The core turns bytes and time into bytes::

    autopilot = SimulatedAutopilot(AutopilotConfig(is_warm=True), Constant(0.0, 5.0), seed=1)
    autopilot.receive(link_id, data)          # MAVLink 2 from a companion or a ground station, any chunks
    autopilot.step(0.02)                      # simulated time passes, always in whole loops of 20 ms
    data = autopilot.take_outgoing(link_id)   # what it wants to send there
    autopilot.truth                           # frozen value for judges and plots

The shell joins it to transports and to the event loop's clock, whatever that is::

    link = MemoryLink(seed=1)                                  # or "udpin:0.0.0.0:14550", "udpout:..", "tcpin:.."
    async with serve(autopilot, [link.far, "tcpin:127.0.0.1:5760"]) as server:
        ...                                                    # the companion opens link.near
        server.autopilot.truth

``serve`` raises what went wrong in it when its block ends. Faults for scenarios: ``autopilot.reboot()``,
``set_vane(VaneFault)``, ``set_gps(GpsFault)``, ``set_battery(volts)``, ``set_current(set_to_rad, drift_mps)``,
``set_mode(Mode)`` (the operator's switch), ``hear_vessel(Vessel)`` (AIS); on the link: ``MemoryLink.impairment``,
``cut`` and ``mend``.
"""

from sitl.autopilot.autopilot import SimulatedAutopilot
from sitl.autopilot.boat.parameters import Parameters, check_parameters
from sitl.autopilot.boat.sail_trial import no_go_half_rad, settled_polar, tack_loss_s
from sitl.autopilot.boat.vehicle import Vehicle
from sitl.autopilot.config import (
    EPOCH_S,
    FRAME_M,
    HOME,
    AutopilotConfig,
    Departures,
    GpsFault,
    Sensors,
    Truth,
    VaneFault,
    VaneState,
    Waves,
)
from sitl.autopilot.memory_link import FrameStream, Impairment, MemoryEnd, MemoryLink, RadioChannel
from sitl.autopilot.protocol.handlers import FORCED_REBOOT
from sitl.autopilot.protocol.telemetry import AisVessel
from sitl.autopilot.server import serve

__all__ = [
    "EPOCH_S",
    "FORCED_REBOOT",
    "FRAME_M",
    "HOME",
    "AisVessel",
    "AutopilotConfig",
    "Departures",
    "FrameStream",
    "GpsFault",
    "Impairment",
    "MemoryEnd",
    "MemoryLink",
    "Parameters",
    "RadioChannel",
    "Sensors",
    "SimulatedAutopilot",
    "Truth",
    "VaneFault",
    "VaneState",
    "Vehicle",
    "Waves",
    "check_parameters",
    "no_go_half_rad",
    "serve",
    "settled_polar",
    "tack_loss_s",
]
