"""The sun's height over the horizon."""

from __future__ import annotations

import math

_J2000_UNIX_S = 946_728_000.0   # 2000-01-01 12:00 UTC
_DAY_S = 86_400.0


def sun_height_rad(lat_rad: float, lon_rad: float, unix_s: float) -> float:
    """Return how high the sun's centre stands over the horizon, negative below it, without refraction [rad].

    The almanac's low-precision formula (U.S. Naval Observatory, Astronomical Almanac, section C): within 0.01 deg of
    the true place until 2050.
    """
    days = (unix_s - _J2000_UNIX_S) / _DAY_S
    mean_longitude = math.radians((280.460 + 0.9856474 * days) % 360.0)
    anomaly = math.radians((357.528 + 0.9856003 * days) % 360.0)
    longitude = mean_longitude + math.radians(1.915) * math.sin(anomaly) + math.radians(0.020) * math.sin(2.0 * anomaly)
    obliquity = math.radians(23.439 - 4e-7 * days)
    ascension = math.atan2(math.cos(obliquity) * math.sin(longitude), math.cos(longitude))
    declination = math.asin(math.sin(obliquity) * math.sin(longitude))
    sidereal = math.radians((280.46062 + 360.98564737 * days) % 360.0)   # Greenwich mean
    hour_angle = sidereal + lon_rad - ascension
    return math.asin(
        math.sin(lat_rad) * math.sin(declination) + math.cos(lat_rad) * math.cos(declination) * math.cos(hour_angle))
