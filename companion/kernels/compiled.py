"""A kernel as numba has it: compiled for the types that it is called with, its code kept by ``KernelCache``."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from companion.kernels.numba_alone import numba

# isort: split

from numba.core.registry import CPUDispatcher
from numba.core.types.misc import unliteral

from companion.kernels.cache import KernelCache

# Code for this very processor would be of no use in a package, would make other plans on another machine, and plans in
# 1 to 5 % less time here.
numba.config.CPU_NAME = "generic"
numba.config.CPU_FEATURES = ""


class Compiled(CPUDispatcher):  # type: ignore[misc]
    """Numba's dispatcher with a cache of our own, and one machine code for each combination of types."""

    def __init__(self, function: Callable[..., Any], locals: Any = None, targetoptions: Any = None) -> None:  # noqa: A002
        options = targetoptions or {"nopython": True, "nogil": True, "boundscheck": None}
        super().__init__(function, locals=locals or {}, targetoptions=options)
        self._cache = KernelCache(self)

    def get_call_template(self, args: Any, kws: Any) -> Any:
        """Return how a kernel is called from another: a literal is a number like any other, not a type of its own."""
        plain = tuple(unliteral(a) for a in args)
        return super().get_call_template(plain, {name: unliteral(a) for name, a in kws.items()})
