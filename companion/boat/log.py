"""What a log tells of a boat, second by second, and the stretches of steady sailing in it.

A stretch is believed for the boat's speed, or left out for one named reason (``Why``) and counted: what nobody could
learn from must not be learned from.
"""

from __future__ import annotations

import enum
import math
from collections import Counter
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from companion.boat.polar import Polar
from companion.boat.towed import driven
from companion.geo.angles import wrap_pi, wrap_pi_array

Floats = NDArray[np.float64]

STRETCH_S = 30.0  # about one independent sample of a boat's speed
SHORT_S = 12.0  # of a small boat on short legs; it counts for less
LEAST_KNOWN = 0.7  # of the stretch's samples, known
GAP_S = 5.0  # longer without a sample, and what is before and after are apart
OUTING_GAP_S = 600.0  # longer, and it is another outing: another day's bottom, sea and stream
BEFORE_S, AFTER_S = 2.0, 10.0  # of a manoeuvre: a heavy boat that is slow for longer is ``UNSTEADY``
TURN_DEG = 20.0  # the bow turns so much within ``TURN_S``: a manoeuvre
TURN_S = 5
LIGHT_MPS = 1.0  # below it a vane's direction is nearly without meaning
SHIFTY_DEG, GUSTY_SHARE = 12.0, 0.3  # deviations within a stretch, of the wind's angle and of its speed
UNSTEADY_SHARE = 0.15  # between the halves of a stretch
FROZEN_S = 20  # a vane or compass that gives one value for so long while the boat turns has stopped
LEAP_MPS = 4.0  # a position that moves so much faster than the velocity says was set anew
ASIDE_DEG = 50.0  # a course so far from the bow is a drift
HEAD_TO_WIND_DEG = 25.0  # nobody sails there: whoever makes way there is driven
NEAR_RAD = math.radians(45.0)  # nearer to the wind no guess says how fast a boat is
TOO_FAST = 3.0  # times the prior's error above what it says (logarithm), and at least so many times as fast:
TOO_FAST_LEAST = 2.0


class Why(enum.Enum):
    """Why a stretch tells nothing of the boat's speed."""

    NOT_SAILED = "disarmed, or a mode in which the sheets are eased"
    UNKNOWN = "wind, heading or speed not known"
    MOTOR = "the motor runs"
    DRIVEN = "no wind explains the speed: a motor or a tow"
    FROZEN_VANE = "the vane has stopped"
    FROZEN_COMPASS = "the compass has stopped"
    RESET = "the position was set anew"
    MANOEUVRE = "a manoeuvre, or just after one"
    LIGHT = "hardly any wind"
    GUSTY = "the wind is not steady"
    UNSTEADY = "she gathers way or loses it"
    DRIFT = "she drifts"
    DOUBTED = "wind or water are in doubt"  # under way alone
    UNLIKE = "unlike all that was sailed before"  # likewise


@dataclass(frozen=True, slots=True, kw_only=True)
class BoatLog:
    """One log: arrays (n,), a second apart as a rule, NaN where nothing is known; ``t_s`` never decreases.

    Attributes:
        name: Of the file or folder.
        t_s: Unix time, or seconds since any moment.
        velocity_en_mps: (n, 2) over the ground.
        heading_rad: Of the bow.
        awa_rad, aws_mps: The apparent wind, as the sensor tells it.
        position_en_m: (n, 2), about any place; NaN unknown.
        stw_mps: Speed through the water, of those that have a log.
        is_sailed: (n,) False: disarmed, holding, loitering.
        has_motor_on: (n,) True: a motor is known to run.
        notes: What its reader had to step over.
    """

    name: str
    t_s: Floats
    velocity_en_mps: Floats
    heading_rad: Floats
    awa_rad: Floats
    aws_mps: Floats
    position_en_m: Floats
    stw_mps: Floats
    is_sailed: NDArray[np.bool_]
    has_motor_on: NDArray[np.bool_]
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = self.t_s.shape[0]
        for name in ("heading_rad", "awa_rad", "aws_mps", "stw_mps", "is_sailed", "has_motor_on"):
            if getattr(self, name).shape != (n,):
                raise ValueError(f"{name} must be {n} values")
        if self.velocity_en_mps.shape != (n, 2) or self.position_en_m.shape != (n, 2):
            raise ValueError(f"velocities and positions must be {n} pairs")
        if bool(np.any(np.diff(self.t_s) < 0.0)):
            raise ValueError("time steps back")

    @property
    def wind_en_mps(self) -> Floats:
        """The wind's from-vector over the ground (n, 2), by the sensor as it is."""
        angle = self.heading_rad + self.awa_rad
        return np.asarray(
            self.aws_mps[:, None] * np.column_stack([np.sin(angle), np.cos(angle)]) - self.velocity_en_mps
        )

    @property
    def twa_rad(self) -> Floats:
        """The true wind's angle over the ground (n,), starboard positive, by the sensor as it is."""
        wind = self.wind_en_mps
        return wrap_pi_array(np.arctan2(wind[:, 0], wind[:, 1]) - self.heading_rad)

    def pieces(self) -> list[slice]:
        """Return what is without a gap."""
        return _cut(self.t_s, GAP_S)


def _cut(t_s: Floats, gap_s: float) -> list[slice]:
    ends = [0, *(np.flatnonzero(np.diff(t_s) > gap_s) + 1).tolist(), t_s.shape[0]]
    return [slice(a, b) for a, b in pairwise(ends) if b - a > 1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretches:
    """Steady sailing: arrays (n,) of means over ``length_s``, ``STRETCH_S`` at most.

    ``outing`` counts the outings from 0 and ``outing_names`` tells of which log each is.
    """

    t_s: Floats
    length_s: Floats
    outing: NDArray[np.int64]
    velocity_en_mps: Floats
    heading_rad: Floats
    awa_rad: Floats
    aws_mps: Floats
    stw_mps: Floats
    outing_names: tuple[str, ...]
    left_out: Counter[Why] = field(default_factory=Counter)

    def __len__(self) -> int:
        """Return how many there are."""
        return int(self.t_s.shape[0])


def stretches_of(logs: list[BoatLog], prior: Polar, prior_error: float) -> Stretches:
    """Return the stretches of steady sailing of all logs.

    ``prior`` and its error (deviation of the logarithm) say what is far too fast for this boat under sail alone.
    """
    rows: list[tuple[float, ...]] = []
    names: list[str] = []
    left_out: Counter[Why] = Counter()
    for log in logs:
        last_s: float | None = None
        for piece in log.pieces():
            if last_s is None or log.t_s[piece.start] - last_s > OUTING_GAP_S:
                names.append(log.name)
            last_s = float(log.t_s[piece.stop - 1])
            turning = turning_of(log, piece)
            for window in _windows(log.t_s, piece, turning):
                found = steady(log, window, turning, prior, prior_error)
                if isinstance(found, Why):
                    left_out[found] += 1
                else:
                    rows.append((float(len(names) - 1), *found))
    table = np.array(rows, dtype=np.float64).reshape(len(rows), 9)
    by_motor = driven_rows(table, prior, prior_error)
    if bool(np.any(by_motor)):
        left_out[Why.DRIVEN] += int(np.sum(by_motor))
        table = table[~by_motor]
    return Stretches(
        outing=table[:, 0].astype(np.int64),
        t_s=table[:, 1],
        velocity_en_mps=table[:, 2:4],
        heading_rad=table[:, 4],
        awa_rad=table[:, 5],
        aws_mps=table[:, 6],
        stw_mps=table[:, 7],
        length_s=table[:, 8],
        outing_names=tuple(names),
        left_out=left_out,
    )


def driven_rows(table: Floats, prior: Polar, prior_error: float) -> NDArray[np.bool_]:
    """Return (n,) which rows of stretches, each behind the number of its outing, no wind explains."""
    velocity, heading, awa, aws = table[:, 2:4], table[:, 4], table[:, 5], table[:, 6]
    bow = np.column_stack([np.sin(heading), np.cos(heading)])
    wind = aws[:, None] * np.column_stack([np.sin(heading + awa), np.cos(heading + awa)]) - velocity
    twa, tws = wrap_pi_array(np.arctan2(wind[:, 0], wind[:, 1]) - heading), np.hypot(wind[:, 0], wind[:, 1])
    return driven(
        outing=table[:, 0].astype(np.int64),
        ahead_mps=np.sum(velocity * bow, axis=1),
        heading_rad=heading,
        twa_rad=twa,
        tws_mps=tws,
        # Nearer to the wind a guess is steep, and a vane's error or a high pointer is no motor.
        expected_mps=np.array(
            [prior.speed_mps(max(abs(a), NEAR_RAD), w) for a, w in zip(twa.tolist(), tws.tolist(), strict=True)]
        ),
        prior_error=prior_error,
    )


def _windows(t_s: Floats, piece: slice, turning: NDArray[np.bool_]) -> list[slice]:
    """Return the stretches of a piece: what is between manoeuvres in even parts, and the manoeuvres themselves."""
    edges = np.flatnonzero(np.diff(turning[piece].astype(np.int8))) + 1
    runs = [piece.start, *(piece.start + edges).tolist(), piece.stop]
    out = []
    for a, b in pairwise(runs):
        length_s = float(t_s[b - 1] - t_s[a])
        count = max(1, math.ceil(length_s / STRETCH_S))
        cuts = np.linspace(a, b, count + 1).astype(int).tolist()
        if length_s >= SHORT_S or turning[a]:
            out += [slice(i, j) for i, j in pairwise(cuts) if j - i > 3]
    return out


def turning_of(log: BoatLog, piece: slice) -> NDArray[np.bool_]:
    """Return (n,) whether the boat manoeuvres then, or has just done so."""
    out = np.zeros(log.t_s.shape[0], dtype=np.bool_)
    t = log.t_s[piece]
    heading = np.unwrap(np.nan_to_num(log.heading_rad[piece]))
    later = np.minimum(np.searchsorted(t, t + TURN_S), t.shape[0] - 1)
    for i in np.flatnonzero(np.abs(heading[later] - heading) > math.radians(TURN_DEG)).tolist():
        a, b = np.searchsorted(t, [t[i] - BEFORE_S, t[later[i]] + AFTER_S])
        out[piece.start + int(a) : piece.start + int(b)] = True
    return out


def _mean_angle(angle_rad: Floats) -> float:
    return math.atan2(float(np.nanmean(np.sin(angle_rad))), float(np.nanmean(np.cos(angle_rad))))


def _spread(angle_rad: Floats) -> float:
    away = wrap_pi_array(angle_rad - _mean_angle(angle_rad))
    return float(np.sqrt(np.nanmean(away * away)))


def steady(
    log: BoatLog, window: slice, turning: NDArray[np.bool_], prior: Polar, prior_error: float
) -> Why | tuple[float, ...]:
    """Return the means of a stretch, as ``Stretches`` has them in a row, or why nothing is learned from it."""
    if not bool(np.all(log.is_sailed[window])):
        return Why.NOT_SAILED
    if bool(np.any(log.has_motor_on[window])):
        return Why.MOTOR
    velocity, heading, wind = log.velocity_en_mps[window], log.heading_rad[window], log.wind_en_mps[window]
    known = np.isfinite(heading) & np.isfinite(wind).all(axis=1)
    if float(np.mean(known)) < LEAST_KNOWN or float(np.sum(known)) < LEAST_KNOWN * (window.stop - window.start):
        return Why.UNKNOWN
    if _has_leapt(log, window):
        return Why.RESET
    swing = _spread(heading)
    vane = log.awa_rad[window][known]
    still = np.max(np.abs(wrap_pi_array(vane - vane[0]))) < 1e-5
    if swing > math.radians(0.5) and still and window.stop - window.start >= FROZEN_S:
        return Why.FROZEN_VANE
    course = np.arctan2(velocity[:, 0], velocity[:, 1])
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    if swing < 1e-6 and _spread(course) > math.radians(5.0) and float(np.nanmean(speed)) > 0.5:
        return Why.FROZEN_COMPASS
    if bool(np.any(turning[window])):
        return Why.MANOEUVRE
    tws = np.hypot(wind[:, 0], wind[:, 1])
    mean_wind = np.nanmean(wind, axis=0)
    tws_mps = float(np.hypot(*mean_wind))
    if tws_mps < LIGHT_MPS:
        return Why.LIGHT
    direction = np.arctan2(wind[:, 0], wind[:, 1])
    if _spread(direction) > math.radians(SHIFTY_DEG) or float(np.nanstd(tws)) > GUSTY_SHARE * tws_mps:
        return Why.GUSTY
    bow = _mean_angle(heading)
    mean = np.nanmean(velocity, axis=0)
    made = float(np.hypot(*mean))
    twa = wrap_pi(math.atan2(*mean_wind) - bow)
    expected = prior.speed_mps(twa, tws_mps)
    ahead = float(mean @ [math.sin(bow), math.cos(bow)])
    beat = prior.speed_mps(math.radians(50.0), tws_mps)
    driven = abs(twa) < math.radians(HEAD_TO_WIND_DEG) and ahead > 0.5 * beat
    most = math.exp(TOO_FAST * prior_error)
    if driven or ahead > max(TOO_FAST_LEAST, most) * max(expected, beat) + 0.3:
        return Why.DRIVEN
    if made < 0.15 * expected or abs(wrap_pi(math.atan2(*mean) - bow)) > math.radians(ASIDE_DEG):
        return Why.DRIFT
    half = (window.stop - window.start) // 2
    first, second = float(np.nanmean(speed[:half])), float(np.nanmean(speed[half:]))
    if abs(first - second) > UNSTEADY_SHARE * made:
        return Why.UNSTEADY
    stw = log.stw_mps[window]
    # The mean apparent wind is that of the mean vectors: the wind's speed enters what follows by its square.
    felt = mean_wind + mean
    return (
        float(np.mean(log.t_s[window])),
        float(mean[0]),
        float(mean[1]),
        bow,
        wrap_pi(math.atan2(*felt) - bow),
        float(np.hypot(*felt)),
        float(np.nanmean(stw)) if bool(np.any(np.isfinite(stw))) else math.nan,
        float(log.t_s[window.stop - 1] - log.t_s[window.start]),
    )


def _has_leapt(log: BoatLog, window: slice) -> bool:
    place, t = log.position_en_m[window], log.t_s[window]
    step = np.maximum(np.diff(t), 0.05)
    moved = np.diff(place, axis=0) / step[:, None]
    said = 0.5 * (log.velocity_en_mps[window][1:] + log.velocity_en_mps[window][:-1])
    off = np.hypot(*(moved - said).T) * np.minimum(step, 1.0)
    return bool(np.any(off[np.isfinite(off)] > LEAP_MPS))
