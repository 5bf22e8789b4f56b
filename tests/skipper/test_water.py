"""A state in another frame: no place that the skipper remembers is forgotten, and a saved state knows its water."""

import math
import typing
from dataclasses import fields, is_dataclass, replace

import pytest

from companion.fold import begun
from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift, is_place, is_velocity
from companion.messages import GeoPoint
from companion.orders import Verb
from companion.planner import Problem
from companion.skipper import Skipper, SkipperConfig
from companion.skipper.step.saved import Persisted, Standing
from companion.skipper.step.state import Adrift, Fix, PendingPlan, SkipperState, in_water
from companion.skipper.way.gates import Approach
from companion.skipper.way.position_plausibility import PositionDoubt
from companion.traffic.vessel import Vessel
from tests.skipper.world import World, voyage, with_parts

# Pairs of numbers that are no places: said here, so that a new one is thought about.
NO_PLACES = {
    ("GoalProgress", "history"),  # carried over by hand
    ("Announced", "codes"),
    ("Alarms", "entering"),
    ("Adrift", "bow_mps"),  # to starboard and ahead, whatever the frame
    ("GoalProgress", "covered"),
    ("Signs", "seen_s"),
    ("Persisted", "inside"),
    ("Persisted", "covered"),
    ("Persisted", "lee_mps"),  # speeds, on either tack
    ("AutopilotStatus", "servo_us"),
}


def pairs_in(hint):
    """Whether a pair of floats is anywhere in a type."""
    if typing.get_origin(hint) is tuple and typing.get_args(hint) == (float, float):
        return True
    return any(pairs_in(a) for a in typing.get_args(hint) if a is not Ellipsis)


def classes_in(hint):
    if isinstance(hint, type) and is_dataclass(hint):
        yield hint
    for inner in typing.get_args(hint):
        if inner is not Ellipsis:
            yield from classes_in(inner)


def reached(*roots):
    seen, todo = set(), list(roots)
    while todo:
        cls = todo.pop()
        if cls in seen or cls is Problem:  # that of a plan which is cancelled where the water changes
            continue
        seen.add(cls)
        for hint in typing.get_type_hints(cls).values():
            todo += list(classes_in(hint))
    return seen


def test_no_place_of_the_state_is_forgotten():
    """Every pair of metres in what is remembered bears a name that is carried over, or is said to be none."""
    found = reached(SkipperState, Persisted, Vessel)
    assert {Approach, Standing, Fix, Adrift, PendingPlan} <= found
    missed = [
        (cls.__name__, f.name)
        for cls in found
        for f in fields(cls)
        if pairs_in(typing.get_type_hints(cls)[f.name])
        and not (is_place(f.name) or is_velocity(f.name))
        and (cls.__name__, f.name) not in NO_PLACES
    ]
    assert missed == []


def shifted(world, east_m=4000.0, north_m=-2500.0):
    before = world.skipper.voyage.frame
    return Shift(before, LocalFrame(before.geo_from_en(east_m, north_m)))


def test_everything_that_is_remembered_is_where_it_was():
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    world.run(120)
    state = with_parts(
        world.state,
        voyage={"rest_en_m": (10.0, 20.0)},
        progress={
            "searched": ((1.0, 2.0), (3.0, 4.0)),
            "approaches": (Approach(goal=0, en_m=(7.0, 8.0), sweeps=(((0.0, 0.0), (9.0, 9.0)),)),),
        },
        position={
            "doubt": PositionDoubt(
                since_s=1.0,
                t_s=1.0,
                settled_s=1.0,
                reckoned_en_m=(30.0, 40.0),
                velocity_en_mps=(1.0, 0.0),
                why="it jumped",
            )
        },
        adrift=Adrift(places=(Fix(t_s=0.0, en_m=(5.0, 6.0)),), ground_en_mps=(0.5, 0.0)),
        orders={"standing": Standing(verb=Verb.GOAL, by="crew", name="there", en_m=(100.0, 200.0))},
    )
    shift = shifted(world)
    out = in_water(state, shift)
    assert state.mission.route is not None
    assert len(state.progress.history) > 2
    for old, new in [
        (state.voyage.rest_en_m, out.voyage.rest_en_m),
        (state.position.last_seen.en_m, out.position.last_seen.en_m),
        (state.orders.standing.en_m, out.orders.standing.en_m),
        (state.progress.approaches[0].en_m, out.progress.approaches[0].en_m),
        (state.progress.approaches[0].sweeps[0][1], out.progress.approaches[0].sweeps[0][1]),
        (state.progress.searched[1], out.progress.searched[1]),
        (state.position.doubt.reckoned_en_m, out.position.doubt.reckoned_en_m),
        (state.adrift.places[0].en_m, out.adrift.places[0].en_m),
        (state.progress.history[1][1:3], out.progress.history[1][1:3]),
        *zip(state.mission.route.points_en_m, out.mission.route.points_en_m, strict=True),
        *zip(state.mission.route.leg_from_en_m, out.mission.route.leg_from_en_m, strict=True),
    ]:
        assert math.dist(shift.point(old), new) < 1e-9
    assert math.hypot(*out.adrift.ground_en_mps) == pytest.approx(0.5)
    assert [h[0::3] for h in out.progress.history] == [h[0::3] for h in state.progress.history]
    assert out.mission.route.items == state.mission.route.items


def passage(world, recentre_m=500.0):
    return replace(world.skipper.voyage, recentre_m=recentre_m)


def test_the_water_is_left_when_she_is_far_from_its_origin_and_nothing_is_under_way():
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    frame = world.skipper.voyage.frame
    skipper, far = replace(world.skipper, voyage=passage(world)), frame.geo_from_en(400.0, 301.0)
    assert not world.skipper.leaves_water(world.state, far)  # no passage
    assert skipper.leaves_water(world.state, far)
    assert not skipper.leaves_water(world.state, frame.geo_from_en(400.0, 299.0))
    world.run(3, lambda w: w.state.pending.plan is not None)
    asked = world.state
    assert asked.pending.plan is not None
    assert not skipper.leaves_water(asked, far)  # its answer would come in the metres of this water
    seen = with_parts(world.state, pending={"plan": None}, position={"last_seen": Fix(t_s=0.0, en_m=(400.0, 290.0))})
    assert skipper.leaves_water(seen, far)
    jumped = with_parts(seen, position={"doubt": Fix(t_s=0.0, en_m=(300.0, 0.0))})
    assert not skipper.leaves_water(jumped, far)  # a position that may be false
    assert not skipper.leaves_water(with_parts(seen, position={"last_seen": Fix(t_s=0.0, en_m=(-200.0, 0.0))}), far)


def test_a_saved_state_knows_its_water_and_is_read_in_it():
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    world.run(60)
    home = world.skipper.voyage
    assert world.skipper.persisted(world.state).water == home.frame.origin
    there = replace(passage(world), frame=shifted(world).after)

    def waters(origin: GeoPoint):
        return replace(there, frame=LocalFrame(origin))

    skipper, state = replace(world.skipper, voyage=passage(world)).in_water(there, world.state)
    saved = Persisted.from_dict(skipper.persisted(state).to_dict())
    assert saved.water == there.frame.origin
    again, kept = begun(replace(world.skipper, voyage=passage(world)), saved, waters)
    assert again.voyage.frame == there.frame
    assert kept == saved
    # The mission is no passage any more: the state is brought into its frame.
    plain, brought = begun(world.skipper, saved, None)
    assert plain.voyage.frame == home.frame
    assert brought.water is None
    for place, was in zip(brought.route.points_en_m, world.state.mission.route.points_en_m, strict=True):
        assert math.dist(place, was) < 1e-3


@pytest.mark.parametrize("water", [[91.0, 0.0], [0.0], "x", [0.0, float("nan")], [1e13, 0.0]])
def test_a_water_that_cannot_be_is_not_believed(water):
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    with pytest.raises(ValueError, match=r"damaged|outside|finite"):
        Persisted.from_dict({**world.skipper.persisted(world.state).to_dict(), "water": water})
