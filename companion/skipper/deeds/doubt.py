"""A position that jumped: the boat is where it says, or where it was and has sailed on from. What is safe at both?

The autopilot takes the new position and sails by it. A jump back to where dead reckoning has the boat ends the doubt at
once. Until then, where the other place is not clear ahead, the boat loiters: ArduRover's LOITER turns in circles of
12 m about a point, and where on earth that is does not matter to it, while HOLD would drift. That the new place is not
clear, either, is no reason against it: nobody sails inside a rock, and what jumps is false more often than true.
"""

from __future__ import annotations

import math

from companion.messages import Mode
from companion.skipper.deeds.helm import is_busy, set_mode
from companion.skipper.step.actions import Severity
from companion.skipper.step.causes import CRITICAL
from companion.skipper.step.state import Fix, Phase
from companion.skipper.step.turn import JUMP_M, Turn
from companion.skipper.way.voyage import PointEn

BACK_M = 15.0         # a jump back misses dead reckoning by no more than this, over the seconds in between
MEMORY_S = 300.0      # a jump back after this is a new jump
AHEAD_S = 20.0        # what the boat sails while the doubt lasts
LOITER_M = 12.0       # measured: how far it gets from the point
STAND_OFF_S = 90.0    # longer than this a position is believed, whatever lies at the other place
SLOW_MPS = 1.0


def follow(turn: Turn) -> None:
    """Add up the jumps; notice that the position is back where dead reckoning has it."""
    state, here, vehicle = turn.state, turn.snapshot.position_en_m, turn.snapshot.vehicle
    if state.doubt is not None and turn.t_s - state.doubt.t_s > MEMORY_S:
        turn.update(doubt=None)
    last, age = state.last_seen, turn.snapshot.vehicle_age_s
    if here is None or vehicle is None or last is None or age is None or turn.jump_m < JUMP_M:
        return
    elapsed_s = turn.t_s - age - last.t_s
    before = (0.0, 0.0) if state.doubt is None else state.doubt.en_m
    east = before[0] + here[0] - last.en_m[0] - vehicle.velocity_en_mps[0] * elapsed_s
    north = before[1] + here[1] - last.en_m[1] - vehicle.velocity_en_mps[1] * elapsed_s
    if state.doubt is not None and math.hypot(east, north) < BACK_M:
        turn.update(doubt=None, back_s=turn.t_s, raised=tuple(r for r in state.raised if r.name != "position jump"))
        turn.say(Severity.NOTICE, "position back", "the position is back where it was reckoned: believed", every_s=0.0)
    else:
        turn.update(doubt=Fix(t_s=turn.t_s, en_m=(east, north)))


def other_place(turn: Turn) -> PointEn | None:
    """Return where the boat is if the position has jumped wrongly, None without a doubt."""
    here, doubt = turn.snapshot.position_en_m, turn.state.doubt
    return None if here is None or doubt is None else (here[0] - doubt.en_m[0], here[1] - doubt.en_m[1])


def is_other_shut(turn: Turn) -> bool:
    """Return whether, from the other place, the boat would soon come too near to something as it is steered now."""
    place, here, leg, vehicle = other_place(turn), turn.snapshot.position_en_m, turn.leg(), turn.snapshot.vehicle
    if place is None or here is None or leg is None or vehicle is None:
        return False
    way = (leg[1][0] - here[0], leg[1][1] - here[1])
    left_m = math.hypot(*way)
    share = min(1.0, AHEAD_S * max(vehicle.speed_mps, SLOW_MPS) / left_m) if left_m > 0.0 else 0.0
    drift = (AHEAD_S * vehicle.velocity_en_mps[0], AHEAD_S * vehicle.velocity_en_mps[1])
    floor_m = min(turn.config.margin_floor_m, turn.config.margin_m)
    return min(
        turn.voyage.area.path_clearance_m([place, (place[0] + d[0], place[1] + d[1])])
        for d in ((share * way[0], share * way[1]), drift)) < floor_m


def stands_off(turn: Turn) -> bool:
    """Loiter while the position is in doubt and the other place is not clear ahead; True while it does."""
    status, state, here = turn.autopilot, turn.state, turn.snapshot.position_en_m
    if status is None or here is None or state.doubt is None or not turn.snapshot.permissions.may_set_mode:
        return False
    if not status.ekf_ok or status.system_status == CRITICAL:
        return False   # nor would it loiter then
    if turn.t_s - state.doubt.t_s > STAND_OFF_S or not is_other_shut(turn):
        return False
    room_m = float(turn.voyage.area.clearance_m([here])[0])
    if 0.0 < room_m < LOITER_M and not turn.is_way_shut:
        return False   # afloat there she would have no room to loiter, and her way is clear
    if status.mode is Mode.LOITER and state.own_mode is Mode.LOITER:
        turn.phase(Phase.HOLDING, "the position jumped and the other place is not clear ahead: waiting in a loiter "
                   "until it can be believed")
        return True
    if not turn.is_raised("position jump") or is_busy(turn, Mode.LOITER.name):
        return False
    if set_mode(turn, Mode.LOITER, "the position jumped and the other place is not clear ahead"):
        turn.update(after_operator=True)
        turn.say(Severity.WARNING, "standing off",
                 "the position jumped and the other place is not clear ahead: loitering", every_s=0.0)
    return True
