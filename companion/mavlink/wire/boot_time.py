"""The autopilot's time since its boot, over the end of its 32 bits. Pure.

``time_boot_ms`` begins again at 0 every 49.7 days. That is no reboot: it comes when it is expected, and
the time goes on.
"""

from __future__ import annotations

WRAP_S = 2**32 / 1e3
# What begins again within this time of when it has to is the same boot: messages wait, and clocks differ [s].
FITS_S = 10.0


def since_boot_s(boot_ms: int, expected_s: float | None) -> float:
    """Return the time since the boot [s] that ``boot_ms`` stands for.

    ``expected_s``: what the messages before and the time since then let expect [s], None at the first.
    """
    boot_s = boot_ms / 1e3
    if expected_s is None:
        return boot_s
    carried_s = boot_s + WRAP_S * max(0, round((expected_s - boot_s) / WRAP_S))
    return carried_s if abs(carried_s - expected_s) <= FITS_S else boot_s
