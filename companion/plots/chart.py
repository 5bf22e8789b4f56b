"""What all pictures share: places and dates in words, a scale, legends beside the curves, one way to save."""

from __future__ import annotations

import datetime as dt
import math
from collections.abc import Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.disk import Disk, reason
from companion.errors import InputError

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DPI = 110


def save(figure: Figure, path: str | Path) -> None:
    """Write a figure whole, a .png where nothing else is said, and close it.

    Raises:
        InputError: the file cannot be written, and what was there is there; or its kind is unknown.
    """
    import matplotlib.pyplot as plt

    path = Path(path) if Path(path).suffix else Path(path).with_suffix(".png")
    drawn = BytesIO()
    try:
        figure.savefig(drawn, dpi=DPI, format=path.suffix[1:])
        Disk().replace(path, drawn.getvalue(), is_durable=False)
    except (OSError, ValueError) as error:
        why = reason(error) if isinstance(error, OSError) else str(error)
        raise InputError(str(path), "", f"cannot be written ({why})", "name a .png elsewhere") from None
    finally:
        plt.close(figure)


def place_words(lat_deg: float, lon_deg: float) -> str:
    """Return a position as a sailor writes it, in degrees and decimal minutes.

    >>> place_words(-33.85, 151.26)
    "33°51.00' S 151°15.60' E"
    """
    words = []
    for value, (positive, negative) in ((lat_deg, "NS"), (lon_deg, "EW")):
        minutes = round(abs(value) * 60.0, 2)
        words.append(f"{int(minutes // 60)}°{minutes % 60.0:05.2f}' {positive if value >= 0.0 else negative}")
    return " ".join(words)


def date_words(utc: str) -> str:
    """Return an ISO time as a date with its minute, "" for text that is not a time.

    >>> date_words("2026-06-09T10:13:20+00:00")
    '9 June 2026, 10:13 UTC'
    """
    try:
        when = dt.datetime.fromisoformat(utc).astimezone(dt.UTC)
    except ValueError:
        return ""
    return f"{when.day} {when:%B %Y, %H:%M} UTC"


def scale_bar(axes: Axes) -> None:
    """Draw a bar of a round length at the lower left of axes in metres whose limits are set."""
    x0, x1 = axes.get_xlim()
    y0, y1 = axes.get_ylim()
    wanted_m = 0.2 * (x1 - x0)
    power = 10.0 ** math.floor(math.log10(wanted_m))
    length_m = max(step * power for step in (1.0, 2.0, 5.0) if step * power <= wanted_m)
    left, low, tick = x0 + 0.03 * (x1 - x0), y0 + 0.03 * (y1 - y0), 0.008 * (y1 - y0)
    axes.plot(
        [left, left, left + length_m, left + length_m],
        [low + tick, low, low, low + tick],
        color="black",
        lw=1.4,
        zorder=10,
        scalex=False,
        scaley=False,
    )
    text = f"{length_m:g} m" if length_m < 1000.0 else f"{length_m / 1000.0:g} km"
    axes.annotate(
        text,
        (left + length_m / 2.0, low),
        xytext=(0, 3),
        textcoords="offset points",
        ha="center",
        fontsize=8,
        zorder=10,
    )


def legend_above(axes: Any) -> None:
    """Put the legend over the axes, where no curve runs."""
    if axes.get_legend_handles_labels()[0]:
        axes.legend(loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=4, fontsize=8, frameon=False, borderaxespad=0.1)


def legend_below(axes: Any, *, columns: int = 4, more: Sequence[Artist] = ()) -> None:
    """Put the legend of a chart under it: what is labelled in it, behind ``more``."""
    handles = [*more, *axes.get_legend_handles_labels()[0]]
    if handles:
        axes.legend(
            handles=handles, loc="upper left", bbox_to_anchor=(0.0, -0.07), ncols=columns, fontsize=8, frameon=False
        )
