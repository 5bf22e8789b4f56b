"""Chart features by the tags of OpenStreetMap: shores, piers and what mappers of seamarks have drawn."""

from __future__ import annotations

import math
import re

from companion.chart.features import Danger, Row, Wanted

_PAIR = re.compile(r'"((?:[^"\\]|\\.)*)"=>"((?:[^"\\]|\\.)*)"')

SEAMARKS = {
    "rock": "rock",
    "wreck": "wreck",
    "obstruction": "obstruction",
    "pile": "pile",
    "mooring": "mooring",
    "platform": "platform",
    "fishing_facility": "fishing stakes",
    "marine_farm": "marine farm",
    "pontoon": "pontoon",
    "floating_dock": "floating dock",
    "hulk": "hulk",
    "shoreline_construction": "shore construction",
    "light_float": "light float",
    "light_vessel": "light vessel",
    "landmark": "",
}
MADE = {"pier": "pier", "breakwater": "breakwater", "groyne": "groyne", "dyke": "dyke", "offshore_platform": "platform"}
NATURAL = {
    "coastline": "shore",
    "rock": "rock",
    "bare_rock": "rock",
    "stone": "rock",
    "reef": "reef",
    "shoal": "shoal",
    "beach": "beach",
    "shingle": "beach",
    "mud": "dries",
    "land": "land",
}
# Of these a depth is that of the water over them; of a pile, a pier or a buoy it is that of the water beside it.
SUBMERGED = frozenset({"rock", "wreck", "obstruction", "reef", "shoal"})
POINT_M = {"wreck": 20.0, "reef": 20.0, "shoal": 20.0}
OTHER_POINT_M = 10.0
LINE_M = 3.0
ENTRY_PROHIBITED = "no_entry"


def hstore(text: str) -> dict[str, str]:
    r"""Return the tags of a column ``other_tags``, as GDAL writes those that have none of their own.

    >>> hstore('"seamark:type"=>"rock","name"=>"The \\"Hat\\""')
    {'seamark:type': 'rock', 'name': 'The "Hat"'}
    """
    return {key: re.sub(r"\\(.)", r"\1", value) for key, value in _PAIR.findall(text)}


def is_tagged(row: Row) -> bool:
    """Return whether a feature says in tags what it is."""
    return bool(row.text("seamark:type") or row.text("natural") or row.text("man_made") or row.text("other_tags"))


def dangers_of(row: Row, wanted: Wanted) -> list[Danger]:
    """Return what of a feature with tags is solid; none where it is of the land, or deep enough."""
    tags = {**{k: row.text(k) for k in row.attributes}, **hstore(row.text("other_tags"))}
    seamark, name = tags.get("seamark:type", ""), tags.get("seamark:name", "") or tags.get("name", "")
    depth_m = _depth_m(tags, seamark)
    reason = (
        SEAMARKS.get(seamark, "") or MADE.get(tags.get("man_made", ""), "") or NATURAL.get(tags.get("natural", ""), "")
    )
    radius_m = POINT_M.get(reason, OTHER_POINT_M)
    if seamark.startswith(("buoy", "beacon")):
        reason, radius_m = seamark.partition("_")[0], wanted.buoy_radius_m
    if seamark == "restricted_area":
        is_shut = ENTRY_PROHIBITED in tags.get("seamark:restricted_area:restriction", "")
        if wanted.restricted == "all" or (wanted.restricted == "prohibited" and is_shut):
            reason = "entry prohibited" if is_shut else "restricted area"
    if not reason or (reason in SUBMERGED and depth_m is not None and depth_m >= wanted.safety_depth_m):
        return []
    if row.geometry.geom_type.endswith("LineString"):
        radius_m = LINE_M
    if row.geometry.geom_type.endswith("Polygon"):
        radius_m = 0.0
    over_m = depth_m if reason in SUBMERGED else None
    return [Danger(reason=reason, geometry=row.geometry, name=name, depth_m=over_m, radius_m=radius_m)]


def _depth_m(tags: dict[str, str], seamark: str) -> float | None:
    """Return the depth that a seamark tells [m], None for one that does not, or not in metres."""
    try:
        depth_m = float(tags.get(f"seamark:{seamark}:depth", "") or tags.get("depth", ""))
    except ValueError:
        return None
    return depth_m if math.isfinite(depth_m) else None
