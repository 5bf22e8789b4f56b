"""A mission's boat and polar."""

from __future__ import annotations

import math
from collections.abc import Callable

from companion.boat import Boat, Hull, Polar, ardurover_sitl, avalon, constant, read_polar
from companion.errors import InputError
from companion.geofence import Mission

_POLARS: dict[str, Callable[[], Polar]] = {"ardurover": ardurover_sitl, "avalon": avalon}


def polar_of(mission: Mission) -> Polar:
    """Return the mission's polar."""
    path = mission.polar_path
    if path is not None:
        file = read_polar(path)
        if file.warnings:
            raise InputError(str(path), "", file.warnings[0], "fill it in: a guessed polar is not sailed")
        return file.polar
    polar = mission.boat.polar
    if isinstance(polar, str):
        maker = _POLARS.get(polar)
        if maker is None:
            raise InputError(str(mission.path), "[boat] polar", f"there is no polar {polar!r}",
                             'write "ardurover", "avalon", a polar file beside the mission, or a speed in m/s')
        return maker()
    return constant(float(polar))


def boat_of(mission: Mission) -> Boat:
    """Return the mission's boat; one that does not sail has no no-go zone, and tacks cost her nothing."""
    if mission.autopilot.frame == "motor":
        if isinstance(mission.boat.polar, str):
            raise InputError(str(mission.path), "[boat] polar", "a motor boat has no polar, and hers is "
                             f"{mission.boat.polar!r}", "write her speed [m/s]: polar = 2.0")
        return Boat(polar=polar_of(mission), no_go_half_rad=0.0, has_motor=True,
                    turn_rate_radps=math.radians(mission.boat.turn_rate_deg_s),
                    hull=Hull(length_m=mission.boat.length_m, beam_m=mission.boat.beam_m))
    return Boat(
        polar=polar_of(mission),
        no_go_half_rad=math.radians(mission.boat.no_go_half_deg),
        max_twa_rad=math.radians(mission.boat.max_twa_deg),
        turn_rate_radps=math.radians(mission.boat.turn_rate_deg_s),
        tack_loss_s=mission.boat.tack_loss_s,
        gybe_loss_s=mission.boat.gybe_loss_s,
        can_tack=mission.boat.can_tack,
        gybe_room_m=mission.boat.gybe_room_m,
        hull=Hull(length_m=mission.boat.length_m, beam_m=mission.boat.beam_m),
        has_motor=mission.boat.motor,
        leeway_rad=math.radians(mission.boat.leeway_deg),
        max_tws_mps=mission.boat.max_tws_mps,
        min_tws_mps=mission.boat.min_tws_mps,
        tack_fails=mission.boat.tack_fails if mission.boat.can_tack else 0.0,
    )
