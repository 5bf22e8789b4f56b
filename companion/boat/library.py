"""The polars that come with the program: constant, AVALON's polynomial, ArduRover's simulated sailboat."""

from __future__ import annotations

import csv
import math
from importlib.resources import files

import numpy as np

from companion.boat.polar import Polar
from companion.geo.units import MPS_PER_KNOT

# [1], eq. 4.1: boat speed per wind speed against the true wind angle in RADIANS; both speeds in knots.
AVALON_COEFFICIENTS = (-0.0048, 0.0335, -0.2460, 0.7465, -0.01109)
AVALON_TESTED_KNOTS = 25.0  # "tested in conditions ranging from almost 0 to 25 knots": the last column


def constant(speed_mps: float) -> Polar:
    """Return a boat that sails at one speed at every angle in any wind (Wolsieffer 2020, section 3.2)."""
    return Polar(
        twa_rad=np.array([0.0, math.pi]), tws_mps=np.array([0.0]),
        speed_mps_table=np.full((2, 1), float(speed_mps)), name=f"constant {speed_mps:g} m/s",
    )


def avalon() -> Polar:
    """Return AVALON's polar ([1], eq. 4.1), sampled each degree; proportional to the wind up to 25 kn.

    The polynomial is slightly negative head to wind; there the boat stands still.

    References:
        [1] G.-A. Büsser, Design and Implementation of a Navigation Algorithm for an Autonomous Sailboat, 2009.

    >>> round(avalon().speed_mps(math.radians(90.0), 10.0 * MPS_PER_KNOT) / MPS_PER_KNOT, 2)
    6.56
    """
    twa = np.radians(np.arange(181.0))
    per_wind = np.clip(np.polyval(AVALON_COEFFICIENTS, twa), 0.0, None)
    tws = AVALON_TESTED_KNOTS * MPS_PER_KNOT
    table = np.column_stack([np.zeros_like(twa), per_wind * tws])
    return Polar(twa_rad=twa, tws_mps=np.array([0.0, tws]), speed_mps_table=table, name="AVALON")


def ardurover_sitl() -> Polar:
    """Return the measured polar of ArduRover SITL's sailboat (4.7-dev, heading held, automatic trim).

    Measured at 3, 6 and 12 m/s; the boat drifts astern head to wind, which counts as no speed.
    """
    text = files("companion.boat").joinpath("data/ardurover_sitl.csv").read_text(encoding="utf-8")
    reader = csv.DictReader(text.splitlines())
    rows = [(float(row["twa_deg"]), float(row["tws_mps"]), float(row["speed_mps"])) for row in reader]
    twa = sorted({row[0] for row in rows})
    tws = sorted({row[1] for row in rows})
    by_place = {(row[0], row[1]): max(0.0, row[2]) for row in rows}
    table = np.array([[by_place[a, w] for w in tws] for a in twa])
    return Polar(twa_rad=np.radians(np.array(twa)), tws_mps=np.array(tws), speed_mps_table=table, name="ArduRover SITL")
