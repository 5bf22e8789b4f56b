"""A binary heap over two arrays, for the compiled searches: keys to be least first, and what they belong to.

The top is ``keys[0]`` and ``items[0]``; the search counts what is on it.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from companion.kernels.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int32]


@kernel
def _sift_up(keys: Floats, items: Ints, i: int) -> None:
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
def _sift_down(keys: Floats, items: Ints, n: int) -> None:
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


@kernel
def push(keys: Floats, items: Ints, n: int, key: float, item: int) -> tuple[Floats, Ints, int]:
    """Put an item on the heap of ``n``; return the arrays, twice as long where they were full, and the new count."""
    if n >= keys.shape[0]:
        keys = np.concatenate((keys, np.empty(n)))
        items = np.concatenate((items, np.empty(n, np.int32)))
    keys[n], items[n] = key, item
    _sift_up(keys, items, n)
    return keys, items, n + 1


@kernel
def pop(keys: Floats, items: Ints, n: int) -> int:
    """Take the top off the heap of ``n``, 1 or more; return the new count."""
    _sift_down(keys, items, n - 1)
    return n - 1
