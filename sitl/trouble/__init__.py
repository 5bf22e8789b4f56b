"""Trouble: what is made to go wrong, with links, sensors, disks, processes and people."""

from sitl.trouble.befalls import Observer, World, break_vane, channel, happen
from sitl.trouble.crew import DRAWN, draw, give_order, set_parameter
from sitl.trouble.forgeries import FORGERIES
from sitl.trouble.fragile import FragilePlanner, MortalPlanner
from sitl.trouble.hostile import HOSTILITIES, measure, rows, written
from sitl.trouble.man_in_the_middle import Middle, Plan
from sitl.trouble.relay import LINK_EVENTS, Relay, befall
from sitl.trouble.satellite import KEY, Satellite

__all__ = [
    "DRAWN",
    "FORGERIES",
    "HOSTILITIES",
    "KEY",
    "LINK_EVENTS",
    "FragilePlanner",
    "Middle",
    "MortalPlanner",
    "Observer",
    "Plan",
    "Relay",
    "Satellite",
    "World",
    "befall",
    "break_vane",
    "channel",
    "draw",
    "give_order",
    "happen",
    "measure",
    "rows",
    "set_parameter",
    "written",
]
