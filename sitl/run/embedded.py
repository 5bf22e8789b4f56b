"""Runs a scenario in one process under the running loop's clock: simulated autopilot, weather, companion, verdict.

Under the virtual clock a seed repeats a voyage bit for bit, and a voyage takes as long as its arithmetic.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import math
import traceback
from collections.abc import Callable, Coroutine, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from companion.app.options import SailOptions, SatelliteLink, at_once
from companion.app.sail import OnStatus, sail
from companion.clock import now_s
from companion.compose import boat_of, drying_of, tide_of
from companion.disk import Disk
from companion.errors import InputError, LinkError
from companion.fold import Step
from companion.geo.frame import LocalFrame
from companion.geofence import LocalArea, Mission, load_mission
from companion.guard import Auxiliary, Guard
from companion.messages import CompanionStatus, Mode
from companion.mission_check import require_sailable
from companion.page import Address
from companion.skipper.behaviors import CALL
from companion.skipper.step import Announce
from companion.telemetry.folder import STATE, SUMMARY, VERDICT, VoyageArchive
from companion.wind import Estimator, WindTracker
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.faults import (
    KEY,
    REDRAWN,
    FaultyPlanner,
    KillablePlanner,
    Observer,
    Satellite,
    SimulatedWorld,
    channel,
    inject,
)
from sitl.run.depths import feed_of, sounder_port, spoken_depths
from sitl.run.variation import Variation
from sitl.scenario import (
    Others,
    Outlet,
    Scenario,
    ScenarioVerdict,
    Terms,
    Told,
    TrueTrack,
    free_port,
    is_all_ordinary,
    judge,
    over_drying_m,
    own_polar,
    recentre_m,
    scenario_departures,
    scenario_seabed,
    scenario_sounder,
    scenario_waters,
    scenario_wind,
    tasks_of,
    under_keel_m,
)
from sitl.world import Seabed

TRUTH_EVERY_S = 0.25
MAX_TRUTH_SAMPLES = 20_000
NEAR_M = 3000.0  # within which of another vessel the truth is watched as often as on a short voyage
# Effort of one plan under the virtual clock, where time cannot stop it.
EXPANSIONS = 15_000

FAR = "far"  # the folder of the satellite link, in the voyage's
# A companion that ended for want of an autopilot is started again after this long, as its service does [s].
SERVICE_RESTART_S = 5.0
# Where outlets cannot be: what is said of them is the same on every machine.
NOWHERE = "192.0.2.1"  # an address for documentation (RFC 5737)
NO_FOLDER = Path("/dev/null")


def solid_of(area: LocalArea) -> BaseGeometry:
    """Return what the boat must not touch: the obstacles and everything outside the fence, local metres."""
    solid: BaseGeometry = shapely.union_all(list(area.polygons)) if area.polygons else shapely.Polygon()
    if area.limits is not None and not area.limits.is_empty:
        x0, y0, x1, y1 = area.limits.bounds
        around = shapely.box(x0 - 1e4, y0 - 1e4, x1 + 1e4, y1 + 1e4)
        solid = shapely.union(solid, shapely.difference(around, area.limits))
    return solid


def terms_of(scenario: Scenario, mission: Mission, seed: int, began_s: float = 0.0) -> Terms:
    """Return what a run of a scenario is held against, which began at ``began_s`` of the track's time."""
    frame = mission.frame()
    lap = [(frame.en_from_geo(g.point), g.rounding) for g in mission.goals if g.rounding is not None]
    return Terms(
        scenario=scenario.name,
        seed=seed,
        expect=scenario.expect,
        solid=solid_of(mission.water()),
        hull=boat_of(mission).hull,
        goal_en_m=frame.en_from_geo(mission.goals[-1].point),
        refuges_en_m=[frame.en_from_geo(r.point) for r in mission.refuges],
        marks=lap * mission.skipper.laps,
        tasks=tasks_of(mission, scenario.epoch_s - began_s),
        keep_m=mission.traffic.safe_distance_m,
        floor_m=mission.margin_floor_m if is_all_ordinary(scenario.events) else None,
    )


def permitted(mission: Mission, scenario: Scenario) -> Mission:
    """Return the mission with what a harness allows, and the autopilot's system where the scenario names it.

    The simulated boat may be armed, and set to AUTO and steered where the scenario does not forbid it.
    """
    options = mission.options
    operator = replace_struct(options.operator, arm=True, set_auto=scenario.set_auto)
    named = options.autopilot if scenario.system is None else replace_struct(options.autopilot, system=scenario.system)
    traffic = options.traffic if scenario.policy is None else replace_struct(options.traffic, policy=scenario.policy)
    return replace(mission, options=replace_struct(options, operator=operator, autopilot=named, traffic=traffic))


def mission_of(scenario: Scenario, source: Path) -> Mission:
    """Return the mission that a scenario sails, with what a harness allows. Raises InputError: it cannot be sailed."""
    mission = load_mission(scenario.mission_path(source))
    if scenario.bottom is not None and mission.boat.draft_m is None:
        raise InputError(
            str(source),
            "bottom",
            f"{scenario.mission} says no draft_m, so nothing could ground",
            "add it to its [boat]",
        )
    return require_sailable(permitted(mission, scenario))


def replace_struct(struct: Any, **changes: Any) -> Any:
    """Return a copy of a msgspec struct with ``changes``."""
    import msgspec

    return msgspec.structs.replace(struct, **changes)


# What is done ashore over a port of the autopilot's own; into which nothing is plugged where none of it is.
SHORE_EVENTS = frozenset({"foreign_mission", "parameter", "order"}) | REDRAWN
RADIO_EVENTS = frozenset({"intruder", "second_boat"})


def with_radio(mission: Mission, scenario: Scenario) -> tuple[Mission, int]:
    """Return the mission with its UDP feed at a free port, and the port; 0 where nothing is told by radio."""
    feeds = mission.traffic.feeds
    told = any(e.kind in RADIO_EVENTS or (e.kind == "meeting" and e.receiver == "feed") for e in scenario.events)
    if not told or not any(f.startswith("udpin:") for f in feeds):
        return mission, 0
    port = free_port()
    moved = tuple(f"udpin:127.0.0.1:{port}" if f.startswith("udpin:") else f for f in feeds)
    traffic = replace_struct(mission.options.traffic, feeds=moved)
    return replace(mission, options=replace_struct(mission.options, traffic=traffic)), port


async def run_embedded(
    scenario: Scenario,
    source: Path,
    seed: int,
    folder: Path,
    *,
    on_status: OnStatus | None = None,
    expansions: int | None = EXPANSIONS,
    observer: Observer | None = None,
    worker_pace: float | None = None,
    variation: Variation | None = None,
    archive: VoyageArchive | None = None,
) -> ScenarioVerdict:
    """Sail ``scenario`` on the embedded autopilot; leaves a voyage folder with verdict.json.

    With ``worker_pace`` (loop seconds per second, on a loop in real time that begins at 0) the planner is the real
    worker process, and plans by its budget of time. ``variation``: what is another in the mission than its file says.
    ``archive``: the folder of ``folder``, and what all voyages in it may take; None: they are left alone.
    """
    mission, radio_port = with_radio(mission_of(scenario, source), scenario)
    depths_port = sounder_port(mission, scenario)
    mission = mission.with_sounder(feed_of(depths_port))
    wind = scenario_wind(scenario, source, seed)
    room = None
    if variation is not None:
        mission = require_sailable(variation.mission(mission))
        room = None if variation.room is None else partial(variation.room, wind)
    start = mission.start or mission.origin
    seabed = scenario_seabed(scenario, source, mission.frame())
    heading_deg = scenario.start_heading_deg
    if heading_deg is None:
        heading_deg = mission.options.start.heading_deg if mission.options.start else 0.0
    autopilot = SimulatedAutopilot(
        AutopilotConfig(
            home=start,
            heading_rad=math.radians(heading_deg),
            is_warm=True,
            is_moored=True,
            parameters=scenario.parameters,
            has_ftp=scenario.has_ftp,
            has_motor=mission.boat.motor,
            is_motorboat=mission.autopilot.frame == "motor",
            polar=own_polar(mission),
            epoch_s=scenario.epoch_s,
            departures=scenario_departures(scenario),
            waters=scenario_waters(scenario, wind, mission.frame().en_from_geo(start)),
            recentre_m=recentre_m(mission),
            sounder=scenario_sounder(scenario, seabed, seed),
            hears_sounder=not depths_port,
        ),
        wind,
        seed=seed,
    )
    link = MemoryLink("companion", seed=seed)
    frame = mission.frame()
    world = SimulatedWorld(
        autopilot=autopilot,
        link=link,
        frame=frame,
        wind=wind,
        seed=seed,
        shore=MemoryLink("shore", seed=seed + 1),
        station=MemoryLink("station", seed=seed + 2),
        observer=observer,
        others=Others(frame, wind, seed, port=radio_port, hear=autopilot.hear_vessel),
    )
    channel(world, scenario.events)
    if scenario.satellite is not None:
        world.satellite = Satellite(scenario.satellite, folder / FAR, seed=seed, epoch_s=scenario.epoch_s)
    folder.mkdir(parents=True, exist_ok=True)
    station = [world.station.far] if any(e.kind == "station" for e in scenario.events) else []
    shore = world.shore.far if any(e.kind in SHORE_EVENTS for e in scenario.events) else None
    below_m = 0.0 if scenario.bottom is None else scenario.bottom.below_m
    async with (
        serve(autopilot, [link.far, shore, *station]),
        spoken_depths(lambda: autopilot.core.sounding_m, depths_port, below_m),
    ):
        side_tasks = [
            asyncio.create_task(_watch_truth(world, frame, scenario.limit_s), name="truth"),
            *([asyncio.create_task(world.satellite.run(), name="satellite")] if world.satellite is not None else []),
            *(asyncio.create_task(inject(world, e), name=f"event {e.kind}") for e in scenario.events),
        ]
        await _sail_and_restart(
            world, scenario, mission, seed, folder, on_status, expansions, worker_pace, room, archive
        )
        for task in side_tasks:
            task.cancel()
        for task in side_tasks:
            with contextlib.suppress(asyncio.CancelledError):
                await task
    verdict = judge(
        terms_of(scenario, mission, seed),
        world.truth,
        Told(
            summary=of_all_lives(world.summary, world.lives),
            alerts=world.alerts,
            errors=world.errors,
            status_times_s=world.status_s,
            called_at_s=world.called_at_s,
            ordered=world.ordered if world.neighbours else None,
        ),
        keel_m=keel_of(mission, world.truth, seabed, 0.0, scenario.epoch_s),
    )
    Disk().replace(folder / VERDICT, json.dumps(verdict.to_dict(), indent=1).encode())
    return verdict


def keel_of(
    mission: Mission, truth: TrueTrack, seabed: Seabed | None, began_s: float, epoch_s: float
) -> NDArray[np.float64] | None:
    """Return the room under the keel along a track [m]: over the bottom, else by the chart over what dries; or None.

    The scenario began at ``began_s`` of the track's time, at the Unix time ``epoch_s``.
    """
    if mission.boat.draft_m is None:
        return None
    if seabed is not None:
        return under_keel_m(truth, seabed, mission.boat.draft_m, began_s)
    table = tide_of(mission) if mission.drying else None
    if table is None:
        return None
    room_m = mission.options.area.under_keel_m
    return over_drying_m(truth, drying_of(mission, mission.frame()), table, room_m, epoch_s - began_s)


async def _sail_and_restart(
    world: SimulatedWorld,
    scenario: Scenario,
    mission: Mission,
    seed: int,
    folder: Path,
    on_status: OnStatus | None,
    expansions: int | None,
    worker_pace: float | None,
    room: Callable[[Estimator], WindTracker] | None,
    archive: VoyageArchive | None,
) -> None:
    """Run the companion; kill it where the scenario says, and start it again."""
    kills = sorted((e for e in scenario.events if e.kind == "kill_companion"), key=lambda e: e.at_s)
    deadline_s = now_s() + scenario.limit_s
    options = SailOptions(
        seed=seed,
        epoch_s=scenario.epoch_s,
        expansions=expansions if worker_pace is None else None,
        budget_scale=1.0 / (worker_pace or 1.0),
        offload=at_once,
        is_durable=False,
        state_path=folder / STATE,
        disk=world.disk,
        command=f"sitl run {scenario.name}",
        archive=archive,
        exit_on_arrival=scenario.exit_on_arrival,
        dry_run=scenario.dry_run,
        far=None
        if scenario.satellite is None
        else SatelliteLink(folder=folder / FAR, key=KEY, every_s=scenario.satellite.status_every_s),
    )
    if room is not None:
        options = replace(options, room=room)
    options = _with_broken(options, scenario.broken)

    def look(status: CompanionStatus, step: Step) -> None:
        world.status_s.append(step.snapshot.t_s)
        if any(isinstance(action, Announce) and action.code == CALL for action in step.actions):
            world.called.set()
            world.called_at_s.append(step.snapshot.t_s)
        if on_status is not None:
            on_status(status, step)

    while True:
        left_s = deadline_s - now_s()
        if left_s <= 0.0:
            return
        born_s = now_s()
        # the planner's process lives and dies with the companion's
        planner = world.planner = FaultyPlanner() if worker_pace is None else KillablePlanner()
        task = asyncio.create_task(
            _one_life(
                planner,
                sail(
                    mission,
                    world.heard_by(),
                    planner,
                    folder,
                    replace(options, limit_s=left_s),
                    on_status=look,
                    guard=_guard_of(scenario.broken, seed),
                ),
            ),
            name="companion",
        )
        kill = kills.pop(0) if kills else None
        done, _ = await asyncio.wait([task], timeout=None if kill is None else max(0.0, kill.at_s - now_s()))
        if task not in done:
            task.cancel()
        gave_up, ended = False, None
        try:
            ended = world.summary = await task
        except asyncio.CancelledError:
            pass
        except Exception as error:
            if not (scenario.is_service and isinstance(error, LinkError)):
                world.errors.append("".join(traceback.format_exception(error)))
                return
            gave_up = True
        if world.observer is not None:
            world.observer.life(born_s, now_s())
        _collect(world, folder, ended)
        if gave_up:
            if kill is not None:
                kills.insert(0, kill)
            await asyncio.sleep(SERVICE_RESTART_S)
            continue
        if task in done and not task.cancelled():
            return
        if kill is None or kill.restart_after_s is None:
            await asyncio.sleep(max(0.0, deadline_s - now_s()))
            return
        if kill.saved != "kept":
            world.disk.spoil(folder / STATE, kill.saved, kill.aged_s)
        options = replace(options, epoch_s=max(0.0, options.epoch_s + kill.clock_step_s))
        await asyncio.sleep(kill.restart_after_s)


def _with_broken(options: SailOptions, broken: Sequence[Outlet]) -> SailOptions:
    """Return the options with outlets that are wanted and cannot be used: of each of them its start fails."""
    if "page" in broken or "page token" in broken:
        options = replace(options, http=Address(host=NOWHERE if "page" in broken else "127.0.0.1", port=0))
    if "socket" in broken:
        options = replace(options, socket=NO_FOLDER / "socket")
    if "satellite" in broken:
        options = replace(options, far=SatelliteLink(folder=NO_FOLDER / FAR, key=KEY))
    return options


def _guard_of(broken: Sequence[Outlet], seed: int) -> Guard:
    """Return the guard of a life, which knows what the command that begins it could not use."""
    guard = Guard(seed=seed)
    if "page token" in broken:
        guard.lost(Auxiliary.ORDERS_BY_PAGE, "its token file is empty", for_good=True)
    return guard


async def _one_life(planner: FaultyPlanner | KillablePlanner, voyage: Coroutine[Any, Any, dict[str, Any]]) -> Any:
    async with planner:
        return await voyage


def _collect(world: SimulatedWorld, folder: Path, summary: dict[str, Any] | None) -> None:
    """Take what a life that has ended told, by its summary or, where it was killed, by the file that the next rewrites.

    Its alerts are those of the file.
    """
    try:
        filed = json.loads((folder / SUMMARY).read_bytes())
    except (OSError, ValueError):
        filed = {}
    world.lives.append(summary or filed)
    for code, count in filed.get("alerts", {}).items():
        world.alerts[code] = world.alerts.get(code, 0) + count


# Of all lives of a companion, what its last one's summary counts from its own start.
_OF_ALL: dict[str, Callable[[Sequence[Any]], Any]] = {
    "replans": sum,
    "no_go_entries": sum,
    "promised_risk": max,
    "promised_clearance_m": min,
}


def of_all_lives(last: Mapping[str, Any], lives: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return the last life's summary with what a verdict tells of the whole voyage: counts, and the worst promises."""
    told = {key: [life[key] for life in lives if life.get(key) is not None] for key in _OF_ALL}
    return {**last, **{key: _OF_ALL[key](values) for key, values in told.items() if values}}


async def _watch_truth(world: SimulatedWorld, frame: LocalFrame, limit_s: float) -> None:
    # A day is watched once in four seconds: the judge looks between samples too, and its memory is bounded.
    every_s = max(TRUTH_EVERY_S, limit_s / MAX_TRUTH_SAMPLES)
    while True:
        t = world.autopilot.truth
        if world.set_sail_s is None and t.is_armed and t.mode in {Mode.AUTO, Mode.GUIDED}:
            world.set_sail_s = now_s()
        if world.set_sail_s is not None:
            here = frame.en_from_geo(t.position)
            world.truth.add(now_s(), here, t.heading_rad, t.speed_mps, (t.twd_from_rad, t.tws_mps))
            world.others.note(world.truth, here, now_s())
        if world.observer is not None:
            world.observer.truth(now_s(), world.autopilot, world.link)
        is_met = every_s > TRUTH_EVERY_S and world.others.nearest_m(frame.en_from_geo(t.position), now_s()) < NEAR_M
        await asyncio.sleep(TRUTH_EVERY_S if is_met else every_s)
