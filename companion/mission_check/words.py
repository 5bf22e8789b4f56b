"""A mission in words: its current, its passage, the winds that it sets sail in, what is waited for."""

from __future__ import annotations

import datetime as dt
import math
from itertools import pairwise

from companion.boat import AutopilotLimits, can_hold, required_margin
from companion.compose import RECENTRE_M, boat_of, drying_of, tide_of, voyage_of, water_of
from companion.current import Prior, hour_words, over_water, span_words
from companion.geo.angles import direction, heading_of
from companion.geo.frame import LocalFrame
from companion.geofence import Mission
from companion.geofence.mission import MissionGoal
from companion.safety import LIGHT_WIND, STRONG_WIND
from companion.words import counted, listed

_DIRECTIONS = 24
MARGIN_HAIR_M = 0.5  # as under way, where no less is spoken of
MOST_NAMED = 3  # pieces of water that dries; of more their number is told


def current_words_of(mission: Mission, unix_s: float) -> tuple[str, ...]:
    """Return what ``[current]`` says, one thing a line; nothing without the table.

    ``unix_s``: the time now, by which a tide table is over or not yet begun. Raises InputError as ``water_of``.
    """
    if mission.current is None:
        return ()
    prior = water_of(mission)
    strongest = prior.strongest_mps
    if not prior.rows:
        lines = [
            (
                f"current: sets {direction(heading_of(prior.east_mps, prior.north_mps))}° "
                f"{strongest:.2f} m/s, give or take {prior.sigma_mps:.2f} m/s"
            )
        ]
    else:
        first, last = (
            f"{dt.datetime.fromtimestamp(row.utc_s, dt.UTC):%Y-%m-%d %H:%M}" for row in (prior.rows[0], prior.rows[-1])
        )
        lines = [
            (
                f"current: {prior.name}, {counted(len(prior.rows), 'row')} from {first} to {last} UTC, at most "
                f"{strongest:.2f} m/s, give or take {prior.sigma_mps:.2f} m/s"
            )
        ]
        said = prior.at(unix_s).verdict
        lines += [f"current: now {said}"] if said else []
    if not _holds(mission, prior):
        tws_mps = mission.wind.preview_speed_mps
        lines.append(
            f"current: in {tws_mps:g} m/s of wind "
            f"from {direction(math.radians(mission.wind.preview_from_deg))}° she cannot make "
            f"way against {strongest:.2f} m/s in every direction"
        )
    return tuple(lines)


def tide_words_of(mission: Mission, unix_s: float) -> str:
    """Return how high the tide stands by the mission's table at a Unix time, and what dries that is closed then.

    Empty without water that dries. Raises InputError as ``tide_of``.
    """
    table = tide_of(mission) if mission.drying else None
    if table is None:
        return ""
    at = f"tide at {hour_words(unix_s)}"
    height_m = table.height_m(unix_s)
    if height_m is None:
        return f"{at}: not known: {span_words(table)}; all that dries is closed"
    waters = drying_of(mission, mission.frame())
    closed = [w for w in waters if w.is_closed(table, unix_s, 0.0)]
    if not closed:
        return f"{at}: {height_m:.2f} m by {table.name}; what dries is open"
    opens_s = min(w.closed_s(table, unix_s)[0][1] for w in closed)
    opens = f"the first opens at {hour_words(unix_s + opens_s)}" if math.isfinite(opens_s) else "none opens by it again"
    names = listed([w.name for w in closed]) if len(closed) <= MOST_NAMED else counted(len(closed), "piece")
    return f"{at}: {height_m:.2f} m by {table.name}; closed of what dries: {names}; {opens}"


def _holds(mission: Mission, prior: Prior) -> bool:
    """Return whether the boat can stem the strongest of it, whichever way it sets, in the wind of previews."""
    boat, drift = boat_of(mission), prior.strongest_mps
    sets = (
        [2.0 * math.pi * n / _DIRECTIONS for n in range(_DIRECTIONS)]
        if prior.rows
        else [math.atan2(prior.east_mps, prior.north_mps)]
    )
    for set_rad in sets:
        current = drift * math.sin(set_rad), drift * math.cos(set_rad)
        from_rad, tws_mps = over_water(
            math.radians(mission.wind.preview_from_deg), mission.wind.preview_speed_mps, current
        )
        if not can_hold(
            boat, twd_from_rad=from_rad, tws_mps=tws_mps, current_en_mps=current, no_go_half_rad=boat.no_go_half_rad
        ):
            return False
    return True


def passage_words(mission: Mission) -> str:
    """Return in words what a passage is: how far, in which waters, how far a plan looks."""
    if mission.start is None:
        return "a passage from wherever she lies"
    places = [mission.start, *(goal.point for goal in mission.goals)]
    lengths_km = [math.hypot(*LocalFrame(a).en_from_geo(b)) / 1000.0 for a, b in pairwise(places)]
    bands = sorted({goal.bandwidth_m for goal in voyage_of(mission).goals if goal.bandwidth_m is not None})
    widths = " to ".join(dict.fromkeys(f"{band / 1000.0:.3g}" for band in bands[:1] + bands[-1:]))
    band = f"bands of {widths} km to either side" if bands else "no band"
    return (
        f"a passage of {sum(lengths_km):.0f} km, the longest leg {max(lengths_km):.0f} km, {band}; "
        f"plans for {mission.skipper.horizon_m / 1000.0:g} km at a time, the frame moves along every "
        f"{(mission.passage.recentre_m or RECENTRE_M) / 1000.0:g} km"
    )


def margin_words(mission: Mission) -> tuple[str, ...]:
    """Return what is worth knowing of the margin, by ArduRover's default parameters in the wind of previews."""
    margin_m, floor_m = mission.margin_m, mission.options.area.margin_floor_m
    lines: list[str] = []
    if floor_m > margin_m:
        lines.append(f"[area] margin_floor_m: {floor_m:g} m is more than margin_m and is taken as {margin_m:g} m")
    is_bare = not (mission.area.solids or mission.area.fence.zones)
    if is_bare or mission.autopilot.frame == "motor":
        return tuple(lines)
    boat = boat_of(mission)
    speed_mps = boat.polar.max_speed_mps(mission.wind.preview_speed_mps)
    asked = required_margin(AutopilotLimits(), speed_mps=speed_mps, hull=boat.hull)
    if asked.total_m > margin_m + MARGIN_HAIR_M:
        lines.append(
            f"[area] margin_m: {margin_m:g} m; in {mission.wind.preview_speed_mps:g} m/s of wind the habits of an "
            f"autopilot of ArduRover's default parameters ask for {asked.describe()}; companion doctor asks yours"
        )
    return tuple(lines)


def wind_limit_words(mission: Mission) -> str:
    """Return in words the winds that the boat sets sail in, empty: in any."""
    boat = mission.boat
    limits = [
        f"{word} {limit:g} m/s"
        for word, limit in (("more than", boat.max_tws_mps), ("less than", boat.min_tws_mps))
        if limit is not None
    ]
    if not limits:
        return ""
    allowed = 100.0 * (1.0 - mission.risk.delta_s)
    strong, light = (mission.safety.end(name).value for name in (STRONG_WIND, LIGHT_WIND))
    return (
        f"she does not set sail where {' or '.join(limits)} of wind is forecast with over {allowed:.0f} % at any "
        f"instant of the plan; under way [safety] has {strong!r} for strong wind and {light!r} for light"
    )


def is_of_unknown_length(goal: MissionGoal) -> bool:
    """Return whether nobody knows how long the task of a goal takes: a search, or a stay until told."""
    task = goal.box or goal.field
    return goal.search is not None or (task is not None and task.for_s is None)


def wait_words(goal: MissionGoal, wait_s: float) -> str:
    """Return in words what the plan of the leg to a goal does not sail, for who reads its time; empty: nothing."""
    gate = goal.gate
    if gate is not None and gate.not_before_s is not None:
        return f"the gun is at {dt.datetime.fromtimestamp(gate.not_before_s, dt.UTC):%Y-%m-%d %H:%M:%S} UTC"
    if gate is not None and gate.after_s is not None:
        return f"then waits {wait_s:.0f} s for the gun" if wait_s > 0.0 else "the gun is before that"
    if goal.search is not None:
        return "then the search, which is not counted"
    if (task := goal.box or goal.field) is not None:
        return "then stays until told, which is not counted" if task.for_s is None else f"then stays {task.for_s:.0f} s"
    return ""
