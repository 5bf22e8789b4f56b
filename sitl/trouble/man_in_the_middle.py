"""Somebody between a live boat and a live companion: passes on what they say, and says more in the boat's name."""

from __future__ import annotations

import asyncio
import time
from dataclasses import dataclass
from pathlib import Path

from companion.clock import now_s
from companion.mavlink.signing import EPOCH_S, TICKS_PER_S, read_key
from companion.mavlink.transports import Transport, open_link
from sitl.trouble.forgeries import Forger, Forgery
from sitl.trouble.signer import SignedEnd, Signer


@dataclass(frozen=True, slots=True, kw_only=True)
class Plan:
    """What to forge, one after another in turn, ``count`` frames in all; ``key`` and ``boat_key`` are key files."""

    forgeries: tuple[Forgery, ...]
    rate_hz: float
    count: int
    for_s: float
    system: int = 1
    listens: bool = False
    key: Path | None = None
    boat_key: Path | None = None


class Middle:
    """Between the boat at one LINK and the companion at another."""

    def __init__(self, boat: str, companion: str, plan: Plan) -> None:
        self._plan = plan
        self.sent = self.passed = 0
        timestamp = int((time.time() - EPOCH_S) * TICKS_PER_S)
        end: Transport = open_link(boat)
        if plan.boat_key is not None:
            end = SignedEnd(end, Signer(read_key(plan.boat_key), timestamp))
        self._boat, self._companion = end, open_link(companion)
        self._forger = Forger(system=plan.system, listens=plan.listens, timestamp=timestamp,
                              key=None if plan.key is None else read_key(plan.key))

    async def run(self) -> None:
        """Forge, and pass on until the time is over."""
        plan = self._plan
        await self._companion.open(self._boat.write)
        try:
            await self._boat.open(self._from_boat)
            try:
                until_s = now_s() + plan.for_s
                while self.sent < plan.count and now_s() < until_s:
                    forgery = plan.forgeries[self.sent % len(plan.forgeries)]
                    self._companion.write(self._forger.frame(now_s(), forgery))
                    self.sent += 1
                    await asyncio.sleep(1.0 / plan.rate_hz)
                await asyncio.sleep(max(0.0, until_s - now_s()))
            finally:
                await self._boat.close()
        finally:
            await self._companion.close()

    def _from_boat(self, data: bytes) -> None:
        self.passed += len(data)
        self._forger.hear(now_s(), data)
        self._companion.write(data)
