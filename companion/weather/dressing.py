"""A forecast dressed with its own error: by how much runs are off, more each day ahead; and what follows past its end.

Members of an ensemble differ by less than they are wrong, and one forecast does not differ at all. Each is given errors
that wander in time and are the same over the water; their deviation grows with the age of the run, so a stale forecast
is a wide one. Past its end the wind becomes that of the season, which is climatology and no forecast, and is labelled.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from companion.weather.weather import Cube, Floats, Weather

DAY_S = 86_400.0
MEMORY_S = DAY_S  # an error of the weather's place lasts a day
STEP_S = 6 * 3600.0
COPIES = 9  # of one forecast; an ensemble of so many members has one of each
_BLOCK = 128
_CALM_S = 2 * DAY_S  # by when a forecast's last wind has become the season's to a third


@dataclass(frozen=True, slots=True, kw_only=True)
class ForecastError:
    """The deviation of a component of the wind from what a member says [m/s]: at once, and what a day ahead adds."""

    now_mps: float
    per_day_mps: float
    memory_s: float = MEMORY_S

    def sd_mps(self, lead_s: Floats) -> Floats:
        """Return it at leads: both parts are independent."""
        return np.hypot(self.now_mps, self.per_day_mps * np.maximum(0.0, lead_s) / DAY_S)


@dataclass(frozen=True, slots=True, kw_only=True)
class Climate:
    """The wind of a season: its mean motion [m/s] to east and north, and the deviation of a component."""

    wind_en_mps: tuple[float, float]
    spread_mps: float


def dressed(weather: Weather, error: ForecastError, *, seed: int = 0, copies: int | None = None) -> Weather:
    """Return a forecast with members that are off as it is: several of each where it has few. A seed repeats it.

    Each of them has the waves of the member that it is made of.
    """
    members = weather.members
    many = max(1, math.ceil(COPIES / len(members))) if copies is None else copies
    numbers = {m: tuple(m * many + k for k in range(many)) for m in members}
    return replace(
        weather,
        wind=tuple(_dressed(cube, error, numbers, seed) for cube in weather.wind),
        waves=tuple(_numbered(cube, numbers) for cube in weather.waves),
    )


def _numbered(cube: Cube, numbers: dict[int, tuple[int, ...]]) -> Cube:
    """Return a cube by the numbers of the members that are made of its own; of a single one as it is, for all."""
    if len(cube.members) == 1:
        return cube
    made = [(number, row) for row, m in enumerate(cube.members) for number in numbers.get(m, ())]
    if not made:
        return cube
    return replace(cube, members=tuple(n for n, _ in made), values=cube.values[[row for _, row in made]])


def _dressed(cube: Cube, error: ForecastError, numbers: dict[int, tuple[int, ...]], seed: int) -> Cube:
    rows, members = [], []
    sd = error.sd_mps(cube.utc_s - cube.base_utc_s)
    for row, member in enumerate(cube.members):
        for number in numbers[member]:
            off = sd[:, None] * _wander(cube.utc_s, error.memory_s, seed, number)
            rows.append(cube.values[row] + off[:, None, None, :].astype(np.float32))
            members.append(number)
    return replace(cube, members=tuple(members), values=np.stack(rows))


def _wander(utc_s: Floats, memory_s: float, seed: int, number: int) -> Floats:
    """Return (t, 2) of deviation 1 that is forgotten by ``memory_s``.

    It is drawn at steps of a clock, so two grids of a member have the same errors at the same time.
    """
    step_s = min(STEP_S, 0.25 * memory_s)
    begin = math.floor(float(utc_s[0]) / step_s)
    count = math.ceil(float(utc_s[-1]) / step_s) - begin + 2
    left = math.exp(-step_s / memory_s)
    # Each step's draw is of its own time, whatever begins before it: forgotten after twelve memories.
    back = math.ceil(12.0 * memory_s / step_s)
    draws = _draws(seed, number, begin - back, back + count)
    out = np.empty_like(draws)
    state = draws[0]
    for k in range(len(draws)):
        state = left * state + math.sqrt(1.0 - left**2) * draws[k]
        out[k] = state
    out = out[back:]
    at = utc_s / step_s - begin
    low = np.clip(np.floor(at).astype(int), 0, count - 2)
    share = (at - low)[:, None]
    mixed = (1.0 - share) * out[low] + share * out[low + 1]
    # Between two draws there is a little less of it than at them.
    return np.asarray(mixed / np.sqrt(1.0 - 2.0 * share * (1.0 - share) * (1.0 - left)))


def _draws(seed: int, number: int, first: int, count: int) -> Floats:
    """Return (count, 2) draws of a clock's steps from ``first`` on: each is of its own step, by blocks of them."""
    blocks = [
        np.random.default_rng([seed & 0xFFFFFFFF, number & 0xFFFFFFFF, block & 0xFFFFFFFF]).standard_normal((_BLOCK, 2))
        for block in range(first // _BLOCK, (first + count - 1) // _BLOCK + 1)
    ]
    begin = first % _BLOCK
    return np.concatenate(blocks)[begin : begin + count]


def errors_of(runs: Sequence[Weather]) -> Floats:
    """Return (n, 3) of successive runs: lead [s], mean square error of a component [m²/s²], the members' variance.

    Each run is held against the beginning of each later one, where both know the wind, and stands for the mean of its
    members.
    """
    rows = []
    for truth in runs:
        cube = truth.wind[-1]
        t = float(cube.utc_s[0])
        lat, lon = (a.ravel() for a in np.meshgrid(cube.lat_deg, cube.lon_deg, indexing="ij"))
        true = truth.wind_en_mps(t, lat, lon).mean(axis=0)
        for run in runs:
            base = float(run.wind[-1].base_utc_s[0])
            if base >= float(cube.base_utc_s[0]) or t > float(run.wind[-1].utc_s[-1]):
                continue
            told = run.wind_en_mps(t, lat, lon)
            known = ~(np.isnan(told).any(axis=(0, 2)) | np.isnan(true).any(axis=1))
            if not known.any():
                continue
            square = float(((told.mean(axis=0) - true)[known] ** 2).mean())
            spread = float(told[:, known].var(axis=0, ddof=1).mean()) if told.shape[0] > 1 else 0.0
            rows.append((t - base, square, spread))
    return np.array(rows).reshape(-1, 3)


def fitted(errors: Floats) -> ForecastError:
    """Return what members have to be dressed with: by least squares, what their own spread does not explain.

    Raises ValueError where fewer than two leads are known.
    """
    if len(errors) < 2 or np.ptp(errors[:, 0]) < 3600.0:
        raise ValueError("there are fewer than two leads")
    # By leads first: a single error says nothing of how sure it is.
    hours, which = np.unique(np.rint(errors[:, 0] / 3600.0), return_inverse=True)
    count = np.bincount(which)
    square, left = (np.bincount(which, weights=v) / count for v in (errors[:, 1], errors[:, 1] - errors[:, 2]))
    days2 = (hours / 24.0) ** 2
    # In shares of the error: of 0.5 and of 16 m²/s² the first counts as much.
    weight = np.sqrt(count) / np.maximum(1e-6, square)
    design = np.stack([np.ones(hours.size), days2], axis=-1) * weight[:, None]
    first, second = np.linalg.lstsq(design, left * weight, rcond=None)[0]
    if first < 0.0:  # neither can be: the other one alone
        first, second = 0.0, float((weight**2 * days2 * left).sum() / (weight**2 * days2**2).sum())
    elif second < 0.0:
        first, second = float(np.average(left, weights=weight**2)), 0.0
    return ForecastError(now_mps=math.sqrt(max(0.0, first)), per_day_mps=math.sqrt(max(0.0, second)))


def continued(weather: Weather, climate: Climate, until_s: float) -> Weather:
    """Return a forecast that goes on past its end with the wind of the season, and says from when on it does."""
    last = max(float(cube.utc_s[-1]) for cube in weather.wind)
    if until_s <= last:
        return weather
    widest = max(weather.wind, key=lambda cube: cube.cell_deg2 * cube.lat_deg.size * cube.lon_deg.size)
    ends = float(widest.utc_s[-1])
    more = np.append(np.arange(ends + STEP_S, until_s, STEP_S), until_s)
    left = np.exp(-(more - ends) / _CALM_S)
    mean = np.array(climate.wind_en_mps)
    values = []
    for row, member in enumerate(widest.members):
        # As sure of the season as its spread says, whatever the forecast ended with.
        own = climate.spread_mps * np.sqrt(1.0 - left**2)[:, None] * _wander(more, MEMORY_S, 1, member)
        faded = left[:, None, None, None] * (widest.values[row, -1] - mean)
        values.append((mean + faded + own[:, None, None, :]).astype(np.float32))
    longer = replace(
        widest,
        utc_s=np.concatenate([widest.utc_s, more]),
        base_utc_s=np.concatenate([widest.base_utc_s, np.full(more.size, widest.base_utc_s[-1])]),
        values=np.concatenate([widest.values, np.stack(values)], axis=1),
        most_step_s=max(widest.most_step_s, STEP_S),
    )
    wind = tuple(longer if cube is widest else cube for cube in weather.wind)
    return replace(weather, wind=wind, climate_from_s=last)
