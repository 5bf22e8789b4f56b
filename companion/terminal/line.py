"""A voyage as lines of text, where there is no terminal to draw on."""

from __future__ import annotations

from datetime import UTC, datetime

from companion.terminal import figures as fig
from companion.terminal.dashboard import age_of
from companion.view import View


def line_of(view: View, unix_s: float, *, knots: bool) -> str:
    """Return the view as one line; nothing without its age."""
    state, boat, wind, plan = view.state, view.boat, view.wind, view.plan
    age_s = age_of(view)
    unit = fig.unit(knots=knots)
    parts = [
        f"{datetime.fromtimestamp(unix_s, UTC):%H:%M:%S} {state.phase.upper()}",
        f"{state.mode or 'mode not heard'}{' armed' if state.is_armed else ''}",
        "age unknown" if age_s is None else f"{'age' if age_s <= fig.OLD_S else 'OLD'} {fig.span(age_s)}",
    ]
    if wind is not None:
        parts.append(f"wind {fig.direction(wind.twd_from_deg)}±{fig.number(wind.sigma_deg)}° "
                     f"{fig.speed(wind.tws_mps, knots=knots)} {unit}")
    parts.append(f"{fig.direction(boat.cog_deg)} {fig.speed(boat.sog_mps, knots=knots)} {unit}")
    if plan is not None and plan.leg is not None:
        parts.append(f"leg {plan.leg}/{fig.number(plan.count)} {fig.length(boat.waypoint_m)}")
    if boat.goal_m is not None:
        parts.append(f"goal {fig.length(boat.goal_m)}")
    if plan is not None and plan.promised_risk is not None:
        parts.append(f"risk {fig.share(plan.promised_risk)}")
    if boat.battery_v is not None:
        parts.append(f"{boat.battery_v:.1f} V")
    parts += [f"{alarm.level.upper()} {alarm.code}" for alarm in view.alarms[:2]]
    parts.append(state.why)
    return " | ".join(part for part in parts if part)
