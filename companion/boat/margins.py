"""How far from an obstacle to plan, from what the autopilot does with the plan.

ArduRover does not sail the planned line. It cuts corners by WP_RADIUS, wanders about the line, and where the
wind shifts a leg inside SAIL_NO_GO_ANGLE it beats in a corridor of SAIL_XTRACK_MAX to either side. Each of these
becomes a named part of the margin. How far a fence lets the boat in is told apart from it: who keeps his margin crosses
no fence, and who switches one on needs no more margin than before.

The figures are measured on ArduRover 4.7-dev's simulated sailboat at 2 to 3 m/s and scale with speed where the
cause is a delay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import ClassVar

from companion.boat import l1
from companion.boat.boat import Hull
from companion.boat.polar import Polar

TRACK_S = 0.85  # |cross-track| <= 2.4 m at 2.93 m/s on reaches and close-hauled legs
CORRIDOR_OVERSHOOT_S = 0.45  # 0.9 m beyond the corridor at 2.0 m/s before the tack has turned the boat
CORNER_S = 1.4  # |cross-track| <= 4 m at 2.9 m/s just after the corners of a planned beat
# Narrower than this a corridor is crossed, at 45 degrees to the line, in less than 7 s; the autopilot tacks at most
# every 5 s and would do little else.
NARROWEST_S = 2.5
# From its place, of a loiter: past it at full speed, and round. On ArduRover 12.2 m at 3.0 m/s and 18.1 at 4.4; on the
# simulated autopilot, come from eight sides, 11.0 m at most at 2.2, 13.9 at 3.0, 20.2 at 4.2 and 25.8 at 5.1.
LOITER_S = 5.2
LOITER_TURNS = (
    1.1  # of a wider turn, how much it takes more: at 15 to 60 degrees a second 10.4 to 42.9 m in 3 to 12 m/s
)
GALE_POWER = 0.75  # of the wind beyond a polar's strongest: 29.3 m in 14 m/s of wind and 33.0 in 16
RATE_MAX_RADPS = math.radians(120.0)  # ArduRover's ATC_STR_RAT_MAX: all of these were measured by it
HEADER_RAD = math.radians(5.0)  # of a no-go zone that is narrower than the boat's: less is lost in the wind's swings
UNLIMITED_RADPS = math.radians(1000.0)  # what 0 stands for as a limit of ArduPilot's


def wider_s(rate_max_radps: float) -> float:
    """Return how much wider the tightest turn is than by ArduRover's own ATC_STR_RAT_MAX, per speed [s, 0 or more]."""
    return max(0.0, 1.0 / rate_max_radps - 1.0 / RATE_MAX_RADPS)


def points_too_high(autopilot_no_go_rad: float, boat_no_go_rad: float) -> bool:
    """Return whether an autopilot's no-go zone is so much narrower than the boat's that it stalls her in a header."""
    return autopilot_no_go_rad < boat_no_go_rad - HEADER_RAD


def loiter_swing_m(polar: Polar, tws_mps: float, rate_max_radps: float = RATE_MAX_RADPS) -> float:
    """Return how far from its place a loiter takes a boat in a wind [m], by its autopilot's ATC_STR_RAT_MAX."""
    strongest_mps = float(polar.tws_mps[-1])
    swing_m = (LOITER_S + LOITER_TURNS * wider_s(rate_max_radps)) * polar.max_speed_mps(tws_mps)
    if tws_mps > strongest_mps > 0.0:  # 0: of a boat that sails without a wind
        swing_m *= math.pow(tws_mps / strongest_mps, GALE_POWER)
    return swing_m


@dataclass(frozen=True, slots=True, kw_only=True)
class AutopilotLimits:
    """The autopilot's parameters that decide where the boat goes; ArduRover's sailboat defaults."""

    PARAMETERS: ClassVar[tuple[str, ...]] = (
        "SAIL_NO_GO_ANGLE",
        "SAIL_XTRACK_MAX",
        "WP_RADIUS",
        "TURN_RADIUS",
        "WP_SPEED",
        "WP_ACCEL",
        "WP_JERK",
        "ATC_ACCEL_MAX",
        "ATC_STR_RAT_MAX",
        "ATC_STR_ACC_MAX",
        "WP_PIVOT_RATE",
        "FENCE_ENABLE",
        "FENCE_ACTION",
        "FENCE_TYPE",
        "FENCE_RADIUS",
    )
    CIRCLE_BIT: ClassVar[int] = 2  # of FENCE_TYPE
    POLYGON_BIT: ClassVar[int] = 4

    sail_no_go_angle_rad: float = math.radians(45.0)
    sail_xtrack_max_m: float = 10.0  # 0: no corridor, long boards to the layline
    wp_radius_m: float = 2.0
    turn_radius_m: float = 0.9
    wp_speed_mps: float | None = None  # of the point that the boat follows, not the boat's; None: it was not read
    wp_accel_mps2: float = 1.0  # of that point
    wp_jerk_mps3: float = 1.0
    rate_max_radps: float = RATE_MAX_RADPS  # ATC_STR_RAT_MAX: it turns no faster
    rate_change_radps2: float = math.radians(120.0)  # ATC_STR_ACC_MAX
    pivot_rate_radps: float = math.radians(60.0)  # WP_PIVOT_RATE: the same in a tack; 0: no such limit
    l1_period_s: float = 0.0  # of ArduRover up to 4.2, which steers by L1; 0: a later one
    l1_damping: float = l1.DAMPING
    fence_action: int | None = None  # None: no fence guards this obstacle; 0 report .. 4, see FENCE_ACTION
    fence_circle_m: float | None = None  # radius of the fence around home, if something would be done about it
    fence_polygons: bool = True  # what is drawn on the autopilot is kept, too
    rc_channels: tuple[int, ...] = (1, 3, 8)  # of the rudder, the throttle and the mode switch, from 1

    def __post_init__(self) -> None:
        if not 0.0 <= self.sail_no_go_angle_rad < math.pi / 2.0:
            raise ValueError(f"SAIL_NO_GO_ANGLE {math.degrees(self.sail_no_go_angle_rad):.0f}° is outside 0..90°")
        for name in ("sail_xtrack_max_m", "wp_radius_m", "turn_radius_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be 0 m or more")

    @classmethod
    def from_params(cls, params: Mapping[str, float]) -> AutopilotLimits:
        """Return the limits from parameter values by ArduPilot's names; a missing one keeps its default.

        >>> AutopilotLimits.from_params({"WP_RADIUS": 3.0, "SAIL_XTRACK_MAX": 30.0}).sail_xtrack_max_m
        30.0
        """
        default = cls()
        fenced = params.get("FENCE_ENABLE", 0.0) > 0.0
        action = int(params.get("FENCE_ACTION", 1.0))
        accel = params.get("WP_ACCEL", 0.0) or params.get("ATC_ACCEL_MAX", 0.0) or default.wp_accel_mps2
        is_circled = action > 0 and bool(int(params.get("FENCE_TYPE", 0.0)) & cls.CIRCLE_BIT)
        return cls(
            sail_no_go_angle_rad=math.radians(
                params.get("SAIL_NO_GO_ANGLE", math.degrees(default.sail_no_go_angle_rad))
            ),
            sail_xtrack_max_m=float(params.get("SAIL_XTRACK_MAX", default.sail_xtrack_max_m)),
            wp_radius_m=float(params.get("WP_RADIUS", default.wp_radius_m)),
            turn_radius_m=float(params.get("TURN_RADIUS", default.turn_radius_m)),
            wp_speed_mps=params.get("WP_SPEED", 0.0) or None,
            wp_accel_mps2=accel,
            wp_jerk_mps3=params.get("WP_JERK", 0.0) or accel,
            rate_max_radps=math.radians(params.get("ATC_STR_RAT_MAX", 120.0)) or UNLIMITED_RADPS,
            rate_change_radps2=math.radians(params.get("ATC_STR_ACC_MAX", 120.0)) or UNLIMITED_RADPS,
            pivot_rate_radps=math.radians(params.get("WP_PIVOT_RATE", 60.0)),
            l1_period_s=params.get("NAVL1_PERIOD", default.l1_period_s),
            l1_damping=params.get("NAVL1_DAMPING", default.l1_damping),
            fence_action=action if fenced else None,
            fence_circle_m=params.get("FENCE_RADIUS") if is_circled else None,
            fence_polygons=bool(int(params.get("FENCE_TYPE", cls.POLYGON_BIT)) & cls.POLYGON_BIT),
            rc_channels=tuple(
                int(params.get(name, channel))
                for name, channel in zip(("RCMAP_ROLL", "RCMAP_THROTTLE", "MODE_CH"), default.rc_channels, strict=True)
            ),
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class MarginPart:
    """One cause of distance: its name, its size [m] and why."""

    name: str
    value_m: float
    why: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Margin:
    """The distance to keep between the planned line and an obstacle, and what it is made of.

    ``is_bounded`` is False when the autopilot's deviation has no limit of its own (SAIL_XTRACK_MAX 0 and legs that
    a shift can push into its no-go zone): then the total covers everything else and ``why`` says so.
    """

    parts: tuple[MarginPart, ...]
    is_bounded: bool = True

    @property
    def total_m(self) -> float:
        """The sum of the parts [m]: they can all happen at once, on the same side."""
        return sum(part.value_m for part in self.parts)

    def describe(self) -> str:
        """Return one line: the total and its parts, of which it is the sum as they are written."""
        parts = " + ".join(f"{part.name} {part.value_m:.1f}" for part in self.parts)
        tail = "" if self.is_bounded else " (no bound on the beat: SAIL_XTRACK_MAX is 0)"
        return f"{sum(round(part.value_m, 1) for part in self.parts):.1f} m = {parts}{tail}"


def required_margin(
    limits: AutopilotLimits, *, speed_mps: float, hull: Hull | None = None, legs_can_enter_no_go: bool = True
) -> Margin:
    """Return the margin that the autopilot's behaviour asks for.

    Args:
        limits: The autopilot's parameters.
        speed_mps: Highest boat speed expected [m/s, 0 or more].
        hull: Size and position error; a 1 m boat with plain GPS when None.
        legs_can_enter_no_go: Whether a wind shift that is not excluded can put a leg into SAIL_NO_GO_ANGLE.

    Raises:
        ValueError: when the speed is out of range.
    """
    if not (math.isfinite(speed_mps) and speed_mps >= 0.0):
        raise ValueError(f"speed {speed_mps} m/s must be 0 or more")
    hull = hull or Hull()
    radius_m = max(limits.wp_radius_m, limits.turn_radius_m)
    # The chord from one leg to the next, each a radius from the corner, is at most half of one from both legs.
    cut_m, overshoot_m = 0.5 * radius_m, (CORNER_S + wider_s(limits.rate_max_radps)) * speed_mps
    corner_m = max(cut_m, overshoot_m)
    track_m = TRACK_S * speed_mps
    corridor = legs_can_enter_no_go and limits.sail_xtrack_max_m > 0.0
    corridor_m = limits.sail_xtrack_max_m + CORRIDOR_OVERSHOOT_S * speed_mps if corridor else 0.0
    widest = max((corridor_m, "corridor"), (corner_m, "corner"), (track_m, "track"))
    why = {
        "corridor": f"a shift puts the leg into SAIL_NO_GO_ANGLE: it beats within SAIL_XTRACK_MAX "
        f"{limits.sail_xtrack_max_m:g} m and overshoots by {CORRIDOR_OVERSHOOT_S * speed_mps:.1f} m",
        "corner": f"cuts the corner {cut_m:.1f} m inside (WP_RADIUS {limits.wp_radius_m:g} m) or swings "
        f"{overshoot_m:.1f} m wide of it",
        "track": "wanders about the line",
    }
    parts = [
        MarginPart(name="hull", value_m=hull.reach_m, why="the hull about its antenna"),
        MarginPart(name="position", value_m=hull.position_error_m, why="the position fix"),
        # The three ways off the line exclude one another in time: the boat corners, follows or beats.
        MarginPart(name=widest[1], value_m=widest[0], why=why[widest[1]]),
    ]
    return Margin(parts=tuple(parts), is_bounded=not legs_can_enter_no_go or limits.sail_xtrack_max_m > 0.0)


def narrowest_corridor_m(speed_mps: float) -> float:
    """Return the least SAIL_XTRACK_MAX that makes sense at a speed [m]: a whole number."""
    return float(math.ceil(NARROWEST_S * speed_mps))


def widest_corridor_m(
    limits: AutopilotLimits, margin_m: float, *, speed_mps: float, hull: Hull | None = None
) -> float | None:
    """Return the greatest whole SAIL_XTRACK_MAX that a margin holds [m]; None when it holds none that makes sense."""
    rest_m = required_margin(replace(limits, sail_xtrack_max_m=0.0), speed_mps=speed_mps, hull=hull)
    room_m = margin_m - sum(part.value_m for part in rest_m.parts[:2])
    corridor_m = math.floor(room_m - CORRIDOR_OVERSHOOT_S * speed_mps + 1e-6)
    fits = rest_m.total_m <= margin_m + 1e-6 and corridor_m >= narrowest_corridor_m(speed_mps)
    return float(corridor_m) if fits else None


@dataclass(frozen=True, slots=True, kw_only=True)
class ProposedMargin:
    """What to write into a mission [m]: whole numbers, and what they are made of.

    ``floor_m`` is what is needed where no shift puts a leg into the autopilot's no-go zone.
    """

    margin_m: float
    floor_m: float
    margin: Margin


def proposed_margin(limits: AutopilotLimits, *, speed_mps: float, hull: Hull | None = None) -> ProposedMargin:
    """Return the margin for a mission from the autopilot's parameters: what the doctor finds enough.

    Without a corridor (SAIL_XTRACK_MAX 0), or with one that is too narrow, the narrowest that makes sense is assumed.
    """
    corridor_m = max(limits.sail_xtrack_max_m, narrowest_corridor_m(speed_mps))
    margin = required_margin(replace(limits, sail_xtrack_max_m=corridor_m), speed_mps=speed_mps, hull=hull)
    floor = required_margin(limits, speed_mps=speed_mps, hull=hull, legs_can_enter_no_go=False)
    return ProposedMargin(
        margin_m=float(math.ceil(margin.total_m)), floor_m=float(math.ceil(floor.total_m)), margin=margin
    )
