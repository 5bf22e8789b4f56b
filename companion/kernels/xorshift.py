"""The random numbers of the compiled searches: the same on every machine for the same seed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from companion.kernels.jit import kernel


@kernel
def uniform(state: NDArray[np.uint64]) -> float:
    """Return the next number on [0, 1) of a xorshift generator whose state is ``state[0]``."""
    x = state[0]
    x ^= x >> np.uint64(12)
    x ^= x << np.uint64(25)
    x ^= x >> np.uint64(27)
    state[0] = x
    return float((x * np.uint64(2685821657736338717)) >> np.uint64(11)) / 9007199254740992.0
