"""Conversations with the autopilot as pure step machines: commands, lists, parameters, files."""

from companion.mavlink.microservices.command import CommandAnswer, Machine, Party, TransferOutcome
from companion.mavlink.microservices.parameters import lookup

__all__ = ["CommandAnswer", "Machine", "Party", "TransferOutcome", "lookup"]
