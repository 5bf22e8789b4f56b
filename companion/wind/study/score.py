"""How good was a forecast? Circular CRPS, coverage of intervals, width, over a record.

The rules are those of the reference figures in docs/reference/wind.md: every reading is fed to the estimator, and a
forecast is made every 30 s after ten minutes, and scored against the single reading at t + h (within 1.05 s) unless the
boat was turning or the wind was below 1 m/s. Direction is scored by the circular continuous ranked probability score of
a wrapped normal (Grimit, Gneiting, Berrocal and Johnson 2006),

    CRPS = E d(X, y) - E d(X, X') / 2,    d = arc on the circle,                                       (a)

which equals the Gaussian CRPS while sigma is small and tends to 45 deg for a uniform forecast.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.geo.angles import wrap_pi
from companion.wind.estimators.catalogue import make
from companion.wind.estimators.estimator import Estimator, normal_half_width
from companion.wind.estimators.kalman import R_DEG, WINDOW
from companion.wind.study.records import Record

SCORED_HORIZONS_S = (10.0, 30.0, 60.0, 120.0, 300.0, 600.0)
SCORED_LEVELS = (0.50, 0.80, 0.95)
STEP_S, WARM_S, MIN_MPS, WITHIN_S = 30.0, 600.0, 1.0, 1.05
TRACE_S = 120.0  # [s] horizon of Score.trace and Score.pit
FEWEST = 20  # forecasts of a horizon below which it has no score

Array = NDArray[np.float64]


def crps_normal(error: float, sigma: float) -> float:
    """Return the CRPS of a normal forecast that missed by ``error`` (Gneiting and Raftery 2007, equation 21)."""
    z = error / sigma
    pdf = math.exp(-0.5 * z * z) / math.sqrt(2.0 * math.pi)
    return sigma * (z * math.erf(z / math.sqrt(2.0)) + 2.0 * pdf - 1.0 / math.sqrt(math.pi))


def crps_circular(error_rad: float, sigma_rad: float) -> float:
    """Return (a) [rad] for a wrapped normal that missed by ``error_rad`` on [-π, π]."""
    if abs(error_rad) + 5.0 * sigma_rad < math.pi:
        return crps_normal(error_rad, sigma_rad)
    # d(x) = π/2 - 4/π Σ cos(kx)/k² over odd k, and E cos(kX) = exp(-k²σ²/2).
    near = apart = 0.0
    for k in range(1, 400, 2):
        e = math.exp(-0.5 * k * k * sigma_rad * sigma_rad)
        near += e * math.cos(k * error_rad) / (k * k)
        apart += e * e / (k * k)
        if e < 1e-12:
            break
    return (math.pi / 2 - 4 / math.pi * near) - 0.5 * (math.pi / 2 - 4 / math.pi * apart)


@dataclass(frozen=True, slots=True, kw_only=True)
class HorizonScore:
    """Averages over the forecasts of one horizon."""

    horizon_s: float
    count: int
    crps_rad: float
    mae_rad: float
    sigma_rad: float
    width95_rad: float
    coverage: tuple[float, ...]  # of SCORED_LEVELS
    speed_crps_mps: float
    speed_coverage95: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """What an estimator did on a record; a horizon with too few targets is absent.

    ``pit`` (n,) are the probability integral transforms at 120 s, by the estimator's own intervals, for reliability.
    ``trace`` (m, 6) are all forecasts for 120 s ahead: time they are for, mean direction, half widths of 50 and 95 %,
    mean speed, its sigma.
    """

    record: str
    estimator: str
    horizons: tuple[HorizonScore, ...]
    pit: Array
    trace: Array

    def at(self, horizon_s: float) -> HorizonScore | None:
        """Return the score of a horizon."""
        return next((h for h in self.horizons if h.horizon_s == horizon_s), None)


def targets(record: Record, horizon_s: float, asked: NDArray[np.int_]) -> NDArray[np.int_]:
    """Return for each asked row the row that its forecast is scored against, -1 for none."""
    t = record.t_s
    row = np.searchsorted(t, t[asked] + horizon_s - WITHIN_S)
    inside = row < t.size
    row = np.minimum(row, t.size - 1)
    good = inside & (np.abs(t[row] - t[asked] - horizon_s) <= WITHIN_S) & ~record.turning[row]
    return np.where(good & (record.tws_mps[row] >= MIN_MPS), row, -1)


def asked_rows(record: Record) -> NDArray[np.int_]:
    """Return the rows at which forecasts are made: every 30 s after ten minutes."""
    rows, due = [], record.t_s[0] + WARM_S
    for i, t in enumerate(record.t_s.tolist()):
        if t >= due:
            rows.append(i)
            due = t + STEP_S
    return np.array(rows, dtype=np.int_)


def score(
    record: Record,
    estimator: Estimator,
    *,
    horizons_s: Sequence[float] = SCORED_HORIZONS_S,
    progress: Callable[[int], None] | None = None,
) -> Score:
    """Feed ``record`` to ``estimator`` and score it; ``progress`` hears the number of rows done now and then."""
    asked = asked_rows(record)
    target = {h: targets(record, h, asked) for h in horizons_s}
    errors: dict[float, list[tuple[float, ...]]] = {h: [] for h in horizons_s}
    pit: list[float] = []
    trace: list[tuple[float, ...]] = []
    due = {int(row): k for k, row in enumerate(asked)}
    direction, speed = record.twd_from_rad, record.tws_mps
    for i in range(len(record)):
        estimator.update(float(record.t_s[i]), float(direction[i]), float(speed[i]))
        if progress is not None and i % 500 == 0:
            progress(i)
        k = due.get(i)
        if k is None:
            continue
        mean, _, mean_speed, sigma_speed = estimator.forecast(TRACE_S)
        half = [min(math.pi, estimator.interval(TRACE_S, p)) for p in (0.5, 0.95)]
        trace.append((float(record.t_s[i]) + TRACE_S, mean, *half, mean_speed, sigma_speed))
        for h in horizons_s:
            j = int(target[h][k])
            if j < 0:
                continue
            ahead = float(record.t_s[j] - record.t_s[i])
            mean, sigma, mean_speed, sigma_speed = estimator.forecast(ahead)
            error, speed_error = wrap_pi(float(direction[j]) - mean), float(speed[j]) - mean_speed
            half = [min(math.pi, estimator.interval(ahead, p)) for p in SCORED_LEVELS]
            errors[h].append(
                (
                    crps_circular(error, sigma),
                    abs(error),
                    sigma,
                    2.0 * half[-1],
                    *(abs(error) <= w for w in half),
                    crps_normal(speed_error, sigma_speed),
                    abs(speed_error) <= normal_half_width(0.95) * sigma_speed,
                )
            )
            if h == TRACE_S:
                pit.append(transform(estimator, ahead, error))
    found = []
    for h in horizons_s:
        if len(errors[h]) >= FEWEST:
            m = np.mean(np.array(errors[h], dtype=np.float64), axis=0).tolist()
            n = 4 + len(SCORED_LEVELS)
            found.append(
                HorizonScore(
                    horizon_s=h,
                    count=len(errors[h]),
                    crps_rad=m[0],
                    mae_rad=m[1],
                    sigma_rad=m[2],
                    width95_rad=m[3],
                    coverage=tuple(m[4:n]),
                    speed_crps_mps=m[n],
                    speed_coverage95=m[n + 1],
                )
            )
    return Score(
        record=record.name,
        estimator=estimator.name,
        horizons=tuple(found),
        pit=np.array(pit),
        trace=np.array(trace, dtype=np.float64).reshape(len(trace), 6),
    )


def transform(estimator: Estimator, horizon_s: float, error_rad: float) -> float:
    """Return where an error fell in the forecast's own distribution, 0..1: uniform when the forecast is honest."""
    low, high = 0.0, 0.9999
    for _ in range(14):
        middle = 0.5 * (low + high)
        if estimator.interval(horizon_s, middle) < abs(error_rad):
            low = middle
        else:
            high = middle
    return 0.5 + math.copysign(0.5 * low, error_rad)


def average(scores: Sequence[Score]) -> Iterator[HorizonScore]:
    """Yield the mean over records of each horizon's score, so that long records do not dominate."""
    for h in sorted({s.horizon_s for score_ in scores for s in score_.horizons}):
        of = [s for score_ in scores if (s := score_.at(h)) is not None]

        def mean(values: Sequence[float]) -> float:
            return float(np.mean(values))

        yield HorizonScore(
            horizon_s=h,
            count=sum(s.count for s in of),
            crps_rad=mean([s.crps_rad for s in of]),
            mae_rad=mean([s.mae_rad for s in of]),
            sigma_rad=mean([s.sigma_rad for s in of]),
            width95_rad=mean([s.width95_rad for s in of]),
            coverage=tuple(mean([s.coverage[i] for s in of]) for i in range(len(SCORED_LEVELS))),
            speed_crps_mps=mean([s.speed_crps_mps for s in of]),
            speed_coverage95=mean([s.speed_coverage95 for s in of]),
        )


# Wolsieffer's filter by its noise R and its window N: how good is it, over records? (2020, section 3.1).
#
# R is "determined through characterization of the anemometer"; the window N "must be large enough to capture the full
# variation of the wind". The paper gives neither number, so both are tried here, over records: every cell of the grid
# is the filter with that R and N, scored by the rules of ``score``. The default forecaster is scored beside it.
#
# What to expect: with a gain k the innovations of a settled filter have the variance R / (1 - k), by (3), (6) and (7).
# An R above what the innovations show has no such k: the gain goes to nothing and the filter stops. One far below has k
# near 1: every reading is believed and Q is the whole unrest of the readings, added at every sample.

NOISES_DEG = (0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
WINDOWS = (10, 30, 100, 300, 1000)
# The paper plans for 10 s at a time and gives no lengths of its plans: a board, and a short plan, beside that.
FILTER_HORIZONS_S = (10.0, 60.0, 300.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class FilterScore:
    """The filter of one R [deg] and one N [samples]: its scores, means over the records."""

    r_deg: float
    window: int
    horizons: tuple[HorizonScore, ...]

    def at(self, horizon_s: float) -> HorizonScore | None:
        """Return the score of a horizon."""
        return next((h for h in self.horizons if h.horizon_s == horizon_s), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Characterisation:
    """The grid over ``records`` (their names), R before N, and the default forecaster on the same horizons.

    ``horizons_s`` are those with a score. Records too short for any have none, and no cells.
    """

    records: tuple[str, ...]
    cells: tuple[FilterScore, ...]
    default: tuple[HorizonScore, ...]

    @property
    def horizons_s(self) -> tuple[float, ...]:
        """Return the horizons that were scored [s]."""
        return tuple(h.horizon_s for h in self.default)

    @property
    def chosen(self) -> FilterScore | None:
        """Return the cell of a mission that says neither R nor N, None where the grid has none."""
        return next((cell for cell in self.cells if (cell.r_deg, cell.window) == (R_DEG, WINDOW)), None)

    def best(self, horizon_s: float) -> FilterScore:
        """Return the cell of the least CRPS at a horizon of ``horizons_s``."""

        def crps(cell: FilterScore) -> float:
            found = cell.at(horizon_s)
            return float("inf") if found is None else found.crps_rad

        return min(self.cells, key=crps)


def runs(noises_deg: Sequence[float] = NOISES_DEG, windows: Sequence[int] = WINDOWS) -> int:
    """Return how many times ``characterise`` goes over every record."""
    return 1 + len(noises_deg) * len(windows)


def characterise(
    records: Sequence[Record],
    *,
    noises_deg: Sequence[float] = NOISES_DEG,
    windows: Sequence[int] = WINDOWS,
    horizons_s: Sequence[float] = FILTER_HORIZONS_S,
    advance: Callable[[int], None] | None = None,
) -> Characterisation:
    """Return the filter's scores over ``records`` for every R [deg] and N [samples].

    ``advance`` hears of the readings that were fed, record by record.
    """

    def over(name: str, **options: float) -> tuple[HorizonScore, ...]:
        found: list[Score] = []
        for record in records:
            found.append(score(record, make(name, **options), horizons_s=horizons_s))
            if advance is not None:
                advance(len(record))
        return tuple(average(found))

    default = over("default")
    grid = [(r_deg, n) for r_deg in noises_deg for n in windows] if default else []
    return Characterisation(
        records=tuple(record.name for record in records),
        default=default,
        cells=tuple(FilterScore(r_deg=r_deg, window=n, horizons=over("kalman", r_deg=r_deg, n=n)) for r_deg, n in grid),
    )
