"""Uploads: asking for one, and taking its end."""

from __future__ import annotations

from dataclasses import replace

from companion.frozen import changed
from companion.skipper.board.mark import marked
from companion.skipper.planning.admission import refusal
from companion.skipper.step.actions import Change, Severity, UploadMission
from companion.skipper.step.missions import common_prefix, stopgap
from companion.skipper.step.route import Route
from companion.skipper.step.snapshot import UploadOutcome, UploadResult
from companion.skipper.step.state import PendingPlan, PendingUpload, Retry
from companion.skipper.step.turn import Turn


def upload(
    turn: Turn, route: Route, set_current: int | None, text: str, *, whole: bool = False, change: Change | None = None,
    planned: PendingPlan | None = None,
) -> str:
    """Ask for the upload of a route, with our mark; without permission it stays ready and the status says so.

    A route that was ``planned`` must be admitted (``companion.skipper.planning.admission``). Return why it is not, in
    words; empty: it is.
    """
    refused = "" if planned is None else refusal(turn, route, set_current, planned)
    if refused:
        return refused
    route = replace(route, items=marked(route.items))
    old = turn.state.mission.route
    known = old is not None and not turn.state.mission.foreign and turn.state.mission.checked and not whole
    on_board = old.items if old is not None and known else ()
    number = turn.new_id()
    keep = common_prefix(on_board, route.items)
    if old is not None and known:
        closing = stopgap(old, keep, turn.state.mission.index)
    else:
        # A list that is not ours to keep a part of: whoever gives an armed boat AUTO meanwhile must not sail a mixture.
        closing = stopgap(route, 0, 0) if turn.autopilot is not None and turn.autopilot.is_armed else None
    action = UploadMission(
        upload_id=number, items=route.items, keep_first=keep, set_current=set_current, plan_id=route.plan_id,
        text=text, stopgap=None if closing is None else marked([closing])[0], change=change or Change(),
    )
    if not turn.act(action):
        turn.set(plans=changed(turn.state.plans, ready_route=route))
        turn.say(Severity.WARNING, "upload not permitted", "a plan is ready; uploading is not permitted")
        return ""
    # A read that is still under way will tell of the mission before this upload: its answer is not wanted.
    turn.set(
        pending=changed(turn.state.pending, read=None, upload=PendingUpload(
            upload_id=number, t_s=turn.t_s, route=route, set_current=set_current, keep_first=action.keep_first)),
        plans=changed(turn.state.plans, ready_route=None))
    return ""


def take_upload(turn: Turn, outcome: UploadOutcome) -> None:
    """Take the end of an upload: the new route sails, or the mission on board must be looked at."""
    pending = turn.state.pending.upload
    if pending is None or pending.upload_id != outcome.upload_id:
        return
    if outcome.result is UploadResult.OK:
        index, missed_s = turn.state.mission.index, turn.state.progress.missed_s
        if pending.set_current is not None:
            index = pending.set_current - 1
        turn.set(
            pending=changed(turn.state.pending, upload=None, upload_retry=Retry()),
            mission=changed(
                turn.state.mission, route=pending.route, index=index, own_index=max(index, 0), checked=True,
                foreign="", unsure_route=None, replace_foreign=False, uploaded_s=turn.t_s,
                asked_s=turn.t_s if pending.set_current is not None else turn.state.mission.asked_s,
                asked_seq=pending.set_current if turn.state.voyage.sailing else None),
            progress=changed(   # an upload that was on its way at the miss does not lead back
                turn.state.progress, missed_s=missed_s if missed_s is not None and pending.t_s <= missed_s else None),
            plans=changed(
                turn.state.plans, no_go_since_s=None,
                replanned_index=turn.state.plans.replanned_index if pending.set_current != 1 else -1))
        return
    turn.set(
        pending=changed(turn.state.pending, upload=None, upload_retry=turn.failed(turn.state.pending.upload_retry)),
        mission=changed(turn.state.mission, unsure_route=pending.route, checked=False, read_since_s=turn.t_s))
    turn.say(
        Severity.ERROR, "upload failed",
        f"upload {outcome.result.value}: {outcome.text or 'no words'}; reading what is on board", every_s=0.0)
