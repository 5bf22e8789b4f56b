"""What a boat can do on a passage: the hull of her speeds over every wind, for mean courses over hours.

Over hours a beat is a mean velocity: any mixture of courses is one in the convex hull of the polar's, and what the
tacks of a mixture cost is a share of its time, the loss of one over the time of a board. Zero belongs to it: she may
heave to.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.boat import Boat
from companion.passage.kernels import Craft

Floats = NDArray[np.float64]
TWS_STEP_MPS = 0.25
MOST_TWS_MPS = 60.0
_ANGLES = 360  # of the polar, round
_RADIAL = 361  # from upwind to downwind, half a degree each
_STILL_MPS = 1e-3  # a hull without an inside has no normals
_MIXED_RAD = math.radians(3.0)  # a side of the hull that spans more mixes two courses


def craft_of(
    boat: Boat,
    *,
    board_m: float = 20_000.0,
    night_share: float = 1.0,
    max_wave_m: float = math.inf,
    lee_tws_mps: float = math.inf,
) -> Craft:
    """Return the hulls of a boat's courses through the water, leeway and all; beyond its last column it is as in it."""
    count = round(MOST_TWS_MPS / TWS_STEP_MPS) + 1
    last = math.ceil(min(float(boat.polar.tws_mps[-1]), MOST_TWS_MPS) / TWS_STEP_MPS)
    still = _STILL_MPS * np.stack([np.cos(twa_of_8 := np.arange(8) * math.pi / 4.0), np.sin(twa_of_8)], axis=-1)
    sides: list[tuple[Floats, Floats]] = []
    for k in range(min(last, count - 1) + 1):
        tws_mps = k * TWS_STEP_MPS
        twa = _courses(boat.made_good_rad(boat.no_go_half_rad, tws_mps), boat.max_twa_rad)
        speed = np.interp(np.abs(twa), *boat.curve(tws_mps))
        points = speed[:, None] * np.stack([np.cos(twa), np.sin(twa)], axis=-1)
        sides.append(_sides(np.concatenate([points, still]), boat.tack_loss_s / board_m))
    most = max(len(n) for n, _ in sides)
    normals = np.zeros((len(sides), most, 2))
    losses = np.zeros((len(sides), most))
    for k, (normal, loss) in enumerate(sides):
        normals[k, : len(normal)], losses[k, : len(normal)] = normal, loss
    angle = np.linspace(0.0, math.pi, _RADIAL)
    along = np.einsum("kid,da->kia", normals, np.stack([np.cos(angle), np.sin(angle)]))  # 0 where there is no side
    binding = along.argmax(axis=1)
    radial = 1.0 / np.take_along_axis(along, binding[:, None], axis=1)[:, 0]
    radial /= 1.0 + np.take_along_axis(losses, binding, axis=1)
    return Craft(
        radial=np.ascontiguousarray(radial),
        normals=normals,
        losses=losses,
        counts=np.array([len(normal) for normal, _ in sides]),
        tws_step_mps=TWS_STEP_MPS,
        max_tws_mps=math.inf if boat.max_tws_mps is None else boat.max_tws_mps,
        max_wave_m=max_wave_m,
        lee_tws_mps=lee_tws_mps,
        share=1.0,
        night_share=night_share,
    )


def _courses(least_rad: float, most_rad: float) -> Floats:
    """Return the angles to the wind that she may sail at, on both tacks [rad]."""
    twa = np.linspace(-math.pi, math.pi, _ANGLES + 1)[:-1]
    twa = np.unique(np.concatenate([twa, *(s * np.array([least_rad, most_rad]) for s in (-1.0, 1.0))]))
    return np.asarray(twa[(np.abs(twa) >= least_rad - 1e-12) & (np.abs(twa) <= most_rad + 1e-12)])


def _sides(points: Floats, loss_per_m: float) -> tuple[Floats, Floats]:
    """Return the hull's sides as (n, 2) normals, n·v <= 1 inside, and the share of time that tacks cost on each."""
    hull = _hull(points)
    after = np.roll(hull, -1, axis=0)
    along = after - hull
    normal = np.stack([along[:, 1], -along[:, 0]], axis=-1)
    offset = np.sum(normal * hull, axis=-1)
    spans = np.abs(np.angle((after[:, 0] + 1j * after[:, 1]) / (hull[:, 0] + 1j * hull[:, 1])))
    speed = np.hypot(*(0.5 * (hull + after)).T)
    loss = np.where(spans > _MIXED_RAD, loss_per_m * np.maximum(speed, np.hypot(*hull.T)), 0.0)
    return normal / offset[:, None], loss


def _hull(points: Floats) -> Floats:
    """Return the corners of the convex hull counter-clockwise (Andrew's monotone chain)."""
    ordered = points[np.lexsort((points[:, 1], points[:, 0]))].tolist()

    def chain(rows: list[list[float]]) -> list[list[float]]:
        out: list[list[float]] = []
        for p in rows:
            while len(out) > 1:
                a, b = out[-2], out[-1]
                if (b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 1e-12:
                    break
                out.pop()
            out.append(p)
        return out[:-1]

    return np.array(chain(ordered) + chain(ordered[::-1]))
