"""Boats as physics: VAIMOS, a seven-state sailboat, with its sensors; a motorboat with two motors.

State: x east, y north [m], heading [rad, clockwise], sail angle, rudder angle [rad], speed through the water along
the keel [m/s], turn rate [rad/s]. Their equations (A simple controller for line following of sailboats, IRSC 2012;
p1..p11 as in J. Melin's VAIMOS-sized set, 2015):

    x' = v cos + p1 a cos(psi),  y' likewise              leeway: drift with the wind
    v' = (fs sin(ds) - p11 fr sin(dr) - p2 v|v|) / p9
    w' = (fs (p6 - p7 cos(ds)) - p8 fr cos(dr) - p3 w |v|) / p10
    fs = p4 a_ap sin(ds - psi_ap),  fr = p5 v sin(dr)

The forces are a fifth of the published set's (``share``). With all of them a sail pushes 300 kg with 600 N at 6 m/s of
wind, five times what a sail of 6 m² can (half rho v² A = 132 N), and the boat makes 2 m/s within 2 s; Jaulin and Le
Bars' own set (p4 = 1000, p2 = 1) is wilder still. Sail, rudder, friction and damping are scaled alike, so speeds and
turning circles stay what they were, and inertia is that of a boat.

Four things are ours. The printed equations have nothing that moves or turns a boat without way: a hull windage (a
force along the keel, so that a boat in irons gathers sternway), friction that opposes motion in both directions,
and a turn damping that does not vanish at v = 0. And they have no hull speed: friction grows by 1 + (v / hull)^4,
2.4 m/s for a waterline of 3.65 m. The sail swings and the rudder turns at a finite rate.

Head to wind the sail gives no force and the rudder none without way: the boat is in irons until sternway and a
reversed rudder, or a wind shift, get it out.

One second at a time: measure, decide, sail. The guidance sees a position with noise, and a wind that is a mean of
what a vane with noise said, never the truth.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar
from companion.field.values import GuidanceSettings, MovingObstacle, Situation
from companion.geo.angles import wrap_pi, wrap_two_pi
from companion.kernels.jit import kernel
from sitl.world.environment import AR1, WindModel

STEP_S = 0.05


@dataclass(frozen=True, slots=True, kw_only=True)
class VaimosParameters:
    """The eleven parameters, and ours. Units as in the module's equations; ``share`` 1 is the published set."""

    p1: float = 0.03  # drift, share of the wind speed
    p2: float = 40.0  # tangential friction [kg/m]
    p3: float = 6000.0  # angular friction [kg m]
    p4: float = 200.0  # sail lift [kg/s]
    p5: float = 1500.0  # rudder lift [kg/s]
    p6: float = 0.5  # distance to the sail's centre of effort [m]
    p7: float = 0.5  # distance to the mast [m]
    p8: float = 2.0  # distance to the rudder [m]
    p9: float = 300.0  # mass [kg]
    p10: float = 400.0  # moment of inertia [kg m²]
    p11: float = 0.2  # rudder break coefficient
    share: float = 0.2  # of p2 to p5 and of the damping
    windage: float = 0.1  # hull and rig along the keel, per apparent wind squared [kg/m]: 0.16 m², flagging sail
    damping: float = 400.0  # turn damping at rest [kg m²/s]
    sail_rate: float = 0.8  # [rad/s]
    rudder_rate: float = 0.8  # [rad/s]
    hull_mps: float = 2.4  # hull speed [m/s]; math.inf for the printed equations

    def array(self) -> NDArray[np.float64]:
        """Return the kernel's parameter vector."""
        return np.array(
            [
                self.p1,
                *(self.share * p for p in (self.p2, self.p3, self.p4, self.p5)),
                self.p6,
                self.p7,
                self.p8,
                self.p9,
                self.p10,
                self.p11,
                self.windage,
                self.share * self.damping,
                self.sail_rate,
                self.rudder_rate,
                self.hull_mps,
            ]
        )


def state_at(east_m: float, north_m: float, heading_rad: float, speed_mps: float = 0.0) -> NDArray[np.float64]:
    """Return a boat at a place, sail and rudder amidships."""
    return np.array([east_m, north_m, heading_rad, 0.0, 0.0, speed_mps, 0.0])


@kernel
def sail_heading(
    state: NDArray[np.float64],
    p: NDArray[np.float64],
    wanted_rad: float,
    twd_from_rad: float,
    tws_mps: float,
    seconds: float,
    step_s: float,
    thrust: float = 1.0,
) -> NDArray[np.float64]:
    """Return the state after ``seconds`` of steering ``wanted_rad`` by rudder, the sail trimmed for the true heading.

    Rudder: proportional to the sine, hard over beyond 90 degrees, against the turn rate. Sheet: line 9 of the
    controller for the heading sailed, let out towards flagging as ``thrust`` goes from 1 to 0 (ArduRover's GUIDED
    thrust eases the sail likewise). This stands for the autopilot.
    """
    s = state.copy()
    for _ in range(round(seconds / step_s)):
        off = wanted_rad - s[2]
        if math.cos(off) >= 0.0:
            rudder = 0.785 * math.sin(off)
        else:
            rudder = math.copysign(0.785, math.sin(off))
        rudder = min(0.785, max(-0.785, rudder - 0.8 * s[6]))
        sheet = 0.25 * math.pi * (1.0 - math.cos(s[2] - twd_from_rad))
        sheet += (1.0 - thrust) * (0.5 * math.pi - sheet)
        _advance(s, p, rudder, sheet, twd_from_rad, tws_mps, step_s)
    return s


@kernel
def step(
    state: NDArray[np.float64],
    p: NDArray[np.float64],
    rudder_rad: float,
    sheet_rad: float,
    twd_from_rad: float,
    tws_mps: float,
    step_s: float,
) -> NDArray[np.float64]:
    """Return the state after one step under a rudder and a sheet command."""
    s = state.copy()
    _advance(s, p, rudder_rad, sheet_rad, twd_from_rad, tws_mps, step_s)
    return s


@kernel
def _advance(s, p, rudder_rad, sheet_rad, twd_from_rad, tws_mps, h):  # type: ignore[no-untyped-def]  # noqa: ANN001, ANN202
    heading, sail, rudder, v, w = s[2], s[3], s[4], s[5], s[6]
    # The wind's motion over the water, ahead and to starboard of the boat, and what the boat feels of it.
    to = twd_from_rad + math.pi
    ahead = tws_mps * math.cos(to - heading) - v
    right = tws_mps * math.sin(to - heading)
    apparent = math.hypot(ahead, right)
    angle = math.atan2(right, ahead)
    # The sail lies to leeward as far as the sheet lets it, or flags.
    if math.cos(angle) + math.cos(sheet_rad) <= 0.0:
        target = math.pi + angle
        if target > math.pi:
            target -= 2.0 * math.pi
    else:
        target = -sheet_rad if math.sin(angle) > 0.0 else sheet_rad
    move = p[13] * h
    sail += min(move, max(-move, target - sail))
    move = p[14] * h
    rudder += min(move, max(-move, rudder_rad - rudder))
    fs = p[3] * apparent * math.sin(sail - angle)
    # fr turns the bow to port in their frame for a positive angle; ours is positive to starboard.
    fr = p[4] * v * math.sin(-rudder)
    push = fs * math.sin(sail) - p[10] * fr * math.sin(-rudder)
    push += p[11] * ahead * apparent
    turn = fs * (p[5] - p[6] * math.cos(sail)) - p[7] * fr * math.cos(rudder)
    # The damping is stiff (40 /s at 2.7 m/s): implicit in w, semi-implicit in v.
    w = (w + h * turn / p[9]) / (1.0 + h * (p[2] * abs(v) + p[12]) / p[9])
    v = (v + h * push / p[8]) / (1.0 + h * p[1] * abs(v) * (1.0 + (v / p[15]) ** 4) / p[8])
    heading += h * w
    if heading > math.pi:
        heading -= 2.0 * math.pi
    elif heading < -math.pi:
        heading += 2.0 * math.pi
    drift = p[0] * tws_mps
    s[0] += h * (v * math.sin(heading) + drift * math.sin(to))
    s[1] += h * (v * math.cos(heading) + drift * math.cos(to))
    s[2], s[3], s[4], s[5], s[6] = heading, sail, rudder, v, w


@lru_cache(maxsize=4)
def polar(parameters: VaimosParameters | None = None) -> Polar:
    """Return the speeds through the water, found by sailing the model: means of two minutes, 0 where it falls off."""
    p = (parameters or VaimosParameters()).array()
    twa = np.radians(np.arange(0.0, 181.0, 5.0))
    tws = np.array([2.0, 3.0, 4.5, 6.0, 8.0, 10.0, 13.0])
    table = np.zeros((len(twa), len(tws)))
    for i, a in enumerate(twa):
        for j, u in enumerate(tws):
            boat, speeds, held = state_at(0.0, 0.0, float(a), 0.5), [], True
            for n in range(24):
                boat = sail_heading(boat, p, float(a), 0.0, float(u), 10.0, STEP_S)
                held = held and abs(math.remainder(float(boat[2]) - float(a), 2.0 * math.pi)) < math.radians(10.0)
                if n >= 12:
                    speeds.append(float(boat[5]))
            table[i, j] = max(0.0, sum(speeds) / len(speeds)) if held else 0.0
    return Polar(twa_rad=twa, tws_mps=tws, speed_mps_table=table, name="VAIMOS model")


LENGTH_M = 3.65
GPS_SD_M = 0.7
VANE_SD_RAD = math.radians(4.0)
WIND_MEAN_S = 8.0
_PARAMETERS = VaimosParameters().array()
_POLARS: dict[int, tuple[tuple[float, ...], tuple[float, ...]]] = {}


def polar_at(tws_mps: float) -> tuple[tuple[float, ...], tuple[float, ...]]:
    """Return (|TWA| nodes, speeds) of the VAIMOS model in this wind, in steps of 0.1 m/s."""
    key = round(10.0 * max(0.5, tws_mps))
    if key not in _POLARS:
        twa, speed = polar().curve(key / 10.0)
        _POLARS[key] = (tuple(map(float, twa)), tuple(map(float, speed)))
    return _POLARS[key]


def habits_for(tws_mps: float, **changes: float | bool) -> GuidanceSettings:
    """Return what VAIMOS can do in this wind: the boat's polar, slow tacks, leeway of 3 % of the wind."""
    twa, speed = polar_at(tws_mps)
    base: dict[str, float | bool] = {
        "turn_rate_radps": math.radians(11.0),
        "tack_s": 7.0,
        "tack_min_mps": 0.5,
        "lag_s": 6.0,
        "leeway_share": 0.03,
        "no_go_half_rad": math.radians(47.0),
    }
    base.update(changes)
    return GuidanceSettings(polar_twa_rad=twa, polar_mps=speed, **base)  # type: ignore[arg-type]


def wind_for(twd_from_rad: float, tws_mps: float, seed: int) -> AR1:
    """Return the weather of a run: 9 degrees about the mean with 28 s of correlation, 10 % of speed."""
    return AR1(twd_from_rad, tws_mps, seed=seed, sd_rad=math.radians(9.0), tws_sd_mps=0.1 * tws_mps, step_s=0.5)


@dataclass(slots=True)
class SimulatedVaimos:
    """The boat, its wind and its sensors; ``track`` grows by a row (t, east, north, heading, speed) each second."""

    wind: WindModel
    rng: np.random.Generator
    state: NDArray[np.float64]
    t_s: float = 0.0
    track: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    _wind_mean: tuple[float, float, float] | None = None
    _velocity: tuple[float, float] = (0.0, 0.0)

    @classmethod
    def launch(
        cls, wind: WindModel, rng: np.random.Generator, en_m: tuple[float, float], heading_rad: float
    ) -> SimulatedVaimos:
        """Return a boat at a place, under way at half a metre a second."""
        return cls(wind=wind, rng=rng, state=state_at(en_m[0], en_m[1], wrap_pi(heading_rad), 0.5))

    @property
    def en_m(self) -> tuple[float, float]:
        """True position."""
        return float(self.state[0]), float(self.state[1])

    @property
    def velocity_en_mps(self) -> tuple[float, float]:
        """Velocity over ground in the last second."""
        return self._velocity

    def sense(self, obstacles: tuple[MovingObstacle, ...] = ()) -> Situation:
        """Return what is measured now."""
        twd, tws = self.wind.at(self.t_s)
        measured = twd + float(self.rng.normal(0.0, VANE_SD_RAD))
        vector = (math.sin(measured), math.cos(measured), tws)
        keep = math.exp(-1.0 / WIND_MEAN_S) if self._wind_mean is not None else 0.0
        old = self._wind_mean or vector
        self._wind_mean = tuple(keep * a + (1.0 - keep) * b for a, b in zip(old, vector, strict=True))  # type: ignore[assignment]
        mean = self._wind_mean
        assert mean is not None
        noise = self.rng.normal(0.0, GPS_SD_M, 2)
        return Situation(
            t_s=self.t_s,
            en_m=(float(self.state[0] + noise[0]), float(self.state[1] + noise[1])),
            velocity_en_mps=self._velocity,
            heading_rad=wrap_pi(float(self.state[2])),
            twd_from_rad=wrap_two_pi(math.atan2(mean[0], mean[1])),
            tws_mps=mean[2],
            obstacles=obstacles,
        )

    def sail(self, heading_rad: float, thrust: float = 1.0) -> None:
        """Steer ``heading_rad`` for a second."""
        twd, tws = self.wind.at(self.t_s)
        before = self.en_m
        self.state = sail_heading(self.state, _PARAMETERS, wrap_pi(heading_rad), twd, tws, 1.0, STEP_S, thrust)
        after = self.en_m
        self._velocity = (after[0] - before[0], after[1] - before[1])
        self.t_s += 1.0
        self.track.append((self.t_s, after[0], after[1], float(self.state[2]), float(self.state[5])))

    def positions(self) -> NDArray[np.float64]:
        """Return the track as an (n, 5) array."""
        return np.asarray(self.track, dtype=np.float64).reshape(-1, 5)


def summary(values: Mapping[str, list[float]]) -> dict[str, dict[str, float]]:
    """Return median, 5 % and 95 % and extremes of each list."""
    out = {}
    for name, numbers in values.items():
        a = np.asarray(numbers, dtype=np.float64)
        a = a[np.isfinite(a)]
        if a.size:
            q = np.quantile(a, [0.0, 0.05, 0.5, 0.95, 1.0])
            out[name] = dict(zip(("min", "p05", "median", "p95", "max"), map(float, q), strict=True))
    return out
