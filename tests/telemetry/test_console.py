"""The console: whoever reads, or does not, nobody waits for it and nothing is raised."""

import os
import pty
import time

import pytest

from companion.telemetry import console as module
from companion.telemetry.console import MOST_WAITING, Console


class Stream:
    """What the console asks of ``sys.stdout``."""

    encoding = "utf-8"

    def __init__(self, fd):
        self._fd = fd

    def flush(self):
        pass

    def isatty(self):
        return os.isatty(self._fd)

    def fileno(self):
        return self._fd


def test_it_prints_in_order_and_waits_for_the_last_words():
    reader, writer = os.pipe()
    with Console(Stream(writer)) as console:
        for k in range(10):
            console.write(f"line {k} ±\n")
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8") as file:
        assert file.read().splitlines() == [f"line {k} ±" for k in range(10)]


def test_what_is_printed_can_do_nothing_to_the_terminal():
    reader, writer = os.pipe()
    with Console(Stream(writer)) as console:
        console.write("Nab\x1b[2J\udcff\n")
        console.control("\x1b[J")
    os.close(writer)
    with os.fdopen(reader, encoding="utf-8") as file:
        assert file.read() == "Nab\\x1b[2J\\udcff\n\x1b[J"


def test_a_reader_that_has_gone():
    reader, writer = os.pipe()
    os.close(reader)
    with Console(Stream(writer)) as console:
        for _ in range(100):
            console.write("nobody hears this\n")
    os.close(writer)


@pytest.mark.parametrize("pipe", [os.pipe, pty.openpty], ids=["pipe", "terminal stopped with Ctrl-S"])
def test_a_reader_that_reads_no_more_holds_nobody_up(pipe, monkeypatch):
    """The loop waited for the terminal, and the boat with it."""
    monkeypatch.setattr(module, "LAST_WORDS_S", 0.2)
    reader, writer = pipe()
    began = time.monotonic()
    with Console(Stream(writer)) as console:
        for _ in range(4 * MOST_WAITING):
            console.write(2000 * "x" + "\n")
        assert time.monotonic() - began < 0.5
    assert time.monotonic() - began < 4.0
    os.close(reader)


def test_a_full_disk_behind_the_redirection():
    fd = os.open("/dev/full", os.O_WRONLY)
    with Console(Stream(fd)) as console:
        console.write("lost\n")
    os.close(fd)


@pytest.mark.parametrize("stream", [None, Stream(999_999)], ids=["none", "closed"])
def test_a_process_that_was_started_without_an_output(stream):
    with Console(stream) as console:
        console.write("lost\n")
        assert not console.isatty()


def test_what_the_encoding_lacks_is_replaced():
    reader, writer = os.pipe()
    stream = Stream(writer)
    stream.encoding = "ascii"
    with Console(stream) as console:
        console.write("270±5°\n")
    assert os.read(reader, 100) == b"270?5?\n"
