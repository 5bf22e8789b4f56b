"""The judge of an encounter: what two true tracks show of the rules of the road, and of the distance.

The duty is that of the moment when our boat could first know of the other (her first report), by ``sitl.scene.road``.
Then, from the tracks alone:

- **we stand on** (17 a i): our course stays within ``STEADY_DEG`` until the other has evidently not acted, which is
  when no more than ``EVIDENT_S`` are left and she has not changed course; if she has, we still stand on until past;
- **we give way** (8, 15, 16): a change of course of ``APPARENT_DEG``, begun early (``EARLY_S`` before the meeting, or
  within ``PROMPT_S`` of her first report), and not across her bow nearer than ``AHEAD_S`` of her way; where rule 14
  says so, to starboard; under sail on port tack, with a vessel nearly dead before the wind whose tack nobody could
  tell, giving way is no fault either (12 a iii);
- **both**: the hulls stay ``keep_m`` apart.

The thresholds are this project's: the rules have none.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sitl.scene.road import Craft, Mover, closest, duty

STEADY_DEG = 15.0
APPARENT_DEG = 30.0
SHOWS_DEG = 15.0             # a change of course has begun
EVIDENT_S = 90.0
EARLY_S, PROMPT_S = 60.0, 45.0
AHEAD_S = 40.0
SMOOTH_S = 5.0
CROSS_DEG = (20.0, 160.0)
DOUBT_DEG = 25.0


@dataclass(slots=True)
class Met:
    """The true track of a vessel that was met, in the times of our boat's; ``heard_s`` is of her first report."""

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
    duty: str                # "we stand on", "we give way", "both"
    manner: str
    craft: str
    cpa_unaltered_m: float
    meet_s: float            # from her first report to the meeting, both going on
    nearest_m: float         # between the hulls
    altered_deg: float       # our largest change of course before the closest approach
    altered_left_s: float | None   # to the meeting when our change had begun
    crossed: str             # "ahead", "astern", ""
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
        names = ("rule", "duty", "manner", "craft", "cpa_unaltered_m", "meet_s", "nearest_m", "altered_deg",
                 "altered_left_s", "crossed", "keep_m")
        plain = {n: round(v, 1) if isinstance(v := getattr(self, n), float) else v for n in names}
        return {**plain, "faults": list(self.faults), "kept_rules": self.kept_rules,
                "kept_distance": self.kept_distance}


def judge_encounter(
    met: Met, t_s: Sequence[float], en_m: Sequence[tuple[float, float]], heading_rad: Sequence[float],
    twd_from_rad: Sequence[float], *, keep_m: float, our_length_m: float, craft: Craft = "sail",
) -> Judgement | None:
    """Return what the tracks show; None where she was not heard, or nothing was sailed after that.

    Args:
        met: the other's track.
        t_s: our track's times.
        en_m: our places.
        heading_rad: where our bow pointed.
        twd_from_rad: the wind there.
        keep_m: between the hulls, what the mission asks for.
        our_length_m: of our hull, taken as a disc.
        craft: ours.

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
        (Mover(en_m=(float(ours[i, 0]), float(ours[i, 1])), course_rad=math.radians(ours_deg[i]),
               heading_rad=float(bows[i]), speed_mps=float(speeds[0][i]), craft=craft),
         Mover(en_m=(float(hers[i, 0]), float(hers[i, 1])), course_rad=math.radians(hers_deg[i]),
               heading_rad=math.radians(hers_deg[i]), speed_mps=float(speeds[1][i]), craft=met.craft))
        for i in range(len(times))]
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
    faults = giving_way if who != "second" else _stand_on_faults(
        movers, turned, her_turn, nearest, keep_m + 0.5 * met.length_m)
    if who == "second" and faults and rule == "12" and not giving_way and _in_doubt(*movers[0], float(wind[0])):
        who, faults = "first", []
    if who == "both" and len(begun) and ours_deg[begun[0]] < ours_deg[0]:
        faults.append("altered to port")
    return Judgement(
        rule=rule, duty={"first": "we give way", "second": "we stand on", "both": "both"}[who], manner=met.manner,
        craft=met.craft, cpa_unaltered_m=cpa_m, meet_s=meet_s, nearest_m=float(gaps[nearest]),
        altered_deg=float(turned[before].max()), altered_left_s=left_s, crossed=crossed[0], faults=tuple(faults),
        keep_m=keep_m)


def _in_doubt(ours: Mover, hers: Mover, twd_from_rad: float) -> bool:
    """Whether we are on port tack and her tack cannot be told for sure: she runs nearly dead before the wind."""
    off_wind = math.degrees(abs(math.remainder(hers.heading_rad - twd_from_rad, 2.0 * math.pi)))
    return off_wind > 180.0 - DOUBT_DEG and math.sin(twd_from_rad - ours.heading_rad) < 0.0


def _stand_on_faults(
    movers: Sequence[tuple[Mover, Mover]], turned: NDArray[np.float64], her_turn: NDArray[np.float64], nearest: int,
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
    turned: NDArray[np.float64], left_s: float | None, meet_s: float, times: NDArray[np.float64],
    begun: NDArray[np.intp], crossed: tuple[str, float], rule: str,
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
    ours: NDArray[np.float64], hers: NDArray[np.float64], hers_deg: NDArray[np.float64], speed: NDArray[np.float64],
    between_deg: float,
) -> tuple[str, float]:
    """Return on which side of her we crossed her course's line first, and how many seconds of her way off."""
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
    times: NDArray[np.float64], t_s: Sequence[float], en_m: Sequence[tuple[float, float]],
) -> NDArray[np.float64]:
    way = _ways(times, t_s, en_m)
    return np.asarray(np.degrees(np.unwrap(np.arctan2(way[:, 0], way[:, 1]))))


def _speeds(
    times: NDArray[np.float64], t_s: Sequence[float], en_m: Sequence[tuple[float, float]],
) -> NDArray[np.float64]:
    return np.asarray(np.hypot(*_ways(times, t_s, en_m).T))


def _gaps(
    ours: NDArray[np.float64], hers: NDArray[np.float64], hers_deg: NDArray[np.float64], met: Met, our_length_m: float,
) -> NDArray[np.float64]:
    """Return the distances between her rectangle and our disc [m]."""
    off = ours - hers
    s, c = np.sin(np.radians(hers_deg)), np.cos(np.radians(hers_deg))
    along, across = np.abs(off[:, 0] * s + off[:, 1] * c), np.abs(off[:, 0] * c - off[:, 1] * s)
    gap = np.hypot(np.maximum(0.0, along - 0.5 * met.length_m), np.maximum(0.0, across - 0.5 * met.beam_m))
    return np.asarray(np.maximum(0.0, gap - 0.5 * our_length_m))
