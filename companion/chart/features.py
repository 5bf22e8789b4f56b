"""What a chart says of its water, whatever its format: dangers with their reason and source, and what it covers."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from shapely.geometry.base import BaseGeometry

from companion.geo import LEAST_DEGREE_M
from companion.geofence import Finding
from companion.messages import GeoPoint

Box = tuple[float, float, float, float]
"""West, south, east, north [deg]; west and east may lie beyond the date line."""

Attributes = Mapping[str, object]
"""Of one feature: what its file says of it, by name; lists as text (``"7,8"``), nothing as None."""


def box_about(center: GeoPoint, reach_m: float) -> Box:
    """Return the box of longitude and latitude that holds the water."""
    tall = reach_m / LEAST_DEGREE_M
    most = min(89.0, abs(center.lat_deg) + tall)
    wide = min(180.0, tall / math.cos(math.radians(most)))
    return (center.lon_deg - wide, center.lat_deg - tall, center.lon_deg + wide, center.lat_deg + tall)


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A chart's name, edition and date, as it says them; "" where it does not."""

    name: str
    edition: str = ""
    date: str = ""

    def __str__(self) -> str:
        edition = f" edition {self.edition}" if self.edition else ""
        return f"{self.name}{edition}" + (f" of {self.date}" if self.date else "")


@dataclass(frozen=True, slots=True, kw_only=True)
class Danger:
    """Something to keep clear of: longitude and latitude [deg], an area, or points and lines with a radius.

    ``depth_m`` is the least depth over it below the chart's datum, negative where it dries; ``doubt_m`` how far off its
    place may be, by the quality of the survey, or the margin that it was drawn with.
    """

    reason: str
    geometry: BaseGeometry
    name: str = ""
    depth_m: float | None = None
    radius_m: float = 0.0
    doubt_m: float = 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Chart:
    """One file's dangers.

    ``resolution_m`` is how fine it is drawn: where two charts cover the same water, the finer one counts. ``coverage``
    is the water of which it speaks; None: all there is, as a coastline does.
    """

    source: Source
    dangers: tuple[Danger, ...]
    coverage: BaseGeometry | None = None
    resolution_m: float = math.inf
    supersedes: bool = False
    """Whether coarser charts count for nothing where this one speaks: a navigational chart's own, no grid's."""
    knows_depths: bool = False
    is_elsewhere: bool = False
    """Whether all of it lies outside of what was asked for: it says nothing of that, not even that it is free."""
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Wanted:
    """What of a chart is solid for this boat."""

    safety_depth_m: float
    """Water less deep than this below the chart's datum is solid."""
    air_draft_m: float = math.inf
    """Bridges and cables with less room than this are solid; without a figure all are."""
    buoy_radius_m: float = 10.0
    most_doubt_m: float = 50.0
    """A survey's doubt of places widens margins by no more."""
    floats_m: float | None = None
    """Water no less deep than this is deep enough at some tide: a grid's is told by its depth; None: at none."""
    restricted: str = "prohibited"
    """Restricted areas: ``none``, ``prohibited`` (where entry is), ``all``."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A feature as a file has it: its class or layer, where it stands in the file, its attributes, its shape."""

    layer: str
    place: str
    geometry: BaseGeometry
    attributes: Attributes = field(default_factory=dict)

    def number(self, key: str) -> float | None:
        """Return a finite number of its attributes, None where there is none."""
        value = self.attributes.get(key)
        if isinstance(value, bool) or not isinstance(value, int | float | str):
            return None
        try:
            number = float(value)
        except ValueError:
            return None
        return number if math.isfinite(number) else None

    def text(self, key: str) -> str:
        """Return an attribute as text, "" where there is none."""
        value = self.attributes.get(key)
        return "" if value is None or (isinstance(value, float) and math.isnan(value)) else str(value).strip()

    def codes(self, key: str) -> frozenset[int]:
        """Return the codes of a list (``"7,8"``)."""
        return frozenset(int(part) for part in self.text(key).strip("()").split(",") if part.strip().isdigit())
