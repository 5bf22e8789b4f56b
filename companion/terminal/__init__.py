"""A voyage on a terminal: the dashboard of ``companion watch``, drawn as values, and the terminal that shows it."""

from companion.terminal.dashboard import History, Shown, draw, event_words, line_of
from companion.terminal.keys import KeyCommands, words_of
from companion.terminal.screen import Frame, Terminal, can_draw, changes

__all__ = [
    "Frame",
    "History",
    "KeyCommands",
    "Shown",
    "Terminal",
    "can_draw",
    "changes",
    "draw",
    "event_words",
    "line_of",
    "words_of",
]
