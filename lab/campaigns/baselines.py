"""What the companion is worth: the same water and weather sailed by ArduRover alone.

Beside the companion: ``fixed``: its first plan, after whose upload it dies. ``alone``: ArduRover with nothing but
a waypoint at each goal, in AUTO. ``dijkstra``: the same with ArduRover's own path planning round the obstacles as
exclusion fences, set at boot as well as we know how. ``greedy``: the heading that makes most way to the next goal now,
in GUIDED (``lab.greedy``). The companion sails on the embedded autopilot and the real ArduRover, and so does ``alone``;
``dijkstra`` on the real one alone, for the embedded one has no path planning, and the fixed plan and the greedy sailor
on the embedded one. On the real one a disarmed boat drifts while the companion watches the wind, so the others begin
where the companion set sail, if it has sailed that seed into the same file.

Everybody is timed alike, on the true track: from sailing in AUTO to being within the radius of the last goal, all
goals reached in order; a contact is an entry into an obstacle or over the limits.
"""

from __future__ import annotations

import asyncio
import math
import statistics
import tempfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import msgspec
from msgspec import structs

from companion.clock import now_s, run, run_virtual
from companion.compose import boat_of
from companion.errors import JobError, LinkError
from companion.geofence import Mission, load_mission
from companion.geofence.autopilot_fence import FenceStatus, fence_for_autopilot
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.microservices import TransferOutcome
from companion.mavlink.reception import LinkIdentity
from companion.mavlink.transports import open_link
from companion.messages import Command, GeoPoint, MissionItem, Mode, waypoint
from companion.wind import make
from lab.campaigns.ablation import interval
from lab.greedy import best_heading
from sitl.ardurover import ArduRover, require
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.autopilot import Truth as Now
from sitl.results import markdown
from sitl.run.embedded import TRUTH_EVERY_S, run_embedded, solid_of
from sitl.run.live import run_live
from sitl.run.variation import Variation
from sitl.runner import (
    SCENARIO_FOLDER,
    CampaignResults,
    Experiment,
    ExperimentSummary,
    Job,
    Key,
    file_hash,
    read_results,
)
from sitl.scenario import (
    EventSpec,
    Scenario,
    ScenarioVerdict,
    TrueTrack,
    count_tacks,
    load_scenario,
    own_polar,
    scenario_wind,
)
from sitl.world import WindModel

# Measured to be its best (ArduPilot 4.7): margins that a tacking boat needs, the fence itself without action.
DIJKSTRA = {
    "OA_TYPE": 2.0,
    "OA_MARGIN_MAX": 15.0,
    "AVOID_ENABLE": 0.0,
    "FENCE_MARGIN": 2.0,
    "FENCE_TYPE": 4.0,
    "FENCE_ACTION": 0.0,
    "FENCE_ENABLE": 1.0,
    "SAIL_XTRACK_MAX": 8.0,
}
# Its fence holds 84 points: the obstacles' outlines are made simpler by at most the first of these that fits [m].
FENCE_PLAYS_M = (4.0, 6.0, 8.0)
# A companion with a fixed plan dies so long after the start: it is on board, and no leg of it is sailed [s].
DIES_S = 45.0
# The companion has watched the wind for about this long when it sets sail: everybody meets the same weather [s].
WEATHER_FROM_S = 35.0
GREEDY_EVERY_S = 1.0


class HeldWind:
    """No wind until ``release``; from then on the weather. The real simulator's boat drifts as soon as there is any."""

    def __init__(self, wind: WindModel) -> None:
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
class BaselineTrack:
    """The true track of a voyage, and when it reached its goals."""

    mission: Mission
    truth: TrueTrack = field(default_factory=TrueTrack)
    goals_s: list[float] = field(default_factory=list)

    def add(self, t_s: float, now: Now) -> None:
        """Take one look; before the boat sails in AUTO nothing is noted, nor after the last goal."""
        if self.is_done or (not self.truth.t_s and not (now.is_armed and now.mode in {Mode.AUTO, Mode.GUIDED})):
            return
        en = self.mission.frame().en_from_geo(now.position)
        self._note(t_s, en, now.heading_rad, now.speed_mps, (now.twd_from_rad, now.tws_mps))

    def follow(self, noted: TrueTrack) -> None:
        """Take the track that somebody else noted, up to the last goal."""
        for n, t_s in enumerate(noted.t_s):
            if self.is_done:
                return
            wind = (noted.twd_from_rad[n], noted.tws_mps[n])
            self._note(t_s, noted.en_m[n], noted.heading_rad[n], noted.speed_mps[n], wind)

    def _note(
        self, t_s: float, en: tuple[float, float], heading_rad: float, speed_mps: float, wind: tuple[float, float]
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
        hulls, solid = (
            self.truth.hull(boat_of(self.mission).hull),
            solid_of(self.mission.area.local(self.mission.frame())),
        )
        contacts, clearance_m = len(hulls.entries(solid)), hulls.least_m(solid)[0]
        tacks, gybes = count_tacks(self.truth)
        return {
            "who": who,
            "scenario": scenario,
            "seed": seed,
            "arrived": self.is_done,
            "contacts": contacts,
            "time_s": self.time_s,
            "tacks": tacks,
            "gybes": gybes,
            "clearance_m": clearance_m if math.isfinite(clearance_m) else None,
        }

    # as an observer of run_embedded
    def observe(self) -> _Observer:
        """Return an observer that fills this track."""
        return _Observer(self)


@dataclass(frozen=True, slots=True)
class _Observer:
    track: BaselineTrack

    def truth(self, t_s: float, autopilot: SimulatedAutopilot, link: MemoryLink) -> None:  # noqa: ARG002 - the interface has it
        self.track.add(t_s, autopilot.truth)

    def life(self, start_s: float, end_s: float) -> None:
        pass


@dataclass(frozen=True, slots=True, kw_only=True)
class BaselineVoyage:
    """A voyage: the true track, and what is told of it."""

    track: BaselineTrack
    record: dict[str, Any]


# ------------------------------------------------------------------------------------------- voyages
def sail_companion(scenario: Scenario, path: Path, seed: int, *, shifts: bool | None, told: str) -> BaselineVoyage:
    """Sail with the companion on the embedded autopilot; ``shifts``: by them or not, None: as the mission says."""
    variation = None if shifts is None else Variation(tables={"skipper": {"shifts": shifts}})
    track = BaselineTrack(load_mission(scenario.mission_path(path)))
    with tempfile.TemporaryDirectory(prefix="figures-") as folder:
        verdict = run_virtual(
            run_embedded(scenario, path, seed, Path(folder) / "voyage", observer=track.observe(), variation=variation)
        )
    return BaselineVoyage(track=track, record={**track.record(told, scenario.name, seed), **_promises(verdict)})


def sail_fixed(scenario: Scenario, path: Path, seed: int) -> BaselineVoyage:
    """Sail the companion's first plan on the embedded autopilot: nobody plans again."""
    dies = EventSpec(at_s=DIES_S, kind="kill_companion")
    track = BaselineTrack(load_mission(scenario.mission_path(path)))
    with tempfile.TemporaryDirectory(prefix="figures-") as folder:
        run_virtual(
            run_embedded(
                msgspec.structs.replace(scenario, events=(*scenario.events, dies)),
                path,
                seed,
                Path(folder) / "voyage",
                observer=track.observe(),
            )
        )
    return BaselineVoyage(track=track, record=track.record("fixed plan", scenario.name, seed))


def sail_companion_ardurover(scenario: Scenario, path: Path, seed: int, speedup: float) -> BaselineVoyage:
    """Sail with the companion, as a process of its own, on the real ArduRover."""
    track, noted = BaselineTrack(load_mission(scenario.mission_path(path))), TrueTrack()
    with tempfile.TemporaryDirectory(prefix="figures-") as folder:
        verdict = run_live(
            scenario,
            path,
            seed,
            Path(folder) / "voyage",
            autopilot="ardurover",
            program=None,
            speedup=speedup,
            truth=noted,
        )
    track.follow(noted)
    if not noted.t_s:
        raise JobError("it never sailed in AUTO")
    point = track.mission.frame().geo_from_en(*noted.en_m[0])
    start = [point.lat_deg, point.lon_deg, math.degrees(noted.heading_rad[0])]
    told = track.record("companion, ArduRover", scenario.name, seed)
    return BaselineVoyage(track=track, record={**told, **_promises(verdict), "start": start})


def _promises(verdict: ScenarioVerdict) -> dict[str, Any]:
    return {key: verdict.figures.get(key) for key in ("promised_risk", "no_go_entries", "replans")}


def sail_alone(scenario: Scenario, path: Path, seed: int, who: str = "alone") -> BaselineVoyage:
    """Sail with one waypoint per goal on the embedded autopilot, or ``greedy`` to each of them."""
    track = BaselineTrack(load_mission(scenario.mission_path(path)))

    async def voyage() -> None:
        mission, wind = track.mission, HeldWind(scenario_wind(scenario, path, seed))
        autopilot = SimulatedAutopilot(
            AutopilotConfig(
                home=mission.start or mission.origin,
                heading_rad=_heading_rad(mission),
                is_warm=True,
                is_moored=True,
                parameters=scenario.parameters,
                polar=own_polar(mission),
            ),
            wind,
            seed=seed,
        )
        wires = MemoryLink("shore", seed=seed)
        async with (
            serve(autopilot, [wires.far]),
            Link(wires.near, identity=LinkIdentity(system=255, component=190), streams=()) as link,
            Autopilot(link) as pilot,
        ):
            wind.release()
            if who == "greedy":
                await _sail_greedily(pilot, track, lambda: autopilot.truth, scenario.limit_s)
            else:
                await _sail(pilot, track, lambda: autopilot.truth, scenario.limit_s)

    run_virtual(voyage())
    return BaselineVoyage(track=track, record=track.record(f"{who}, embedded", scenario.name, seed))


def sail_ardurover(
    scenario: Scenario,
    path: Path,
    seed: int,
    who: str,
    speedup: float,
    set_sail: tuple[float, float, float] | None = None,
) -> BaselineVoyage:
    """Sail with the real ArduRover, "alone" or with its own "dijkstra".

    ``set_sail`` is where, in place of the mission's start: latitude, longitude, heading [deg].
    """
    mission = load_mission(scenario.mission_path(path))
    track = BaselineTrack(mission)
    has_obstacles = bool(mission.area.solids or mission.area.fence.inclusions)
    parameters = {**scenario.parameters, **(DIJKSTRA if who == "dijkstra" and has_obstacles else {})}

    async def voyage() -> None:
        start, heading_rad = mission.start or mission.origin, _heading_rad(mission)
        if set_sail is not None:
            start = GeoPoint(lat_deg=set_sail[0], lon_deg=set_sail[1])
            heading_rad = math.radians(set_sail[2])
        wind = HeldWind(scenario_wind(scenario, path, seed))
        async with (
            ArduRover(require(), start, wind, heading_rad=heading_rad, speedup=speedup, parameters=parameters) as rover,
            Link(open_link(rover.link), identity=LinkIdentity(system=255, component=190), streams=()) as link,
            Autopilot(link, timeout_s=30.0 * speedup) as pilot,
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
    return BaselineVoyage(track=track, record=track.record(f"{who}, ArduRover", scenario.name, seed))


def _heading_rad(mission: Mission) -> float:
    return math.radians(mission.options.start.heading_deg) if mission.options.start else 0.0


async def _sail(pilot: Autopilot, track: BaselineTrack, now: Callable[[], Now | None], limit_s: float) -> None:
    """Upload a waypoint per goal, arm, set AUTO, and watch until the last goal or the limit.

    The last waypoint is there twice: the mission then ends beyond the goal's radius for nobody.
    """
    points: list[MissionItem] = [waypoint(g.point) for g in track.mission.goals]
    done = await pilot.upload_mission(
        [*points, waypoint(track.mission.goals[-1].point, command=Command.NAV_LOITER_UNLIM)]
    )
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


async def _sail_greedily(pilot: Autopilot, track: BaselineTrack, now: Callable[[], Now], limit_s: float) -> None:
    """Arm, set GUIDED, and steer the best heading of each second, by the mean wind of 5 s, until the last goal."""
    mission, polar, mean = track.mission, boat_of(track.mission).polar, make("mean5")
    for _ in range(30):
        await pilot.arm()
        await pilot.set_mode(Mode.GUIDED)
        if now().is_armed and now().mode is Mode.GUIDED:
            break
        await asyncio.sleep(1.0)
    until_s = now_s() + limit_s
    while now_s() < until_s:
        look = now()
        track.add(look.t_s, look)
        if track.is_done:
            break
        mean.update(look.t_s, look.twd_from_rad, look.tws_mps)
        twd_from_rad, _, tws_mps, _ = mean.forecast(0.0)
        here = mission.frame().en_from_geo(look.position)
        goal = mission.frame().en_from_geo(mission.goals[len(track.goals_s)].point)
        heading_rad = best_heading(
            polar,
            twd_from_rad=twd_from_rad,
            tws_mps=tws_mps,
            way_en_m=(goal[0] - here[0], goal[1] - here[1]),
            heading_rad=look.heading_rad,
        )
        pilot.steer_heading(heading_rad)
        await asyncio.sleep(GREEDY_EVERY_S)
    if not track.truth.t_s:
        raise JobError("it never sailed in GUIDED")


HEADS = (
    "scenario",
    "sailor",
    "pairs",
    "median s",
    "against s",
    "median %",
    "mean % (95 %)",
    "worst pair %",
    "tacks",
    "of the possible %",
)


def pairs(records: Sequence[dict[str, Any]], against: str) -> str:
    """Return a Markdown table: a row for each scenario and sailor but ``against``, as it is told in records.

    Pairs of clean arrivals count; how many seeds both sailed is said where it is more. "median %" is of the medians,
    the mean geometric over pairs with the bootstrap's interval. "of the possible" is the sum of what was gained over
    that of what a clairvoyant gains in the same winds, where he is known.
    """
    rows = []
    base = {(r["scenario"], r["seed"]): r for r in records if r["who"] == against}
    for scenario in dict.fromkeys(scenario for scenario, _ in base):
        for who in dict.fromkeys(r["who"] for r in records if r["scenario"] == scenario and r["who"] != against):
            both = [
                (r, base[key])
                for r in records
                if (key := (scenario, r["seed"])) in base and (r["scenario"], r["who"]) == (scenario, who)
            ]
            rows.append((scenario, who, *_cells(both)))
    return markdown(HEADS, rows)


def _cells(both: Sequence[tuple[dict[str, Any], dict[str, Any]]]) -> list[str]:
    clean = [(a, b) for a, b in both if all(r["arrived"] and not r["contacts"] for r in (a, b))]
    count = str(len(clean)) if len(clean) == len(both) else f"{len(clean)} of {len(both)}"
    if not clean:
        return [count, *("-" for _ in HEADS[3:])]
    shares = [a["time_s"] / b["time_s"] for a, b in clean]
    mine, other = (statistics.median(r["time_s"] for r in rows) for rows in zip(*clean, strict=True))
    middle, low, high = (100.0 * (share - 1.0) for share in interval(shares))
    known = [(a["time_s"], b["time_s"], b["best_s"]) for a, b in clean if "best_s" in b]
    possible_s = sum(other_s - best_s for _, other_s, best_s in known)
    gained_s = sum(other_s - mine_s for mine_s, other_s, _ in known)
    return [
        count,
        f"{mine:.0f}",
        f"{other:.0f}",
        f"{100.0 * (mine / other - 1.0):+.1f}",
        f"{middle:+.1f} ({low:+.1f} to {high:+.1f})",
        f"{100.0 * (max(shares) - 1.0):+.1f}",
        f"{statistics.median(a['tacks'] for a, _ in clean):g}",
        f"{100.0 * gained_s / possible_s:.0f}" if possible_s > 0.0 else "-",
    ]


SCENARIOS = tuple(
    SCENARIO_FOLDER / f"{name}.toml"
    for name in ("figures/block", "two-channels", "demo", "lee-shore", "figures/slalom", "upwind")
)
# The sailors, and as they are told in tables, in their order there.
NAMES = {
    "companion": "companion",
    "shifts": "companion, by shifts",
    "no-shifts": "companion, no shifts",
    "fixed": "fixed plan",
    "companion-ardurover": "companion, ArduRover",
    "greedy": "greedy, embedded",
    "alone-embedded": "alone, embedded",
    "alone": "alone, ArduRover",
    "dijkstra": "dijkstra, ArduRover",
}
TOLD = tuple(NAMES.values())
# Sailors with the companion on the embedded autopilot: by the shifts, or not; None: as the mission says.
SHIFTS: dict[str, bool | None] = {"companion": None, "shifts": True, "no-shifts": False}
# Who never tacks on them, by the parameters for that.
WITHOUT = frozenset({"no-shifts", "alone-embedded", "alone", "dijkstra"})
# A wind: its spread [deg] and correlation time [s].
WindOf = tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class Sailor:
    """Who sails a voyage, at which pace of the real ArduRover, and from where; ``wind`` in place of the scenario's."""

    who: str
    speedup: float
    set_sail: tuple[float, float, float] | None = None
    wind: WindOf | None = None


def scenario_of(job: Job[Sailor]) -> Scenario:
    """Return what a job sails: by this sailor's parameters; in another wind it has another name."""
    scenario = load_scenario(job.scenario)
    if job.case.who in WITHOUT:
        scenario = structs.replace(scenario, parameters={**scenario.parameters, **scenario.without_shifts})
    if job.case.wind is None:
        return scenario
    spread_deg, tau_s = job.case.wind
    told = f"{spread_deg:g}°, {tau_s:g} s" if spread_deg > 0.0 else "steady"
    model: Literal["ou", "constant"] = "ou" if spread_deg > 0.0 else "constant"
    wind = structs.replace(scenario.wind, model=model, sd_deg=spread_deg, tau_s=tau_s)
    return structs.replace(scenario, name=f"{scenario.name}, {told}", wind=wind)


def sail(job: Job[Sailor]) -> dict[str, Any]:
    """Sail a job; return what is told of it."""
    return voyage_of(job).record


def voyage_of(job: Job[Sailor]) -> BaselineVoyage:
    """Sail a job; JobError or LinkError where the harness fails, and then there is no result."""
    what, sailor = (scenario_of(job), job.scenario, job.seed), job.case
    if sailor.who in SHIFTS:
        return sail_companion(*what, shifts=SHIFTS[sailor.who], told=NAMES[sailor.who])
    if sailor.who == "companion-ardurover":
        return sail_companion_ardurover(*what, sailor.speedup)
    if sailor.who == "fixed":
        return sail_fixed(*what)
    if sailor.who in {"alone-embedded", "greedy"}:
        return sail_alone(*what, who=sailor.who.removesuffix("-embedded"))
    return sail_ardurover(*what, sailor.who, sailor.speedup, sailor.set_sail)


def key_of(job: Job[Sailor]) -> Key:
    """Return what a voyage is known by: of those on the real ArduRover the pace and where they set sail, too."""
    sailor = job.case
    key: Key = {"who": sailor.who, "scenario": scenario_of(job).name, "hash": file_hash(job.scenario), "seed": job.seed}
    if sailor.who in {"companion-ardurover", "alone", "dijkstra"}:
        key = {**key, "speedup": sailor.speedup}
    if sailor.set_sail is not None and sailor.who in {"alone", "dijkstra"}:
        key = {**key, "from": "{:.6f},{:.6f},{:.1f}".format(*sailor.set_sail)}
    return key


def baselines(jobs: Sequence[Job[Sailor]], *, results: Path | None, against: str | None = None) -> Experiment[Sailor]:
    """Return the voyages, begun where the companion set sail in ``results``; a table of all that the file holds."""
    began: dict[tuple[str, int], tuple[float, float, float]] = {}
    if results is not None and results.is_file() and results.stat().st_size:
        began = {
            (key["scenario"], key["seed"]): tuple(result["start"])
            for key, result in read_results(results).pairs()
            if "start" in result
        }

    def sum_up(sailed: CampaignResults) -> ExperimentSummary:
        records = latest([result for _, result in sailed.held.pairs()])
        return ExperimentSummary(lines=[table(records), *([] if against is None else [pairs(records, NAMES[against])])])

    return Experiment(
        name="baselines",
        sail=sail,
        key=key_of,
        sum_up=sum_up,
        jobs=[
            replace(job, case=replace(job.case, set_sail=began.get((scenario_of(job).name, job.seed)))) for job in jobs
        ],
    )


def jobs_of(
    who: Sequence[str], scenarios: Sequence[Path], seeds: int, speedup: float, winds: Sequence[WindOf] | None
) -> list[Job[Sailor]]:
    """Return the voyages of a campaign; ``winds`` None: those of the scenarios."""
    return [
        Job(scenario=p, seed=s, case=Sailor(who=w, speedup=speedup, wind=wind))
        for s in range(seeds)
        for w in who
        for p in scenarios
        for wind in winds or (None,)
    ]


def latest(records: Sequence[dict[str, Any]]) -> list[dict[str, Any]]:
    """Return one record of every sailor, scenario and seed: of those that set sail here and there, the last."""
    return list({(r["who"], r["scenario"], r["seed"]): r for r in records}.values())


def table(records: Sequence[dict[str, Any]]) -> str:
    """Return the figures as a Markdown table: a row for each scenario and sailor, losses included.

    Times are of voyages that arrived without contact; "forced" is how many of the companion's voyages met a wind shift
    into the no-go zone on a leg, to be held against the risk that the plan promised.
    """
    heads = (
        "scenario",
        "sailor",
        "runs",
        "arrived",
        "touched",
        "clean",
        "median s",
        "90 %",
        "tacks",
        "least m",
        "risk",
        "forced",
    )
    lines = []
    names = list(dict.fromkeys(load_scenario(p).name for p in SCENARIOS))
    for name in [*names, *sorted({r["scenario"] for r in records} - set(names))]:
        for who in TOLD:
            rows = [r for r in records if r["scenario"] == name and r["who"] == who]
            if rows:
                lines.append(_row(name, who, rows))
    return markdown(heads, lines)


def _row(name: str, who: str, rows: Sequence[dict[str, Any]]) -> list[str]:
    clean = sorted(r["time_s"] for r in rows if r["arrived"] and not r["contacts"])
    clearances = [r["clearance_m"] for r in rows if r["clearance_m"] is not None]
    risks = [r["promised_risk"] for r in rows if r.get("promised_risk") is not None]
    entered = [r["no_go_entries"] for r in rows if r.get("no_go_entries") is not None]
    return [
        name,
        who,
        str(len(rows)),
        str(sum(r["arrived"] for r in rows)),
        str(sum(r["contacts"] > 0 for r in rows)),
        str(len(clean)),
        f"{statistics.median(clean):.0f}" if clean else "-",
        f"{clean[math.ceil(0.9 * len(clean)) - 1]:.0f}" if clean else "-",
        f"{statistics.median(r['tacks'] for r in rows):g}",
        f"{min(clearances):.1f}" if clearances else "-",
        f"{statistics.median(risks):.2f}" if risks else "-",
        f"{sum(n > 0 for n in entered)} of {len(entered)}" if entered else "-",
    ]
