"""What the shore hears of a voyage by itself: the status every two seconds, silent feeds, trouble with the disk."""

from __future__ import annotations

import asyncio
import math
from collections.abc import Callable

from companion.clock import now_s
from companion.fold import Step
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.wire import HIGH_LATENCY_S
from companion.messages import CompanionStatus
from companion.skipper.step import Severity
from companion.telemetry.far import worst_watchdog
from companion.telemetry.folder.logbook import Logbook
from companion.traffic.listening import Feeds

# Status to the radio: a frame of it every so often [s]; see companion.mavlink.wire.status for its bytes.
STATUS_EVERY_S = 2.0
TROUBLE_EVERY_S = 600.0   # trouble with the disk that lasts is said again


async def speak_high_latency(
    autopilot: Autopilot, seen: Callable[[], tuple[CompanionStatus, Step] | None], is_wanted: Callable[[], bool],
) -> None:
    """Send HIGH_LATENCY2 while it is asked for, until cancelled."""
    while True:
        now = seen() if is_wanted() else None
        if now is not None:
            status, step = now
            autopilot.send_high_latency(status, step.snapshot.vehicle, worst_watchdog(step))
        await asyncio.sleep(HIGH_LATENCY_S)


class Radio:
    """Speaks through ``autopilot``; ``status`` and ``trouble`` are asked for what there is to say."""

    def __init__(
        self, autopilot: Autopilot, feeds: Feeds, log: Logbook, *, status: Callable[[], CompanionStatus | None],
        trouble: Callable[[], str],
    ) -> None:
        self._autopilot, self._feeds, self._log = autopilot, feeds, log
        self._status, self._trouble = status, trouble
        self._told, self._told_s = "", -math.inf

    async def run(self) -> None:
        """Speak until cancelled."""
        while True:
            status = self._status()
            if status is not None:
                self._autopilot.send_status(status)
            self._tell_silence()
            self._tell_trouble()
            await asyncio.sleep(STATUS_EVERY_S)

    def _tell_silence(self) -> None:
        """Say and record that a feed has fallen silent, and that it is heard again."""
        for feed in self._feeds.changed():
            text = f"AIS feed {'silent' if feed.is_silent else 'heard again'}: {feed.sentence()}"
            self._log.note(self._log.now_s(), {"kind": "feed", "silent": feed.is_silent, "text": text})
            self._autopilot.say(int(Severity.WARNING if feed.is_silent else Severity.NOTICE), text)

    def _tell_trouble(self) -> None:
        trouble = self._trouble()
        if trouble and (trouble != self._told or now_s() - self._told_s >= TROUBLE_EVERY_S):
            self._autopilot.say(int(Severity.WARNING), f"{trouble}; sailing on")
            self._told_s = now_s()
        elif self._told and not trouble:
            self._autopilot.say(int(Severity.NOTICE), "the disk is well again: everything is recorded")
        self._told = trouble
