"""A motorboat: nothing waits for a wind, nothing is closed to windward, and what a vane tells steers nothing."""

import math

import pytest
from shapely.geometry import box

from companion.boat import Boat, constant
from companion.field.tree import FieldTree, Round, parse
from companion.mavlink.vehicle_identity import Identity
from companion.messages import Mode
from companion.skipper.rules import Skipper
from companion.skipper.step import actions as act
from companion.skipper.step.config import SkipperConfig
from companion.skipper.step.snapshot import WindEstimate
from companion.skipper.step.state import Phase
from companion.skipper.way import Composed, Until
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import Goal, Voyage
from tests.skipper.world import FRAME, World, area

MOTOR = Boat(polar=constant(2.0), no_go_half_rad=0.0, has_motor=True, turn_rate_radps=0.5)
IDENTITY = Identity(system=1, uid="5a", is_confirmed=True, vehicle_type=11, frame_class=2, sails=False)


def make(*goals, obstacles=(), wind=None, **config):
    voyage = Voyage(name="motor", frame=FRAME, goals=goals, area=area(*obstacles), boat=MOTOR)
    world = World(
        skipper=Skipper(voyage=voyage, config=SkipperConfig(sails=False, **config)),
        identity=IDENTITY,
        expansions=1500,
        no_go=0.0,
    )
    if wind is None:
        world.extra = {"wind": WindEstimate()}  # none was ever told
    return world


def codes(world):
    return {a.code for _, a in world.actions if isinstance(a, act.Announce)}


def test_marks_by_plan_without_a_wind_straight_and_round_a_rock():
    world = make(
        Goal(en_m=(0.0, 200.0), radius_m=6.0),
        Goal(en_m=(200.0, 200.0), radius_m=6.0),
        obstacles=(box(-20.0, 80.0, 20.0, 110.0),),
    )
    assert world.run(400, lambda w: w.state.phase is Phase.DONE)
    assert world.state.progress.reached == (0, 1)
    assert world.clearance() > 6.0
    sailed = sum(math.dist(a, b) for a, b in zip(world.track, world.track[1:], strict=False))
    assert sailed < 470.0  # nothing is beaten
    assert not codes(world) & {"becalmed", "in irons", "wind untrusted", "no progress", "drifting"}


def test_it_is_under_way_at_once():
    world = make(Goal(en_m=(0.0, 200.0), radius_m=6.0))
    assert world.run(15, lambda w: w.state.voyage.sailing)


@pytest.mark.parametrize("guidance", ["ring", "throughout"])
def test_by_field_without_a_wind(guidance):
    from companion.skipper.step.config import Guidance

    tree = FieldTree(
        expression=parse("ring", ("ring",), "", ""), atoms=(("ring", Round(at_en=(0.0, 80.0), radius_m=40.0)),)
    )
    goal = Goal(
        en_m=(0.0, 40.0),
        radius_m=8.0,
        name="ring",
        field=Composed(tree=tree, until=Until.TIME, for_s=200.0) if guidance == "ring" else None,
    )
    world = make(
        goal, Goal(en_m=(0.0, 160.0), radius_m=6.0), guidance=Guidance.PLAN if guidance == "ring" else Guidance.FIELD
    )
    assert world.run(20, lambda w: w.mode is Mode.GUIDED)
    assert world.run(500, lambda w: w.state.phase is Phase.DONE)
    if guidance == "ring":
        steered = [a for _, a in world.actions if isinstance(a, act.SteerHeading)]
        assert any(a.thrust < 1.0 for a in steered)  # slower through turns
        assert any(abs(a.heading_rad) < 0.2 for a in steered)  # north, into where a wind would come from
        assert all(distance_m(p, (0.0, 80.0)) < 50.0 for p in world.track[300:1000])


def test_what_a_vane_tells_steers_nothing():
    blowing, still = make(Goal(en_m=(0.0, 200.0), radius_m=6.0), wind=True), make(Goal(en_m=(0.0, 200.0), radius_m=6.0))
    for world in (blowing, still):
        assert world.run(300, lambda w: w.state.phase is Phase.DONE)
    assert blowing.track == still.track


def test_a_station_of_a_motorboat_is_kept_by_the_autopilots_loiter():
    from companion.skipper.step.config import Guidance

    world = make(Goal(en_m=(0.0, 100.0), radius_m=6.0), guidance=Guidance.FIELD, station_s=60.0)
    assert world.run(300, lambda w: w.state.phase is Phase.HOLDING)
    assert world.run(100, lambda w: w.state.phase is Phase.DONE)
    assert distance_m(world.position, (0.0, 100.0)) < 25.0
