"""Stretches that no wind explains: while a motor or a tow drives a boat she keeps one speed at every angle to the wind.

The speed along the bow of each stretch is that of one of two regimes, beside the outing's stream s:

    sailed   e^(c + day + f(twa, tws)) prior(twa, tws) + s . bow      f: a few shapes that a true polar may have
    driven   V + s . bow                                              V: one speed of the outing

Which, is the likeliest path through the outing's stretches (Viterbi), where a change of regime costs as much as a few
stretches tell; regimes and path are found by turns, from several beginnings. An outing is taken to be driven in part
only where that tells much more than sailing alone does, and only the faster of the two: a tow is not slower than sails.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi_array

Floats = NDArray[np.float64]

DAY_SD, CURRENT_SD = 0.1, 0.4
SHAPE_SD = (0.12, 0.12, 0.12, 0.15)  # of f: cos twa, cos 2 twa, logarithm of the wind, the tack
# Noise of a stretch, Student's; a share of the speed, which is what sailing alone leaves unexplained: no more.
NOISE_SHARE, MOST_SHARE, NOISE_MPS, FREEDOM = 0.07, 0.15, 0.04, 4.0
SWITCH, LEVEL = 6.0, 6.0  # what a change of regime costs, and a speed of its own (logarithms of the likelihood)
LEAST_GAIN = 10.0
LEAST_RUN, MOST_OF = 4, 0.6  # stretches; of an outing
# Spreads of the logarithm within what is driven: about its one speed, and about what the wind explains. Racing yachts
# near their hull's speed keep to one within 10 to 15 % at every angle.
MOST_SCATTER, LEAST_APART, LEAST_TIMES = 0.06, 0.08, 2.5
MOST_WANDER, FAR_APART = 0.10, 0.3  # a tow's on one course, and how much faster it then is than sails
BEGINNINGS = (0.15, 0.4, 0.6, 0.85)  # quantiles of speed over the prior's: that of sailing
FAR = 0.25  # from it (logarithm), and a stretch is taken for driven at first
TURNS, STEPS, MOST_STEP = 8, 3, 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class _Rows:
    """Stretches: speed along the bow, logarithm of the prior's, shapes (n, k), bow (n, 2) and their outings."""

    ahead_mps: Floats
    log_prior: Floats
    shapes: Floats
    bow: Floats
    outing: NDArray[np.int64]
    outings: int


def driven(
    *,
    outing: NDArray[np.int64],
    ahead_mps: Floats,
    heading_rad: Floats,
    twa_rad: Floats,
    tws_mps: Floats,
    expected_mps: Floats,
    prior_error: float,
) -> NDArray[np.bool_]:
    """Return (n,) which stretches are driven, of all outings together; stretches are in the order of time.

    Args:
        outing: of each, from 0.
        ahead_mps: over the ground, along the bow.
        heading_rad: of the bow.
        twa_rad: of the true wind.
        tws_mps: of the true wind.
        expected_mps: what the prior says of it.
        prior_error: how far all of that may be off together, as the deviation of the logarithm.

    """
    n = ahead_mps.shape[0]
    if n <= LEAST_RUN:
        return np.zeros(n, dtype=np.bool_)
    off = wrap_pi_array(twa_rad)
    rows = _Rows(
        ahead_mps=np.maximum(ahead_mps, 0.05),
        log_prior=np.log(np.maximum(expected_mps, 0.05)),
        shapes=np.column_stack(
            [
                np.cos(off),
                np.cos(2.0 * off),
                np.log(tws_mps / float(np.median(tws_mps))),
                0.5 * np.sign(off) * (1.0 + np.cos(off)),
            ]
        ),
        bow=np.column_stack([np.sin(heading_rad), np.cos(heading_rad)]),
        outing=outing,
        outings=int(outing.max()) + 1,
    )
    none = np.zeros(n, dtype=np.bool_)
    ratio = np.log(rows.ahead_mps) - rows.log_prior
    sailing = _Fit(rows, prior_error, float(np.median(ratio)), NOISE_SHARE)
    for _ in range(2):
        sailing.improve(none)
        sailing.share = min(max(_spread(sailing.unexplained()), NOISE_SHARE), MOST_SHARE)
    best, label = sailing.score(none), none
    least = best + LEAST_GAIN
    for quantile in BEGINNINGS:
        scale = float(np.quantile(ratio, quantile))
        fit = _Fit(rows, prior_error, scale, sailing.share)
        found = fit.begin(ratio - scale > FAR)
        for _ in range(TURNS):
            fit.improve(found)
            later = fit.path()
            if bool(np.all(later == found)):
                break
            found = later
        found = fit.believable(found)
        fit.improve(found)
        score = fit.score(found)
        # Of nothing but one speed nobody can say whether it was sailed.
        if bool(np.any(found)) and int(np.sum(~found)) >= LEAST_RUN and score > max(best, least):
            best, label = score, found
    return label


class _Fit:
    """The regimes' speeds: unknowns are c, the shapes, the outings' days, their streams, their driven speeds."""

    def __init__(self, rows: _Rows, prior_error: float, scale: float, share: float) -> None:
        self.rows, self.share = rows, share
        k, o = rows.shapes.shape[1], rows.outings
        self.at_day, self.at_stream, self.at_speed = 1 + k, 1 + k + o, 1 + k + 3 * o
        self.x = np.zeros(self.at_speed + o)
        self.x[0] = scale
        self.sd = np.concatenate(
            [[max(prior_error, 0.03)], SHAPE_SD[:k], np.full(o, DAY_SD), np.full(2 * o, CURRENT_SD), np.full(o, 1e3)]
        )
        self.of_outing = [np.flatnonzero(rows.outing == i) for i in range(o)]
        self.x[self.at_speed :] = [float(np.median(rows.ahead_mps[i])) if i.shape[0] else 1.0 for i in self.of_outing]

    def begin(self, far: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return who is driven at first: in each outing what is far too fast, at its median speed."""
        for i in range(self.rows.outings):
            fast = self.rows.ahead_mps[far & (self.rows.outing == i)]
            if fast.shape[0]:
                self.x[self.at_speed + i] = float(np.median(fast))
        return far

    def _sailed(self) -> Floats:
        k = self.rows.shapes.shape[1]
        off = self.x[0] + self.rows.shapes @ self.x[1 : 1 + k] + self.x[self.at_day + self.rows.outing]
        return np.asarray(np.exp(np.clip(off + self.rows.log_prior, -4.0, 4.0)))

    def _driven(self) -> Floats:
        return np.asarray(self.x[self.at_speed + self.rows.outing])

    def _stream(self) -> Floats:
        first = self.at_stream + 2 * self.rows.outing
        return np.asarray(self.x[first] * self.rows.bow[:, 0] + self.x[first + 1] * self.rows.bow[:, 1])

    def _log_likelihood(self, speed: Floats) -> Floats:
        sigma = _noise(speed, self.share)
        z = (self.rows.ahead_mps - speed - self._stream()) / sigma
        return np.asarray(-0.5 * (FREEDOM + 1.0) * np.log1p(z * z / FREEDOM) - np.log(sigma))

    def _each(self) -> tuple[Floats, Floats]:
        """Return the logarithm of the likelihood of each stretch, sailed and driven."""
        return self._log_likelihood(self._sailed()), self._log_likelihood(self._driven())

    def improve(self, label: NDArray[np.bool_]) -> None:
        """Take a few robust Gauss-Newton steps with these stretches driven."""
        rows, k = self.rows, self.rows.shapes.shape[1]
        for _ in range(STEPS):
            sailed = self._sailed()
            speed = np.where(label, self._driven(), sailed)
            sigma = _noise(speed, self.share)
            r = rows.ahead_mps - speed - self._stream()
            weight = (FREEDOM + 1.0) / (FREEDOM + (r / sigma) ** 2) / sigma**2
            own = np.where(label, 0.0, sailed)
            columns = np.column_stack([own, own[:, None] * rows.shapes, own, rows.bow, label])
            size, shared = self.x.shape[0], np.arange(1 + k)
            normal, right = np.zeros((size, size)), np.zeros(size)
            for o, of in enumerate(self.of_outing):
                at = np.concatenate(
                    [shared, [self.at_day + o, self.at_stream + 2 * o, self.at_stream + 2 * o + 1, self.at_speed + o]]
                )
                weighted = weight[of, None] * columns[of]
                normal[np.ix_(at, at)] += columns[of].T @ weighted
                right[at] += weighted.T @ r[of]
            believed = self.x.copy()
            believed[self.at_speed :] = 0.0
            step = np.linalg.solve(normal + np.diag(1.0 / self.sd**2), right - believed / self.sd**2)
            self.x += np.clip(step, -MOST_STEP, MOST_STEP)

    def path(self) -> NDArray[np.bool_]:
        """Return the likeliest stretches to be driven."""
        sailed, by_motor = self._each()
        out = np.zeros(sailed.shape[0], dtype=np.bool_)
        for of in self.of_outing:
            if of.shape[0]:
                out[of] = _viterbi(sailed[of].tolist(), by_motor[of].tolist())
        return out

    def score(self, label: NDArray[np.bool_]) -> float:
        """Return the logarithm of the likelihood, with what changes and speeds of their own cost."""
        sailed, by_motor = self._each()
        told = np.where(label, by_motor, sailed)
        same = np.diff(self.rows.outing) == 0
        changes = int(np.sum((np.diff(label.astype(np.int8)) != 0) & same))
        own = np.unique(self.rows.outing[label]).shape[0]
        prior = -0.5 * float(np.sum((self.x[: self.at_speed] / self.sd[: self.at_speed]) ** 2))
        return float(np.sum(told) - SWITCH * changes - LEVEL * own + prior)

    def unexplained(self) -> Floats:
        """Return the logarithm of the speed through the water over that of sailing."""
        return np.asarray(np.log(np.maximum(self.rows.ahead_mps - self._stream(), 0.05) / self._sailed()))

    def believable(self, label: NDArray[np.bool_]) -> NDArray[np.bool_]:
        """Return what is driven, without outings where it is short, slower than sails, or no single speed."""
        out = label.copy()
        unlike = self.unexplained()
        off = unlike + np.log(self._sailed()) - np.log(np.maximum(self._driven(), 0.05))
        for of in self.of_outing:
            by_motor = of[label[of]]
            if by_motor.shape[0] == 0:
                continue
            scatter, by_wind = _spread(off[by_motor]), _spread(unlike[by_motor])
            faster = float(np.median(unlike[by_motor]))
            one_speed = faster > 0.0 and scatter < MOST_SCATTER and by_wind > max(LEAST_APART, LEAST_TIMES * scatter)
            # Of a whole outing a stream down the wind explains why she beats slower than she runs.
            # And other outings, in another wind, tell little of how fast she is in this: the guess has its say, too.
            whole = by_motor.shape[0] >= MOST_OF * of.shape[0]
            guess = float(np.median(np.log(self.rows.ahead_mps[by_motor]) - self.rows.log_prior[by_motor]))
            too_fast = faster > FAR_APART and scatter < MOST_WANDER and not (whole and guess < self.sd[0])
            one_speed = one_speed and not whole
            if by_motor.shape[0] < LEAST_RUN or not (one_speed or too_fast):
                out[by_motor] = False
        return out


def _noise(speed_mps: Floats, share: float) -> Floats:
    return np.hypot(share * np.maximum(speed_mps, 0.0), NOISE_MPS)


def _spread(values: Floats) -> float:
    return 1.4826 * float(np.median(np.abs(values - np.median(values))))


def _viterbi(sailed: list[float], by_motor: list[float]) -> list[bool]:
    best = [sailed[0], by_motor[0]]
    back: list[tuple[int, int]] = []
    for a, b in zip(sailed[1:], by_motor[1:], strict=True):
        from_a = 0 if best[0] >= best[1] - SWITCH else 1
        from_b = 1 if best[1] >= best[0] - SWITCH else 0
        best = [a + (best[0] if from_a == 0 else best[1] - SWITCH), b + (best[1] if from_b == 1 else best[0] - SWITCH)]
        back.append((from_a, from_b))
    state = 0 if best[0] >= best[1] else 1
    path = [state]
    for step in reversed(back):
        state = step[state]
        path.append(state)
    return [s == 1 for s in reversed(path)]
