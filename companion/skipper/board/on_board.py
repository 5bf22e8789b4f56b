"""The mission on the autopilot: read, compared, and known to be ours, an earlier one of ours, a mixture, or foreign.

A mission that is not ours is read twice before it is called foreign, and looked at again now and then while it is: what
was read once may have been forged, and what a stranger put there he may take away.
"""

from __future__ import annotations

import math
from dataclasses import replace

from companion.frozen import changed
from companion.geofence.mission import hindrance, offer
from companion.mavlink.wire import mission_hash
from companion.messages import Command, MissionItem, Mode, Severity, sailed_part
from companion.safety import STOPPING
from companion.skipper.board.mark import are_marked, marked
from companion.skipper.step import AdoptDrawing, Persisted, Phase, ReadMission, Route, StepContext
from companion.skipper.step.missions import HELD_BACK, NO_PLAN, held_back, is_mixture, is_same_mission
from companion.skipper.step.state import Inside, Since, saved_of
from companion.words import counted

REMEDY = "it is not resumed; waiting for [operator] replace_foreign, or an order, to allow its replacement"
FOREIGN_REREAD_S = 30.0  # a mission that is not ours is read again this often


def mission_is_known(ctx: StepContext) -> bool:
    """Make sure that the mission on the autopilot is ours, empty, or known not to be."""
    state = ctx.state
    if state.mission.foreign:
        if _may_replace(ctx):
            ctx.set(mission=changed(ctx.state.mission, foreign="", route=None, adoptable=None, replace_foreign=True))
            return True
        if _is_ours_again(ctx):
            return True
        ctx.phase(Phase.OPERATOR if state.voyage.sailing else Phase.WAITING, f"{state.mission.foreign}; {REMEDY}")
        return False
    if state.pending.upload is not None:
        return True
    if state.mission.checked:
        age_s = ctx.t_s - state.mission.read_t_s
        if state.voyage.sailing and age_s > ctx.config.reread_s and state.pending.read is None:
            _read(ctx, "a look now and then whether it is still ours")
        elif (
            state.mission.read_t_s > state.mission.read_since_s
            and state.mission.read_items is not None
            and (
                state.mission.route is not None
                and state.mission.read_t_s == ctx.t_s
                and not is_same_mission(state.mission.read_items, state.mission.route.items)
            )
        ):
            ctx.set(mission=changed(ctx.state.mission, checked=False, read_since_s=state.mission.read_t_s))
        else:
            return True
    state = ctx.state
    if state.mission.checked:
        return True
    onboard = ctx.snapshot.mission
    items, read_t_s = state.mission.read_items, state.mission.read_t_s
    if onboard.items is not None and onboard.read_t_s is not None and onboard.read_t_s > read_t_s:
        items, read_t_s = onboard.items, onboard.read_t_s
    if items is None or read_t_s < state.mission.read_since_s:
        if state.pending.read is None and ctx.t_s >= state.pending.read_retry.not_before_s:
            _read(ctx, "whose mission is on board?")
        if not state.voyage.sailing:
            ctx.phase(Phase.WAITING, "waiting for the mission on the autopilot to be read")
        else:
            # Under way nothing is changed on a mission that may not be ours; what is there sails on.
            ctx.phase(state.phase, "waiting for the mission on board to be read: nothing is changed on it before")
        return False
    return _compare(ctx, items)


def _read(ctx: StepContext, text: str) -> None:
    number = ctx.new_id()
    ctx.set(pending=changed(ctx.state.pending, read=(number, ctx.t_s)))
    ctx.act(ReadMission(read_id=number, text=text))


def _compare(ctx: StepContext, items: tuple[MissionItem, ...]) -> bool:
    """Judge the mission that was read: ours, empty, a mixture of ours, an earlier one of ours, or foreign."""
    state = ctx.state
    saved = state.mission.adoptable
    ctx.set(mission=changed(ctx.state.mission, checked=True, read_t_s=ctx.t_s, adoptable=None, read_twice=False))
    lists = saved.lists if saved else ()
    routes = [r for r in (state.mission.route, state.mission.unsure_route, *lists) if r is not None]
    for route in routes:
        if is_same_mission(items, route.items):
            ctx.set(mission=changed(ctx.state.mission, route=route, unsure_route=None))
            if saved is not None and state.mission.route is None:
                _adopt(ctx, saved)
            return True
    cut = next((c for c in (held_back(items, r) for r in routes) if c is not None), None)
    if cut is not None:
        ctx.set(mission=changed(ctx.state.mission, route=cut, unsure_route=None))
        ctx.say(Severity.WARNING, "held back", f"{cut.why}: planning on", every_s=0.0)
        if saved is not None and state.mission.route is None:
            _adopt(ctx, saved)
        return True
    if not items:
        ctx.set(mission=changed(ctx.state.mission, route=None, unsure_route=None))
        if saved is not None:
            _take_up(ctx, saved)
        return True
    if any(is_mixture(items, a.items, b.items) for a in routes for b in routes):
        newest = state.mission.unsure_route or (saved.pending or saved.unsure if saved else None) or routes[0]
        ctx.say(Severity.WARNING, "mixture", "an upload was cut short: the mission is put right", every_s=0.0)
        if saved is not None:
            _take_up(ctx, saved)
            ctx.set(voyage=changed(ctx.state.voyage, sailing=state.voyage.sailing or _under_way(ctx)))
        ctx.set(
            mission=changed(ctx.state.mission, route=state.mission.route or newest, unsure_route=newest, repair=True)
        )
        return True
    # Under way we know what we have put there: a list of ours that we did not put there is somebody's order.
    if not state.voyage.sailing and (mission_hash(items) in state.mission.known or are_marked(items)):
        _take_over(ctx, items, saved)
        return True
    if not state.mission.read_twice and not state.mission.foreign:
        # behind this very read, which has the step's own time
        ctx.set(
            mission=changed(
                ctx.state.mission,
                checked=False,
                read_since_s=math.nextafter(ctx.t_s, math.inf),
                read_twice=True,
                adoptable=saved,
            )
        )
        phase = ctx.state.phase if state.voyage.sailing else Phase.WAITING
        ctx.phase(phase, "waiting for a second reading: the mission that was read is not ours")
        return False
    if state.mission.replace_foreign or _may_replace(ctx):
        ctx.set(mission=changed(ctx.state.mission, route=None, unsure_route=None, replace_foreign=True))
        return True
    text = f"the mission on the autopilot ({len(items)} items) is not ours"
    # What we had is kept as after a restart: a mission of ours that is read again is taken over.
    ctx.set(
        mission=changed(
            ctx.state.mission,
            foreign=text,
            route=None,
            unsure_route=None,
            adoptable=saved or saved_of(state, ctx.voyage.name),
        )
    )
    if not state.mission.foreign:
        ctx.say(Severity.ERROR, "foreign mission", f"{text}; {REMEDY}", every_s=0.0)
        ctx.say(Severity.WARNING, "drawn mission", offer(items, adopts=ctx.config.adopts), every_s=0.0)
    ctx.phase(Phase.OPERATOR if state.voyage.sailing else Phase.WAITING, f"{text}; {REMEDY}")
    return False


def _may_replace(ctx: StepContext) -> bool:
    """Return whether a stranger's mission may be overwritten: not one that somebody brings while we sail."""
    return ctx.snapshot.permissions.may_replace_foreign and not ctx.state.voyage.sailing


def _is_ours_again(ctx: StepContext) -> bool:
    """Look again at a mission that is not ours, and take up the voyage when it is ours by now."""
    state = ctx.state
    if state.mission.read_items is None or state.mission.read_t_s != ctx.t_s:
        patient = (
            ctx.t_s - state.mission.read_t_s > FOREIGN_REREAD_S and ctx.t_s >= state.pending.read_retry.not_before_s
        )
        if patient and state.pending.read is None:
            _read(ctx, "is it still a stranger's?")
        return False
    if not _compare(ctx, state.mission.read_items):
        return False
    ctx.set(mission=changed(ctx.state.mission, foreign=""))
    ctx.phase(Phase.WAITING, "waiting no longer: the mission on board is not a stranger's any more")
    return True


def _take_over(ctx: StepContext, items: tuple[MissionItem, ...], saved: Persisted | None) -> None:
    """Take a list of ours that is no list we know: an earlier voyage's, or one whose upload was not saved.

    A boat that sails by it keeps it until there is a plan from where it is; else it is replaced.
    """
    saved = saved or Persisted(voyage=ctx.voyage.name, gate=0, sailing=True, route=None, pending=None)
    if not _under_way(ctx):
        _take_up(ctx, saved)
        ctx.set(mission=changed(ctx.state.mission, route=None, unsure_route=None))
        ctx.say(
            Severity.NOTICE,
            "earlier mission",
            "the mission on board is an earlier one of ours, or the drawing that is sailed: it is replaced",
            every_s=0.0,
        )
        return
    ctx.set(mission=changed(ctx.state.mission, route=_route_of(ctx, items), unsure_route=None))
    _adopt(ctx, saved, "an earlier one of ours, or the drawing: sailing on by it until there is a plan")


def _route_of(ctx: StepContext, items: tuple[MissionItem, ...]) -> Route:
    """Return a list that was read as the route that sails: where it leads is known, what for is not."""
    whole = marked(sailed_part(items))
    autopilot = ctx.snapshot.autopilot
    known = None if autopilot is None else autopilot.home
    home = ctx.boat_en or (0.0, 0.0) if known is None else ctx.voyage.frame.en_from_geo(known)
    points = tuple(
        home if item.command == Command.NAV_RETURN_TO_LAUNCH else ctx.voyage.frame.en_from_geo(item.point)
        for item in whole
    )
    facts = ctx.blank_facts(NO_PLAN, ctx.config.margin_m, ctx.config.delta_s, HELD_BACK)
    return replace(
        facts,
        items=whole,
        points_en_m=points,
        leg_from_en_m=(points[0], *points[:-1]),
        gate_of=(-1,) * len(whole),
        why="a mission of ours that was not saved",
    )


def _under_way(ctx: StepContext) -> bool:
    status = ctx.autopilot
    return status is not None and status.is_armed and status.mode is Mode.AUTO


def _take_up(ctx: StepContext, saved: Persisted) -> None:
    """Take up the voyage where it was: the gates that are passed, and the way round the next buoy."""
    ctx.set(
        progress=changed(
            ctx.state.progress,
            gate=saved.gate,
            approaches=saved.approaches,
            bearing_rad=0.5 * math.pi * saved.quarters,
            is_blind=True,
            inside=None if saved.inside is None else Inside(goal=saved.inside[0], t_s=ctx.t_s, utc_s=saved.inside[1]),
            searched=saved.searched,
            covered=saved.covered,
            reached=saved.reached,
        ),
        voyage=changed(
            ctx.state.voyage,
            station_since=None if saved.station_utc_s is None else Since(t_s=ctx.t_s, utc_s=saved.station_utc_s),
        ),
    )


def _adopt(ctx: StepContext, saved: Persisted, what: str = "ours") -> None:
    """Take over the mission that sails, without an upload."""
    status = ctx.autopilot
    index = (status.mission_seq or 1) - 1 if status is not None else 0
    _take_up(ctx, saved)
    ctx.set(
        mission=changed(ctx.state.mission, index=index, own_index=index),
        steering=changed(ctx.state.steering, own_mode=saved.own_mode),
        adrift=replace(ctx.state.adrift, motor=saved.motor),
        operator=changed(ctx.state.operator, is_back=saved.own_mode in STOPPING),  # the boat has drifted since
        # Armed but not in AUTO: somebody else has taken the boat while we were away.
        voyage=changed(
            ctx.state.voyage, sailing=_under_way(ctx) or (saved.sailing and status is not None and status.is_armed)
        ),
    )
    ctx.say(Severity.NOTICE, "adopted", f"the mission on board is {what}, taken over at item {index + 1}", every_s=0.0)


# -------- Adopting what somebody has drawn and uploaded under way: the order for it, or why it cannot be.


def adopt(ctx: StepContext) -> str:
    """Ask for the mission on board to be sailed in place of this voyage; return why not, empty when it is asked for."""
    state = ctx.state
    if not state.mission.foreign or state.mission.read_items is None:
        return "nothing drawn is on offer"
    if not ctx.config.adopts:
        return "the goals of this voyage are in its mission file: end it, and start companion run --from-autopilot"
    trouble = hindrance(state.mission.read_items)
    if trouble:
        return f"what was drawn cannot be sailed: {trouble}"
    ctx.act(
        AdoptDrawing(text=f"the mission of {counted(len(state.mission.read_items), 'item')} that was drawn is adopted")
    )
    return ""
