"""Real time that begins at 0, as scenarios count it."""

from __future__ import annotations

import asyncio
import time
from collections.abc import Coroutine
from typing import Any, TypeVar

from companion.clock import RealTimeLoop

T = TypeVar("T")


class _FromZero(RealTimeLoop):
    def __init__(self, speedup: float) -> None:
        self._zero_s = time.monotonic() * speedup
        super().__init__(speedup)

    def time(self) -> float:
        """Return loop time since the start [s]."""
        return super().time() - self._zero_s


def run_from_zero(main: Coroutine[Any, Any, T], speedup: float) -> T:
    """Run ``main`` in real time, ``speedup`` times as fast, on a clock that begins at 0."""
    with asyncio.Runner(loop_factory=lambda: _FromZero(speedup)) as runner:
        return runner.run(main)
