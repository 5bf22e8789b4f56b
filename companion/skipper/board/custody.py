"""Whose boat: nothing is asked of an autopilot before it is known to be ours, nor after it has become another.

Ours is the board that this voyage began with, alone under its system id, a rover with the frame that the mission asks
for. What a stranger's autopilot has on board sails on; ours is told nothing either until it is told apart again.
"""

from __future__ import annotations

from companion.frozen import changed
from companion.mavlink.vehicle_identity import ROVERS, Identity, type_words
from companion.skipper.step.actions import CancelPlan, Severity, StopOrders
from companion.skipper.step.state import Phase
from companion.skipper.step.turn import Turn

BOAT_CLASS = 2         # FRAME_CLASS of ArduRover
SAY_EVERY_S = 60.0


def judge(turn: Turn) -> None:
    """Judge whose autopilot is heard, before anything else is done; stop all orders when it may not be ours."""
    identity = turn.snapshot.identity
    if turn.snapshot.has_company:
        turn.say(Severity.ERROR, "second companion",
                 "a second companion speaks for this boat: stop one of the two, they give her different orders",
                 every_s=SAY_EVERY_S)
    wrong = _wrong(turn, identity)
    if wrong:
        turn.say(Severity.ERROR, "not ours", f"no orders: {wrong}", every_s=SAY_EVERY_S)
    asking = _unknown(turn, identity)
    if not wrong and not asking:
        if turn.state.vehicle.doubt:
            turn.set(
                vehicle=changed(turn.state.vehicle, doubt=""),
                mission=changed(turn.state.mission, checked=False, read_since_s=turn.t_s))
            turn.say(Severity.NOTICE, "ours", "the autopilot is known to be ours", every_s=0.0)
        if turn.state.vehicle.uid is None:
            turn.set(vehicle=changed(turn.state.vehicle, uid=identity.uid, system=identity.system))
        turn.set(vehicle=changed(turn.state.vehicle, is_ours=True))
        return
    if turn.state.vehicle.is_ours:
        turn.act(StopOrders(text=wrong or asking))
        if turn.state.pending.plan is not None:
            turn.act(CancelPlan(request_id=turn.state.pending.plan.request_id))
        turn.set(pending=changed(turn.state.pending, plan=None), steering=changed(turn.state.steering, until_s=None))
    turn.set(vehicle=changed(turn.state.vehicle, is_ours=False, doubt=wrong or turn.state.vehicle.doubt))


def stand_by(turn: Turn) -> bool:
    """Say why nothing is asked of the autopilot; False when it is ours."""
    state = turn.state
    if state.vehicle.is_ours:
        return False
    wrong = _wrong(turn, turn.snapshot.identity)
    phase = state.phase
    if phase is not Phase.DONE and not state.voyage.sailing:
        phase = Phase.WAITING
    elif phase is not Phase.DONE and wrong:
        phase = Phase.OPERATOR
    turn.phase(phase, f"no orders, waiting: {wrong}" if wrong else _unknown(turn, turn.snapshot.identity))
    return True


def _wrong(turn: Turn, identity: Identity) -> str:
    """Return why the autopilot is none of ours, "" when it may be."""
    return _stranger(turn, identity) or ("" if turn.state.voyage.sailing else _unfit(turn, identity))


def _stranger(turn: Turn, identity: Identity) -> str:
    """Return why the autopilot is another than the one that this voyage began with, "" when it is not."""
    kind, known, told = identity.vehicle_type, turn.state.vehicle.uid, identity.uid
    if identity.is_contested:
        return ("two autopilots speak with one system id: give one of them another SYSID_THISMAV and name ours in "
                "[autopilot] system, or sign the link")
    if kind is not None and kind not in ROVERS:
        return f"the vehicle is a {type_words(kind)}, not a rover: is it the right autopilot?"
    if known is not None and identity.is_confirmed and told != known:
        return (f"the autopilot is another one than this voyage began with (UID {told or 'none'}, not "
                f"{known or 'none'}): connect ours again, or begin anew without the saved state")
    if turn.snapshot.neighbours and not turn.state.voyage.sailing:
        return (f"other autopilots are heard ({'; '.join(turn.snapshot.neighbours)}): say which is yours, with "
                "--system N or [autopilot] system in the mission")
    return ""


def _unfit(turn: Turn, identity: Identity) -> str:
    """Return why its frame is not the one that the mission asks for, "" when it is, or is not known yet."""
    if identity.frame_class is not None and identity.frame_class != BOAT_CLASS:
        return f"FRAME_CLASS is {identity.frame_class}, not a boat's: set it to {BOAT_CLASS} and reboot the autopilot"
    if identity.sails is None or identity.sails == turn.config.sails:
        return ""
    if turn.config.sails:
        return 'SAIL_ENABLE is 0, the boat does not sail: set it to 1, or write frame = "motor" in [autopilot]'
    return 'SAIL_ENABLE is 1 and the mission is for a motor boat: write frame = "sailboat" in [autopilot]'


def _unknown(turn: Turn, identity: Identity) -> str:
    """Return what of it is still to be told, in words, "" when all is."""
    if not identity.is_confirmed:
        return "waiting for the autopilot to tell who it is (AUTOPILOT_VERSION)"
    if not turn.state.voyage.sailing and (identity.frame_class is None or identity.sails is None):
        return "waiting for the autopilot to tell its frame (FRAME_CLASS, SAIL_ENABLE)"
    return ""
