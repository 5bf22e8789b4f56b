"""Whose the mission on the autopilot is: what the next voyage meets there, and what a lost state leaves."""

from dataclasses import replace

import pytest

from companion.compose import permissions_of
from companion.geofence import load_mission
from companion.messages import MissionItem, Mode, StatusText
from companion.skipper.step import actions as act
from companion.skipper.step.config import ALL_PERMITTED, DRY_RUN
from companion.skipper.step.missions import is_same_mission
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import UploadResult
from companion.skipper.step.state import Phase
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal
from tests.skipper.test_voyage import ISLANDS, is_done, make, said
from tests.skipper.world import skipper, voyage


def stranger(saved, **changes):
    return replace(saved, **{"voyage": "another", "gate": 0, **changes})


def test_a_state_of_another_voyage_is_not_used_but_its_mission_is_known_and_replaced():
    """A second mission met the first one's list as foreign and waited for ever."""
    world = make()
    world.run(30)
    there = world.mission
    saved = world.skipper.persisted(world.state)
    moved = skipper(voyage(Goal(en_m=(-250.0, 60.0)), obstacles=ISLANDS))
    world.skipper, world.state, world.pending = moved, moved.initial(stranger(saved, gate=1)), []
    uploads = world.count(act.UploadMission)
    world.run(20)
    # under way by the old list, which is taken over as it is and replaced in one piece, behind a stopgap
    assert said(world, "adopted")
    assert not said(world, "foreign mission")
    upload = [a for _, a in world.actions if isinstance(a, act.UploadMission)][uploads]
    assert upload.stopgap is not None or upload.keep_first > 0
    assert not is_same_mission(world.mission, there)
    assert world.run(1500, is_done)
    assert distance_m(world.position, (-250.0, 60.0)) < 40.0


@pytest.mark.parametrize("how", ["from its state", "by its name", "by its mark"])
def test_an_earlier_mission_on_a_boat_that_lies_still_is_replaced(how):
    world = make()
    assert world.run(1500, is_done)
    saved = world.skipper.persisted(world.state)
    plain = tuple(replace(item, alt_m=0.0) for item in world.mission)
    world.mission = world.mission if how == "by its mark" else plain  # an autopilot without room for a mark
    world.armed, world.mode, world.pending = False, Mode.MANUAL, []
    moved = skipper(voyage(Goal(en_m=(-250.0, 60.0)), obstacles=ISLANDS))
    world.skipper, world.state = (
        moved,
        moved.initial(
            stranger(saved) if how == "from its state" else None, saved.names if how == "by its name" else ()
        ),
    )
    world.run(5)
    assert said(world, "earlier mission")
    assert world.run(1500, is_done)
    assert distance_m(world.position, (-250.0, 60.0)) < 40.0


@pytest.mark.parametrize(
    ("set_auto", "dry_run", "words"),
    [
        (True, True, "no --dry-run"),
        (False, True, "[operator] set_auto = true in the mission, and no --dry-run"),
        (False, False, "[operator] set_auto = true in the mission"),
    ],
)
def test_only_what_is_not_in_place_already_is_asked_for(tmp_path, set_auto, dry_run, words):
    path = tmp_path / "m.toml"
    path.write_text(
        "[[goal]]\nlat = 50.82\nlon = -1.3\n[start]\nlat = 50.817\nlon = -1.3\n"
        f"[operator]\nset_auto = {str(set_auto).lower()}\n"
    )
    permissions = permissions_of(load_mission(path), dry_run=dry_run)
    assert not permissions.may_upload
    world = make()
    world.permissions = permissions
    world.run(120)
    assert world.state.why == f"a plan is ready; waiting for permission to upload it: {words}"


def test_a_dry_run_plans_beside_an_earlier_mission_and_leaves_it_there():
    world = make()
    assert world.run(1500, is_done)
    there = world.mission
    world.armed, world.mode, world.pending, world.permissions = False, Mode.MANUAL, [], DRY_RUN
    moved = skipper(voyage(Goal(en_m=(-250.0, 60.0)), obstacles=ISLANDS))
    world.skipper, world.state = moved, moved.initial()
    before = len(world.actions)
    world.run(60)
    assert "waiting for permission to upload it: [operator] set_auto = true" in world.state.why
    assert world.mission == there
    assert not {type(a) for _, a in world.actions[before:]} & {act.UploadMission, act.SetMode, act.Arm, act.SetCurrent}


def test_an_earlier_mission_that_somebody_has_changed_is_his():
    world = make()
    assert world.run(1500, is_done)
    first, *rest = world.mission
    world.mission = (replace(first, lat_e7=first.lat_e7 + 1000), *rest)
    world.armed, world.mode, world.pending = False, Mode.MANUAL, []
    world.state = world.skipper.initial()
    world.run(60)
    assert said(world, "foreign mission")
    assert "replace_foreign" in world.state.why
    assert not world.armed


def test_the_permission_to_replace_does_not_hold_for_what_somebody_brings_under_way():
    world = make(permissions=replace(ALL_PERMITTED, may_replace_foreign=True))
    world.run(60)
    theirs = (MissionItem(command=16, lat_e7=511_010_000, lon_e7=-13_000_000), MissionItem(command=20))
    world.install(theirs)
    world.events.append(StatusText(t_s=world.t, severity=6, text="Flight plan received"))
    world.run(60)
    assert world.mission == theirs
    assert world.state.mission.foreign


def test_a_mission_that_has_arrived_is_not_sailed_again_by_itself():
    """It asked for a plan without a goal, for ever."""
    world = make()
    assert world.run(1500, is_done)
    saved = world.skipper.persisted(world.state)
    assert world.skipper.has_arrived(saved)
    world.armed, world.mode, world.pending = False, Mode.MANUAL, []
    world.state = world.skipper.initial(saved)
    before = len(world.actions)
    world.run(30)
    assert world.state.phase is Phase.DONE
    assert "--again" in world.state.why
    assert {type(a) for _, a in world.actions[before:]} <= {act.ReadMission, act.Announce}
    # told to, it sails from the beginning; the list of the first time is known by its name
    world.state, world.position = world.skipper.initial(None, saved.names), (0.0, 0.0)
    assert world.run(1500, is_done)
    assert world.state.progress.reached


def test_a_failed_upload_is_remembered_beside_the_next():
    """A kill then left a mixture that the saved state could not explain."""
    world = make(uploads_fail=lambda n: UploadResult.TIMEOUT if n == 2 else UploadResult.OK)
    world.run(400, lambda w: w.state.mission.unsure_route is not None and w.state.pending.upload is not None)
    saved = world.skipper.persisted(world.state)
    assert saved.unsure is not None
    assert saved.pending is not None
    assert Persisted.from_dict(saved.to_dict()) == saved
