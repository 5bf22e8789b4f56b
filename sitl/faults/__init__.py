"""Trouble: what is made to go wrong, with links, sensors, disks, processes and people."""

from sitl.faults.computer_faults import FaultyPlanner, KillablePlanner
from sitl.faults.ground_station import REDRAWN, give_order, redraw, set_parameter
from sitl.faults.hostile import HOSTILITIES, measure, rows, written
from sitl.faults.injection import Observer, SimulatedWorld, break_vane, channel, inject
from sitl.faults.link_faults import LINK_EVENTS, Relay, impair
from sitl.faults.satellite_link import KEY, Satellite
from sitl.faults.spoofing import FORGERIES, ManInTheMiddle, SpoofingPlan

__all__ = [
    "FORGERIES",
    "HOSTILITIES",
    "KEY",
    "LINK_EVENTS",
    "REDRAWN",
    "FaultyPlanner",
    "KillablePlanner",
    "ManInTheMiddle",
    "Observer",
    "Relay",
    "Satellite",
    "SimulatedWorld",
    "SpoofingPlan",
    "break_vane",
    "channel",
    "give_order",
    "impair",
    "inject",
    "measure",
    "redraw",
    "rows",
    "set_parameter",
    "written",
]
