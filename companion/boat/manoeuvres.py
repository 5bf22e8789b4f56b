"""Tacks and gybes in a log: what each cost, how fast the boat turned, which failed.

What a tack costs is in time made good: the integral of 1 - (made good / what both boards make good in the mean), from
where the boat leaves one board until it is settled on the other. A planner's ``tack_loss_s`` is this.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from companion.boat.log import BoatLog
from companion.geo.angles import wrap_pi, wrap_pi_array

Floats = NDArray[np.float64]

SMOOTH_S = 5  # of the wind's angle
BOARD_S, SETTLE_S = 12, 8  # a board is so long at least; how far from a turn it is taken to be settled
LEAST_BOARD_S = 6  # of a board beside a tack, to tell its pace
REGAINED, MOST_RECOVERY_S = 0.95, 60  # of the new board's speed: then the tack is over
SLOWEST_MPS, UNEQUAL = 0.05, 2.5  # made good on the boards; one against the other
APART_S = 40.0  # a failure nearer than this spoils what a tack's cost is told by
BEATS_DEG = 75.0  # a tack between boards nearer to the wind than this tells what it cost
LUFFED_DEG, LUFFED_SHARE = 28.0, 0.55  # nearer to the wind than both: she tried to tack
FAILED_S = 4.0
LATE_S = 6.0  # as long within that angle, and three times as long as a good tack, and it had failed
PRIOR_FAILS, PRIOR_TRIES = 1.0, 20.0  # one in twenty, before any was seen
PRIOR_SPREAD = 0.5  # of a loss, as the deviation of its logarithm
LOST_DEG = 20.0  # nearer to the wind, or to straight before it, there is no telling one board from the other


@dataclass(frozen=True, slots=True, kw_only=True)
class Manoeuvre:
    """One tack or gybe: when, in which wind, what it cost [s] (None: cannot be told), how fast she turned [rad/s]."""

    t_s: float
    tws_mps: float
    is_tack: bool
    failed: bool = False
    loss_s: float | None = None
    rate_radps: float | None = None
    shift_rad: float | None = None  # by how much the wind's direction seemed to turn with her, tack by tack


@dataclass(frozen=True, slots=True, kw_only=True)
class Chances:
    """Tacks or gybes of a kind: how many, what one costs (median, deviation of the logarithm), how often it fails."""

    tried: int
    failed: int
    loss_s: float | None
    loss_spread: float
    fails: float
    fails_most: float
    """Not more often than this with 90 % probability."""


def manoeuvres_of(log: BoatLog, vane_rad: float = 0.0, compass_rad: float = 0.0) -> list[Manoeuvre]:
    """Return the tacks and gybes of a log whose vane and compass err by so much to starboard."""
    found: list[Manoeuvre] = []
    for piece in log.pieces():
        if piece.stop - piece.start > 2 * BOARD_S and bool(np.any(log.is_sailed[piece])):
            found += _of_piece(log, piece, vane_rad, compass_rad)
    return found


def _of_piece(log: BoatLog, piece: slice, vane_rad: float, compass_rad: float) -> list[Manoeuvre]:
    t = np.arange(math.ceil(log.t_s[piece.start]), log.t_s[piece.stop - 1])  # whole seconds: loggers differ
    if t.shape[0] < 2 * BOARD_S:
        return []

    def at(values: Floats) -> Floats:
        known = np.isfinite(values)
        return np.interp(t, log.t_s[piece][known], values[known]) if np.any(known) else np.full(t.shape, math.nan)

    velocity = np.column_stack([at(log.velocity_en_mps[piece, i]) for i in (0, 1)])
    bow = np.unwrap(np.nan_to_num(log.heading_rad[piece])) - compass_rad
    bow = np.interp(t, log.t_s[piece], bow)
    angle = bow + _unwrapped_at(t, log.t_s[piece], log.awa_rad[piece]) - vane_rad
    felt = at(log.aws_mps[piece])
    wind = felt[:, None] * np.column_stack([np.sin(angle), np.cos(angle)]) - velocity
    if not np.all(np.isfinite(wind)):
        return []
    sailed = np.interp(t, log.t_s[piece], log.is_sailed[piece].astype(float)) > 0.5
    mean_wind = np.column_stack([_smooth(wind[:, i], 4 * SMOOTH_S) for i in (0, 1)])
    twa = wrap_pi_array(np.arctan2(mean_wind[:, 0], mean_wind[:, 1]) - bow)
    tws = np.hypot(mean_wind[:, 0], mean_wind[:, 1])
    crossings = np.flatnonzero(twa[1:] * twa[:-1] < 0.0)
    failed = _failures(t, twa, tws, sailed)
    changes = _changes(t, twa, tws, wind, mean_wind, velocity, bow, crossings, sailed)
    # What a failure beside it cost is no cost of the tack that got through.
    alone = [m if _is_alone(m, failed) else replace(m, loss_s=None) for m in changes]
    return [*alone, *failed]


def _is_alone(one: Manoeuvre, failed: list[Manoeuvre]) -> bool:
    return all(abs(m.t_s - one.t_s) > APART_S for m in failed)


def _smooth(x: Floats, seconds: int) -> Floats:
    width = min(seconds, x.shape[0])
    total = np.convolve(x, np.ones(width), mode="same")
    return np.asarray(total / np.convolve(np.ones(x.shape[0]), np.ones(width), mode="same"))


def _unwrapped_at(t: Floats, known_s: Floats, angle: Floats) -> Floats:
    ok = np.isfinite(angle)
    if not np.any(ok):
        return np.full(t.shape, math.nan)
    return np.arctan2(np.interp(t, known_s[ok], np.sin(angle[ok])), np.interp(t, known_s[ok], np.cos(angle[ok])))


def _changes(
    t: Floats,
    twa: Floats,
    tws: Floats,
    wind: Floats,
    mean_wind: Floats,
    velocity: Floats,
    bow: Floats,
    crossings: NDArray[np.int64],
    sailed: NDArray[np.bool_],
) -> list[Manoeuvre]:
    out = []
    for n, c in enumerate(crossings.tolist()):
        before = 0 if n == 0 else int(crossings[n - 1]) + 1
        after = t.shape[0] - 1 if n + 1 == len(crossings) else int(crossings[n + 1])
        if c - before < BOARD_S or after - c < BOARD_S or not np.all(sailed[c - BOARD_S : c + BOARD_S]):
            continue
        old = float(np.median(twa[max(before, c - 3 * BOARD_S) : c - SETTLE_S + 1]))
        new = float(np.median(twa[c + SETTLE_S : min(after, c + 3 * BOARD_S) + 1]))
        if abs(old) < math.radians(LOST_DEG) or abs(new) < math.radians(LOST_DEG):
            continue
        is_tack = bool(abs(twa[c]) < 0.5 * math.pi)
        turn = float(bow[min(after, c + SETTLE_S)] - bow[max(before, c - SETTLE_S)])
        if abs(turn) < math.radians(30.0):
            continue  # the wind went round, not the boat
        window = slice(max(before, c - 2 * SETTLE_S), min(after, c + 2 * SETTLE_S) + 1)
        done = np.abs(bow[window] - bow[window.start]) / abs(turn)
        quick = np.flatnonzero((done > 0.2) & (done < 0.8))
        rate = float(np.max(np.abs(np.gradient(bow[window]))))
        if quick.shape[0] > 2:
            rate = float(np.mean(np.abs(np.gradient(bow[window]))[quick]))
        both = max(abs(old), abs(new)) < math.radians(BEATS_DEG)
        deep = min(abs(old), abs(new)) > math.radians(180.0 - BEATS_DEG)
        loss = (
            _loss_s(mean_wind, velocity, c, before, after, 1.0 if is_tack else -1.0)
            if (both if is_tack else deep)
            else None
        )
        left, right = wind[max(before, c - 25) : c - SETTLE_S + 1], wind[c + SETTLE_S : min(after, c + 25) + 1]
        shift = _direction(right) - _direction(left)
        out.append(
            Manoeuvre(
                t_s=float(t[c]),
                tws_mps=float(tws[c]),
                is_tack=is_tack,
                loss_s=loss,
                rate_radps=rate,
                shift_rad=math.copysign(1.0, new) * wrap_pi(shift),
            )
        )
    return out


def _direction(wind: Floats) -> float:
    mean = wind.mean(axis=0)
    return math.atan2(mean[0], mean[1])


def _loss_s(wind: Floats, velocity: Floats, c: int, before: int, after: int, sign: float) -> float | None:
    """Return the seconds made good that are lost about ``c``; None where the boards are too short to say.

    The wind's direction is its mean over the whole of it: a vane that swings in the turn is not believed.
    """
    speed = np.hypot(velocity[:, 0], velocity[:, 1])
    start, last = c - SETTLE_S, min(after, c + MOST_RECOVERY_S)
    regained = np.flatnonzero(speed[c + 2 : last] >= REGAINED * float(np.median(speed[c + 2 : last])))
    if start - LEAST_BOARD_S < before or regained.shape[0] == 0:
        return None
    end = max(c + SETTLE_S, c + 2 + int(regained[0]) + 1)
    if end + LEAST_BOARD_S > after:
        return None
    old, new = slice(max(before + 2, start - 2 * BOARD_S), start), slice(end, min(after - 2, end + 2 * BOARD_S))
    up = wind[old.start : new.stop].mean(axis=0)
    made = sign * velocity @ (up / max(float(np.hypot(*up)), 1e-6))
    boards = float(np.mean(made[old])), float(np.mean(made[new]))
    if min(boards) < SLOWEST_MPS or max(boards) > UNEQUAL * min(boards):
        return None
    # Each board's pace up to the wind's eye and from there: what a lift in the turn gives is no gain of the tack's.
    pace = np.where(np.arange(start, end) < c, boards[0], boards[1])
    return float(np.sum(pace - made[start:end]) / (0.5 * (boards[0] + boards[1])))


def _failures(t: Floats, twa: Floats, tws: Floats, sailed: NDArray[np.bool_]) -> list[Manoeuvre]:
    """Return the tacks that failed: she lay near the wind, and fell off to her old board or got through late."""
    spells: list[tuple[int, int, bool]] = []
    near = np.abs(twa) < math.radians(LUFFED_DEG)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], near.astype(np.int8), [0]])))
    for a, b in zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True):
        if a < BOARD_S or b + SETTLE_S >= t.shape[0] or not np.all(sailed[a - BOARD_S : b]):
            continue
        old = float(np.median(twa[a - BOARD_S : a - 2]))
        if abs(old) > math.radians(35.0) and float(np.min(np.abs(twa[a:b]))) < LUFFED_SHARE * abs(old):
            spells.append((a, b - a, old * float(twa[b]) < 0.0))  # she may tack back at once: that is another one
    through = [length for _, length, crosses in spells if crosses]
    late = max(LATE_S, 3.0 * float(np.quantile(through, 0.25))) if through else math.inf
    return [
        Manoeuvre(t_s=float(t[a]), tws_mps=float(tws[a]), is_tack=True, failed=True)
        for a, length, crosses in spells
        if (length > late if crosses else length >= FAILED_S)
    ]


def chances(done: list[Manoeuvre]) -> Chances:
    """Return what manoeuvres of one kind cost, and how often they fail."""
    failed = sum(m.failed for m in done)
    losses = np.array([m.loss_s for m in done if m.loss_s is not None])
    losses = np.maximum(losses, 0.3)
    told = losses.shape[0]
    spread = PRIOR_SPREAD
    if told > 1:
        # A deviation of few is itself uncertain: five of the prior's weigh with it.
        spread = math.sqrt((5.0 * PRIOR_SPREAD**2 + told * float(np.var(np.log(losses)))) / (5.0 + told))
    a, b = PRIOR_FAILS + failed, PRIOR_TRIES - PRIOR_FAILS + len(done) - failed
    return Chances(
        tried=len(done),
        failed=failed,
        loss_s=float(np.median(losses)) if told else None,
        loss_spread=spread,
        fails=a / (a + b),
        fails_most=_beta_quantile(a, b, 0.9),
    )


def _beta_quantile(a: float, b: float, p: float) -> float:
    x = np.linspace(1e-6, 1.0 - 1e-6, 20001)
    log = (a - 1.0) * np.log(x) + (b - 1.0) * np.log(1.0 - x)
    mass = np.cumsum(np.exp(log - log.max()))
    return float(x[int(np.searchsorted(mass, p * mass[-1]))])
