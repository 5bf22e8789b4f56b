"""A boat between rocks as a Gymnasium environment: the simulated boat of ``sitl``, under virtual time.

``gymnasium.make("sailbench/Rocks-v0", action="heading")``. A step is a second of the boat's loop at 50 Hz.
The weather is that of the scenario for the seed of ``reset``, from where the companion sets sail in it: who sails here
and who sails by ``sitl`` meet the same wind.

Observation, float32, in metres and metres a second, east and north of the start, directions as sine and cosine:

    0, 1      to the next goal, east and north
    2, 3      position, east and north
    4, 5      heading
    6         speed through the water
    7, 8      where the true wind comes from, as the vane tells it
    9         true wind speed, as the vane tells it
    10        goals that are left
    11 to 26  how far the water is free on 16 bearings, from north by 22.5 degrees clockwise, 100 m at most

Action: ``heading``: a compass heading to steer, one float in -1..1, in half turns clockwise from north. ``tack``: 0
holds the tack that she is on, 1 goes about; on either she sails the heading that makes most way towards the goal.

Reward: minus the seconds that a step took. Touching a rock or the limits ends it, with what is left of the time limit
taken off as well: no collision is faster than an arrival. The time limit truncates.
"""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any, Literal

import gymnasium
import numpy as np
import shapely
from gymnasium import spaces
from numpy.typing import NDArray

from companion.compose import boat_of
from companion.errors import InputError
from companion.geo.angles import wrap_pi
from companion.geo.frame import LocalFrame
from companion.geofence import Mission, load_mission
from companion.planner import Problem
from lab.campaigns.baselines import WEATHER_FROM_S
from lab.greedy import best_heading
from sitl.autopilot import Parameters, Vehicle
from sitl.run.embedded import solid_of
from sitl.runner import SCENARIO_FOLDER
from sitl.scenario import HullTrack, load_scenario, own_polar, scenario_wind
from sitl.world import Later

ActionKind = Literal["heading", "tack"]
STEP_S, LOOPS = 1.0, 50
RAYS, RAY_M = 16, 100.0
GOAL_M = 10.0  # a goal without a radius of its own
FAR_M = 1e6
PAD_DEG = 5.0  # off her closest course, which the wind's shifts take from her
WINDS = frozenset({"wind_shift", "wind_speed"})  # the events that a boat alone can have
_BEARINGS = np.arange(RAYS) * (2.0 * math.pi / RAYS)
_TIPS = RAY_M * np.column_stack([np.sin(_BEARINGS), np.cos(_BEARINGS)])

Observation = NDArray[np.float32]
Action = NDArray[np.float32] | np.int64 | int


class SailingEnv(gymnasium.Env[Observation, Action]):
    """One scenario of ``sitl`` without its companion: a boat, a wind, rocks, and goals in their order.

    Args:
        scenario: a name of ours (``sitl run --help``) or a scenario's file. It may have wind that changes, and nothing
            else that befalls a boat: no vessels, currents or faults.
        action: ``heading`` or ``tack``.

    Raises:
        InputError: there is no such scenario, or it has more than wind and rocks.

    """

    def __init__(self, scenario: str = "faults/rocks", action: ActionKind = "heading") -> None:
        path = Path(scenario) if scenario.endswith(".toml") else SCENARIO_FOLDER / f"{scenario}.toml"
        self.source, self.scenario = path, load_scenario(path)
        others = {event.kind for event in self.scenario.events} - WINDS
        more = [n for n in ("current", "waves", "boat", "sensors", "bottom") if getattr(self.scenario, n) is not None]
        if others or more or self.scenario.wind.lees:
            found = ", ".join(sorted({*others, *more})) or "lees"
            raise InputError(str(path), "", f"has {found}, and here is wind alone", "take another scenario")
        if action not in {"heading", "tack"}:
            raise InputError("action", str(action), "is no kind of action", "heading or tack")
        self.mission: Mission = load_mission(self.scenario.mission_path(path))
        start = self.mission.start or self.mission.origin
        self.frame = LocalFrame(start)
        self.goals = [(self.frame.en_from_geo(g.point), g.radius_m or GOAL_M) for g in self.mission.goals]
        self.solid = solid_of(self.mission.area.local(self.frame))
        self.boat = boat_of(self.mission)
        self.limit_s, self.action = self.scenario.limit_s, action
        self.action_space = spaces.Box(-1.0, 1.0, (1,), np.float32) if action == "heading" else spaces.Discrete(2)
        high = np.array([FAR_M] * 4 + [1.0] * 2 + [50.0] + [1.0] * 2 + [100.0, len(self.goals)] + [RAY_M] * RAYS)
        low = np.concatenate([-high[:9], np.zeros(2 + RAYS)])
        self.observation_space = spaces.Box(low.astype(np.float32), high.astype(np.float32), dtype=np.float32)
        shapely.prepare(self.solid)
        self._vehicle: Vehicle | None = None
        self._left, self.t_s = len(self.goals), 0.0

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Observation, dict[str, Any]]:
        """Put her at the start, at rest; the weather is that of ``seed``, or drawn."""
        super().reset(seed=seed, options=options)
        weather = int(self.np_random.integers(1 << 31)) if seed is None else seed
        start = self.mission.options.start
        self._vehicle = Vehicle(
            Later(scenario_wind(self.scenario, self.source, weather), WEATHER_FROM_S),
            Parameters(self.scenario.parameters),
            heading_rad=math.radians(start.heading_deg if start else 0.0),
            is_moored=False,
            seed=weather,
            polar=own_polar(self.mission),
        )
        self._vehicle.settle()
        self._vehicle.set_armed(armed=True)
        self._left, self.t_s = len(self.goals), 0.0
        return self._seen(self._vehicle), self._told(weather=weather)

    def step(self, action: Action) -> tuple[Observation, float, bool, bool, dict[str, Any]]:
        """Sail for a second."""
        vehicle = self._vehicle
        if vehicle is None:
            raise gymnasium.error.ResetNeeded("call reset before step")
        before = vehicle.true_position, vehicle.heading
        vehicle.steer_heading(self.heading_of(action), 1.0)
        done = 0
        while done < LOOPS:  # it stops where something happened that a mission would want to know
            done += max(1, vehicle.advance(LOOPS - done)[0])
        self.t_s += STEP_S
        places = np.array([before[0], vehicle.true_position])
        hull = HullTrack(en_m=places, heading_rad=np.array([before[1], vehicle.heading]), hull=self.boat.hull)
        touched = bool(hull.entries(self.solid))
        goal, radius_m = self.goals[-self._left]
        if not touched and math.dist(vehicle.true_position, goal) <= radius_m:
            self._left -= 1
        arrived, over = self._left == 0, self.t_s >= self.limit_s
        reward = -STEP_S - (self.limit_s - self.t_s if touched else 0.0)
        told = self._told(touched=touched, arrived=arrived)
        return self._seen(vehicle), reward, touched or arrived, over and not (touched or arrived), told

    def heading_of(self, action: Action) -> float:
        """Return the heading that an action steers [rad]."""
        if self.action == "heading":
            return math.pi * float(np.asarray(action).reshape(-1)[0])
        vehicle = self._vehicle
        assert vehicle is not None
        twd_from_rad, tws_mps = vehicle.true_wind
        side_rad = wrap_pi(vehicle.heading - twd_from_rad)
        if int(action) == 1:
            side_rad = -side_rad
        return best_heading(
            self.boat.polar,
            twd_from_rad=twd_from_rad,
            tws_mps=tws_mps,
            way_en_m=self._way(vehicle),
            heading_rad=twd_from_rad + side_rad,
            beating_m=math.inf,  # whether to go about is the action
        )

    def problem(self, margin_m: float = 0.0) -> Problem:
        """Return the planning problem from where she is to her next goal, in the wind of the vane as if it stayed.

        The rocks are made larger by ``margin_m``, the limits narrower.
        """
        vehicle = self._vehicle
        if vehicle is None:
            raise gymnasium.error.ResetNeeded("call reset before problem")
        twd_from_rad, tws_mps = vehicle.true_wind
        at, (goal, radius_m) = vehicle.true_position, self.goals[-self._left]
        area = self.mission.area.local(self.frame)
        polar = self.boat.polar
        return Problem.from_json(
            {
                "id": self.scenario.name,
                "title": self.scenario.title,
                "start": {"x": at[0], "y": at[1], "heading_deg": math.degrees(vehicle.heading)},
                "goal": {"x": goal[0], "y": goal[1], "radius": radius_m},
                "obstacles": [shapely.to_wkt(polygon.buffer(margin_m)) for polygon in area.polygons],
                "fence": None if area.limits is None else shapely.to_wkt(area.limits.buffer(-margin_m)),
                "wind": {"from_deg": math.degrees(twd_from_rad), "speed_mps": tws_mps, "sigma": {"model": "none"}},
                "boat": {
                    "no_go_half_deg": math.degrees(self.boat.no_go_half_rad) + PAD_DEG,
                    "max_twa_deg": 180.0,
                    "turn_rate_rad_s": self.boat.turn_rate_radps,
                    "speed": {
                        "model": "polar",
                        "twa_deg": list(range(0, 181, 5)),
                        "v_mps": polar.speeds_mps(np.radians(np.arange(0.0, 181.0, 5.0)), tws_mps).tolist(),
                    },
                },
                "delta_s": 0.5,
            }
        )

    def _way(self, vehicle: Vehicle) -> tuple[float, float]:
        east, north = vehicle.true_position
        (goal_e, goal_n), _ = self.goals[min(len(self.goals) - self._left, len(self.goals) - 1)]
        return goal_e - east, goal_n - north

    def _seen(self, vehicle: Vehicle) -> Observation:
        at, heading = vehicle.true_position, vehicle.heading
        twd_from_rad, tws_mps = vehicle.true_wind
        values = [
            *self._way(vehicle),
            *at,
            math.sin(heading),
            math.cos(heading),
            vehicle.speed_mps,
            math.sin(twd_from_rad),
            math.cos(twd_from_rad),
            tws_mps,
            self._left,
            *self._free_m(at),
        ]
        seen = np.array(values, dtype=np.float32)
        return np.clip(seen, self.observation_space.low, self.observation_space.high)  # type: ignore[attr-defined]

    def _free_m(self, at: tuple[float, float]) -> NDArray[np.float64]:
        here = np.array(at)
        if self.solid.is_empty:
            return np.full(RAYS, RAY_M)
        rays = shapely.linestrings(np.stack([np.broadcast_to(here, _TIPS.shape), here + _TIPS], axis=1))
        reach = shapely.distance(shapely.Point(at), shapely.intersection(rays, self.solid))
        return np.where(np.isnan(reach), RAY_M, reach)

    def _told(self, **more: Any) -> dict[str, Any]:
        return {"t_s": self.t_s, **more}


ENVIRONMENTS = {
    "sailbench/Rocks-v0": "faults/rocks",
    "sailbench/Slalom-v0": "figures/slalom",
    "sailbench/Beat-v0": "figures/beat-500",
    "sailbench/TwoChannels-v0": "two-channels",
    "sailbench/Lake-v0": str(Path(__file__).parent / "winds" / "lake.toml"),  # one weather, whatever the seed
}


def register() -> None:
    """Make the environments known to Gymnasium; once."""
    for name, scenario in ENVIRONMENTS.items():
        if name not in gymnasium.registry:
            gymnasium.register(name, entry_point="sailbench.environment:SailingEnv", kwargs={"scenario": scenario})
