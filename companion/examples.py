"""The missions to learn from: inside the program where it is installed, beside it in a checkout."""

from __future__ import annotations

from pathlib import Path

# The simplest first; what else scenarios and tests sail lies in sitl/missions.
NAMES = ("lake", "rocks", "bay", "bay-with-care", "archipelago", "buoy-course", "gates", "box", "search", "field-ring")
_HERE = Path(__file__).resolve().parent


def folder() -> Path:
    """Return the folder of the missions and their areas."""
    installed = _HERE / "missions"
    return installed if installed.is_dir() else _HERE.parent / "missions"
