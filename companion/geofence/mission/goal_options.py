"""``[[goal]]``: what a mission TOML may say of a goal, one struct per kind. Without ``kind`` it is a point."""

from __future__ import annotations

import datetime as dt
from typing import Annotated, Literal

from msgspec import Meta, Struct

Latitude = Annotated[float, Meta(ge=-90.0, le=90.0)]
Longitude = Annotated[float, Meta(ge=-180.0, le=180.0)]


class MarkOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A mark of a gate."""

    lat: Latitude
    lon: Longitude


class PointOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="point"):
    """``kind = "point"``: a mark to reach, or to round."""

    lat: Latitude
    lon: Longitude
    radius_m: Annotated[float, Meta(gt=0.0, le=5000.0)] = 10.0
    rounding: Literal["port", "starboard"] | None = None
    """Leave the mark to this side of the boat; None: just come within the radius."""
    bandwidth_m: Annotated[float, Meta(gt=0.0)] | None = None
    """Half width of the lane that leads here; None: as ``[skipper] bandwidth_m`` has it."""
    name: str = ""


class GateOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="gate"):
    """``kind = "gate"``: two marks to pass between, the port one on the port hand. With a time a start line."""

    port_mark: MarkOptions
    starboard_mark: MarkOptions
    mark_radius_m: Annotated[float, Meta(ge=0.0, le=500.0)] = 5.0
    """What plans keep clear of each mark."""
    not_before: Annotated[dt.datetime, Meta(tz=True)] | None = None
    """The gun of a start line: a crossing before it does not count."""
    after_s: Annotated[float, Meta(gt=0.0, le=1e6)] | None = None
    """The same, counted from setting sail."""
    name: str = ""


class BoxOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="box"):
    """``kind = "box"``: water to stay in, for a time or until told to go on."""

    polygon: str
    """WKT, longitude first (``POLYGON ((-1.31 50.81, ...))``), or a file beside the mission."""
    for_s: Annotated[float, Meta(gt=0.0, le=1e7)] | None = None
    """How long, counted from entry; None: until the order ``go_on``."""
    name: str = ""


class SearchOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="search"):
    """``kind = "search"``: water to be looked at, in sweeps across the wind."""

    polygon: str
    """As for a box."""
    swath_m: Annotated[float, Meta(ge=4.0, le=5000.0)]
    """How wide the strip is that is seen from the track, both sides together."""
    coverage: Annotated[float, Meta(gt=0.0, le=0.99)] = 0.95
    """What share of the free water must be seen; what the sweeps left is sailed again, up to three times."""
    name: str = ""


class FieldOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="field"):
    """``kind = "field"``: sail by a field that is composed of the file's atoms (``[field.NAME]``), in GUIDED."""

    lat: Latitude
    lon: Longitude
    """Where the mission on board leads meanwhile: she loiters there when she cannot be steered."""
    field: str
    """The expression: ``ring + 0.5 * islet``."""
    until: Literal["told", "time", "place", "vessel", "outside"] = "told"
    """What ends it: the order ``go_on``; ``for_s`` alone; she is within ``radius_m`` of the place; another vessel is
    inside ``polygon``; she herself is outside of it. The order always does."""
    for_s: Annotated[float, Meta(gt=0.0, le=1e7)] | None = None
    """At the longest, counted from when the goal before was reached."""
    radius_m: Annotated[float, Meta(gt=0.0, le=5000.0)] = 10.0
    polygon: str | None = None
    """As for a box: the water that ``until = "vessel"`` and ``"outside"`` speak of."""
    name: str = ""


GoalOptions = PointOptions | GateOptions | BoxOptions | SearchOptions | FieldOptions
KINDS: dict[str, type[GoalOptions]] = {
    "point": PointOptions, "gate": GateOptions, "box": BoxOptions, "search": SearchOptions, "field": FieldOptions}


def kind_of(goal: GoalOptions) -> str:
    """Return what a goal's ``kind`` says."""
    return next(kind for kind, options in KINDS.items() if isinstance(goal, options))
