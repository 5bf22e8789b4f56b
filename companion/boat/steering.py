"""How an autopilot steered, from its log: what its rate controller lacks, where the rudder works for nothing.

The rudder here is what the controller asked for, from -1 (port) to 1, before ArduRover's scale by speed: the share
``FF`` of a wanted rate of turn r [rad/s] is ``ATC_STR_RAT_FF`` r of it. All of it is told by bands of speed, because a
rudder turns a boat by the water that passes it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi_array

Floats = NDArray[np.float64]

STEP_S = 0.2  # between samples
BANDS_MPS = (0.3, 1.0, 2.0, 3.0, 5.0, 10.0)
LEAST_S = 60.0  # of a band, to say anything of it
# As ArduRover's QuikTune does it: seconds in which the rudder is this far over and the bow turns this fast.
MOVED, TURNS_RADPS, LEAST_TURNING_S, FF_SHARE = 0.1, math.radians(10.0), 5.0, 0.9
MOST_LAG_S, LEAST_LIKE = 3.0, 0.5  # of the rate behind the wanted one; their correlation
TURN_RAD, TURN_S, SETTLE_S, SETTLED_RAD = math.radians(40.0), 6.0, 15.0, math.radians(10.0)
STEADY_RAD = math.radians(20.0)  # the bow goes no farther within ``TURN_S``: she is on a course
PIECE_S, SLOWEST_HZ, FASTEST_HZ = 20.0, 0.1, 1.0
PEAK = 0.5  # of what the bow's rate swings by, within ``PEAK_WIDE`` bins: it oscillates
PEAK_WIDE = 2
REVERSAL, MIDDLE_S = 0.04, 5.0  # the rudder is so far on either side of its mean over so long
FULL = 0.97
HEEL_DEG = 5.0  # the boat leans to one side


@dataclass(frozen=True, slots=True, kw_only=True)
class SteeringLog:
    """Arrays (n,), ``STEP_S`` apart within one log; NaN where nothing is known.

    Attributes:
        t_s: Unix time or any other [s].
        heading_rad, rate_radps: Of the bow, to starboard.
        wanted_rate_radps: What the controller was to turn at.
        wanted_heading_rad: What it was to hold.
        rudder: -1 to 1, as it is above.
        ahead_mps: Over the ground along the bow.
        heel_rad: To starboard.
        is_steered: (n,) the autopilot steers.
        tacks_s: When it began to tack.
        time_outs: How many of these it gave up.
        parameters: As the log tells them.
    """

    name: str
    t_s: Floats
    heading_rad: Floats
    rate_radps: Floats
    wanted_rate_radps: Floats
    wanted_heading_rad: Floats
    rudder: Floats
    ahead_mps: Floats
    heel_rad: Floats
    is_steered: NDArray[np.bool_]
    tacks_s: tuple[float, ...]
    time_outs: int
    parameters: Mapping[str, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class SteeringBand:
    """Between two speeds; None: it cannot be told.

    Attributes:
        low_mps, high_mps: The band.
        time_s: Steered in it.
        ff: Rudder for a rate of turn [1 / (rad/s)], and by how many seconds of turning it is known.
        turning_s: As said.
        lag_s: Of the rate behind the wanted one.
        reversals_per_min: Of the rudder, on a course.
        swing_hz: Where bow and rudder swing together; None: nowhere.
        swing_rad: By how much the bow then does, as an amplitude.
        saturated: Share of the time that the rudder is hard over.
        steady_error_rad: To leeward of the wanted heading, heeled; the mean of both sides.
    """

    low_mps: float
    high_mps: float
    time_s: float
    ff: float | None
    turning_s: float
    lag_s: float | None
    reversals_per_min: float | None
    swing_hz: float | None
    swing_rad: float
    saturated: float
    steady_error_rad: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class Steering:
    """All that logs of one boat tell of its steering.

    Attributes:
        bands: From slow to fast.
        overshoot_rad: Past the new course after turns of ``TURN_RAD`` and more, the median; None: no turn was seen.
        tack_s: From where a tack began until the bow was within ``SETTLED_RAD`` of its new course, the median.
        tacks: How many were begun.
        time_outs: How many of them were given up.
        astern: Share of the time steered that it went astern: ArduRover then turns the rudder round.
        heeled: Share of the time that it heeled more than ``SAIL_HEEL_MAX``; None: it is not known.
        parameters: As the last log tells them.
    """

    bands: tuple[SteeringBand, ...]
    overshoot_rad: float | None
    tack_s: float | None
    tacks: int
    time_outs: int
    astern: float
    heeled: float | None
    parameters: Mapping[str, float]


def steering_of(logs: Sequence[SteeringLog]) -> Steering:
    """Return what logs of one boat tell of its steering."""
    bands = tuple(
        band
        for low, high in pairwise(BANDS_MPS)
        if (band := _band([(g, _within(g, low, high)) for g in logs], low, high))
    )
    turns = [t for g in logs for t in _turns(g)]
    tacks = [t for g in logs for at in g.tacks_s if (t := _tack_s(g, at)) is not None]
    steered = sum(int(np.sum(g.is_steered)) for g in logs)
    parameters: dict[str, float] = {}
    for g in logs:
        parameters.update(g.parameters)
    most_deg = parameters.get("SAIL_HEEL_MAX")
    heel = np.concatenate([np.zeros(0), *(g.heel_rad[g.is_steered] for g in logs)])
    heel = heel[np.isfinite(heel)]
    return Steering(
        bands=bands,
        overshoot_rad=float(np.median(turns)) if turns else None,
        tack_s=float(np.median(tacks)) if tacks else None,
        tacks=sum(len(g.tacks_s) for g in logs),
        time_outs=sum(g.time_outs for g in logs),
        astern=sum(int(np.sum(g.is_steered & (g.ahead_mps < 0.0))) for g in logs) / max(steered, 1),
        heeled=None
        if most_deg is None or heel.shape[0] == 0
        else float(np.mean(np.abs(heel) > math.radians(most_deg))),
        parameters=parameters,
    )


def _within(log: SteeringLog, low: float, high: float) -> NDArray[np.bool_]:
    return log.is_steered & (log.ahead_mps >= low) & (log.ahead_mps < high) & np.isfinite(log.rudder)


def _band(parts: list[tuple[SteeringLog, NDArray[np.bool_]]], low: float, high: float) -> SteeringBand | None:
    time_s = STEP_S * sum(int(np.sum(on)) for _, on in parts)
    if time_s < LEAST_S:
        return None

    def joined(values: list[Floats]) -> Floats:
        return np.concatenate([np.zeros(0), *values])

    rudder = joined([g.rudder[on] for g, on in parts])
    rate = joined([g.rate_radps[on] for g, on in parts])
    turning = (np.abs(rudder) > MOVED) & (np.abs(rate) > TURNS_RADPS) & (rudder * rate > 0.0)
    turning_s = STEP_S * int(np.sum(turning))
    ff = None
    if turning_s >= LEAST_TURNING_S:
        ff = FF_SHARE * float(np.sum(np.abs(rudder[turning])) / np.sum(np.abs(rate[turning])))
    steady = [(g, on & _steady(g)) for g, on in parts]
    # One that swings so far that she is on no course is known by all of it.
    swing = _swing(steady if any(bool(np.any(still)) for _, still in steady) else parts)
    return SteeringBand(
        low_mps=low,
        high_mps=high,
        time_s=time_s,
        ff=ff,
        turning_s=turning_s,
        lag_s=_lag_s(parts),
        reversals_per_min=_reversals(steady),
        swing_hz=None if swing is None else swing[0],
        swing_rad=0.0 if swing is None else swing[1],
        saturated=float(np.mean(np.abs(rudder) > FULL)),
        steady_error_rad=_steady_error(steady),
    )


def runs_of(on: NDArray[np.bool_], least: int) -> list[slice]:
    """Return where ``on`` (n,) holds for ``least`` samples and more on end."""
    edges = np.flatnonzero(np.diff(np.concatenate([[0], on.astype(np.int8), [0]])))
    return [slice(a, b) for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True) if b - a >= least]


def _steady(log: SteeringLog) -> NDArray[np.bool_]:
    """Return (n,) whether she is on a course: no turn within ``TURN_S`` before or after."""
    width = round(TURN_S / STEP_S)
    turned = np.zeros(log.t_s.shape[0], dtype=np.bool_)
    if turned.shape[0] > width:
        bow = np.unwrap(np.nan_to_num(log.heading_rad))
        far = np.abs(bow[width:] - bow[:-width]) > STEADY_RAD
        for i in np.flatnonzero(far).tolist():
            turned[i : i + 2 * width] = True
    return ~turned


def _lag_s(parts: list[tuple[SteeringLog, NDArray[np.bool_]]]) -> float | None:
    """Return by how much the rate follows the wanted one, by the likest shift of one against the other."""
    most = round(MOST_LAG_S / STEP_S)
    total = np.zeros(most + 1)
    of_wanted = of_rate = 0.0
    for log, on in parts:
        for run in runs_of(on & np.isfinite(log.wanted_rate_radps) & np.isfinite(log.rate_radps), 4 * most):
            wanted, rate = log.wanted_rate_radps[run], log.rate_radps[run]
            wanted, rate = wanted - wanted.mean(), rate - rate.mean()
            end = wanted.shape[0] - most
            total += [float(wanted[:end] @ rate[k : k + end]) for k in range(most + 1)]
            of_wanted, of_rate = of_wanted + float(wanted @ wanted), of_rate + float(rate @ rate)
    best = int(np.argmax(total))
    if of_wanted <= 0.0 or total[best] < LEAST_LIKE * math.sqrt(of_wanted * of_rate):
        return None
    return STEP_S * best


def _reversals(parts: list[tuple[SteeringLog, NDArray[np.bool_]]]) -> float | None:
    count, time_s = 0, 0.0
    for log, on in parts:
        for run in runs_of(on, round(PIECE_S / STEP_S)):
            width = np.ones(round(MIDDLE_S / STEP_S))
            about = np.convolve(log.rudder[run], width, "same") / np.convolve(
                np.ones(run.stop - run.start), width, "same"
            )
            rudder = log.rudder[run] - about
            side = np.sign(rudder[np.abs(rudder) > REVERSAL])
            count += int(np.sum(np.diff(side) != 0.0))
            time_s += STEP_S * (run.stop - run.start)
    return 60.0 * count / time_s if time_s >= LEAST_S else None


def _swing(parts: list[tuple[SteeringLog, NDArray[np.bool_]]]) -> tuple[float, float] | None:
    """Return the frequency [Hz] at which bow and rudder swing together on a course, and the bow's amplitude [rad]."""
    n = round(PIECE_S / STEP_S)
    window = np.hanning(n)
    hz = np.fft.rfftfreq(n, STEP_S)
    spectra = np.zeros((2, hz.shape[0]))
    pieces = 0
    for log, on in parts:
        for run in runs_of(on & np.isfinite(log.rate_radps), n):
            for start in range(run.start, run.stop - n + 1, n // 2):
                piece = slice(start, start + n)
                for i, values in enumerate((log.rate_radps[piece], log.rudder[piece])):
                    spectra[i] += np.abs(np.fft.rfft(window * (values - values.mean()))) ** 2
                pieces += 1
    seen = (hz >= SLOWEST_HZ) & (hz <= FASTEST_HZ)
    if pieces == 0 or float(spectra[0][1:].sum()) <= 0.0:
        return None
    peak = int(np.argmax(np.where(seen, spectra[0], 0.0)))
    near = slice(max(1, peak - PEAK_WIDE), peak + PEAK_WIDE + 1)
    shares = [float(s[near].sum() / max(s[1:].sum(), 1e-12)) for s in spectra]
    slower, faster = spectra[0][peak - 1], spectra[0][min(peak + 1, hz.shape[0] - 1)]
    if min(shares) < PEAK or spectra[0][peak] < max(slower, faster):
        return None  # the slope of what is slower: turns, and the helm's way
    # a window of Hann keeps 3/8 of the power: amplitude^2 / 2 = the rate's variance within the peak
    variance = 2.0 * float(spectra[0][near].sum()) / (pieces * n * n * 0.375)
    return float(hz[peak]), math.sqrt(2.0 * variance) / (2.0 * math.pi * float(hz[peak]))


def _steady_error(parts: list[tuple[SteeringLog, NDArray[np.bool_]]]) -> float | None:
    """Return how far she lies to leeward of the wanted heading [rad], from both sides that she heels to."""
    means = []
    for side in (1.0, -1.0):
        found = []
        for log, on in parts:
            leans = on & (side * log.heel_rad > math.radians(HEEL_DEG)) & np.isfinite(log.wanted_heading_rad)
            off = wrap_pi_array(log.heading_rad[leans] - log.wanted_heading_rad[leans])
            found.append(side * off[np.abs(off) < STEADY_RAD])
        off = np.concatenate(found)
        if STEP_S * off.shape[0] < 0.5 * LEAST_S:
            return None
        means.append(float(np.mean(off)))
    return 0.5 * (means[0] + means[1])


def _turns(log: SteeringLog) -> list[float]:
    """Return how far the bow went past its new course, of each turn."""
    width, settle = round(TURN_S / STEP_S), round(SETTLE_S / STEP_S)
    out: list[float] = []
    bow = np.unwrap(np.nan_to_num(log.heading_rad))
    i = width
    while i + settle < bow.shape[0]:
        turn = float(bow[i] - bow[i - width])
        if abs(turn) < TURN_RAD or not bool(np.all(log.is_steered[i - width : i + settle])):
            i += 1
            continue
        new = bow[i + settle // 2 : i + settle]
        if float(np.ptp(new)) < 2.0 * TURN_RAD:
            past = math.copysign(1.0, turn) * (bow[i - width : i + settle] - float(np.median(new)))
            out.append(max(0.0, float(past.max())))
        i += settle
    return out


def _tack_s(log: SteeringLog, began_s: float) -> float | None:
    """Return how long a tack took; None: she was not on a course after it."""
    a, b = np.searchsorted(log.t_s, [began_s, began_s + 2.0 * SETTLE_S])
    bow = np.unwrap(np.nan_to_num(log.heading_rad[a:b]))
    half = bow.shape[0] // 2
    if half < round(0.5 * SETTLE_S / STEP_S) or float(np.ptp(bow[half:])) > 2.0 * STEADY_RAD:
        return None
    away = np.flatnonzero(np.abs(bow - float(np.median(bow[half:]))) > SETTLED_RAD)
    if away.shape[0] == 0 or int(away[-1]) >= half:
        return None
    return STEP_S * float(away[-1] + 1)
