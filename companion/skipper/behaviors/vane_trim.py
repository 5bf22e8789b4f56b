"""A vane that is turned on its mast, put right where the autopilot reads it: by ``WNDVN_DIR_OFS``.

The autopilot trims sheets and keeps out of the no-go zone by the wind that its vane tells. With a vane that is wrong by
30 degrees it holds the boat head to wind, and no plan and no mode of it sails her out: the vane itself is to be put
right. Asked for only where she does not sail and her own motion says so surely (``companion.current.vane``), by what it
is wrong by at least, and again when that did not do. What did not help after all is taken back.
"""

from __future__ import annotations

import math
from dataclasses import replace

from companion.current import VaneError
from companion.geo.angles import wrap_pi
from companion.messages import Severity
from companion.skipper.behaviors.helm import write_parameter
from companion.skipper.step.context import StepContext
from companion.skipper.step.state import VaneTrim
from companion.wind import VANE_OFFSET

DEAD_MPS = 0.3  # ahead, over ground: slower she lies dead
STUCK_S = 10.0  # she has not sailed for so long
AGAIN_S = 30.0  # the wind is learned anew meanwhile
LEAST_RAD = math.radians(8.0)  # a vane that is wrong by less is sailed by
MOST_TRIMS = 6
WORKED_S = 600.0  # she has sailed for so long since: what comes is another fault
SAID_S = 60.0


def trims_vane(ctx: StepContext) -> bool:
    """Ask for the vane's offset where she does not sail for it; True in the step in which that is asked."""
    vane, memory = ctx.snapshot.vane, ctx.state.vane
    if vane is None or not (vane.is_sure and _does_not_sail(ctx, vane)) or abs(vane.least_rad) < LEAST_RAD:
        _sails(ctx, memory)
        return False
    if memory.stuck_s is None:
        memory = replace(memory, stuck_s=ctx.t_s)
        ctx.set(vane=memory)
    assert memory.stuck_s is not None
    if ctx.t_s - memory.stuck_s < STUCK_S or ctx.t_s - memory.trimmed_s < AGAIN_S:
        return False
    present = ctx.snapshot.vane_offset_rad
    way = "clockwise" if vane.off_rad > 0.0 else "anticlockwise"
    error = (
        f"by the way she moves her vane reads {math.degrees(abs(vane.off_rad)):.0f}±"
        f"{math.degrees(vane.sigma_rad):.0f}° too far {way}"
    )
    if present is None:
        ctx.say(Severity.ERROR, "vane", f"{error}: turn it back on its mast", every_s=SAID_S)
        return False
    wanted = wrap_pi(present - vane.least_rad)
    if not ctx.snapshot.permissions.may_trim_vane:
        text = f"{error}: set {VANE_OFFSET} to {_degrees(wanted)}, it is {_degrees(present)} ([operator] trim_vane)"
        ctx.say(Severity.ERROR, "vane", text, every_s=SAID_S)
        return False
    if memory.trims > MOST_TRIMS:
        return False
    first = present if memory.first_rad is None else memory.first_rad
    is_last = memory.trims == MOST_TRIMS
    if is_last:
        wanted, text = first, f"{VANE_OFFSET} was written {MOST_TRIMS} times and she does not sail: it is put back"
    else:
        text = f"{error}: {VANE_OFFSET} from {_degrees(present)} to {_degrees(wanted)}"
    wanted_deg = float(f"{math.degrees(wanted):.0f}")
    if not write_parameter(ctx, VANE_OFFSET, wanted_deg, text):
        return False
    ctx.set(vane=replace(memory, trims=memory.trims + 1, trimmed_s=ctx.t_s, written_deg=wanted_deg, first_rad=first))
    ctx.say(Severity.WARNING, "vane", text, every_s=0.0)
    return True


def _does_not_sail(ctx: StepContext, vane: VaneError) -> bool:
    """Return whether she is held or driven for a wind that is not where it is told, or lies dead where she sailed.

    One that has not sailed yet may lie dead in a head sea, by a vane that is right. One whose vane was written already
    is not done before that is within what is sailed by: she crawled close to the wind by what was left of the error.
    """
    if ctx.snapshot.unsure or ctx.is_raised("drifting") or ctx.state.vane.trims > 0:
        return True
    vehicle = ctx.snapshot.vehicle
    if vehicle is None or not vane.was_right:
        return False
    east, north = vehicle.velocity_en_mps
    return east * math.sin(vehicle.heading_rad) + north * math.cos(vehicle.heading_rad) < DEAD_MPS


def _sails(ctx: StepContext, memory: VaneTrim) -> None:
    if memory.trims > 0 and ctx.t_s - memory.trimmed_s >= WORKED_S:
        ctx.set(vane=VaneTrim())
    elif memory.stuck_s is not None:
        ctx.set(vane=replace(memory, stuck_s=None))


def _degrees(angle_rad: float) -> str:
    return f"{math.degrees(angle_rad):.0f}"
