"""Station keeping: stay near a point with a boat that cannot stop.

A boat that tacks within seconds sails short boards close-hauled and ends each by tacking. Any other turns in loops,
always the same way, with the sail eased, and goes straight for the point whenever that lies ahead: through the wind
it needs way, which it gathers first. Far off both sail back by the attractive point of the field.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace

from companion.field.guidance import go_to, helm, step
from companion.field.values import GuidanceSettings, GuidanceState, Manoeuvre, Setpoint, Situation
from companion.geo.angles import wrap_pi

RETURNED_M = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """Where and how to stay. At ``far_m`` the field takes over.

    Boards (``tacks``): one at ``board_twa_rad`` ends when the boat is ``board_max_m`` beyond the point on its side;
    ``bear_off_deg_per_m`` is how much lower it sails for each metre too far to windward.

    Loops: about a point ``loop_up_m`` to windward of the station, since they drift; ``loop_cone_rad`` is how far from
    ahead a point may lie that it goes straight for, beyond ``loop_near_m`` of it; above ``ease_mps`` the sail is let
    out; ``loop_turn_rad`` is how far ahead of the bow a turn's heading is set; ``look_s`` its place is looked at ahead.
    """

    at_en: tuple[float, float]
    far_m: float = 25.0
    tacks: bool = False
    board_max_m: float = 2.0
    board_twa_rad: float = math.radians(55.0)
    bear_off_deg_per_m: float = 10.0
    loop_up_m: float = 3.0
    loop_near_m: float = 2.0
    loop_cone_rad: float = math.radians(48.0)
    loop_turn_rad: float = math.radians(92.0)
    ease_mps: float = 0.5
    eased_within_m: float = 12.0
    tack_mps: float = 0.6
    look_s: float = 0.5


class StationPhase(enum.Enum):
    """What the boat is doing."""

    RETURN = "return"  # by the field
    BOARD = "board"
    TACK = "tack"
    LOOP = "loop"


@dataclass(frozen=True, slots=True, kw_only=True)
class StationState:
    """The memory: ``side`` is the sign of TWA on this board."""

    phase: StationPhase = StationPhase.RETURN
    since_s: float = 0.0
    side: int = 1
    steering: GuidanceState = field(default_factory=GuidanceState)


def keep(
    state: StationState, situation: Situation, station: Station, habits: GuidanceSettings
) -> tuple[StationState, Setpoint]:
    """Return the next state and the setpoint, its thrust included.

    Raises:
        ValueError: the wind is not known.

    """
    twd = situation.twd_from_rad
    if twd is None:
        raise ValueError("station keeping under sail needs the wind")
    habits = replace(habits, look_ahead=False)
    distance = math.dist(situation.en_m, station.at_en)
    if distance > (RETURNED_M if state.phase is StationPhase.RETURN else station.far_m):
        steering, setpoint = step(state.steering, situation, go_to(station.at_en, twd, 15.0), habits)
        return replace(state, phase=StationPhase.RETURN, steering=steering), setpoint
    if station.tacks:
        return _board(state, situation, station, habits, twd)
    return _loop(state, situation, station, habits, twd)


def _board(
    state: StationState, situation: Situation, station: Station, habits: GuidanceSettings, twd: float
) -> tuple[StationState, Setpoint]:
    t = situation.t_s
    de, dn = situation.en_m[0] - station.at_en[0], situation.en_m[1] - station.at_en[1]
    up = de * math.sin(twd) + dn * math.cos(twd)
    across = de * math.cos(twd) - dn * math.sin(twd)  # to starboard of the wind's eye
    twa = wrap_pi(twd - situation.heading_rad)
    if state.phase is StationPhase.RETURN:
        state = replace(state, phase=StationPhase.BOARD, since_s=t, side=1 if twa > 0.0 else -1)
    # Wind on starboard (side +1) carries the boat to port of the wind's eye.
    beyond = -state.side * across
    if state.phase is StationPhase.BOARD and beyond > (0.0 if up > 0.0 else station.board_max_m):
        state = replace(state, phase=StationPhase.TACK, since_s=t, side=-state.side)
    # To windward of the point the boat bears off, up to a broad reach: that is how it loses height on purpose.
    height = max(0.0, up + 1.0)
    angle = min(math.radians(125.0), station.board_twa_rad + math.radians(station.bear_off_deg_per_m) * height)
    if state.phase is StationPhase.TACK:
        if twa * state.side > 0.0 and abs(twa) < angle + math.radians(25.0):
            state = replace(state, phase=StationPhase.BOARD, since_s=t)
        elif t - state.since_s > 45.0:
            state = replace(state, phase=StationPhase.RETURN, since_s=t)
    steering, heading, why = helm(state.steering, situation, twd - state.side * angle, habits)
    setpoint = Setpoint(t_s=t, heading_rad=wrap_pi(heading), reason=f"{state.phase.value}: {why}")
    return replace(state, steering=steering), setpoint


def _loop(
    state: StationState, situation: Situation, station: Station, habits: GuidanceSettings, twd: float
) -> tuple[StationState, Setpoint]:
    half, heading_rad = habits.no_go_half_rad, situation.heading_rad
    ve, vn = situation.velocity_en_mps
    speed = math.hypot(ve, vn)
    de = situation.en_m[0] + station.look_s * ve - station.at_en[0] - station.loop_up_m * math.sin(twd)
    dn = situation.en_m[1] + station.look_s * vn - station.at_en[1] - station.loop_up_m * math.cos(twd)
    distance, bearing = math.hypot(de, dn), math.atan2(-de, -dn)
    twa = wrap_pi(twd - heading_rad)
    same_tack = 1.0 if twa > 0.0 else -1.0
    thrust = 1.0 if speed < station.ease_mps or distance > station.eased_within_m else 0.0
    if distance > station.loop_near_m and abs(wrap_pi(bearing - heading_rad)) < station.loop_cone_rad:
        wanted, what = bearing, "to the point"
        if abs(wrap_pi(twd - bearing)) <= half:
            wanted, thrust = twd - same_tack * (half + math.radians(3.0)), 1.0
    else:
        wanted, what = heading_rad + station.loop_turn_rad, "turning"
        through = abs(wrap_pi(twd - wanted)) < half or (
            wrap_pi(twd - wanted) * twa < 0.0 and abs(twa) < math.radians(95.0)
        )
        if through and speed < station.tack_mps and abs(twa) > math.radians(40.0):
            wanted, thrust, what = twd - same_tack * math.radians(65.0), 1.0, "gathering way"
        elif abs(wrap_pi(twd - wanted)) < half:
            wanted = twd + half  # the boat turns to the right: out of the zone on the other side
    way = replace(habits, tack_min_mps=0.8 * station.tack_mps)
    steering, heading, why = helm(state.steering, situation, wanted, way)
    if steering.manoeuvre in {Manoeuvre.IRONS, Manoeuvre.WEAR}:
        what, thrust = why, 1.0
    setpoint = Setpoint(
        t_s=situation.t_s, heading_rad=wrap_pi(heading), thrust=thrust, reason=f"{StationPhase.LOOP.value}: {what}"
    )
    return replace(state, phase=StationPhase.LOOP, steering=steering), setpoint
