"""What the simulated boat can do, tried out on it: its speed at every angle, what a tack costs."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from companion.boat import Polar
from companion.kernels.jit import kernel
from sitl.autopilot.boat.kernel import S_TACKS, S_V, S_YAW, clip, sail_force
from sitl.autopilot.boat.parameters import Parameters
from sitl.autopilot.boat.vehicle import LOOP_S, Vehicle
from sitl.world import Constant

Floats = NDArray[np.float64]
WINDS_MPS = np.arange(0.5, 20.25, 0.25)
TRIED_S, TACKED_S = 120.0, (40.0, 60.0, 80.0)


def no_go_half_rad(parameters: Mapping[str, float]) -> float:
    """Return how near to the wind the autopilot sails, whatever the mission plans by."""
    return math.radians(Parameters(parameters).get("SAIL_NO_GO_ANGLE"))


def settled_polar(parameters: Mapping[str, float]) -> Polar:
    """Return what SIM_Sailboat's hull settles at, sheeted as the autopilot does it, by whole degrees."""
    told = Parameters(parameters)
    ideal, least, most = (math.radians(told.get(f"SAIL_ANGLE_{name}")) for name in ("IDEAL", "MIN", "MAX"))
    angles = np.radians(np.arange(181.0))
    return Polar(
        twa_rad=angles,
        tws_mps=WINDS_MPS,
        name="SIM_Sailboat, settled",
        speed_mps_table=_settled_mps(angles, WINDS_MPS, ideal, least, most),
    )


@kernel
def _settled_mps(twa_rad: Floats, tws_mps: Floats, ideal_rad: float, least_rad: float, most_rad: float) -> Floats:
    """Return (angles, winds) the speed at which sail and drag are even, by bisection; 0 where it drifts astern."""
    out = np.zeros((twa_rad.shape[0], tws_mps.shape[0]))
    for i in range(twa_rad.shape[0]):
        for j in range(tws_mps.shape[0]):
            low, high = 0.0, 3.0 * tws_mps[j]
            for _ in range(40):
                v = 0.5 * (low + high)
                across, ahead = tws_mps[j] * math.sin(twa_rad[i]), tws_mps[j] * math.cos(twa_rad[i]) + v
                awa = abs(math.atan2(across, ahead))
                force = sail_force(math.hypot(across, ahead), awa, clip(awa - ideal_rad, least_rad, most_rad))
                low, high = (v, high) if force > 0.5 * v * v else (low, v)
            out[i, j] = low
    return out


def tack_loss_s(parameters: Mapping[str, float], polar: Polar | None, tws_mps: float) -> float:
    """Return what each tack of a beat costs, in time made good to windward [s]: the simulated boat tries it."""
    tacked, tacks, _ = _beaten(parameters, polar, tws_mps, TACKED_S)
    straight, _, made_good_mps = _beaten(parameters, polar, tws_mps, ())
    return max(0.0, (straight - tacked) / (made_good_mps * tacks))


def _beaten(
    parameters: Mapping[str, float], polar: Polar | None, tws_mps: float, tacks_s: tuple[float, ...]
) -> tuple[float, float, float]:
    """Return (way made to windward [m] in ``TRIED_S``, tacks, speed made good [m/s]), tacking at these times."""
    vehicle = Vehicle(
        Constant(0.0, tws_mps),
        Parameters({**parameters, "SAIL_XTRACK_MAX": 0.0}),
        polar=polar,
        heading_rad=math.radians(60.0),
        is_moored=False,
        seed=0,
    )
    vehicle.set_armed(armed=True)
    vehicle.sail_leg((0.0, 0.0), (0.0, 1e4), None, is_corner=False, goes_on=False)
    for until_s in (*tacks_s, TRIED_S):
        loops = round((until_s - vehicle.t_s) / LOOP_S)
        while loops > 0:
            loops -= vehicle.advance(loops)[0]
        vehicle.ask_tack()
    s = vehicle.state
    return vehicle.true_position[1], float(s[S_TACKS]), float(s[S_V] * math.cos(s[S_YAW]))
