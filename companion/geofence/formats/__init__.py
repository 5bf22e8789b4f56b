"""Every file format that carries fences, obstacles and missions."""

from companion.geofence.formats.fence_items import (
    MAX_FENCE_ITEMS,
    STORAGE_BYTES,
    items_to_zones,
    storage_bytes,
    zones_to_items,
)
from companion.geofence.formats.geojson import zone_kind
from companion.geofence.formats.losses import Written
from companion.geofence.formats.registry import FORMATS, format_of, parse, write
from companion.geofence.formats.rings import Findings
from companion.geofence.formats.routes import lines_as_route
from companion.geofence.formats.untrusted import MAX_BYTES, MAX_POSITIONS, decode, read_bytes
from companion.geofence.formats.wkt import KINDS, drawings_of

__all__ = [
    "FORMATS",
    "KINDS",
    "MAX_BYTES",
    "MAX_FENCE_ITEMS",
    "MAX_POSITIONS",
    "STORAGE_BYTES",
    "Findings",
    "Written",
    "decode",
    "drawings_of",
    "format_of",
    "items_to_zones",
    "lines_as_route",
    "parse",
    "read_bytes",
    "storage_bytes",
    "write",
    "zone_kind",
    "zones_to_items",
]
