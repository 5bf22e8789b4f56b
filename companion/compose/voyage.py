"""A mission's voyage: its goals, area and boat in a local frame."""

from __future__ import annotations

from companion.compose.boat import boat_of
from companion.compose.fields import composed_of
from companion.fold import Waters
from companion.geo.frame import LocalFrame
from companion.geofence import LocalArea, Mission
from companion.geofence.mission import Gate, free_water
from companion.geofence.shapes import polygon_en
from companion.messages import GeoPoint
from companion.skipper.way import FAR_M, Box, Goal, Line, Refuge, Search, Side, Voyage

# A passage: how far the boat sails in one frame, and what of the area is in it: a plan may go aside as far as ahead.
RECENTRE_M = 10_000.0
HORIZONS, BEYOND_M = 1.5, 10_000.0

_SIDES = {None: Side.NONE, "port": Side.PORT, "starboard": Side.STARBOARD}


def voyage_of(mission: Mission) -> Voyage:
    """Return the voyage in the mission's local frame, with its whole area."""
    return _voyage_in(mission, mission.frame(), mission.water())


def waters_of(mission: Mission) -> Waters | None:
    """Return what makes a passage's voyage about a place, with the area that a plan from there can meet; None: none."""
    if not mission.is_passage:
        return None
    reach_m = (mission.passage.recentre_m or RECENTRE_M) + HORIZONS * mission.skipper.horizon_m + BEYOND_M

    def about(origin: GeoPoint) -> Voyage:
        frame = LocalFrame(origin)
        return _voyage_in(mission, frame, mission.area.about(frame, reach_m))

    return about


def _voyage_in(mission: Mission, frame: LocalFrame, area: LocalArea) -> Voyage:
    goals = tuple(
        Goal(
            en_m=frame.en_from_geo(g.point), radius_m=g.radius_m, name=g.name, side=_SIDES[g.rounding],
            rounding_m=max(g.radius_m, mission.margin_m) if g.rounding else 12.0,
            bandwidth_m=mission.skipper.bandwidth_m if g.bandwidth_m is None else g.bandwidth_m,
            line=_line(g.gate, frame),
            box=None if g.box is None else Box(
                area_en=polygon_en(g.box.shape, frame, cover=False), for_s=g.box.for_s),
            search=None if g.search is None else Search(
                area_en=free_water(g.search.shape, frame, mission.area), swath_m=g.search.swath_m,
                coverage=g.search.coverage),
            field=None if g.field is None else composed_of(mission, number, g.field, frame),
        )
        for number, g in enumerate(mission.goals, start=1)
    )
    return Voyage(
        name=mission.name, frame=frame, goals=goals, area=area, boat=boat_of(mission),
        laps=mission.skipper.laps,
        refuges=tuple(
            Refuge(name=r.name, en_m=frame.en_from_geo(r.point), radius_m=r.radius_m) for r in mission.refuges),
        recentre_m=(mission.passage.recentre_m or RECENTRE_M) if mission.is_passage else None,
        far_m=max(FAR_M, mission.passage.leg_m or 0.0),
    )


def _line(gate: Gate | None, frame: LocalFrame) -> Line | None:
    if gate is None:
        return None
    return Line(
        port_en_m=frame.en_from_geo(gate.port), starboard_en_m=frame.en_from_geo(gate.starboard), keep_m=gate.keep_m,
        not_before_s=gate.not_before_s, after_s=gate.after_s)
