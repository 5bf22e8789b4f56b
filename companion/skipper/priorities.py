"""What the boat does when several things want doing: of behaviors in one order the first that acts has the step."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from companion.skipper.behaviors.failsafe import keeps_off, operator_has_it
from companion.skipper.behaviors.field_guidance import last_resort
from companion.skipper.behaviors.headings import brakes
from companion.skipper.behaviors.helm import repair
from companion.skipper.behaviors.launch import finished, launch, start
from companion.skipper.behaviors.operator_orders import holds_ashore, leaves_alone
from companion.skipper.behaviors.sailing import (
    bear_away,
    follow_route,
    give_back_helm,
    lie_at_diversion,
    rest_at_end,
    sail_on,
    stand_off,
    stop_drift,
)
from companion.skipper.behaviors.shoaling import turns_back
from companion.skipper.behaviors.vane_trim import trims_vane
from companion.skipper.behaviors.wind_doubt import holds, seeks_sea_room
from companion.skipper.board.on_board import mission_is_known
from companion.skipper.board.vehicle_identity import stand_by
from companion.skipper.intake import notice_truncation
from companion.skipper.step import Phase, StepContext


@dataclass(frozen=True, slots=True, kw_only=True)
class Behavior:
    """One thing to do: ``act`` returns whether it has the step, and nothing behind it is asked then."""

    name: str
    when: str
    does: str
    act: Callable[[StepContext], bool]


def _await_autopilot(ctx: StepContext) -> bool:
    """Wait until the autopilot is heard."""
    if ctx.autopilot is not None:
        return False
    age = ctx.snapshot.heartbeat_age_s
    heard = "nothing yet" if age is None else f"silent for {age:.0f} s; what it has on board sails on"
    phase = Phase.WAITING if not ctx.state.voyage.sailing else ctx.state.phase
    ctx.phase(phase, f"waiting to hear the autopilot: {heard}")
    return True


def _await_mission(ctx: StepContext) -> bool:
    """Change nothing on a mission that is not known to be ours; stop the boat where there is no time for that."""
    notice_truncation(ctx)
    if mission_is_known(ctx):
        return False
    if ctx.state.operator.is_back and not ctx.state.mission.foreign:
        brakes(ctx)  # a mode changes no mission, and a step may be all that is left of the water
    return True


def _await_next_start(ctx: StepContext) -> bool:
    """Stay where nothing was left to sail before this start."""
    if ctx.gate is not None or ctx.state.voyage.sailing:
        return False
    finished(ctx)
    return True


def _get_first_plan(ctx: StepContext) -> bool:
    """Get a first plan on board."""
    if ctx.state.mission.route is not None:
        return False
    start(ctx)
    return True


def _set_sail(ctx: StepContext) -> bool:
    """Set AUTO and arm."""
    if ctx.state.voyage.sailing:
        return False
    launch(ctx)
    return True


BEHAVIORS: tuple[Behavior, ...] = (
    Behavior(
        name="await autopilot",
        act=_await_autopilot,
        when="the autopilot is not heard",
        does="waits; what is on board sails on",
    ),
    Behavior(
        name="stand by", act=stand_by, when="the autopilot is not known to be this boat's", does="asks nothing of it"
    ),
    Behavior(name="given up", act=leaves_alone, when="the order `stop` stands", does="asks nothing of the boat"),
    Behavior(
        name="keep off",
        act=keeps_off,
        when="a way that is not of our planning leads over something near by",
        does="asks for LOITER",
    ),
    Behavior(
        name="operator",
        act=operator_has_it,
        when="a person, or a failsafe that is not answered, has the boat",
        does="does nothing until AUTO comes back; takes over from a failsafe that is",
    ),
    Behavior(
        name="await mission",
        act=_await_mission,
        when="the mission on board is not known to be ours",
        does="reads it, and changes nothing before; stops a boat that is given back too near to something",
    ),
    Behavior(
        name="held ashore",
        act=holds_ashore,
        when="the order `hold` stands and she has not set sail",
        does="waits to be told to go on",
    ),
    Behavior(
        name="await start", act=_await_next_start, when="nothing was left to sail before this start", does="watches"
    ),
    Behavior(
        name="first plan",
        act=_get_first_plan,
        when="no mission of ours is on board",
        does="plans and uploads one, once position, wind and permissions are there",
    ),
    Behavior(
        name="set sail",
        act=_set_sail,
        when="she is not under way",
        does="sets AUTO and arms, as permitted; not over a mode that somebody has set",
    ),
    Behavior(
        name="stand off",
        act=stand_off,
        when="the position is doubted and the place reckoned is not clear, or "
        "a LOITER's point jumped with it or lies beyond something",
        does="asks for LOITER, and keeps it until the position is believed",
    ),
    Behavior(
        name="trim the vane",
        act=trims_vane,
        when="she does not sail, and by the way she moves her vane is turned",
        does="writes `WNDVN_DIR_OFS`, as permitted",
    ),
    Behavior(
        name="seek sea room",
        act=seeks_sea_room,
        when="the wind is doubted, and a LOITER by it would be driven onto something",
        does="sails a straight clear leg to water with nothing to leeward",
    ),
    Behavior(
        name="stop a drift",
        act=stop_drift,
        when="she does not sail and drifts onto something, or in a calm",
        does="motor, LOITER, the call to the anchor",
    ),
    Behavior(
        name="rest",
        act=rest_at_end,
        when="the voyage is over, or no goal is left and nothing else to sail to",
        does="loiters, and is watched",
    ),
    Behavior(name="hold", act=holds, when="the wind cannot be planned with", does="asks for LOITER until it is known"),
    Behavior(
        name="turn back",
        act=turns_back,
        when="the sounder tells that it shoals",
        does="uploads a loiter on her own track, where the water is known to be deep; then plans with what was found",
    ),
    Behavior(name="brake", act=brakes, when="the leg meets something within 8 s", does="asks for LOITER, then plans"),
    Behavior(
        name="sail on",
        act=sail_on,
        when="she shows a stop that is ours to end",
        does="plans from where she is, and gives AUTO back",
    ),
    Behavior(name="last resort", act=last_resort, when="a vessel is too near to plan for", does="steers by field"),
    Behavior(
        name="lie at diversion",
        act=lie_at_diversion,
        when="she is at the end of a diversion",
        does="loiters while its reason lasts",
    ),
    Behavior(name="bear away", act=bear_away, when="she is in irons", does="steers out of them in GUIDED"),
    Behavior(
        name="give back helm",
        act=give_back_helm,
        when="GUIDED that we asked for is over",
        does="gives AUTO back at the item that she has come to",
    ),
    Behavior(
        name="repair", act=repair, when="the mission on board is a mixture of two of ours", does="uploads the whole one"
    ),
    Behavior(
        name="follow route",
        act=follow_route,
        when="otherwise",
        does="sails the mission on board, and plans for the [first reason](#reasons-to-plan) that there is",
    ),
)


def act(ctx: StepContext) -> None:
    """Let the first behavior that has something to do do it."""
    for behavior in BEHAVIORS:
        if behavior.act(ctx):
            return
