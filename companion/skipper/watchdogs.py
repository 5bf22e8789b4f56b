"""The watchdogs: what can go wrong under way, as one table of data, and the conditions behind it.

Each row has an entry (a condition that holds for ``enter_s``), an exit (its opposite, with a hysteresis, for
``exit_s``) and a response. ``python -m companion.skipper.document`` prints docs/watchdogs.md from the table.
"""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from companion.geo.angles import difference_rad
from companion.messages import Mode
from companion.skipper.actions import Severity
from companion.skipper.adrift import LIGHT_MPS, meets_in_s, sails
from companion.skipper.by_field import meets_in
from companion.skipper.geometry import along_m, cross_track_m, distance_m
from companion.skipper.snapshot import WindHealth
from companion.skipper.state import Raised
from companion.skipper.turn import JUMP_M, Turn


class Response(enum.Enum):
    """What a raised watchdog makes the skipper do, besides saying so."""

    SAY = "say so"
    FREEZE = "no actions until it clears; what is on the autopilot sails on"
    NO_BOAT_PLANS = "no plan from the boat's position until it clears, unless the way from there is shut"
    NO_WIND_PLANS = "no new plan because of the wind; the plan in place stays"
    WAIT_FOR_WIND = "no plans, no complaint about progress; LOITER where she drifts; plan again when the wind is back"
    STOP_DRIFT = "say where to and when, each minute; motor if there is one, LOITER if she can stem it, else the anchor"
    BEAR_AWAY = "bear away under GUIDED until the boat sails, back to AUTO, plan again; after two, gybe round"
    REPLAN = "plan again from the boat"
    RESTART = "read the mission, take it over if it is ours, and start again as far as permitted"
    COMPARE = "read the mission; ours: go on; not ours: stop acting and report"
    ADVANCE = "make the next item current"
    BY_FIELD = "steer by field under GUIDED, plan again from there, back to AUTO when the way is clear"
    REFUGE = "say so; plan to the nearest refuge if the mission names one"


@dataclass(frozen=True, slots=True, kw_only=True)
class Watchdog:
    """One row: its thresholds are ``enter`` and ``exit`` in ``unit``, held for ``enter_s`` and ``exit_s``."""

    name: str
    watches: str
    enter: float
    exit: float
    unit: str
    enter_s: float
    exit_s: float
    severity: Severity
    response: Response
    why: str
    at_rest: bool = False      # watched before the voyage sails, too


W = Watchdog
S = Severity

TABLE: tuple[Watchdog, ...] = (
    W(name="link silent", watches="time since the autopilot's last heartbeat", enter=3.0, exit=1.5, unit="s",
      enter_s=0.0, exit_s=2.0, severity=S.ERROR, response=Response.FREEZE, at_rest=True,
      why="nothing can be asked of an autopilot that is not heard; it sails its mission to the safe end alone"),
    W(name="position lost", watches="time since the last position", enter=5.0, exit=2.0, unit="s", enter_s=0.0,
      exit_s=2.0, severity=S.ERROR, response=Response.NO_BOAT_PLANS, at_rest=True, why="a plan needs a start"),
    W(name="position jump", watches="distance between fixes beyond what the boat can sail", enter=JUMP_M, exit=10.0,
      unit="m", enter_s=0.0, exit_s=20.0, severity=S.WARNING, response=Response.NO_BOAT_PLANS, at_rest=True,
      why="a GPS jump may put the start into an obstacle; the plan on the autopilot does not depend on us"),
    W(name="wind untrusted", watches="the wind room's verdict (frozen, mirrored, spiking, silent vane)", enter=1.0,
      exit=0.5, unit="", enter_s=5.0, exit_s=30.0, severity=S.WARNING, response=Response.NO_WIND_PLANS, at_rest=True,
      why="a plan made for a wind that is not there is worse than an old one"),
    W(name="becalmed", watches="mean true wind speed, of a boat that does not sail", enter=LIGHT_MPS, exit=1.2,
      unit="m/s", enter_s=60.0, exit_s=30.0, severity=S.NOTICE, response=Response.WAIT_FOR_WIND,
      why="without wind there is no progress to complain of and no direction to plan for"),
    W(name="drifting", watches="time until a boat that does not sail drifts within the margin's floor of something",
      enter=300.0, exit=360.0, unit="s", enter_s=20.0, exit_s=30.0, severity=S.CRITICAL, response=Response.STOP_DRIFT,
      why="a current takes her there without wind, and an anchor takes time to be let go"),
    W(name="in irons", watches="speed ahead while pointing within 35° of the wind", enter=0.3, exit=0.8, unit="m/s",
      enter_s=8.0, exit_s=3.0, severity=S.WARNING, response=Response.BEAR_AWAY,
      why="ArduRover has no recovery of its own; a tack takes 2 to 7 s"),
    W(name="vessel too near", watches="time until our way is within half the distance to keep of a vessel that moves",
      enter=30.0, exit=60.0, unit="s", enter_s=2.0, exit_s=8.0, severity=S.WARNING, response=Response.BY_FIELD,
      why="a plan, its upload and the turn take too long; while headings are sent, our own field keeps clear"),
    W(name="no progress", watches="way made good towards the target in 180 s", enter=5.0, exit=15.0, unit="m",
      enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.REPLAN,
      why="current, weed, a lee: whatever the plan did not know"),
    W(name="heading against course", watches="angle between heading and course over ground above 0.5 m/s",
      enter=60.0, exit=40.0, unit="deg", enter_s=20.0, exit_s=10.0, severity=S.WARNING, response=Response.SAY,
      why="a compass error, going astern, or a current stronger than the boat"),
    W(name="off the corridor", watches="distance off the leg against what the plan's margin allows", enter=1.0,
      exit=0.7, unit="of the corridor", enter_s=3.0, exit_s=5.0, severity=S.WARNING, response=Response.REPLAN,
      why="outside it the clearance that was planned is no longer there"),
    W(name="stuck waypoint", watches="time since the waypoint was passed by our own geometry", enter=15.0, exit=1.0,
      unit="s", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.ADVANCE,
      why="Büsser's double conditions against the autopilot's own count"),
    W(name="mission ended", watches="the autopilot has completed the mission while goals remain", enter=1.0, exit=0.5,
      unit="", enter_s=5.0, exit_s=1.0, severity=S.NOTICE, response=Response.REPLAN,
      why="a plan that came too late leaves the boat in its safe end"),
    W(name="fence breach", watches="the autopilot's FENCE_STATUS", enter=1.0, exit=0.5, unit="", enter_s=0.0,
      exit_s=3.0, severity=S.CRITICAL, response=Response.REPLAN, at_rest=True,
      why="no new fence action follows while a breach lasts: the way out is ours"),
    W(name="foreign mission", watches="items on the autopilot that we did not put there", enter=1.0, exit=0.5, unit="",
      enter_s=0.0, exit_s=0.0, severity=S.ERROR, response=Response.COMPARE, at_rest=True,
      why="someone else changed the mission: it is theirs to decide"),
    W(name="reboot", watches="the autopilot's boot time going back", enter=1.0, exit=1.0, unit="s", enter_s=0.0,
      exit_s=0.0, severity=S.ERROR, response=Response.RESTART, at_rest=True,
      why="rates, mode and arming are lost; the mission survives in its memory"),
    W(name="battery low", watches="battery remaining", enter=20.0, exit=25.0, unit="%", enter_s=10.0, exit_s=10.0,
      severity=S.WARNING, response=Response.SAY, at_rest=True, why="time to think of the way home"),
    W(name="battery critical", watches="battery remaining", enter=10.0, exit=15.0, unit="%", enter_s=10.0,
      exit_s=10.0, severity=S.CRITICAL, response=Response.REFUGE, at_rest=True,
      why="a boat without power steers no more; better in a refuge"),
    W(name="planner dead", watches="the planner's worker process", enter=1.0, exit=0.5, unit="", enter_s=5.0,
      exit_s=1.0, severity=S.ERROR, response=Response.SAY, at_rest=True,
      why="it is killed and replaced by itself; until then the plan in place sails"),
)

BY_NAME = {w.name: w for w in TABLE}
IRONS_TWA_RAD = math.radians(35.0)
IRONS_TWS_MPS = 1.5            # less wind than this is a calm, not irons
MOVING_MPS = 0.5
PROGRESS_WINDOW_S = 180.0


# -------------------------------------------------------------------------------------- conditions
def measure(turn: Turn, name: str) -> float | None:
    """Return the watched figure in the table's unit, None when it cannot be told now."""
    return _MEASURES[name](turn)


def _flag(value: bool | None) -> float | None:
    return None if value is None else float(value)


def _link(turn: Turn) -> float | None:
    return turn.snapshot.heartbeat_age_s


def _position_lost(turn: Turn) -> float | None:
    return turn.snapshot.vehicle_age_s


def _jump(turn: Turn) -> float | None:
    return turn.jump_m if turn.snapshot.position_en_m is not None else None


def _wind(turn: Turn) -> float | None:
    health = turn.snapshot.wind.health
    return float(health is WindHealth.UNTRUSTED or (health is WindHealth.NONE and turn.state.sailing))


def _becalmed(turn: Turn) -> float | None:
    wind = turn.wind_mean
    if wind is None:
        return None
    return max(wind[1], BY_NAME["becalmed"].exit) if sails(turn) else wind[1]


def _irons(turn: Turn) -> float | None:
    wind, vehicle = turn.wind_now, turn.snapshot.vehicle
    if wind is None or vehicle is None or wind[1] < IRONS_TWS_MPS or turn.boat_en is None:
        return None
    if abs(difference_rad(wind[0], vehicle.heading_rad)) > IRONS_TWA_RAD:
        return BY_NAME["in irons"].exit
    ahead = vehicle.velocity_en_mps[0] * math.sin(vehicle.heading_rad) + (
        vehicle.velocity_en_mps[1] * math.cos(vehicle.heading_rad))
    return max(0.0, ahead)


def _too_near(turn: Turn) -> float | None:
    met = meets_in(turn)
    return None if met is None else met[0]


def _progress(turn: Turn) -> float | None:
    """Way made good in the window; None before the window is full or while there is a reason to stand still."""
    if turn.is_raised("becalmed") or not turn.ahead() or not turn.state.history:
        return None
    old = turn.state.history[0]
    if turn.t_s - old[0] < PROGRESS_WINDOW_S:
        return None
    return old[3] - turn.state.history[-1][3]


def _heading(turn: Turn) -> float | None:
    vehicle = turn.snapshot.vehicle
    if vehicle is None or turn.boat_en is None:
        return None
    if vehicle.speed_mps < MOVING_MPS:
        return 0.0
    return math.degrees(abs(difference_rad(math.atan2(*vehicle.velocity_en_mps), vehicle.heading_rad)))


def corridor_m(turn: Turn) -> float:
    """Return how far off its leg the boat may be before the margin's floor is in question [m]."""
    route = turn.state.route
    margin = route.margin_m if route is not None else turn.config.margin_m
    return max(margin - turn.config.margin_floor_m, turn.config.manoeuvre_m)


def _corridor(turn: Turn) -> float | None:
    """Share of the corridor used; in open water the grid size bounds it, not the margin."""
    boat, leg = turn.boat_en, turn.leg()
    if boat is None or leg is None or not turn.ahead() or turn.state.own_mode in {Mode.HOLD, Mode.LOITER}:
        return None      # stopped she follows no leg
    if distance_m(*leg) < 1.0:
        return 0.0
    if along_m(boat, *leg) < 0.0:
        # Before its leg begins: by a little wherever a waypoint is announced early, by more after a jump.
        off = max(0.0, distance_m(boat, leg[0]) - 2.0 * turn.config.announce_m)
    else:
        off = abs(cross_track_m(boat, *leg))
    clearance = turn.voyage.area.path_clearance_m([boat, leg[1]])
    allowed = turn.config.grid_size_m
    if clearance < turn.config.margin_floor_m:
        allowed = min(allowed, corridor_m(turn))
    return off / allowed


def _stuck(turn: Turn) -> float | None:
    passed = turn.state.passed_since_s
    return None if passed is None else turn.t_s - passed


def _ended(turn: Turn) -> float | None:
    route = turn.state.route
    if route is None or turn.gate is None or turn.autopilot is None:
        return None
    return float(turn.state.index >= len(route.items) - 1 or turn.autopilot.mission_state.name == "COMPLETE")


def _breach(turn: Turn) -> float | None:
    return _flag(turn.autopilot.fence_breached) if turn.autopilot is not None else None


def _foreign(turn: Turn) -> float | None:
    return float(bool(turn.state.foreign))


def _reboot(turn: Turn) -> float | None:
    return float(turn.state.rebooted)


def _battery(turn: Turn) -> float | None:
    status = turn.autopilot
    if status is None or status.battery_remaining is None:
        return None
    return 100.0 * status.battery_remaining


def _planner(turn: Turn) -> float | None:
    return float(not turn.snapshot.planner_alive)


_MEASURES: dict[str, Callable[[Turn], float | None]] = {
    "link silent": _link, "position lost": _position_lost, "position jump": _jump, "wind untrusted": _wind,
    "becalmed": _becalmed, "drifting": meets_in_s, "in irons": _irons, "vessel too near": _too_near,
    "no progress": _progress,
    "heading against course": _heading, "off the corridor": _corridor, "stuck waypoint": _stuck,
    "mission ended": _ended, "fence breach": _breach, "foreign mission": _foreign, "reboot": _reboot,
    "battery low": _battery, "battery critical": _battery, "planner dead": _planner,
}


# -------------------------------------------------------------------------------------- evaluation
def watch(turn: Turn) -> tuple[str, ...]:
    """Raise and clear watchdogs; return the names raised in this very step."""
    raised = {r.name: r for r in turn.state.raised}
    entering = dict(turn.state.entering)
    fresh: list[str] = []
    for dog in TABLE:
        value = measure(turn, dog.name) if dog.at_rest or _is_under_way(turn) else None
        above = dog.enter >= dog.exit     # the figure is bad when it is large
        enters = value is not None and (value >= dog.enter if above else value <= dog.enter)
        leaves = value is None or (value <= dog.exit if above else value >= dog.exit)
        if dog.enter == dog.exit:
            leaves = not enters
        if dog.name not in raised:
            if not enters:
                entering.pop(dog.name, None)
                continue
            since = entering.setdefault(dog.name, turn.t_s)
            if turn.t_s - since >= dog.enter_s:
                raised[dog.name] = Raised(name=dog.name, since_s=turn.t_s)
                entering.pop(dog.name)
                fresh.append(dog.name)
            continue
        now = raised[dog.name]
        if not leaves:
            raised[dog.name] = replace(now, clear_since_s=None)
            continue
        clear = now.clear_since_s if now.clear_since_s is not None else turn.t_s
        if turn.t_s - clear >= dog.exit_s:
            del raised[dog.name]
            turn.say(Severity.INFO, f"{dog.name} over", f"{dog.name}: over", every_s=0.0)
        else:
            raised[dog.name] = replace(now, clear_since_s=clear)
    order = {dog.name: n for n, dog in enumerate(TABLE)}
    turn.update(
        raised=tuple(sorted(raised.values(), key=lambda r: order[r.name])),
        entering=tuple(sorted(entering.items(), key=lambda e: order[e[0]])),
    )
    for name in fresh:
        dog = BY_NAME[name]
        value = measure(turn, name)
        figure = "" if value is None or not dog.unit else f" ({value:.1f} {dog.unit})"
        turn.say(dog.severity, name, f"{name}{figure}: {dog.response.value}", every_s=0.0)
    return tuple(fresh)


def _is_under_way(turn: Turn) -> bool:
    status = turn.autopilot
    own = turn.state.own_mode
    return (
        turn.state.sailing and status is not None and status.is_armed and status.mode in {Mode.AUTO, own}
    )
