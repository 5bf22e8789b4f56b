"""Wind and current by place and time, seeded and repeatable.

A ``Wind`` is asked ``at(t_s)`` and answers (where the wind comes from [rad, true north clockwise, 0..2π), how fast
[m/s]). It is a function: the same question has the same answer, in whatever order and however often it is asked,
so the simulated autopilot, the real one and the judge of a scenario all sail in one weather. Winds compose:
``Scripted`` lays events over any other wind.

Places are metres east and north of a home, as the autopilots count them; ``home_en_m`` is that home in the frame in
which islands and shear are given. A question has one answer, in whatever order it is asked.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from companion.errors import InputError, unreadable
from companion.geo.angles import wrap_two_pi

# Wolsieffer 2020, equation 17: mean reversion of the wind direction and its noise over a step of 1 s.
RHO_HZ = 0.036
NOISE_RAD = 0.087
# q / sqrt(2 rho): the spread that noise keeps up, 18.6 degrees.
SPREAD_RAD = NOISE_RAD / math.sqrt(2.0 * RHO_HZ)

_BLOCK = 1024


class WindModel(Protocol):
    """The wind at the boat's place."""

    def at(self, t_s: float) -> tuple[float, float]:
        """Return (direction it comes from [rad, 0..2π), speed [m/s]) ``t_s`` seconds after the start."""


@dataclass(frozen=True, slots=True)
class Constant:
    """The same wind for ever."""

    twd_from_rad: float
    tws_mps: float

    def at(self, t_s: float) -> tuple[float, float]:  # noqa: ARG002 - the interface has it
        """Return the wind."""
        return wrap_two_pi(self.twd_from_rad), self.tws_mps


class Process:
    """A stationary Ornstein-Uhlenbeck process of mean 0 and standard deviation 1, known on a fixed time grid.

    x(t + d) = exp(-rho d) x(t) + sqrt(1 - exp(-2 rho d)) n: exact at any d, so the spread does not depend on the
    grid (the Euler form of equation 17 with noise of fixed size per step would make it grow with the rate).
    Between grid points it is linear: at the default 0.1 s this lowers the standard deviation by less than 0.1 %
    half way between them. Values are made in blocks from (seed, block), so a question far ahead and a question
    twice have one answer; only the first value of each block is kept, 80 bytes per hour.
    """

    def __init__(self, rho_hz: float, step_s: float, seed: int, stream: int, *, from_mean: bool) -> None:
        self._phi = math.exp(-rho_hz * step_s)
        self._noise = math.sqrt(1.0 - self._phi * self._phi)
        self._step_s = step_s
        self._seed = (seed & 0xFFFFFFFF, stream)
        first = 0.0 if from_mean else float(np.random.default_rng((*self._seed, 2**31)).standard_normal())
        self._first = [first]
        self._cached = -1
        self._values: list[float] = []

    def at(self, t_s: float) -> float:
        """Return the process at ``t_s``; before 0 as at 0."""
        place = max(0.0, t_s) / self._step_s
        index = math.floor(place)
        share = place - index
        a = self._value(index)
        return a if share == 0.0 else a + share * (self._value(index + 1) - a)

    def _value(self, index: int) -> float:
        block, offset = divmod(index, _BLOCK)
        if block != self._cached:
            self._load(block)
        return self._values[offset]

    def _load(self, block: int) -> None:
        for b in range(min(block, len(self._first) - 1), block + 1):
            noise = np.random.default_rng((*self._seed, b)).standard_normal(_BLOCK) * self._noise
            # value k of the block is phi x(k-1) + noise(k-1); a loop, for scipy's filters take a second to import
            values = [self._first[b]]
            for each in noise.tolist():
                values.append(self._phi * values[-1] + each)
            if b + 1 == len(self._first):
                self._first.append(values[-1])
        self._values = values[:-1]
        self._cached = block


class AR1:
    """Wolsieffer's equation 17: a direction that wanders about a mean and is drawn back to it.

    Args:
        twd_from_rad: mean direction [rad].
        tws_mps: mean speed [m/s].
        seed: of the direction and the speed; two winds of one seed are equal.
        sd_rad: stationary spread [rad]; the default is his, 0.087 rad/s at 1 s and 0.036 Hz: 18.6 degrees.
        rho_hz: mean reversion [1/s]; 1 / rho is the correlation time.
        tws_sd_mps: spread of the speed [m/s], a process of the same kind, clipped at 0.
        step_s: of the time grid; changes the realisation, not the statistics.
        from_mean: start at the mean instead of in the stationary spread.
    """

    def __init__(
        self,
        twd_from_rad: float,
        tws_mps: float,
        *,
        seed: int,
        sd_rad: float = SPREAD_RAD,
        rho_hz: float = RHO_HZ,
        tws_sd_mps: float = 0.0,
        step_s: float = 0.1,
        from_mean: bool = False,
    ) -> None:
        self.twd_from_rad, self.tws_mps = twd_from_rad, tws_mps
        self.sd_rad, self.rho_hz, self.tws_sd_mps = sd_rad, rho_hz, tws_sd_mps
        self._direction = Process(rho_hz, step_s, seed, 0, from_mean=from_mean)
        self._speed = Process(rho_hz, step_s, seed, 1, from_mean=from_mean)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at ``t_s``."""
        twd = self.twd_from_rad + self.sd_rad * self._direction.at(t_s)
        if self.tws_sd_mps == 0.0:
            return wrap_two_pi(twd), self.tws_mps
        return wrap_two_pi(twd), max(0.0, self.tws_mps + self.tws_sd_mps * self._speed.at(t_s))


class Recorded:
    """A record, read at the times it has and straight between them the shorter way round; held at both ends."""

    def __init__(
        self, t_s: NDArray[np.float64], twd_from_rad: NDArray[np.float64], tws_mps: NDArray[np.float64]
    ) -> None:
        if t_s.size == 0 or not bool(np.all(np.diff(t_s) > 0.0)):
            raise ValueError("a record needs times that increase")
        self._t_s = t_s - t_s[0]
        self._twd_rad = np.unwrap(twd_from_rad)
        self._tws_mps = tws_mps

    @property
    def duration_s(self) -> float:
        """Length of the record [s]."""
        return float(self._t_s[-1])

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind ``t_s`` after the record's first row."""
        twd = float(np.interp(t_s, self._t_s, self._twd_rad))
        return wrap_two_pi(twd), float(np.interp(t_s, self._t_s, self._tws_mps))

    @classmethod
    def from_csv(cls, path: Path) -> Recorded:
        """Read a CSV with the columns t_s, wind_from_deg, wind_speed_ms; rows with an empty value are left out.

        Raises:
            InputError: naming the file, the line and what is wrong.
        """
        rows: list[tuple[float, float, float]] = []
        try:
            with path.open(newline="", encoding="utf-8-sig") as stream:
                reader = csv.DictReader(line for line in stream if not line.startswith("#"))
                names = ("t_s", "wind_from_deg", "wind_speed_ms")
                missing = [n for n in names if n not in (reader.fieldnames or [])]
                if missing:
                    raise InputError(str(path), "line 1", f"no column {missing[0]}", f"name them {','.join(names)}")
                for row in reader:
                    texts = [row[n] for n in names]
                    if any(not text for text in texts):
                        continue
                    try:
                        t, direction, speed = (float(text) for text in texts)
                    except ValueError:
                        raise InputError(str(path), f"line {reader.line_num}", f"{texts} are not numbers") from None
                    if not all(map(math.isfinite, (t, direction, speed))):
                        continue
                    if not 0.0 <= speed <= 100.0:
                        raise InputError(str(path), f"line {reader.line_num}", f"wind of {speed} m/s", "write m/s")
                    if rows and t <= rows[-1][0]:
                        raise InputError(str(path), f"line {reader.line_num}", "time does not increase")
                    rows.append((t, math.radians(direction), speed))
        except OSError as error:
            raise unreadable(str(path), error, remedy="name a wind CSV") from error
        except UnicodeDecodeError as error:
            raise InputError(str(path), "", f"cannot be read ({error})", "name a wind CSV") from error
        if not rows:
            raise InputError(str(path), "", "holds no wind")
        table = np.array(rows)
        return cls(table[:, 0], table[:, 1], table[:, 2])


@dataclass(frozen=True, slots=True)
class Later:
    """Another wind, of which the first ``by_s`` seconds are over."""

    base: WindModel
    by_s: float

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at ``t_s``."""
        return self.base.at(t_s + self.by_s)


@dataclass(frozen=True, slots=True, kw_only=True)
class WindEvent:
    """Something that happens to the wind from ``at_s``, brought in evenly over ``over_s`` and gone after ``for_s``.

    ``veer_rad`` turns it (positive: clockwise), ``tws_mps`` replaces its speed. A shift, a dying wind (``tws_mps=0``),
    a returning one (a second event, or ``for_s``), a gust are all of this form.
    """

    at_s: float
    veer_rad: float = 0.0
    tws_mps: float | None = None
    over_s: float = 0.0
    for_s: float = math.inf

    def share(self, t_s: float) -> float:
        """Return how much of the event is in force, 0..1."""
        if t_s < self.at_s:
            return 0.0
        rise = 1.0 if self.over_s <= 0.0 else min(1.0, (t_s - self.at_s) / self.over_s)
        past_s = t_s - self.at_s - self.for_s
        if past_s <= 0.0:
            return rise
        return 0.0 if self.over_s <= 0.0 else max(0.0, rise - past_s / self.over_s)


@dataclass(frozen=True, slots=True)
class Scripted:
    """Events over another wind, applied in the order given."""

    base: WindModel
    events: Sequence[WindEvent] = field(default=())

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at ``t_s``."""
        twd, tws = self.base.at(t_s)
        for event in self.events:
            share = event.share(t_s)
            if share > 0.0:
                twd += share * event.veer_rad
                tws += share * ((tws if event.tws_mps is None else event.tws_mps) - tws)
        return wrap_two_pi(twd), max(0.0, tws)


def parse_wind(text: str, *, seed: int = 0) -> WindModel:
    """Read a wind from a command line: ``5@180``, ``ar1:5@180`` (also with ``,sd=9,rho=0.036,gust=0.5``), ``FILE.csv``.

    Speed in m/s, direction and sd in degrees.

    Raises:
        InputError: it is none of these.

    >>> parse_wind("5@90").at(0.0)[1]
    5.0
    """
    if text.endswith(".csv"):
        return Recorded.from_csv(Path(text))
    kind, colon, rest = text.partition(":")
    model, body = (kind, rest) if colon else ("constant", text)
    remedy = "write SPEED@FROM, ar1:SPEED@FROM[,sd=DEG][,rho=HZ][,gust=MPS], or FILE.csv"
    head, *pairs = body.split(",")
    try:
        speed, direction = (float(part) for part in head.split("@"))
        options = {key: float(value) for key, value in (pair.split("=") for pair in pairs)}
    except ValueError:
        raise InputError("--wind", text, "is not a wind", remedy) from None
    unknown = set(options) - ({"sd", "rho", "gust"} if model == "ar1" else set())
    numbers = [speed, direction, *options.values()]
    if model not in {"constant", "ar1"} or unknown or not all(map(math.isfinite, numbers)) or not 0 <= speed <= 100:
        raise InputError("--wind", text, "is not a wind", remedy)
    if model == "constant":
        return Constant(math.radians(direction), speed)
    return AR1(
        math.radians(direction),
        speed,
        seed=seed,
        sd_rad=math.radians(options.get("sd", math.degrees(SPREAD_RAD))),
        rho_hz=options.get("rho", RHO_HZ),
        tws_sd_mps=options.get("gust", 0.0),
    )


Place = tuple[float, float]
_KM = 1000.0
# A wake grows wider by this share of the way downwind (Jensen 1983, A note on wind generator interaction: 0.1; 0.04 to
# 0.075 are in use for it since).
WAKE_WIDENING = 0.07
# The wind's strength is never multiplied by less or more than this, however far out a gradient is followed.
LEAST_SHARE, MOST_SHARE = 0.2, 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Lee:
    """An island that takes the wind from the water behind it.

    Attributes:
        en_m: its middle.
        radius_m: of what stands in the wind.
        loss: the share of the wind's strength that is lost close behind it.
        reach_m: downwind of which a third of that is left (1 / e).
    """

    en_m: Place
    radius_m: float
    loss: float
    reach_m: float

    def share(self, en_m: Place, twd_from_rad: float) -> float:
        """Return the share of the wind's strength that is left at a place."""
        east, north = en_m[0] - self.en_m[0], en_m[1] - self.en_m[1]
        sin, cos = math.sin(twd_from_rad), math.cos(twd_from_rad)
        behind_m, across_m = -(east * sin + north * cos), east * cos - north * sin
        if behind_m <= -self.radius_m:
            return 1.0
        width_m = self.radius_m + WAKE_WIDENING * max(behind_m, 0.0)
        depth = math.exp(-behind_m / self.reach_m) if behind_m > 0.0 else 1.0 + behind_m / self.radius_m
        return 1.0 - self.loss * depth * math.exp(-((across_m / width_m) ** 2))


@dataclass(frozen=True, slots=True, kw_only=True)
class CurrentModel:
    """The water's motion: a constant part, a tide, and how both change over the water.

    Attributes:
        set_to_rad, drift_mps: the constant part.
        tide_to_rad, tide_mps: the tide's greatest stream, at ``tide_high_s`` ...
        tide_s: ... and again after this; it falls as a cosine.
        tide_turns: its stream across, as a share: 0 runs to and fro, 1 turns with the clock, -1 against it.
        shear_per_km: the stream is stronger by this share of itself for each km ...
        shear_to_rad: ... in this direction. It never turns round.
    """

    set_to_rad: float = 0.0
    drift_mps: float = 0.0
    tide_to_rad: float = 0.0
    tide_mps: float = 0.0
    tide_s: float = 44_712.0
    tide_high_s: float = 0.0
    tide_turns: float = 0.0
    shear_per_km: float = 0.0
    shear_to_rad: float = 0.0

    def at(self, t_s: float, en_m: Place) -> Place:
        """Return the stream at a time and a place, east and north [m/s]."""
        phase = 2.0 * math.pi * (t_s - self.tide_high_s) / self.tide_s
        along, across = self.tide_mps * math.cos(phase), self.tide_mps * self.tide_turns * math.sin(phase)
        sin, cos = math.sin(self.tide_to_rad), math.cos(self.tide_to_rad)
        east = self.drift_mps * math.sin(self.set_to_rad) + along * sin + across * cos
        north = self.drift_mps * math.cos(self.set_to_rad) + along * cos - across * sin
        there_m = en_m[0] * math.sin(self.shear_to_rad) + en_m[1] * math.cos(self.shear_to_rad)
        share = max(0.0, 1.0 + self.shear_per_km * there_m / _KM)
        return east * share, north * share


class Gusty:
    """Another wind with gusts: its strength times a factor whose mean is 1 and that wanders as AR(1) does.

    ``spread`` is the standard deviation of the factor's logarithm, ``tau_s`` its correlation time.
    """

    def __init__(self, base: WindModel, *, spread: float, tau_s: float, seed: int) -> None:
        self.base, self._spread = base, spread
        self._process = Process(1.0 / tau_s, 0.1, seed, 2, from_mean=False)

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at ``t_s``."""
        twd, tws = self.base.at(t_s)
        return twd, tws * math.exp(self._spread * self._process.at(t_s) - 0.5 * self._spread**2)


class ForecastWind(Protocol):
    """A wind that knows each place by a forecast."""

    def elsewhere(self, t_s: float, en_m: Place, home: tuple[float, float]) -> tuple[float, float]:
        """Return the wind of a place, where that of home is (from [rad], speed [m/s])."""

    def stream_at(self, t_s: float, en_m: Place) -> Place:
        """Return the stream of a place, east and north [m/s]."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Waters:
    """Wind and stream by place and time.

    A forecast beneath the wind says both for each place; the rest is over it.

    Attributes:
        wind: at the frame's origin, far from any island; of a forecast at home.
        lees: the islands.
        stronger_per_km: the wind is stronger by this share for each km ...
        stronger_to_rad: ... in this direction ...
        bends_rad_per_km: ... and veers by so much there (positive: clockwise).
        stream: of the water.
        home_en_m: from which places are counted, in the frame of the islands.
        forecast: what is beneath the wind, and varies over the water; None: nothing does but what is said here.
    """

    wind: WindModel
    lees: Sequence[Lee] = ()
    stronger_per_km: float = 0.0
    stronger_to_rad: float = 0.0
    bends_rad_per_km: float = 0.0
    stream: CurrentModel = field(default_factory=CurrentModel)
    home_en_m: Place = (0.0, 0.0)
    forecast: ForecastWind | None = None

    def wind_at(self, t_s: float, en_m: Place) -> tuple[float, float]:
        """Return (direction it comes from [rad, 0..2π), speed [m/s]) at a time and a place."""
        twd, tws = self.wind.at(t_s)
        here = en_m[0] + self.home_en_m[0], en_m[1] + self.home_en_m[1]
        if self.forecast is not None:
            twd, tws = self.forecast.elsewhere(t_s, here, (twd, tws))
        there_km = (here[0] * math.sin(self.stronger_to_rad) + here[1] * math.cos(self.stronger_to_rad)) / _KM
        share = min(max(1.0 + self.stronger_per_km * there_km, LEAST_SHARE), MOST_SHARE)
        for lee in self.lees:
            share *= lee.share(here, twd)
        return wrap_two_pi(twd + self.bends_rad_per_km * there_km), tws * share

    def stream_at(self, t_s: float, en_m: Place) -> Place:
        """Return the stream at a time and a place, east and north [m/s]."""
        here = en_m[0] + self.home_en_m[0], en_m[1] + self.home_en_m[1]
        east, north = self.stream.at(t_s, here)
        if self.forecast is not None:
            flows = self.forecast.stream_at(t_s, here)
            east, north = east + flows[0], north + flows[1]
        return east, north
