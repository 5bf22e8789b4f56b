"""The missions that come with the program: inside it where it is installed, beside it in a checkout."""

from __future__ import annotations

from pathlib import Path

# Those to learn from, the simplest first; the others are what scenarios and tests sail.
TEACHING = (
    "lake", "rocks", "bay", "bay-with-care", "archipelago", "buoy-course", "gates", "box", "search", "field-ring",
)
_HERE = Path(__file__).resolve().parent


def folder() -> Path:
    """Return the folder of the missions and their areas."""
    installed = _HERE / "missions"
    return installed if installed.is_dir() else _HERE.parent / "missions"
