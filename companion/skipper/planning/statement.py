"""From a snapshot to a planning problem: start, goal, grown obstacles, the forecast, the boat.

Büsser's section 4.2: the way between two global waypoints has a bandwidth, and the local plan covers only the
next few miles of it. Both are cut here, so the planner sees one fence and one goal.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from statistics import NormalDist
from typing import Any

import numpy as np
import shapely
from pyproj import Geod
from shapely.geometry import LineString, Polygon

from companion.boat import Boat
from companion.current import STILL_WATER, WaterCurrent, WindAngleUncertainty, forecast_over_water
from companion.geo.angles import difference_rad, wrap_two_pi
from companion.geo.distinct import distinct
from companion.geo.frame import LocalFrame
from companion.geofence.area import grown_m
from companion.messages import WindForecast
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.snapshot import SpeedSeen
from companion.skipper.step.wind_limits import strength_of
from companion.skipper.way import Gate, PointEn, Voyage, bearing_rad, distance_m, half_width_rad, mean_twd_rad, moved
from companion.skipper.way.gates import marks_of
from companion.skipper.way.line import STRAY_M
from companion.skipper.way.shortest import shortest_way
from companion.skipper.way.stemming import Water
from companion.skipper.way.voyage import AreaLike, outside_m, water_to_keep

# The last ones are for a boat that has drifted out of the fence; nobody is led so far past anything solid.
REPAIR_RINGS_M = (
    3.0,
    6.0,
    10.0,
    15.0,
    20.0,
    30.0,
    45.0,
    60.0,
    90.0,
    140.0,
    210.0,
    320.0,
    480.0,
    720.0,
    1080.0,
    1620.0,
    2430.0,
    3645.0,
)
REPAIR_DIRECTIONS = 24
BACK_TRIES = 3  # to find a way back inside: each takes some hundredths of a second of the loop
BACK_M = 80.0  # to either side of that way a plan may lead: room to beat
NOTCH = 2.0  # radius of the notch as a multiple of what the start lacks: room to turn out of it
LEG_SAVING = 8e-5  # share of a plan's time that a leg must save: each is an item to upload and a plan to make again
HAIR_M = 0.2  # a repaired point stands this far clear of the margin it was repaired for
PIECE_M = 2000.0  # a geodesic is off a chord of this length by 8 cm at most, at 75 degrees of latitude too
MOST_LEVEL = 0.9999  # of an interval: beyond it no normal distribution tells
NEAR_SHARES, NEAR_COUNT = (0.2, 0.4, 0.6, 0.8), 24  # of an aim's radius, and how many places all round
_EARTH = Geod(ellps="WGS84")


@dataclass(frozen=True, slots=True, kw_only=True)
class Start:
    """Where a plan begins: the point, the heading there, when, and how it had to be repaired.

    ``lead_in`` are waypoints before it; ``notch_m`` is the radius of a notch that is cut into the margin around it.
    ``back_en`` is a way about which the limits are opened to a boat that is outside of them.
    """

    en_m: PointEn
    heading_rad: float
    after_s: float = 0.0
    lead_in: tuple[PointEn, ...] = ()
    notch_m: float = 0.0
    back_en: tuple[PointEn, ...] = ()
    text: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Aim:
    """Where a plan ends: the point, its radius, and the gate that it completes (-1: none)."""

    en_m: PointEn
    radius_m: float
    gate: int


def wind_part(
    forecast: WindForecast, *, after_s: float, length_s: float, delta_s: float, is_known: bool = True
) -> dict[str, Any]:
    """Return the ``wind`` of a problem that starts ``after_s`` from the forecast's moment.

    The planner takes one mean direction: the forecast's, averaged over the plan's length. How far the forecast's
    mean is from it at each horizon is added to the half width that the no-go zone is widened by, so that a forecast
    that swings is not forgotten. The half width is that of the central interval of probability 2 delta_s - 1.
    """
    horizons = forecast.horizon_s
    times = distinct(np.concatenate([[0.0], np.clip(horizons - after_s, 0.0, None)]))
    span = times[times <= max(length_s, times[min(1, times.shape[0] - 1)])]
    means = np.array([mean_twd_rad(forecast, after_s + float(t)) for t in span])
    mean = math.atan2(float(np.mean(np.sin(means))), float(np.mean(np.cos(means))))
    speed = float(np.mean(np.interp(after_s + span, horizons, forecast.mean_tws_mps)))
    sigma = np.interp(after_s + times, horizons, forecast.sigma_twd_rad)
    level = 2.0 * delta_s - 1.0
    half = np.array([half_width_rad(forecast, after_s + float(t), level) for t in times])
    offset = np.abs([difference_rad(mean_twd_rad(forecast, after_s + float(t)), mean) for t in times])
    return {
        "from_deg": math.degrees(wrap_two_pi(mean)),
        "speed_mps": speed,
        "sigma": {
            "model": "forecast",
            "horizon_s": [float(t) for t in times],
            "sigma_deg": [float(x) for x in np.degrees(np.hypot(sigma, offset))],
            "half_width_deg": [float(x) for x in np.degrees(half + offset)],
        },
        "strength": strength_of(forecast, after_s=after_s, is_known=is_known).to_dict(),
    }


def planned_forecast(
    boat: Boat, forecast: WindForecast, half_rad: float, doubt: WindAngleUncertainty | None
) -> tuple[WindForecast, float]:
    """Return the forecast by which plans widen the no-go zone, and how much wider than the boat's it is without [rad].

    The forecast has what the sensors and the boat's file may err by. The second is what the boat has shown of the
    wind's angle to her bow: by so much more than her leeway it is less than that to her course, on either tack.
    ``half_rad`` is the bow's angle to the wind that is kept out of; ``doubt``: of the wind's angle on a leg.
    """
    speed, nearer_rad = float(np.max(forecast.mean_tws_mps)), 0.0
    if doubt is not None:
        on_a_beat = {
            "beat_rad": half_rad,
            "speed_mps": boat.polar.speed_mps(half_rad, speed),
            "leeway_rad": boat.made_good_rad(half_rad, speed) - half_rad,
        }
        nearer_rad = doubt.nearer_rad(forecast, **on_a_beat)
        forecast = doubt.widened(forecast, **on_a_beat)
    if boat.no_go_error_rad > 0.0:
        forecast = with_no_go_error(forecast, boat.no_go_error_rad)
    return forecast, nearer_rad


def with_no_go_error(forecast: WindForecast, error_rad: float) -> WindForecast:
    """Return the forecast with the doubt of the no-go zone's half angle in its direction's spread.

    What the boat's zone may be wider by keeps it out of the wind no less than a shift does, and has nothing to do with
    one: deviations add by their squares, and so do the half widths that they keep within a probability.
    """
    z = np.array([NormalDist().inv_cdf(0.5 + 0.5 * min(float(level), MOST_LEVEL)) for level in forecast.level])
    return replace(
        forecast,
        sigma_twd_rad=np.minimum(np.hypot(forecast.sigma_twd_rad, error_rad), math.pi),
        half_width_rad=np.minimum(np.hypot(forecast.half_width_rad, z * error_rad), math.pi),
    )


def repaired(
    voyage: Voyage,
    start: Start,
    *,
    margin_m: float,
    floor_m: float,
    twd_from_rad: float | None,
    water: Water | None = None,
) -> Start:
    """Return the start made plannable if it is nearer than ``margin_m`` to an obstacle or limit.

    Down to ``floor_m`` the margin around it gets a notch, so that the plan begins where the boat is. Nearer than
    that, or inside, the plan begins in free water and a lead-in goes there: from the boat to the nearest free point
    on a line that never comes nearer to the obstacle than the boat is now, nor nearer than ``floor_m`` to any that it
    is clear of; of equally near ones the one that is not upwind. In ``water`` that runs it is the one that the boat is
    soonest at: the nearest may lie up the stream. Outside of the autopilot's fence and within the mission's own, which
    may be the shore, the limits are opened about a way back inside.
    """
    asked_m, margin_m = margin_m, grown_m(margin_m)  # as the water is drawn that a plan may begin in
    area, back = voyage.area, _back_inside(voyage.area, start, margin_m=margin_m, floor_m=floor_m)
    if back:
        out_m, area = outside_m(area, start.en_m), water_to_keep(area, start.en_m)
        start = replace(start, back_en=back, text=f"the start is {out_m:.0f} m outside the fence: planned back into it")
    here = float(area.clearance_m([start.en_m])[0])
    solid_m = min(floor_m, float(area.unfenced.clearance_m([start.en_m])[0])) - HAIR_M
    spare_m, over_floor_m = (float(area.spare_m([start.en_m], m)[0]) for m in (asked_m, floor_m))
    if spare_m >= 0.0:
        return start
    if over_floor_m >= 0.0:
        text = f"the start is {here:.1f} m from an obstacle or limit: the margin gets a notch around it"
        return replace(start, notch_m=HAIR_M - NOTCH * spare_m, text="; ".join(filter(None, (start.text, text))))
    best: tuple[float, PointEn, float] | None = None
    courses = [2.0 * math.pi * n / REPAIR_DIRECTIONS for n in range(REPAIR_DIRECTIONS)]
    made_mps = {course: None if water is None else water.made_good_mps(course) for course in courses}
    fastest_mps = max((made for made in made_mps.values() if made is not None), default=math.inf)
    for ring_m in REPAIR_RINGS_M:
        if best is not None and (water is None or ring_m / fastest_mps >= best[0]):
            break
        for course in courses:
            made = made_mps[course]
            if water is not None and made is None:
                continue
            place = moved(start.en_m, course, ring_m)
            if float(area.spare_m([place], asked_m)[0]) < HAIR_M:
                continue
            way = np.linspace(start.en_m, place, 9)
            if float(np.min(area.clearance_m(way))) < here - HAIR_M:
                continue
            if solid_m > 0.0 and area.unfenced.path_clearance_m(way) < solid_m:
                continue
            upwind = twd_from_rad is not None and abs(difference_rad(course, twd_from_rad)) < math.radians(55.0)
            cost = ring_m * (3.0 if upwind else 1.0) + abs(difference_rad(course, start.heading_rad))
            if made is not None:
                cost = ring_m / made
            if best is None or cost < best[0]:
                best = (cost, place, ring_m)
    if best is None:
        if water is None:
            return start
        return repaired(voyage, start, margin_m=margin_m, floor_m=floor_m, twd_from_rad=twd_from_rad)  # she may yet
    _, place, ring_m = best
    text = f"the start is {here:.1f} m from an obstacle or limit: led {ring_m:.0f} m into free water first"
    return replace(
        start,
        en_m=place,
        heading_rad=bearing_rad(start.en_m, place),
        lead_in=(place,),
        text="; ".join(filter(None, (start.text, text))),
    )


def _back_inside(area: AreaLike, start: Start, *, margin_m: float, floor_m: float) -> tuple[PointEn, ...]:
    """Return a way round what is solid to the roomiest place of the nearest ring that has one inside the limits.

    Empty where she is not outside, or outside of the mission's own, or there is none.
    """
    sea, tries = water_to_keep(area, start.en_m), 0
    for ring_m in () if sea is area else REPAIR_RINGS_M:
        places = [moved(start.en_m, 2.0 * math.pi * n / REPAIR_DIRECTIONS, ring_m) for n in range(REPAIR_DIRECTIONS)]
        rooms = area.clearance_m(np.asarray(places))
        if float(np.max(rooms)) < margin_m + HAIR_M:
            continue
        for clear_m in (margin_m, floor_m):
            way = shortest_way(sea, start.en_m, places[int(np.argmax(rooms))], clear_m)
            if way is not None:
                return way
        tries += 1
        if tries == BACK_TRIES:
            break
    return ()


def aim_at(voyage: Voyage, config: SkipperConfig, target: Gate, gate: int, start_en: PointEn) -> Aim:
    """Return what to plan for: the gate ``target``, or a place on the way where a local plan ends (Büsser 4.1)."""
    left_m = distance_m(start_en, target.en_m)
    inner_m = _inner_m(config, target.radius_m)
    if left_m <= config.horizon_m:
        return Aim(en_m=target.en_m, radius_m=inner_m, gate=gate)
    radius = max(50.0, 0.02 * config.horizon_m)
    line, most_m = _leg(voyage, target, start_en), math.inf
    towards = target.en_m if line is not None else _seen(voyage, config, start_en, target.en_m)
    course, reach_m = bearing_rad(start_en, towards), min(config.horizon_m, distance_m(start_en, towards))
    if line is not None and target.bandwidth_m is not None:
        radius = min(radius, 0.25 * target.bandwidth_m)
        most_m = target.bandwidth_m - 2.0 * radius
    for share in np.arange(1.0, 0.3, -0.05):
        for side in (0.0, 1.0, -1.0, 2.0, -2.0, 4.0, -4.0):
            if abs(side * 2.0 * radius) > most_m:
                continue
            if line is not None:
                place = along(line, start_en, float(share) * config.horizon_m, side * 2.0 * radius)
            else:
                on_line = moved(start_en, course, float(share) * reach_m)
                place = moved(on_line, course + math.pi / 2.0, side * 2.0 * radius)
            if float(voyage.area.clearance_m([place])[0]) >= config.margin_m + radius:
                return Aim(en_m=place, radius_m=radius, gate=-1)
    return Aim(en_m=target.en_m, radius_m=inner_m, gate=gate)


def _inner_m(config: SkipperConfig, radius_m: float) -> float:
    """Return how near a plan to a place comes [m]: the autopilot leaves a waypoint behind before it is there."""
    return max(radius_m - config.announce_m, 0.2 * radius_m)


def aim_near(
    area: AreaLike, config: SkipperConfig, en_m: PointEn, radius_m: float, margin_m: float, *, gate: int = -1
) -> Aim | None:
    """Return an aim within ``radius_m`` of a place, the nearest that keeps a margin as it is drawn, or None.

    It completes the gate ``gate``, where there is one: anywhere inside its radius then, which is what counts. Where it
    completes none, a loiter follows there. What lies between the two is free: it is not beyond a mole.
    """
    inner_m = _inner_m(config, radius_m)
    lack_m = -float(area.spare_m([en_m], margin_m)[0])
    if lack_m <= 0.0:
        return Aim(en_m=en_m, radius_m=inner_m, gate=gate)
    most_m = radius_m if gate >= 0 else inner_m
    offs_m = {lack_m + HAIR_M, *(share * inner_m for share in NEAR_SHARES), *(share * most_m for share in NEAR_SHARES)}
    for off_m in sorted(off_m for off_m in offs_m if lack_m < off_m < most_m):
        ring = [moved(en_m, 2.0 * math.pi * n / NEAR_COUNT, off_m) for n in range(NEAR_COUNT)]
        spare_m = area.spare_m(ring, margin_m)
        for n in np.argsort(-spare_m, kind="stable"):
            if spare_m[n] >= 0.0 and area.path_clearance_m([en_m, ring[n]]) > 0.0:
                left_m = max(inner_m - off_m, NEAR_SHARES[0] * (most_m - off_m))
                return Aim(en_m=ring[n], radius_m=left_m, gate=gate)
    return None


def _seen(voyage: Voyage, config: SkipperConfig, start_en: PointEn, target_en: PointEn) -> PointEn:
    """Return where the shortest way to a target leaves the horizon; the target itself where none was found.

    On the straight line behind which land lies the local goal would be in a bay, or on a lake.
    """
    way = shortest_way(voyage.area, start_en, target_en, config.margin_m) or (start_en, target_en)
    inside, out = start_en, target_en
    for place in way[1:]:
        if distance_m(start_en, place) >= config.horizon_m:
            out = place
            break
        inside = place
    if inside == start_en:
        return out
    # from the last corner that is seen on along the way, to where it leaves the horizon
    for share in np.linspace(1.0, 0.0, 21):
        place = (inside[0] + float(share) * (out[0] - inside[0]), inside[1] + float(share) * (out[1] - inside[1]))
        if distance_m(start_en, place) <= config.horizon_m:
            return place
    return inside


def _leg(voyage: Voyage, gate: Gate, start_en: PointEn) -> LineString | None:
    """Return the leg of a passage that has a band, as far as a plan from ``start_en`` can see; None: it has none."""
    if not voyage.is_passage or gate.bandwidth_m is None:
        return None
    return leg_line(voyage.frame, gate.from_en_m or start_en, gate.en_m, start_en, voyage.area.reach_m)


def band(voyage: Voyage, gate: Gate, start_en: PointEn, aim_en: PointEn) -> Polygon | None:
    """Return the corridor to the gate: everything within the bandwidth of the line between global waypoints.

    A boat outside its band is let in: the band reaches around it.
    """
    if gate.bandwidth_m is None:
        return None
    line = _leg(voyage, gate, start_en) or LineString([gate.from_en_m or start_en, gate.en_m])
    corridor = shapely.buffer(line, gate.bandwidth_m, quad_segs=8)
    for point in (start_en, aim_en):
        if not corridor.covers(shapely.points(point)):
            near = shapely.shortest_line(shapely.points(point), line)
            corridor = shapely.union(corridor, shapely.buffer(near, 0.25 * gate.bandwidth_m, quad_segs=8))
    return corridor


def problem_dict(
    voyage: Voyage,
    gate: Gate,
    *,
    start: Start,
    aim: Aim,
    forecast: WindForecast,
    margin_m: float,
    delta_s: float,
    no_go_half_rad: float,
    floor_m: float = 0.0,
    title: str = "",
    beat: dict[str, Any] | None = None,
    max_path_risk: float | None = None,
    tracking: dict[str, Any] | None = None,
    current: WaterCurrent = STILL_WATER,
    zone_half_rad: float = 0.0,
    doubt: WindAngleUncertainty | None = None,
    failing: dict[str, Any] | None = None,
    seen: SpeedSeen | None = None,
    is_wind_known: bool = True,
    stray_m: float = STRAY_M,
) -> dict[str, Any]:
    """Return the problem in the JSON form of the planner (degrees there, as its format has them).

    A ``current`` that is significant is planned with: the wind is then that over the water. ``zone_half_rad`` is how
    far off the wind over the ground, which is the autopilot's, a course must be there for it to be followed.
    ``failing`` is what is known of tacks that fail, as the problem's boat has it, ``seen`` what it makes of its speeds.
    ``stray_m`` is what is kept clear of a line's marks on top of what the mission says.

    Raises:
        ValueError: when no water is left inside the fence at this margin.
    """
    fence = _fence(voyage, start, margin_m)
    obstacles, names = voyage.area.obstacles_wkt(margin_m), voyage.area.obstacle_names(margin_m)
    if start.notch_m > 0.0:
        obstacles, names, fence = _notched(voyage, start, (obstacles, names), fence, floor_m)
    marks = marks_of(voyage, stray_m)
    corridor = band(voyage, gate, start.en_m, aim.en_m)
    if corridor is not None:
        limits = shapely.intersection(corridor, shapely.from_wkt(fence)) if fence is not None else corridor
        pieces = [p for p in shapely.get_parts(limits) if isinstance(p, Polygon) and not p.is_empty]
        if not pieces:
            raise ValueError("no water is left inside the fence and the band")
        here = shapely.points(start.en_m)
        fence = shapely.to_wkt(min(pieces, key=lambda p: (float(p.distance(here)), -p.area)), rounding_precision=4)
    speed = float(np.max(forecast.mean_tws_mps))
    length_s = 1.5 * distance_m(start.en_m, aim.en_m) / max(0.3, voyage.boat.polar.max_speed_mps(speed))
    half_rad = max(no_go_half_rad, voyage.boat.no_go_half_rad)
    forecast, nearer_rad = planned_forecast(voyage.boat, forecast, half_rad, doubt)
    wind = wind_part(forecast, after_s=start.after_s, length_s=length_s, delta_s=delta_s, is_known=is_wind_known)
    water: dict[str, Any] = {}
    if current.is_significant:
        water["current"] = {"set_deg": math.degrees(current.set_rad), "drift_mps": current.drift_mps}
        water["zone"] = {"from_deg": wind["from_deg"], "half_deg": math.degrees(zone_half_rad)}
        wind = wind_part(
            forecast_over_water(forecast, current),
            after_s=start.after_s,
            length_s=length_s,
            delta_s=delta_s,
            is_known=is_wind_known,
        )
    boat = dict(voyage.boat.problem_boat(wind["speed_mps"]))
    boat["speeds"] = voyage.boat.problem_speeds()
    boat.update(failing or {})
    if seen is None:
        seen = SpeedSeen()
    boat["speed_share"] = seen.share
    boat["speed_error"] = min(math.hypot(voyage.boat.speed_error / (1.0 + seen.tries), seen.error), 1.0)
    if not current.is_significant and failing and failing["tack_fails"] > 0.0:
        water["adrift"] = {"set_deg": math.degrees(current.set_rad), "drift_mps": current.drift_mps}
    course_rad = min(voyage.boat.made_good_rad(half_rad, wind["speed_mps"]) + nearer_rad, voyage.boat.max_twa_rad)
    boat["no_go_half_deg"] = math.degrees(course_rad)
    if course_rad > half_rad:
        boat["leeway_deg"] = math.degrees(course_rad - half_rad)
    return {
        "id": voyage.name,
        "title": title,
        "start": {"x": start.en_m[0], "y": start.en_m[1], "heading_deg": math.degrees(wrap_two_pi(start.heading_rad))},
        "goal": {"x": aim.en_m[0], "y": aim.en_m[1], "radius": aim.radius_m},
        "obstacles": [*obstacles, *(mark.disc_wkt for mark in marks), *(kept.wkt for kept in gate.keep_out)],
        "obstacle_names": [*names, *(mark.name for mark in marks), *(kept.name for kept in gate.keep_out)],
        "fence": fence,
        **({} if fence is None else {"fence_name": voyage.area.edge_name}),
        "wind": wind,
        "boat": boat,
        "delta_s": delta_s,
        "leg_saving": LEG_SAVING,
        **water,
        "beat": beat,
        "tracking": tracking,
        "risk": None
        if max_path_risk is None
        else {"max_path_risk": max_path_risk, "correlation_time_s": forecast.correlation_time_s},
    }


def _fence(voyage: Voyage, start: Start, margin_m: float) -> str | None:
    """Return the limits less the margin, opened about the way back inside to a start that is outside."""
    if not start.back_en:
        return voyage.area.fence_wkt(margin_m, start.en_m)
    way = shapely.buffer(LineString(start.back_en), BACK_M, quad_segs=8)
    outer = water_to_keep(voyage.area, start.en_m).fence_wkt(margin_m, start.en_m)
    if outer is not None:
        way = shapely.intersection(way, shapely.from_wkt(outer))
    inner = voyage.area.fence_wkt(margin_m, start.back_en[-1])
    limits = way if inner is None else shapely.union(way, shapely.from_wkt(inner))
    here = shapely.points(start.en_m)
    pieces = [p for p in shapely.get_parts(limits) if isinstance(p, Polygon) and not p.is_empty]
    return str(shapely.to_wkt(min(pieces, key=lambda p: float(p.distance(here))), rounding_precision=4))


def _notched(
    voyage: Voyage, start: Start, solids: tuple[Sequence[str], Sequence[str]], fence: str | None, floor_m: float
) -> tuple[list[str], list[str], str | None]:
    """Return obstacles, their names and the fence with the notch around the start: there the floor holds alone."""
    disc = shapely.buffer(shapely.points(start.en_m), start.notch_m, quad_segs=4)
    core = shapely.union_all([shapely.from_wkt(w) for w in voyage.area.obstacles_wkt(floor_m)])
    opening = shapely.difference(disc, core)
    open_obstacles: list[str] = []
    open_names: list[str] = []
    for text, name in zip(*solids, strict=True):
        rest = shapely.difference(shapely.from_wkt(text), opening)
        kept = [p for p in shapely.get_parts(rest) if isinstance(p, Polygon) and not p.is_empty]
        open_obstacles.extend(shapely.to_wkt(p, rounding_precision=4) for p in kept)
        open_names.extend(name for _ in kept)
    if fence is not None:
        inner = voyage.area.fence_wkt(floor_m, start.en_m)
        if inner is not None:
            wider = shapely.union(shapely.from_wkt(fence), shapely.intersection(disc, shapely.from_wkt(inner)))
            pieces = [p for p in shapely.get_parts(wider) if isinstance(p, Polygon)]
            here = shapely.points(start.en_m)
            fence = shapely.to_wkt(min(pieces, key=lambda p: (float(p.distance(here)), -p.area)), rounding_precision=4)
    return open_obstacles, open_names, fence


# -------- A leg of a passage: the line between two global waypoints that are farther apart than any frame is flat.
# The line is the geodesic between them, the same one in every frame. Büsser 2009, section 4.2: a bandwidth bounds the
# way about it, and the local plan covers the next miles of it only.


def leg_line(frame: LocalFrame, from_en: PointEn, to_en: PointEn, near_en: PointEn, reach_m: float) -> LineString:
    """Return what of the leg lies within ``reach_m`` along it of the place that is nearest to ``near_en``.

    It is cut into pieces of ``PIECE_M``; both ends of the leg are in it where they are near enough.
    """
    a, b, here = (frame.geo_from_en(*en) for en in (from_en, to_en, near_en))
    azimuth_deg, _, length_m = _EARTH.inv(a.lon_deg, a.lat_deg, b.lon_deg, b.lat_deg)
    to_here_deg, _, far_m = _EARTH.inv(a.lon_deg, a.lat_deg, here.lon_deg, here.lat_deg)
    along_m = min(max(far_m * float(np.cos(np.radians(to_here_deg - azimuth_deg))), 0.0), length_m)
    begin_m, end_m = max(0.0, along_m - reach_m), min(length_m, along_m + reach_m)
    if length_m < 1.0 or end_m - begin_m < 1.0:
        return LineString([from_en, to_en])
    stations_m = np.linspace(begin_m, end_m, max(2, 1 + int(np.ceil((end_m - begin_m) / PIECE_M))))
    count = len(stations_m)
    lon_deg, lat_deg, _ = _EARTH.fwd(
        np.full(count, a.lon_deg), np.full(count, a.lat_deg), np.full(count, azimuth_deg), stations_m
    )
    return LineString(frame.array_en_from_lonlat(np.column_stack([lon_deg, lat_deg])))


def along(line: LineString, near_en: PointEn, ahead_m: float, aside_m: float = 0.0) -> PointEn:
    """Return the place ``ahead_m`` along the line from where it is nearest to ``near_en``, ``aside_m`` to its right."""
    at_m = float(line.project(shapely.points(near_en))) + ahead_m
    place, before = line.interpolate(at_m), line.interpolate(max(0.0, at_m - 1.0))
    east, north = place.x - before.x, place.y - before.y
    length = max(distance_m((0.0, 0.0), (east, north)), 1e-9)
    return float(place.x + aside_m * north / length), float(place.y - aside_m * east / length)
