"""Tells systemd that the companion is ready, what it is doing, and that its loop still turns (sd_notify).

Sent from the steps of the voyage itself, never from a thread or a timer of its own: a companion whose loop hangs falls
silent, and systemd's watchdog starts it again; the mission on the autopilot sails on meanwhile. Where no service
manager listens (``NOTIFY_SOCKET`` is not set) nothing is sent.
"""

from __future__ import annotations

import contextlib
import socket
from collections.abc import Mapping
from types import TracebackType
from typing import Self

STATUS_CHARACTERS = 200
PATIENCE_S = 120  # after each word that it is still being started


class ServiceManager:
    """The way to the service manager named in the environment's ``NOTIFY_SOCKET``; a context manager."""

    def __init__(self, environment: Mapping[str, str]) -> None:
        name = environment.get("NOTIFY_SOCKET", "")
        # A leading @ stands for the abstract namespace (sd_notify(3)).
        self._address = "\0" + name[1:] if name.startswith("@") else name
        self._socket: socket.socket | None = None
        self._is_ready = False

    def __enter__(self) -> Self:
        if self._address:
            self._socket = socket.socket(socket.AF_UNIX, socket.SOCK_DGRAM | socket.SOCK_CLOEXEC)
            self._socket.setblocking(False)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._send("STOPPING=1")
        if self._socket is not None:
            self._socket.close()
            self._socket = None

    def starting(self, doing: str) -> None:
        """Say what is done before a voyage, and ask for patience: the first start compiles for minutes on a Pi.

        It may be ready already: a voyage that gives way to a drawing has another behind it.
        """
        patience = "WATCHDOG=1" if self._is_ready else f"EXTEND_TIMEOUT_USEC={PATIENCE_S * 10**6}"
        self._send(f"STATUS={' '.join(doing.split())[:STATUS_CHARACTERS]}\n{patience}")

    def alive(self, doing: str) -> None:
        """Say that the loop turns, and what it is doing in one line; the first time also that it is ready."""
        ready = "" if self._is_ready else "READY=1\n"
        self._is_ready = True
        self._send(f"{ready}STATUS={' '.join(doing.split())[:STATUS_CHARACTERS]}\nWATCHDOG=1")

    def _send(self, text: str) -> None:
        # A manager that does not listen now must not stop a voyage.
        if self._socket is not None:
            with contextlib.suppress(OSError):
                self._socket.sendto(text.encode(), self._address)
