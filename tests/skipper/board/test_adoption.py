"""Adopting what somebody has drawn: asked for where it can be, refused with the reason where not."""

from dataclasses import replace

from companion.messages import GeoPoint, waypoint
from companion.skipper import Skipper
from companion.skipper.board.on_board import adopt
from companion.skipper.step import AdoptDrawing, SkipperConfig
from companion.skipper.step.context import StepContext
from companion.skipper.way import Goal
from tests.skipper.world import World, voyage, with_parts

DRAWN = (waypoint(GeoPoint(lat_deg=50.81, lon_deg=-1.31)),)


def asked(*, adopts=True, **changes):
    skipper = Skipper(voyage=voyage(Goal(en_m=(0.0, 100.0))), config=SkipperConfig(adopts=adopts))
    world = World(skipper=skipper)
    ctx = StepContext(skipper.voyage, skipper.config, with_parts(skipper.initial(), mission=changes), world.snapshot())
    return adopt(ctx), ctx.actions


def test_what_is_drawn_is_asked_for():
    trouble, actions = asked(foreign="not ours", read_items=DRAWN)
    assert trouble == ""
    assert actions == [AdoptDrawing(text="the mission of 1 item that was drawn is adopted")]


def test_what_is_not_on_offer_is_refused_with_its_reason():
    for trouble, actions in (asked(), asked(read_items=DRAWN)):
        assert (trouble, actions) == ("nothing drawn is on offer", [])
    trouble, actions = asked(foreign="not ours", read_items=DRAWN, adopts=False)
    assert "start companion run --from-autopilot" in trouble
    assert actions == []
    trouble, actions = asked(foreign="not ours", read_items=(*DRAWN, replace(DRAWN[0], command=178)))
    assert "item 2: DO_CHANGE_SPEED is nothing that a voyage does" in trouble
    assert actions == []
