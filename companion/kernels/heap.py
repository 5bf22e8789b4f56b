"""A binary heap over two arrays, for the compiled searches: keys to be least first, and what they belong to."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from companion.kernels.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@kernel
def sift_up(keys: Floats, items: Ints, i: int) -> None:
    """Restore the heap after its item ``i`` was put there."""
    key, item = keys[i], items[i]
    while i > 0:
        p = (i - 1) >> 1
        if keys[p] <= key:
            break
        keys[i], items[i] = keys[p], items[p]
        i = p
    keys[i], items[i] = key, item


@kernel
def sift_down(keys: Floats, items: Ints, n: int) -> None:
    """Restore the heap of ``n`` after its top was taken; item ``n`` moves there."""
    key, item = keys[n], items[n]
    i = 0
    while True:
        c = 2 * i + 1
        if c >= n:
            break
        if c + 1 < n and keys[c + 1] < keys[c]:
            c += 1
        if keys[c] >= key:
            break
        keys[i], items[i] = keys[c], items[c]
        i = c
    keys[i], items[i] = key, item
