"""Watches a voyage with faults from the outside, and judges it.

What counts as contact. An entry into what is solid fails the voyage unless one of these holds at that moment, and
then it is counted under that name:

- ``position``: an injected position error was in force and the boat was clear of everything where its receiver
  put it: nobody on board could know better;
- ``operator``: the boat was not in AUTO or GUIDED, or not armed (an operator's mode, a failsafe of the autopilot
  that stops it, a reboot that leaves it disarmed): a sailboat that nobody steers drifts;
- ``foreign``: the boat followed a mission that somebody else put on board, which the companion may not replace.

What counts as a mixture. The list on the autopilot, up to the item that ends it, is at every moment one that somebody
uploaded as a whole, or there is none. It may be otherwise while an upload is under way, and while nobody can mend it:
with the link cut or the companion dead.
"""

from __future__ import annotations

import itertools
from collections import Counter
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.fold import Step
from companion.geo.frame import LocalFrame
from companion.messages import Command, Mode
from companion.skipper.actions import UploadMission
from sitl.autopilot import Autopilot, MemoryLink

MAX_SILENCE_S = 10.0
# A mission under way to the autopilot may be half there for this long while the link works [s]: the item protocol
# writes in place, and putting a torn upload right takes a read and another upload.
MAX_MIXTURE_S = 20.0
# Where a mission stops being read.
_ENDS = frozenset({int(Command.NAV_LOITER_UNLIM), int(Command.NAV_RETURN_TO_LAUNCH)})

MissionKey = tuple[tuple[int, int, int], ...]


@dataclass(slots=True)
class Watch:
    """An observer of one run, and its judge."""

    solid: BaseGeometry
    frame: LocalFrame
    t_s: list[float] = field(default_factory=list)
    en_m: list[tuple[float, float]] = field(default_factory=list)
    believed_en_m: list[tuple[float, float]] = field(default_factory=list)
    steered: list[bool] = field(default_factory=list)
    missions: list[MissionKey] = field(default_factory=list)
    link_up: list[bool] = field(default_factory=list)
    lives: list[tuple[float, float]] = field(default_factory=list)
    ours: set[MissionKey] = field(default_factory=set)
    foreign: set[MissionKey] = field(default_factory=set)
    has_sailed: bool = False
    _last: tuple[Any, MissionKey] = ((), ())

    def step(self, step: Step) -> None:
        """Note what the companion uploads."""
        for action in step.actions:
            if isinstance(action, UploadMission):
                self.ours.add(mission_key((i.command, i.lat_e7, i.lon_e7) for i in action.items))

    def truth(self, t_s: float, autopilot: Autopilot, link: MemoryLink) -> None:
        """Note where the boat is, where it believes to be, and what it sails by."""
        truth, pilot = autopilot.truth, autopilot.chart.point(autopilot.vehicle.position)
        self.has_sailed = self.has_sailed or (truth.is_armed and truth.mode in {Mode.AUTO, Mode.GUIDED})
        self.t_s.append(t_s)
        self.en_m.append(self.frame.en_from_geo(truth.position))
        self.believed_en_m.append(self.frame.en_from_geo(pilot))
        self.steered.append(truth.is_armed and truth.mode in {Mode.AUTO, Mode.GUIDED})
        items = tuple(autopilot.helm.mission.items[1:])
        if items != self._last[0]:
            self._last = (items, mission_key((i.command, i.x, i.y) for i in items))
        self.missions.append(self._last[1])
        self.link_up.append(not link.is_cut)

    def life(self, start_s: float, end_s: float) -> None:
        """Note one life of the companion."""
        self.lives.append((start_s, end_s))

    def contacts(self) -> Counter[str]:
        """Return entries into what is solid, by the reason that excuses them; "unexcused" for none."""
        counts: Counter[str] = Counter()
        if not self.t_s:
            return counts
        shapely.prepare(self.solid)
        positions, believed = np.asarray(self.en_m), np.asarray(self.believed_en_m)
        inside = shapely.intersects(self.solid, shapely.points(positions))
        believed_inside = shapely.intersects(self.solid, shapely.points(believed))
        entries = np.flatnonzero(inside & ~np.concatenate([[False], inside[:-1]]))
        for i in entries:
            wrong_m = float(np.hypot(*(positions[i] - believed[i])))
            if wrong_m > 1.0 and not believed_inside[i]:
                counts["position"] += 1
            elif not self.steered[i]:
                counts["operator"] += 1
            elif self.missions[i] in self.foreign:
                counts["foreign"] += 1
            else:
                counts["unexcused"] += 1
        return counts

    def clearance_m(self) -> float | None:
        """Return the smallest true distance to anything solid [m]."""
        if not self.en_m:
            return None
        return float(np.min(shapely.distance(self.solid, shapely.points(np.asarray(self.en_m)))))

    def mixture_s(self) -> tuple[float, bool]:
        """Return how long the mission on board was no whole one while it could be put right, and if it is so at last.

        Only while the link is up and the companion lives can anybody do something about it.
        """
        longest = since = 0.0
        was = False
        for i, t_s in enumerate(self.t_s):
            key = self.missions[i]
            is_mixed = bool(key) and key not in self.ours and key not in self.foreign
            can_act = self.link_up[i] and any(a <= t_s <= b for a, b in self.lives)
            if not is_mixed or not can_act:
                was = False
            elif not was:
                was, since = True, t_s
            else:
                longest = max(longest, t_s - since)
        last = self.missions[-1] if self.missions else ()
        return longest, bool(last) and last not in self.ours and last not in self.foreign

    def silence_s(self, status_s: Sequence[float]) -> float:
        """Return the longest time without a status within a life of the companion [s]."""
        longest = 0.0
        for start_s, end_s in self.lives:
            times = [start_s, *[t for t in status_s if start_s <= t <= end_s], end_s]
            longest = max(longest, *(b - a for a, b in itertools.pairwise(times)))
        return longest


def mission_key(items: Iterable[tuple[int, int, int]]) -> MissionKey:
    """Return a mission up to the item that ends it: what is stored behind that is dead."""
    out: list[tuple[int, int, int]] = []
    for command, x, y in items:
        out.append((int(command), int(x), int(y)) if command != Command.NAV_RETURN_TO_LAUNCH else (int(command), 0, 0))
        if command in _ENDS:
            break
    return tuple(out)
