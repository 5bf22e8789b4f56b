"""What the companion is worth: the same water and weather sailed by ArduRover alone.

Beside the companion: ``fixed``: her first plan, which she uploads and then dies. ``alone``: ArduRover with nothing but
a waypoint at each goal, in AUTO. ``dijkstra``: the same with ArduRover's own path planning round the obstacles as
exclusion fences, set at boot as well as we know how. The companion sails on the embedded autopilot and the real
ArduRover, and so does ``alone``; ``dijkstra`` on the real one alone, for the embedded one has no path planning, and the
fixed plan on the embedded one. On the real one a disarmed boat drifts while the companion watches the wind, so the
others begin where the companion set sail, if it has sailed that seed into the same file.

Everybody is timed alike, on the true track: from sailing in AUTO to being within the radius of the last goal, all
goals reached in order; a contact is an entry into an obstacle or over the limits.
"""

from __future__ import annotations

import asyncio
import math
import tempfile
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import msgspec

from companion.clock import now_s, run, run_virtual
from companion.compose import boat_of
from companion.errors import JobError, LinkError
from companion.geofence import Mission, load_mission
from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot
from companion.mavlink.autopilot import Autopilot as Pilot
from companion.mavlink.link import Link
from companion.mavlink.microservices import TransferOutcome
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.transports import open_link
from companion.messages import Command, GeoPoint, MissionItem, Mode, waypoint
from sitl.ardurover import ArduRover, require
from sitl.autopilot import Autopilot, AutopilotConfig, MemoryLink, serve
from sitl.autopilot import Truth as Now
from sitl.run.embedded import TRUTH_EVERY_S, run_embedded, solid_of
from sitl.run.live import run_live
from sitl.run.variation import Variation
from sitl.scene import EventSpec, Scenario, Truth, Verdict, count_tacks, own_polar, scenario_wind
from sitl.world import Wind

# Measured to be its best (ArduPilot 4.7): margins that a tacking boat needs, the fence itself without action.
DIJKSTRA = {
    "OA_TYPE": 2.0, "OA_MARGIN_MAX": 15.0, "AVOID_ENABLE": 0.0, "FENCE_MARGIN": 2.0, "FENCE_TYPE": 4.0,
    "FENCE_ACTION": 0.0, "FENCE_ENABLE": 1.0, "SAIL_XTRACK_MAX": 8.0,
}
# Its fence holds 84 points: the obstacles' outlines are made simpler by at most the first of these that fits [m].
FENCE_PLAYS_M = (4.0, 6.0, 8.0)
# A companion with a fixed plan dies so long after the start: it is on board, and no leg of it is sailed [s].
DIES_S = 45.0
# The companion has watched the wind for about this long when it sets sail: everybody meets the same weather [s].
WEATHER_FROM_S = 35.0


class Held:
    """No wind until ``release``; from then on the weather. The real simulator's boat drifts as soon as there is any."""

    def __init__(self, wind: Wind) -> None:
        self._wind = wind
        self._last_s = 0.0
        self._from_s: float | None = None

    def release(self) -> None:
        """Let it blow."""
        self._from_s = self._last_s

    def at(self, t_s: float) -> tuple[float, float]:
        """Return the wind."""
        self._last_s = max(self._last_s, t_s)
        if self._from_s is None:
            return self._wind.at(WEATHER_FROM_S)[0], 0.0
        return self._wind.at(WEATHER_FROM_S + max(0.0, t_s - self._from_s))


@dataclass(slots=True)
class Track:
    """The true track of a voyage, and when it reached its goals."""

    mission: Mission
    truth: Truth = field(default_factory=Truth)
    goals_s: list[float] = field(default_factory=list)

    def add(self, t_s: float, now: Now) -> None:
        """Take one look; before the boat sails in AUTO nothing is noted, nor after the last goal."""
        if self.is_done or (not self.truth.t_s and not (now.is_armed and now.mode in {Mode.AUTO, Mode.GUIDED})):
            return
        en = self.mission.frame().en_from_geo(now.position)
        self._note(t_s, en, now.heading_rad, now.speed_mps, (now.twd_from_rad, now.tws_mps))

    def follow(self, noted: Truth) -> None:
        """Take the track that somebody else noted, up to the last goal."""
        for n, t_s in enumerate(noted.t_s):
            if self.is_done:
                return
            wind = (noted.twd_from_rad[n], noted.tws_mps[n])
            self._note(t_s, noted.en_m[n], noted.heading_rad[n], noted.speed_mps[n], wind)

    def _note(
        self, t_s: float, en: tuple[float, float], heading_rad: float, speed_mps: float, wind: tuple[float, float],
    ) -> None:
        self.truth.add(t_s, en, heading_rad, speed_mps, wind)
        goal = self.mission.goals[len(self.goals_s)]
        radius_m = goal.radius_m if goal.radius_m is not None else 10.0
        if math.dist(en, self.mission.frame().en_from_geo(goal.point)) <= radius_m:
            self.goals_s.append(t_s)

    @property
    def is_done(self) -> bool:
        """Whether all goals were reached."""
        return len(self.goals_s) == len(self.mission.goals)

    @property
    def time_s(self) -> float | None:
        """From sailing in AUTO to the last goal [s]; None where it was not reached."""
        return self.goals_s[-1] - self.truth.t_s[0] if self.is_done else None

    def record(self, who: str, scenario: str, seed: int) -> dict[str, Any]:
        """Return how it went."""
        hulls, solid = self.truth.hull(boat_of(self.mission).hull), solid_of(
            self.mission.area.local(self.mission.frame()))
        contacts, clearance_m = len(hulls.entries(solid)), hulls.least_m(solid)[0]
        tacks, gybes = count_tacks(self.truth)
        return {
            "who": who, "scenario": scenario, "seed": seed, "arrived": self.is_done, "contacts": contacts,
            "time_s": self.time_s, "tacks": tacks, "gybes": gybes,
            "clearance_m": clearance_m if math.isfinite(clearance_m) else None,
        }

    # as an observer of run_embedded
    def observe(self) -> _Observer:
        """Return an observer that fills this track."""
        return _Observer(self)


@dataclass(frozen=True, slots=True)
class _Observer:
    track: Track

    def truth(self, t_s: float, autopilot: Autopilot, link: MemoryLink) -> None:  # noqa: ARG002 - the interface has it
        self.track.add(t_s, autopilot.truth)

    def life(self, start_s: float, end_s: float) -> None:
        pass


@dataclass(frozen=True, slots=True, kw_only=True)
class Voyage:
    """A voyage: the true track, and what is told of it."""

    track: Track
    record: dict[str, Any]


# ------------------------------------------------------------------------------------------- voyages
def sail_companion(scenario: Scenario, path: Path, seed: int, *, shifts: bool | None, told: str) -> Voyage:
    """Sail with the companion on the embedded autopilot; ``shifts``: by them or not, None: as the mission says."""
    variation = None if shifts is None else Variation(tables={"skipper": {"shifts": shifts}})
    track = Track(load_mission(scenario.mission_path(path)))
    with tempfile.TemporaryDirectory(prefix="figures-") as folder:
        verdict = run_virtual(run_embedded(
            scenario, path, seed, Path(folder) / "voyage", observer=track.observe(), variation=variation))
    return Voyage(track=track, record={**track.record(told, scenario.name, seed), **_promises(verdict)})


def sail_fixed(scenario: Scenario, path: Path, seed: int) -> Voyage:
    """Sail the companion's first plan on the embedded autopilot: nobody plans again."""
    dies = EventSpec(at_s=DIES_S, kind="kill_companion")
    track = Track(load_mission(scenario.mission_path(path)))
    with tempfile.TemporaryDirectory(prefix="figures-") as folder:
        run_virtual(run_embedded(
            msgspec.structs.replace(scenario, events=(*scenario.events, dies)), path, seed, Path(folder) / "voyage",
            observer=track.observe()))
    return Voyage(track=track, record=track.record("fixed plan", scenario.name, seed))


def sail_companion_ardurover(scenario: Scenario, path: Path, seed: int, speedup: float) -> Voyage:
    """Sail with the companion, as a process of its own, on the real ArduRover."""
    track, noted = Track(load_mission(scenario.mission_path(path))), Truth()
    with tempfile.TemporaryDirectory(prefix="figures-") as folder:
        verdict = run_live(
            scenario, path, seed, Path(folder) / "voyage", autopilot="ardurover", program=None, speedup=speedup,
            truth=noted)
    track.follow(noted)
    if not noted.t_s:
        raise JobError("it never sailed in AUTO")
    point = track.mission.frame().geo_from_en(*noted.en_m[0])
    start = [point.lat_deg, point.lon_deg, math.degrees(noted.heading_rad[0])]
    told = track.record("companion, ArduRover", scenario.name, seed)
    return Voyage(track=track, record={**told, **_promises(verdict), "start": start})


def _promises(verdict: Verdict) -> dict[str, Any]:
    return {key: verdict.figures.get(key) for key in ("promised_risk", "no_go_entries", "replans")}


def sail_alone(scenario: Scenario, path: Path, seed: int) -> Voyage:
    """Sail with one waypoint per goal on the embedded autopilot."""
    track = Track(load_mission(scenario.mission_path(path)))

    async def voyage() -> None:
        mission, wind = track.mission, Held(scenario_wind(scenario, path, seed))
        autopilot = Autopilot(
            AutopilotConfig(home=mission.start or mission.origin, heading_rad=_heading_rad(mission), is_warm=True,
                            is_moored=True, parameters=scenario.parameters, polar=own_polar(mission)), wind, seed=seed)
        wires = MemoryLink("shore", seed=seed)
        async with (
            serve(autopilot, [wires.far]),
            Link(wires.near, identity=LinkIdentity(system=255, component=190), streams=()) as link,
            Pilot(link) as pilot,
        ):
            wind.release()
            await _sail(pilot, track, lambda: autopilot.truth, scenario.limit_s)

    run_virtual(voyage())
    return Voyage(track=track, record=track.record("alone, embedded", scenario.name, seed))


def sail_ardurover(
    scenario: Scenario, path: Path, seed: int, who: str, speedup: float,
    set_sail: tuple[float, float, float] | None = None,
) -> Voyage:
    """Sail with the real ArduRover, "alone" or with its own "dijkstra".

    ``set_sail`` is where, in place of the mission's start: latitude, longitude, heading [deg].
    """
    mission = load_mission(scenario.mission_path(path))
    track = Track(mission)
    has_obstacles = bool(mission.area.solids or mission.area.fence.inclusions)
    parameters = {**scenario.parameters, **(DIJKSTRA if who == "dijkstra" and has_obstacles else {})}

    async def voyage() -> None:
        start, heading_rad = mission.start or mission.origin, _heading_rad(mission)
        if set_sail is not None:
            start = GeoPoint(lat_deg=set_sail[0], lon_deg=set_sail[1])
            heading_rad = math.radians(set_sail[2])
        wind = Held(scenario_wind(scenario, path, seed))
        async with (
            ArduRover(require(), start, wind, heading_rad=heading_rad, speedup=speedup,
                      parameters=parameters) as rover,
            Link(open_link(rover.link), identity=LinkIdentity(system=255, component=190), streams=()) as link,
            Pilot(link, timeout_s=30.0 * speedup) as pilot,
        ):
            if who == "dijkstra" and has_obstacles:
                places = [start, *(g.point for g in mission.goals)]
                for play_m in FENCE_PLAYS_M:
                    fence = fence_for_autopilot(mission.area, play_m, inside=places)
                    if fence.status is FenceStatus.OK:
                        break
                if fence.status is not FenceStatus.OK:
                    raise JobError(f"{scenario.name} does not fit in ArduRover's fence: {fence.reason}")
                done = await pilot.upload_fence(fence.items)
                if done.outcome is not TransferOutcome.OK:
                    raise JobError(f"the fence was not taken: {done.text}")

            def now() -> Now | None:
                try:
                    return rover.truth
                except LinkError:
                    return None

            wind.release()
            await _sail(pilot, track, now, scenario.limit_s)

    run(voyage(), speedup=speedup)
    return Voyage(track=track, record=track.record(f"{who}, ArduRover", scenario.name, seed))


def _heading_rad(mission: Mission) -> float:
    return math.radians(mission.options.start.heading_deg) if mission.options.start else 0.0


async def _sail(pilot: Pilot, track: Track, now: Callable[[], Now | None], limit_s: float) -> None:
    """Upload a waypoint per goal, arm, set AUTO, and watch until the last goal or the limit.

    The last waypoint is there twice: the mission then ends beyond the goal's radius for nobody.
    """
    points: list[MissionItem] = [waypoint(g.point) for g in track.mission.goals]
    done = await pilot.upload_mission([*points, waypoint(track.mission.goals[-1].point,
                                                         command=Command.NAV_LOITER_UNLIM)])
    if done.outcome is not TransferOutcome.OK:
        raise JobError(f"the mission was not taken: {done.text}")
    for _ in range(30):
        await pilot.arm()
        await pilot.set_mode(Mode.AUTO)
        look = now()
        if look is not None and look.is_armed and look.mode is Mode.AUTO:
            break
        await asyncio.sleep(1.0)
    until_s = now_s() + limit_s
    while now_s() < until_s and not track.is_done:
        look = now()
        if look is not None:
            track.add(look.t_s, look)
        await asyncio.sleep(TRUTH_EVERY_S)
    if not track.truth.t_s:
        raise JobError("it never sailed in AUTO")
