"""The watchdogs as numbers, for links that have no room for words."""

from __future__ import annotations

# In the order in which they were numbered: a new one goes to the end, for a status of last year must read the same.
WATCHDOGS = (
    "link silent", "position lost", "position jump", "wind untrusted", "becalmed", "drifting", "in irons",
    "vessel too near", "no progress", "heading against course", "off the corridor", "stuck waypoint", "mission ended",
    "fence breach", "foreign mission", "reboot", "battery low", "battery critical", "leaking", "dark", "shore lost",
    "out of time", "dragged off", "planner dead", "strong wind", "light wind", "fence off",
    "wind contradicted",
)


def number_of(watchdog: str) -> int:
    """Return the number of a watchdog, 0 for none (an empty name)."""
    return WATCHDOGS.index(watchdog) + 1 if watchdog else 0


def watchdog_of(number: int) -> str:
    """Return the watchdog of a number, empty for 0; one that is not known here is named by its number."""
    if number == 0:
        return ""
    return WATCHDOGS[number - 1] if number <= len(WATCHDOGS) else f"watchdog {number}"
