"""The vessels heard of, as a fold of reports: ``targets = targets.heard(report)``.

Bounded, tolerant of what feeds do: reports out of order, two vessels with one MMSI, clocks that jump, positions
that cannot be. Everything refused is counted; nothing raises.
"""

from __future__ import annotations

import heapq
import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from companion.geo.angles import wrap_two_pi
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift, carried
from companion.messages import AisReport
from companion.traffic.approach import peril_m
from companion.traffic.predict import predict
from companion.traffic.vessel import LAIN_S, Vessel, hull_of


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficCounts:
    """What happened to the reports, for the status."""

    heard: int = 0
    own: int = 0
    late: int = 0  # older than what is known of the vessel
    stale: int = 0  # too old when it came
    far: int = 0  # not near enough to matter, or not on the globe's useful part
    static_unknown: int = 0  # name and size of a vessel whose position was never heard
    shared_mmsi: int = 0  # two vessels with one MMSI
    clock_jumps: int = 0
    forgotten: int = 0  # expired, or pushed out by the bound


@dataclass(frozen=True, slots=True, kw_only=True)
class TrafficPicture:
    """All vessels at ``t_s``: what the rest of the program sees."""

    t_s: float
    vessels: tuple[Vessel, ...] = ()
    counts: TrafficCounts = TrafficCounts()
    last_heard_s: float | None = None

    def age_s(self, vessel: Vessel) -> float:
        """Return how old the vessel's position is [s]."""
        return max(0.0, self.t_s - vessel.t_s)

    @property
    def silence_s(self) -> float | None:
        """Seconds since any report; None: never heard one. AIS is not all traffic, and a stopped feed is silent."""
        return None if self.last_heard_s is None else max(0.0, self.t_s - self.last_heard_s)


# How far off a report may be from what can be reached and still be the same vessel [m, m/s]: fast ferries do 25.
REACH_SLACK_M, REACH_MPS = 400.0, 30.0
# Farther from us than this a vessel says nothing to a boat of a few knots.
FAR_M = 60_000.0
# The companion's clock never goes back; a replay's or a test's may. More than this is a jump, not disorder.
CLOCK_BACK_S = 60.0
LIES_MPS, SWINGS_M = 0.26, 15.0  # half a knot; a fix's error and a swing at the mooring, in LAIN_S
LIES_APART_S = 400.0  # a vessel that lies still reports each three minutes
# Who goes next where there are too many is judged for an eighth of them, and for so long [s]: a flood of new numbers
# must not have all of them judged for each.
SPARE_SHARE, SPARE_S = 8, 5.0

Key = tuple[int, int]  # MMSI and branch


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetLimits:
    """Bounds of the fold.

    Attributes:
        max_vessels: when one more appears, the one goes that would come the least near (``peril_m``).
        max_branches: vessels kept apart under one MMSI.
        expire_s: a vessel unheard for this long is forgotten (ArduPilot's AIS_TIME_OUT).
        max_age_s: a report that was this old when it arrived is refused.
        own_mmsi: our own transponder's reports are refused.

    """

    max_vessels: int = 400
    max_branches: int = 3
    expire_s: float = 600.0
    max_age_s: float = 600.0
    own_mmsi: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Targets:
    """The fold's state. Make it with ``Targets.empty(frame)``."""

    frame: LocalFrame
    limits: TargetLimits = TargetLimits()
    vessels: Mapping[Key, Vessel] = field(default_factory=dict)
    counts: TrafficCounts = field(default_factory=TrafficCounts)
    last_heard_s: float | None = None
    spare: tuple[tuple[float, Key], ...] = ()  # who goes next: peril [m] and whose, the least perilous first
    spare_s: float = -math.inf  # when that was judged

    @classmethod
    def empty(cls, frame: LocalFrame, limits: TargetLimits | None = None) -> Targets:
        """Return a fold that has heard nothing."""
        return cls(frame=frame, limits=limits or TargetLimits())

    def picture(self, t_s: float) -> TrafficPicture:
        """Return what is known at ``t_s``: vessels not expired, by MMSI."""
        alive = [v for _, v in sorted(self.vessels.items()) if t_s - v.heard_s <= self.limits.expire_s]
        return TrafficPicture(t_s=t_s, vessels=tuple(alive), counts=self.counts, last_heard_s=self.last_heard_s)

    def heard(
        self,
        report: AisReport,
        own_en_m: tuple[float, float] = (0.0, 0.0),
        own_velocity_en_mps: tuple[float, float] = (0.0, 0.0),
    ) -> Targets:
        """Return the fold after ``report``; ``report.t_s`` is when it arrived on our clock.

        ``own_en_m`` and ``own_velocity_en_mps`` are our boat's: what comes near comes near to it.
        """
        return self._clock(report.t_s)._heard(report, (own_en_m, own_velocity_en_mps))  # noqa: SLF001 - the same class

    def _heard(self, report: AisReport, own: _Own) -> Targets:
        now = report.t_s if self.last_heard_s is None else max(report.t_s, self.last_heard_s)
        counts = replace(self.counts, heard=self.counts.heard + 1)
        if not _is_sound(report):
            return self.counted(counts, now, stale=1)
        if report.mmsi == self.limits.own_mmsi:
            return self.counted(counts, now, own=1)
        if report.position is None:
            return self._static(report, counts, now)
        if report.age_s > self.limits.max_age_s:
            return self.counted(counts, now, stale=1)
        en = self.frame.en_from_geo(report.position)
        if not (math.isfinite(en[0]) and math.isfinite(en[1])) or math.dist(en, own[0]) > FAR_M:
            return self.counted(counts, now, far=1)
        return self._placed(report, en, own, counts, now)

    def in_frame(self, frame: LocalFrame) -> Targets:
        """Return the fold in the metres of another frame."""
        shift = Shift(self.frame, frame)
        return replace(self, frame=frame, vessels={key: carried(v, shift) for key, v in self.vessels.items()})

    # ------------------------------------------------------------------------------------- inside
    def counted(self, counts: TrafficCounts, now_s: float, **more: int) -> Targets:
        """Return the fold with a report counted and nothing else changed."""
        added = {name: getattr(counts, name) + value for name, value in more.items()}
        return replace(self, counts=replace(counts, **added), last_heard_s=now_s)

    def _clock(self, t_s: float) -> Targets:
        """Keep the tracks' ages when the clock was set back."""
        if self.last_heard_s is None or t_s >= self.last_heard_s - CLOCK_BACK_S:
            return self
        jump = t_s - self.last_heard_s
        moved = {k: replace(v, t_s=v.t_s + jump, heard_s=v.heard_s + jump) for k, v in self.vessels.items()}
        return replace(
            self, vessels=moved, last_heard_s=t_s, counts=replace(self.counts, clock_jumps=self.counts.clock_jumps + 1)
        )

    def _branches(self, mmsi: int) -> list[Vessel]:
        keys = ((mmsi, branch) for branch in range(self.limits.max_branches))
        return [self.vessels[key] for key in keys if key in self.vessels]

    def _static(self, report: AisReport, counts: TrafficCounts, now_s: float) -> Targets:
        """Fold name, type and size into every vessel with that MMSI: whose it is cannot be told."""
        known = self._branches(report.mmsi)
        if not known:
            return self.counted(counts, now_s, static_unknown=1)
        vessels = dict(self.vessels)
        for vessel in known:
            vessels[vessel.mmsi, vessel.branch] = _described(vessel, report, now_s)
        return replace(self, vessels=vessels, counts=counts, last_heard_s=now_s)

    def _placed(
        self, report: AisReport, en: tuple[float, float], own: _Own, counts: TrafficCounts, now_s: float
    ) -> Targets:
        t_s = report.t_s - max(0.0, report.age_s)
        known = self._branches(report.mmsi)
        nearest = min(known, key=lambda v: (_surprise_m(v, t_s, en), v.branch), default=None)
        if nearest is not None and _surprise_m(nearest, t_s, en) > _reach_m(nearest, t_s):
            nearest = None
        if nearest is not None and (t_s <= nearest.t_s or _is_repeat(nearest, report, en, t_s)):
            # ArduPilot repeats a silent vessel every 30 s with a growing age in whole seconds: nothing new.
            return self.counted(counts, now_s, late=1)
        vessels = dict(self.vessels)
        if nearest is None:
            return self._new(report, en, own, t_s, vessels, known, counts, now_s)
        vessels[nearest.mmsi, nearest.branch] = _moved(nearest, report, en, t_s, now_s)
        return replace(self, vessels=vessels, counts=counts, last_heard_s=now_s)

    def _new(
        self,
        report: AisReport,
        en: tuple[float, float],
        own: _Own,
        t_s: float,
        vessels: dict[Key, Vessel],
        known: list[Vessel],
        counts: TrafficCounts,
        now_s: float,
    ) -> Targets:
        expired = [k for k, v in vessels.items() if now_s - v.heard_s > self.limits.expire_s]
        for key in expired:
            del vessels[key]
        known = [v for v in known if (v.mmsi, v.branch) in vessels]
        forgotten = len(expired)
        shared = bool(known)
        if shared:
            counts = replace(counts, shared_mmsi=counts.shared_mmsi + 1)
            for v in known:
                vessels[v.mmsi, v.branch] = replace(v, is_shared_mmsi=True)
        free = [b for b in range(self.limits.max_branches) if (report.mmsi, b) not in vessels]
        branch = free[0] if free else min(known, key=lambda v: (v.t_s, v.branch)).branch
        vessels[report.mmsi, branch] = _first(report, branch, en, t_s, now_s, is_shared=shared)
        spare, spare_s = self.spare, self.spare_s
        if len(vessels) > self.limits.max_vessels:
            spare = tuple(s for s in spare if s[1] in vessels) if 0.0 <= now_s - spare_s < SPARE_S else ()
            if not spare:
                spare_s, spare = now_s, _least_perilous(vessels, own, now_s, self.limits.max_vessels // SPARE_SHARE + 1)
            newcomer = peril_m(*own, vessels[report.mmsi, branch], now_s), (report.mmsi, branch)
            del vessels[max(newcomer, spare[0])[1]]
            forgotten += 1
        counts = replace(counts, forgotten=counts.forgotten + forgotten)
        return replace(self, vessels=vessels, counts=counts, last_heard_s=now_s, spare=spare, spare_s=spare_s)


_Own = tuple[tuple[float, float], tuple[float, float]]  # place [m] and velocity [m/s] of our boat


def _least_perilous(vessels: Mapping[Key, Vessel], own: _Own, t_s: float, count: int) -> tuple[tuple[float, Key], ...]:
    """Return those that would come the least near, the least perilous first."""
    return tuple(heapq.nlargest(count, ((peril_m(*own, vessel, t_s), key) for key, vessel in vessels.items())))


def _is_sound(report: AisReport) -> bool:
    """Are all numbers finite and possible? A decoder's sentinels never arrive here."""
    numbers = (
        report.t_s,
        report.age_s,
        report.course_rad,
        report.speed_mps,
        report.heading_rad,
        report.turn_rate_radps,
        report.bow_m,
        report.stern_m,
        report.port_m,
        report.starboard_m,
    )
    if any(x is not None and not math.isfinite(x) for x in numbers):
        return False
    return (report.speed_mps or 0.0) >= 0.0 and report.age_s >= -1.0


def _surprise_m(vessel: Vessel, t_s: float, en: tuple[float, float]) -> float:
    """Return how far the antenna is from where it was expected [m]."""
    if t_s <= vessel.t_s:
        return math.dist(vessel.antenna_en_m, en)
    there = predict(vessel, t_s).mean_en_m
    shift = (vessel.centre_en_m[0] - vessel.antenna_en_m[0], vessel.centre_en_m[1] - vessel.antenna_en_m[1])
    return math.hypot(there[0] - shift[0] - en[0], there[1] - shift[1] - en[1])


def _is_repeat(vessel: Vessel, report: AisReport, en: tuple[float, float], t_s: float) -> bool:
    return report.age_s >= 1.0 and t_s - vessel.t_s < 1.5 and math.dist(en, vessel.antenna_en_m) < 0.5


def _reach_m(vessel: Vessel, t_s: float) -> float:
    return REACH_SLACK_M + REACH_MPS * abs(t_s - vessel.t_s)


def _described(vessel: Vessel, report: AisReport, now_s: float) -> Vessel:
    size = (report.bow_m, report.stern_m, report.port_m, report.starboard_m)
    return replace(
        vessel,
        heard_s=now_s,
        name=report.name or vessel.name,
        ship_type=report.ship_type if report.ship_type is not None else vessel.ship_type,
        hull=hull_of(*size, is_class_b=vessel.is_class_b) if any(size) else vessel.hull,
    )


def _first(
    report: AisReport, branch: int, en: tuple[float, float], t_s: float, now_s: float, *, is_shared: bool
) -> Vessel:
    return Vessel(
        mmsi=report.mmsi,
        branch=branch,
        t_s=t_s,
        heard_s=now_s,
        antenna_en_m=en,
        course_rad=report.course_rad,
        speed_mps=report.speed_mps,
        heading_rad=report.heading_rad,
        turn_rate_radps=report.turn_rate_radps,
        nav_status=report.nav_status,
        ship_type=report.ship_type,
        name=report.name,
        is_class_b=report.is_class_b,
        is_shared_mmsi=is_shared,
        hull=hull_of(report.bow_m, report.stern_m, report.port_m, report.starboard_m, is_class_b=report.is_class_b),
    )


def _moved(vessel: Vessel, report: AisReport, en: tuple[float, float], t_s: float, now_s: float) -> Vessel:
    described = _described(vessel, report, now_s)
    course, speed, derived = report.course_rad, report.speed_mps, False
    dt = t_s - vessel.t_s
    if (speed is None or (course is None and speed >= 0.3)) and 2.0 <= dt <= 120.0:
        # A report without a velocity: take it from the two positions.
        de, dn = en[0] - vessel.antenna_en_m[0], en[1] - vessel.antenna_en_m[1]
        speed = math.hypot(de, dn) / dt if speed is None else speed
        course = wrap_two_pi(math.atan2(de, dn)) if course is None else course
        derived = True
    lain_s, lain_en_m = _lain(vessel, report, en, dt)
    return replace(
        described,
        t_s=t_s,
        antenna_en_m=en,
        course_rad=course,
        speed_mps=speed,
        heading_rad=report.heading_rad,
        turn_rate_radps=report.turn_rate_radps,
        nav_status=report.nav_status if report.nav_status is not None else vessel.nav_status,
        is_class_b=report.is_class_b or vessel.is_class_b,
        reports=vessel.reports + 1,
        derived=derived,
        lain_s=lain_s,
        lain_en_m=lain_en_m,
    )


def _lain(
    vessel: Vessel, report: AisReport, en: tuple[float, float], dt_s: float
) -> tuple[float, tuple[float, float] | None]:
    """Return for how long a vessel shows itself lying still [s], and since the last ``LAIN_S`` where [m].

    Class B has no status that says so. From one report to the next a vessel that moves is as near as one that lies,
    where its reports come each second: it is held against where it lay some time ago.
    """
    has_speed = report.speed_mps is not None and report.speed_mps >= LIES_MPS
    lay_en_m = vessel.antenna_en_m if vessel.lain_en_m is None else vessel.lain_en_m
    if has_speed or math.dist(en, lay_en_m) > SWINGS_M or not 0.0 <= dt_s <= LIES_APART_S:
        return 0.0, None
    lain_s = vessel.lain_s + dt_s
    return lain_s, lay_en_m if lain_s // LAIN_S == vessel.lain_s // LAIN_S else en
