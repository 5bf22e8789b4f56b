"""Trouble: what is made to go wrong, with links, sensors, disks, processes and people."""

from sitl.faults.computer_faults import FaultyPlanner, KillablePlanner
from sitl.faults.ground_station import REDRAWN, give_order, redraw, set_parameter
from sitl.faults.injection import Observer, SimulatedWorld, break_vane, channel, inject
from sitl.faults.link_faults import LINK_EVENTS, Relay, impair
from sitl.faults.satellite_link import KEY, Satellite
from sitl.faults.spoofing import FORGERIES, Forger, Forgery

__all__ = [
    "FORGERIES",
    "KEY",
    "LINK_EVENTS",
    "REDRAWN",
    "FaultyPlanner",
    "Forger",
    "Forgery",
    "KillablePlanner",
    "Observer",
    "Relay",
    "Satellite",
    "SimulatedWorld",
    "break_vane",
    "channel",
    "give_order",
    "impair",
    "inject",
    "redraw",
    "set_parameter",
]
