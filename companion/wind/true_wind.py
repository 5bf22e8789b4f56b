"""True wind from apparent wind, heading and ground velocity, and back.

With all vectors in the local east-north frame and "from" vectors pointing at where the wind comes from,

    A = W + V,     A = aws (sin(heading + awa), cos(heading + awa)),    twd = atan2(W_east, W_north)        (a)

where A is the apparent and W the true wind's from-vector and V the boat's velocity: sailing into the wind adds to
it. V over ground gives wind over ground, which is what ArduRover reports. The combination is made of readings
of one instant and before any filter: filtering first and combining afterwards puts a false shift into every tack
(ArduPilot pull request 17139).
"""

from __future__ import annotations

import math

from companion.geo.angles import heading_of, wrap_pi
from companion.messages import ApparentWind, VehicleState, WindQuality, WindSample, WindSource

LIGHT_MPS = 1.0  # [m/s] below this the direction is nearly without meaning (recorded wind)
TURNING_RADPS = math.radians(10.0)  # [rad/s] no wave, a manoeuvre: compass and vane lag
STALE_S = 1.0  # [s] apparent wind and vehicle further apart than this are not one instant


def true_wind(apparent: ApparentWind, vehicle: VehicleState) -> WindSample:
    """Return the unfiltered true wind over ground.

    Its quality is TURNING in a manoeuvre, LIGHT below 1 m/s, SUSPECT when the two readings are not of one instant.

    >>> from companion.messages import GeoPoint
    >>> boat = VehicleState(t_s=0.0, boot_s=0.0, position=GeoPoint(lat_deg=0, lon_deg=0),
    ...                     velocity_en_mps=(0.0, 3.0), heading_rad=0.0)
    >>> wind = true_wind(ApparentWind(t_s=0.0, awa_rad=math.radians(45.0), aws_mps=3.0 * 2**0.5), boat)
    >>> round(math.degrees(wind.twd_from_rad)), round(wind.tws_mps, 3)   # north at 3 m/s, 3 m/s from the east
    (90, 3.0)
    """
    angle = vehicle.heading_rad + apparent.awa_rad
    ve, vn = vehicle.velocity_en_mps
    east, north = apparent.aws_mps * math.sin(angle) - ve, apparent.aws_mps * math.cos(angle) - vn  # (a)
    speed = math.hypot(east, north)
    if abs(apparent.t_s - vehicle.t_s) > STALE_S:
        quality = WindQuality.SUSPECT
    elif vehicle.yaw_rate_radps is not None and abs(vehicle.yaw_rate_radps) > TURNING_RADPS:
        quality = WindQuality.TURNING
    elif speed < LIGHT_MPS:
        quality = WindQuality.LIGHT
    else:
        quality = WindQuality.GOOD
    return WindSample(
        t_s=apparent.t_s,
        twd_from_rad=heading_of(east, north) if speed > 0.0 else wrap_pi(angle),
        tws_mps=min(100.0, speed),
        source=WindSource.APPARENT,
        quality=quality,
    )


def apparent_wind(sample: WindSample, vehicle: VehicleState) -> ApparentWind:
    """Return the wind that the boat would feel in this true wind over ground (the inverse of ``true_wind``)."""
    ve, vn = vehicle.velocity_en_mps
    east = sample.tws_mps * math.sin(sample.twd_from_rad) + ve  # (a)
    north = sample.tws_mps * math.cos(sample.twd_from_rad) + vn
    return ApparentWind(
        t_s=sample.t_s,
        awa_rad=wrap_pi(heading_of(east, north) - vehicle.heading_rad),
        aws_mps=min(100.0, math.hypot(east, north)),
    )
