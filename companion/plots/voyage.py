"""The picture of a voyage: the chart with planned and sailed tracks, and the wind with the no-go zone as it widened.

Reads a voyage folder, nothing else, so any voyage can be drawn again. Port tack is red, starboard tack green, as
a sailor expects; the true wind is blue.
"""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.errors import InputError
from companion.telemetry.names import AREA, DECISIONS, SUMMARY, TRACK
from companion.telemetry.recorder import read_jsonl

PORT_RED, STARBOARD_GREEN, WIND_BLUE, PLAN_GREY = "#b3261e", "#1b7f3b", "#1f5fa8", "#5b6472"
LAND, LAND_EDGE, WATER = "#e7dcc3", "#8a7a55", "#f4f8fb"


@dataclass(frozen=True, slots=True, kw_only=True)
class VoyageRecord:
    """What a voyage folder holds; columns are float arrays with NaN for what is unknown."""

    folder: Path
    columns: dict[str, NDArray[np.float64]]
    texts: dict[str, list[str]]
    decisions: list[dict[str, Any]]
    area: dict[str, Any]
    summary: dict[str, Any]


def read_voyage(folder: Path) -> VoyageRecord:
    """Read a voyage folder.

    Raises:
        InputError: it is not a voyage folder, naming the missing file.
    """
    for name in (TRACK, DECISIONS, AREA):
        if not (folder / name).is_file():
            raise InputError(str(folder), name, "is missing", "name a folder that `companion run` left")
    with (folder / TRACK).open(newline="", encoding="utf-8") as file:
        rows = [r for r in csv.DictReader(file) if r.get("t_s") and None not in r.values()]
    texts: dict[str, list[str]] = {k: [r[k] for r in rows] for k in ("mode", "phase")}
    names = [k for k in (rows[0] if rows else {}) if k not in texts]
    columns = {k: np.array([_number(r[k]) for r in rows], dtype=np.float64) for k in names}
    summary_path = folder / SUMMARY
    return VoyageRecord(
        folder=folder,
        columns=columns,
        texts=texts,
        decisions=_joined(read_jsonl(folder / DECISIONS)),
        area=json.loads((folder / AREA).read_text(encoding="utf-8")),
        summary=json.loads(summary_path.read_text(encoding="utf-8")) if summary_path.is_file() else {},
    )


def _joined(decisions: list[dict[str, Any]]) -> list[dict[str, Any]]:
    """Give each plan the facts of its request: reason, wind, widening of the no-go zone."""
    requests = {d["request_id"]: d for d in decisions if d.get("action") == "RequestPlan"}
    for decision in decisions:
        if decision.get("kind") == "plan":
            request = requests.get(decision.get("request_id"), {})
            for key in ("reason", "rung", "twd_deg", "widening"):
                decision.setdefault(key, request.get(key))
    return decisions


def _number(text: str) -> float:
    try:
        return float(text)
    except ValueError:
        return math.nan


def plot_voyage(record: VoyageRecord, path: Path) -> None:
    """Draw ``record`` into ``path`` (PNG, PDF or SVG by its suffix)."""
    import matplotlib as mpl

    mpl.use("Agg")
    import matplotlib.pyplot as plt

    figure = plt.figure(figsize=(15.0, 9.2), layout="constrained")
    grid = figure.add_gridspec(4, 2, width_ratios=(1.15, 1.0))
    plans = [d for d in record.decisions if d.get("kind") == "plan" and (d.get("plan") or {}).get("waypoints")]
    _chart(figure.add_subplot(grid[:, 0]), record, plans)
    direction = figure.add_subplot(grid[0, 1])
    _direction(direction, record)
    _speed(figure.add_subplot(grid[1, 1], sharex=direction), record)
    _no_go(figure.add_subplot(grid[2, 1], sharex=direction), record, plans)
    _cross_track(figure.add_subplot(grid[3, 1], sharex=direction), record)
    figure.suptitle(_title(record), fontsize=13, ha="left", x=0.01)
    figure.savefig(path, dpi=110)
    plt.close(figure)


def _title(record: VoyageRecord) -> str:
    s = record.summary
    if not s:
        return f"{record.area.get('name', record.folder.name)}: unfinished voyage"
    end = "arrived" if s.get("arrived") else f"not arrived ({s.get('end_reason', 'unknown')})"
    parts = [f"{record.area.get('name', record.folder.name)}: {end}"]
    if s.get("time_s") is not None:
        parts.append(f"{s['time_s']:.0f} s, {s.get('distance_m') or 0.0:.0f} m")
    parts.append(f"{s.get('tacks')} tacks, {s.get('replans')} replans")
    if s.get("min_clearance_m") is not None:
        parts.append(f"smallest clearance {s['min_clearance_m']:.1f} m")
    if s.get("promised_risk") is not None:
        parts.append(f"promised risk {100.0 * s['promised_risk']:.0f} %")
    return "   ·   ".join(parts)


def _start_s(record: VoyageRecord) -> float:
    t = record.columns.get("t_s")
    return float(t[0]) if t is not None and len(t) else 0.0


def _polygon(axes: Any, wkt: str, **style: Any) -> None:
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path as Outline

    for polygon in shapely.get_parts(shapely.from_wkt(wkt)):
        if polygon.is_empty:
            continue
        rings = [np.asarray(r.coords) for r in (polygon.exterior, *polygon.interiors)]
        codes = [c for r in rings for c in (Outline.MOVETO, *[Outline.LINETO] * (len(r) - 2), Outline.CLOSEPOLY)]
        axes.add_patch(PathPatch(Outline(np.concatenate(rings), codes), **style))


def _chart(axes: Any, record: VoyageRecord, plans: list[dict[str, Any]]) -> None:
    from matplotlib.patches import Circle

    area, c = record.area, record.columns
    axes.set_facecolor(WATER)
    for wkt in area.get("grown", []):
        _polygon(axes, wkt, facecolor="none", edgecolor=LAND_EDGE, linewidth=0.7, linestyle=(0, (4, 3)), zorder=1)
    for wkt in area.get("obstacles", []):
        _polygon(axes, wkt, facecolor=LAND, edgecolor=LAND_EDGE, linewidth=1.0, zorder=2)
    if area.get("fence"):
        _polygon(axes, area["fence"], facecolor="none", edgecolor="#444444", linewidth=1.4, zorder=2)
    for i, decision in enumerate(plans):
        way = np.asarray(decision["plan"]["waypoints"], dtype=np.float64)
        first = i == 0
        axes.plot(
            way[:, 0], way[:, 1], color=PLAN_GREY, linewidth=1.6 if first else 0.8, alpha=0.95 if first else 0.4,
            linestyle="--" if first else "-", marker="o" if first else None, markersize=3.5, zorder=3,
            label="first plan" if first else ("replanned" if i == 1 else None),
        )
    _fans(axes, area, plans)
    east, north = c.get("east_m", np.empty(0)), c.get("north_m", np.empty(0))
    twa = _wrap_deg(c["heading_deg"] - c["twd_deg"]) if "twd_deg" in c else np.empty(0)
    _tack_coloured(axes, east, north, twa)
    for decision in plans[1:]:
        if decision["plan"]["waypoints"]:
            t = decision.get("t_s", 0.0)
            k = int(np.searchsorted(c["t_s"], t)) if len(c.get("t_s", [])) else 0
            if k < len(east):
                axes.plot(east[k], north[k], marker="|", color="black", markersize=7, zorder=6)
    for goal in area.get("goals", []):
        axes.add_patch(Circle((goal["x"], goal["y"]), goal["radius_m"], facecolor="#f6c945", edgecolor="black",
                              alpha=0.8, zorder=4))
        axes.annotate(goal.get("name") or "goal", (goal["x"], goal["y"]), xytext=(9, 7), textcoords="offset points")
    if len(east):
        axes.plot(east[0], north[0], marker="o", color="white", markeredgecolor="black", markersize=8, zorder=7)
        axes.annotate("start", (east[0], north[0]), xytext=(9, -12), textcoords="offset points")
        axes.plot(east[-1], north[-1], marker="s", color="black", markersize=5, zorder=7)
    _wind_arrow(axes, c)
    axes.set_aspect("equal", adjustable="datalim")
    axes.margins(0.06)
    axes.set_xlabel("east, m")
    axes.set_ylabel("north, m")
    axes.grid(visible=True, color="white", linewidth=0.8, zorder=0)
    handles, labels = axes.get_legend_handles_labels()
    if handles:
        axes.legend(handles, labels, loc="lower right", fontsize=8, framealpha=0.9)


def _fans(axes: Any, area: dict[str, Any], plans: list[dict[str, Any]]) -> None:
    """Draw the no-go zone at each waypoint of the first plan: the boat's own, and as the forecast widened it."""
    from matplotlib.patches import Wedge

    if not plans:
        return
    legs = plans[0]["plan"].get("legs", [])
    wind_deg = plans[0].get("twd_deg")
    if wind_deg is None:
        return
    scale = 0.055 * max((math.dist(leg["from"], legs[-1]["to"]) for leg in legs), default=100.0)
    bare = float(area.get("no_go_half_deg", 45.0))
    for k, leg in enumerate(legs):
        half = float(leg["no_go_half_deg"])
        middle = 90.0 - float(wind_deg)
        for angle, shade, layer in ((half, "#f3c1bd", 2.4), (bare, "#d9867f", 2.5)):
            axes.add_patch(Wedge(leg["from"], scale, middle - angle, middle + angle, facecolor=shade, alpha=0.55,
                                 edgecolor="none", zorder=layer,
                                 label=None if k else ("no-go zone, widened" if angle == half else "no-go zone")))


def _tack_coloured(axes: Any, east: NDArray[np.float64], north: NDArray[np.float64], twa: NDArray[np.float64]) -> None:
    from matplotlib.collections import LineCollection

    if len(east) < 2:
        return
    segments = np.stack([np.column_stack([east[:-1], north[:-1]]), np.column_stack([east[1:], north[1:]])], axis=1)
    # Heading minus wind: positive means the wind is over the port side, which is port tack.
    colours = [PORT_RED if a > 0.0 else STARBOARD_GREEN for a in twa[:-1]]
    axes.add_collection(LineCollection(list(segments), colors=colours, linewidths=2.2, zorder=5))
    axes.update_datalim(np.column_stack([east, north]))
    axes.plot([], [], color=PORT_RED, linewidth=2.2, label="sailed, port tack")
    axes.plot([], [], color=STARBOARD_GREEN, linewidth=2.2, label="sailed, starboard tack")


def _wind_arrow(axes: Any, c: dict[str, NDArray[np.float64]]) -> None:
    twd = c.get("twd_deg", np.empty(0))
    twd = twd[np.isfinite(twd)]
    if not len(twd):
        return
    mean = math.atan2(float(np.sin(np.radians(twd)).mean()), float(np.cos(np.radians(twd)).mean()))
    x, y, length = 0.07, 0.90, 0.07
    axes.annotate(
        "", xy=(x - length / 2 * math.sin(mean), y - length / 2 * math.cos(mean)),
        xytext=(x + length / 2 * math.sin(mean), y + length / 2 * math.cos(mean)),
        xycoords="axes fraction", textcoords="axes fraction",
        arrowprops={"arrowstyle": "-|>", "color": WIND_BLUE, "linewidth": 2.4},
    )
    axes.text(x, y - 0.075, f"mean wind\n{math.degrees(mean) % 360.0:03.0f}°", transform=axes.transAxes,
              color=WIND_BLUE, ha="center", va="top", fontsize=9)


def _wrap_deg(angle: NDArray[np.float64]) -> NDArray[np.float64]:
    return np.asarray((angle + 180.0) % 360.0 - 180.0)


def _direction(axes: Any, record: VoyageRecord) -> None:
    c = record.columns
    if "twd_deg" not in c:
        return
    t = c["t_s"] - _start_s(record)
    unwrapped = c["twd_deg"].copy()
    known = np.isfinite(unwrapped)
    unwrapped[known] = np.degrees(np.unwrap(np.radians(unwrapped[known])))
    if known.any() and np.nanmean(unwrapped) > 180.0:
        unwrapped -= 360.0
    sigma = c["twd_sigma_deg"]
    axes.fill_between(t, unwrapped - 1.96 * sigma, unwrapped + 1.96 * sigma, color=WIND_BLUE, alpha=0.15, linewidth=0,
                      label="95 % a minute ahead")
    axes.plot(t, unwrapped, color=WIND_BLUE, linewidth=1.2, label="wind from (5 s mean)")
    axes.set_ylabel("TWD, °")
    axes.legend(loc="upper right", fontsize=8, ncols=2)
    axes.grid(visible=True, alpha=0.3)


def _speed(axes: Any, record: VoyageRecord) -> None:
    c = record.columns
    t = c.get("t_s", np.empty(0)) - _start_s(record)
    axes.plot(t, c.get("tws_mps", t * math.nan), color=WIND_BLUE, linewidth=1.0, label="true wind")
    axes.plot(t, c.get("sog_mps", t * math.nan), color="black", linewidth=1.0, label="boat over ground")
    axes.set_ylabel("speed, m/s")
    axes.set_ylim(bottom=0.0)
    axes.legend(loc="upper right", fontsize=8, ncols=2)
    axes.grid(visible=True, alpha=0.3)


def _no_go(axes: Any, record: VoyageRecord, plans: list[dict[str, Any]]) -> None:
    """Draw |TWA| as sailed over the half angle that each plan kept clear, from when it was made to the next."""
    c = record.columns
    t0 = _start_s(record)
    bare = float(record.area.get("no_go_half_deg", 45.0))
    axes.axhspan(0.0, bare, color="#d9867f", alpha=0.35, linewidth=0, label="no-go zone")
    times = [float(p.get("t_s", 0.0)) - t0 for p in plans] + [float(c["t_s"][-1]) - t0 if len(c["t_s"]) else 0.0]
    for k, plan in enumerate(plans):
        start_s = times[k]
        xs: list[float] = []
        ys: list[float] = []
        for horizon_s, half_deg in plan.get("widening") or []:
            at_s = start_s + float(horizon_s)
            if at_s > times[k + 1] + 1e-9 and xs:
                break
            xs.append(at_s)
            ys.append(float(half_deg))
        if xs and xs[-1] < times[k + 1]:
            xs.append(times[k + 1])
            ys.append(ys[-1])
        if xs:
            axes.fill_between(xs, bare, ys, color="#f3c1bd", alpha=0.6, linewidth=0,
                              label="as the plan widened it" if k == 0 else None)
    if "twd_deg" in c:
        twa = np.abs(_wrap_deg(c["heading_deg"] - c["twd_deg"]))
        axes.plot(c["t_s"] - t0, twa, color="black", linewidth=0.9, label="|TWA| as sailed")
    axes.set_ylim(0.0, 180.0)
    axes.set_yticks(range(0, 181, 45))
    axes.set_ylabel("angle to the wind, °")
    axes.legend(loc="upper right", fontsize=8, ncols=3)
    axes.grid(visible=True, alpha=0.3)


def _cross_track(axes: Any, record: VoyageRecord) -> None:
    c = record.columns
    t = c.get("t_s", np.empty(0)) - _start_s(record)
    axes.plot(t, c.get("cross_track_m", t * math.nan), color=PLAN_GREY, linewidth=1.0, label="cross-track (+ right)")
    axes.plot(t, c.get("clearance_m", t * math.nan), color="#8a5a00", linewidth=1.2, label="clearance")
    axes.axhline(0.0, color="black", linewidth=0.6)
    margin = record.area.get("margin_m")
    if margin is not None:
        axes.axhline(float(margin), color="#8a5a00", linewidth=0.8, linestyle=":", label="planned margin")
    axes.set_ylim(-40.0, 60.0)
    axes.set_ylabel("metres")
    axes.set_xlabel("time since the start, s")
    axes.legend(loc="upper right", fontsize=8, ncols=3)
    axes.grid(visible=True, alpha=0.3)
