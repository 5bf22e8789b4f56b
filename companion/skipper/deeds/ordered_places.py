"""Where an order to sail somewhere leads, or why it leads nowhere: judged before anything moves."""

from __future__ import annotations

from companion.orders import Place, Wanted, which
from companion.skipper.planning.errands import home_trouble, place_trouble
from companion.skipper.step.turn import Turn
from companion.skipper.way.geometry import distance_m
from companion.skipper.way.voyage import PointEn

Found = tuple[str, PointEn]


def refuge_place(turn: Turn, wanted: Wanted) -> Found | str:
    """Return the refuge's name and place, or what is wrong."""
    refuges = turn.voyage.refuges
    if not refuges:
        return "the mission has no refuge"
    here = turn.boat_en or turn.snapshot.position_en_m
    is_any = not (wanted.name or wanted.mark or wanted.number)
    if is_any and here is not None:
        nearest = min(refuges, key=lambda r: distance_m(here, r.en_m))
        return nearest.name, nearest.en_m
    number = 0 if is_any else which(wanted, [r.name for r in refuges])
    if number is None:
        named = ", ".join(f"{n} {r.name}".rstrip() for n, r in enumerate(refuges, start=1))
        return f"the mission has no such refuge: it has {named}"
    return refuges[number].name, refuges[number].en_m


def home_place(turn: Turn) -> Found | str:
    """Return home, or why there is no way to it."""
    trouble, status = home_trouble(turn), turn.snapshot.autopilot
    if trouble or status is None or status.home is None:
        return trouble or "the autopilot is not heard"
    return "", turn.voyage.frame.en_from_geo(status.home)


def goal_place(turn: Turn, wanted: Wanted) -> Found | str:
    """Return the place that was named, or what is wrong with it."""
    place = wanted.place
    if place is None:
        return "a goal needs a position"
    trouble = _trouble(turn, place)
    if trouble:
        far_m = turn.voyage.far_m
        is_near = not place.swapped.trouble and distance_m(_en(turn, place.swapped), (0.0, 0.0)) <= far_m
        is_far = bool(place.trouble) or distance_m(_en(turn, place), (0.0, 0.0)) > far_m
        return f"{trouble}; latitude and longitude are swapped?" if is_near and is_far else trouble
    return f"{place.lat_deg:.5f} {place.lon_deg:.5f}", _en(turn, place)


def _trouble(turn: Turn, place: Place) -> str:
    return place.trouble or place_trouble(turn, "the place", _en(turn, place))


def _en(turn: Turn, place: Place) -> PointEn:
    return turn.voyage.frame.en_from_geo(place.point)
