"""``companion watch`` as a process on a terminal (a pty, read by pyte): redraw, resize, keys, silence."""

import contextlib
import fcntl
import json
import os
import pty
import select
import signal
import socket
import struct
import subprocess
import sys
import termios
import threading
import time
from dataclasses import replace
from pathlib import Path

import msgspec
import pyte
import pytest

from companion.terminal.screen import ENTER, LEAVE
from companion.view.values import OrdersView
from tests.terminal.test_dashboard import VIEW

PATIENCE_S = 30.0
# Ctrl-C and a change of its size come as signals to who has the terminal as his own.
OWN_TERMINAL = """import fcntl, termios, sys
fcntl.ioctl(0, termios.TIOCSCTTY, 0)
from companion.cli import main
sys.exit(main())"""


class Boat:
    """The socket of a companion that is not one: it tells a view again and again, and answers orders."""

    def __init__(self, path, permitted=("all",)):
        self.orders, self.is_silent, self.permitted = [], False, permitted
        self._server = socket.socket(socket.AF_UNIX)
        self._server.bind(str(path))
        self._server.listen()
        self._is_over = False
        self._threads = [threading.Thread(target=self._accept, daemon=True)]
        self._threads[0].start()

    def _accept(self):
        with contextlib.suppress(OSError):
            while True:
                wire, _ = self._server.accept()
                thread = threading.Thread(target=self._talk, args=(wire,), daemon=True)
                self._threads.append(thread)
                thread.start()

    def _talk(self, wire):
        with wire, contextlib.suppress(OSError):
            words = wire.makefile().readline().strip()
            if words != "watch":
                self.orders.append(words)
                wire.sendall(json.dumps({"result": "done", "text": f"so be it, {words}"}).encode() + b"\n")
                return
            number, is_silent = 0, False
            while not self._is_over:
                if not is_silent:
                    number += 1
                    view = replace(
                        VIEW,
                        t_s=600.0 + number,
                        orders=OrdersView(permitted=self.permitted),
                        age_s=8.0 if self.is_silent else 0.4,
                    )
                    wire.sendall(msgspec.json.encode({"view": view, "events": ()}) + b"\n")
                is_silent = self.is_silent  # its last word is old already: a test waits less
                time.sleep(0.1)

    def close(self):
        self._is_over = True
        self._server.shutdown(socket.SHUT_RDWR)
        self._server.close()
        for thread in self._threads:
            thread.join(5.0)


class Terminal:
    """A pty of 80x24 with a program on it."""

    def __init__(self, *words, columns=80, rows=24):
        self.master, slave = pty.openpty()
        self.size = (columns, rows)
        self._set_size(slave)
        self.before = termios.tcgetattr(slave)
        self.screen = pyte.Screen(columns, rows)
        self.stream = pyte.ByteStream(self.screen)
        self.data = b""
        self.process = subprocess.Popen(
            [sys.executable, "-c", OWN_TERMINAL, "watch", *words],
            stdin=slave,
            stdout=slave,
            stderr=slave,
            start_new_session=True,
            env={**os.environ, "TERM": "xterm"},
        )
        self.slave = slave

    def _set_size(self, fd):
        fcntl.ioctl(fd, termios.TIOCSWINSZ, struct.pack("HHHH", self.size[1], self.size[0], 0, 0))

    def resize(self, columns, rows):
        self.size = (columns, rows)
        self.screen.resize(rows, columns)
        self._set_size(self.master)

    def read(self, seconds=0.2):
        until_s = time.monotonic() + seconds
        while (left := until_s - time.monotonic()) > 0.0:
            if select.select([self.master], [], [], left)[0]:
                with contextlib.suppress(OSError):
                    data = os.read(self.master, 65_536)
                    self.data += data
                    self.stream.feed(data.replace(b"\x1b[?1049h", b"").replace(b"\x1b[?1049l", b""))

    @property
    def text(self):
        return "\n".join(line.rstrip() for line in self.screen.display)

    def until(self, is_so):
        until_s = time.monotonic() + PATIENCE_S
        while not is_so():
            assert time.monotonic() < until_s, self.text
            self.read()

    def shows(self, text):
        self.until(lambda: text in self.text)

    def type(self, keys):
        os.write(self.master, keys.encode())

    def ends(self):
        until_s = time.monotonic() + PATIENCE_S
        while self.process.poll() is None and time.monotonic() < until_s:
            self.read()
        self.read()
        return self.process.wait(1.0)

    def close(self):
        self.process.kill()
        self.process.wait()
        os.close(self.master)
        os.close(self.slave)


@pytest.fixture
def boat(tmp_path):
    made = Boat(tmp_path / "boat.sock")
    yield made
    made.close()


@pytest.fixture
def terminal(tmp_path, boat):
    made = Terminal("--socket", str(tmp_path / "boat.sock"))
    made.shows("STANDARD  AUTO armed")
    yield made
    made.close()


def test_a_dashboard_that_redraws_little_is_resized_and_leaves_the_terminal_as_it_was(terminal):
    assert terminal.data.startswith(ENTER.encode())
    assert "080°±9° 9.7±1.2 kn" in terminal.text
    terminal.read(1.0)
    begin = len(terminal.data)
    terminal.read(3.0)
    assert (len(terminal.data) - begin) / 3.0 < 100.0  # nothing changes but the clock: 20 bytes a second
    time.sleep(2.0)  # nobody reads (Ctrl-S, a line that takes nothing): frames are left out, none is cut
    terminal.resize(60, 20)
    terminal.until(lambda: terminal.text.split("\n")[19].startswith(" q quit"))
    assert "Parts  wind too short" in terminal.text
    terminal.resize(100, 30)
    terminal.until(lambda: terminal.text.split("\n")[29].startswith(" q quit"))
    terminal.type("u")
    terminal.shows("5.0±0.6 m/s")
    terminal.type("\x03")
    assert terminal.ends() == 0
    assert terminal.data.endswith(LEAVE.encode())
    assert termios.tcgetattr(terminal.slave) == terminal.before
    assert b"Traceback" not in terminal.data


def test_keys_give_orders_and_what_moves_her_is_asked_first(terminal, boat):
    terminal.type("h")
    terminal.shows("hold: done: so be it, hold")
    terminal.type("g")
    terminal.shows("go_on: she sails on. y: yes, any other key: no")
    terminal.type("n")
    terminal.shows("go_on: not given")
    terminal.type("o50.81951 -1.30801\r")
    terminal.shows("goal 50.81951 -1.30801: she leaves her way. y: yes")
    terminal.type("y")
    terminal.shows("done: so be it, goal 50.81951 -1.30801")
    terminal.type("\x1b[A")  # an arrow: no key of ours
    terminal.type("q")
    assert terminal.ends() == 0
    assert boat.orders == ["hold", "goal 50.81951 -1.30801"]


def test_a_boat_that_falls_silent_looks_old_and_is_heard_again(terminal, boat):
    boat.is_silent = True
    terminal.shows("OLD 1")
    boat.is_silent = False
    terminal.shows("age 0 s")
    boat.close()
    terminal.shows("companion run needs --socket")
    boat.close = lambda: None


def test_nothing_is_there_and_the_ssh_is_dropped(tmp_path):
    terminal = Terminal("--socket", str(tmp_path / "s"))
    try:
        terminal.shows("Nothing heard yet")
        terminal.shows("nobody is there (No such file or directory): companion run needs --socket")
        terminal.process.send_signal(signal.SIGHUP)
        assert terminal.ends() == 0
        assert terminal.data.endswith(LEAVE.encode())
        assert termios.tcgetattr(terminal.slave) == terminal.before
    finally:
        terminal.close()


def lines(tmp_path, *words):
    return subprocess.Popen(
        [sys.executable, "-m", "companion.cli", "watch", *words],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": str(Path.cwd())},
    )


def test_without_a_terminal_it_is_lines(tmp_path, boat):
    process = lines(tmp_path, "--socket", "boat.sock", "--every", "0.5", "--units", "ms")
    first, second = process.stdout.readline(), process.stdout.readline()
    assert "STANDARD | AUTO armed | age 0 s | wind 080°±9° 5.0 m/s" in first
    assert second[8:] == first[8:]
    assert "\x1b" not in first
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, err) == (0, "")


def test_a_reader_that_goes_ends_it_without_a_word(tmp_path, boat):
    process = lines(tmp_path, "--socket", "boat.sock", "--every", "0.5")
    process.stdout.readline()
    process.stdout.close()
    assert process.wait(PATIENCE_S) == 0
    assert process.stderr.read() == ""
    process.stderr.close()


def test_without_a_terminal_nobody_waits_for_ever(tmp_path):
    process = lines(tmp_path, "--socket", "boat.sock", "--timeout", "1")
    out, err = process.communicate(timeout=PATIENCE_S)
    assert (process.returncode, out) == (3, "")
    assert err == (
        "companion watch: boat.sock: nobody is there (No such file or directory): companion run needs --socket\n"
    )


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ((), "--link: is missing: there is nobody to watch"),
        (("--link", "x", "--socket", "y"), "two ways to one boat"),
        (("--link", "x"), "x"),
        (("--link", "udpin:127.0.0.1:14999", "--signing-key", "nowhere"), "nowhere"),
    ],
)
def test_what_cannot_be_watched_is_refused_in_one_line(words, says, capfd):
    from companion import cli

    assert cli.main(["watch", *words]) == 2
    err = capfd.readouterr().err
    assert says in err
    assert err.count("\n") == 1
