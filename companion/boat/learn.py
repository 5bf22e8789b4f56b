"""What logs tell of a boat: its polar about a prior, leeway, errors of vane and compass, and the stream, all at once.

Every stretch of steady sailing (``companion.boat.log``) gives the velocity through the water, which is that over the
ground less the stream, in the apparent wind:

    log |u| = log prior(twa, tws) + f(twa, log tws) + day(outing) + noise,        f a Gaussian field of few components
    course of u - heading = compass - sign(twa) leeway + noise

The stream is one vector for ``BLOCK_S``, wandering about its outing's mean; the vane's offset turns the apparent wind
from which ``twa`` and ``tws`` are made. It is a robust Gauss-Newton solution with Student's weights, and its inverse
normal matrix is the doubt of all of them together: what they cannot be told apart by, they share. ``findings`` says
that in words, with the manoeuvre that would settle it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.boat.boat import coefficient_of, leeway_at
from companion.boat.log import SHORT_S, STRETCH_S, Stretches
from companion.boat.polar import Polar
from companion.geo.angles import wrap_pi_array
from companion.words import counted

Floats = NDArray[np.float64]

# The field: nodes, and what is believed of it before any log. The common error is the prior's own (a guess: 35 %).
TWA_DEG = np.array([30.0, 40.0, 50.0, 60.0, 75.0, 90.0, 110.0, 130.0, 150.0, 165.0, 180.0])
TWS_MPS = np.array([1.5, 2.25, 3.4, 5.0, 7.5, 11.0, 16.0])
SHAPE_ANGLE, SHAPE_WIND, SHAPE_BOTH = 0.10, 0.10, 0.04  # twice what rated yachts of one size differ by
REACH_DEG, REACH_WIND = 35.0, 0.8  # over which it changes: angle, logarithm of the wind
KEPT = 0.995  # of the field's variance, by its leading components
# Before any log; radians, m/s, shares.
VANE_SD, COMPASS_SD = math.radians(6.0), math.radians(4.0)
LEEWAY, LEEWAY_SD = math.radians(5.0), math.radians(4.0)
CURRENT_SD, WANDER_SD = 0.4, 0.08
# Faster on one tack than on the other, most on a beat and not at all before the wind: rig, keel, and sheets that are
# trimmed by the vane. Four degrees of its offset are 15 % of the simulator's drive, and hide half of what shows it.
LEAN_SD = 0.06
DAY_SD = 0.05  # of one outing: sea, growth, the wind's gradient
DAY_WEIGHT = 4.0  # as so many outings that were seen
LOG_SD = 0.10  # of a log's factor, an outing's
BLOCK_S = 1200.0
# Noise of one stretch; speeds below ``SLOW_MPS`` are worth less. The shares are then scaled to what is seen.
SPEED_NOISE, COURSE_NOISE, SLOW_MPS = 0.06, math.radians(2.5), 0.06
FREEDOM = 4.0  # of Student's distribution
# How far the wind at the vane may be off that which drives the boat, of one stretch [m/s]: the logs say it, where it
# explains their scatter by so much (logarithm of the likelihood); a keelboat's speeds scatter by half of themselves in
# light winds. On a day that was not sailed it is ``WIND_LEFT`` of what the residuals show, for streams and days take a
# share of it up, and a whole day's is so much of that: gradient, patches. Both by one keelboat's days of 2007 to 2013.
WIND_STEPS_MPS, WIND_GAIN, WIND_LEFT, WIND_OF_DAY = np.arange(0.0, 1.01, 0.05), 6.0, 2.0, 0.9
STEEPEST = 1.5  # of the speed with the wind, both as logarithms
ROUNDS, CLOSE = 24, 1e-4
EASED = (8.0, 8.0, 4.0, 4.0, 2.0, 2.0)  # times the noise, in the first rounds
LEAST_OF_OUTING, LEAST_ALIKE = 5, 0.67  # stretches; of the fastest outing's speed: less is no boat's day
LEAST_AHEAD = 0.3  # of the speed: more leeway than that is no leeway
STEP = 1e-4  # of numerical derivatives: radians, m/s
OWN = 4  # unknowns of the boat beside the field
LEAST_STRETCHES = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Known:
    """A figure with the deviation of what is not known of it."""

    mean: float
    sd: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedBoat:
    """What is learned of speed and course, radians and m/s.

    Attributes:
        polar: Mean speed through the water on ``TWA_DEG`` and ``TWS_MPS`` (and zero head to wind).
        error: (angles, winds) deviation of the logarithm of the speed, one day's included.
        common: What all speeds may be off by together, likewise.
        vane, compass, leeway: Offsets to starboard; leeway as ``Boat.leeway_rad`` states it.
        lean: How much faster it is close-hauled with the wind from starboard than in the mean of both (logarithm).
        currents: For each outing, the stream east and north in the mean of the time that was sailed.
        log_factors: For each outing, what its log's reading is to be divided by; only where there is a log.
        draws: (k, angles, winds) speeds that are as likely as the mean.
        seen: (angles, winds) how many stretches lie nearest to each node.
        noise: Deviation of one stretch's speed (share) and of its course [rad].
        wind_mps: How far one stretch's wind on another day, as the vane tells it, is off that which drives her.
    """

    polar: Polar
    error: Floats
    common: float
    vane: Known
    compass: Known
    leeway: Known
    lean: Known
    currents: tuple[tuple[Known, Known], ...]
    log_factors: tuple[Known, ...]
    draws: Floats
    seen: NDArray[np.int64]
    noise: tuple[float, float]
    wind_mps: float
    stretches: int
    twa_rad: Floats
    findings: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class _Field:
    """The Gaussian field's components on the nodes, (nodes, k): each of unit prior."""

    basis: Floats
    k: int

    def at(self, twa_rad: Floats, tws_mps: Floats) -> Floats:
        """Return the components (n, k) at these winds, linear between the nodes, constant beyond."""
        a, fa = _between(np.degrees(np.abs(twa_rad)), TWA_DEG)
        w, fw = _between(np.log(np.maximum(tws_mps, 1e-3)), np.log(TWS_MPS))
        m = TWS_MPS.shape[0]
        out = np.zeros((twa_rad.shape[0], self.basis.shape[1]))
        for da, ga in ((0, 1.0 - fa), (1, fa)):
            for dw, gw in ((0, 1.0 - fw), (1, fw)):
                out += (ga * gw)[:, None] * self.basis[(a + da) * m + w + dw]
        return out


def _between(x: Floats, nodes: Floats) -> tuple[NDArray[np.int64], Floats]:
    i = np.clip(np.searchsorted(nodes, x, side="right") - 1, 0, nodes.shape[0] - 2)
    return i, np.clip((x - nodes[i]) / (nodes[i + 1] - nodes[i]), 0.0, 1.0)


def _field(common: float) -> _Field:
    angles, winds = (g.ravel() for g in np.meshgrid(TWA_DEG, np.log(TWS_MPS), indexing="ij"))
    by_angle = np.exp(-0.5 * ((angles[:, None] - angles) / REACH_DEG) ** 2)
    by_wind = np.exp(-0.5 * ((winds[:, None] - winds) / REACH_WIND) ** 2)
    covariance = common**2 + SHAPE_ANGLE**2 * by_angle + SHAPE_WIND**2 * by_wind + SHAPE_BOTH**2 * by_angle * by_wind
    values, vectors = np.linalg.eigh(covariance)
    values, vectors = values[::-1], vectors[:, ::-1]
    # The shape's variance is what must be kept: a large common error would hide it.
    shape = values.sum() - common**2 * angles.shape[0]
    k = int(np.searchsorted(np.cumsum(values), values.sum() - (1.0 - KEPT) * shape)) + 1
    return _Field(basis=vectors[:, :k] * np.sqrt(values[:k]), k=k)


@dataclass(slots=True)
class _State:
    """The unknowns: components, vane, compass, leeway; outings' days, log factors; streams by outing and block."""

    shape: Floats
    nuisance: Floats  # vane, compass, leeway, lean
    day: Floats
    factor: Floats
    mean: Floats  # (outings, 2)
    stream: Floats  # (blocks, 2)


def learn(stretches: Stretches, prior: Polar, prior_error: float, *, seed: int = 0, draws: int = 200) -> LearnedBoat:
    """Return what the stretches tell of a boat that was believed to sail as ``prior``.

    Args:
        stretches: at least ``LEAST_STRETCHES``.
        prior: speed through the water.
        prior_error: how far all of it may be off together, as the deviation of the logarithm.
        seed: of the draws.
        draws: how many are kept.

    Raises:
        ValueError: there are too few stretches.
    """
    if len(stretches) < LEAST_STRETCHES:
        raise ValueError(
            f"{counted(len(stretches), 'stretch', 'stretches')} of steady sailing; {LEAST_STRETCHES} are the least"
        )
    shape = _field(max(prior_error, 0.03))
    blocks, block = np.unique(
        np.column_stack([stretches.outing, np.floor(stretches.t_s / BLOCK_S)]).astype(np.int64),
        axis=0,
        return_inverse=True,
    )
    solver = _Solver(stretches, prior, shape, blocks[:, 0], np.asarray(block).reshape(-1))
    state, covariance, noise = solver.solve()
    return _told(solver, state, covariance, noise, prior, np.random.default_rng(seed), draws)


class _Solver:
    """Gauss-Newton over all stretches; ``order`` of the unknowns is that of ``_State``'s fields."""

    def __init__(
        self, s: Stretches, prior: Polar, shape: _Field, block_outing: NDArray[np.int64], block: NDArray[np.int64]
    ) -> None:
        self.s, self.shape = s, shape
        self.block, self.block_outing = block, block_outing
        self.outings, self.blocks = len(s.outing_names), block_outing.shape[0]
        self.has_log = bool(np.any(np.isfinite(s.stw_mps)))
        k = shape.k
        self.at_nuisance = k
        self.at_day = k + OWN
        self.at_factor = self.at_day + self.outings
        self.at_mean = self.at_factor + self.outings
        self.at_stream = self.at_mean + 2 * self.outings
        self.size = self.at_stream + 2 * self.blocks
        self.wind_mps, self.log_noise = 0.0, SPEED_NOISE
        self.day_sd = np.full(self.outings, DAY_SD)
        self._table = np.log(
            np.maximum(
                np.array([[prior.speed_mps(math.radians(a), float(w)) for w in _FINE_TWS] for a in _FINE_TWA]), 0.02
            )
        )

    def log_prior(self, twa_rad: Floats, tws_mps: Floats) -> Floats:
        """Return the logarithm of the prior's speed, from a fine table."""
        a, fa = _between(np.degrees(np.abs(twa_rad)), _FINE_TWA)
        w, fw = _between(tws_mps, _FINE_TWS)
        t = self._table
        low = (1.0 - fa) * t[a, w] + fa * t[a + 1, w]
        high = (1.0 - fa) * t[a, w + 1] + fa * t[a + 1, w + 1]
        return np.asarray((1.0 - fw) * low + fw * high)

    def steepness(self, twa_rad: Floats, tws_mps: Floats) -> Floats:
        """Return by what share the prior's speed changes with a m/s of wind."""
        change = self.log_prior(twa_rad, 1.1 * tws_mps) - self.log_prior(twa_rad, tws_mps / 1.1)
        return np.asarray(np.clip(change / math.log(1.21), 0.0, STEEPEST) / np.maximum(tws_mps, TWS_MPS[0]))

    def start(self) -> _State:
        """Return what is believed before any log."""
        return _State(
            shape=np.zeros(self.shape.k),
            nuisance=np.array([0.0, 0.0, LEEWAY, 0.0]),
            day=np.zeros(self.outings),
            factor=np.zeros(self.outings),
            mean=np.zeros((self.outings, 2)),
            stream=np.zeros((self.blocks, 2)),
        )

    def wind(self, nuisance: Floats, stream: Floats) -> tuple[Floats, Floats, Floats]:
        """Return the velocity through the water (n, 2), and the true wind over it: angle to the true bow, speed."""
        u = self.s.velocity_en_mps - stream
        vane, compass = nuisance[:2]
        bow = self.s.heading_rad - compass
        angle = bow + self.s.awa_rad - vane
        wind = self.s.aws_mps[:, None] * np.column_stack([np.sin(angle), np.cos(angle)]) - u
        return u, wrap_pi_array(np.arctan2(wind[:, 0], wind[:, 1]) - bow), np.hypot(wind[:, 0], wind[:, 1])

    def residuals(self, x: _State, nuisance: Floats, stream: Floats) -> Floats:
        """Return (n, 3) observed less expected: logarithm of the speed, course, logarithm of the log's reading."""
        u, twa, tws = self.wind(nuisance, stream)
        speed = np.maximum(np.hypot(u[:, 0], u[:, 1]), 1e-3)
        day = x.day[self.s.outing]
        log_speed = (
            self.log_prior(twa, tws)
            + self.shape.at(twa, tws) @ x.shape
            + day
            + nuisance[3] * 0.5 * np.sign(twa) * (1.0 + np.cos(twa))
        )
        compass, leeway = nuisance[1], nuisance[2]
        course = wrap_pi_array(np.arctan2(u[:, 0], u[:, 1]) - self.s.heading_rad + compass)
        # Leeway by the speed ahead that is seen: by what is expected of it the solution would chase its own tail.
        ahead = speed * np.maximum(np.cos(course), LEAST_AHEAD)
        lee = leeway_at(coefficient_of(max(leeway, 0.0)), twa, tws, ahead)
        off = course + np.sign(twa) * (lee + min(leeway, 0.0))
        log = np.log(np.maximum(self.s.stw_mps, 1e-3)) - x.factor[self.s.outing] - log_speed
        # The polar's speed is along the bow; a boat that slips goes a little faster than that over the water.
        return np.column_stack([np.log(speed) + np.log(np.maximum(np.cos(lee), LEAST_AHEAD)) - log_speed, off, log])

    def solve(self) -> tuple[_State, Floats, tuple[float, float]]:
        """Return the unknowns, their covariance and the noise of a stretch."""
        x, noise = self.start(), (SPEED_NOISE, COURSE_NOISE)
        for turn in range(ROUNDS):
            # Loose at first: a boat far from its guess, in a stream, has a second solution nearby, of a false stream.
            eased = noise if turn >= len(EASED) else (EASED[turn] * SPEED_NOISE, EASED[turn] * COURSE_NOISE)
            normal, right, noise = self._normal(x, eased)
            step = np.asarray(np.linalg.solve(normal, right), dtype=np.float64)
            x = self._moved(x, step)
            if turn >= len(EASED) and float(np.max(np.abs(step))) < CLOSE:
                break
        normal, _, noise = self._normal(x, noise)
        return x, np.asarray(np.linalg.inv(normal), dtype=np.float64), noise

    def _moved(self, x: _State, step: Floats) -> _State:
        limited = step.copy()
        a = self.at_nuisance
        limited[a : a + OWN] = np.clip(step[a : a + OWN], -0.1, 0.1)
        limited[self.at_mean :] = np.clip(step[self.at_mean :], -0.5, 0.5)
        return _State(
            shape=x.shape + limited[:a],
            nuisance=x.nuisance + limited[a : a + OWN],
            day=x.day + limited[self.at_day : self.at_factor],
            factor=x.factor + limited[self.at_factor : self.at_mean],
            mean=x.mean + limited[self.at_mean : self.at_stream].reshape(-1, 2),
            stream=x.stream + limited[self.at_stream :].reshape(-1, 2),
        )

    def _normal(self, x: _State, noise: tuple[float, float]) -> tuple[Floats, Floats, tuple[float, float]]:
        """Return the normal matrix, its right hand side, and the noise that the residuals show."""
        s, k, n = self.s, self.shape.k, len(self.s)
        stream = x.stream[self.block]
        r = self.residuals(x, x.nuisance, stream)
        u, twa, tws = self.wind(x.nuisance, stream)
        speed = np.maximum(np.hypot(u[:, 0], u[:, 1]), 1e-3)
        # A shorter stretch averages less of what wanders.
        short = np.sqrt(STRETCH_S / np.clip(s.length_s, SHORT_S, STRETCH_S))
        slow, steep = SLOW_MPS / speed, self.steepness(twa, tws)
        by_wind = np.hypot(slow, steep * self.wind_mps)
        sigma = np.column_stack(
            [np.hypot(noise[0], by_wind), np.hypot(noise[1], slow), np.hypot(self.log_noise, steep * self.wind_mps)]
        )
        sigma *= short[:, None]
        z = np.where(np.isfinite(r), r, 0.0) / sigma
        weight = np.where(np.isfinite(r), (FREEDOM + 1.0) / (FREEDOM + z * z), 0.0) / sigma**2
        # Columns of a stretch: components, vane, compass, leeway, lean, day and factor, stream.
        columns = np.zeros((n, 3, k + OWN + 4))
        columns[:, 0, :k] = columns[:, 2, :k] = self.shape.at(twa, tws)
        for i in range(OWN):
            moved = x.nuisance.copy()
            moved[i] += STEP
            columns[:, :, k + i] = -(self.residuals(x, moved, stream) - r) / STEP
        columns[:, 0, k + OWN] = columns[:, 2, k + OWN] = 1.0
        columns[:, 2, k + OWN + 1] = 1.0
        for i in (0, 1):
            moved = stream.copy()
            moved[:, i] += STEP
            columns[:, :, k + OWN + 2 + i] = -(self.residuals(x, x.nuisance, moved) - r) / STEP
        columns = np.where(np.isfinite(columns), columns, 0.0)
        r = np.where(np.isfinite(r), r, 0.0)
        normal, right = self._prior_terms(x)
        for b in range(self.blocks):
            rows = np.flatnonzero(self.block == b)
            o = int(self.block_outing[b])
            j = columns[rows].reshape(-1, k + OWN + 4)
            w = weight[rows].reshape(-1)
            index = np.concatenate(
                [
                    np.arange(k + OWN),
                    [self.at_day + o, self.at_factor + o, self.at_stream + 2 * b, self.at_stream + 2 * b + 1],
                ]
            )
            normal[np.ix_(index, index)] += j.T @ (w[:, None] * j)
            right[index] += j.T @ (w * r[rows].reshape(-1))
        self._learn_wind(r[:, 0], slow, steep, short)
        logged = np.isfinite(s.stw_mps)
        if bool(np.any(logged)):  # one that fouls in the middle of an outing is no measure of her speed
            self.log_noise = max(_scatter(r[logged, 2], slow[logged], SPEED_NOISE, self.log_noise), noise[0], 0.03)
        # What is left by a wind that is not the vane's is no noise of its own.
        share = noise[0] / np.hypot(noise[0], steep * self.wind_mps)
        seen = (_scatter(r[:, 0] * share, slow, SPEED_NOISE, noise[0]), _scatter(r[:, 1], slow, COURSE_NOISE, noise[1]))
        return normal, right, seen

    def _learn_wind(self, r: Floats, slow: Floats, steep: Floats, short: Floats) -> None:
        """Learn how far a stretch's wind is off from how the residuals scatter, more or less in light winds."""
        own = SPEED_NOISE * np.geomspace(0.4, 5.0, 10)[:, None]  # whatever is left as its own: the best for each wind
        likelihood = np.empty(WIND_STEPS_MPS.shape)
        for n, wind_mps in enumerate(WIND_STEPS_MPS.tolist()):
            sigma = np.hypot(np.hypot(own, slow), steep * wind_mps) * short
            told = -0.5 * (FREEDOM + 1.0) * np.log1p((r / sigma) ** 2 / FREEDOM) - np.log(sigma)
            likelihood[n] = float(told.sum(axis=1).max())
        best = int(np.argmax(likelihood))
        found = float(WIND_STEPS_MPS[best]) if likelihood[best] > likelihood[0] + WIND_GAIN else 0.0
        self.wind_mps = 0.5 * (self.wind_mps + found)
        for o in range(self.outings):
            of = self.s.outing == o
            mean = float(np.mean(steep[of])) if bool(np.any(of)) else 0.0
            self.day_sd[o] = math.hypot(DAY_SD, WIND_OF_DAY * mean * self.wind_mps)

    def _prior_terms(self, x: _State) -> tuple[Floats, Floats]:
        sd = np.empty(self.at_mean)
        sd[: self.at_nuisance] = 1.0
        sd[self.at_nuisance : self.at_day] = VANE_SD, COMPASS_SD, LEEWAY_SD, LEAN_SD
        sd[self.at_day : self.at_factor] = self.day_sd
        sd[self.at_factor :] = LOG_SD
        off = np.concatenate([x.shape, x.nuisance - self.start().nuisance, x.day, x.factor])
        normal, right = np.zeros((self.size, self.size)), np.zeros(self.size)
        i = np.arange(self.at_mean)
        normal[i, i] += 1.0 / sd**2
        right[i] -= off / sd**2
        for axis in (0, 1):
            mean = self.at_mean + 2 * np.arange(self.outings) + axis
            normal[mean, mean] += 1.0 / CURRENT_SD**2
            right[mean] -= x.mean[:, axis] / CURRENT_SD**2
            own, of = self.at_stream + 2 * np.arange(self.blocks) + axis, mean[self.block_outing]
            gap = (x.stream[:, axis] - x.mean[self.block_outing, axis]) / WANDER_SD**2
            normal[own, own] += 1.0 / WANDER_SD**2
            np.add.at(normal, (of, of), 1.0 / WANDER_SD**2)
            normal[own, of] -= 1.0 / WANDER_SD**2
            normal[of, own] -= 1.0 / WANDER_SD**2
            right[own] -= gap
            np.add.at(right, of, gap)
        return normal, right


_FINE_TWA, _FINE_TWS = np.arange(0.0, 181.0, 2.0), np.arange(0.25, 30.1, 0.25)


def _scatter(r: Floats, slow: Floats, least: float, now: float) -> float:
    """Return the deviation of the residuals, by their median, eased towards what was believed; never far below it."""
    seen = 1.4826 * float(np.median(np.abs(r)) if r.shape[0] else now)
    seen = math.sqrt(max(seen**2 - float(np.median(slow)) ** 2, 0.0))
    return float(np.clip(0.5 * (seen + now), 0.4 * least, 5.0 * least))


def _of_two_boats(solver: _Solver, x: _State) -> tuple[str, ...]:
    """Return a question where two outings differ by more than a boat's days do, on one course in one wind."""
    off = x.day[solver.s.outing] + solver.residuals(x, x.nuisance, x.stream[solver.block])[:, 0]
    found = {
        name: float(np.median(off[on]))
        for number, name in enumerate(solver.s.outing_names)
        if int(np.sum(on := solver.s.outing == number)) >= LEAST_OF_OUTING
    }
    if len(found) < 2:
        return ()
    slow, fast = min(found, key=found.__getitem__), max(found, key=found.__getitem__)
    share = math.exp(found[slow] - found[fast])
    if share > LEAST_ALIKE:
        return ()
    return (
        (
            f"in {slow} she made {100.0 * share:.0f} % of her speed in {fast}, as courses and winds compare: is it one "
            "boat? If not, all that was learned is of neither: learn from the logs of one"
        ),
    )


def _told(
    solver: _Solver,
    x: _State,
    covariance: Floats,
    noise: tuple[float, float],
    prior: Polar,
    rng: np.random.Generator,
    draws: int,
) -> LearnedBoat:
    k, a = solver.shape.k, solver.at_nuisance
    basis = solver.shape.basis
    angles, winds = TWA_DEG.shape[0], TWS_MPS.shape[0]
    base = np.array([[prior.speed_mps(math.radians(t), float(w)) for w in TWS_MPS] for t in TWA_DEG])
    part = covariance[:k, :k]
    factor = basis @ x.shape
    spread = np.sqrt(np.einsum("ij,jk,ik->i", basis, part, basis))
    # What days differ by: what is believed of it, and what the outings show. A day that is not sailed yet is another.
    days = slice(solver.at_day, solver.at_factor)
    # An outing in light wind tells little of it: there the wind is as much to blame.
    seen_days = float(np.sum((x.day**2 + np.diag(covariance)[days]) * (DAY_SD / solver.day_sd) ** 2))
    day = math.sqrt((DAY_WEIGHT * DAY_SD**2 + seen_days) / (DAY_WEIGHT + solver.outings))
    _, twa, tws = solver.wind(x.nuisance, x.stream[solver.block])
    seen = np.zeros((angles, winds), dtype=np.int64)
    near_a = np.argmin(np.abs(np.degrees(np.abs(twa))[:, None] - TWA_DEG), axis=1)
    near_w = np.argmin(np.abs(np.log(tws)[:, None] - np.log(TWS_MPS)), axis=1)
    np.add.at(seen, (near_a, near_w), 1)
    # What all speeds are off by together: the mean over what a voyage sails, in the winds that were sailed.
    share = np.maximum(seen.sum(axis=0), 0) / max(1, seen.sum())
    usual = ((TWA_DEG >= 40.0) & (TWA_DEG <= 165.0)).astype(float)
    over = np.outer(usual / usual.sum(), share).ravel() @ basis
    nodes = np.meshgrid(np.radians(TWA_DEG), TWS_MPS, indexing="ij")
    of_wind = WIND_OF_DAY * WIND_LEFT * solver.wind_mps * solver.steepness(nodes[0].ravel(), nodes[1].ravel())
    of_usual = float(np.outer(usual / usual.sum(), share).ravel() @ of_wind)
    common = math.sqrt(float(over @ part @ over) + day**2 + of_usual**2)
    values, vectors = np.linalg.eigh(part)
    noise_of = (vectors * np.sqrt(np.maximum(values, 0.0))) @ rng.standard_normal((k, draws))
    fields = (basis @ (x.shape[:, None] + noise_of)).T.reshape(draws, angles, winds)

    def known(i: int, value: float) -> Known:
        return Known(mean=value, sd=float(math.sqrt(max(covariance[i, i], 0.0))))

    def stream(outing: int, axis: int) -> Known:
        """Return the stream of the time that was sailed: what it was before and after is nobody's question."""
        of = np.flatnonzero(solver.block_outing == outing)
        if of.shape[0] == 0:
            return known(solver.at_mean + 2 * outing + axis, float(x.mean[outing, axis]))
        i = solver.at_stream + 2 * of + axis
        return Known(mean=float(np.mean(x.stream[of, axis])), sd=math.sqrt(float(np.mean(covariance[np.ix_(i, i)]))))

    table = base * np.exp(factor.reshape(angles, winds))
    table = np.maximum.accumulate(table, axis=1)  # more wind makes no boat slower
    return LearnedBoat(
        polar=Polar(twa_rad=np.radians(TWA_DEG), tws_mps=TWS_MPS, speed_mps_table=table, name="learned"),
        error=np.hypot(np.hypot(spread, day), of_wind).reshape(angles, winds),
        common=common,
        vane=known(a, float(x.nuisance[0])),
        compass=known(a + 1, float(x.nuisance[1])),
        leeway=known(a + 2, max(0.0, float(x.nuisance[2]))),
        lean=known(a + 3, float(x.nuisance[3])),
        currents=tuple((stream(o, 0), stream(o, 1)) for o in range(solver.outings)),
        log_factors=tuple(
            known(solver.at_factor + o, math.exp(float(x.factor[o]))) for o in range(solver.outings) if solver.has_log
        ),
        draws=base * np.exp(fields),
        seen=seen,
        noise=noise,
        wind_mps=WIND_LEFT * solver.wind_mps,
        stretches=len(solver.s),
        twa_rad=twa,
        findings=_of_two_boats(solver, x),
    )
