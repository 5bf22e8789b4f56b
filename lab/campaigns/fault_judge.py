"""The judge of a voyage with faults: watches it from outside, and sails contacts again to see what would have helped.

An excuse names a fault; whether it excuses is found out and not supposed. The same seed is sailed without that fault:
where the boat touches all the same, the fault is no excuse. Then it is sailed up to each moment at which something
could first be known of the fault, and from there an ideal skipper takes the place of the companion, who does one thing
at once and nothing else: he lets be what is on board, loiters, or holds. Where one of them touches nothing the contact
was avoidable. He orders no more than the companion may: without the permission to set modes, after a
crash, and while a stranger's mission is on board, he can only let be.

What counts as contact. A hull that touches what is solid fails the voyage. It may be excused where something looks
like having prevented everybody on board from helping it, and is only where that is so
(``lab.campaigns.fault_judge``):

- ``false position``: the position that every instrument on board reports was wrong at that moment, by an injected
  error, and clear of everything; or it became right less than ``REACTION_S`` ago, which is what it takes to see it,
  plan, upload, read back and turn a boat at speed;
- ``operator``: a person had the boat (a mode that the companion may not end), or gave it back less than
  ``REACTION_S`` ago;
- ``autopilot refuses``: a failsafe of the autopilot had stopped it, or it was booting and could not be armed; or that
  ended less than ``RESUME_S`` ago;
- ``failsafe``: it was in a mode, or disarmed, by a failsafe of the autopilot that no one has ended since (or that ended
  less than ``REACTION_S`` ago);
- ``crash``: the same by the crash check, which only a person may end;
- ``drift``: what wind there was over the water left it without steerage, or too slow to stem the current, and it was
  carried. Nobody on board can help that but the crew with its anchor, who must be called in time: ``CALLED_S`` before
  it touches, or where it began later than that, within ``NOTICED_S`` of its beginning;
- ``cut off``: it lay stopped or disarmed by the autopilot's own doing while the link was cut or the companion dead;
- ``foreign``: the boat followed a mission that somebody else put on board and that the companion may not replace;
- ``false wind``: the vane was turned by ``TURNED_DEG`` or more, or its offset set so, or that over for less than
  ``REACTION_S``: by such a wind the autopilot itself can neither sail nor loiter.

What counts as a mixture. The mission on the autopilot, up to the item that ends it, is at every moment one that was
asked for as a whole, or a beginning of one that ends in a loiter at one of its own waypoints (what stands there while
an upload without MAVFTP is under way), or there is none; anything else under way is a mixture, whatever the link and
whoever lives. On a boat that was not armed yet a beginning without its end is a first upload on its way. What a
stranger leaves on board between the first and the last word of his own upload is his: for at most ``STRANGER_S``, and
only if his mission follows at once.

Silence is the time without a status that says why; it counts within a life of the companion: a dead process says
nothing. That the process ends for want of an autopilot, with an error that names it, and is started again by its
service 5 s later is no unhandled error.
"""

from __future__ import annotations

import bisect
import enum
import itertools
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from typing import Any

import msgspec
import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.boat import Hull
from companion.fold import Step
from companion.geo.frame import LocalFrame
from companion.messages import ENDING, Command, Mode
from companion.skipper.behaviors import CALL
from companion.skipper.step import Announce, UploadMission
from sitl.autopilot import MemoryLink, SimulatedAutopilot
from sitl.scenario import CALL_HOLDS_S, EventSpec, HullTrack, Scenario

# What stands behind an excuse, as kinds of events.
CAUSES: dict[str, frozenset[str]] = {
    "false position": frozenset({"gps_jump", "gps_lost"}),
    "operator": frozenset({"mode"}),
    "autopilot refuses": frozenset({"gps_lost", "gps_jump", "reboot", "radio_lost", "station"}),
    "failsafe": frozenset({"battery", "radio_lost", "station", "gps_lost", "gps_jump"}),
    "crash": frozenset({"knockdown"}),
    "cut off": frozenset({"link_cut", "link_half", "link_quality", "kill_companion"}),
    "foreign": frozenset({"foreign_mission"}),
    "drift": frozenset({"current", "wind_speed"}),
    "false wind": frozenset({"vane", "parameter"}),
}
# While it lasts nothing may be ordered, by the table of causes.
HANDS_OFF = frozenset({"crash"})
# Those whose causes are the autopilot's parameters, too: without them it does nothing by itself.
BY_PARAMETERS = frozenset({"failsafe", "crash", "autopilot refuses"})
# From the first sign to an order that the autopilot has: a step to see it, a step for the command.
ALERT_S = 2.0
# An ideal skipper has done enough when he has gained this much time: he can plan and upload in half of it.
GAINED_S = 15.0
MOMENTS = 4  # the last before the contact are tried

HANDS: tuple[tuple[str, Mode | None], ...] = (("lets be", None), ("loiters", Mode.LOITER), ("holds", Mode.HOLD))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """When a skipper could see and order: in a life of the companion, with the link up, nobody else at the helm."""

    lives: Sequence[tuple[float, float]]
    link_up: Sequence[tuple[float, bool]]
    operator_s: Sequence[tuple[float, float]]
    stopped_s: Sequence[float] = ()  # when a failsafe stopped the boat: a sign as well
    false_s: Sequence[float] = ()  # when the autopilot came to believe a place where the boat is not

    def first_s(self, t_s: float, before_s: float) -> float | None:
        """Return the first moment from ``t_s`` on at which he could, None before ``before_s``."""
        times = [t_s, *[t for t, _ in self.link_up], *[a for a, _ in self.lives], *[b for _, b in self.operator_s]]
        return next((t for t in sorted(times) if t_s <= t < before_s and self._can(t)), None)

    def _can(self, t_s: float) -> bool:
        up = next((is_up for t, is_up in reversed(self.link_up) if t <= t_s), True)
        alive = any(a <= t_s <= b for a, b in self.lives)
        return up and alive and not any(a <= t_s < b for a, b in self.operator_s)


def moments(events: Sequence[EventSpec], kinds: frozenset[str], contact_s: float, reach: Reach) -> list[float]:
    """Return when an ideal skipper could have acted: soon after each beginning and each end of the fault."""
    signs: list[float] = []
    for event in events:
        if event.kind in kinds and not (event.is_of_one and math.hypot(event.east_m, event.north_m) == 0.0):
            # of a jump that the filter resists nothing shows before it is taken
            taken_s = [t for t in reach.false_s if t >= event.at_s][:1] if event.is_resisted else [event.at_s]
            signs += taken_s
            if event.for_s is not None:
                signs.append(event.at_s + event.for_s)
            if event.restart_after_s is not None:
                signs.append(event.at_s + event.restart_after_s)
    signs += reach.stopped_s
    found = {reach.first_s(t + ALERT_S, contact_s) for t in signs if t < contact_s}
    return sorted(t for t in found if t is not None)[-MOMENTS:]


def without(scenario: Scenario, excuse: str) -> Scenario:
    """Return the scenario without what stands behind an excuse."""
    events = tuple(e for e in scenario.events if e.kind not in CAUSES[excuse])
    parameters = {} if excuse in BY_PARAMETERS else scenario.parameters
    return msgspec.structs.replace(scenario, events=events, parameters=parameters)


def by_hand(scenario: Scenario, t_s: float, mode: Mode | None, until_s: float) -> Scenario:
    """Return the scenario with an ideal skipper from ``t_s`` on: the companion is gone, and one thing is ordered."""
    kept = [e for e in scenario.events if not (e.kind == "kill_companion" and e.at_s >= t_s)]
    kept.append(EventSpec(at_s=t_s, kind="kill_companion"))
    if mode is not None:
        kept.append(EventSpec(at_s=t_s, kind="mode", mode=mode.name))
    return msgspec.structs.replace(
        scenario, events=tuple(sorted(kept, key=lambda e: e.at_s)), limit_s=min(scenario.limit_s, until_s + 1.0)
    )


def _may_order(scenario: Scenario, excuse: str, t_s: float) -> bool:
    strange = any(e.kind == "foreign_mission" and e.at_s <= t_s for e in scenario.events)
    return scenario.set_auto and excuse not in HANDS_OFF and not strange


def avoidable(
    scenario: Scenario, excuse: str, contact_s: float, reach: Reach, touches: Callable[[Scenario], float | None]
) -> str:
    """Return by what the contact at ``contact_s`` was to be avoided; empty when by nothing that was tried.

    ``touches`` sails a scenario with the same seed and returns when its boat first touches [s], None for never.
    """
    kinds = CAUSES[excuse]
    if touches(without(scenario, excuse)) is not None:
        return "the boat touches without that fault as well"
    for t_s in moments(scenario.events, kinds, contact_s, reach):
        until_s = contact_s + GAINED_S
        for name, mode in HANDS if _may_order(scenario, excuse, t_s) else HANDS[:1]:
            touched_s = touches(by_hand(scenario, t_s, mode, until_s))
            if touched_s is None or touched_s > until_s:
                return f"a skipper who {name} at {t_s:.0f} s touches nothing"
    return ""


MAX_SILENCE_S = 10.0
FALSE_M = 1.0
# From knowing to being on another course [s]: a step of 1 s to see it, 1 s to plan, 1.5 s to upload and read back, and
# 2.5 s for a turn of 180 degrees at speed.
REACTION_S = 6.0
# From an autopilot that can be sailed again to a boat that steers [s]: two commands, each believed when the heartbeat
# of the following second shows it, and the time to gather steerage way.
RESUME_S = 10.0
# A ground station's upload of one item on a link that loses nothing [s]: the count cuts the old mission short at once,
# the item is written when it has been asked for.
STRANGER_S = 1.0
# A crew that is called to the anchor needs this long to let it go [s].
CALLED_S = 120.0
# From the water's carrying a boat without steerage to a call [s]: a wind that has died is one by its mean over a
# minute, and a velocity that is not by sails by its mean over ten seconds.
NOTICED_S = 60.0
# With less wind over the water than this there is no steerage [m/s]; and with less than this many times the current it
# does not stem it: half of the wind is what the boat makes in light air.
STEERAGE_MPS, STEMS = 0.8, 2.0
TURNED_DEG = 60.0
UNEXCUSED = "unexcused"
# What may excuse a contact, in the words of the campaign's table.
EXCUSES = {
    "false position": f"with the reported position wrong and clear, or right again for less than {REACTION_S:g} s",
    "operator": f"in a person's hands, or given back less than {REACTION_S:g} s before",
    "autopilot refuses": f"stopped by a failsafe or booting, or that over for less than {RESUME_S:g} s",
    "failsafe": f"in the mode that a failsafe had put it into, or out of it for less than {REACTION_S:g} s",
    "crash": "stopped by the crash check, until a person has looked",
    "drift": f"carried without wind to sail by, the crew called to the anchor {CALLED_S:g} s before, or at once",
    "cut off": "stopped by the autopilot, with the link cut or the companion dead",
    "foreign": "following a stranger's mission, which may not be replaced",
    "false wind": "with the vane turned far, by which the autopilot sails and loiters",
}
# Where a mission stops being read.

MissionKey = tuple[tuple[int, int, int], ...]


class WhoSteers(enum.Enum):
    """Who steers."""

    SAILED = "sailed"  # armed, and in AUTO or GUIDED
    REFUSED = "refused"  # stopped by a failsafe that lasts, or disarmed and not to be armed yet
    ADRIFT = "adrift"  # stopped or disarmed, and free to be sailed


@dataclass(slots=True)
class Watch:
    """An observer of one run, and its judge.

    ``operator_s`` is when a person had the boat, ``false_wind_s`` when the vane was turned far, from and to [s].
    """

    solid: BaseGeometry
    frame: LocalFrame
    hull: Hull
    operator_s: list[tuple[float, float]] = field(default_factory=list)
    false_wind_s: list[tuple[float, float]] = field(default_factory=list)
    called_s: list[float] = field(default_factory=list)
    t_s: list[float] = field(default_factory=list)
    en_m: list[tuple[float, float]] = field(default_factory=list)
    heading_rad: list[float] = field(default_factory=list)
    believed_en_m: list[tuple[float, float]] = field(default_factory=list)
    helm: list[WhoSteers] = field(default_factory=list)
    armed: list[bool] = field(default_factory=list)
    missions: list[MissionKey] = field(default_factory=list)
    link_up: list[bool] = field(default_factory=list)
    stopped: list[str] = field(default_factory=list)
    carried: list[bool] = field(default_factory=list)
    lives: list[tuple[float, float]] = field(default_factory=list)
    ours: set[MissionKey] = field(default_factory=set)
    foreign: set[MissionKey] = field(default_factory=set)
    has_sailed: bool = False
    _last: tuple[Any, MissionKey] = ((), ())

    def step(self, step: Step) -> None:
        """Note what the companion uploads, and when it calls its crew."""
        for action in step.actions:
            if isinstance(action, Announce) and action.code == CALL:
                self.called_s.append(step.snapshot.t_s)
            if isinstance(action, UploadMission):
                self.ours.add(mission_key((i.command, i.lat_e7, i.lon_e7) for i in action.items))

    def truth(self, t_s: float, autopilot: SimulatedAutopilot, link: MemoryLink) -> None:
        """Note where the boat is, where it believes to be, who steers, and what it sails by."""
        truth, pilot = autopilot.truth, autopilot.core.chart.point(autopilot.core.vehicle.position)
        helm = WhoSteers.ADRIFT
        if truth.is_armed and truth.mode in {Mode.AUTO, Mode.GUIDED}:
            helm = WhoSteers.SAILED
        elif autopilot.pilot.failsafe.is_active or not (truth.is_armed or autopilot.pilot.ekf.is_ready):
            helm = WhoSteers.REFUSED
        self.has_sailed = self.has_sailed or helm is WhoSteers.SAILED
        self.t_s.append(t_s)
        self.en_m.append(self.frame.en_from_geo(truth.position))
        self.heading_rad.append(truth.heading_rad)
        self.believed_en_m.append(self.frame.en_from_geo(pilot))
        self.helm.append(helm)
        self.armed.append(truth.is_armed)
        items = tuple(autopilot.pilot.helm.mission.items[1:])
        if items != self._last[0]:
            self._last = (items, mission_key((i.command, i.x, i.y) for i in items))
        self.missions.append(self._last[1])
        self.link_up.append(link.is_up)
        self.stopped.append("" if helm is WhoSteers.SAILED else autopilot.pilot.failsafe.stopped_by)
        current = autopilot.core.vehicle.current_en_mps
        air = (
            truth.tws_mps * math.sin(truth.twd_from_rad) + current[0],
            truth.tws_mps * math.cos(truth.twd_from_rad) + current[1],
        )
        drift_mps = math.hypot(*current)
        self.carried.append(drift_mps > 0.0 and math.hypot(*air) < max(STEERAGE_MPS, STEMS * drift_mps))

    def life(self, start_s: float, end_s: float) -> None:
        """Note one life of the companion."""
        self.lives.append((start_s, end_s))

    # ------------------------------------------------------------------------------------------ contacts
    def contacts(self) -> list[tuple[float, str]]:
        """Return when the hull came to touch [s], and what looks like an excuse; ``UNEXCUSED`` for nothing."""
        return [(self.t_s[i], self._excuse(i)) for i in self._track().entries(self.solid)]

    def _excuse(self, i: int) -> str:
        wrong = np.asarray(self._is_false())
        if wrong[i] and not shapely.intersects(self.solid, shapely.points(self.believed_en_m[i])):
            return "false position"
        if not wrong[i] and wrong[self._since(i, REACTION_S) : i].any():
            return "false position"
        t_s = self.t_s[i]
        if any(a <= t_s <= b + REACTION_S for a, b in self.operator_s):
            return "operator"
        if WhoSteers.REFUSED in self.helm[self._since(i, RESUME_S) : i + 1]:
            return "autopilot refuses"
        stops = self.stopped[self._since(i, REACTION_S) : i + 1]
        if any(stops):
            return "crash" if "crash" in stops else "failsafe"
        if self.carried[i] and self._was_called(i):
            return "drift"
        if self.helm[i] is WhoSteers.ADRIFT and not (self.link_up[i] and any(a <= t_s <= b for a, b in self.lives)):
            return "cut off"
        if self.missions[i] in self.foreign:
            return "foreign"
        if any(a <= t_s <= b + REACTION_S for a, b in self.false_wind_s):
            return "false wind"
        return UNEXCUSED

    def _was_called(self, i: int) -> bool:
        """Whether the crew was called in time for a contact at sample ``i``."""
        t_s, began = self.t_s[i], i
        while began > 0 and self.carried[began - 1]:
            began -= 1
        latest_s = max(t_s - CALLED_S, min(self.t_s[began] + NOTICED_S, t_s))
        return any(t_s - CALL_HOLDS_S <= called_s <= latest_s for called_s in self.called_s)

    def reach(self) -> Reach:
        """Return when a skipper could see and order."""
        changes = [
            (t_s, up)
            for n, (t_s, up) in enumerate(zip(self.t_s, self.link_up, strict=True))
            if n == 0 or up != self.link_up[n - 1]
        ]
        return Reach(
            lives=tuple(self.lives),
            link_up=tuple(changes),
            operator_s=tuple(self.operator_s),
            stopped_s=self._begins([bool(by) for by in self.stopped]),
            false_s=self._begins(self._is_false()),
        )

    def _begins(self, holds: Sequence[bool]) -> tuple[float, ...]:
        """Return when something began to hold [s]."""
        return tuple(t_s for n, t_s in enumerate(self.t_s) if holds[n] and not (n and holds[n - 1]))

    def _is_false(self) -> list[bool]:
        """Return, of each sample, whether the autopilot believed the boat to be where it was not."""
        off_m = np.asarray(self.en_m).reshape(-1, 2) - np.asarray(self.believed_en_m).reshape(-1, 2)
        return [bool(far) for far in np.hypot(*off_m.T) > FALSE_M]

    def _since(self, i: int, span_s: float) -> int:
        """Return the index of the first sample not more than ``span_s`` before sample ``i``."""
        return bisect.bisect_left(self.t_s, self.t_s[i] - span_s)

    def clearance_m(self) -> tuple[float, float] | None:
        """Return the hull's smallest true distance to anything solid [m], and when [s]."""
        if not self.en_m:
            return None
        least_m, i = self._track().least_m(self.solid)
        return least_m, self.t_s[i]

    def _track(self) -> HullTrack:
        return HullTrack(
            en_m=np.asarray(self.en_m).reshape(-1, 2), heading_rad=np.asarray(self.heading_rad), hull=self.hull
        )

    # ------------------------------------------------------------------------------------------ missions
    def mixture_s(self) -> float:
        """Return the longest time that the mission on board was a mixture [s]; a single sample counts 1 ms."""
        return self._longest_s("mixture")

    def held_back_s(self) -> float:
        """Return the longest time that a beginning of a mission, ended by a loiter, stood on board [s]."""
        return self._longest_s("closed")

    def kind(self, key: MissionKey, *, was_armed: bool) -> str:
        """Return what the mission on board is: "whole", "closed", "begun", "mixture"."""
        if not key or key in self.ours or key in self.foreign:
            return "whole"
        begun = [mission for mission in self.ours if mission[: len(key) - 1] == key[:-1]]
        ends_in = {item[1:] for mission in begun for item in mission}
        if key[-1][0] == Command.NAV_LOITER_UNLIM and key[-1][1:] in ends_in:
            return "closed"
        if not was_armed and any(mission[: len(key)] == key for mission in self.ours):
            return "begun"
        return "mixture"

    def _kinds(self) -> list[str]:
        """Return the kind of each sample's mission."""
        was_armed = itertools.accumulate(self.armed, bool.__or__)
        kinds = [self.kind(key, was_armed=armed) for key, armed in zip(self.missions, was_armed, strict=True)]
        for i in range(len(kinds) - 1, 0, -1):
            if kinds[i - 1] == "mixture" and self.missions[i] in self.foreign:
                since = i - 1
                while since > 0 and kinds[since - 1] == "mixture":
                    since -= 1
                if self.t_s[i] - self.t_s[since] <= STRANGER_S:
                    kinds[since:i] = ["stranger"] * (i - since)
        return kinds

    def _longest_s(self, wanted: str) -> float:
        longest = 0.0
        since_s: float | None = None
        for t_s, kind in zip(self.t_s, self._kinds(), strict=True):
            if kind != wanted:
                since_s = None
                continue
            since_s = t_s if since_s is None else since_s
            longest = max(longest, t_s - since_s, 1e-3)
        return longest

    # ------------------------------------------------------------------------------------------- silence
    def silence_s(self, status_s: Sequence[float]) -> float:
        """Return the longest time without a status, given when there was one, within a life of the companion [s]."""
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
        if command in ENDING:
            break
    return tuple(out)


def false_wind_spans(events: Iterable[EventSpec], end_s: float) -> list[tuple[float, float]]:
    """Return when the vane was turned by ``TURNED_DEG`` or more, or its offset was set so, from and to [s]."""
    spans = [
        (e.at_s, end_s if e.for_s is None else e.at_s + e.for_s)
        for e in events
        if e.kind == "vane" and e.state == "offset" and abs(e.value_deg) >= TURNED_DEG
    ]
    offsets = sorted((e for e in events if e.parameter == "WNDVN_DIR_OFS"), key=lambda e: e.at_s)
    for event, until_s in zip(offsets, (*(e.at_s for e in offsets[1:]), end_s), strict=False):  # there may be none
        if abs(event.value) >= TURNED_DEG:
            spans.append((event.at_s, until_s))
    return spans


def operator_spans(events: Iterable[EventSpec], end_s: float) -> list[tuple[float, float]]:
    """Return when a person had the boat, from and to [s]: from a mode other than AUTO to the next AUTO."""
    spans: list[tuple[float, float]] = []
    since_s: float | None = None
    for event in sorted((e for e in events if e.kind == "mode"), key=lambda e: e.at_s):
        if event.mode != Mode.AUTO.name:
            since_s = event.at_s if since_s is None else since_s
        elif since_s is not None:
            spans.append((since_s, event.at_s))
            since_s = None
    return spans if since_s is None else [*spans, (since_s, end_s)]
