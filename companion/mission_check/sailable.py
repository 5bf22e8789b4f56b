"""Whether a mission may be sailed: keys that contradict each other are refused, and what would fail under way."""

from __future__ import annotations

from companion.compose import (
    config_of,
    displays_of,
    estimator_of,
    feeds_of,
    permissions_of,
    require_fields,
    sounder_of,
    target_limits_of,
    voyage_of,
    water_of,
)
from companion.errors import InputError
from companion.geofence import Mission
from companion.geofence.mission import AreaOptions, kind_of


def require_sailable(mission: Mission) -> Mission:
    """Return the mission; raise InputError for what would fail, or be passed over in silence, under way.

    ``load_mission`` has seen to each key by itself and to the places; here everything that a voyage is made of is made
    once, and keys that contradict each other are refused.
    """
    source = str(mission.path)
    _require_water_and_wind(mission, source)
    _require_guidance(mission, source)
    _require_voyage(mission, source)
    try:
        estimator_of(mission)
        feeds_of(mission)
        sounder_of(mission)
        displays_of(mission)
        permissions_of(mission)
        target_limits_of(mission)
        config_of(mission)
        require_fields(mission)
        voyage_of(mission)
        water_of(mission)
    except ValueError as error:
        raise InputError(source, "", str(error)) from error
    return mission


def _require_water_and_wind(mission: Mission, source: str) -> None:
    """Refuse a margin that its floor is above, and limits of the wind that no wind is within or nobody looks at."""
    area = mission.options.area
    if area.margin_floor_m > max(area.margin_m, AreaOptions().margin_floor_m):
        raise InputError(
            source,
            "[area] margin_floor_m",
            f"{area.margin_floor_m:g} m is more than margin_m, {area.margin_m:g} m",
            "the margin is reduced down to the floor: write a smaller floor or a larger margin",
        )
    boat = mission.boat
    if boat.max_tws_mps is not None and boat.min_tws_mps is not None and boat.min_tws_mps >= boat.max_tws_mps:
        raise InputError(
            source,
            "[boat] min_tws_mps",
            f"{boat.min_tws_mps:g} m/s is not below max_tws_mps, {boat.max_tws_mps:g} m/s",
            "no wind is both: write a smaller min_tws_mps or a larger max_tws_mps",
        )
    limit = next((key for key in ("max_tws_mps", "min_tws_mps") if getattr(boat, key) is not None), None)
    if limit is not None and mission.autopilot.frame == "motor":
        raise InputError(
            source,
            f"[boat] {limit}",
            "is for a boat that sails: no wind is looked at for a motor boat",
            'leave it out, or write frame = "sailboat" in [autopilot]',
        )


def _require_guidance(mission: Mission, source: str) -> None:
    """Refuse a guidance that nobody allows, or that cannot sail this boat or these goals."""
    operator, skipper = mission.operator, mission.skipper
    missing = [key for key in ("guided", "set_auto") if not getattr(operator, key)]
    if skipper.guidance != "plan" and missing:
        raise InputError(
            source,
            "[skipper] guidance",
            f'"{skipper.guidance}" steers in GUIDED, which nobody allows',
            f'write {" and ".join(f"{key} = true" for key in missing)} in [operator], or guidance = "plan"',
        )
    if skipper.guidance == "heading" and mission.autopilot.frame == "motor":
        raise InputError(
            source,
            "[skipper] guidance",
            '"heading" is for a boat that sails',
            'write guidance = "plan" or "field", or frame = "sailboat" in [autopilot]',
        )
    by_field = next((n for n, goal in enumerate(mission.goals, start=1) if goal.field is not None), None)
    if by_field is not None and missing:
        raise InputError(
            source,
            f"[[goal]] {by_field} kind",
            "a field is steered in GUIDED, which nobody allows",
            f"write {' and '.join(f'{key} = true' for key in missing)} in [operator]",
        )
    kinds = [(n, kind_of(goal)) for n, goal in enumerate(mission.options.goal, start=1)]
    task = next(((n, kind) for n, kind in kinds if kind not in {"point", "field"}), None)
    if skipper.guidance != "plan" and task is not None:
        raise InputError(
            source,
            "[skipper] guidance",
            f'"{skipper.guidance}" knows nothing of the {task[1]}, [[goal]] {task[0]}',
            'write guidance = "plan"',
        )


def _require_voyage(mission: Mission, source: str) -> None:
    """Refuse keys of a passage, of planning again and of the fence that are without what they belong to."""
    passage, skipper = mission.passage, mission.skipper
    if passage.leg_m is None and passage.recentre_m is not None:
        raise InputError(
            source,
            "[passage] recentre_m",
            "is of a passage, and nothing says how long its legs are",
            "add leg_m, the longest leg in metres, or leave it out",
        )
    if skipper.max_replan_s is not None and skipper.max_replan_s < skipper.min_replan_s:
        raise InputError(
            source,
            "[skipper] max_replan_s",
            f"{skipper.max_replan_s:g} s is less than min_replan_s, {skipper.min_replan_s:g} s",
            "write a larger one, or a smaller min_replan_s",
        )
    if mission.operator.upload_fence and not (mission.area.solids or mission.area.fence.zones):
        raise InputError(
            source,
            "[operator] upload_fence",
            "there is no area to make a fence of",
            "name its files in [area], or write upload_fence = false",
        )
