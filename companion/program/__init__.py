"""What the command lines of this project share: how they load and end, the values of their options, missing extras."""

from companion.program.commands import INTERRUPTED, ExtraCommands, Parser, Program, control, with_negative_values

__all__ = ["INTERRUPTED", "ExtraCommands", "Parser", "Program", "control", "with_negative_values"]
