"""Conversations with the autopilot as pure step machines: commands, lists, parameters, files."""

from companion.mavlink.transfers.commands import CommandAnswer
from companion.mavlink.transfers.machines import Outcome
from companion.mavlink.transfers.params import lookup

__all__ = ["CommandAnswer", "Outcome", "lookup"]
