"""A boat learned from its logs, whole: speeds, no-go zone, best angles, tacks and gybes, and what is still open.

>>> settled(Known(mean=0.1, sd=0.02), 0.05)
True
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.boat.learn import TWA_DEG, TWS_MPS, Known, LearnedBoat, learn
from companion.boat.log import BoatLog, Why, stretches_of
from companion.boat.manoeuvres import Chances, Manoeuvre, chances, manoeuvres_of
from companion.boat.polar import Polar
from companion.words import counted

Floats = NDArray[np.float64]

# What the nearest stretches of a beat say of the no-go zone.
HELD_QUANTILE, LEAST_HELD, BEAT_DEG = 0.1, 5, 75.0
HELD_SD_DEG, GUESSED_SD_DEG, MUCH_WIDER_DEG = 1.5, 5.0, 6.0
INTERVAL = (0.1, 0.9)
FEW_TACKS = 6
# Less sure than this, and it is said with the manoeuvre that would settle it.
OPEN_VANE, OPEN_COMPASS, OPEN_LEEWAY = math.radians(2.0), math.radians(2.0), math.radians(2.5)
OPEN_CURRENT_MPS, OPEN_COMMON = 0.08, 0.08
CERTAIN = 2.0  # deviations, and at least ...
TELLING = math.radians(2.0)
WIND_BIN_MPS = 2.0
# (from, to) degrees, what sailing there is called
COURSES = (
    (35.0, 55.0, "a beat"),
    (55.0, 80.0, "a close reach"),
    (80.0, 105.0, "a reach"),
    (105.0, 140.0, "a broad reach"),
    (140.0, 181.0, "a run"),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class BestAngles:
    """In one wind: the angles of the best beat and run as intervals [deg], and what they make good [m/s]."""

    tws_mps: float
    beat_deg: tuple[float, float, float]
    beat_mps: float
    run_deg: tuple[float, float, float]
    run_mps: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Lesson:
    """What logs tell of a boat; angles in radians but where a name says otherwise."""

    boat: LearnedBoat
    outing_names: tuple[str, ...]
    left_out: Counter[Why]
    no_go: Known
    no_go_is_sailed: bool
    angles: tuple[BestAngles, ...]
    tacks: Chances
    gybes: Chances
    tacks_by_wind: tuple[tuple[float, Chances], ...]
    turn_rate: Known | None
    vane_width: Known | None
    """Half of what the wind seems to turn by from starboard tack to port, beside what tacks on shifts do."""
    hours: float
    findings: tuple[str, ...]


def settled(figure: Known, enough: float) -> bool:
    """Return whether a figure is known well enough."""
    return figure.sd <= enough


def lesson_of(
    logs: Sequence[BoatLog], prior: Polar, prior_error: float, *, no_go_half_rad: float, seed: int = 0
) -> Lesson:
    """Return what the logs tell of a boat that was believed to be as ``prior``.

    Args:
        logs: at least one.
        prior: its speeds, as they were believed.
        prior_error: how far all of them may be off together, as the deviation of the logarithm.
        no_go_half_rad: as it was believed.
        seed: of the draws that the best angles' intervals are from.

    Raises:
        ValueError: the logs hold too little steady sailing.
    """
    stretches = stretches_of(list(logs), prior, prior_error)
    boat = learn(stretches, prior, prior_error, seed=seed)
    done = [m for log in logs for m in manoeuvres_of(log, boat.vane.mean, boat.compass.mean)]
    tacks, gybes = ([m for m in done if m.is_tack is wanted] for wanted in (True, False))
    no_go, is_sailed = _no_go(boat, no_go_half_rad)
    rates = np.array([m.rate_radps for m in done if m.rate_radps is not None])
    shifts = np.array([m.shift_rad for m in tacks if m.shift_rad is not None])
    lesson = Lesson(
        boat=boat,
        outing_names=stretches.outing_names,
        left_out=stretches.left_out,
        no_go=no_go,
        no_go_is_sailed=is_sailed,
        angles=_angles(boat),
        tacks=chances(tacks),
        gybes=chances(gybes),
        tacks_by_wind=_by_wind(tacks),
        turn_rate=_middle(rates) if rates.shape[0] > 2 else None,
        vane_width=_middle(0.5 * shifts) if shifts.shape[0] >= FEW_TACKS else None,
        hours=float(np.sum(stretches.length_s)) / 3600.0,
        findings=(),
    )
    return _with_findings(lesson)


def _middle(values: Floats) -> Known:
    spread = 1.4826 * float(np.median(np.abs(values - np.median(values))))
    return Known(mean=float(np.median(values)), sd=1.25 * spread / math.sqrt(values.shape[0]))


def _no_go(boat: LearnedBoat, believed_rad: float) -> tuple[Known, bool]:
    """Return the half angle of the no-go zone, and whether anybody sailed near it.

    It is the nearest that a beat was held to, and at least the angle of the best one: an autopilot that keeps off the
    zone by its own setting never shows where the boat stops.
    """
    off = np.abs(boat.twa_rad)
    beats = off[off < math.radians(BEAT_DEG)]
    guessed = Known(mean=believed_rad, sd=math.radians(GUESSED_SD_DEG))
    if beats.shape[0] < LEAST_HELD:
        return guessed, False
    held = float(np.quantile(beats, HELD_QUANTILE))
    if held > believed_rad + math.radians(MUCH_WIDER_DEG):
        return guessed, False  # nobody tried
    best = boat.polar.best_beat(_usual_wind(boat)).twa_rad
    sd = math.hypot(math.radians(HELD_SD_DEG), boat.vane.sd)
    return Known(mean=max(held, best), sd=min(sd, guessed.sd)), True


def _usual_wind(boat: LearnedBoat) -> float:
    return float(TWS_MPS[int(np.argmax(boat.seen.sum(axis=0)))])


def _angles(boat: LearnedBoat) -> tuple[BestAngles, ...]:
    out = []
    beats, runs = np.radians(np.arange(30.0, 75.1, 0.5)), np.radians(np.arange(110.0, 180.1, 1.0))
    for j in np.flatnonzero(boat.seen.sum(axis=0) > 0).tolist():
        rows: list[tuple[tuple[float, float, float], float]] = []
        for angles, sign in ((beats, 1.0), (runs, -1.0)):
            speeds = np.array([np.interp(angles, np.radians(TWA_DEG), draw[:, j]) for draw in boat.draws])
            made = sign * speeds * np.cos(angles)
            best = np.degrees(angles[np.argmax(made, axis=1)])
            low, middle, high = np.quantile(best, [INTERVAL[0], 0.5, INTERVAL[1]]).tolist()
            rows.append(((low, middle, high), float(np.median(made.max(axis=1)))))
        out.append(
            BestAngles(
                tws_mps=float(TWS_MPS[j]),
                beat_deg=rows[0][0],
                beat_mps=rows[0][1],
                run_deg=rows[1][0],
                run_mps=rows[1][1],
            )
        )
    return tuple(out)


def _by_wind(tacks: list[Manoeuvre]) -> tuple[tuple[float, Chances], ...]:
    bins: dict[int, list[Manoeuvre]] = {}
    for tack in tacks:
        bins.setdefault(int(tack.tws_mps / WIND_BIN_MPS), []).append(tack)
    return tuple(((n + 0.5) * WIND_BIN_MPS, chances(bins[n])) for n in sorted(bins))


def offset_step_deg(vane: Known) -> float:
    """Return what WNDVN_DIR_OFS is to be changed by [deg].

    ArduPilot adds it to what an analog vane (WNDVN_TYPE 3) or an NMEA one (4) says, clockwise from the bow, and to no
    other's (AP_WindVane_Analog.cpp, AP_WindVane_NMEA.cpp; master of 2025).
    """
    return -math.degrees(vane.mean)


def _with_findings(lesson: Lesson) -> Lesson:
    return replace(lesson, findings=tuple(_findings(lesson)))


def _findings(lesson: Lesson) -> list[str]:
    boat, out = lesson.boat, list(lesson.boat.findings)
    vane, compass, leeway = boat.vane, boat.compass, boat.leeway
    vane_sd, compass_sd, leeway_sd = (f"{math.degrees(k.sd):.1f}" for k in (vane, compass, leeway))
    if abs(vane.mean) > max(CERTAIN * vane.sd, TELLING):
        out.append(
            f"the vane points {abs(math.degrees(vane.mean)):.1f} degrees too far to "
            f"{'starboard' if vane.mean > 0.0 else 'port'} (deviation {vane_sd}): turn it back, or change "
            f"WNDVN_DIR_OFS (of an analog or NMEA vane) by {offset_step_deg(vane):+.1f}, in steps of 5 at most, "
            "and learn from later logs"
        )
    elif not settled(vane, OPEN_VANE):
        out.append(
            f"whether the vane is turned is known to {vane_sd} degrees: a boat that is faster on one tack looks "
            "the same; a reach and a run on both tacks settle it"
        )
    if not settled(compass, OPEN_COMPASS) or not settled(leeway, OPEN_LEEWAY):
        out.append(
            f"compass ({compass_sd} degrees), leeway ({leeway_sd}) and a stream across are not told apart: a "
            "reciprocal reach, ten minutes there and ten back, settles it"
        )
    elif abs(compass.mean) > max(CERTAIN * compass.sd, TELLING):
        out.append(f"the compass is off by {math.degrees(compass.mean):+.1f} degrees (deviation {compass_sd})")
    loose = sum(max(east.sd, north.sd) > OPEN_CURRENT_MPS for east, north in boat.currents)
    if loose:
        out.append(
            f"the stream is not told from the boat's speed in {loose} of {counted(len(boat.currents), 'outing')}: a "
            "circle, or four headings at right angles, within twenty minutes, settles it"
        )
    if boat.common > OPEN_COMMON:
        out.append(
            f"all speeds may be off together by {100.0 * boat.common:.0f} %: reaches there and back on other days "
            "settle it"
        )
    near = np.degrees(np.abs(boat.twa_rad))
    absent = [what for low, high, what in COURSES if not bool(np.any((near >= low) & (near < high)))]
    if absent:
        out.append(f"nobody sailed {', '.join(absent)}: the speeds there are guessed from the rest")
    if not lesson.no_go_is_sailed:
        out.append("how near to the wind the boat sails is guessed: five minutes close-hauled on each tack settle it")
    if lesson.tacks.tried < FEW_TACKS:
        out.append(
            f"{counted(lesson.tacks.tried, 'tack')} seen: six on one beat, of a minute each, tell what one costs"
        )
    elif lesson.tacks.loss_s is None:
        out.append("what a tack costs cannot be told, the boards are too short: six tacks, of a minute each, settle it")
    if lesson.tacks.failed:
        out.append(
            f"{lesson.tacks.failed} of {counted(lesson.tacks.tried, 'tack')} failed: {100.0 * lesson.tacks.fails:.0f} "
            f"%, at most {100.0 * lesson.tacks.fails_most:.0f} % with nine chances in ten"
        )
    return out
