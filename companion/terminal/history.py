"""What a dashboard remembers: the wind of the last minutes and the log."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.view import Event, View

KEPT_S = 3600.0
STEP_S = 2.0
EVENTS = 200


@dataclass(frozen=True, slots=True)
class Bin:
    """The wind of a stretch of time: ``twd_from_deg`` is its mean, ``spread_deg`` half of what it swung through."""

    ago_s: float
    twd_from_deg: float
    tws_mps: float
    spread_deg: float
    tack: str


@dataclass(slots=True)
class _Wind:
    t_s: float
    twd_rad: float
    tws_mps: float
    tack: str


class History:
    """Takes views and events, and tells the newest."""

    def __init__(self) -> None:
        self._winds: deque[_Wind] = deque()
        self.events: deque[Event] = deque(maxlen=EVENTS)

    def take(self, view: View, events: tuple[Event, ...]) -> None:
        """Note what is new."""
        self.events.extend(events)
        wind = view.wind
        if wind is None or wind.twd_from_deg is None or wind.tws_mps is None or (wind.age_s or 0.0) > STEP_S:
            return
        if self._winds and view.t_s - self._winds[-1].t_s < STEP_S:
            return
        tack = (view.boat.tack or "")[:1].upper()
        self._winds.append(_Wind(view.t_s, math.radians(wind.twd_from_deg), wind.tws_mps, tack))
        while view.t_s - self._winds[0].t_s > KEPT_S:
            self._winds.popleft()

    def bins(self, t_s: float, each_s: float, count: int) -> list[Bin | None]:
        """Return the last stretches of ``each_s``, the newest first; None where nothing was heard."""
        found: list[list[_Wind]] = [[] for _ in range(count)]
        for wind in reversed(self._winds):
            number = int((t_s - wind.t_s) / each_s)
            if number >= count:
                break
            found[max(0, number)].append(wind)
        return [_bin(number * each_s, winds) if winds else None for number, winds in enumerate(found)]


def _bin(ago_s: float, winds: list[_Wind]) -> Bin:
    mean = math.atan2(sum(math.sin(w.twd_rad) for w in winds), sum(math.cos(w.twd_rad) for w in winds))
    off = [math.degrees(wrap_pi(w.twd_rad - mean)) for w in winds]
    return Bin(ago_s, math.degrees(wrap_two_pi(mean)), sum(w.tws_mps for w in winds) / len(winds),
               0.5 * (max(off) - min(off)), winds[0].tack)
