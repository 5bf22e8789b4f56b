"""Was it to be helped? A contact that looks like nobody's fault is sailed again: without the fault, and by other hands.

An excuse names a fault; whether it excuses is found out and not supposed. The same seed is sailed without that fault:
where the boat touches all the same, the fault is no excuse. Then it is sailed up to each moment at which something
could first be known of the fault, and from there an ideal skipper takes the place of the companion, who does one thing
at once and nothing else: he lets be what is on board, loiters, or holds. Where one of them touches nothing the contact
was avoidable. He orders no more than the companion may: without the permission to set modes, after a
crash, and while a stranger's mission is on board, he can only let be.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import msgspec

from companion.messages import Mode
from sitl.scene import EventSpec, Scenario

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
MOMENTS = 4          # the last before the contact are tried

HANDS: tuple[tuple[str, Mode | None], ...] = (("lets be", None), ("loiters", Mode.LOITER), ("holds", Mode.HOLD))


@dataclass(frozen=True, slots=True, kw_only=True)
class Reach:
    """When a skipper could see and order: in a life of the companion, with the link up, nobody else at the helm."""

    lives: Sequence[tuple[float, float]]
    link_up: Sequence[tuple[float, bool]]
    operator_s: Sequence[tuple[float, float]]
    stopped_s: Sequence[float] = ()          # when a failsafe stopped her: a sign as well
    false_s: Sequence[float] = ()            # when the autopilot came to believe a place where she is not

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
        scenario, events=tuple(sorted(kept, key=lambda e: e.at_s)), limit_s=min(scenario.limit_s, until_s + 1.0))


def _may_order(scenario: Scenario, excuse: str, t_s: float) -> bool:
    strange = any(e.kind == "foreign_mission" and e.at_s <= t_s for e in scenario.events)
    return scenario.set_auto and excuse not in HANDS_OFF and not strange


def avoidable(
    scenario: Scenario, excuse: str, contact_s: float, reach: Reach, touches: Callable[[Scenario], float | None],
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
