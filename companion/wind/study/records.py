"""A record of wind: readings of direction and speed over time, with what else was logged.

Reading text is here; opening files is the command's business. The simulated winds serve the tests, the fit and the
documentation: a process whose best forecast is known is the only real check of a forecaster.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import minimize_scalar

from companion.errors import InputError
from companion.geo.angles import mean_direction_rad, wrap_pi, wrap_pi_array
from companion.words import counted

Array = NDArray[np.float64]


_DIRECTION = ("wind_from_deg", "twd_deg", "twd_from_deg")
_SPEED = ("wind_speed_ms", "wind_speed_mps", "tws_ms", "tws_mps")


@dataclass(frozen=True, slots=True, kw_only=True)
class Record:
    """Arrays of one length: time [s], direction the true wind comes from [rad], its speed [m/s].

    ``turning`` marks readings in manoeuvres; ``heading_rad`` and ``awa_rad`` (positive to starboard) are None when
    they were not logged.
    """

    name: str
    t_s: Array
    twd_from_rad: Array
    tws_mps: Array
    turning: NDArray[np.bool_]
    heading_rad: Array | None = None
    awa_rad: Array | None = None

    def __post_init__(self) -> None:
        n = self.t_s.shape
        if any(a.shape != n for a in (self.twd_from_rad, self.tws_mps, self.turning)) or len(n) != 1:
            raise ValueError("the columns of a record must have one length")

    def __len__(self) -> int:
        return int(self.t_s.size)

    @property
    def duration_s(self) -> float:
        """Time from the first to the last reading [s]."""
        return float(self.t_s[-1] - self.t_s[0]) if len(self) else 0.0

    def rotated(self, angle_rad: float) -> Record:
        """Return the record as it would have been with north elsewhere."""
        return Record(
            name=self.name,
            t_s=self.t_s,
            twd_from_rad=self.twd_from_rad + angle_rad,
            tws_mps=self.tws_mps,
            turning=self.turning,
        )


def parse_csv(lines: Iterable[str], source: str) -> Record:
    """Return the record in CSV text with a header: ``t_s``, a direction in degrees, a speed in m/s, other columns.

    Raises InputError naming the line when a column is missing, a number is not one, or time does not advance.
    """
    reader = csv.reader(lines)
    header = [name.strip() for name in next(reader, [])]

    def column(names: tuple[str, ...], *, needed: bool) -> int | None:
        for name in names:
            if name in header:
                return header.index(name)
        if needed:
            raise InputError(source, "line 1", f"no column {names[0]}", "a record has t_s,wind_from_deg,wind_speed_ms")
        return None

    i_t, i_d, i_s = (column(n, needed=True) for n in (("t_s",), _DIRECTION, _SPEED))
    i_turn, i_head, i_awa = (column((n,), needed=False) for n in ("turning", "heading_deg", "awa_deg"))
    rows: list[tuple[float, float, float, float, float, float]] = []
    for number, row in enumerate(reader, start=2):
        if not row:
            continue

        def value(index: int | None, row: list[str] = row, number: int = number) -> float:
            if index is None:
                return 0.0
            try:
                found = float(row[index])
            except (ValueError, IndexError):
                text = row[index] if index < len(row) else ""
                raise InputError(source, f"line {number}", f"{header[index]} is {text!r}", "write a number") from None
            if not math.isfinite(found):
                raise InputError(source, f"line {number}", f"{header[index]} is {found}", "write a finite number")
            return found

        new = (value(i_t), value(i_d), value(i_s), value(i_turn), value(i_head), value(i_awa))
        if rows and new[0] <= rows[-1][0]:
            raise InputError(source, f"line {number}", f"time {new[0]:g} is not after {rows[-1][0]:g}", "sort by t_s")
        if new[2] < 0.0:
            raise InputError(source, f"line {number}", f"wind speed {new[2]:g} is negative", "write m/s")
        rows.append(new)
    if len(rows) < 2:
        raise InputError(source, "", f"{counted(len(rows), 'reading')}", "a record needs at least two")
    table = np.array(rows, dtype=np.float64)
    return Record(
        name=source,
        t_s=table[:, 0],
        twd_from_rad=np.radians(table[:, 1]),
        tws_mps=table[:, 2],
        turning=table[:, 3] != 0.0,
        heading_rad=np.radians(table[:, 4]) if i_head is not None else None,
        awa_rad=np.radians((table[:, 5] + 180.0) % 360.0 - 180.0) if i_awa is not None else None,
    )


# Fit the AR(1) wind of Wolsieffer's equation 17 to a record by maximum likelihood.
#
#     y_t = y_{t-1} + Δ (−ρ y_{t-1} + w_t),    w ~ N(0, σ_w)                                              (17)
#
# Records have irregular steps, so the continuous process behind it is fitted: over a step d the departure from the mean
# keeps a = e^{-k d} and gains a normal of variance v (1 − a²). The likelihood of the record (Hamilton 1994, chapter 5,
# conditional on the first reading) is profiled over mean and v and maximised over k; the errors are those of the
# observed information. For the record's usual step Δ the paper's numbers follow: ρ = (1 − e^{-kΔ}) / Δ and
# σ_w = sqrt(v (1 − e^{-2kΔ})) / Δ.


@dataclass(frozen=True, slots=True, kw_only=True)
class Ar1Fit:
    """Equation 17 fitted: every ``_error`` is one standard error."""

    step_s: float
    rho_hz: float
    rho_error_hz: float
    noise_radps: float
    noise_error_radps: float
    sigma_rad: float
    mean_twd_from_rad: float
    correlation_time_s: float
    count: int


def fit_ar1(record: Record) -> Ar1Fit:
    """Return the fit to the record's direction. Raises InputError for fewer than 100 readings."""
    if len(record) < 100:
        raise InputError(record.name, "", f"{counted(len(record), 'reading')}", "the AR(1) fit needs at least 100")
    centre = mean_direction_rad(record.twd_from_rad)
    centre = 0.0 if math.isnan(centre) else centre
    y = wrap_pi_array(record.twd_from_rad - centre)
    d = np.diff(record.t_s)
    step = float(np.median(d))

    def parts(k: float) -> tuple[float, float, float]:
        """Return the log likelihood profiled over mean and variance, the mean, v."""
        a = np.exp(-k * d)
        scale = np.maximum(1e-12, 1.0 - a * a)
        # Innovations y' - a y = (1 - a) m + e: the mean is a weighted regression.
        w = (1.0 - a) ** 2 / scale
        m = float(np.sum((1.0 - a) * (y[1:] - a * y[:-1]) / scale) / max(1e-12, float(np.sum(w))))
        e = y[1:] - a * y[:-1] - (1.0 - a) * m
        v = max(1e-12, float(np.mean(e * e / scale)))
        return _log_likelihood(e, v * scale), m, v

    found = minimize_scalar(
        lambda u: -parts(math.exp(u))[0],
        bounds=(math.log(1e-5), math.log(5.0 / step)),
        method="bounded",
        options={"xatol": 1e-6},
    )
    k = math.exp(float(found.x))
    _, m, v = parts(k)

    def paper(p: Array) -> tuple[float, float]:
        """Return (ρ, σ_w) of (17) from (ln k, ln v)."""
        rate, variance = math.exp(p[0]), math.exp(p[1])
        return -math.expm1(-rate * step) / step, math.sqrt(-variance * math.expm1(-2.0 * rate * step)) / step

    def whole(p: Array) -> float:
        a = np.exp(-math.exp(p[0]) * d)
        e = y[1:] - a * y[:-1] - (1.0 - a) * m
        return _log_likelihood(e, math.exp(p[1]) * np.maximum(1e-12, 1.0 - a * a))

    at = np.array([math.log(k), math.log(v)])
    covariance = np.linalg.inv(_information(whole, at))
    jacobian = np.array([(np.array(paper(at + h)) - np.array(paper(at - h))) / 2e-4 for h in np.eye(2) * 1e-4]).T
    errors = np.sqrt(np.maximum(0.0, np.diag(jacobian @ covariance @ jacobian.T)))
    rho, noise = paper(at)
    return Ar1Fit(
        step_s=step,
        rho_hz=rho,
        rho_error_hz=float(errors[0]),
        noise_radps=noise,
        noise_error_radps=float(errors[1]),
        sigma_rad=math.sqrt(v),
        mean_twd_from_rad=wrap_pi(centre + m),
        correlation_time_s=1.0 / k,
        count=len(record),
    )


def _log_likelihood(error: Array, variance: Array) -> float:
    return float(-0.5 * np.sum(np.log(2.0 * math.pi * variance) + error * error / variance))


def _information(function: Callable[[Array], float], at: Array) -> Array:
    """Return minus the Hessian by central differences."""
    n, step = at.size, 1e-3
    h = np.eye(n) * step
    found = np.empty((n, n))
    for i in range(n):
        for j in range(n):
            found[i, j] = -(
                function(at + h[i] + h[j])
                - function(at + h[i] - h[j])
                - function(at - h[i] + h[j])
                + function(at - h[i] - h[j])
            ) / (4.0 * step * step)
    return found
