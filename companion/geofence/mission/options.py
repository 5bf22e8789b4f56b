"""What a mission TOML may say: one struct per table, every field with its unit and default.

An unknown key is an error (with the nearest known spelling), a missing one takes the default given here.
"""

from __future__ import annotations

import datetime as dt
from typing import TYPE_CHECKING, Annotated, Any, Literal

import msgspec
from msgspec import Meta, Struct

from companion.planners import ALGORITHMS, MissionKey
from companion.safety import CHOICES, ENDINGS, FAILSAFES, SETTINGS, WORD_OF, End, Setting

# ``[[goal]]``: what a mission TOML may say of a goal, one struct per kind. Without ``kind`` it is a point.

Latitude = Annotated[float, Meta(ge=-90.0, le=90.0)]
Longitude = Annotated[float, Meta(ge=-180.0, le=180.0)]


class MarkOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """A mark of a gate."""

    lat: Latitude
    lon: Longitude


class PointOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="point"):
    """``kind = "point"``: a mark to reach, or to round."""

    lat: Latitude
    lon: Longitude
    radius_m: Annotated[float, Meta(gt=0.0, le=5000.0)] = 10.0
    rounding: Literal["port", "starboard"] | None = None
    """Leave the mark to this side of the boat; None: just come within the radius."""
    bandwidth_m: Annotated[float, Meta(gt=0.0)] | None = None
    """Half width of the lane that leads here; None: as ``[skipper] bandwidth_m`` has it."""
    heading_deg: Annotated[float, Meta(ge=0.0, le=360.0)] | None = None
    """``planner = "astar"``: the heading that plans arrive here with; None: nearest to the bearing from their start."""
    name: str = ""


class GateOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="gate"):
    """``kind = "gate"``: two marks to pass between, the port one on the port hand. With a time a start line."""

    port_mark: MarkOptions
    starboard_mark: MarkOptions
    mark_radius_m: Annotated[float, Meta(ge=0.0, le=500.0)] = 5.0
    """What plans keep clear of each mark."""
    not_before: Annotated[dt.datetime, Meta(tz=True)] | None = None
    """The gun of a start line: a crossing before it does not count."""
    after_s: Annotated[float, Meta(gt=0.0, le=1e6)] | None = None
    """The same, counted from setting sail."""
    name: str = ""


class BoxOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="box"):
    """``kind = "box"``: water to stay in, for a time or until told to go on."""

    polygon: str
    """WKT, longitude first (``POLYGON ((-1.31 50.81, ...))``), or a file beside the mission."""
    for_s: Annotated[float, Meta(gt=0.0, le=1e7)] | None = None
    """How long, counted from entry; None: until the order ``go_on``."""
    name: str = ""


class SearchOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="search"):
    """``kind = "search"``: water to be looked at, in sweeps across the wind."""

    polygon: str
    """As for a box."""
    swath_m: Annotated[float, Meta(ge=4.0, le=5000.0)]
    """How wide the strip is that is seen from the track, both sides together."""
    coverage: Annotated[float, Meta(gt=0.0, le=0.99)] = 0.95
    """What share of the free water must be seen; what the sweeps left is sailed again, up to three times."""
    name: str = ""


class FieldOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="field"):
    """``kind = "field"``: sail by a field that is composed of the file's atoms (``[field.NAME]``), in GUIDED."""

    lat: Latitude
    lon: Longitude
    """Where the mission on board leads meanwhile: the boat loiters there when it cannot be steered."""
    field: str
    """The expression: ``ring + 0.5 * islet``."""
    until: Literal["told", "time", "place", "vessel", "outside"] = "told"
    """What ends it: the order ``go_on``; ``for_s`` alone; it is within ``radius_m`` of the place; another vessel is
    inside ``polygon``; the boat itself is outside of it. The order always does."""
    for_s: Annotated[float, Meta(gt=0.0, le=1e7)] | None = None
    """At the longest, counted from when the goal before was reached."""
    radius_m: Annotated[float, Meta(gt=0.0, le=5000.0)] = 10.0
    polygon: str | None = None
    """As for a box: the water that ``until = "vessel"`` and ``"outside"`` speak of."""
    name: str = ""


GoalOptions = PointOptions | GateOptions | BoxOptions | SearchOptions | FieldOptions
KINDS: dict[str, type[GoalOptions]] = {
    "point": PointOptions,
    "gate": GateOptions,
    "box": BoxOptions,
    "search": SearchOptions,
    "field": FieldOptions,
}


def kind_of(goal: GoalOptions) -> str:
    """Return what a goal's ``kind`` says."""
    return next(kind for kind, options in KINDS.items() if isinstance(goal, options))


# ``[field.NAME]``: what a mission TOML may say of an atom of its fields, one struct per kind.

Range = Annotated[float, Meta(ge=1.0, le=5000.0)]
Radius = Annotated[float, Meta(ge=5.0, le=5000.0)]


class PointAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="point"):
    """``kind = "point"``: towards a place from everywhere, weakening within a few metres of it."""

    lat: Latitude
    lon: Longitude
    zone_m: Range = 50.0
    """Half the width of the band about the wind's line through it, in which a beat is sailed."""


class StationAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="station"
):
    """``kind = "station"``: to a place, and about it once it is there: short boards, or loops."""

    lat: Latitude
    lon: Longitude
    zone_m: Range = 15.0


class LineAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="line"):
    """``kind = "line"``: onto the line through two places and along it, from ``start`` towards ``end``."""

    start: MarkOptions
    end: MarkOptions
    zone_m: Range = 50.0
    """From this far off it is made for at 22.5°, from farther at up to 45°; and half the width of a beat along it."""


class CircleAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="circle"):
    """``kind = "circle"``: onto a circle and round it."""

    lat: Latitude
    lon: Longitude
    radius_m: Radius
    turn: Literal["clockwise", "anticlockwise"] = "clockwise"
    zone_m: Range = 50.0
    """Half the width of the ring in which a beat is sailed; a quarter of the radius at the most."""


class RepulsivePointAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="repulsive_point"
):
    """``kind = "repulsive_point"``: away from a place, twice as strong as what leads on, fading with the distance."""

    lat: Latitude
    lon: Longitude
    range_m: Range = 100.0
    """At this distance it has 37 % of its strength, at twice as much 2 %."""


class RepulsiveLineAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="repulsive_line"
):
    """``kind = "repulsive_line"``: away from the endless line through two places, to either side."""

    start: MarkOptions
    end: MarkOptions
    range_m: Range = 100.0


class HeadingAtomOptions(
    Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="heading"
):
    """``kind = "heading"``: the same heading everywhere."""

    heading_deg: Annotated[float, Meta(ge=0.0, le=360.0)]


class LeaveAtomOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True, tag_field="kind", tag="leave"):
    """``kind = "leave"``: out of some water by the heading that is soonest out, clear of vessels."""

    polygon: str
    """WKT, longitude first, or a file beside the mission."""


AtomOptions = (
    PointAtomOptions
    | StationAtomOptions
    | LineAtomOptions
    | CircleAtomOptions
    | RepulsivePointAtomOptions
    | RepulsiveLineAtomOptions
    | HeadingAtomOptions
    | LeaveAtomOptions
)
ATOMS: dict[str, type[AtomOptions]] = {
    "point": PointAtomOptions,
    "station": StationAtomOptions,
    "line": LineAtomOptions,
    "circle": CircleAtomOptions,
    "repulsive_point": RepulsivePointAtomOptions,
    "repulsive_line": RepulsiveLineAtomOptions,
    "heading": HeadingAtomOptions,
    "leave": LeaveAtomOptions,
}


Positive = Annotated[float, Meta(gt=0.0)]
NonNegative = Annotated[float, Meta(ge=0.0)]
Heading = Annotated[float, Meta(ge=0.0, le=360.0)]


class RefugeOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[[refuge]]``: a safe place to wait in, where a critical battery or a voyage out of time leads."""

    lat: Latitude
    lon: Longitude
    radius_m: Annotated[float, Meta(gt=0.0, le=5000.0)] = 15.0
    name: str = ""


class StartOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[start]``: for checks, previews and simulations. The boat itself starts where it is."""

    lat: Latitude
    lon: Longitude
    heading_deg: Heading = 0.0


class AreaOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[area]``: files beside the mission, and the margins to keep from what is in them."""

    obstacles: tuple[str, ...] = ()
    fence: str | None = None
    axis: Literal["auto", "lonlat", "latlon"] = "auto"
    margin_m: Annotated[float, Meta(ge=0.0, le=1000.0)] = 12.0
    """What the plan keeps clear of obstacles and fence."""
    margin_floor_m: Annotated[float, Meta(ge=0.0, le=1000.0)] = 6.0
    """What it may be reduced to, step by step, when there is no way at the full margin."""
    point_radius_m: Annotated[float, Meta(gt=0.0, le=5000.0)] = 10.0
    """The radius of an obstacle that is only a point or a line."""
    under_keel_m: Annotated[float, Meta(ge=0.0, le=50.0)] = 0.5
    """Room under the keel that ``companion chart import`` leaves; less than it by the sounder is told."""
    tide: str | None = None
    """A table of the tide's heights beside the mission: lines of time, metres above the chart's datum; by it what was
    sounded is told below the datum."""
    drying: tuple[str, ...] = ()
    """Files of water that is too shallow at some hours of that table only, each piece with its ``depth_m``."""


class RiskOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[risk]``: the probabilities that a plan must keep."""

    delta_s: Annotated[float, Meta(ge=0.5, lt=1.0)] = 0.9
    """Probability of being outside the no-go zone at each instant."""
    max_path_risk: Annotated[float, Meta(gt=0.0, lt=1.0)] | None = None
    """Bound of the probability of ever being inside it along a plan; None: not bounded."""


class BoatOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[boat]``: what the boat can do."""

    file: str | None = None
    """The boat's own file beside the mission (``companion boat guess``): what is not said here is as it says."""
    polar: str | Positive = "ardurover"
    """``ardurover`` (the simulator's), ``avalon`` (Büsser's eq. 4.1), a polar file beside the mission, or a constant
    speed [m/s]."""
    speed_error_percent: Annotated[float, Meta(ge=0.0, le=60.0)] | None = None
    """How far all speeds of the polar may be off together [%, standard deviation]: arrivals spread by it; None: nobody
    says, and they are taken to be 30 % off."""
    no_go_half_deg: Annotated[float, Meta(ge=0.0, lt=90.0)] = 47.0
    no_go_error_deg: Annotated[float, Meta(ge=0.0, le=15.0)] = 0.0
    """How far that half angle may be off [standard deviation]: it has its share in ``[risk]``, beside the wind's."""
    max_twa_deg: Annotated[float, Meta(gt=90.0, le=180.0)] = 180.0
    turn_rate_deg_s: Annotated[float, Meta(gt=0.0, le=360.0)] = 30.0
    tack_loss_s: NonNegative = 4.0
    gybe_loss_s: NonNegative = 0.0
    can_tack: bool = True
    """False: the boat does not get through the wind's eye; its plans gybe round."""
    gybe_room_m: Positive | None = None
    """Leg to leeward that gybing round needs; None: five turning radii at full speed."""
    length_m: Annotated[float, Meta(gt=0.0, le=100.0)] = 1.0
    beam_m: Annotated[float, Meta(gt=0.0, le=30.0)] = 0.3
    """The hull: what touches, and what vessels are kept clear of. The position is taken to be amidships."""
    draft_m: Annotated[float, Meta(gt=0.0, le=20.0)] | None = None
    """How deep the keel is: what of a chart is too shallow, and what a sounder warns of."""
    transducer_m: Annotated[float, Meta(ge=0.0, le=20.0)] = 0.0
    """The sounder's transducer lies so deep below the water's surface: it tells the depth from there."""
    leeway_deg: Annotated[float, Meta(ge=0.0, le=30.0)] = 0.0
    """How far to leeward of the bow a beat goes: apparent wind 30 degrees off it, three times the boat's speed."""
    max_tws_mps: Positive | None = None
    """The boat is not to be out in more wind than this, with probability ``[risk] delta_s`` at each instant."""
    min_tws_mps: Positive | None = None
    """In less wind than this the boat makes no way; with the same probability."""
    tack_fails: Annotated[float, Meta(ge=0.0, le=0.9)] = 0.03
    """The chance that a tack fails; the voyage's own tacks add to it. 0: tacks are not reckoned to fail."""
    learn: Literal["use", "shadow", "off"] = "use"
    """Whether she is learned under way: plans are of what was learned once it predicts her better than her file."""
    motor: bool = False
    """The boat has an auxiliary motor that the autopilot can run: used when it drifts onto something."""


class WindOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[wind]``: how the wind is estimated, and what previews assume before there is any."""

    estimator: str = "default"
    kalman_window: Annotated[int, Meta(ge=2, le=100_000)] | None = None
    """``estimator = "kalman"``: N of eq. 8, the samples that its spread is taken from."""
    kalman_r_deg: Positive | None = None
    """... and R: the noise of the vane and of the anemometer."""
    kalman_r_mps: Positive | None = None
    preview_from_deg: Heading = 0.0
    preview_speed_mps: Annotated[float, Meta(gt=0.0, le=50.0)] = 5.0


class CurrentOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[current]``: what is known of it before the boat's own track tells; without the table next to nothing is."""

    set_deg: Heading | None = None
    """Where it goes [deg, true]; with ``drift_mps``."""
    drift_mps: Annotated[float, Meta(ge=0.0, le=10.0)] | None = None
    table: str | None = None
    """A file beside the mission in place of both: lines of time, set_deg, drift_mps (docs/reference/current.md)."""
    sigma_mps: Annotated[float, Meta(ge=0.02, le=5.0)] = 0.2
    """How far what is given here may be wrong [m/s, standard deviation in each direction]."""


class OperatorOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[operator]``: what the companion may do uninvited. Nothing is sent to the boat that is not allowed here."""

    arm: bool = False
    set_auto: bool = False
    guided: bool = False
    upload_fence: bool = False
    trim_vane: bool = False
    """Write WNDVN_DIR_OFS where the boat does not sail because its vane is turned, as its own motion tells."""
    replace_foreign: bool = False
    """Overwrite a mission on the autopilot that is not ours, before setting sail; under way somebody else's stays."""
    orders: tuple[str, ...] | str = ()
    """What the crew may order over MAVLink (docs/guides/orders.md): verbs, or ``all``. Asking why is always so."""
    local_orders: tuple[str, ...] | str = ()
    """The same over the socket on board (``companion run --socket``)."""
    far_orders: tuple[str, ...] | str = ()
    """The same over a satellite link (``companion run --far``)."""


def _planner_key(key: MissionKey) -> tuple[str, Any, None]:
    """Return a number of a planner as a field: its key, what it may be; not said it is the planner's default."""
    if key.words:
        return key.key, Literal[key.words] | None, None
    number = Annotated[float, Meta(gt=key.above, ge=key.least, le=key.most, lt=key.below)]
    return key.key, (bool if key.is_flag else number) | None, None


class _Planner(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[planner]``: the numbers of ``[skipper] planner``, from the table of planners; a key of another is refused."""

    expansions: Annotated[int, Meta(gt=0)] | None = None
    """Its effort in its own steps (states taken, samples drawn), in place of the voyage's."""


if TYPE_CHECKING:
    PlannerOptions = _Planner
else:
    PlannerOptions = msgspec.defstruct(
        "PlannerOptions",
        [_planner_key(key) for row in ALGORITHMS.values() for key in row.keys.values()],
        bases=(_Planner,),
        frozen=True,
        forbid_unknown_fields=True,
        kw_only=True,
    )


class PassageOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[passage]``: a voyage farther than 50 km: the local frame moves along with the boat."""

    leg_m: Annotated[float, Meta(gt=0.0, le=1e7)] | None = None
    """The longest leg: a goal farther from the one before, or the start, is a mistake. None: no passage; all goals lie
    within 50 km of the origin."""
    recentre_m: Annotated[float, Meta(ge=500.0, le=25_000.0)] | None = None
    """The frame is replaced when the boat is so far from its origin; None: 10 km."""


class AutopilotOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[autopilot]``: which autopilot is ours."""

    system: Annotated[int, Meta(ge=1, le=255)] | None = None
    """Its MAVLink system id (SYSID_THISMAV); None: the only one that is heard."""
    frame: Literal["sailboat", "motor"] = "sailboat"
    """What it must be: a boat (FRAME_CLASS 2) that sails (SAIL_ENABLE 1), or one that does not."""


if TYPE_CHECKING:
    PlannerName = str
else:
    PlannerName = Literal[tuple(ALGORITHMS)]


class SkipperOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[skipper]``: the rules of the voyage, numbers as data."""

    replan: Literal["waypoint", "forecast"] = "waypoint"
    """At each waypoint, or also when the wind leaves what was forecast."""
    end: Literal["loiter", "home"] = "loiter"
    """After the last goal: loiter there, or plan the way to the autopilot's home and loiter there."""
    autopilot_beats: bool = True
    """Where the water is clear by its corridor, leave the beat to the autopilot: it follows each shift at once."""
    shifts: bool = False
    """On a beat so left, ask the autopilot for a tack where its shifts make one worth it (docs/lab/regret.md)."""
    tacks_per_minute: Annotated[float, Meta(gt=0.0, le=6.0)] = 6.0
    """Of these, at most: as far apart, and from the last that was asked for otherwise."""
    guidance: Literal["plan", "heading", "field"] = "plan"
    """Sail the plan's mission in AUTO; or steer in GUIDED, by the plan's headings or by vector fields.

    GUIDED is for those whom ``[operator] guided`` and ``set_auto`` allow it."""
    station_s: NonNegative = 0.0
    """Stay at the last goal for this long."""
    laps: Annotated[int, Meta(ge=1, le=10_000)] = 1
    bandwidth_m: Positive | None = None
    """Half width of the lane between two goals; None: no lane. A goal may have its own."""
    horizon_m: Annotated[float, Meta(ge=500.0, le=60_000.0)] = 5000.0
    """A plan covers the next so many metres of the way (Büsser: 15 to 20 nautical miles at sea)."""
    planner: PlannerName = "auto"
    """The project's own; or Wolsieffer's RRT*, or Büsser's A*, by the numbers of ``[planner]``. What these do not find
    is planned by ``auto``."""
    planning_budget_s: Annotated[float, Meta(gt=0.0, le=600.0)] = 2.0
    expansions: Annotated[int, Meta(gt=0)] | None = None
    """Plan by this much effort in place of time, so that a voyage repeats; None: by time."""
    seed: Annotated[int, Meta(ge=0)] = 0
    min_replan_s: NonNegative = 10.0
    max_replan_s: Positive | None = None
    """Replan at the latest after this long; None: after 60 minutes."""
    wind_shift_deg: Annotated[float, Meta(gt=0.0, le=180.0)] = 20.0
    """Replan when the mean wind has turned this far from the plan's."""
    off_track_m: Positive = 30.0
    """Replan when the boat is this far from its leg."""
    voyage_timeout_s: Positive | None = None
    """Under way for longer than this the goals are given up: to the nearest refuge, or home, or a loiter near by."""


class _Safety(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[safety]``: what ends a voyage early, and where to; its keys are those of the table (``companion.safety``).

    ``refuge``: the nearest one, without one home if the mission ends there; ``home``; ``stay``: a loiter near by;
    ``say``: words alone. A place to which no way leads is replaced by the next of these. Of a failsafe of the autopilot
    that has stopped it, with ``set_auto``: ``sail_on``, ``stay``, ``refuge``; ``leave``: nothing.
    """

    def end(self, watchdog: str) -> End:
        """Return what is done when this watchdog is raised."""
        return End(getattr(self, ENDINGS[watchdog].key))


def _figure(setting: Setting) -> tuple[str, Any, float | None]:
    """Return a setting as a field: its key, what it may be, and its default."""
    number = Annotated[float, Meta(gt=setting.above, ge=setting.least, le=setting.most)]
    return setting.key, number if setting.default is not None else number | None, setting.default


if TYPE_CHECKING:
    SafetyOptions = _Safety
else:
    SafetyOptions = msgspec.defstruct(
        "SafetyOptions",
        [
            *((ending.key, Literal[tuple(map(str, End))], ending.default.value) for ending in ENDINGS.values()),
            *map(_figure, SETTINGS.values()),
            *((cause.key, Literal[tuple(CHOICES)], WORD_OF[cause.answer]) for cause in FAILSAFES if cause.key),
        ],
        bases=(_Safety,),
        frozen=True,
        forbid_unknown_fields=True,
        kw_only=True,
    )


class TrafficOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[traffic]``: where other vessels are heard, and how far to stay away."""

    feeds: tuple[str, ...] = ()
    """``udpin:HOST:PORT`` (NMEA or JSON), ``tcp:HOST:PORT`` (NMEA), ``/dev/NAME:BAUD``. What the autopilot hears is
    taken without a feed; ``mavlink`` may stand for it."""
    safe_distance_m: Positive = 50.0
    """Plans keep this clear between hulls; an approach nearer than it within ``safe_time_s`` is an alarm."""
    safe_time_s: Positive = 90.0
    drop_after_s: Positive = 600.0
    policy: Literal["keep clear", "rules"] = "keep clear"
    """Keep clear of everyone, whatever the rules of the road give us; or stand on where they say so, and give way
    early, by much and astern where they ask for it."""
    own_mmsi: Annotated[int, Meta(ge=1, le=999_999_999)] | None = None
    """Our own transponder's: what is heard of it, by a receiver on board or by way of a server, is no other vessel."""


class SounderOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[sounder]``: a depth sounder that the companion hears itself, not the autopilot."""

    feed: str | None = None
    """NMEA 0183 with DPT or DBT sentences: ``udpin:HOST:PORT``, ``tcp:HOST:PORT``, ``/dev/NAME:BAUD`` (4800)."""


class OutputOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """``[output]``: other displays that are told of the voyage under way (docs/guides/displays.md)."""

    nmea: tuple[str, ...] = ()
    """NMEA 0183: ``udp:HOST:PORT``, or ``tcp:[HOST:]PORT`` to be a server."""
    signalk: tuple[str, ...] = ()
    """Signal K servers: ``ws://HOST:PORT``, or ``tcp:HOST:PORT``."""
    signalk_token: str | None = None
    """A file beside the mission, of mode 0600, with the token that the server asks for."""


class MissionOptions(Struct, frozen=True, forbid_unknown_fields=True, kw_only=True):
    """The whole file."""

    goal: tuple[GoalOptions, ...] = ()
    name: str | None = None
    description: str = ""
    from_autopilot: bool = False
    """Goals, fence and refuges are those that were drawn and uploaded to the autopilot: there is no ``[[goal]]``."""
    start: StartOptions | None = None
    refuge: tuple[RefugeOptions, ...] = ()
    field: dict[str, AtomOptions] = {}
    """``[field.NAME]``: the atoms of the fields that goals of ``kind = "field"`` are sailed by."""
    area: AreaOptions = AreaOptions()
    risk: RiskOptions = RiskOptions()
    boat: BoatOptions = BoatOptions()
    wind: WindOptions = WindOptions()
    current: CurrentOptions | None = None
    autopilot: AutopilotOptions = AutopilotOptions()
    operator: OperatorOptions = OperatorOptions()
    skipper: SkipperOptions = SkipperOptions()
    planner: PlannerOptions = PlannerOptions()
    passage: PassageOptions = PassageOptions()
    safety: SafetyOptions = SafetyOptions()
    traffic: TrafficOptions = TrafficOptions()
    sounder: SounderOptions = SounderOptions()
    output: OutputOptions = OutputOptions()


def tables() -> dict[str, tuple[str, ...]]:
    """Return the keys of each table, for spelling suggestions: "" is the top level."""
    known = {"": MissionOptions.__struct_fields__}
    for field in msgspec.structs.fields(MissionOptions):
        if isinstance(field.default, Struct):
            known[field.name] = type(field.default).__struct_fields__
    known["goal"] = tuple(dict.fromkeys(key for kind in KINDS.values() for key in ("kind", *kind.__struct_fields__)))
    known["field"] = tuple(dict.fromkeys(key for kind in ATOMS.values() for key in ("kind", *kind.__struct_fields__)))
    known["refuge"] = RefugeOptions.__struct_fields__
    known["start"] = StartOptions.__struct_fields__
    known["current"] = CurrentOptions.__struct_fields__
    return known
