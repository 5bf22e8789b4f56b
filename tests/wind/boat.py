"""A boat that sails in a simulated wind, with a wind sensor that can be broken."""

import math
from dataclasses import replace

from companion.messages import ApparentWind, GeoPoint, VehicleState, WindSample, WindSource
from companion.wind import WindTracker, apparent_wind
from lab.simulated_wind import weather

HERE = GeoPoint(lat_deg=47.0, lon_deg=8.0)


def voyage(*, seconds=1500.0, seed=5, speed_mps=6.0, leg_s=120.0, dt_s=1.0, boat_mps=2.0, mean_rad=0.3, noise_rad=0.03):
    """Yield (vehicle, apparent, true direction): a beat with a tack every ``leg_s``, the tack taking 6 s."""
    record = weather(seed, seconds=seconds, dt_s=dt_s, speed_mps=speed_mps, mean_rad=mean_rad, noise_rad=noise_rad)
    close = math.radians(48.0)
    for t, twd, tws in zip(record.t_s, record.twd_from_rad, record.tws_mps, strict=True):
        phase = t % (2.0 * leg_s)
        side = 1.0 if phase < leg_s else -1.0
        into = min(1.0, (phase % leg_s) / 6.0) if t > leg_s / 2 else 1.0
        angle = close * side * (2.0 * into - 1.0)
        yaw = math.radians(2.0) * math.sin(t / 2.3)  # she yaws in the waves
        heading = mean_rad - angle + yaw
        velocity = (boat_mps * math.sin(heading), boat_mps * math.cos(heading))
        boat = VehicleState(t_s=float(t), boot_s=float(t), position=HERE, velocity_en_mps=velocity, heading_rad=heading)
        true = WindSample(t_s=float(t), twd_from_rad=float(twd), tws_mps=float(tws), source=WindSource.SIMULATED)
        yield boat, apparent_wind(true, boat), true


def sail(fault=None, *, parameters=None, room=None, **options):
    """Sail with ``fault(t, boat, apparent) -> apparent or None``; return [(t, status)] and the room."""
    room = room or WindTracker(parameters)
    log = []
    for boat, felt, _ in voyage(**options):
        room.update(boat)
        broken = felt if fault is None else fault(boat.t_s, boat, felt)
        if broken is not None:
            log.append((boat.t_s, room.update(broken)))
    return log, room


def turned(felt: ApparentWind, angle_rad: float) -> ApparentWind:
    """Return what a vane turned clockwise by an angle reads."""
    return replace(felt, awa_rad=(felt.awa_rad + angle_rad + math.pi) % (2.0 * math.pi) - math.pi)
