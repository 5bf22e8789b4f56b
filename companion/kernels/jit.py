"""``@kernel``: a function compiled by numba, without the interpreter's lock, its code kept by ``KernelCache``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeVar, cast

from companion.kernels.numba_alone import numba

# isort: split

from numba.core.registry import CPUDispatcher
from numba.core.types.misc import unliteral

from companion.kernels.cache import KernelCache

F = TypeVar("F", bound=Callable[..., Any])

# Code for this very processor would be of no use in a package, would make other plans on another machine, and plans in
# 1 to 5 % less time here.
numba.config.CPU_NAME = "generic"
numba.config.CPU_FEATURES = ""


def kernel(function: F) -> F:
    """Return the function compiled, for each combination of types when it is first called with them.

    A kernel uses numbers, tuples and arrays that are constants of its module, other kernels, and what numba itself
    compiles. Anything else is refused when it is first compiled: its changes could not be seen.
    """
    return cast("F", _Kernel(function))


class _Kernel(CPUDispatcher):  # type: ignore[misc]
    """Numba's dispatcher with a cache of our own, and one machine code for each combination of types."""

    def __init__(self, function: Callable[..., Any], locals: Any = None, targetoptions: Any = None) -> None:  # noqa: A002
        options = targetoptions or {"nopython": True, "nogil": True, "boundscheck": None}
        super().__init__(function, locals=locals or {}, targetoptions=options)
        self._cache = KernelCache(self)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a kernel is called from another: a literal is a number like any other, not a type of its own."""
        plain = tuple(unliteral(a) for a in args)
        return super().get_call_template(plain, {name: unliteral(a) for name, a in kws.items()})
