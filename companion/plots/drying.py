"""Water that dries on a picture: filled where it is solid at the picture's moment, with its hours beside its name."""

from __future__ import annotations

import datetime as dt
import math
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from companion.compose import drying_of, tide_of
from companion.current import closed_spans

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.patches import Patch

    from companion.geofence import Mission

DRYING, DRYING_EDGE = "#8fb39a", "#4f7a5c"  # a chart's green: no land
CHANGES = 3  # of its state that are told, from the picture's moment on

Spans = tuple[tuple[float | None, float | None], ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class DryingShape:
    """A piece of it in the picture's metres; ``solid_unix_s``: spans of Unix time, None where one has no end."""

    name: str
    shape: BaseGeometry
    solid_unix_s: Spans


@dataclass(frozen=True, slots=True, kw_only=True)
class DryingPicture:
    """All of it at a moment [Unix time]; None: the time is not known."""

    waters: tuple[DryingShape, ...]
    at_s: float | None


def drying_picture(mission: Mission, now_s: float) -> DryingPicture:
    """Return a mission's: at ``now_s``, or when the table begins where it does not hold for then."""
    table = tide_of(mission) if mission.drying else None
    waters = tuple(
        DryingShape(name=w.name, shape=w.polygon, solid_unix_s=closed_spans(table, w.opens_at_m))
        for w in drying_of(mission, mission.frame())
    )
    return DryingPicture(waters=waters, at_s=now_s if table is None else table.near_s(now_s))


def hours_in_words(solid_unix_s: Spans, at_s: float | None) -> str:
    """Return how it is from a moment on, UTC, a day named where it is another.

    >>> hours_in_words(((None, 30600.0), (51000.0, None)), 28800.0)
    'solid until 08:30, open until 14:10, then solid'
    """
    if at_s is None:
        return "solid: the time is not known"
    words: list[str] = []
    day = _utc(at_s).date()
    edges = sorted({t for span in solid_unix_s for t in span if t is not None and at_s < t < math.inf})
    for begin, end in zip([at_s, *edges], [*edges, math.inf], strict=True):
        state = "solid" if is_solid(solid_unix_s, begin) else "open"
        if end == math.inf:
            words.append(f"then {state}" if words else state)
        elif len(words) < CHANGES:
            when = _utc(end)
            words.append(f"{state} until {when:%H:%M}" + ("" if when.date() == day else f" on {when.day} {when:%b}"))
            day = when.date()
    return ", ".join(words[: CHANGES if len(words) > CHANGES else None])


def is_solid(solid_unix_s: Spans, at_s: float | None) -> bool:
    """Return whether it is solid at a moment; where that is not known it is."""
    return at_s is None or any((a is None or a <= at_s) and (b is None or at_s < b) for a, b in solid_unix_s)


def _utc(at_s: float) -> dt.datetime:
    return dt.datetime.fromtimestamp(at_s, dt.UTC)


def draw_drying(axes: Axes, picture: DryingPicture) -> list[Patch]:
    """Draw it; return the legend's handles."""
    from matplotlib.patches import Patch, PathPatch
    from matplotlib.path import Path as DrawnPath

    for water in picture.waters:
        solid = is_solid(water.solid_unix_s, picture.at_s)
        for part in shapely.get_parts(water.shape):
            rings = [np.asarray(ring.coords) for ring in (part.exterior, *part.interiors)]
            codes = [
                c for r in rings for c in (DrawnPath.MOVETO, *[DrawnPath.LINETO] * (len(r) - 2), DrawnPath.CLOSEPOLY)
            ]
            axes.add_artist(  # how much is drawn of the water about it is others' to say
                PathPatch(
                    DrawnPath(np.concatenate(rings), codes),
                    fc=DRYING if solid else "none",
                    ec=DRYING_EDGE,
                    hatch=None if solid else "..",
                    lw=1.0,
                    ls="-" if solid else (0, (2, 2)),
                    zorder=2.2,
                )
            )
        at = water.shape.representative_point()
        axes.annotate(
            f"{water.name}:\n{hours_in_words(water.solid_unix_s, picture.at_s)}",
            (at.x, at.y),
            fontsize=6.5,
            ha="center",
            va="center",
            color="#24402e",
            zorder=5,
            annotation_clip=True,
        )
    when = "" if picture.at_s is None else f" at {_utc(picture.at_s):%Y-%m-%d %H:%M} UTC"
    states = {is_solid(water.solid_unix_s, picture.at_s) for water in picture.waters}
    handles = {
        True: Patch(fc=DRYING, ec=DRYING_EDGE, label=f"dries: solid{when}"),
        False: Patch(fc="none", ec=DRYING_EDGE, hatch="..", ls=(0, (2, 2)), label=f"dries: open{when}"),
    }
    return [handle for state, handle in handles.items() if state in states]
