"""Vessels and boats for the traffic tests."""

from __future__ import annotations

import math
from typing import Any

from companion.geo.frame import LocalFrame
from companion.messages import AisReport, GeoPoint
from companion.traffic import OwnShip, Vessel
from companion.traffic.vessel import hull_of

FRAME = LocalFrame(GeoPoint(lat_deg=51.1, lon_deg=-1.3))


def report(t_s: float, en: tuple[float, float] | None, mmsi: int = 211000001, **more: Any) -> AisReport:
    """A report at a local place."""
    return AisReport(t_s=t_s, mmsi=mmsi, position=None if en is None else FRAME.geo_from_en(*en), **more)


def vessel(
    en: tuple[float, float] = (0.0, 0.0),
    course_deg: float | None = 0.0,
    speed_mps: float | None = 5.0,
    size: tuple[float, float, float, float] = (50.0, 50.0, 8.0, 8.0),
    **more: Any,
) -> Vessel:
    """A vessel at t = 0."""
    course = None if course_deg is None else math.radians(course_deg)
    values: dict[str, Any] = {
        "mmsi": 211000001,
        "t_s": 0.0,
        "heard_s": 0.0,
        "antenna_en_m": en,
        "course_rad": course,
        "speed_mps": speed_mps,
        "heading_rad": course,
        "hull": hull_of(*size, is_class_b=False),
    }
    return Vessel(**(values | more))


def own(en: tuple[float, float] = (0.0, 0.0), course_deg: float = 0.0, speed_mps: float = 2.0, **more: Any) -> OwnShip:
    """Our boat at t = 0."""
    c = math.radians(course_deg)
    velocity = (speed_mps * math.sin(c), speed_mps * math.cos(c))
    values: dict[str, Any] = {"t_s": 0.0, "en_m": en, "velocity_en_mps": velocity, "heading_rad": c}
    return OwnShip(**(values | more))
