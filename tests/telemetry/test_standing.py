"""A line that stands: rewritten on a terminal, and in a file now and then, the last one always."""

import io

import pytest

from companion.telemetry import console
from companion.telemetry.console import StatusLine


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.fixture
def clock(monkeypatch):
    now = [100.0]
    monkeypatch.setattr(console.time, "monotonic", lambda: now[0])
    return now


def test_on_a_terminal_each_stands_in_place_of_the_last_and_covers_it():
    out = Terminal()
    line = StatusLine(out, 30.0)
    line.show("12 of 100")
    line.show("9 of 9")
    line.stay("something else")
    line.end()
    assert out.getvalue() == "\r12 of 100   \r9 of 9      \rsomething else\n\n"


def test_in_a_file_it_is_written_now_and_then_and_what_it_was_at_last(clock):
    out = io.StringIO()
    line = StatusLine(out, 30.0)
    for second in range(71):
        clock[0] = 100.0 + second
        line.show(f"{second}")
    line.stay("something else")
    line.end()
    assert out.getvalue().split("\n") == ["0", "30", "60", "something else", "70", ""]


def test_the_same_is_not_said_twice(clock):
    out = io.StringIO()
    line = StatusLine(out, 30.0)
    line.show("still")
    clock[0] += 60.0
    line.show("still")
    line.end()
    assert out.getvalue() == "still\n"
    quiet = Terminal()
    StatusLine(quiet, 30.0).end()
    assert quiet.getvalue() == ""
