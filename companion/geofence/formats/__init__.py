"""Every file format that carries fences, obstacles and missions."""

from companion.geofence.formats.fence_items import (
    MAX_FENCE_ITEMS,
    STORAGE_BYTES,
    items_to_zones,
    storage_bytes,
    zones_to_items,
)
from companion.geofence.formats.losses import Written
from companion.geofence.formats.raw.text import MAX_BYTES, MAX_POSITIONS
from companion.geofence.formats.registry import format_of, write
from companion.geofence.formats.rings import Findings
from companion.geofence.formats.routes import lines_as_route

__all__ = [
    "MAX_BYTES", "MAX_FENCE_ITEMS", "MAX_POSITIONS", "STORAGE_BYTES", "Findings", "Written", "format_of",
    "items_to_zones", "lines_as_route", "storage_bytes", "write", "zones_to_items",
]
