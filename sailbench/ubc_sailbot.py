"""UBC Sailbot's published test plans, as missions and scenarios of ours, sailed: ``python -m sailbench.ubc_sailbot``.

    git clone https://github.com/UBCSailbot/sailbot_workspace
    python -m sailbench.ubc_sailbot sailbot_workspace/src/local_pathfinding/test_plans --out ubc

Their plans (Apache-2.0, fetched and not part of this project) are YAML: a start, a route from its end to its beginning,
land, ships, a wind that is named by where it flows *to*, speeds in km/h. Each becomes ``NAME.toml`` (a mission), with
``NAME.wkt`` where there is land, and ``NAME-scenario.toml``; all are sailed by the companion on the embedded autopilot
for as long as their runner let them in July 2026, two hours, and the table says how far each came. A voyage is one line
of ``voyages.jsonl``, and what is there is not sailed again.
"""

from __future__ import annotations

import argparse
import json
import math
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise, zip_longest
from pathlib import Path
from typing import Any

import shapely
import tomli_w

from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint

HOURS = 2.0  # what their runs of July 2026 had
REACHED_M = 300.0  # theirs: a waypoint of the route is reached, and the last of them ends a run
KMH = 1.0 / 3.6
MARGIN_M, FLOOR_M = 50.0, 20.0
FAR_M = 45_000.0  # from here on a route is a passage
NO_COURSE_DEG = 360.0  # their "course unavailable"


@dataclass(frozen=True, slots=True, kw_only=True)
class UbcPlan:
    """A plan of theirs in our words; ``left_out``: what of it has no counterpart."""

    name: str
    mission: Mapping[str, Any]
    scenario: Mapping[str, Any]
    land: tuple[str, ...]  # WKT, longitude before latitude
    left_out: tuple[str, ...]

    def write(self, folder: Path) -> Path:
        """Write its files; return the scenario's."""
        folder.mkdir(parents=True, exist_ok=True)
        (folder / f"{self.name}.toml").write_text(tomli_w.dumps(self.mission), encoding="utf-8")
        if self.land:
            lines = [f"land {n}|exclusion|{wkt}" for n, wkt in enumerate(self.land, start=1)]
            (folder / f"{self.name}.wkt").write_text("\n".join(lines) + "\n", encoding="utf-8")
        path = folder / f"{self.name}-scenario.toml"
        path.write_text(tomli_w.dumps(self.scenario), encoding="utf-8")
        return path


def from_deg(flows_to_deg: float) -> float:
    """Return where a wind comes from [deg, 0 to 360) that flows to a direction."""
    return (flows_to_deg + 180.0) % 360.0


def converted(plan: Mapping[str, Any], name: str, hours: float = HOURS) -> UbcPlan:
    """Return a plan of theirs in our words.

    Raises:
        InputError: it has no start or no route.
        KeyError, TypeError: it is not of their form.

    """
    if not isinstance(plan, Mapping):
        raise TypeError("no mapping")
    if not plan.get("gps") or not plan.get("global_path"):
        raise InputError(name, "", "has no start or no route", "it is no voyage: leave it out")
    start = GeoPoint(lat_deg=plan["gps"]["latitude"], lon_deg=plan["gps"]["longitude"])
    frame = LocalFrame(start)
    route = [GeoPoint(lat_deg=w["latitude"], lon_deg=w["longitude"]) for w in plan["global_path"]["waypoints"]][::-1]
    while len(route) > 1 and math.hypot(*frame.en_from_geo(route[0])) < REACHED_M:
        route.pop(0)  # she begins there
    land = tuple(shapely.to_wkt(shapely.Polygon(ring)) for ring in plan.get("land") or ())
    events, left_out = _events(plan.get("events") or {}, plan["tw_dir_deg"])
    for ship in plan.get("ais") or ():
        at = frame.en_from_geo(GeoPoint(lat_deg=ship["lat"], lon_deg=ship["lon"]))
        has_course = ship["heading"] != NO_COURSE_DEG
        if not has_course:
            left_out.append(f"ship {ship['id']} has no course: she lies still")
        events.append(
            {
                "at_s": 0.0,
                "kind": "vessel",
                "east_m": at[0],
                "north_m": at[1],
                "course_deg": float(ship["heading"]) % 360.0,
                "sog_mps": ship["speed"] * KMH if has_course else 0.0,
                "length_m": max(1.0, float(ship["height"])),
            }
        )
    legs_m = [math.hypot(*LocalFrame(a).en_from_geo(b)) for a, b in pairwise([start, *route])]
    mission: dict[str, Any] = {
        "name": name,
        "description": "A test plan of UBC Sailbot's (Apache-2.0), converted.",
        "start": {"lat": start.lat_deg, "lon": start.lon_deg, "heading_deg": float(plan["heading_deg"]) % 360.0},
        "goal": [
            {"name": f"{n}", "lat": p.lat_deg, "lon": p.lon_deg, "radius_m": REACHED_M}
            for n, p in enumerate(route, start=1)
        ],
        "operator": {"arm": True, "set_auto": True},
    }
    if land:
        mission["area"] = {"obstacles": [f"{name}.wkt"], "margin_m": MARGIN_M, "margin_floor_m": FLOOR_M}
    if sum(legs_m) > FAR_M:
        mission["passage"] = {"leg_m": 1.1 * max(legs_m)}
        mission["skipper"] = {"horizon_m": 30_000.0}
    tws_mps = plan["tw_speed_kmph"] * KMH
    scenario = {
        "name": name,
        "title": f"{name} of UBC Sailbot's test plans",
        "mission": f"{name}.toml",
        "limit_s": 3600.0 * hours,
        "wind": {"from_deg": from_deg(plan["tw_dir_deg"]), "tws_mps": tws_mps, "tws_sd_mps": 0.1 * tws_mps},
        "parameters": {"FENCE_TYPE": 4.0},
        "events": events,
    }
    return UbcPlan(name=name, mission=mission, scenario=scenario, land=land, left_out=tuple(left_out))


def _events(events: Mapping[str, Sequence[Mapping[str, Any]]], flows_to_deg: float) -> tuple[list[Any], list[str]]:
    """Return what befalls the boat, and what of it has no counterpart here."""
    made: list[Any] = []
    left_out: list[str] = []
    now_deg = flows_to_deg
    for event in events.get("mock_wind_sensor", ()):
        veer_deg = (event["direction_deg"] - now_deg + 180.0) % 360.0 - 180.0
        now_deg = event["direction_deg"]
        at_s = event["timestamp"]
        made += [
            {"at_s": at_s, "kind": "wind_shift", "veer_deg": float(veer_deg)},
            {"at_s": at_s, "kind": "wind_speed", "tws_mps": event["speed_kmph"] * KMH},
        ]
    drifts = [e for e in events.get("mock_gps", ()) if "use_ocean_drift" in e]
    for event, after in zip_longest(drifts, drifts[1:]):
        if event["use_ocean_drift"]:
            drift = {
                "at_s": event["timestamp"],
                "kind": "current",
                "set_deg": event.get("ocean_drift_dir_deg", 0.0) % 360.0,
                "drift_mps": event.get("ocean_drift_speed_kmph", 0.0) * KMH,
            }
            made.append(drift if after is None else {**drift, "for_s": after["timestamp"] - event["timestamp"]})
    if any(event.get("publish_heading") is False for event in events.get("mock_gps", ())):
        left_out.append("the heading falls silent: ArduRover's comes with its position")
    if events.get("mock_ais"):
        left_out.append("AIS messages that leave ships out: ours are the ships, which sail on")
    if events.get("mock_global_path"):
        left_out.append("another route under way")
    return made, left_out


def plans_of(folder: Path, hours: float = HOURS) -> Iterator[UbcPlan]:
    """Yield the voyages among the plans of a folder, by name; say on the error output which are none."""
    import yaml

    files = sorted(folder.glob("*.yaml"))
    if not files:
        raise InputError(str(folder), "", "holds no .yaml", "name src/local_pathfinding/test_plans of their repository")
    for file in files:
        try:
            yield converted(yaml.safe_load(file.read_text(encoding="utf-8")), file.stem, hours)
        except InputError as none:
            print(none, file=sys.stderr)
        except (AttributeError, KeyError, TypeError, ValueError, yaml.YAMLError) as error:
            words = " ".join(f"{type(error).__name__}: {error}".split())
            raise InputError(
                str(file), "", f"is no test plan of theirs ({words})", "name the folder of them"
            ) from error


def sail(plan: UbcPlan, folder: Path) -> dict[str, Any]:
    """Sail a plan with seed 0; return how far she came and what she touched."""
    from companion.clock import run_virtual
    from companion.geofence import load_mission
    from lab.campaigns.baselines import BaselineTrack
    from sitl.run.embedded import run_embedded
    from sitl.scenario import load_scenario

    path = plan.write(folder)
    try:
        track = BaselineTrack(load_mission(folder / f"{plan.name}.toml"))
        verdict = run_virtual(
            run_embedded(load_scenario(path), path, 0, folder / "voyages" / plan.name, observer=track.observe())
        )
    except InputError as refused:
        return {"plan": plan.name, "refused": f"{refused.place}: {refused.problem}"}
    frame = track.mission.frame()
    places = [frame.en_from_geo(goal.point) for goal in track.mission.goals][len(track.goals_s) :]
    ways = [track.truth.en_m[-1] if track.truth.en_m else (0.0, 0.0), *places]
    return {
        "plan": plan.name,
        **track.record("companion", plan.name, 0),
        "goals": len(track.goals_s),
        "of": len(track.mission.goals),
        "sailed_s": track.truth.t_s[-1] - track.truth.t_s[0] if track.truth.t_s else 0.0,
        "sailed_km": sum(math.dist(a, b) for a, b in pairwise(track.truth.en_m)) / 1e3,
        "to_go_km": sum(math.dist(a, b) for a, b in pairwise(ways)) / 1e3,
        "vessel_m": min(verdict.figures["vessel_distances_m"].values(), default=None),
        "replans": verdict.figures.get("replans"),
        "end_reason": verdict.figures.get("end_reason"),
        "left_out": plan.left_out,
    }


def table(rows: Sequence[Mapping[str, Any]]) -> str:
    """Return the voyages as a Markdown table."""
    lines = [
        "| plan | arrived | goals | hours | sailed km | to go km | contacts | nearest ship m | replans | left out |",
        "|---|---|---|--:|--:|--:|--:|--:|--:|---|",
    ]
    for row in sorted(rows, key=lambda r: str(r["plan"])):
        if "refused" in row:
            lines.append(f"| `{row['plan']}` | refused | | | | | | | | {row['refused']} |")
            continue
        ship = "" if row["vessel_m"] is None else f"{row['vessel_m']:.0f}"
        lines.append(
            f"| `{row['plan']}` | {'yes' if row['arrived'] else 'no'} | {row['goals']} of {row['of']} "
            f"| {row['sailed_s'] / 3600.0:.2f} | {row['sailed_km']:.2f} | {row['to_go_km']:.2f} | {row['contacts']} "
            f"| {ship} | {row['replans']} | {'; '.join(row['left_out'])} |"
        )
    return "\n".join(lines)


def main(argv: Sequence[str] | None = None) -> int:
    """Convert, sail what was not sailed yet, print the table."""
    parser = argparse.ArgumentParser(
        prog="python -m sailbench.ubc_sailbot",
        description=(__doc__ or "").splitlines()[0],
        epilog="example: python -m sailbench.ubc_sailbot sailbot_workspace/src/local_pathfinding/test_plans --out ubc",
    )
    parser.add_argument("folder", type=Path, help="their test_plans, of a clone of their sailbot_workspace")
    parser.add_argument("--out", type=Path, default=Path("ubc"), help="where missions, scenarios and voyages go")
    parser.add_argument("--only", nargs="+", metavar="PLAN", help="some of them, by name")
    parser.add_argument("--hours", type=float, default=HOURS, help="of a voyage at most (default: theirs, 2)")
    parser.add_argument("--convert", action="store_true", help="write missions and scenarios; do not sail")
    args = parser.parse_args(argv)
    try:
        plans = [plan for plan in plans_of(args.folder, args.hours) if args.only is None or plan.name in args.only]
    except InputError as error:
        print(f"sailbench: {error}", file=sys.stderr)
        return 2
    if args.convert:
        for plan in plans:
            print(plan.write(args.out))
        return 0
    kept = args.out / "voyages.jsonl"
    rows = [json.loads(line) for line in kept.read_text(encoding="utf-8").splitlines()] if kept.is_file() else []
    for plan in plans:
        if plan.name not in {row["plan"] for row in rows}:
            rows.append(sail(plan, args.out))
            with kept.open("a", encoding="utf-8") as file:
                file.write(json.dumps(rows[-1]) + "\n")
    print(table(rows))
    return 0


if __name__ == "__main__":
    sys.exit(main())
