"""``companion far``: the end ashore of a satellite link: makes orders of 24 bytes, reads statuses of 42 bytes."""

from companion.commands.far.parser import add_parser

__all__ = ["add_parser"]
