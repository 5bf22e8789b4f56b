"""The vessels as the rest of the program sees them: one picture a step, and what happened to the reports behind it."""

from __future__ import annotations

import enum
from dataclasses import dataclass

from companion.traffic.vessel import Vessel


class Change(enum.Enum):
    """Why an active plan should be checked again."""

    APPEARED = "appeared"
    TURNED = "turned"
    SPEED = "changed speed"
    SURPRISE = "is not where it was expected"


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficCounts:
    """What happened to the reports, for the status."""

    heard: int = 0
    own: int = 0
    late: int = 0             # older than what is known of the vessel
    stale: int = 0            # too old when it came
    far: int = 0              # not near enough to matter, or not on the globe's useful part
    static_unknown: int = 0   # name and size of a vessel whose position was never heard
    shared_mmsi: int = 0      # two vessels with one MMSI
    clock_jumps: int = 0
    forgotten: int = 0        # expired, or pushed out by the bound


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficPicture:
    """All vessels at ``t_s``: what the rest of the program sees."""

    t_s: float
    vessels: tuple[Vessel, ...] = ()
    changes: tuple[tuple[float, int, Change], ...] = ()   # (when, MMSI, what), the last 32
    counts: TrafficCounts = TrafficCounts()
    last_heard_s: float | None = None

    def age_s(self, vessel: Vessel) -> float:
        """Return how old the vessel's position is [s]."""
        return max(0.0, self.t_s - vessel.t_s)

    @property
    def silence_s(self) -> float | None:
        """Seconds since any report; None: never heard one. AIS is not all traffic, and a stopped feed is silent."""
        return None if self.last_heard_s is None else max(0.0, self.t_s - self.last_heard_s)

    def changed_since(self, t_s: float) -> tuple[tuple[float, int, Change], ...]:
        """Return the changes after ``t_s``: an active plan is checked again when there is one."""
        return tuple(change for change in self.changes if change[0] > t_s)
