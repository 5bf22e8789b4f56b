"""One moment of a voyage under way, made by hand: a route, a place, a wind, and the step's context of them."""

from __future__ import annotations

import math
from dataclasses import replace

from companion.messages import Command, Mode, waypoint
from companion.skipper.step.context import StepContext
from companion.skipper.step.route import Route
from companion.skipper.step.state import PendingPlan, Phase, Raised
from companion.skipper.way.voyage import Goal
from tests.skipper.world import FRAME, World, forecast, skipper, voyage, with_parts

NOW_S = 1000.0
GOALS = (Goal(en_m=(0.0, 600.0), name="one"), Goal(en_m=(600.0, 600.0), name="two"))


def route(*points, begin=(0.0, 0.0), gate_of=(), **facts) -> Route:
    """Return a route over these points, the last its loiter; asked for a minute ago in a wind from the north."""
    commands = [Command.NAV_WAYPOINT] * (len(points) - 1) + [Command.NAV_LOITER_UNLIM]
    told = {
        "plan_id": 7,
        "plan_t_s": NOW_S - 60.0,
        "plan_twd_from_rad": 0.0,
        "plan_tws_mps": 5.0,
        "plan_half_width_rad": math.radians(8.0),
        "margin_m": 15.0,
        "delta_s": 0.95,
    }
    return Route(
        items=tuple(
            waypoint(FRAME.geo_from_en(*point), command=command)
            for point, command in zip(points, commands, strict=True)
        ),
        points_en_m=points,
        leg_from_en_m=(begin, *points[:-1]),
        gate_of=tuple(gate_of) or (-1,) * len(points),
        **(told | facts),
    )


def asked_for(facts: Route) -> PendingPlan:
    """Return a plan that was asked for now, from the frame's origin."""
    return PendingPlan(
        request_id=9,
        t_s=NOW_S,
        reason=None,
        from_index=None,
        rung=0,
        gate=0,
        lead_in=(),
        start_en_m=(0.0, 0.0),
        facts=facts,
        problem=None,
    )


def raised(*names):
    """Return the watchdogs that are raised."""
    return tuple(Raised(name=name, since_s=NOW_S - 30.0) for name in names)


def moment(
    way=None,
    *,
    goals=GOALS,
    obstacles=(),
    at=(0.0, 0.0),
    heading_deg=90.0,
    speed_mps=2.0,
    twd_deg=0.0,
    tws_mps=5.0,
    mean_deg=None,
    mean_mps=None,
    sigma_deg=3.0,
    up=(),
    seen=None,
    config=None,
    permissions=None,
    state=None,
    **parts,
) -> StepContext:
    """Return the context of a step under way in AUTO on ``way``; ``twd_deg`` is the wind now, ``mean_deg`` its mean.

    ``seen`` replaces parts of the snapshot, ``parts`` of the state (as ``with_parts`` has them).
    """
    made = voyage(*goals, obstacles=obstacles)
    world = World(
        skipper=skipper(made, **(config or {})),
        position=at,
        heading=math.radians(heading_deg),
        speed=speed_mps,
        mode=Mode.AUTO,
        armed=True,
        seq=1,
        t=NOW_S,
        sigma=math.radians(sigma_deg),
    )
    if permissions is not None:
        world.permissions = permissions
    snapshot = world.snapshot()
    mean = math.radians(twd_deg if mean_deg is None else mean_deg)
    strength = tws_mps if mean_mps is None else mean_mps
    wind = replace(
        snapshot.wind,
        forecast=forecast(NOW_S, mean, strength, math.radians(sigma_deg)),
        mean_twd_from_rad=mean,
        mean_tws_mps=strength,
        present_twd_from_rad=math.radians(twd_deg),
        present_tws_mps=tws_mps,
    )
    snapshot = replace(snapshot, **({"wind": wind} | (seen or {})))
    whole = with_parts(
        state or world.state,
        vehicle={"is_ours": True},
        voyage={"sailing": True},
        phase=Phase.STANDARD,
        mission={"route": way},
        alarms={"raised": raised(*up)},
    )
    return StepContext(made, world.skipper.config, with_parts(whole, **parts), snapshot)
