"""The mission on the autopilot: read, compared, and known to be ours, an earlier one of ours, a mixture, or foreign.

A mission that is not ours is read twice before it is called foreign, and looked at again now and then while it is: what
was read once may have been forged, and what a stranger put there he may take away.
"""

from __future__ import annotations

import math
from dataclasses import replace

from companion.frozen import changed
from companion.geofence.mission import offer
from companion.mavlink.wire import mission_hash
from companion.messages import Command, MissionItem, Mode
from companion.skipper.board.mark import are_marked, marked
from companion.skipper.step.actions import ReadMission, Severity
from companion.skipper.step.causes import STOPPING
from companion.skipper.step.missions import HELD_BACK, NO_PLAN, effective, held_back, is_mixture, is_same_mission
from companion.skipper.step.route import Route
from companion.skipper.step.saved import Persisted
from companion.skipper.step.state import Inside, Phase, saved_of
from companion.skipper.step.turn import Turn

REMEDY = "it is not resumed; waiting for [operator] replace_foreign, or an order, to allow its replacement"
FOREIGN_REREAD_S = 30.0   # a mission that is not ours is read again this often


def mission_is_known(turn: Turn) -> bool:
    """Make sure that the mission on the autopilot is ours, empty, or known not to be."""
    state = turn.state
    if state.mission.foreign:
        if _may_replace(turn):
            turn.set(mission=changed(turn.state.mission, foreign="", route=None, adoptable=None, replace_foreign=True))
            return True
        if _is_ours_again(turn):
            return True
        turn.phase(Phase.OPERATOR if state.voyage.sailing else Phase.WAITING, f"{state.mission.foreign}; {REMEDY}")
        return False
    if state.pending.upload is not None:
        return True
    if state.mission.checked:
        age_s = turn.t_s - state.mission.read_t_s
        if state.voyage.sailing and age_s > turn.config.reread_s and state.pending.read is None:
            _read(turn, "a look now and then whether it is still ours")
        elif state.mission.read_t_s > state.mission.read_since_s and state.mission.read_items is not None and (
            state.mission.route is not None and state.mission.read_t_s == turn.t_s
            and not is_same_mission(state.mission.read_items, state.mission.route.items)
        ):
            turn.set(mission=changed(turn.state.mission, checked=False, read_since_s=state.mission.read_t_s))
        else:
            return True
    state = turn.state
    if state.mission.checked:
        return True
    onboard = turn.snapshot.mission
    items, read_t_s = state.mission.read_items, state.mission.read_t_s
    if onboard.items is not None and onboard.read_t_s is not None and onboard.read_t_s > read_t_s:
        items, read_t_s = onboard.items, onboard.read_t_s
    if items is None or read_t_s < state.mission.read_since_s:
        if state.pending.read is None and turn.t_s >= state.pending.read_retry.not_before_s:
            _read(turn, "whose mission is on board?")
        if not state.voyage.sailing:
            turn.phase(Phase.WAITING, "waiting for the mission on the autopilot to be read")
        else:
            # Under way nothing is changed on a mission that may not be ours; what is there sails on.
            turn.phase(state.phase, "waiting for the mission on board to be read: nothing is changed on it before")
        return False
    return _compare(turn, items)


def _read(turn: Turn, text: str) -> None:
    number = turn.new_id()
    turn.set(pending=changed(turn.state.pending, read=(number, turn.t_s)))
    turn.act(ReadMission(read_id=number, text=text))


def _compare(turn: Turn, items: tuple[MissionItem, ...]) -> bool:
    """Judge the mission that was read: ours, empty, a mixture of ours, an earlier one of ours, or foreign."""
    state = turn.state
    saved = state.mission.adoptable
    turn.set(mission=changed(turn.state.mission, checked=True, read_t_s=turn.t_s, adoptable=None, read_twice=False))
    lists = saved.lists if saved else ()
    routes = [r for r in (state.mission.route, state.mission.unsure_route, *lists) if r is not None]
    for route in routes:
        if is_same_mission(items, route.items):
            turn.set(mission=changed(turn.state.mission, route=route, unsure_route=None))
            if saved is not None and state.mission.route is None:
                _adopt(turn, saved)
            return True
    cut = next((c for c in (held_back(items, r) for r in routes) if c is not None), None)
    if cut is not None:
        turn.set(mission=changed(turn.state.mission, route=cut, unsure_route=None))
        turn.say(Severity.WARNING, "held back", f"{cut.why}: planning on", every_s=0.0)
        if saved is not None and state.mission.route is None:
            _adopt(turn, saved)
        return True
    if not items:
        turn.set(mission=changed(turn.state.mission, route=None, unsure_route=None))
        if saved is not None:
            _take_up(turn, saved)
        return True
    if any(is_mixture(items, a.items, b.items) for a in routes for b in routes):
        newest = state.mission.unsure_route or (saved.pending or saved.unsure if saved else None) or routes[0]
        turn.say(Severity.WARNING, "mixture", "an upload was cut short: the mission is put right", every_s=0.0)
        if saved is not None:
            _take_up(turn, saved)
            turn.set(voyage=changed(turn.state.voyage, sailing=state.voyage.sailing or _under_way(turn)))
        turn.set(mission=changed(
            turn.state.mission, route=state.mission.route or newest, unsure_route=newest, repair=True))
        return True
    # Under way we know what we have put there: a list of ours that we did not put there is somebody's order.
    if not state.voyage.sailing and (mission_hash(items) in state.mission.known or are_marked(items)):
        _take_over(turn, items, saved)
        return True
    if not state.mission.read_twice and not state.mission.foreign:
        # behind this very read, which has the step's own time
        turn.set(mission=changed(
            turn.state.mission, checked=False, read_since_s=math.nextafter(turn.t_s, math.inf), read_twice=True,
            adoptable=saved))
        phase = turn.state.phase if state.voyage.sailing else Phase.WAITING
        turn.phase(phase, "waiting for a second reading: the mission that was read is not ours")
        return False
    if state.mission.replace_foreign or _may_replace(turn):
        turn.set(mission=changed(turn.state.mission, route=None, unsure_route=None, replace_foreign=True))
        return True
    text = f"the mission on the autopilot ({len(items)} items) is not ours"
    # What we had is kept as after a restart: a mission of ours that is read again is taken over.
    turn.set(mission=changed(
        turn.state.mission, foreign=text, route=None, unsure_route=None,
        adoptable=saved or saved_of(state, turn.voyage.name)))
    if not state.mission.foreign:
        turn.say(Severity.ERROR, "foreign mission", f"{text}; {REMEDY}", every_s=0.0)
        turn.say(Severity.WARNING, "drawn mission", offer(items, adopts=turn.config.adopts), every_s=0.0)
    turn.phase(Phase.OPERATOR if state.voyage.sailing else Phase.WAITING, f"{text}; {REMEDY}")
    return False


def _may_replace(turn: Turn) -> bool:
    """Return whether a stranger's mission may be overwritten: not one that somebody brings while we sail."""
    return turn.snapshot.permissions.may_replace_foreign and not turn.state.voyage.sailing


def _is_ours_again(turn: Turn) -> bool:
    """Look again at a mission that is not ours, and take up the voyage when it is ours by now."""
    state = turn.state
    if state.mission.read_items is None or state.mission.read_t_s != turn.t_s:
        patient = (
            turn.t_s - state.mission.read_t_s > FOREIGN_REREAD_S
            and turn.t_s >= state.pending.read_retry.not_before_s)
        if patient and state.pending.read is None:
            _read(turn, "is it still a stranger's?")
        return False
    if not _compare(turn, state.mission.read_items):
        return False
    turn.set(mission=changed(turn.state.mission, foreign=""))
    turn.phase(Phase.WAITING, "waiting no longer: the mission on board is not a stranger's any more")
    return True


def _take_over(turn: Turn, items: tuple[MissionItem, ...], saved: Persisted | None) -> None:
    """Take a list of ours that is no list we know: an earlier voyage's, or one whose upload was not saved.

    A boat that sails by it keeps it until there is a plan from where she is; else it is replaced.
    """
    saved = saved or Persisted(voyage=turn.voyage.name, gate=0, sailing=True, route=None, pending=None)
    if not _under_way(turn):
        _take_up(turn, saved)
        turn.set(mission=changed(turn.state.mission, route=None, unsure_route=None))
        turn.say(Severity.NOTICE, "earlier mission", "the mission on board is an earlier one of ours, or the drawing "
                 "that is sailed: it is replaced", every_s=0.0)
        return
    turn.set(mission=changed(turn.state.mission, route=_route_of(turn, items), unsure_route=None))
    _adopt(turn, saved, "an earlier one of ours, or the drawing: sailing on by it until there is a plan")


def _route_of(turn: Turn, items: tuple[MissionItem, ...]) -> Route:
    """Return a list that was read as the route that sails: where it leads is known, what for is not."""
    whole = marked(effective(items))
    home = turn.voyage.home_en_m or turn.boat_en or (0.0, 0.0)
    points = tuple(
        home if item.command == Command.NAV_RETURN_TO_LAUNCH else turn.voyage.frame.en_from_geo(item.point)
        for item in whole)
    facts = turn.blank_facts(NO_PLAN, turn.config.margin_m, turn.config.delta_s, HELD_BACK)
    return replace(
        facts, items=whole, points_en_m=points, leg_from_en_m=(points[0], *points[:-1]), gate_of=(-1,) * len(whole),
        why="a mission of ours that was not saved")


def _under_way(turn: Turn) -> bool:
    status = turn.autopilot
    return status is not None and status.is_armed and status.mode is Mode.AUTO


def _take_up(turn: Turn, saved: Persisted) -> None:
    """Take up the voyage where it was: the gates that are passed, and the way round the next buoy."""
    turn.set(progress=changed(
        turn.state.progress, gate=saved.gate, approaches=saved.approaches,
        bearing_rad=0.5 * math.pi * saved.quarters, is_blind=True,
        inside=None if saved.inside is None else Inside(goal=saved.inside[0], t_s=turn.t_s, utc_s=saved.inside[1]),
        searched=saved.searched, covered=saved.covered))


def _adopt(turn: Turn, saved: Persisted, what: str = "ours") -> None:
    """Take over the mission that sails, without an upload."""
    status = turn.autopilot
    index = (status.mission_seq or 1) - 1 if status is not None else 0
    _take_up(turn, saved)
    turn.set(
        mission=changed(turn.state.mission, index=index, own_index=index),
        steering=changed(turn.state.steering, own_mode=saved.own_mode),
        adrift=replace(turn.state.adrift, motor=saved.motor),
        operator=changed(turn.state.operator, is_back=saved.own_mode in STOPPING),   # she has drifted since
        # Armed but not in AUTO: somebody else has taken the boat while we were away.
        voyage=changed(
            turn.state.voyage, sailing=_under_way(turn) or (saved.sailing and status is not None and status.is_armed)))
    turn.say(Severity.NOTICE, "adopted", f"the mission on board is {what}, taken over at item {index + 1}", every_s=0.0)
