"""The picture of a voyage: the chart with planned and sailed tracks, and the wind with the no-go zone as it widened.

Reads a voyage folder, nothing else, so any voyage can be drawn again. Port tack is red, starboard tack green, as
a sailor expects; the true wind is blue.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.geo.angles import direction
from companion.plots.chart import date_words, legend_above, legend_below, place_words, save, scale_bar
from companion.plots.drying import DryingPicture, DryingShape, draw_drying
from companion.plots.mission import draw_gate, draw_water, gate_handles, water_handle
from companion.telemetry.folder import RecordedChart, RecordedPlan, VoyageRecord
from companion.words import clearance_words, counted

PORT_RED, STARBOARD_GREEN, WIND_BLUE, PLAN_GREY = "#b3261e", "#1b7f3b", "#1f5fa8", "#5b6472"
LAND, LAND_EDGE, WATER, GOAL = "#e7dcc3", "#8a7a55", "#f4f8fb", "#f6c945"
SAILING_MODES = frozenset({"AUTO", "GUIDED"})


def plot_voyage(record: VoyageRecord, path: Path) -> None:
    """Draw ``record`` into ``path`` (PNG, PDF or SVG by its suffix)."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(15.0, 9.6), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.15, 1.0))
    plans = [p for p in record.plans if p.plan is not None and p.plan.waypoints]
    _chart(figure.add_subplot(grid[:, 0]), record, plans)
    direction = figure.add_subplot(grid[0, 1])
    _direction(direction, record)
    _speed(figure.add_subplot(grid[1, 1], sharex=direction), record)
    _no_go(figure.add_subplot(grid[2, 1], sharex=direction), record, plans)
    _cross_track(figure.add_subplot(grid[3, 1], sharex=direction), record)
    figure.suptitle(_title(record), fontsize=12, ha="left", x=0.01)
    save(figure, path)


def _title(record: VoyageRecord) -> str:
    s, chart = record.summary, record.chart
    where = [date_words(record.began_utc), place_words(chart.origin.lat_deg, chart.origin.lon_deg)]
    if s.arrived is None:
        parts = ["unfinished voyage"]
    else:
        parts = ["arrived" if s.arrived else f"not arrived ({s.end_reason or 'unknown'})"]
        if s.time_s is not None:
            parts.append(f"{s.time_s:.0f} s, {s.distance_m or 0.0:.0f} m")
        parts.append(f"{counted(s.tacks, 'tack')}, {counted(s.replans, 'replan')}")
        if s.min_clearance_m is not None:
            promised = (
                "" if s.promised_clearance_m is None else f" (expected {clearance_words(s.promised_clearance_m)})"
            )
            parts.append(f"smallest clearance {s.min_clearance_m:.1f} m{promised}")
        if s.promised_risk is not None:
            parts.append(f"promised risk {100.0 * s.promised_risk:.0f} %")
    return "   ·   ".join([chart.name or record.folder.name, *(w for w in where if w)]) + "\n" + "   ·   ".join(parts)


def _polygon(axes: Any, wkt: str, **style: Any) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    for polygon in shapely.get_parts(shapely.from_wkt(wkt)):
        if polygon.is_empty:
            continue
        rings = [np.asarray(r.coords) for r in (polygon.exterior, *polygon.interiors)]
        codes = [c for r in rings for c in (Outline.MOVETO, *[Outline.LINETO] * (len(r) - 2), Outline.CLOSEPOLY)]
        axes.add_patch(PathPatch(Outline(np.concatenate(rings), codes), **style))


def _chart(axes: Any, record: VoyageRecord, plans: list[RecordedPlan]) -> None:
    chart, c = record.chart, record.columns
    axes.set_facecolor(WATER)
    for wkt in chart.grown:
        _polygon(axes, wkt, facecolor="none", edgecolor=LAND_EDGE, linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
    handles = draw_drying(axes, _drying(record))
    for wkt in chart.obstacles:
        _polygon(axes, wkt, facecolor=LAND, edgecolor=LAND_EDGE, linewidth=1.0, zorder=2)
    if chart.fence:
        _polygon(axes, chart.fence, facecolor="none", edgecolor="#444444", linewidth=1.4, zorder=2)
        axes.plot([], [], color="#444444", linewidth=1.4, label="fence")
    if chart.obstacles:
        axes.plot([], [], "s", color=LAND, markeredgecolor=LAND_EDGE, label="obstacle")
        axes.plot([], [], color=LAND_EDGE, linewidth=0.7, linestyle=(0, (4, 3)), label="its margin")
    for i, decision in enumerate(plans):
        way = np.asarray(decision.plan.waypoints if decision.plan else (), dtype=np.float64)
        first = i == 0
        axes.plot(
            way[:, 0],
            way[:, 1],
            color=PLAN_GREY,
            linewidth=1.6 if first else 0.8,
            alpha=0.95 if first else 0.4,
            linestyle="--" if first else "-",
            marker="o" if first else None,
            markersize=3.5,
            zorder=3,
            label="first plan" if first else ("later plan" if i == 1 else None),
        )
    _fans(axes, chart, plans)
    east, north = c["east_m"], c["north_m"]
    known = np.flatnonzero(np.isfinite(east) & np.isfinite(north))
    _sailed(axes, record)
    label: str | None = "planned again here"
    for decision in plans[1:]:
        k = int(np.searchsorted(c["t_s"], decision.t_s))
        if k < len(east) and np.isfinite(east[k]):
            axes.plot(east[k], north[k], "|", color="black", markersize=8, zorder=6, label=label)
            label = None
    _goals(axes, chart)
    if len(known):
        axes.plot(
            east[known[0]],
            north[known[0]],
            "o",
            color="white",
            markeredgecolor="black",
            markersize=8,
            zorder=7,
            label="first position",
        )
        axes.plot(east[known[-1]], north[known[-1]], "s", color="black", markersize=5, zorder=7, label="last position")
    _wind_arrow(axes, c)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.autoscale_view()
    axes.apply_aspect()
    scale_bar(axes)
    axes.set_xlabel("east of the origin, m")
    axes.set_ylabel("north of the origin, m")
    axes.grid(visible=True, color="white", linewidth=0.8, zorder=0)
    legend_below(axes, more=handles)


def _drying(record: VoyageRecord) -> DryingPicture:
    """Return the water that dries as it was when the voyage's track begins."""
    t_s = record.columns["t_s"]
    at_s = None if record.epoch_s is None or not len(t_s) else record.epoch_s + float(t_s[0])
    waters = tuple(
        DryingShape(name=w.name, shape=shapely.from_wkt(w.area), solid_unix_s=w.solid_unix_s)
        for w in record.chart.drying
    )
    return DryingPicture(waters=waters, at_s=at_s)


def _goals(axes: Any, chart: RecordedChart) -> None:
    """Draw the goals, each by its name or its place in the order."""
    from matplotlib.patches import Circle

    for number, goal in enumerate(chart.goals, start=1):
        name = goal.name or (f"goal {number}" if len(chart.goals) > 1 else "goal")
        if goal.line is not None:
            draw_gate(axes, goal.line[0], goal.line[1], name)
            continue
        if goal.water is not None:
            draw_water(axes, shapely.from_wkt(goal.water), name)
            continue
        axes.add_patch(Circle((goal.x, goal.y), goal.radius_m, facecolor=GOAL, edgecolor="black", alpha=0.8, zorder=4))
        side = f", leave to {goal.side}" if goal.side != "none" else ""
        axes.annotate(name + side, (goal.x, goal.y), xytext=(9, 7), textcoords="offset points", zorder=8)
    if any(goal.line is not None for goal in chart.goals):
        for handle in gate_handles():
            axes.add_line(handle)  # nothing of it is drawn: it stands in the legend
    if any(goal.water is not None for goal in chart.goals):
        axes.add_line(water_handle())
    if any(goal.line is None and goal.water is None for goal in chart.goals):
        axes.plot([], [], "o", color=GOAL, markeredgecolor="black", markersize=8, label="goal and its radius")


def _fans(axes: Any, chart: RecordedChart, plans: list[RecordedPlan]) -> None:
    """Draw the no-go zone at each waypoint of the first plan: the boat's own, and as the forecast widened it."""
    from matplotlib.patches import Wedge

    if not plans or plans[0].plan is None or plans[0].twd_deg is None:
        return
    legs = plans[0].plan.legs
    scale = 0.055 * max((math.dist(leg.start_en, legs[-1].end_en) for leg in legs), default=100.0)
    middle = 90.0 - plans[0].twd_deg
    for k, leg in enumerate(legs):
        for angle, shade, layer, name in (
            (leg.no_go_half_deg, "#f3c1bd", 2.4, "no-go zone as widened"),
            (chart.no_go_half_deg, "#d9867f", 2.5, "no-go zone"),
        ):
            axes.add_patch(
                Wedge(
                    leg.start_en,
                    scale,
                    middle - angle,
                    middle + angle,
                    facecolor=shade,
                    alpha=0.55,
                    edgecolor="none",
                    zorder=layer,
                    label=None if k else name,
                )
            )


def _sailed(axes: Any, record: VoyageRecord) -> None:
    """Draw the track: by tack where the autopilot sailed, dotted where the boat drifted or somebody else had it."""
    from matplotlib.collections import LineCollection

    c = record.columns
    track = np.column_stack([c["east_m"], c["north_m"]])
    known: NDArray[np.bool_] = np.isfinite(track[:, 0]) & np.isfinite(track[:, 1])
    pairs = known[:-1] & known[1:]
    if not pairs.any():
        return
    segments = np.stack([track[:-1], track[1:]], axis=1)
    sails = np.array([mode in SAILING_MODES for mode in record.texts["mode"]])[:-1]
    # Heading minus wind: positive means the wind is over the port side, which is port tack.
    twa = _wrap_deg(c["heading_deg"] - c["twd_deg"])[:-1]
    for chosen, style, name in (
        (pairs & sails & (twa > 0.0), {"color": PORT_RED, "linewidth": 2.2}, "sailed on port tack"),
        (pairs & sails & ~(twa > 0.0), {"color": STARBOARD_GREEN, "linewidth": 2.2}, "sailed on starboard tack"),
        (pairs & ~sails, {"color": "black", "linewidth": 1.2, "linestyle": ":"}, "adrift, or in other hands"),
    ):
        if chosen.any():
            axes.add_collection(LineCollection(list(segments[chosen]), zorder=5, **style))
            axes.plot([], [], label=name, **style)
    axes.update_datalim(track[known])


def _wind_arrow(axes: Any, c: dict[str, NDArray[np.float64]]) -> None:
    twd = c["twd_deg"]
    twd = twd[np.isfinite(twd)]
    if not len(twd):
        return
    mean = math.atan2(float(np.sin(np.radians(twd)).mean()), float(np.cos(np.radians(twd)).mean()))
    x, y, length = 0.07, 0.90, 0.07
    axes.annotate(
        "",
        xy=(x - length / 2 * math.sin(mean), y - length / 2 * math.cos(mean)),
        xytext=(x + length / 2 * math.sin(mean), y + length / 2 * math.cos(mean)),
        xycoords="axes fraction",
        textcoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "color": WIND_BLUE, "linewidth": 2.4},
    )
    axes.text(
        x,
        y - 0.075,
        f"mean wind\n{direction(mean)}°",
        transform=axes.transAxes,
        color=WIND_BLUE,
        ha="center",
        va="top",
        fontsize=9,
    )


def _wrap_deg(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray((angle + 180.0) % 360.0 - 180.0)


def _direction(axes: Any, record: VoyageRecord) -> None:
    c = record.columns
    t = c["t_s"] - record.start_s
    unwrapped = c["twd_deg"].copy()
    known = np.isfinite(unwrapped)
    unwrapped[known] = np.degrees(np.unwrap(np.radians(unwrapped[known])))
    if known.any() and np.nanmean(unwrapped) > 180.0:
        unwrapped -= 360.0
    sigma = c["twd_sigma_deg"]
    axes.fill_between(
        t,
        unwrapped - 1.96 * sigma,
        unwrapped + 1.96 * sigma,
        color=WIND_BLUE,
        alpha=0.15,
        linewidth=0,
        label="95 % a minute ahead",
    )
    axes.plot(t, unwrapped, color=WIND_BLUE, linewidth=1.2, label="wind from (5 s mean)")
    axes.set_ylabel("TWD, °")
    legend_above(axes)
    axes.grid(visible=True, alpha=0.3)


def _speed(axes: Any, record: VoyageRecord) -> None:
    c = record.columns
    t = c["t_s"] - record.start_s
    axes.plot(t, c["tws_mps"], color=WIND_BLUE, linewidth=1.0, label="true wind")
    axes.plot(t, c["sog_mps"], color="black", linewidth=1.0, label="boat over ground")
    axes.set_ylabel("speed, m/s")
    axes.set_ylim(bottom=0.0)
    legend_above(axes)
    axes.grid(visible=True, alpha=0.3)


def _no_go(axes: Any, record: VoyageRecord, plans: list[RecordedPlan]) -> None:
    """Draw |TWA| as sailed over the half angle that each plan kept clear, from when it was made to the next."""
    c = record.columns
    t0 = record.start_s
    bare = record.chart.no_go_half_deg
    axes.axhspan(0.0, bare, color="#d9867f", alpha=0.35, linewidth=0, label=f"no-go zone of the mission, {bare:g}°")
    times = [p.t_s - t0 for p in plans] + [float(c["t_s"][-1]) - t0 if len(c["t_s"]) else 0.0]
    for k, plan in enumerate(plans):
        start_s = times[k]
        xs: list[float] = []
        ys: list[float] = []
        for horizon_s, half_deg in plan.widening or ():
            at_s = start_s + horizon_s
            if at_s > times[k + 1] + 1e-9 and xs:
                break
            xs.append(at_s)
            ys.append(half_deg)
        if xs and xs[-1] < times[k + 1]:
            xs.append(times[k + 1])
            ys.append(ys[-1])
        if xs:
            axes.fill_between(
                xs, bare, ys, color="#f3c1bd", alpha=0.6, linewidth=0, label="as plans widened it" if k == 0 else None
            )
    twa = np.abs(_wrap_deg(c["heading_deg"] - c["twd_deg"]))
    axes.plot(c["t_s"] - t0, twa, color="black", linewidth=0.9, label="|TWA| as sailed")
    axes.set_ylim(0.0, 180.0)
    axes.set_yticks(range(0, 181, 45))
    axes.set_ylabel("angle to the wind, °")
    legend_above(axes)
    axes.grid(visible=True, alpha=0.3)


def _cross_track(axes: Any, record: VoyageRecord) -> None:
    c = record.columns
    t = c["t_s"] - record.start_s
    axes.plot(t, c["cross_track_m"], color=PLAN_GREY, linewidth=1.0, label="cross-track (+ right)")
    axes.plot(t, c["clearance_m"], color="#8a5a00", linewidth=1.2, label="clearance")
    axes.axhline(0.0, color="black", linewidth=0.6)
    margin_m = record.chart.margin_m
    if margin_m is not None:
        axes.axhline(margin_m, color="#8a5a00", linewidth=0.8, linestyle=":", label="planned margin")
    axes.set_ylim(-40.0, 60.0)
    axes.set_ylabel("metres")
    axes.set_xlabel("time since the start, s")
    legend_above(axes)
    axes.grid(visible=True, alpha=0.3)
