"""Watches a voyage with faults from the outside, and judges it.

What counts as contact. An entry into what is solid fails the voyage unless one of these holds at that moment, and
then it is counted under that name:

- ``position``: an injected position error was in force and the boat was clear of everything where its receiver
  put it: nobody on board could know better; or one had ended less than 30 s ago: the boat was sailed there by it,
  a position that jumps is not believed for 20 s, in whichever direction it jumped, and a boat takes time to turn;
- ``operator``: the boat was not in AUTO or GUIDED, or not armed (an operator's mode, a failsafe of the autopilot
  that stops it, a reboot that leaves it disarmed): a sailboat that nobody steers drifts; or it was given back less
  than 10 s ago, which is what a tack away from a rock takes;
- ``foreign``: the boat followed a mission that somebody else put on board, which the companion may not replace.

What counts as a mixture. The list on the autopilot, up to the item that ends it, is at every moment one that somebody
uploaded as a whole, or there is none. It may be otherwise while an upload is under way (without MAVFTP items are
written in place, one by one, for as long as a bad link makes it), and while nobody can mend it: with the link cut
or the companion dead. How long that was is a figure of its own.
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
# A mission may be half there for this long with no upload under way and a link that works [s]: putting a torn upload
# right takes a read, item by item, before the next upload.
MAX_MIXTURE_S = 20.0
# A position error excuses a contact for this long after its end [s]: the watchdog's 20 s, and ten to turn the boat.
AFTER_ERROR_S = 30.0
AFTER_OPERATOR_S = 10.0
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
    uploading: list[bool] = field(default_factory=list)
    has_sailed: bool = False
    _uploads: bool = False
    _last: tuple[Any, MissionKey] = ((), ())

    def step(self, step: Step) -> None:
        """Note what the companion uploads."""
        self._uploads = step.state.pending_upload is not None
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
        self.uploading.append(self._uploads)

    def life(self, start_s: float, end_s: float) -> None:
        """Note one life of the companion."""
        self._uploads = False
        self.lives.append((start_s, end_s))

    def contacts(self) -> Counter[str]:
        """Return entries into what is solid, by the reason that excuses them; "unexcused" for none."""
        counts: Counter[str] = Counter()
        if not self.t_s:
            return counts
        shapely.prepare(self.solid)
        positions, believed = np.asarray(self.en_m), np.asarray(self.believed_en_m)
        wrong = np.hypot(*(positions - believed).T) > 1.0
        times, steered = np.asarray(self.t_s), np.asarray(self.steered)
        taken = ~steered & np.logical_or.accumulate(steered)
        inside = shapely.intersects(self.solid, shapely.points(positions))
        believed_inside = shapely.intersects(self.solid, shapely.points(believed))
        entries = np.flatnonzero(inside & ~np.concatenate([[False], inside[:-1]]))
        for i in entries:
            recent = wrong & (times > times[i] - AFTER_ERROR_S) & (times < times[i])
            if (wrong[i] and not believed_inside[i]) or (not wrong[i] and recent.any()):
                counts["position"] += 1
            elif not steered[i] or (taken & (times > times[i] - AFTER_OPERATOR_S) & (times < times[i])).any():
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

        Only while the link is up and the companion lives can anybody do something about it; a mission on its way is
        none yet.
        """
        free = [
            up and not uploads and any(a <= t <= b for a, b in self.lives)
            for t, up, uploads in zip(self.t_s, self.link_up, self.uploading, strict=True)
        ]
        last = self.missions[-1] if self.missions else ()
        return self._longest_mixed_s(free), self._is_mixed(last)

    def half_written_s(self) -> float:
        """Return how long the mission on board was no whole one, for whatever reason [s]."""
        return self._longest_mixed_s([True] * len(self.t_s))

    def _is_mixed(self, key: MissionKey) -> bool:
        return bool(key) and key not in self.ours and key not in self.foreign

    def _longest_mixed_s(self, counts: Sequence[bool]) -> float:
        longest = 0.0
        since_s: float | None = None
        for t_s, key, is_counted in zip(self.t_s, self.missions, counts, strict=True):
            if not is_counted or not self._is_mixed(key):
                since_s = None
                continue
            since_s = t_s if since_s is None else since_s
            longest = max(longest, t_s - since_s)
        return longest

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
