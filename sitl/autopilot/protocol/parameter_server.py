"""The parameter protocol: whole lists, single values, settings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as mav

from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.links.link import Link
from sitl.autopilot.links.voice import Voice

# 1288 values took 0.6 s on the real one.
_PER_LOOP = 43


@dataclass(slots=True)
class _List:
    link: Link
    index: int = 0


class ParameterServer:
    """Answers PARAM_ messages; lists go out over several loops."""

    def __init__(self, parameters: Parameters, voice: Voice, changed: Callable[[str], None]) -> None:
        self._parameters = parameters
        self._voice = voice
        self._changed = changed
        self._lists: list[_List] = []

    @property
    def is_busy(self) -> bool:
        """Whether a list is under way."""
        return bool(self._lists)

    def handle(self, m: Any, link: Link) -> None:
        """Take PARAM_REQUEST_LIST, PARAM_REQUEST_READ or PARAM_SET."""
        name = m.get_type()
        if name == "PARAM_REQUEST_LIST":
            self._lists = [*(p for p in self._lists if p.link is not link), _List(link)]
        elif name == "PARAM_REQUEST_READ":
            key: str | int = m.param_index if m.param_index >= 0 else m.param_id
            entry = self._parameters.entry(key)
            if entry is not None:
                link.send(self._message(entry, None if isinstance(key, str) else entry[3]))
        elif name == "PARAM_SET" and self._parameters.set(m.param_id, m.param_value):
            self._changed(m.param_id)
            entry = self._parameters.entry(m.param_id)
            if entry is not None:
                self._voice.broadcast(self._message(entry, None))

    def update(self) -> None:
        """One loop: the next values of each list."""
        if not self._lists:
            return
        for sending in self._lists:
            for _ in range(_PER_LOOP):
                entry = self._parameters.entry(sending.index)
                if entry is None:
                    break
                sending.link.send(self._message(entry, sending.index))
                sending.index += 1
        self._lists = [p for p in self._lists if p.index < len(self._parameters)]

    def _message(self, entry: tuple[str, float, int, int], index: int | None) -> Any:
        name, value, kind, _ = entry
        # single values have no index
        return mav.MAVLink_param_value_message(
            name.encode(), value, kind, len(self._parameters), 65535 if index is None else index
        )
