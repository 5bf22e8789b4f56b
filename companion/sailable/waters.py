"""What a mission says of the current, in words for who checks it."""

from __future__ import annotations

import datetime as dt
import math

from companion.boat import can_hold
from companion.compose import boat_of, water_of
from companion.current import Prior, over_water
from companion.geofence import Mission
from companion.words import counted

_DIRECTIONS = 24


def words_of(mission: Mission, unix_s: float) -> tuple[str, ...]:
    """Return what ``[current]`` says, one thing a line; nothing without the table.

    ``unix_s``: the time now, by which a tide table is over or not yet begun. Raises InputError as ``water_of``.
    """
    if mission.current is None:
        return ()
    prior = water_of(mission)
    strongest = prior.strongest_mps
    if not prior.rows:
        lines = [(f"current: sets {math.degrees(math.atan2(prior.east_mps, prior.north_mps)) % 360.0:03.0f}° "
                 f"{strongest:.2f} m/s, give or take {prior.sigma_mps:.2f} m/s")]
    else:
        first, last = (f"{dt.datetime.fromtimestamp(row.utc_s, dt.UTC):%Y-%m-%d %H:%M}"
                       for row in (prior.rows[0], prior.rows[-1]))
        lines = [(f"current: {prior.name}, {counted(len(prior.rows), 'row')} from {first} to {last} UTC, at most "
                 f"{strongest:.2f} m/s, give or take {prior.sigma_mps:.2f} m/s")]
        said = prior.at(unix_s).verdict
        lines += [f"current: now {said}"] if said else []
    if not _holds(mission, prior):
        tws_mps = mission.wind.preview_speed_mps
        lines.append(f"current: in {tws_mps:g} m/s of wind from {mission.wind.preview_from_deg:03.0f}° she cannot make "
                     f"way against {strongest:.2f} m/s in every direction")
    return tuple(lines)


def _holds(mission: Mission, prior: Prior) -> bool:
    """Return whether she can stem the strongest of it, whichever way it sets, in the wind of previews."""
    boat, drift = boat_of(mission), prior.strongest_mps
    sets = [2.0 * math.pi * n / _DIRECTIONS for n in range(_DIRECTIONS)] if prior.rows else [
        math.atan2(prior.east_mps, prior.north_mps)]
    for set_rad in sets:
        current = drift * math.sin(set_rad), drift * math.cos(set_rad)
        from_rad, tws_mps = over_water(
            math.radians(mission.wind.preview_from_deg), mission.wind.preview_speed_mps, current)
        if not can_hold(boat, twd_from_rad=from_rad, tws_mps=tws_mps, current_en_mps=current,
                        no_go_half_rad=boat.no_go_half_rad):
            return False
    return True
