"""Numbers sorted, each once."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray


def distinct(values: ArrayLike) -> NDArray[np.float64]:
    """Return the values of an array of any shape, none of them NaN, sorted and each once: (n,).

    As numpy's ``unique``, which loads numpy's masked arrays to ask whether these are such: a megabyte for ever, in the
    companion and in its planner.

    >>> distinct([[2.0, 1.0], [2.0, 0.5]]).tolist()
    [0.5, 1.0, 2.0]
    """
    found = np.sort(np.asarray(values, dtype=np.float64), axis=None)
    return found[np.concatenate([[True], found[1:] != found[:-1]])] if found.size else found
