"""A voyage on a terminal: the dashboard of ``companion watch``, drawn as values, and the terminal that shows it."""

from companion.terminal.dashboard import Shown, draw, event_words
from companion.terminal.history import History
from companion.terminal.keys import Helm, Key, words_of
from companion.terminal.line import line_of
from companion.terminal.screen import Frame, changes
from companion.terminal.tty import Terminal, can_draw

__all__ = [
    "Frame", "Helm", "History", "Key", "Shown", "Terminal", "can_draw", "changes", "draw", "event_words", "line_of",
    "words_of",
]
