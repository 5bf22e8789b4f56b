"""The figures of the dashboard, a labelled line each, the most important first."""

from __future__ import annotations

import math

from companion.terminal import figures as fig
from companion.terminal.screen import Style
from companion.view import View

Row = tuple[str, str, Style]


def body_of(view: View, *, knots: bool, columns: int) -> list[Row]:
    """Return label, text and style of each line; ``columns`` wide ones say more."""
    is_wide = columns >= 40
    return [
        _wind(view, knots=knots), *_water(view, knots=knots), _bow(view, knots=knots), _boat(view, knots=knots),
        _leg(view), _goal(view),
        _tack(view), _plan(view, is_wide=is_wide), _clear(view), _parts(view), _power(view), _speeds(view, knots=knots),
    ]


def _wind(view: View, *, knots: bool) -> Row:
    wind = view.wind
    if wind is None:
        return "Wind", "not heard", Style.PLAIN
    spread = "" if wind.sigma_deg is None else f"±{wind.sigma_deg:.0f}°"
    gusts = "" if wind.tws_sigma_mps is None else f"±{fig.speed(wind.tws_sigma_mps, knots=knots)}"
    style = Style.PLAIN if wind.health == "good" else Style.WARN
    health = "" if wind.health == "good" else f" {wind.health}"
    return "Wind", (f"{fig.direction(wind.twd_from_deg)}{spread} {fig.speed(wind.tws_mps, knots=knots)}{gusts} "
                    f"{fig.unit(knots=knots)}{health}"), style


def _water(view: View, *, knots: bool) -> list[Row]:
    """Return the current's line, none where plans do not reckon with one and nothing is wrong with it."""
    water = view.water
    if water is None or not (water.is_planned or water.verdict):
        return []
    spread = "" if water.sigma_mps is None else f"±{fig.speed(water.sigma_mps, knots=knots)}"
    said = "" if not water.verdict else f" {water.verdict}"
    text = f"sets {fig.direction(water.set_deg)} {fig.speed(water.drift_mps, knots=knots)}{spread}"
    style = Style.PLAIN if water.is_planned else Style.WARN
    return [("Water", f"{text} {fig.unit(knots=knots)}{said}", style)]


def _bow(view: View, *, knots: bool) -> Row:
    wind = view.wind
    if wind is None:
        return "Bow", "-", Style.PLAIN
    style = Style.PLAIN if wind.twa_deg is None else Style.STARBOARD if wind.twa_deg >= 0.0 else Style.PORT
    apparent = f", apparent {fig.side(wind.awa_deg)} {fig.speed(wind.aws_mps, knots=knots)}"
    return "Bow", f"{fig.side(wind.twa_deg)}{'' if wind.awa_deg is None else apparent}", style


def _boat(view: View, *, knots: bool) -> Row:
    boat = view.boat
    text = (f"HDG {fig.direction(boat.heading_deg)} COG {fig.direction(boat.cog_deg)} "
            f"{fig.speed(boat.sog_mps, knots=knots)} {fig.unit(knots=knots)}")
    is_old = boat.age_s is None or boat.age_s > fig.OLD_S
    return "Boat", f"{text}, {fig.span(boat.age_s)} ago" if is_old else text, Style.WARN if is_old else Style.PLAIN


def _leg(view: View) -> Row:
    plan, boat = view.plan, view.boat
    if plan is None or plan.leg is None:
        return "Leg", "no plan is sailed", Style.PLAIN
    bearing = ""
    leg = next((leg for leg in plan.legs if not leg.is_done), None)
    if leg is not None and boat.at_en_m is not None:
        east, north = leg.to_en_m[0] - boat.at_en_m[0], leg.to_en_m[1] - boat.at_en_m[1]
        bearing = f" at {fig.direction(math.degrees(math.atan2(east, north)) % 360.0)}"
    off = "" if boat.cross_track_m is None else f", xt {fig.number(boat.cross_track_m, '+.0f')} m"
    return "Leg", f"{plan.leg}/{fig.number(plan.count)} {fig.length(boat.waypoint_m)}{bearing}{off}", Style.PLAIN


def _goal(view: View) -> Row:
    goal = next((g for g in view.goals if g.is_next), None)
    figures = view.figures
    number = "" if figures.goals is None or figures.goals_reached is None else \
        f"{min(figures.goals_reached + 1, figures.goals)}/{figures.goals} "
    if goal is None:
        return "Goal", f"{number}{fig.length(view.boat.goal_m)}", Style.PLAIN
    text = f"{number}{fig.length(goal.distance_m)} at {fig.direction(goal.bearing_deg)} {goal.name}"
    return "Goal", text, Style.PLAIN


def _tack(view: View) -> Row:
    lines = () if view.laylines is None else tuple(line for line in view.laylines.lines if line.reach_s is not None)
    nearest = min(lines, key=lambda line: line.reach_s or 0.0, default=None)
    layline = "" if nearest is None else f", layline {nearest.tack[:1].upper()} in {fig.span(nearest.reach_s)}"
    next_s = None if view.plan is None else view.plan.next_tack_s
    tacks = view.figures.tacks
    return "Tack", (f"{'none planned' if next_s is None else f'in {fig.span(next_s)}'}{layline}"
                    f"{'' if tacks is None else f', {tacks} done'}"), Style.PLAIN


def _plan(view: View, *, is_wide: bool) -> Row:
    plan = view.plan
    if plan is None:
        return "Plan", "none", Style.PLAIN
    whole = "" if plan.path_risk is None or not is_wide else f", {fig.share(plan.path_risk)} in all"
    text = f"#{fig.number(plan.number)} {fig.span(plan.age_s)} old, risk {fig.share(plan.promised_risk)}{whole}"
    return "Plan", f"{text}, {plan.bound_for}" if plan.bound_for else text, Style.PLAIN


def _clear(view: View) -> Row:
    near = min((v for v in view.vessels if v.cpa_s is not None), key=lambda v: v.cpa_m or 0.0, default=None)
    ships = "" if not view.vessels else f", {len(view.vessels)} vessels" if near is None else \
        f", {near.name or near.mmsi} {fig.length(near.cpa_m)} in {fig.span(near.cpa_s)}"
    is_alarm = any(v.alarm in {"act", "touch"} for v in view.vessels)
    return "Clear", f"{fig.length(view.boat.clearance_m)} of land{ships}", Style.BAD if is_alarm else Style.PLAIN


def _parts(view: View) -> Row:
    ill = [part for part in view.health if part.grade in {"bad", "poor"}]
    if not ill:
        return "Parts", "all well", Style.PLAIN
    worst = any(part.grade == "bad" for part in ill)
    words = ", ".join(part.name + (f" {fig.span(part.age_s)} ago" if (part.age_s or 0.0) > 5.0 else
                                   f" {part.text}" if part.text else f" {part.grade}") for part in ill)
    return "Parts", words, Style.BAD if worst else Style.WARN


def _power(view: View) -> Row:
    boat, standing = view.boat, view.orders.standing
    order = "" if standing is None else f", order {standing.words} {fig.span(standing.age_s)}"
    charge = "" if boat.battery_share is None else f" {fig.share(boat.battery_share)}"
    return "Power", f"{fig.number(boat.battery_v, '.1f', ' V')}{charge}{order}", Style.PLAIN


def _speeds(view: View, *, knots: bool) -> Row:
    boat, polar = view.boat, view.polar
    twa_deg = None if view.wind is None else view.wind.twa_deg
    target = None if polar is None or twa_deg is None else polar.at_mps(twa_deg)
    ratio = boat.sog_mps / target if target and boat.sog_mps is not None else None
    heel = "" if boat.roll_deg is None else f", heel {abs(boat.roll_deg):.0f}°{'S' if boat.roll_deg > 0.0 else 'P'}"
    return "VMG", (f"{fig.speed(boat.vmg_mps, knots=knots)} {fig.unit(knots=knots)}"
                   f"{'' if ratio is None else f', polar {fig.share(ratio)}'}{heel}"), Style.PLAIN
