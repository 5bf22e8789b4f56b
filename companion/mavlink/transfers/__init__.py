"""Conversations with the autopilot as pure step machines: commands, lists, parameters, files."""

from companion.mavlink.transfers.commands import CommandAnswer
from companion.mavlink.transfers.machines import Machine, Outcome, Party
from companion.mavlink.transfers.params import lookup

__all__ = ["CommandAnswer", "Machine", "Outcome", "Party", "lookup"]
