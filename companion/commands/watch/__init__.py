"""``companion watch``: a dashboard for a terminal, ashore over the radio or on board beside ``companion run``."""

from companion.commands.watch.command import add_parser

__all__ = ["add_parser"]
