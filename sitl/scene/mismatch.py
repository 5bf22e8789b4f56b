"""A scenario's tables of what the plan does not know: current, waves, a boat and sensors that are other ones.

Every key has a range; what is outside of it is said with file and place as anything else in a scenario is.
"""

from __future__ import annotations

import math
from typing import Annotated

import msgspec

from sitl.autopilot import Departures, Sensors, Waves
from sitl.world import Lee, Stream

# What a number may be. No comparison holds for a number that is none (nan), so that is refused, too.
Share = Annotated[float, msgspec.Meta(ge=0.0, le=1.0)]
Positive = Annotated[float, msgspec.Meta(gt=0.0, le=1e6)]
Speed = Annotated[float, msgspec.Meta(ge=0.0, le=10.0)]
Degrees = Annotated[float, msgspec.Meta(ge=-360.0, le=360.0)]
Slope = Annotated[float, msgspec.Meta(ge=-10.0, le=10.0)]
Metres = Annotated[float, msgspec.Meta(ge=-1e6, le=1e6)]
Turns = Annotated[float, msgspec.Meta(ge=-1.0, le=1.0)]
Factor = Annotated[float, msgspec.Meta(ge=0.2, le=2.0)]
Leeway = Annotated[float, msgspec.Meta(ge=0.0, le=30.0)]
Swing = Annotated[float, msgspec.Meta(ge=0.0, le=45.0)]
Seconds = Annotated[float, msgspec.Meta(ge=0.0, le=600.0)]


class LeeSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """An island that takes the wind from the water behind it."""

    east_m: Metres               # its middle, from the mission's origin
    north_m: Metres
    radius_m: Positive
    loss: Share = 0.5            # of the wind's strength, close behind it
    reach_m: Positive = 150.0    # downwind of which a third of that is left


class CurrentSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The water's motion: a constant part and a tide, both stronger on one side of the water."""

    set_deg: Degrees = 0.0       # where it runs to
    drift_mps: Speed = 0.0
    tide_set_deg: Degrees = 0.0  # where the tide runs to at its greatest
    tide_mps: Speed = 0.0
    tide_s: Positive = 44_712.0  # from one such time to the next: 12.42 hours, the moon's
    tide_high_s: Metres = 0.0    # the first of them, after the start
    tide_turns: Turns = 0.0      # 0: to and fro; 1: turns with the clock; -1: against it; between: an ellipse
    shear_per_km: Slope = 0.0    # stronger by this share of itself for each km from the mission's origin ...
    shear_to_deg: Degrees = 0.0  # ... in this direction; it never turns round


class WavesSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A seaway."""

    from_deg: Degrees | None = None   # none: from where the wind is on the average
    loss: Share = 0.0            # of her speed, head to sea; half of it abeam, none with it
    yaw_deg: Swing = 0.0         # how far her bow swings to each side
    period_s: Positive = 4.0     # of that


class HullSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A boat that is not the polar's."""

    speed: Factor = 1.0          # of the polar's, at every angle, times ...
    beat: Factor = 1.0           # ... this at 45 degrees to the true wind
    reach: Factor = 1.0          # at 90
    run: Factor = 1.0            # at 150, straight between
    leeway_deg: Leeway = 0.0     # on a beat: the apparent wind 30 degrees off the bow, three times as fast as she
    tack_fails: Share = 0.0      # the chance that a tack does ...
    irons_s: Seconds = 10.0      # ... and how long she lies near head to wind then


class SensorsSpec(msgspec.Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """Sensors that err from the start to the end."""

    vane_deg: Degrees = 0.0      # the vane points so far to starboard of the wind
    compass_deg: Degrees = 0.0   # the heading is told so far to starboard
    deviation_deg: Swing = 0.0   # beside it, on the worst heading ...
    deviation_at_deg: Degrees = 0.0   # ... which is 90 degrees from this one, on which it is none
    gps_noise_m: Annotated[float, msgspec.Meta(ge=0.0, le=100.0)] = 0.0   # spread, east and north each, wandering ...
    gps_noise_s: Positive = 30.0      # ... with this correlation time
    gps_lag_s: Seconds = 0.0     # the position is so old


def stream_of(spec: CurrentSpec) -> Stream:
    """Return the stream of a scenario's table."""
    return Stream(
        set_to_rad=math.radians(spec.set_deg), drift_mps=spec.drift_mps, tide_to_rad=math.radians(spec.tide_set_deg),
        tide_mps=spec.tide_mps, tide_s=spec.tide_s, tide_high_s=spec.tide_high_s, tide_turns=spec.tide_turns,
        shear_per_km=spec.shear_per_km, shear_to_rad=math.radians(spec.shear_to_deg))


def lee_of(spec: LeeSpec) -> Lee:
    """Return the island of a scenario's table."""
    return Lee(en_m=(spec.east_m, spec.north_m), radius_m=spec.radius_m, loss=spec.loss, reach_m=spec.reach_m)


def departures_of(
    boat: HullSpec | None, waves: WavesSpec | None, sensors: SensorsSpec | None, wind_from_deg: float,
) -> Departures | None:
    """Return what a boat is that is not the plan's; None where no table says so."""
    if boat is None and waves is None and sensors is None:
        return None
    hull, sea, told = boat or HullSpec(), waves or WavesSpec(), sensors or SensorsSpec()
    return Departures(
        beat=hull.speed * hull.beat, reach=hull.speed * hull.reach, run=hull.speed * hull.run,
        leeway_rad=math.radians(hull.leeway_deg), tack_fails=hull.tack_fails, irons_s=hull.irons_s,
        waves=Waves(from_rad=math.radians(wind_from_deg if sea.from_deg is None else sea.from_deg), loss=sea.loss,
                    yaw_rad=math.radians(sea.yaw_deg), period_s=sea.period_s),
        sensors=Sensors(
            vane_rad=math.radians(told.vane_deg), compass_rad=math.radians(told.compass_deg),
            deviation_rad=math.radians(told.deviation_deg), deviation_at_rad=math.radians(told.deviation_at_deg),
            gps_noise_m=told.gps_noise_m, gps_noise_s=told.gps_noise_s, gps_lag_s=told.gps_lag_s))
