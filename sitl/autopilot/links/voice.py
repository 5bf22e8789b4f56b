"""The voice of the autopilot: its open ports, and what it says on one or on all of them."""

from __future__ import annotations

import math
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.links.link import Link


class Voice:
    """The ports by number."""

    def __init__(self, sysid: int) -> None:
        self._sysid = sysid
        self.links: dict[int, Link] = {}
        self._text_id = 0
        self._late_texts: list[tuple[int, str]] = []
        self._key: tuple[bytes, int] | None = None   # and its timestamp; kept over reboots

    @property
    def has_work(self) -> bool:
        """Whether bytes wait to be read or texts to be sent."""
        if self._late_texts:
            return True
        for link in self.links.values():  # noqa: SIM110 - asked at every loop, as the next one is: no generators
            if link.inbox:
                return True
        return False

    @property
    def due_s(self) -> float:
        """When the next stream of any port is due."""
        due_s = math.inf
        for link in self.links.values():
            due_s = min(due_s, link.due_s)
        return due_s

    def open(self, number: int, t_s: float) -> Link:
        """Return a port; a new one sends the default streams from now on."""
        link = self.links.get(number)
        if link is None:
            link = self.links[number] = Link(number, self._sysid)
            link.restart(t_s)
            if self._key is not None:
                link.sign(*self._key)
        return link

    def take_key(self, key: bytes, timestamp: int) -> None:
        """SETUP_SIGNING: from now on, on every port."""
        self._key = key, timestamp
        for link in self.links.values():
            link.sign(key, timestamp)

    def restart(self, t_s: float) -> None:
        """A reboot: default rates, nothing waiting."""
        self._late_texts.clear()
        for link in self.links.values():
            link.restart(t_s)
            link.take()

    def announce(self, severity: int, text: str) -> None:
        """STATUSTEXT on every port, in chunks of 50 characters."""
        pieces = [text[i:i + 50] for i in range(0, len(text), 50)] or [""]
        ident = 0
        if len(pieces) > 1:
            self._text_id = self._text_id % 65535 + 1
            ident = self._text_id
        for n, piece in enumerate(pieces):
            self.broadcast(mav.MAVLink_statustext_message(severity, piece.encode("ascii", "replace"), ident, n))

    def announce_after_ack(self, severity: int, text: str) -> None:
        """As ``announce``, behind the acknowledgement of the command being carried out."""
        self._late_texts.append((severity, text))

    def after_ack(self) -> None:
        """A command was acknowledged: say what belongs behind it."""
        if not self._late_texts:
            return
        late, self._late_texts = self._late_texts, []
        for severity, text in late:
            self.announce(severity, text)

    def broadcast(self, message: Any) -> None:
        """Send on every port."""
        for link in self.links.values():
            link.send(message)

    def reply(self, message: Any, link: int) -> None:
        """Send on one port."""
        if link in self.links:
            self.links[link].send(message)
