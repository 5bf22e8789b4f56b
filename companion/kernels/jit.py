"""``@kernel``: a function as machine code, without the interpreter's lock: what the package carries, or numba's."""

from __future__ import annotations

import sys
from collections.abc import Callable
from typing import Any, TypeVar, cast

from companion.kernels import carried

F = TypeVar("F", bound=Callable[..., Any])


def kernel(function: F) -> F:
    """Return the function as machine code, one for each combination of types that it is called with.

    A kernel uses numbers, tuples and arrays that are constants of its module, other kernels, and what numba itself
    compiles. Anything else is refused when it is first compiled: its changes could not be seen. Numba is loaded only
    where the package does not carry it all.
    """
    if carried.is_used(function.__module__.partition(".")[0]):
        return cast("F", carried.Carried(function))
    from companion.kernels.cache import Compiled

    return cast("F", Compiled(function))


def begun() -> int:
    """Return how many kernels this process has begun to compile; numba is not loaded for the answer."""
    cache = sys.modules.get("companion.kernels.cache")
    return 0 if cache is None else int(cache.BEGUN.count)
