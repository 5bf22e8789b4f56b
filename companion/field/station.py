"""Station keeping: stay near a point with a boat that cannot stop.

Short boards close-hauled, each ended by wearing round: bearing away and gybing is a circle of a few metres, while
a tack without way is irons. A board lasts until the boat has made up the height that the circle will cost and is
past the point; far off she sails back by the attractive point of the field.
"""

from __future__ import annotations

import enum
import math
from dataclasses import dataclass, field, replace

from companion.field.guidance import go_to, helm, step
from companion.field.values import GuidanceState, Habits, Manoeuvre, Setpoint, Situation
from companion.geo.angles import wrap_pi


@dataclass(frozen=True, slots=True, kw_only=True)
class Station:
    """Where and how to stay.

    A board at ``board_twa_rad`` ends when the boat is ``board_m`` beyond the point on its side and ``height_m`` to
    windward of it, or ``board_max_m`` beyond. At ``far_m`` the field takes over. ``thrust`` eases the sail: 1 is
    full. ``bear_off_deg_per_m`` is how much lower she sails for each metre too far to windward. With ``tacks``
    boards end by tacking, for a boat that tacks within seconds.
    """

    at_en: tuple[float, float]
    board_m: float = 0.0
    board_max_m: float = 3.0
    height_m: float = 6.0
    far_m: float = 20.0
    board_twa_rad: float = math.radians(55.0)
    thrust: float = 1.0
    bear_off_deg_per_m: float = 10.0
    tacks: bool = False


class Phase(enum.Enum):
    """What she is doing."""

    RETURN = "return"     # by the field
    BOARD = "board"
    WEAR = "wear"


@dataclass(frozen=True, slots=True, kw_only=True)
class StationState:
    """The memory: ``side`` is the sign of TWA on this board."""

    phase: Phase = Phase.RETURN
    since_s: float = 0.0
    side: int = 1
    steering: GuidanceState = field(default_factory=GuidanceState)


def keep(
    state: StationState, situation: Situation, station: Station, habits: Habits
) -> tuple[StationState, Setpoint]:
    """Return the next state and the setpoint, its thrust included.

    Raises:
        ValueError: the wind is not known.

    """
    twd, t = situation.twd_from_rad, situation.t_s
    if twd is None:
        raise ValueError("station keeping under sail needs the wind")
    habits = replace(habits, look_ahead=False)
    de, dn = situation.en_m[0] - station.at_en[0], situation.en_m[1] - station.at_en[1]
    up = de * math.sin(twd) + dn * math.cos(twd)
    across = de * math.cos(twd) - dn * math.sin(twd)      # to starboard of the wind's eye
    distance = math.hypot(de, dn)
    twa = wrap_pi(twd - situation.heading_rad)
    if state.phase is Phase.RETURN or distance > station.far_m:
        if distance < 10.0:
            state = replace(state, phase=Phase.BOARD, since_s=t, side=1 if twa > 0.0 else -1)
        else:
            steering, setpoint = step(state.steering, situation, go_to(station.at_en, twd, 15.0), habits)
            return replace(state, phase=Phase.RETURN, steering=steering), setpoint
    # Wind on starboard (side +1) carries her to port of the wind's eye.
    beyond = -state.side * across
    if state.phase is Phase.BOARD and (
        (beyond > station.board_m and up > station.height_m) or beyond > station.board_max_m
    ):
        state = replace(state, phase=Phase.WEAR, since_s=t, side=-state.side)
    if state.phase is Phase.WEAR:
        # Round by the stern: bear away past dead before the wind, then come up on the new side.
        if twa * state.side > 0.0 and abs(twa) < station.board_twa_rad + math.radians(25.0):
            state = replace(state, phase=Phase.BOARD, since_s=t)
        elif t - state.since_s > 45.0:
            state = replace(state, phase=Phase.RETURN, since_s=t)
    # To windward of the point she bears off, up to a broad reach: that is how she loses height on purpose.
    height = max(0.0, up - station.height_m + 1.0)
    angle = min(math.radians(125.0), station.board_twa_rad + math.radians(station.bear_off_deg_per_m) * height)
    wanted = twd - state.side * angle
    if not station.tacks:
        habits = replace(habits, tack_min_mps=math.inf)
    steering, heading, why = helm(state.steering, situation, wanted, habits)
    thrust = 1.0 if steering.manoeuvre is not Manoeuvre.SAIL else station.thrust
    setpoint = Setpoint(t_s=t, heading_rad=wrap_pi(heading), thrust=thrust, reason=f"{state.phase.value}: {why}")
    return replace(state, steering=steering), setpoint
