"""``companion setup``: from a computer that is wired to an autopilot to a service that can be started."""

from companion.commands.setup.parser import add_parser

__all__ = ["add_parser"]
