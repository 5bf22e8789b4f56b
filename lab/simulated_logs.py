"""Logs of simulated boats, to judge learning by: the truth is known, and the model is not the learner's.

A boat is sailed second by second; what spoils her log (a vane that widens, a compass that swings, a lag, a tow) is then
done to it.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.boat import BoatLog, Polar, Sizes
from companion.boat.boat import coefficient_of, leeway_at
from companion.boat.guess import guessed_polar

Floats = NDArray[np.float64]

SIZES = Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9)
TAU_S = 5.0  # she gathers way so
TIDE_S = 12.4 * 3600.0
TOWED_MPS = 2.5


@dataclass(frozen=True, slots=True, kw_only=True)
class Truth:
    """What the boat is that the learner does not know; angles in degrees, speeds in m/s."""

    scale: float = 1.0
    beat: float = 1.0  # of the polar, at 45 degrees; 1 at 90
    run: float = 1.0  # at 150
    leeway_deg: float = 0.0
    vane_deg: float = 0.0
    compass_deg: float = 0.0
    current_en_mps: tuple[float, float] = (0.0, 0.0)
    tack_s: float = 3.0
    tack_speed: float = 0.5  # what is left of the speed when she is through
    fails: float = 0.0
    lean: float = 0.0  # faster with the wind from starboard, close-hauled (logarithm)
    day_sd: float = 0.0  # of an outing's factor (logarithm): sea, growth
    tide_mps: float = 0.0  # of a stream that turns once in 12.4 h, beside the steady one
    waves: float = 0.0  # of the speed, come and gone within 20 s (deviation of the logarithm)
    vane_width_deg: float = 0.0  # to starboard with the wind from there, to port likewise
    vane_scale: float = 1.0  # what the vane tells of the wind's speed
    swing_deg: float = 0.0  # of the compass, round the circle
    lag_s: int = 0  # of the position's velocity behind the rest
    stuck_share: float = 0.0  # of the outing, at its end, the vane has stopped
    log_step: float | None = None  # she has a log, which tells so much less from the middle of the outing on
    towed_share: float = 0.0  # likewise, towed at 2.5 m/s wherever the wind is

    def speed_mps(self, polar: Polar, twa_rad: float, tws_mps: float) -> float:
        """Return how fast she really is."""
        shape = float(np.interp(abs(math.degrees(twa_rad)), [45.0, 90.0, 150.0], [self.beat, 1.0, self.run]))
        lean = math.exp(0.5 * self.lean * math.copysign(1.0 + math.cos(twa_rad), twa_rad))
        return self.scale * shape * lean * polar.speed_mps(twa_rad, tws_mps)


def _by_log(speed_mps: Floats, step: float | None) -> Floats:
    """Return what a log tells of the speed through the water; NaN: there is none."""
    if step is None:
        return np.full(speed_mps.shape, math.nan)
    half = np.arange(speed_mps.shape[0]) >= speed_mps.shape[0] // 2
    return np.asarray(speed_mps * np.where(half, 1.0 - step, 1.0))


def sailed(
    truth: Truth,
    *,
    hours: float,
    seed: int,
    tws_mps: float = 4.0,
    angles_deg: tuple[float, ...] = (46.0, -46.0, 46.0, -46.0, 90.0, -90.0, 150.0, -150.0, 120.0, -120.0, 65.0, -65.0),
    leg_s: float = 120.0,
    t0_s: float = 1.75e9,
    name: str = "sailed",
) -> BoatLog:
    """Return the log of an outing: legs of ``leg_s`` at these angles, by the vane as it is, in a wandering wind."""
    rng = np.random.default_rng(seed)
    polar = guessed_polar(SIZES)
    n = int(hours * 3600.0)
    k = coefficient_of(math.radians(truth.leeway_deg))
    day = math.exp(truth.day_sd * rng.standard_normal()) if truth.day_sd else 1.0
    phase = rng.uniform(0.0, 2.0 * math.pi) if truth.tide_mps else 0.0
    shift = gust = wave = 0.0
    bow, speed, place = 0.0, 0.0, np.zeros(2)
    irons_until, last = -1.0, 1.0
    rows = np.zeros((n, 9))
    for i in range(n):
        shift += -shift / 300.0 + math.radians(6.0) * math.sqrt(2.0 / 300.0) * rng.standard_normal()
        gust += -gust / 60.0 + 0.10 * math.sqrt(2.0 / 60.0) * rng.standard_normal()
        twd, tws = shift, tws_mps * math.exp(gust)
        wanted = math.radians(angles_deg[int(i / leg_s) % len(angles_deg)])
        target = twd - wanted  # bow so that the wind is at ``wanted`` to starboard
        off = (target - bow + math.pi) % (2.0 * math.pi) - math.pi
        rate = 0.5 * math.pi / truth.tack_s
        turn = float(np.clip(off + math.radians(1.5) * rng.standard_normal(), -rate, rate))
        if i < irons_until:
            turn = 0.0
        bow += turn
        twa = (twd - bow + math.pi) % (2.0 * math.pi) - math.pi
        if twa * last < 0.0 and abs(twa) < 1.0:
            if truth.fails and rng.random() < truth.fails:
                bow, twa, irons_until = twd - 0.15 * last, 0.15 * last, i + 10.0
            else:
                speed *= truth.tack_speed
        last = math.copysign(1.0, twa)
        if truth.waves:
            wave += -wave / 20.0 + truth.waves * math.sqrt(2.0 / 20.0) * rng.standard_normal()
        aim = day * truth.speed_mps(polar, twa, tws) * math.exp(wave)
        speed += (aim * math.exp(0.03 * rng.standard_normal()) - speed) / TAU_S
        slip = math.copysign(float(leeway_at(k, twa, tws, max(speed, 0.1))), -twa)
        over = speed / math.cos(slip) * np.array([math.sin(bow + slip), math.cos(bow + slip)])
        if i >= (1.0 - truth.towed_share) * n:
            over = TOWED_MPS * np.array([math.sin(bow), math.cos(bow)])
        tide = phase + 2.0 * math.pi * i / TIDE_S
        ground = over + np.array(truth.current_en_mps) + truth.tide_mps * np.array([math.sin(tide), math.cos(tide)])
        place = place + ground
        # the air moves with the ground's wind less the stream: ``tws`` is over the water, as the polar's
        felt = tws * np.array([math.sin(twd), math.cos(twd)]) + over
        aws, awd = float(np.hypot(*felt)), math.atan2(felt[0], felt[1])
        rows[i] = (
            t0_s + i,
            *(ground + 0.03 * rng.standard_normal(2)),
            bow + math.radians(truth.compass_deg + rng.standard_normal()),
            awd - bow + math.radians(truth.vane_deg + 2.0 * rng.standard_normal()),
            aws * (1.0 + 0.03 * rng.standard_normal()),
            *place,
            speed,
        )
    starboard = np.sign(np.sin(rows[:, 4]))
    rows[:, 4] += math.radians(truth.vane_width_deg) * starboard
    rows[:, 3] += math.radians(truth.swing_deg) * np.sin(rows[:, 3])
    rows[:, 5] *= truth.vane_scale
    rows[truth.lag_s :, 1:3] = rows[: n - truth.lag_s, 1:3].copy()
    stuck = int((1.0 - truth.stuck_share) * n)
    rows[stuck:, 4] = rows[min(stuck, n - 1), 4]
    return BoatLog(
        name=name,
        t_s=rows[:, 0],
        velocity_en_mps=rows[:, 1:3],
        heading_rad=rows[:, 3],
        awa_rad=(rows[:, 4] + math.pi) % (2.0 * math.pi) - math.pi,
        aws_mps=rows[:, 5],
        position_en_m=rows[:, 6:8],
        stw_mps=_by_log(rows[:, 8], truth.log_step),
        is_sailed=np.ones(n, dtype=np.bool_),
        has_motor_on=np.zeros(n, dtype=np.bool_),
    )
