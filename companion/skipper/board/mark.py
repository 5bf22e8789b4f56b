"""The mark by which our missions are known again when nothing else is left of them: the altitude of each item.

A boat's waypoint has no use for an altitude, and ArduPilot keeps it to the centimetre. Ours follows from the item's
command and place. So an item that somebody has moved, or made another of, is his and no longer ours.
"""

from __future__ import annotations

import struct
import zlib
from collections.abc import Sequence
from dataclasses import replace

from companion.messages import Command, MissionItem, sailed_part

_PLACE = struct.Struct("<Hii")
# Altitudes from 1 cm to 41 m; a list of two items bears ours by chance once in 16 million.
MARKS = 4096
# The autopilot cuts an altitude to centimetres, and a number of 32 bits may lie a little below its own.
_SURELY_M = 0.004


def marked(items: Sequence[MissionItem]) -> tuple[MissionItem, ...]:
    """Return ``items`` with our mark in each that has a place."""
    return tuple(
        replace(item, alt_m=_mark_cm(item) / 100.0 + _SURELY_M) if _has_place(item) else item for item in items
    )


def are_marked(items: Sequence[MissionItem]) -> bool:
    """Return whether every item that can be sailed, and has a place, bears our mark; False when there is none."""
    places = [item for item in sailed_part(items) if _has_place(item)]
    return bool(places) and all(_is_marked(item) for item in places)


def is_remnant(items: Sequence[MissionItem], drawn: Sequence[MissionItem]) -> bool:
    """Return whether ``items`` are ours in part and for the rest of ``drawn``: an upload over it that was cut short."""
    left = {(item.command, item.lat_e7, item.lon_e7) for item in drawn}
    ours = [item for item in items if _has_place(item) and _is_marked(item)]
    return bool(ours) and all(
        item in ours or (item.command, item.lat_e7, item.lon_e7) in left for item in sailed_part(items)
    )


def _has_place(item: MissionItem) -> bool:
    return item.command != Command.NAV_RETURN_TO_LAUNCH


def _is_marked(item: MissionItem) -> bool:
    return int(item.alt_m * 100.0 + 0.5) == _mark_cm(item)


def _mark_cm(item: MissionItem) -> int:
    mark = 1 + zlib.crc32(_PLACE.pack(item.command, item.lat_e7, item.lon_e7)) % MARKS
    return mark if mark % 50 else mark + 7  # never a round altitude, which people give
