"""The hull on the water: its outline about the place that the position is of."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.boat.boat import Hull


def outline_en_m(hull: Hull, en_m: ArrayLike, heading_rad: ArrayLike) -> NDArray[np.float64]:
    """Return the closed outline of the hull at each place (n, 5, 2) [m]: the rectangle that holds it.

    The position is amidships.

    Args:
        hull: Length and beam.
        en_m: Places (n, 2), east north.
        heading_rad: Headings (n,).

    >>> outline_en_m(Hull(length_m=4.0, beam_m=2.0), [(10.0, 0.0)], [0.0])[0, 0].round(9).tolist()
    [11.0, 2.0]

    """
    places = np.asarray(en_m, dtype=np.float64).reshape(-1, 1, 2)
    heading = np.asarray(heading_rad, dtype=np.float64).reshape(-1, 1)
    ahead = 0.5 * hull.length_m * np.array([1.0, -1.0, -1.0, 1.0, 1.0])
    aside = 0.5 * hull.beam_m * np.array([1.0, 1.0, -1.0, -1.0, 1.0])
    sin, cos = np.sin(heading), np.cos(heading)
    return np.asarray(places + np.stack([ahead * sin + aside * cos, ahead * cos - aside * sin], axis=-1))

