"""A route in words: when she is there, what she meets, what bounds it, where it turns."""

from __future__ import annotations

import math

import numpy as np

from companion.geo import M_PER_NM
from companion.passage.frame import GEOD
from companion.passage.plan import Route
from companion.weather import iso

_HOURS = {"night": "by night", "beating": "beating", "waiting": "waiting"}


def told_of(route: Route) -> tuple[str, ...]:
    """Return lines about a route that was found; of one that was not, why."""
    sailed = route.sailed
    if sailed is None:
        return (f"no way: {route.outcome.value}",)
    if not sailed.arrived:
        return (f"not there: after {_span(sailed.time_s)}, {_way_left(route)} from the goal: {sailed.why}",)
    arrives = route.depart_utc_s + sailed.time_s
    made = sailed.length_m / max(1.0, sailed.time_s)
    wind = sailed.rows[:, 3]
    gained = 100.0 * (1.0 - route.bound_s / max(1.0, sailed.time_s))
    way = f"{sailed.length_m / M_PER_NM:.0f} NM at {made:.2f} m/s"
    hours = [f"{sailed.hours(word):.0f} h {said}" for word, said in _HOURS.items()]
    lines = [
        f"departs {iso(route.depart_utc_s)}, arrives {iso(arrives)}: {_span(sailed.time_s)}, {way}",
        f"no way is faster than about {_span(route.bound_s)} in this forecast: at most {gained:.1f} % could be gained",
        f"wind {wind.min():.1f} to {wind.max():.1f} m/s, mean {wind.mean():.1f}; {', '.join(hours)}",
    ]
    lines += [_leg(route, k) for k in range(1, len(route.waypoints))]
    return tuple(lines)


def _leg(route: Route, k: int) -> str:
    a, b = route.waypoints[k - 1], route.waypoints[k]
    azimuth, _, length = GEOD.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
    when = ""
    if route.sailed is not None:
        lat, lon = route.sailed.places.T
        near = (lat - b.lat_deg) ** 2 + (np.cos(np.radians(b.lat_deg)) * _turned(lon - b.lon_deg)) ** 2
        when = f" by {iso(float(route.sailed.rows[int(np.argmin(near)), 0]))}"
    return f"  {k}: {b.lat_deg:.4f}, {b.lon_deg:.4f}  {length / M_PER_NM:.1f} NM on {azimuth % 360.0:03.0f}{when}"


def _turned(deg: np.ndarray[tuple[int], np.dtype[np.float64]]) -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.mod(deg + 180.0, 360.0) - 180.0


def _way_left(route: Route) -> str:
    assert route.sailed is not None
    left = route.sailed.length_m - (route.sailed.rows[-1, 1] if len(route.sailed.rows) else 0.0)
    return f"{left / M_PER_NM:.0f} NM"


def _span(seconds: float) -> str:
    """Return a time as 1 d 05:20, or 17:05.

    >>> _span(105_600.0), _span(61_500.0)
    ('1 d 05:20', '17:05')
    """
    minutes = round(seconds / 60.0) if math.isfinite(seconds) else 0
    days, rest = divmod(minutes, 1440)
    return (f"{days} d " if days else "") + f"{rest // 60:02}:{rest % 60:02}"
