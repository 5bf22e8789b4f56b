"""What survives a kill, as values and as plain JSON; a saved state is checked as everything from outside is."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from companion.boat import LearnedAfloat
from companion.mavlink.wire import mission_hash
from companion.messages import GeoPoint, MissionItem, Mode
from companion.orders import BY_VERB, Verb
from companion.skipper.step.latency import KEPT, NO_ANSWERS, PlannerLatency
from companion.skipper.step.route import Route
from companion.skipper.way import Approach, PointEn
from companion.skipper.way.shoals import MOST_RADIUS_M, MOST_SHOALS, Shoal

FORMAT = 1
MAX_ITEMS = 2000  # no autopilot holds more
MAX_GOALS = 10**6
MAX_POINTS = 20_000  # of the track of a search
MAX_TACKS = 10**6
MOST_M = 2.1e7  # to any place on Earth
MAX_QUARTERS = 10**6  # turns round one buoy
MOST_IRONS_S = 60.0  # more is a lull that the boat waited in: no room of a tack would be enough ever after
MOST_LEE_MPS = 1.0  # more is a position that has jumped
NO_FAILED_TACK = (0.0, 0.0, 0.0)
NOTHING_LEARNED = LearnedAfloat()
_NUMBERS = (
    "plan_t_s",
    "plan_twd_from_rad",
    "plan_tws_mps",
    "plan_half_width_rad",
    "margin_m",
    "delta_s",
    "vessel_risk",
    "vessels_part",
    "plan_current_east_mps",
    "plan_current_north_mps",
)
_MAYBE = ("risk", "cost_s", "median_s", "late_s", "expected_clearance_m", "planned_clearance_m")
_WORDS = ("rung", "why", "bound_for")
# of states that were saved before there were any
_DEFAULTS: dict[str, Any] = {
    "vessel_risk": 0.0,
    "vessels_part": 0.0,
    "plan_current_east_mps": 0.0,
    "plan_current_north_mps": 0.0,
    "bound_for": "",
    "expected_clearance_m": None,
    "planned_clearance_m": None,
    "median_s": None,
    "late_s": None,
}


# ------------------- The order that stands: what the boat was told to do until it is told to go on.


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """One order that stands.

    Attributes:
        verb: what.
        by: who asked, in words.
        name: of the refuge, or of the place in words.
        en_m: where, for a goal.
        since_s: since when, in this life of the companion; None: it was taken over from before and not yet counted.
        before_s: how long it stood before that [s].
    """

    verb: Verb
    by: str
    name: str = ""
    en_m: PointEn | None = None
    since_s: float | None = None
    before_s: float = 0.0

    def age_s(self, t_s: float) -> float:
        """Return how long it has stood [s]."""
        return self.before_s + (0.0 if self.since_s is None else max(0.0, t_s - self.since_s))

    @property
    def words(self) -> str:
        """The order as it is spoken of."""
        return f"{self.verb}{f' {self.name}' if self.name else ''}"

    @property
    def why(self) -> str:
        """By whom, as a reason."""
        return f"ordered by {self.by}"


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedPlace:
    """Where the boat was at ``utc_s``, by the autopilot's clock: as it was believed, or reckoned while it was not.

    ``velocity_en_mps``: as it was told then [m/s]; ``farthest_m``: how far off that place the doubted position was at
    the most; 0: it was believed.
    """

    utc_s: float
    en_m: tuple[float, float]
    error_m: float = 0.0
    farthest_m: float = 0.0
    velocity_en_mps: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class SavedGoal:
    """A goal as it is known again after a restart: where it is, and what is done there."""

    place: GeoPoint
    kind: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Persisted:
    """What survives a kill: written whenever it changes, before the actions of the step are carried out.

    ``route``, ``pending`` and ``unsure`` are every list that may be on the autopilot: the one that was there last, the
    one whose upload is under way, and one whose upload failed before that.
    """

    voyage: str
    gate: int
    sailing: bool
    route: Route | None
    pending: Route | None
    unsure: Route | None = None
    own_mode: Mode | None = None  # the boat was steered by us in this mode: it is ours to hand back
    motor: bool = False  # it was run by us: ours to switch off
    under_way_s: float = 0.0  # how long the voyage has been under way, in whole minutes
    arrived: bool = False  # nothing is left to sail, the way home included
    uid: str | None = None  # of the autopilot, and ...
    system: int | None = None  # ... its system id
    approaches: tuple[Approach, ...] = ()  # the numbering of the gates hangs on them
    quarters: int = 0  # ``bearing_rad`` in quarter turns: the place afterwards says the rest
    standing: Standing | None = None  # the order that stands
    reached: tuple[int, ...] = ()  # goals reached, in order
    skipped: int = 0  # goals given up: by order, and boxes that she could not stay in
    set_sail_utc_s: float | None = None  # Unix time of setting sail
    inside: tuple[int, float] | None = None  # the goal whose box the boat stays in, Unix time of entry
    station_utc_s: float | None = None  # Unix time of the beginning of her stay at the last goal
    searched: tuple[tuple[float, float], ...] = ()  # the track of the search that is next
    covered: tuple[tuple[int, float], ...] = ()  # goals searched, and the share that was seen
    tacks: tuple[int, int] = (0, 0)  # tried, and of these failed
    irons_s: float = 0.0  # the longest that she has lain in one that failed, and ...
    lee_mps: tuple[float, float] = (0.0, 0.0)  # ... the fastest that she was set then, on starboard tack and on port
    place: SavedPlace | None = None  # where the boat was
    latency: PlannerLatency = NO_ANSWERS  # of the planner on this computer
    shoals: tuple[Shoal, ...] = ()  # that were sounded
    afloat: LearnedAfloat = NOTHING_LEARNED  # what is known of the boat from this voyage
    water: GeoPoint | None = None  # the origin of all metres here; None: the mission's
    goals: tuple[SavedGoal, ...] = ()  # of the mission as it was then; none: it was not saved
    laps: int = 1  # ... and how often they are sailed
    leg: int = 0  # which of the goals of all laps was sailed to, from 0

    @property
    def lists(self) -> tuple[Route, ...]:
        """Every list that may be on the autopilot."""
        return tuple(r for r in (self.route, self.pending, self.unsure) if r is not None)

    @property
    def names(self) -> tuple[str, ...]:
        """The same by their hashes (``companion.mavlink.wire.items.mission_hash``)."""
        return tuple(dict.fromkeys(mission_hash(route.items) for route in self.lists))

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        return {
            "format": FORMAT,
            "voyage": self.voyage,
            "gate": self.gate,
            "sailing": self.sailing,
            "route": _route_to_dict(self.route),
            "pending": _route_to_dict(self.pending),
            "unsure": _route_to_dict(self.unsure),
            "own_mode": None if self.own_mode is None else self.own_mode.name,
            "motor": self.motor,
            "under_way_s": self.under_way_s,
            "arrived": self.arrived,
            "uid": self.uid,
            "system": self.system,
            "approaches": [_approach_to_list(a) for a in self.approaches],
            "quarters": self.quarters,
            "standing": _standing_to_dict(self.standing),
            "reached": list(self.reached),
            "skipped": self.skipped,
            "set_sail_utc_s": self.set_sail_utc_s,
            "inside": None if self.inside is None else list(self.inside),
            "station_utc_s": self.station_utc_s,
            "searched": [list(p) for p in self.searched],
            "covered": [list(c) for c in self.covered],
            "tacks": list(self.tacks),
            "failed_tack": [self.irons_s, *self.lee_mps],
            "place": _place_to_list(self.place),
            "latency": [list(self.latency.answers_s), self.latency.room_s, self.latency.speed],
            **({"shoals": [_shoal_to_list(s) for s in self.shoals]} if self.shoals else {}),
            **({} if self.afloat == NOTHING_LEARNED else {"afloat": self.afloat.to_dict()}),
            **({} if self.water is None else {"water": _geo_to_list(self.water)}),
            **({} if not self.goals else {"goals": [[*_geo_to_list(g.place), g.kind] for g in self.goals]}),
            "laps": self.laps,
            "leg": self.leg,
        }

    @classmethod
    def from_dict(cls, data: Any) -> Persisted:
        """Read ``to_dict``'s result.

        Raises:
            ValueError: it cannot be believed, whatever is wrong with it.
        """
        try:
            if data["format"] != FORMAT:
                raise ValueError(f"its format is {str(data['format'])[:20]}, not {FORMAT}")
            return cls(
                voyage=_words(data["voyage"]),
                gate=_whole(data["gate"], 0, 10**9),
                sailing=_truth(data["sailing"]),
                route=_route_from_dict(data["route"]),
                pending=_route_from_dict(data["pending"]),
                unsure=_route_from_dict(data.get("unsure")),
                own_mode=None if data.get("own_mode") is None else Mode[data["own_mode"]],
                motor=_truth(data.get("motor", False)),
                under_way_s=_number(data.get("under_way_s", 0.0)),
                arrived=_truth(data.get("arrived", False)),
                uid=None if data.get("uid") is None else _words(data["uid"]),
                system=None if data.get("system") is None else _whole(data["system"], 1, 255),
                approaches=tuple(_approach_from_list(a) for a in data.get("approaches", ())[: MAX_GOALS + 1]),
                quarters=_whole(data.get("quarters", 0), -MAX_QUARTERS, MAX_QUARTERS),
                standing=_standing_from_dict(data.get("standing")),
                reached=tuple(_whole(g, 0, MAX_GOALS) for g in data.get("reached", ())[:MAX_GOALS]),
                skipped=_whole(data.get("skipped", 0), 0, MAX_GOALS),
                set_sail_utc_s=None if data.get("set_sail_utc_s") is None else _number(data["set_sail_utc_s"]),
                inside=None
                if data.get("inside") is None
                else (_whole(data["inside"][0], 0, MAX_GOALS), _number(data["inside"][1])),
                station_utc_s=None if data.get("station_utc_s") is None else _number(data["station_utc_s"]),
                searched=tuple((_metres(e), _metres(n)) for e, n in data.get("searched", ())[:MAX_POINTS]),
                covered=tuple((_whole(g, 0, MAX_GOALS), _number(s)) for g, s in data.get("covered", ())[:MAX_GOALS]),
                tacks=_tacks(data.get("tacks", (0, 0))),
                irons_s=_within(data.get("failed_tack", NO_FAILED_TACK)[0], MOST_IRONS_S),
                lee_mps=_lee(data.get("failed_tack", NO_FAILED_TACK)),
                place=_place_from_list(data.get("place")),
                latency=_latency(data.get("latency")),
                shoals=tuple(_shoal_from_list(s) for s in data.get("shoals", ())[-MOST_SHOALS:]),
                afloat=NOTHING_LEARNED if data.get("afloat") is None else LearnedAfloat.from_dict(data["afloat"]),
                water=None if data.get("water") is None else _geo_from_list(data["water"]),
                goals=tuple(
                    SavedGoal(place=_geo_from_list(goal), kind=_words(goal[2]))
                    for goal in data.get("goals", ())[:MAX_GOALS]
                ),
                laps=_whole(data.get("laps", 1), 1, MAX_GOALS),
                leg=_whole(data.get("leg", 0), 0, MAX_GOALS),
            )
        except (KeyError, TypeError, IndexError, AttributeError, OverflowError, RecursionError) as error:
            raise ValueError(f"it is damaged: {str(error)[:80] or type(error).__name__}") from error


def _geo_to_list(place: GeoPoint) -> list[float]:
    return [place.lat_deg, place.lon_deg]


def _geo_from_list(data: Any) -> GeoPoint:
    lat_deg, lon_deg = _number(data[0]), _number(data[1])
    if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
        raise ValueError(f"it is damaged: {lat_deg:g}, {lon_deg:g} where a place should be")
    return GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg)


def _latency(data: Any) -> PlannerLatency:
    if data is None:
        return NO_ANSWERS
    answers, room, speed = data
    return PlannerLatency(
        answers_s=tuple(max(0.0, _number(s)) for s in answers[-KEPT:]),
        room_s=max(0.0, _number(room)),
        speed=None if speed is None else max(0.0, _number(speed)),
    )


def _place_to_list(place: SavedPlace | None) -> list[float] | None:
    return (
        None if place is None else [place.utc_s, *place.en_m, place.error_m, place.farthest_m, *place.velocity_en_mps]
    )


def _place_from_list(data: Any) -> SavedPlace | None:
    if data is None:
        return None
    utc_s, east, north, error_m, farthest_m, *velocity = (_number(value) for value in data[:7])
    east_mps, north_mps = velocity or (0.0, 0.0)  # of states that were saved before there was any
    return SavedPlace(
        utc_s=utc_s,
        en_m=(_metres(east), _metres(north)),
        error_m=abs(_metres(error_m)),
        farthest_m=abs(_metres(farthest_m)),
        velocity_en_mps=(east_mps, north_mps),
    )


def _shoal_to_list(shoal: Shoal) -> list[float]:
    tide = [] if shoal.tide_m is None else [shoal.tide_m]
    return [*shoal.en_m, shoal.radius_m, shoal.doubt_m, shoal.depth_m, *tide]


def _shoal_from_list(data: Any) -> Shoal:
    east, north, radius_m, doubt_m, depth_m, *tide = (_number(value) for value in data)
    if len(tide) > 1:
        raise ValueError("it is damaged: a shoal with two tides")
    if not (0.0 < radius_m <= MOST_RADIUS_M and 0.0 <= doubt_m <= MOST_RADIUS_M):
        raise ValueError("it is damaged: a shoal of no size")
    tide_m = tide[0] if tide else None
    return Shoal(
        en_m=(_metres(east), _metres(north)), radius_m=radius_m, doubt_m=doubt_m, depth_m=depth_m, tide_m=tide_m
    )


def _approach_to_list(approach: Approach) -> list[Any]:
    """Return an approach as it is saved: the sweeps of a search behind the rest, where there are any."""
    out: list[Any] = [approach.goal, *approach.en_m, approach.turn_rad]
    if approach.round > 0:
        out += [[[*a, *b] for a, b in approach.sweeps], approach.twd_from_rad, approach.round]
    return out


def _approach_from_list(data: list[Any]) -> Approach:
    goal, e, n, turn, *laid = data
    approach = Approach(
        goal=_whole(goal, 0, MAX_GOALS), en_m=(_metres(e), _metres(n)), turn_rad=None if turn is None else _number(turn)
    )
    if not laid:
        return approach
    sweeps, twd_from_rad, count = laid
    return replace(
        approach,
        twd_from_rad=_number(twd_from_rad),
        round=_whole(count, 1, MAX_GOALS),
        sweeps=tuple(((_metres(a), _metres(b)), (_metres(c), _metres(d))) for a, b, c, d in sweeps[:MAX_POINTS]),
    )


def _standing_to_dict(order: Standing | None) -> dict[str, Any] | None:
    if order is None:
        return None
    return {
        "verb": order.verb.value,
        "by": order.by,
        "name": order.name,
        "before_s": order.before_s,
        "en_m": None if order.en_m is None else list(order.en_m),
    }


def _standing_from_dict(data: dict[str, Any] | None) -> Standing | None:
    if data is None:
        return None
    verb, place = Verb(data["verb"]), data["en_m"]
    en_m = None if place is None else (_metres(place[0]), _metres(place[1]))
    if not BY_VERB[verb].stands or (en_m is None and verb not in {Verb.HOLD, Verb.STOP}):
        raise ValueError(f"it is damaged: no order stands as {verb}")
    return Standing(
        verb=verb, by=_words(data["by"]), name=_words(data["name"]), en_m=en_m, before_s=_number(data["before_s"])
    )


def _route_to_dict(route: Route | None) -> dict[str, Any] | None:
    if route is None:
        return None
    return {
        "items": [[m.command, m.lat_e7, m.lon_e7, m.alt_m, m.frame, list(m.params)] for m in route.items],
        "points": [list(p) for p in route.points_en_m],
        "from": [list(p) for p in route.leg_from_en_m],
        "gates": list(route.gate_of),
        **{name: getattr(route, name) for name in ("plan_id", *_NUMBERS, *_MAYBE, *_WORDS)},
    }


def _route_from_dict(data: dict[str, Any] | None) -> Route | None:
    if data is None:
        return None
    items = tuple(
        MissionItem(
            command=_whole(c, 0, 0xFFFF),
            lat_e7=_whole(lat, -(10**9), 10**9),
            lon_e7=_whole(lon, -2 * 10**9, 2 * 10**9),
            alt_m=_number(alt),
            frame=_whole(frame, 0, 255),
            params=(_number(p[0]), _number(p[1]), _number(p[2]), _number(p[3])),
        )
        for c, lat, lon, alt, frame, p in data["items"][: MAX_ITEMS + 1]
    )
    points = tuple((_metres(e), _metres(n)) for e, n in data["points"])
    starts = tuple((_metres(e), _metres(n)) for e, n in data["from"])
    gates = tuple(_whole(g, -1, 10**9) for g in data["gates"])
    if not 0 < len(items) == len(points) == len(starts) == len(gates) <= MAX_ITEMS:
        raise ValueError("it is damaged: its lists differ in length")
    values = {**_DEFAULTS, **data}
    figures: dict[str, Any] = {
        **{name: _number(values[name]) for name in _NUMBERS},
        **{name: None if values[name] is None else _number(values[name]) for name in _MAYBE},
        **{name: _words(values[name]) for name in _WORDS},
    }
    return Route(
        items=items,
        points_en_m=points,
        leg_from_en_m=starts,
        gate_of=gates,
        plan_id=_whole(data["plan_id"], -1, 10**12),
        **figures,
    )


def _tacks(data: Any) -> tuple[int, int]:
    tried = _whole(data[0], 0, MAX_TACKS)
    return tried, _whole(data[1], 0, tried)


def _lee(data: Any) -> tuple[float, float]:
    return _within(data[1], MOST_LEE_MPS), _within(data[2], MOST_LEE_MPS)


def _within(value: Any, most: float) -> float:
    return min(max(_number(value), 0.0), most)


def _number(value: Any) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value) or abs(value) > 1e12:
        raise ValueError(f"it is damaged: {str(value)[:20]} where a number should be")
    return float(value)


def _metres(value: Any) -> float:
    """Return metres of a place: none is farther than half way round the Earth."""
    number = _number(value)
    if abs(number) > MOST_M:
        raise ValueError(f"it is damaged: {number:g} m where a place should be")
    return number


def _whole(value: Any, low: int, high: int) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not low <= value <= high:
        raise ValueError(f"it is damaged: {str(value)[:20]} where a whole number should be")
    return value


def _truth(value: Any) -> bool:
    if not isinstance(value, bool):
        raise TypeError(f"{str(value)[:20]} where true or false should be")
    return value


def _words(value: Any) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{str(value)[:20]} where words should be")
    return value
