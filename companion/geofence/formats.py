"""All formats behind two functions: ``read`` looks at the content, ``write`` at the name it is given."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from companion.geo.frame import LocalFrame
from companion.geofence.document import Document
from companion.geofence.findings import Code, Finding, Severity
from companion.geofence.shapes import Circle, ZoneKind, center_of
from companion.geofence.text import decode, read_bytes
from companion.geofence.wkt import read_wkt
from companion.messages import GeoPoint

FAR_M = 50_000.0


def read(
    path: str | Path, *, kind: ZoneKind = ZoneKind.EXCLUSION, axis: str = "auto", near: GeoPoint | None = None,
) -> Document:
    """Read a file of any known format.

    ``kind`` is what zones are when the format does not say. ``axis`` (``auto``, ``lonlat``, ``latlon``) is the
    order of coordinates in WKT; with ``auto`` it is longitude first, and with ``near`` [the place of the mission] a
    file that lies elsewhere is an error that suggests the swap. Raises InputError where the file cannot be
    understood at all; everything else that is wrong is in the document's findings.
    """
    path = Path(path)
    source = str(path)
    document = read_wkt(decode(read_bytes(path), source), source, kind=kind, latlon=axis == "latlon")
    return check_place(document, near) if near is not None else document


def check_place(document: Document, near: GeoPoint) -> Document:
    """Return the document with a finding if it lies more than 50 km from ``near``."""
    from dataclasses import replace

    frame = LocalFrame(near)
    centers = [center_of(z.shape) for z in document.zones]
    for index, center in enumerate(centers):
        distance_m = float(np.hypot(*frame.en_from_geo(center)))
        shape = document.zones[index].shape
        if distance_m <= FAR_M or (not isinstance(shape, Circle) and _covers(shape, near)):
            continue
        remedy = "check the coordinates"
        if abs(center.lon_deg) <= 90.0:
            swapped = GeoPoint(lat_deg=center.lon_deg, lon_deg=center.lat_deg)
            if float(np.hypot(*frame.en_from_geo(swapped))) <= FAR_M:
                remedy = 'latitude and longitude look swapped: try --axis latlon (in a mission: axis = "latlon")'
        code = Code.SWAPPED_AXES if "swapped" in remedy else Code.FAR_AWAY
        finding = Finding(
            severity=Severity.ERROR, code=code, place=document.zones[index].name or f"zone {index + 1}",
            text=f"lies {distance_m / 1000.0:.0f} km from the mission, at {center.lat_deg:.4f}, {center.lon_deg:.4f}",
            remedy=remedy,
        )
        return replace(document, findings=(*document.findings, finding))
    return document


def _covers(shape: shapely.Geometry, point: GeoPoint) -> bool:
    return bool(shapely.covers(shape, shapely.points(point.lon_deg, point.lat_deg)))
