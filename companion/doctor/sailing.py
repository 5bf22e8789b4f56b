"""How the autopilot sails: the boat's parameters, its wind vane, its way along a mission."""

from __future__ import annotations

import math

from companion.boat import AutopilotLimits, narrowest_corridor_m, points_too_high, proposed_margin, widest_corridor_m
from companion.doctor.report import Level, Needs, Report
from companion.mavlink.wire import believable


def boat(report: Report, needs: Needs) -> None:
    """Look at what the autopilot believes of the boat: its no-go zone, the corridor it beats in, its loiter."""
    report.expect(Level.ERROR, "SAIL_ENABLE", 1.0, "without it the autopilot sails into the wind")
    no_go = report.get("SAIL_NO_GO_ANGLE")
    planned = math.degrees(needs.no_go_half_rad)
    if no_go is not None and no_go > planned + 0.5:
        report.add(
            Level.INFO,
            "no-go",
            f"SAIL_NO_GO_ANGLE {no_go:g}° is wider than the boat's {planned:g}°",
            f"plans keep to {no_go + 2.0:g}°: if the boat points higher, lower the parameter",
            name="SAIL_NO_GO_ANGLE",
        )
    if no_go is not None and points_too_high(math.radians(no_go), needs.no_go_half_rad):
        report.add(
            Level.WARNING,
            "no-go",
            f"SAIL_NO_GO_ANGLE {no_go:g}° is narrower than the boat's {planned:g}°",
            "in a header the autopilot points higher than the boat sails",
            name="SAIL_NO_GO_ANGLE",
            wanted=planned,
        )
    limits = AutopilotLimits.from_params(
        believable({name: value for name in AutopilotLimits.PARAMETERS if (value := report.get(name)) is not None})[0]
    )
    if not needs.can_tack:
        if limits.sail_xtrack_max_m > 0.0:
            report.add(
                Level.WARNING,
                "corridor",
                f"SAIL_XTRACK_MAX is {limits.sail_xtrack_max_m:g}, and this boat cannot tack",
                "when a shift closes a leg the autopilot tries to tack at that corridor's edge; "
                "at 0 it sails on, and the companion gybes round",
                name="SAIL_XTRACK_MAX",
                wanted=0.0,
            )
    else:
        _corridor(report, needs, limits)
    loiter = report.get("SAIL_LOIT_RADIUS")
    if loiter is not None and 2.5 * loiter > needs.loiter_radius_m:
        report.add(
            Level.WARNING,
            "loiter",
            f"SAIL_LOIT_RADIUS {loiter:g} m needs about {2.5 * loiter:.0f} m of room",
            f"the mission's end is chosen with {needs.loiter_radius_m:g} m",
            name="SAIL_LOIT_RADIUS",
            wanted=math.floor(needs.loiter_radius_m / 2.5),
        )
    report.expect(Level.INFO, "LOIT_TYPE", 1.0, "a sailboat keeps moving in a loiter; 1 turns it bow to the point")


def _corridor(report: Report, needs: Needs, limits: AutopilotLimits) -> None:
    """Hold corridor and margin against each other, once for both: what is wanted of one must not spoil the other."""
    corridor_m, speed_mps = limits.sail_xtrack_max_m, needs.speed_mps
    narrowest_m = narrowest_corridor_m(speed_mps)
    fitting_m = widest_corridor_m(limits, needs.margin_m, speed_mps=speed_mps, hull=needs.hull)
    proposed = proposed_margin(limits, speed_mps=speed_mps, hull=needs.hull)
    if corridor_m < narrowest_m:
        wanted = narrowest_m if fitting_m is None else fitting_m
        if corridor_m <= 0.0:
            what = "SAIL_XTRACK_MAX is 0: no corridor when a shift closes a leg"
            why = (
                "the autopilot then sails long boards to the layline, wherever that is; the companion reacts, but "
                "if it dies nothing bounds the boat"
            )
        else:
            what = f"SAIL_XTRACK_MAX {corridor_m:g} m is soon crossed at {speed_mps:.1f} m/s"
            why = "when a shift closes a leg the autopilot does little but tack"
        report.add(Level.WARNING, "corridor", what, why, name="SAIL_XTRACK_MAX", wanted=wanted)
    if proposed.margin.total_m > needs.margin_m + 1e-6:
        narrows = fitting_m is not None and fitting_m < corridor_m
        report.add(
            Level.WARNING,
            "margin",
            f"the margin of {needs.margin_m:g} m is less than {proposed.margin.describe()}",
            "when a shift closes a leg the autopilot beats in its corridor: "
            f"{'narrow it, or ' if narrows else ''}plan with [area] margin_m = {proposed.margin_m:g}",
            name="SAIL_XTRACK_MAX",
            wanted=fitting_m if narrows else None,
        )


def wind(report: Report) -> None:
    """Look at the wind vane, the wind speed sensor and the filter of the true wind."""
    kind = report.get("WNDVN_TYPE")
    speed = report.get("WNDVN_SPEED_TYPE")
    if kind == 0:
        report.add(
            Level.ERROR,
            "vane",
            "WNDVN_TYPE is 0: no wind vane",
            "arming is refused, and nothing can be planned",
            name="WNDVN_TYPE",
        )
    elif kind in {1.0, 2.0}:
        report.add(
            Level.ERROR,
            "vane",
            f"WNDVN_TYPE is {kind:g}: the wind is the heading at arming, not a measurement",
            "it may serve a short try in steady wind, no voyage",
            name="WNDVN_TYPE",
        )
    elif kind == 11.0:
        report.add(
            Level.ERROR,
            "vane",
            "WNDVN_TYPE is 11: the simulator's apparent wind, which the model never fills",
            "the boat tacks at random",
            name="WNDVN_TYPE",
            wanted=10.0,
        )
    if speed == 0:
        report.add(
            Level.WARNING,
            "wind speed",
            "WNDVN_SPEED_TYPE is 0: no wind speed sensor",
            "the autopilot's true wind is then vane plus heading: wrong whenever the boat moves",
            name="WNDVN_SPEED_TYPE",
        )
    minimum = report.get("WNDVN_SPEED_MIN")
    if minimum is not None and minimum > 0.0:
        report.add(
            Level.INFO,
            "held wind",
            f"below WNDVN_SPEED_MIN {minimum:g} m/s the old true wind is held",
            "it looks fresh; the wind watch marks it as held",
            name="WNDVN_SPEED_MIN",
        )
    cut_hz = report.get("WNDVN_TRUE_FILT")
    if cut_hz is not None and cut_hz > 0.0:
        lag_s = 1.0 / (2.0 * math.pi * cut_hz)
        level = Level.INFO if lag_s < 5.0 else Level.WARNING
        report.add(
            level,
            "wind filter",
            f"WNDVN_TRUE_FILT {cut_hz:g} Hz: the true wind lags {lag_s:.1f} s",
            "the forecaster accounts for it; a longer lag delays the answer to a header",
            name="WNDVN_TRUE_FILT",
            wanted=None if lag_s < 5.0 else 0.05,
        )


def navigation(report: Report, needs: Needs) -> None:
    """Look at how waypoints are reached, what bends the way between them, and what follows the last."""
    radius = report.get("WP_RADIUS")
    if radius is not None and radius > needs.goal_radius_m:
        report.add(
            Level.WARNING,
            "waypoint radius",
            f"WP_RADIUS {radius:g} m is more than the goal's radius {needs.goal_radius_m:g} m",
            "waypoints count as reached, and corners are cut, that far off",
            name="WP_RADIUS",
            wanted=max(1.0, math.floor(min(needs.goal_radius_m, 3.0))),
        )
    avoid = report.get("AVOID_ENABLE")
    if avoid is not None and avoid != 0:
        report.add(
            Level.WARNING,
            "avoidance",
            f"AVOID_ENABLE is {avoid:g}",
            "near a fence the autopilot eases the sail, and outside an inclusion fence it may never move again "
            "(ArduPilot issue 34218); it does not keep the boat out either",
            name="AVOID_ENABLE",
            wanted=0.0,
        )
    oa_type = report.get("OA_TYPE")
    if oa_type is not None and oa_type != 0:
        report.add(
            Level.WARNING,
            "two planners",
            f"OA_TYPE is {oa_type:g}",
            "the autopilot's path planner knows no wind and bends the companion's legs",
            name="OA_TYPE",
            wanted=0.0,
        )
    report.expect(
        Level.WARNING, "MIS_RESTART", 0.0, "at 1 every return to AUTO begins the mission again at its first item"
    )
    if report.get("MIS_DONE_BEHAVE") == 0:
        report.add(
            Level.INFO,
            "mission end",
            "MIS_DONE_BEHAVE is 0: HOLD after the last item",
            "HOLD drifts; the companion's missions end in a loiter of their own",
            name="MIS_DONE_BEHAVE",
            wanted=1.0,
        )
