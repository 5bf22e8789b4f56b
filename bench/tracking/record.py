"""Sailing a trial: on the real ArduRover or on the simulated autopilot, in AUTO; the track that was sailed."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable, Mapping

import numpy as np
from numpy.typing import NDArray

from bench.tracking.trials import SPREAD_TAU_S, Trial
from companion.clock import now_s, run, run_virtual
from companion.errors import JobError, LinkError
from companion.geo.frame import LocalFrame
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices import TransferOutcome
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.transports import open_link
from companion.messages import Command, Mode, waypoint
from sitl.ardurover import ArduRover, require
from sitl.autopilot import HOME, AutopilotConfig, Departures, MemoryLink, SimulatedAutopilot, serve
from sitl.autopilot import Truth as Now
from sitl.world import WindModel
from sitl.world.environment import AR1, Constant

EVERY_S = 0.2
PATIENCE_S = 150.0  # without a waypoint, and the time of the longest leg
SLOWEST_MPS = 0.15
IDENTITY = LinkIdentity(system=255, component=190)

Track = NDArray[np.float64]
"""(n, 5): time [s], east, north [m] from where she lay, the item sailed to (from 1), the wind's direction [rad]."""


class Risen:
    """A calm until it is let go, then the trial's wind."""

    def __init__(self, wind: WindModel) -> None:
        self._wind, self.is_released = wind, False

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind at ``t_s``."""
        twd, tws = self._wind.at(t_s)
        return twd, tws if self.is_released else 0.0


def _wind(trial: Trial) -> Risen:
    if trial.spread_rad <= 0.0:
        return Risen(Constant(0.0, trial.tws_mps))
    return Risen(AR1(0.0, trial.tws_mps, seed=trial.seed, sd_rad=trial.spread_rad, rho_hz=1.0 / SPREAD_TAU_S))


def _parameters(trial: Trial) -> dict[str, float]:
    return {"WP_RADIUS": trial.wp_radius_m, "SAIL_XTRACK_MAX": trial.corridor_m}


def sail_ardurover(trial: Trial, speedup: float) -> Track:
    """Sail a trial on the real ArduRover.

    Raises:
        JobError: it does not run, does not take the mission, or does not sail it.

    """

    async def voyage() -> Track:
        wind = _wind(trial)
        async with (
            ArduRover(
                require(), HOME, wind, heading_rad=trial.first_rad, speedup=speedup, parameters=_parameters(trial)
            ) as rover,
            Link(open_link(rover.link), identity=IDENTITY, streams=()) as link,
            Autopilot(link, timeout_s=30.0 * speedup) as pilot,
        ):
            rover.set_current(trial.set_rad, trial.drift_mps)
            return await _sail(trial, pilot, wind, lambda: rover.truth)

    return run(voyage(), speedup=speedup)


def sail_simulated(
    trial: Trial, parameters: Mapping[str, float] | None = None, departures: Departures | None = None
) -> Track:
    """Sail a trial on the simulated autopilot, with ``parameters`` beside the trial's own."""

    async def voyage() -> Track:
        wind = _wind(trial)
        autopilot = SimulatedAutopilot(
            AutopilotConfig(
                home=HOME,
                heading_rad=trial.first_rad,
                is_warm=True,
                is_moored=True,
                parameters={**_parameters(trial), **(parameters or {})},
                departures=departures,
            ),
            wind,
            seed=trial.seed,
        )
        autopilot.set_current(trial.set_rad, trial.drift_mps)
        wires = MemoryLink("shore", seed=trial.seed)
        async with (
            serve(autopilot, [wires.far]),
            Link(wires.near, identity=IDENTITY, streams=()) as link,
            Autopilot(link) as pilot,
        ):
            return await _sail(trial, pilot, wind, lambda: autopilot.truth)

    return run_virtual(voyage())


async def _sail(trial: Trial, pilot: Autopilot, wind: Risen, now: Callable[[], Now]) -> Track:
    frame = LocalFrame(HOME)
    points = [waypoint(frame.geo_from_en(*p)) for p in trial.points_en_m]
    loiter = waypoint(frame.geo_from_en(*trial.points_en_m[-1]), command=Command.NAV_LOITER_UNLIM)
    done = await pilot.upload_mission([*points, loiter])
    if done.outcome is not TransferOutcome.OK:
        raise JobError(f"{trial.name}: the mission was not taken: {done.text}")
    for _ in range(30):
        await pilot.arm()
        await pilot.set_mode(Mode.AUTO)
        if _look(now) is not None and now().is_armed and now().mode is Mode.AUTO:
            break
        await asyncio.sleep(1.0)
    wind.is_released = True
    rows: list[tuple[float, ...]] = []
    legs = [math.dist(a, b) for a, b in zip([(0.0, 0.0), *trial.points_en_m], trial.points_en_m, strict=False)]
    seq, since_s = 0, now_s()
    while now_s() - since_s < PATIENCE_S + 2.5 * max(legs) / SLOWEST_MPS:
        look = _look(now)
        if look is not None:
            rows.append((look.t_s, look.east_m, look.north_m, look.mission_seq, look.twd_from_rad))
            if look.mission_seq > len(points):
                break
            if look.mission_seq != seq:
                seq, since_s = look.mission_seq, now_s()
        await asyncio.sleep(EVERY_S)
    track = np.asarray(rows)
    if len(track) < 10:
        raise JobError(f"{trial.name}: it never sailed")
    moved = np.concatenate([[True], np.any(np.diff(track[:, 1:3], axis=0) != 0.0, axis=1)])
    return track[moved]


def _look(now: Callable[[], Now]) -> Now | None:
    try:
        return now()
    except LinkError:
        return None
