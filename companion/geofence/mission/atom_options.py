"""``[field.NAME]``: what a mission TOML may say of an atom of its fields, one struct per kind."""

from __future__ import annotations

from typing import Annotated, Literal

from msgspec import Meta, Struct

from companion.geofence.mission.goal_options import Latitude, Longitude, MarkOptions

Range = Annotated[float, Meta(ge=1.0, le=5000.0)]
Radius = Annotated[float, Meta(ge=5.0, le=5000.0)]


class PointAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="point"):
    """``kind = "point"``: towards a place from everywhere, weakening within a few metres of it."""

    lat: Latitude
    lon: Longitude
    zone_m: Range = 50.0
    """Half the width of the band about the wind's line through it, in which a beat is sailed."""


class StationAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="station",
):
    """``kind = "station"``: to a place, and about it once she is there: short boards, or loops."""

    lat: Latitude
    lon: Longitude
    zone_m: Range = 15.0


class LineAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="line"):
    """``kind = "line"``: onto the line through two places and along it, from ``start`` towards ``end``."""

    start: MarkOptions
    end: MarkOptions
    zone_m: Range = 50.0
    """From this far off it is made for at 22.5°, from farther at up to 45°; and half the width of a beat along it."""


class CircleAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="circle"):
    """``kind = "circle"``: onto a circle and round it."""

    lat: Latitude
    lon: Longitude
    radius_m: Radius
    turn: Literal["clockwise", "anticlockwise"] = "clockwise"
    zone_m: Range = 50.0
    """Half the width of the ring in which a beat is sailed; a quarter of the radius at the most."""


class RepulsivePointAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="repulsive_point",
):
    """``kind = "repulsive_point"``: away from a place, twice as strong as what leads on, fading with the distance."""

    lat: Latitude
    lon: Longitude
    range_m: Range = 100.0
    """At this distance it has 37 % of its strength, at twice as much 2 %."""


class RepulsiveLineAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="repulsive_line",
):
    """``kind = "repulsive_line"``: away from the endless line through two places, to either side."""

    start: MarkOptions
    end: MarkOptions
    range_m: Range = 100.0


class HeadingAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="heading",
):
    """``kind = "heading"``: the same heading everywhere."""

    heading_deg: Annotated[float, Meta(ge=0.0, le=360.0)]


class LeaveAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="leave"):
    """``kind = "leave"``: out of some water by the heading that is soonest out, clear of vessels."""

    polygon: str
    """WKT, longitude first, or a file beside the mission."""


AtomOptions = (
    PointAtomOptions | StationAtomOptions | LineAtomOptions | CircleAtomOptions | RepulsivePointAtomOptions
    | RepulsiveLineAtomOptions | HeadingAtomOptions | LeaveAtomOptions)
ATOMS: dict[str, type[AtomOptions]] = {
    "point": PointAtomOptions, "station": StationAtomOptions, "line": LineAtomOptions, "circle": CircleAtomOptions,
    "repulsive_point": RepulsivePointAtomOptions, "repulsive_line": RepulsiveLineAtomOptions,
    "heading": HeadingAtomOptions, "leave": LeaveAtomOptions}
