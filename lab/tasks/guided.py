"""WRSC 2013 and station keeping over MAVLink: field guidance steers an ArduRover sailboat in GUIDED.

The same skippers as in the fast loop, but heading setpoints go out as SET_ATTITUDE_TARGET once a second through the
companion's own link, and position, heading and wind come in by it. The boat is the simulated autopilot in virtual
time, or the real ArduRover's simulator::

    python -m lab.tasks.guided --seeds 10                          # WRSC 2013, simulated autopilot
    python -m lab.tasks.guided --seeds 10 --autopilot ardurover    # the real one, in a hurry
    python -m lab.tasks.guided --task station --seeds 5            # station keeping
"""

from __future__ import annotations

import argparse
import asyncio
import json
import math
import sys
from collections.abc import Callable
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from companion import clock
from companion.boat import ardurover_sitl
from companion.clock import now_s
from companion.errors import LinkError
from companion.field.station import Station, StationState, keep
from companion.field.values import RESEND_S, GuidanceSettings, Situation
from companion.geo.frame import LocalFrame
from companion.mavlink.autopilot import Autopilot
from companion.mavlink.link import Link
from companion.mavlink.transports import open_link
from companion.messages import Command, MissionItem, Mode, VehicleState, WindSample, waypoint
from lab.tasks.wrsc2013 import LEAVE_WITHIN_S, ORIGIN, Wrsc2013Score, broadcast, draw, score
from lab.tasks.wrsc2013_skippers import HALF_M, FieldSkipper
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, Truth, serve
from sitl.scenario import station_score
from sitl.world import AR1

Decide = Callable[[Situation], tuple[float, float]]
# The intruder of a run over MAVLink comes early: nobody learns more from 40 minutes of waiting.
ENTRY_LIMIT_S = 300.0
AUTO_HALF_M, AUTO_LOOPS = 5.0, 100  # a station's plan: to and fro across the wind


def ardurover_habits(tws_mps: float, **changes: float | bool) -> GuidanceSettings:
    """Return what ArduRover's simulated sailboat can do: a measured polar, tacks of 2 s, no irons."""
    twa, speed = ardurover_sitl().curve(max(1.0, tws_mps))
    base: dict[str, float | bool] = {
        "turn_rate_radps": math.radians(40.0),
        "tack_s": 1.5,
        "tack_min_mps": 0.3,
        "lag_s": 2.5,
        "no_go_half_rad": math.radians(45.0),
    }
    base.update(changes)
    return GuidanceSettings(polar_twa_rad=tuple(map(float, twa)), polar_mps=tuple(map(float, speed)), **base)  # type: ignore[arg-type]


class Steering:
    """Heading setpoints to one autopilot in GUIDED, each from what was last heard of boat and wind."""

    def __init__(self, facade: Autopilot, frame: LocalFrame, *, needs_wind: bool = True) -> None:
        self._facade, self._frame, self._needs_wind = facade, frame, needs_wind
        self._vehicle: VehicleState | None = None
        self._wind: WindSample | None = None
        self._stop = facade.on_value(self._take)
        self.sent = 0

    def _take(self, value: object) -> None:
        if isinstance(value, VehicleState):
            self._vehicle = value
        elif isinstance(value, WindSample):
            self._wind = value

    def seen(self, t_s: float) -> Situation | None:
        """Return the situation, or None before both (a motorboat: before it) were heard."""
        if self._vehicle is None or (self._wind is None and self._needs_wind):
            return None
        wind = self._wind
        return Situation(
            t_s=t_s,
            en_m=self._frame.en_from_geo(self._vehicle.position),
            velocity_en_mps=self._vehicle.velocity_en_mps,
            heading_rad=self._vehicle.heading_rad,
            twd_from_rad=None if wind is None else wind.twd_from_rad,
            tws_mps=0.0 if wind is None else wind.tws_mps,
        )

    async def take_over(self) -> None:
        """Arm and switch to GUIDED.

        Raises:
            LinkError: the autopilot refuses; the text has its words.

        """
        for attempt in range(4):
            # A simulator in a hurry on a busy machine may show its new mode later than the facade waits for it.
            armed, guided = await self._facade.arm(), await self._facade.set_mode(Mode.GUIDED)
            status = self._facade.status
            if (armed.is_ok and guided.is_ok) or (status and status.is_armed and status.mode is Mode.GUIDED):
                return
            if attempt == 3:
                raise LinkError(f"the autopilot refuses GUIDED: {armed.text} {guided.text}")

    async def run(self, decide: Decide, is_over: Callable[[], bool], zero_s: float) -> None:
        """Decide and send once a second until it is over; then hand back (the caller's mode)."""
        next_s = now_s()
        while not is_over():
            seen = self.seen(now_s() - zero_s)
            if seen is not None:
                heading, thrust = decide(seen)
                self._facade.steer_heading(heading, thrust=thrust)
                self.sent += 1
            next_s = max(next_s + RESEND_S, now_s())
            await asyncio.sleep(next_s - now_s())
        self._stop()


async def sail_guided(
    facade: Autopilot,
    truth: Callable[[], Truth],
    frame: LocalFrame,
    decide: Decide,
    until: Callable[[float], bool],
    limit_s: float,
    *,
    needs_wind: bool = True,
) -> list[tuple[float, float, float, float, float]]:
    """Steer by ``decide`` while the truth is sampled each half second; return its rows."""
    rows: list[tuple[float, float, float, float, float]] = []
    steering = Steering(facade, frame, needs_wind=needs_wind)
    await steering.take_over()
    zero = now_s()

    async def watch() -> None:
        while now_s() - zero < limit_s and not until(now_s() - zero):
            now = truth()
            rows.append((now_s() - zero, now.east_m, now.north_m, now.heading_rad, now.speed_mps))
            await asyncio.sleep(0.5)

    watching = asyncio.create_task(watch(), name="truth")
    await steering.run(decide, watching.done, zero)
    await watching
    await facade.set_mode(Mode.LOITER)
    return rows


def with_boat(
    wind: AR1,
    seed: int,
    heading_rad: float,
    job: Callable[[Autopilot, Callable[[], Truth]], Any],
    autopilot: str,
    speedup: float,
    model: str = "sailboat",
) -> Any:
    """Run ``job`` with a boat: the simulated autopilot in virtual time, or the real ArduRover in a hurry."""

    async def simulated() -> Any:
        config = AutopilotConfig(home=ORIGIN, heading_rad=heading_rad, is_warm=True, is_moored=True)
        memory = MemoryLink(seed=seed)
        async with (
            serve(SimulatedAutopilot(config, wind, seed), [memory.far]) as server,
            Link(memory.near) as link,
            Autopilot(link) as facade,
        ):
            await asyncio.sleep(3.0)
            return await job(facade, lambda: server.truth)

    async def real() -> Any:
        from sitl.ardurover import ArduRover, require

        async with (
            ArduRover(require(), ORIGIN, wind, heading_rad=heading_rad, speedup=speedup, model=model) as boat,
            Link(open_link(boat.link)) as link,
            Autopilot(link) as facade,
        ):
            await asyncio.sleep(15.0)
            return await job(facade, lambda: boat.truth)

    if autopilot == "embedded":
        return clock.run_virtual(simulated())
    return clock.run(real(), speedup=speedup)


async def _sail_mission(
    facade: Autopilot,
    truth: Callable[[], Truth],
    items: list[MissionItem],
    until: Callable[[float], bool],
    limit_s: float,
) -> list[tuple[float, float, float, float, float]]:
    """Sail a mission in AUTO while the truth is sampled each half second; return its rows."""
    rows: list[tuple[float, float, float, float, float]] = []
    uploaded = await facade.upload_mission(items)
    armed, auto = await facade.arm(), await facade.set_mode(Mode.AUTO)
    if not (armed.is_ok and auto.is_ok):
        raise LinkError(f"the autopilot refuses: {uploaded.text} {armed.text} {auto.text}")
    zero = now_s()
    while now_s() - zero < limit_s and not until(now_s() - zero):
        now = truth()
        rows.append((now_s() - zero, now.east_m, now.north_m, now.heading_rad, now.speed_mps))
        await asyncio.sleep(0.5)
    return rows


def _weather(twd_from_rad: float, tws_mps: float, seed: int) -> AR1:
    return AR1(twd_from_rad, tws_mps, seed=seed, sd_rad=math.radians(9.0), tws_sd_mps=0.1 * tws_mps)


def run_wrsc(seed: int, autopilot: str = "embedded", speedup: float = 8.0) -> Wrsc2013Score:
    """Sail WRSC 2013 over MAVLink and score it."""
    course = draw(seed)
    course = replace(course, entry_s=60.0 + course.entry_s * (ENTRY_LIMIT_S - 60.0) / 2700.0)
    rng = np.random.default_rng((2013, seed, 9))
    frame = LocalFrame(ORIGIN)
    skipper = FieldSkipper(ardurover_habits, frame, look_ahead=True)
    wind = _weather(course.twd_from_rad, course.tws_mps, seed)

    def decide(seen: Situation) -> tuple[float, float]:
        return skipper.decide(seen, broadcast(course, seen.t_s, rng, frame))

    async def job(facade: Autopilot, truth: Callable[[], Truth]) -> Any:
        # The real boat drifts while it boots: it sails to the middle first, before the clock of the task starts.
        start = truth()
        if math.hypot(start.east_m, start.north_m) > 30.0:
            await sail_guided(
                facade,
                truth,
                frame,
                lambda s: skipper.by_field(s, ()),
                lambda _: math.hypot(truth().east_m, truth().north_m) < 25.0,
                240.0,
            )

        def over(t_s: float) -> bool:
            now = truth()
            ix, iy = course.at(t_s)
            out = max(abs(now.east_m), abs(now.north_m)) > HALF_M + 15.0
            return t_s > course.entry_s and out and math.hypot(now.east_m - ix, now.north_m - iy) > 60.0

        return await sail_guided(facade, truth, frame, decide, over, course.entry_s + LEAVE_WITHIN_S)

    rows = np.asarray(with_boat(wind, seed, course.twd_from_rad + math.pi / 2.0, job, autopilot, speedup))
    return score(rows, np.column_stack(course.at(rows[:, 0])), seed=seed)


STATION_RADIUS_M = 20.0


def run_station(
    seed: int, autopilot: str = "embedded", speedup: float = 8.0, method: str = "field"
) -> dict[str, float]:
    """Keep station over MAVLink for five minutes after the first point inside, and score it.

    ``method``: field (headings in GUIDED), plan (a loop of two waypoints in AUTO) or loiter (the mission's last item).
    """
    rng = np.random.default_rng((2018, seed))
    twd, tws = float(rng.uniform(0.0, 2.0 * math.pi)), float(rng.uniform(3.0, 8.0))
    frame = LocalFrame(ORIGIN)
    wind = _weather(twd, tws, seed)
    off = float(rng.uniform(0.0, 2.0 * math.pi))
    point = (45.0 * math.sin(off), 45.0 * math.cos(off))
    station, state = Station(at_en=point, tacks=True), StationState()

    def decide(seen: Situation) -> tuple[float, float]:
        nonlocal state
        state, setpoint = keep(state, seen, station, ardurover_habits(seen.tws_mps))
        return setpoint.heading_rad, setpoint.thrust

    async def job(facade: Autopilot, truth: Callable[[], Truth]) -> Any:
        inside: list[float] = []

        def over(t_s: float) -> bool:
            now = truth()
            if not inside and math.dist((now.east_m, now.north_m), point) < STATION_RADIUS_M:
                inside.append(t_s)
            return bool(inside) and t_s > inside[0] + 301.0

        if method == "field":
            return await sail_guided(facade, truth, frame, decide, over, 900.0)
        items = [waypoint(frame.geo_from_en(*point))]
        if method == "plan":
            e, n = AUTO_HALF_M * math.cos(twd), -AUTO_HALF_M * math.sin(twd)
            pair = [waypoint(frame.geo_from_en(point[0] + s * e, point[1] + s * n)) for s in (1.0, -1.0)]
            items += pair * AUTO_LOOPS
        items.append(waypoint(frame.geo_from_en(*point), command=Command.NAV_LOITER_UNLIM))
        return await _sail_mission(facade, truth, items, over, 900.0)

    rows = np.asarray(with_boat(wind, seed, twd + math.pi / 2.0, job, autopilot, speedup))
    result = station_score(rows, point, radius_m=STATION_RADIUS_M, length_m=1.0)
    return {"seed": seed, "tws_mps": round(tws, 1), **asdict(result)}


def main(argv: list[str] | None = None) -> int:
    """Run the seeds and print one line each."""
    parser = argparse.ArgumentParser(
        prog="python -m lab.tasks.guided",
        description="Field guidance over MAVLink.",
        epilog="example: python -m lab.tasks.guided --seeds 10 --autopilot ardurover",
    )
    parser.add_argument("--task", choices=["wrsc", "station"], default="wrsc")
    parser.add_argument("--method", choices=["field", "plan", "loiter"], default="field", help="of station keeping")
    parser.add_argument("--seeds", type=int, default=5)
    parser.add_argument("--autopilot", choices=["embedded", "ardurover"], default="embedded")
    parser.add_argument("--speedup", type=float, default=8.0, help="of the real ArduRover (default 8)")
    args = parser.parse_args(argv)
    passed = 0
    for seed in range(args.seeds):
        if args.task == "wrsc":
            result = run_wrsc(seed, args.autopilot, args.speedup)
            passed += result.complete
            row: dict[str, Any] = {**asdict(result), "complete": result.complete}
        else:
            row = run_station(seed, args.autopilot, args.speedup, method=args.method)
            passed += bool(row["kept"])
        sys.stdout.write(json.dumps({k: round(v, 2) if isinstance(v, float) else v for k, v in row.items()}) + "\n")
        sys.stdout.flush()
    sys.stdout.write(f"{args.task} on {args.autopilot}: {passed}/{args.seeds}\n")
    return 0 if passed == args.seeds else 1


if __name__ == "__main__":
    sys.exit(main())
