"""Whether a mission can be sailed as it stands: one validation for who checks it, who sails it and who simulates it."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from companion.compose import (
    config_of,
    displays_of,
    estimator_of,
    feeds_of,
    field_findings_of,
    permissions_of,
    require_fields,
    target_limits_of,
    voyage_of,
    water_of,
)
from companion.errors import InputError
from companion.geofence import Code, Finding, Mission, Severity
from companion.geofence.check import Conditions, check_area
from companion.geofence.mission import AreaOptions, kind_of, place_troubles, read_mission


@dataclass(frozen=True, slots=True, kw_only=True)
class Judged:
    """A mission file as the boat would read it.

    Attributes:
        mission: None when it cannot be read at all.
        refusals: why it must not be sailed; the first is what ``load_mission`` or ``require_sailable`` raises.
        findings: what else is wrong or worth knowing, worst first.
    """

    mission: Mission | None
    refusals: tuple[InputError, ...] = ()
    findings: tuple[Finding, ...] = ()


def judge(path: Path, *, from_deg: float | None = None, given: Mapping[Path, bytes] | None = None) -> Judged:
    """Read a mission and its area as the boat will, and look for what is wrong with it: never raises InputError.

    ``from_deg``: where the wind comes from, in which gaps are looked at (else the mission's). ``given``: see
    ``load_mission``.
    """
    try:
        mission = read_mission(path, given or {})
        troubles = tuple(InputError(str(path), *trouble) for trouble in place_troubles(mission))
        if not troubles:
            require_sailable(mission)
    except InputError as error:
        return Judged(mission=None, refusals=(error,))
    found = check_area(mission.area, Conditions(
        start=mission.start, goals=tuple(g.point for g in mission.goals), margin_m=mission.margin_m,
        is_passage=mission.is_passage,
        twd_from_rad=math.radians(mission.wind.preview_from_deg if from_deg is None else from_deg),
        no_go_half_rad=math.radians(mission.boat.no_go_half_deg)))
    told = {Code.START_OUTSIDE, Code.GOAL_OUTSIDE} if troubles else set()
    return Judged(mission=mission, refusals=troubles, findings=(
        *mission.findings, *(() if troubles else field_findings_of(mission)),
        *(f for f in found if f.severity is not Severity.ERROR or f.code not in told)))


def require_sailable(mission: Mission) -> Mission:
    """Return the mission; raise InputError for what would fail, or be passed over in silence, under way.

    ``load_mission`` has seen to each key by itself and to the places; here everything that a voyage is made of is made
    once, and keys that contradict each other are refused.
    """
    source = str(mission.path)
    _require_consistent(mission, source)
    try:
        estimator_of(mission)
        feeds_of(mission)
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


def _require_consistent(mission: Mission, source: str) -> None:
    area, operator, skipper = mission.options.area, mission.operator, mission.skipper
    if area.margin_floor_m > max(area.margin_m, AreaOptions().margin_floor_m):
        raise InputError(source, "[area] margin_floor_m",
                         f"{area.margin_floor_m:g} m is more than margin_m, {area.margin_m:g} m",
                         "the margin is reduced down to the floor: write a smaller floor or a larger margin")
    boat = mission.boat
    if boat.max_tws_mps is not None and boat.min_tws_mps is not None and boat.min_tws_mps >= boat.max_tws_mps:
        raise InputError(source, "[boat] min_tws_mps",
                         f"{boat.min_tws_mps:g} m/s is not below max_tws_mps, {boat.max_tws_mps:g} m/s",
                         "no wind is both: write a smaller min_tws_mps or a larger max_tws_mps")
    limit = next((key for key in ("max_tws_mps", "min_tws_mps") if getattr(boat, key) is not None), None)
    if limit is not None and mission.autopilot.frame == "motor":
        raise InputError(source, f"[boat] {limit}", "is for a boat that sails: no wind is looked at for a motor boat",
                         'leave it out, or write frame = "sailboat" in [autopilot]')
    missing = [key for key in ("guided", "set_auto") if not getattr(operator, key)]
    if skipper.guidance != "plan" and missing:
        raise InputError(source, "[skipper] guidance", f'"{skipper.guidance}" steers in GUIDED, which nobody allows',
                         f"write {' and '.join(f'{key} = true' for key in missing)} in [operator], "
                         'or guidance = "plan"')
    if skipper.guidance == "heading" and mission.autopilot.frame == "motor":
        raise InputError(source, "[skipper] guidance", '"heading" is for a boat that sails',
                         'write guidance = "plan" or "field", or frame = "sailboat" in [autopilot]')
    by_field = next((n for n, goal in enumerate(mission.goals, start=1) if goal.field is not None), None)
    if by_field is not None and missing:
        raise InputError(source, f"[[goal]] {by_field} kind", "a field is steered in GUIDED, which nobody allows",
                         f"write {' and '.join(f'{key} = true' for key in missing)} in [operator]")
    kinds = [(n, kind_of(goal)) for n, goal in enumerate(mission.options.goal, start=1)]
    task = next(((n, kind) for n, kind in kinds if kind not in {"point", "field"}), None)
    if skipper.guidance != "plan" and task is not None:
        raise InputError(source, "[skipper] guidance", f'"{skipper.guidance}" knows nothing of the {task[1]}, [[goal]] '
                         f"{task[0]}", 'write guidance = "plan"')
    passage = mission.passage
    if passage.leg_m is None and passage.recentre_m is not None:
        raise InputError(source, "[passage] recentre_m", "is of a passage, and nothing says how long its legs are",
                         "add leg_m, the longest leg in metres, or leave it out")
    if skipper.max_replan_s is not None and skipper.max_replan_s < skipper.min_replan_s:
        raise InputError(source, "[skipper] max_replan_s",
                         f"{skipper.max_replan_s:g} s is less than min_replan_s, {skipper.min_replan_s:g} s",
                         "write a larger one, or a smaller min_replan_s")
    if operator.upload_fence and not (mission.area.solids or mission.area.fence.zones):
        raise InputError(source, "[operator] upload_fence", "there is no area to make a fence of",
                         "name its files in [area], or write upload_fence = false")
