"""Whose boat: nothing is asked of an autopilot before it is known to be ours, nor after it has become another.

Ours is the board that this voyage began with, alone under its system id, a rover with the frame that the mission asks
for. What a stranger's autopilot has on board sails on; ours is told nothing either until it is told apart again.
"""

from __future__ import annotations

from companion.frozen import changed
from companion.mavlink.vehicle_identity import ROVERS, Identity, type_words
from companion.messages import Severity
from companion.skipper.step import CancelPlan, Phase, StepContext, StopOrders

BOAT_CLASS = 2  # FRAME_CLASS of ArduRover
SAY_EVERY_S = 60.0


def judge(ctx: StepContext) -> None:
    """Judge whose autopilot is heard, before anything else is done; stop all orders when it may not be ours."""
    identity = ctx.snapshot.identity
    if ctx.snapshot.has_company:
        ctx.say(
            Severity.ERROR,
            "second companion",
            "a second companion speaks for this boat: stop one of the two, they give her different orders",
            every_s=SAY_EVERY_S,
        )
    wrong = _wrong(ctx, identity)
    if wrong:
        ctx.say(Severity.ERROR, "not ours", f"no orders: {wrong}", every_s=SAY_EVERY_S)
    asking = _unknown(ctx, identity)
    if not wrong and not asking:
        if ctx.state.vehicle.doubt:
            ctx.set(
                vehicle=changed(ctx.state.vehicle, doubt=""),
                mission=changed(ctx.state.mission, checked=False, read_since_s=ctx.t_s),
            )
            ctx.say(Severity.NOTICE, "ours", "the autopilot is known to be ours", every_s=0.0)
        if ctx.state.vehicle.uid is None:
            ctx.set(vehicle=changed(ctx.state.vehicle, uid=identity.uid, system=identity.system))
        ctx.set(vehicle=changed(ctx.state.vehicle, is_ours=True))
        return
    if ctx.state.vehicle.is_ours:
        ctx.act(StopOrders(text=wrong or asking))
        if ctx.state.pending.plan is not None:
            ctx.act(CancelPlan(request_id=ctx.state.pending.plan.request_id))
        ctx.set(pending=changed(ctx.state.pending, plan=None), steering=changed(ctx.state.steering, until_s=None))
    ctx.set(vehicle=changed(ctx.state.vehicle, is_ours=False, doubt=wrong or ctx.state.vehicle.doubt))


def stand_by(ctx: StepContext) -> bool:
    """Say why nothing is asked of the autopilot; False when it is ours."""
    state = ctx.state
    if state.vehicle.is_ours:
        return False
    wrong = _wrong(ctx, ctx.snapshot.identity)
    phase = state.phase
    if phase is not Phase.DONE and not state.voyage.sailing:
        phase = Phase.WAITING
    elif phase is not Phase.DONE and wrong:
        phase = Phase.OPERATOR
        if ctx.is_taken and state.operator.since_s is None:  # somebody takes her meanwhile, and may give her back
            ctx.set(operator=changed(ctx.state.operator, since_s=ctx.t_s))
    ctx.phase(phase, f"no orders, waiting: {wrong}" if wrong else _unknown(ctx, ctx.snapshot.identity))
    return True


def _wrong(ctx: StepContext, identity: Identity) -> str:
    """Return why the autopilot is none of ours, "" when it may be."""
    return _stranger(ctx, identity) or ("" if ctx.state.voyage.sailing else _unfit(ctx, identity))


def _stranger(ctx: StepContext, identity: Identity) -> str:
    """Return why the autopilot is another than the one that this voyage began with, "" when it is not."""
    kind, known, told = identity.vehicle_type, ctx.state.vehicle.uid, identity.uid
    if identity.is_contested:
        return (
            "two autopilots speak with one system id: give one of them another SYSID_THISMAV and name ours in "
            "[autopilot] system, or sign the link"
        )
    if kind is not None and kind not in ROVERS:
        return f"the vehicle is a {type_words(kind)}, not a rover: is it the right autopilot?"
    if known is not None and identity.is_confirmed and told != known:
        return (
            f"the autopilot is another one than this voyage began with (UID {told or 'none'}, not "
            f"{known or 'none'}): connect ours again, or begin anew without the saved state"
        )
    if ctx.snapshot.neighbours and not ctx.state.voyage.sailing:
        return (
            f"other autopilots are heard ({'; '.join(ctx.snapshot.neighbours)}): say which is yours, with "
            "--system N or [autopilot] system in the mission"
        )
    return ""


def _unfit(ctx: StepContext, identity: Identity) -> str:
    """Return why its frame is not the one that the mission asks for, "" when it is, or is not known yet."""
    if identity.frame_class is not None and identity.frame_class != BOAT_CLASS:
        return f"FRAME_CLASS is {identity.frame_class}, not a boat's: set it to {BOAT_CLASS} and reboot the autopilot"
    if identity.sails is None or identity.sails == ctx.config.sails:
        return ""
    if ctx.config.sails:
        return 'SAIL_ENABLE is 0, the boat does not sail: set it to 1, or write frame = "motor" in [autopilot]'
    return 'SAIL_ENABLE is 1 and the mission is for a motor boat: write frame = "sailboat" in [autopilot]'


def _unknown(ctx: StepContext, identity: Identity) -> str:
    """Return what of it is still to be told, in words, "" when all is."""
    if not identity.is_confirmed:
        return "waiting for the autopilot to tell who it is (AUTOPILOT_VERSION)"
    if not ctx.state.voyage.sailing and (identity.frame_class is None or identity.sails is None):
        return "waiting for the autopilot to tell its frame (FRAME_CLASS, SAIL_ENABLE)"
    return ""
