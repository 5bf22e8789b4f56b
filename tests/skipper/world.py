"""A tiny pure world for the skipper's tests: a boat that sails like ArduRover's, an autopilot that answers.

No protocol and no time but its own; the planner is the real one, on an expansion budget. What the skipper asks for
is carried out after stated delays, so that outcomes arrive in later snapshots as they do in the application.
"""

from __future__ import annotations

import functools
import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace

import numpy as np

from companion.boat import AutopilotLimits, Boat, ardurover_sitl
from companion.geo.angles import difference_rad, wrap_pi
from companion.geo.frame import LocalFrame
from companion.geofence.area import LocalArea
from companion.mavlink.vehicle_identity import Identity
from companion.messages import (
    AutopilotStatus,
    Command,
    GeoPoint,
    MissionItem,
    MissionState,
    Mode,
    VehicleState,
    WindForecast,
)
from companion.orders import Order, Source, phrase
from companion.planner import plan
from companion.skipper.rules import Skipper
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, Permissions, SkipperConfig
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import (
    CommandOutcome,
    CommandResult,
    MissionOnBoard,
    PlanOutcome,
    ReadOutcome,
    Snapshot,
    UploadOutcome,
    UploadResult,
    WindEstimate,
    WindHealth,
)
from companion.skipper.step.state import SkipperState
from companion.skipper.way.geometry import bearing_rad, cross_track_m, distance_m, is_past, moved
from companion.skipper.way.voyage import Goal, Refuge, Voyage

FRAME = LocalFrame(GeoPoint(lat_deg=51.1, lon_deg=-1.3))
HORIZONS = (0.0, 5.0, 10.0, 30.0, 60.0, 120.0, 300.0, 600.0, 1800.0, 3600.0)


@functools.lru_cache(maxsize=1024)
def en_of(lat_e7: int, lon_e7: int) -> tuple[float, float]:
    """Return where an item is [m]: it is asked for six times a step."""
    return FRAME.en_from_geo(GeoPoint(lat_deg=lat_e7 / 1e7, lon_deg=lon_e7 / 1e7))


def area(*polygons, limits=None) -> LocalArea:
    return LocalArea(
        frame=FRAME,
        names=tuple(f"o{i}" for i in range(len(polygons))),
        polygons=tuple(polygons),
        own_margins_m=(0.0,) * len(polygons),
        limits=limits,
    )


def voyage(*goals: Goal, obstacles=(), limits=None, laps=1, refuges=()) -> Voyage:
    boat = Boat(polar=ardurover_sitl(), turn_rate_radps=0.8)
    return Voyage(
        name="test",
        frame=FRAME,
        goals=goals or (Goal(en_m=(0.0, 300.0)),),
        laps=laps,
        area=area(*obstacles, limits=limits),
        boat=boat,
        refuges=tuple(Refuge(name=f"{n + 1}", en_m=p) for n, p in enumerate(refuges)),
    )


def order(words, t_s=0.0, *, by=(255, 190), command=31010) -> Order:
    """Return an order as a station gives it; ``words`` as a person types them."""
    return Order(
        wanted=phrase(words.split()),
        t_s=t_s,
        command=command,
        source=Source(kind="mavlink", system=by[0], component=by[1]),
    )


def forecast(t_s: float, twd_rad: float, tws_mps: float = 5.0, sigma_rad: float = 0.05) -> WindForecast:
    n = len(HORIZONS)
    level = np.array([0.5, 0.8, 0.9, 0.95])
    z = np.array([0.674, 1.282, 1.645, 1.96])
    return WindForecast(
        t_s=t_s,
        horizon_s=np.array(HORIZONS),
        mean_twd_from_rad=np.full(n, twd_rad),
        sigma_twd_rad=np.full(n, sigma_rad),
        mean_tws_mps=np.full(n, tws_mps),
        sigma_tws_mps=np.full(n, 0.5),
        level=level,
        half_width_rad=np.outer(np.full(n, sigma_rad), z),
        correlation_time_s=30.0,
    )


def with_parts(state, **parts):
    """A state with other parts: ``{field: value}`` changes a part, anything else takes its place."""
    return replace(
        state,
        **{name: replace(getattr(state, name), **new) if isinstance(new, dict) else new for name, new in parts.items()},
    )


@dataclass
class World:
    """Boat, wind, autopilot and the application's hands in one; ``run`` folds the skipper over it."""

    skipper: Skipper
    wind: Callable[[float], tuple[float, float]] = lambda t: (0.0, 5.0)
    permissions: Permissions = ALL_PERMITTED
    position: tuple[float, float] = (0.0, 0.0)
    heading: float = 0.0
    speed: float = 0.0
    mode: Mode = Mode.MANUAL
    armed: bool = False
    mission: tuple[MissionItem, ...] = ()
    seq: int = 0
    mission_state: MissionState = MissionState.NO_MISSION
    t: float = 0.0
    boot_s: float = 100.0
    sigma: float = 0.05
    corridor: float = 10.0
    no_go: float = math.radians(45.0)
    circle_m: float | None = None  # the autopilot's own fence around home, kept while ``fence_breached`` is told
    upload_s: float = 1.0
    plan_s: float = 1.0
    expansions: int = 3000
    algorithm: str = "auto"
    wind_health: WindHealth = WindHealth.GOOD
    heartbeat_age: float = 0.2
    position_offset: tuple[float, float] = (0.0, 0.0)
    system_status: int = 4
    ekf_ok: bool = True
    shown: dict = field(default_factory=dict)  # what else the status shows
    identity: Identity = field(
        default_factory=lambda: Identity(
            system=1, uid="5a", is_confirmed=True, vehicle_type=11, frame_class=2, sails=True
        )
    )
    drift_mps: float = 0.0  # along the heading, while nobody sails
    share: float = 1.0  # of her file's speed that she sails at
    current: Callable[[float], tuple[float, float]] = lambda t: (0.0, 0.0)  # of the water, east north
    motor: bool = False  # it runs
    tack_asked: bool = False  # heard on a leg that is beaten
    turning_to: float = 0.0  # the tack that a turn through the wind ends on, 0 when there is none
    uploads_fail: Callable[[int], UploadResult] = lambda n: UploadResult.OK
    planner: Callable | None = None
    state: SkipperState | None = None
    pending: list = field(default_factory=list)
    stopped: list = field(default_factory=list)
    forged_reads: list = field(default_factory=list)  # what the next reads find in place of the mission
    events: list = field(default_factory=list)
    actions: list = field(default_factory=list)
    log: list = field(default_factory=list)
    track: list = field(default_factory=list)
    uploads: int = 0
    restarts: int = 0
    leg_from: tuple[float, float] = (0.0, 0.0)
    last_tack: float = -100.0
    tacks: int = 0
    winds: list = field(default_factory=list)
    extra: dict = field(default_factory=dict)
    steer: float | None = None
    steer_until: float = -1.0

    def __post_init__(self) -> None:
        if self.state is None:
            self.state = self.skipper.initial()

    # ------------------------------------------------------------------------------------- autopilot
    def target(self) -> tuple[float, float] | None:
        if not 1 <= self.seq <= len(self.mission):
            return None
        item = self.mission[self.seq - 1]
        return en_of(item.lat_e7, item.lon_e7)

    def sail(self, dt: float) -> None:
        water = self.current(self.t)
        self.position = (self.position[0] + dt * water[0], self.position[1] + dt * water[1])
        if self.motor:  # it keeps the boat where it is
            self.speed, self.position = 0.0, (self.position[0] - dt * water[0], self.position[1] - dt * water[1])
            return
        twd, tws = self.wind(self.t)
        if self.mode is Mode.GUIDED and self.armed and self.steer is not None and self.t < self.steer_until:
            want = self.steer
        elif self.mode is Mode.AUTO and self.armed and self.mission_state is MissionState.ACTIVE and self.target():
            want = self._auto(twd)
        else:
            self.speed = max(0.7 * self.speed, self.drift_mps)
            self.position = moved(self.position, self.heading, self.speed * dt)
            return
        turn = difference_rad(want, self.heading)
        rate = 1.0 * dt
        self.heading = wrap_pi(self.heading + max(-rate, min(rate, turn)))
        twa = abs(difference_rad(twd, self.heading))
        drive = self.share * self.skipper.voyage.boat.polar.speed_mps(twa, tws)
        self.speed += (drive - self.speed) * min(1.0, dt / 1.5)
        self.position = moved(self.position, self.heading, self.speed * dt)

    def _auto(self, twd: float) -> float:
        target = self.target()
        assert target is not None
        item = self.mission[self.seq - 1]
        if item.command == Command.NAV_LOITER_UNLIM:
            if distance_m(self.position, target) < 8.0:
                return wrap_pi(self.heading + 0.6)
        elif distance_m(self.position, target) < 3.5 or (
            distance_m(self.position, target) < 15.0 and is_past(self.position, self.leg_from, target)
        ):
            if self.seq < len(self.mission):
                self.seq += 1
                self.leg_from = target
                target = self.target()
            else:
                self.mission_state = MissionState.COMPLETE
                return self.heading
        assert target is not None
        bearing = bearing_rad(self.position, target)
        twa = difference_rad(twd, bearing)
        if abs(twa) > self.no_go:
            off = cross_track_m(self.position, self.leg_from, target)
            leg = bearing_rad(self.leg_from, target)
            if abs(difference_rad(bearing, leg)) < 0.7 and abs(difference_rad(twd, leg)) > self.no_go:
                return wrap_pi(leg - max(-0.5, min(0.5, 0.06 * off)))
            return bearing
        tack = 1.0 if difference_rad(twd, self.heading) >= 0.0 else -1.0
        off = cross_track_m(self.position, self.leg_from, target)
        out = self.corridor > 0.0 and abs(off) >= self.corridor and (off > 0.0) == (tack < 0.0)
        asked, self.tack_asked = self.tack_asked, False
        if (out or asked) and self.t - self.last_tack > 5.0:
            self.turning_to, self.last_tack, self.tacks = -tack, self.t, self.tacks + 1
        if self.turning_to == tack:
            self.turning_to = 0.0  # through the wind
        return wrap_pi(twd - (self.turning_to or tack) * self.no_go)

    # ----------------------------------------------------------------------------------- application
    def carry_out(self, action: act.Action) -> None:
        later = self.pending.append
        if isinstance(action, act.RequestPlan):
            later((self.t + self.plan_s, "plan", action))
        elif isinstance(action, act.CancelPlan):
            self.pending = [p for p in self.pending if not (p[1] == "plan" and p[2].request_id == action.request_id)]
        elif isinstance(action, act.UploadMission):
            later((self.t + self.upload_s, "upload", action))
        elif isinstance(action, act.ReadMission):
            later((self.t + 0.5, "read", action))
        elif isinstance(action, (act.SetMode, act.Arm, act.SetCurrent, act.SetParameter, act.RunMotor, act.Tack)):
            later((self.t + 0.1, "command", action))
        elif isinstance(action, act.SteerHeading):
            self.steer, self.steer_until = action.heading_rad, self.t + 3.0
        elif isinstance(action, act.StopOrders):
            self.stopped += [p for p in self.pending if p[1] != "plan"]
            self.pending = [p for p in self.pending if p[1] == "plan"]

    def answer(self) -> list:
        stopped = [
            UploadOutcome(upload_id=a.upload_id, result=UploadResult.TIMEOUT, text="stopped")
            for _, kind, a in self.stopped
            if kind == "upload"
        ]
        self.stopped = []
        due = [p for p in self.pending if p[0] <= self.t]
        self.pending = [p for p in self.pending if p[0] > self.t]
        return stopped + [self._answer(kind, action) for _, kind, action in due]

    def _answer(self, kind: str, action):
        if kind == "plan":
            make = self.planner or (
                lambda p, seed: plan(p, expansions=self.expansions, seed=seed, algorithm=self.algorithm)
            )
            return PlanOutcome(request_id=action.request_id, plan=make(action.problem, action.seed))
        if kind == "upload":
            self.uploads += 1
            result = self.uploads_fail(self.uploads)
            if result is UploadResult.OK:
                assert tuple(action.items[: action.keep_first]) == tuple(self.mission[: action.keep_first])
                self.install(action.items)
                if action.set_current is not None:
                    self.seq, self.mission_state, self.leg_from = action.set_current, MissionState.ACTIVE, self.position
                    if not (self.armed and self.mode is Mode.AUTO):
                        self.mission_state = MissionState.NOT_STARTED
            elif result is UploadResult.TIMEOUT:
                half = len(action.items) // 2
                self.install((*action.items[:half], *self.mission[half : len(action.items)]))
            return UploadOutcome(upload_id=action.upload_id, result=result)
        if kind == "read":
            items = self.forged_reads.pop(0) if self.forged_reads else self.mission
            return ReadOutcome(read_id=action.read_id, items=items)
        if isinstance(action, act.SetMode):
            if action.mode is Mode.AUTO and not self.mission:
                return CommandOutcome(command_id=action.command_id, result=CommandResult.REFUSED, text="No Mission")
            self.set_mode(action.mode)
        elif isinstance(action, act.Arm):
            self.armed = True
            self.set_mode(self.mode)
        elif isinstance(action, act.Tack):
            self.tack_asked = True
        elif isinstance(action, act.RunMotor):
            self.motor = action.is_on
        elif isinstance(action, act.SetCurrent):
            if action.seq > len(self.mission):
                return CommandOutcome(command_id=action.command_id, result=CommandResult.REFUSED, text="DENIED")
            self.seq, self.mission_state, self.leg_from = action.seq, MissionState.ACTIVE, self.position
        return CommandOutcome(command_id=action.command_id, result=CommandResult.ACCEPTED)

    def install(self, items) -> None:
        self.mission = tuple(items)
        self.leg_from = self.position
        if self.seq == 0:
            self.seq = 1
        if self.mission_state is MissionState.NO_MISSION:
            self.mission_state = MissionState.NOT_STARTED

    def set_mode(self, mode: Mode) -> None:
        self.mode = mode
        if mode is Mode.AUTO and self.armed and self.mission_state is not MissionState.COMPLETE:
            self.mission_state = MissionState.ACTIVE
            self.leg_from = self.position

    # ------------------------------------------------------------------------------------------ fold
    def snapshot(self) -> Snapshot:
        twd, tws = self.wind(self.t)
        recent = self.winds = [*(w for w in self.winds if w[0] > self.t - 90.0), (self.t, twd, tws)]
        mean = math.atan2(sum(math.sin(w[1]) for w in recent), sum(math.cos(w[1]) for w in recent))
        mean_tws = sum(w[2] for w in recent) / len(recent)
        short = [w for w in recent if w[0] > self.t - 5.0]
        present = math.atan2(sum(math.sin(w[1]) for w in short), sum(math.cos(w[1]) for w in short))
        here = (self.position[0] + self.position_offset[0], self.position[1] + self.position_offset[1])
        water = (0.0, 0.0) if self.motor else self.current(self.t)
        velocity = (self.speed * math.sin(self.heading) + water[0], self.speed * math.cos(self.heading) + water[1])
        vehicle = VehicleState(
            t_s=self.t,
            boot_s=self.boot_s + self.t,
            position=FRAME.geo_from_en(*here),
            velocity_en_mps=velocity,
            heading_rad=self.heading,
        )
        status = AutopilotStatus(
            t_s=self.t,
            boot_s=self.boot_s + self.t,
            mode=self.mode,
            is_armed=self.armed,
            ekf_ok=self.ekf_ok,
            system_status=self.system_status,
            mission_seq=self.seq,
            mission_total=len(self.mission),
            mission_state=self.mission_state,
            **self.shown,
        )
        out = Snapshot(
            identity=self.identity,
            t_s=self.t,
            vehicle=vehicle,
            vehicle_age_s=0.1,
            position_en_m=here,
            autopilot=status,
            autopilot_age_s=0.2,
            heartbeat_age_s=self.heartbeat_age,
            permissions=self.permissions,
            wind=WindEstimate(
                health=self.wind_health,
                forecast=forecast(self.t, mean, mean_tws, self.sigma),
                mean_twd_from_rad=mean,
                mean_tws_mps=mean_tws,
                sigma_twd_rad=self.sigma,
                present_twd_from_rad=present,
                present_tws_mps=tws,
                record_s=100.0 + self.t,
            ),
            limits=AutopilotLimits(
                sail_no_go_angle_rad=self.no_go, sail_xtrack_max_m=self.corridor, fence_circle_m=self.circle_m
            ),
            mission=MissionOnBoard(),
            events=tuple(self.events),
            outcomes=tuple(self.answer()),
        )
        self.events = []
        return replace(out, **self.extra)

    def order(self, words: str, by: tuple[int, int] = (255, 190)) -> None:
        self.events.append(order(words, self.t, by=by))

    def step(self) -> None:
        snapshot = self.snapshot()
        assert self.state is not None
        before = self.state
        self.state, actions = self.skipper.step(self.state, snapshot)
        check_invariants(before, self.state, snapshot, actions)
        for action in actions:
            self.actions.append((self.t, action))
            self.carry_out(action)
        if self.state.phase is not before.phase or self.state.why != before.why:
            self.log.append((self.t, self.state.phase.value, self.state.why))
        self.log.extend((self.t, a.code, a.text) for a in actions if isinstance(a, act.Announce))
        for _ in range(5):
            self.sail(0.2)
            self.track.append(self.position)
        self.t += 1.0

    def run(self, seconds: float, until: Callable[[World], bool] | None = None) -> bool:
        end = self.t + seconds
        while self.t < end:
            self.step()
            if until is not None and until(self):
                return True
        return until is None

    def count(self, kind) -> int:
        return sum(isinstance(a, kind) for _, a in self.actions)

    def clearance(self) -> float:
        return self.skipper.voyage.area.path_clearance_m(self.track)


def check_invariants(before, after, snapshot, actions) -> None:
    """What must hold in every step of every test."""
    from companion.skipper.step.context import permitted
    from companion.skipper.step.missions import ends_safely
    from companion.skipper.step.state import Phase

    for action in actions:
        assert permitted(action, snapshot.permissions), action
        if isinstance(action, (act.UploadMission, act.SetMode, act.Arm, act.SetCurrent, act.SteerHeading)):
            assert after.vehicle.is_ours, action
        if isinstance(action, act.UploadMission):
            assert ends_safely(action.items)
            if before.mission.route is not None and after.pending.upload is not None:
                assert action.items[: action.keep_first] == before.mission.route.items[: action.keep_first]
        if after.phase is Phase.OPERATOR:
            assert isinstance(
                action, (act.Announce, act.Acknowledge, act.CancelPlan, act.ReadMission, act.StopOrders)
            ), action
    assert after.why
    if after.phase in {Phase.WAITING, Phase.HOLDING}:
        assert "wait" in after.why, f"{after.phase.value}, and not said for what: {after.why}"
    ids = [
        getattr(a, n)
        for a in actions
        for n in ("request_id", "upload_id", "read_id", "command_id")
        if hasattr(a, n) and not isinstance(a, act.CancelPlan)
    ]
    assert len(ids) == len(set(ids))


def skipper(made: Voyage, **config) -> Skipper:
    return Skipper(voyage=made, config=SkipperConfig(**config))


def restarted(world: World) -> World:
    """Kill the skipper and start it again from what was saved."""
    assert world.state is not None
    saved = Persisted.from_dict(world.skipper.persisted(world.state).to_dict())
    world.state = world.skipper.initial(saved)
    world.pending = []
    return world
