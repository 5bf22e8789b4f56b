"""Rules of the road for a judge: who keeps clear by COLREGs 12 to 18, and what two true tracks show of it.

Written from the rules and not from the companion's code, which it is to judge: nothing of ``companion.traffic`` is
used. Angles are those that the rules name, seen from each vessel in turn.

The duty is that of the moment when our boat could first know of the other (its first report).
Then, from the tracks alone:

- **we stand on** (17 a i): our course stays within ``STEADY_DEG`` until the other has evidently not acted, which is
  when no more than ``EVIDENT_S`` are left and it has not changed course; if it has, we still stand on until past;
- **we give way** (8, 15, 16): a change of course of ``APPARENT_DEG``, begun early (``EARLY_S`` before the meeting, or
  within ``PROMPT_S`` of its first report), and not across its bow nearer than ``AHEAD_S`` of its way; where rule 14
  says so, to starboard; under sail on port tack, with a vessel nearly dead before the wind whose tack nobody could
  tell, giving way is no fault either (12 a iii);
- **both**: the hulls stay ``keep_m`` apart.

The thresholds are this project's: the rules have none.

A ``Mariner`` is placed so that, both going on, the vessels are ``miss_m`` apart after ``meet_s``. One who keeps them
gives way where that is its duty: when as little as ``react_s`` is left it turns by 50 degrees to the side on
which it passes our stern, by more while that is not enough, and comes back to its course when we are past. Under sail
it does not turn nearer to the wind than it can sail.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

Craft = Literal["power", "sail", "fishing", "restricted", "not under command", "draught"]
Duty = Literal["first", "second", "both"]

# ITU-R M.1371: what a vessel of each kind says of itself.
STATUS: dict[Craft, int] = {"power": 0, "sail": 8, "fishing": 7, "restricted": 3, "not under command": 2, "draught": 4}
SHIP_TYPE: dict[Craft, int] = {
    "power": 70,
    "sail": 36,
    "fishing": 30,
    "restricted": 33,
    "not under command": 70,
    "draught": 80,
}
# Rule 18: who is before whom; a vessel constrained by its draught is not to be impeded by sail either.
_RANK: dict[Craft, int] = {"power": 0, "sail": 1, "draught": 2, "fishing": 3, "restricted": 4, "not under command": 4}
STERN_SECTOR_DEG = 112.5  # 22.5 degrees abaft the beam
END_ON_DEG = 6.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Mover:
    """A vessel at an instant: middle, course over ground, where the bow points, speed."""

    en_m: tuple[float, float]
    course_rad: float
    heading_rad: float
    speed_mps: float
    craft: Craft

    @property
    def velocity_mps(self) -> complex:
        """East and north [m/s]."""
        return complex(self.speed_mps * math.sin(self.course_rad), self.speed_mps * math.cos(self.course_rad))


def closest(a: Mover, b: Mover) -> tuple[float, float]:
    """Return (distance of middles [m], in how many seconds) at the closest, both going on; 0 s where they part."""
    off, way = complex(*b.en_m) - complex(*a.en_m), b.velocity_mps - a.velocity_mps
    if abs(way) < 1e-9:
        return abs(off), 0.0
    t_s = max(0.0, -(off * way.conjugate()).real / abs(way) ** 2)
    return abs(off + way * t_s), t_s


def bearing_off_bow_deg(a: Mover, b: Mover) -> float:
    """Return where ``b`` is seen from ``a``, from its bow, -180 to 180, positive to starboard."""
    bearing = math.degrees(math.atan2(b.en_m[0] - a.en_m[0], b.en_m[1] - a.en_m[1]))
    return _half_turn(bearing - math.degrees(a.heading_rad))


def duty(a: Mover, b: Mover, twd_from_rad: float) -> tuple[str, Duty]:
    """Return the rule, and who keeps out of the way: the first, the second, or both."""
    if abs(bearing_off_bow_deg(b, a)) > STERN_SECTOR_DEG and _gains_on(a, b):
        return "13", "first"
    if abs(bearing_off_bow_deg(a, b)) > STERN_SECTOR_DEG and _gains_on(b, a):
        return "13", "second"
    if _RANK[a.craft] != _RANK[b.craft]:
        return "18", "first" if _RANK[a.craft] < _RANK[b.craft] else "second"
    if a.craft == "sail":
        return "12", _sails(a, b, math.degrees(twd_from_rad))
    here = bearing_off_bow_deg(a, b)
    opposite = abs(_half_turn(math.degrees(b.heading_rad - a.heading_rad) + 180.0))
    if abs(here) < END_ON_DEG and opposite < 2.0 * END_ON_DEG:
        return "14", "both"
    return "15", "first" if here >= 0.0 else "second"


def _gains_on(a: Mover, b: Mover) -> bool:
    """Whether ``a`` comes up with ``b``: the range closes, and it is ``a`` who closes it along b's course."""
    along = complex(math.sin(b.heading_rad), math.cos(b.heading_rad))
    faster = (a.velocity_mps * along.conjugate()).real > (b.velocity_mps * along.conjugate()).real
    return closest(a, b)[1] > 0.0 and faster


def _sails(a: Mover, b: Mover, twd_deg: float) -> Duty:
    """Rule 12 a: the tack, and on the same tack the place."""
    first, second = (_half_turn(twd_deg - math.degrees(m.heading_rad)) > 0.0 for m in (a, b))
    if first != second:
        return "second" if first else "first"  # with the wind on the starboard side it is on starboard tack
    upwind = complex(math.sin(math.radians(twd_deg)), math.cos(math.radians(twd_deg)))
    higher = ((complex(*a.en_m) - complex(*b.en_m)) * upwind.conjugate()).real
    return "first" if higher >= 0.0 else "second"


def _half_turn(degrees: float) -> float:
    return math.remainder(degrees, 360.0)


STEADY_DEG = 15.0
APPARENT_DEG = 30.0
SHOWS_DEG = 15.0  # a change of course has begun
EVIDENT_S = 90.0
EARLY_S, PROMPT_S = 60.0, 45.0
AHEAD_S = 40.0
SMOOTH_S = 5.0
CROSS_DEG = (20.0, 160.0)
DOUBT_DEG = 25.0


@dataclass(slots=True)
class Met:
    """The true track of a vessel that was met, in the times of our boat's; ``heard_s`` is of its first report."""

    craft: Craft
    manner: str
    length_m: float
    beam_m: float
    heard_s: float | None = None
    t_s: list[float] = field(default_factory=list)
    en_m: list[tuple[float, float]] = field(default_factory=list)
    course_rad: list[float] = field(default_factory=list)
    speed_mps: list[float] = field(default_factory=list)


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What came of it; ``faults`` are the rules that our boat broke, in words."""

    rule: str
    duty: str  # "we stand on", "we give way", "both"
    manner: str
    craft: str
    cpa_unaltered_m: float
    meet_s: float  # from its first report to the meeting, both going on
    nearest_m: float  # between the hulls
    altered_deg: float  # our largest change of course before the closest approach
    altered_left_s: float | None  # to the meeting when our change had begun
    crossed: str  # "ahead", "astern", ""
    faults: tuple[str, ...]
    keep_m: float

    @property
    def kept_rules(self) -> bool:
        """Whether no rule was broken."""
        return not self.faults

    @property
    def kept_distance(self) -> bool:
        """Whether the hulls stayed apart as the mission wants."""
        return self.nearest_m >= self.keep_m

    def to_dict(self) -> dict[str, Any]:
        """Return the figures as plain values."""
        names = (
            "rule",
            "duty",
            "manner",
            "craft",
            "cpa_unaltered_m",
            "meet_s",
            "nearest_m",
            "altered_deg",
            "altered_left_s",
            "crossed",
            "keep_m",
        )
        plain = {n: round(v, 1) if isinstance(v := getattr(self, n), float) else v for n in names}
        return {
            **plain,
            "faults": list(self.faults),
            "kept_rules": self.kept_rules,
            "kept_distance": self.kept_distance,
        }


def judge_encounter(
    met: Met,
    t_s: Sequence[float],
    en_m: Sequence[tuple[float, float]],
    heading_rad: Sequence[float],
    twd_from_rad: Sequence[float],
    *,
    keep_m: float,
    our_length_m: float,
) -> Judgement | None:
    """Return what the tracks show; None where the other was not heard, or nothing was sailed after that.

    Args:
        met: the other's track.
        t_s: our track's times.
        en_m: our places.
        heading_rad: where our bow pointed.
        twd_from_rad: the wind there.
        keep_m: between the hulls, what the mission asks for.
        our_length_m: of our hull, taken as a disc.

    """
    if met.heard_s is None:
        return None
    times = np.asarray(met.t_s)
    times = times[times >= met.heard_s]
    if len(times) < 2 * SMOOTH_S:
        return None
    times = np.arange(times[0], times[-1], 1.0)
    ours, hers = _at(times, t_s, en_m), _at(times, met.t_s, met.en_m)
    ours_deg, hers_deg = _courses_deg(times, t_s, en_m), _courses_deg(times, met.t_s, met.en_m)
    speeds = _speeds(times, t_s, en_m), _speeds(times, met.t_s, met.en_m)
    wind = np.interp(times, t_s, np.unwrap(twd_from_rad))
    bows = np.interp(times, t_s, np.unwrap(heading_rad))
    gaps = _gaps(ours, hers, hers_deg, met, our_length_m)
    movers = [
        (
            Mover(
                en_m=(float(ours[i, 0]), float(ours[i, 1])),
                course_rad=math.radians(ours_deg[i]),
                heading_rad=float(bows[i]),
                speed_mps=float(speeds[0][i]),
                craft="sail",
            ),
            Mover(
                en_m=(float(hers[i, 0]), float(hers[i, 1])),
                course_rad=math.radians(hers_deg[i]),
                heading_rad=math.radians(hers_deg[i]),
                speed_mps=float(speeds[1][i]),
                craft=met.craft,
            ),
        )
        for i in range(len(times))
    ]
    rule, who = duty(*movers[0], float(np.median(wind[:10])))
    cpa_m, meet_s = closest(*movers[0])
    nearest = int(np.argmin(gaps))
    turned = np.abs(ours_deg - ours_deg[0])
    her_turn = np.abs(hers_deg - hers_deg[0])
    before = slice(0, nearest + 1)
    begun = np.flatnonzero(turned[before] >= SHOWS_DEG)
    left_s = float(meet_s - (times[begun[0]] - times[0])) if len(begun) else None
    crossed = _crossed(ours, hers, hers_deg, speeds[1], float(hers_deg[0] - ours_deg[0]))
    giving_way = _give_way_faults(turned[before], left_s, meet_s, times, begun, crossed, rule)
    faults = (
        giving_way
        if who != "second"
        else _stand_on_faults(movers, turned, her_turn, nearest, keep_m + 0.5 * met.length_m)
    )
    if who == "second" and faults and rule == "12" and not giving_way and _in_doubt(*movers[0], float(wind[0])):
        who, faults = "first", []
    if who == "both" and len(begun) and ours_deg[begun[0]] < ours_deg[0]:
        faults.append("altered to port")
    return Judgement(
        rule=rule,
        duty={"first": "we give way", "second": "we stand on", "both": "both"}[who],
        manner=met.manner,
        craft=met.craft,
        cpa_unaltered_m=cpa_m,
        meet_s=meet_s,
        nearest_m=float(gaps[nearest]),
        altered_deg=float(turned[before].max()),
        altered_left_s=left_s,
        crossed=crossed[0],
        faults=tuple(faults),
        keep_m=keep_m,
    )


def _in_doubt(ours: Mover, hers: Mover, twd_from_rad: float) -> bool:
    """Whether we are on port tack and the other's tack cannot be told for sure: it runs nearly dead before the wind."""
    off_wind = math.degrees(abs(math.remainder(hers.heading_rad - twd_from_rad, 2.0 * math.pi)))
    return off_wind > 180.0 - DOUBT_DEG and math.sin(twd_from_rad - ours.heading_rad) < 0.0


def _stand_on_faults(
    movers: Sequence[tuple[Mover, Mover]],
    turned: NDArray[np.float64],
    her_turn: NDArray[np.float64],
    nearest: int,
    clear_m: float,
) -> list[str]:
    began = movers[0][0]
    for i in range(nearest + 1):
        ours, hers = movers[i]
        # By our first course: a turn of ours makes the time that is left look short, and must not excuse itself.
        cpa_m, left_s = closest(replace(ours, course_rad=began.course_rad, heading_rad=began.heading_rad), hers)
        acts = bool(her_turn[: i + 1].max() >= SHOWS_DEG)
        evident = left_s <= EVIDENT_S and not acts and cpa_m < clear_m + 0.5 * clear_m
        if evident:
            return []
        if turned[i] > STEADY_DEG:
            return [f"did not stand on: {turned[i]:.0f} degrees off her course, {left_s:.0f} s before the meeting"]
    return []


def _give_way_faults(
    turned: NDArray[np.float64],
    left_s: float | None,
    meet_s: float,
    times: NDArray[np.float64],
    begun: NDArray[np.intp],
    crossed: tuple[str, float],
    rule: str,
) -> list[str]:
    faults = []
    if left_s is None or turned.max() < APPARENT_DEG:
        faults.append(f"not apparent: {turned.max():.0f} degrees")
    elif left_s < min(EARLY_S, 0.5 * meet_s) and times[begun[0]] - times[0] > PROMPT_S:
        faults.append(f"late: {left_s:.0f} s before the meeting")
    if crossed[0] == "ahead" and crossed[1] < AHEAD_S and rule in {"15", "18"}:
        faults.append(f"crossed {crossed[1]:.0f} s ahead of her bow")
    return faults


def _crossed(
    ours: NDArray[np.float64],
    hers: NDArray[np.float64],
    hers_deg: NDArray[np.float64],
    speed: NDArray[np.float64],
    between_deg: float,
) -> tuple[str, float]:
    """Return on which side of the other we crossed its course's line first, and how many seconds of its way off."""
    if not CROSS_DEG[0] < abs(math.remainder(between_deg, 360.0)) < CROSS_DEG[1]:
        return "", math.inf
    off = ours - hers
    s, c = np.sin(np.radians(hers_deg)), np.cos(np.radians(hers_deg))
    along, across = off[:, 0] * s + off[:, 1] * c, off[:, 0] * c - off[:, 1] * s
    changes = np.flatnonzero(np.sign(across[1:]) != np.sign(across[:-1]))
    if not len(changes):
        return "", math.inf
    i = int(changes[0])
    return ("ahead" if along[i] > 0.0 else "astern"), abs(float(along[i])) / max(0.5, float(speed[i]))


def _at(times: NDArray[np.float64], t_s: Sequence[float], en_m: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    points = np.asarray(en_m, dtype=np.float64)
    return np.column_stack([np.interp(times, t_s, points[:, k]) for k in (0, 1)])


def _ways(times: NDArray[np.float64], t_s: Sequence[float], en_m: Sequence[tuple[float, float]]) -> NDArray[np.float64]:
    half = 0.5 * SMOOTH_S
    ahead, behind = np.minimum(times + half, t_s[-1]), np.maximum(times - half, t_s[0])
    return np.asarray((_at(ahead, t_s, en_m) - _at(behind, t_s, en_m)) / (ahead - behind)[:, None])


def _courses_deg(
    times: NDArray[np.float64], t_s: Sequence[float], en_m: Sequence[tuple[float, float]]
) -> NDArray[np.float64]:
    way = _ways(times, t_s, en_m)
    return np.asarray(np.degrees(np.unwrap(np.arctan2(way[:, 0], way[:, 1]))))


def _speeds(
    times: NDArray[np.float64], t_s: Sequence[float], en_m: Sequence[tuple[float, float]]
) -> NDArray[np.float64]:
    return np.asarray(np.hypot(*_ways(times, t_s, en_m).T))


def _gaps(
    ours: NDArray[np.float64], hers: NDArray[np.float64], hers_deg: NDArray[np.float64], met: Met, our_length_m: float
) -> NDArray[np.float64]:
    """Return the distances between the other's rectangle and our disc [m]."""
    off = ours - hers
    s, c = np.sin(np.radians(hers_deg)), np.cos(np.radians(hers_deg))
    along, across = np.abs(off[:, 0] * s + off[:, 1] * c), np.abs(off[:, 0] * c - off[:, 1] * s)
    gap = np.hypot(np.maximum(0.0, along - 0.5 * met.length_m), np.maximum(0.0, across - 0.5 * met.beam_m))
    return np.asarray(np.maximum(0.0, gap - 0.5 * our_length_m))


Manner = Literal["rules", "keeps"]
TURN_DEG, MORE_DEG, MOST_DEG = 50.0, 20.0, 110.0
MORE_AFTER_S = 15.0
CLOSE_HAULED_DEG = 50.0
NIMBLE_M = 40.0  # shorter than this it turns fast
RATES_DEG_S = (6.0, 2.5)
ROOM_M = 90.0  # between the middles, beyond half its length: what it wants between us


@dataclass(slots=True)
class Mariner:
    """State of the other vessel; ``watch`` moves it on by a second."""

    mmsi: int
    length_m: float
    craft: Craft
    manner: Manner
    react_s: float
    base_rad: float  # the course that it is on its way by
    speed_mps: float
    en_m: tuple[float, float]
    t_s: float
    name: str = ""
    course_rad: float = 0.0
    turn_deg: float = 0.0  # how far off its course it has decided to go
    turned_s: float = -math.inf
    gives_way: bool | None = None  # by what the rules gave when it began

    def __post_init__(self) -> None:
        self.course_rad = self.base_rad

    def at(self, t_s: float) -> tuple[float, float]:
        """Return its middle at ``t_s``, a second or so from the last look."""
        run = self.speed_mps * (t_s - self.t_s)
        return self.en_m[0] + run * math.sin(self.course_rad), self.en_m[1] + run * math.cos(self.course_rad)

    def way(self, t_s: float) -> tuple[float, float, float]:  # noqa: ARG002 - it turns from look to look
        """Return course, heading and speed."""
        return self.course_rad, self.course_rad, self.speed_mps

    def mover(self, course_rad: float | None = None) -> Mover:
        """Return the vessel as the rules see it, on its course or on another."""
        course = self.course_rad if course_rad is None else course_rad
        return Mover(en_m=self.en_m, course_rad=course, heading_rad=course, speed_mps=self.speed_mps, craft=self.craft)

    def watch(self, ours: Mover, twd_from_rad: float, t_s: float) -> None:
        """Go on to ``t_s`` and look round."""
        self.en_m, step_s, self.t_s = self.at(t_s), t_s - self.t_s, t_s
        if self.gives_way is None:
            self.gives_way = duty(ours, self.mover(), twd_from_rad)[1] != "first"
        if self.manner == "rules" and self.gives_way:
            self._give_way(ours, math.degrees(twd_from_rad))
        rate = math.radians(RATES_DEG_S[self.length_m > NIMBLE_M]) * step_s
        off = math.remainder(self.base_rad + math.radians(self.turn_deg) - self.course_rad, 2.0 * math.pi)
        self.course_rad += max(-rate, min(rate, off))

    def _give_way(self, ours: Mover, twd_deg: float) -> None:
        room_m = ROOM_M + 0.5 * self.length_m
        if self.turn_deg:
            away_m, ahead_s = closest(ours, self.mover(self.base_rad))
            if ahead_s == 0.0 or away_m > 1.5 * room_m:
                self.turn_deg = 0.0
                return
        away_m, ahead_s = closest(ours, self.mover(self.base_rad + math.radians(self.turn_deg)))
        if ahead_s == 0.0 or ahead_s > self.react_s or away_m >= room_m or self.t_s - self.turned_s < MORE_AFTER_S:
            return
        size = min(abs(self.turn_deg) + (MORE_DEG if self.turn_deg else TURN_DEG), MOST_DEG)
        sides = (1.0, -1.0) if not self.turn_deg else (math.copysign(1.0, self.turn_deg),)
        able = [s * size for s in sides if self._can(s * size, twd_deg)] or [
            s * size for s in (1.0, -1.0) if self._can(s * size, twd_deg)
        ]
        if able:
            # The better side by what is gained; to starboard where both do.
            self.turn_deg = max(
                able,
                key=lambda d: (
                    round(min(room_m, closest(ours, self.mover(self.base_rad + math.radians(d)))[0]), -1),
                    d,
                ),
            )
            self.turned_s = self.t_s

    def _can(self, turn_deg: float, twd_deg: float) -> bool:
        if self.craft != "sail":
            return True
        return abs(math.remainder(math.degrees(self.base_rad) + turn_deg - twd_deg, 360.0)) >= CLOSE_HAULED_DEG


@dataclass(slots=True)
class Receiver:
    """What AIS makes of a vessel: errors of its receiver and log, drawn from a seed."""

    rng: np.random.Generator
    fix_sd_m: float = 3.0
    drift: complex = 0j  # of the fix: it wanders, it does not jump

    def fix_error_m(self) -> complex:
        """Return the error of the next fix, east and north [m]."""
        keep = 0.9
        noise = self.rng.normal(size=2) * self.fix_sd_m * math.sqrt(1.0 - keep * keep)
        self.drift = keep * self.drift + complex(*noise)
        return self.drift

    def speed_error_mps(self) -> float:
        """Return the error of the next speed."""
        return float(self.rng.normal(0.0, 0.1))

    def course_error_rad(self, speed_mps: float) -> float:
        """Return the error of the next course: a slow vessel's is worse."""
        return math.radians(float(self.rng.normal(0.0, 1.0 + 2.0 / max(speed_mps, 0.5))))


def met_by(
    ours: tuple[tuple[float, float], tuple[float, float]],
    course_deg: float,
    sog_mps: float,
    meet_s: float,
    miss_m: float,
) -> tuple[tuple[float, float], float]:
    """Return where a vessel is, and its course [rad], that will meet ours after ``meet_s``.

    Args:
        ours: position and velocity, east and north [m, m/s].
        course_deg: the vessel's, clockwise from ours.
        sog_mps: the vessel's.
        meet_s: until the closest approach, both going on.
        miss_m: between the middles then; positive: it is ahead of our bow, or to starboard where courses are alike.

    """
    (east, north), (ve, vn) = ours
    course = math.atan2(ve, vn) + math.radians(course_deg)
    hers = complex(sog_mps * math.sin(course), sog_mps * math.cos(course))
    relative = hers - complex(ve, vn)
    bow = complex(ve, vn) / max(1e-9, math.hypot(ve, vn))
    beside = relative / max(1e-9, abs(relative)) * 1j
    towards = (
        (beside * bow.conjugate()).real
        if abs(math.sin(math.radians(course_deg))) > 0.2
        else (beside * (bow * -1j).conjugate()).real
    )
    there = complex(east, north) + complex(ve, vn) * meet_s + beside * math.copysign(miss_m, towards * miss_m)
    start = there - hers * meet_s
    return (start.real, start.imag), course
