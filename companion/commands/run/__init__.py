"""``companion run``: sail a mission."""

from companion.commands.run.parser import add_parser

__all__ = ["add_parser"]
