"""What the skipper may do and when it acts: permissions and thresholds as data.

Nothing here is read from a file: the application builds one ``SkipperConfig`` from the mission. Every number has
its unit in its name and its reason beside it.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from companion.boat import AutopilotLimits, Boat
from companion.current import TideTable
from companion.orders import ALL
from companion.planners import AUTO, PlannerChoice
from companion.safety import CAUSES, CHOICES, ENDINGS, SETTINGS, End, Recovery
from companion.traffic import Policy


class ReplanPolicy(enum.Enum):
    """When a new plan is made at a waypoint."""

    WAYPOINT = "waypoint"  # at every waypoint, from the next one (Wolsieffer 2020, section VI)
    FORECAST = "forecast"  # only when the forecast, its spread included, has changed enough to matter


class Guidance(enum.Enum):
    """What steers the boat."""

    PLAN = "plan"  # the mission, in AUTO
    HEADING = "heading"  # the plan's headings, in GUIDED (Büsser's own interface)
    FIELD = "field"  # vector fields, in GUIDED; the mission on board is what is left when we are gone


class Learning(enum.Enum):
    """Whether the boat is learned under way (``companion.boat.afloat``)."""

    USE = "use"  # and plans are of what was learned, once it has predicted her better than her file for an hour
    SHADOW = "shadow"  # it is told and kept, and plans are of her file
    OFF = "off"


class SafeEnd(enum.Enum):
    """How the voyage ends. Every mission ends in a NAV_LOITER_UNLIM; none in RTL, whose way nobody looks at."""

    LOITER = "loiter"  # at the last goal, or near it at a place with room to leeward
    RETURN = "return"  # at home, the way there planned like any other


@dataclass(frozen=True, slots=True)
class Ends:
    """What the mission's ``[safety]`` says, as pairs of key and value; what it does not say is as the table has it."""

    said: tuple[tuple[str, str | float | None], ...] = ()

    @classmethod
    def of(cls, **said: str | float | None) -> Ends:
        """Return what these keys of ``[safety]`` say."""
        return cls(tuple(said.items()))

    def end(self, watchdog: str) -> End:
        """Return what is done when a watchdog that ends a voyage early is raised.

        Raises:
            KeyError: it is none of these.
        """
        ending = ENDINGS[watchdog]
        return End(str(dict(self.said).get(ending.key, ending.default)))

    def figure(self, key: str) -> float | None:
        """Return a figure of ``[safety]`` in the unit of its key, None: it is not asked for."""
        value = dict(self.said).get(key, SETTINGS[key].default)
        return None if value is None else float(value)

    def answer(self, cause: str) -> Recovery | None:
        """Return what is done about a stop by this cause, None: it is nobody's failsafe."""
        known = CAUSES.get(cause)
        return None if known is None else CHOICES.get(str(dict(self.said).get(known.key)), known.answer)


@dataclass(frozen=True, slots=True, kw_only=True)
class Permissions:
    """What the operator allows. The default is a dry run: look, plan, speak, touch nothing."""

    may_upload: bool = False  # put missions on the autopilot
    may_upload_fence: bool = False
    may_arm: bool = False
    may_set_mode: bool = False  # AUTO to begin with, and the modes of the watchdogs
    may_steer: bool = False  # GUIDED headings (out of irons, buoys by heading)
    may_trim_vane: bool = False  # write WNDVN_DIR_OFS
    may_replace_foreign: bool = False  # a mission that is not ours may be overwritten before setting sail
    orders: tuple[str, ...] = ()  # verbs that the crew may give by MAVLink, or "all" (``companion.orders``)
    local_orders: tuple[str, ...] = ()  # ... over the socket on board
    far_orders: tuple[str, ...] = ()  # ... over the satellite link
    # what is to be changed for a mission to be put on the autopilot, where it may not be
    to_upload: str = "[operator] set_auto = true in the mission, and no --dry-run"


DRY_RUN = Permissions()
ALL_PERMITTED = Permissions(
    may_upload=True, may_upload_fence=True, may_arm=True, may_set_mode=True, may_steer=True, orders=(ALL,)
)


@dataclass(frozen=True, slots=True, kw_only=True)
class SkipperConfig:
    """Thresholds of the rules. Watchdog thresholds are in ``companion.safety``."""

    sails: bool = True  # False: a motor boat is what the mission asks for
    # planning
    delta_s: float = 0.95
    max_path_risk: float | None = None  # of ever being forced into the no-go zone along a plan; None: not bounded
    delta_s_ladder: tuple[float, ...] = (0.90, 0.80, 0.66)  # tried in this order when nothing is found
    margin_m: float = 15.0  # >= 15 m at 3 m/s: a breach coasts 6 to 10 m (ardurover notes, fence)
    margin_floor_m: float = 8.0  # never planned closer than this, whatever the ladder
    tide: TideTable | None = None  # of the water, where the mission has a table
    least_depth_m: float | None = None  # that a sounder may tell: the keel and the room under it; None: not watched
    margin_ladder: tuple[float, ...] = (0.75, 0.5)  # share of margin - floor that is left
    planner: PlannerChoice = AUTO  # by which algorithm; what it does not find is planned by ``auto``
    plan_budget_s: float = 1.0
    first_plan_budget_s: float = 2.0
    plan_timeout_s: float = 20.0  # no answer from the planner: the request is counted as failed
    no_go_half_rad: float = 0.785398  # SAIL_NO_GO_ANGLE 45 deg
    tack_corridor_m: float = 10.0  # SAIL_XTRACK_MAX, its default, until it has been read
    autopilot_beats: bool = True  # where the water is clear by its corridor the autopilot beats by itself
    shifts: bool = False  # there it is asked for a tack where the wind's shifts make one worth it
    shift_tacks_apart_s: float = 10.0  # ... and no sooner after the last that was asked for
    no_go_pad_rad: float = 0.034907  # legs at least 2 deg outside: then the autopilot adds no tacks of its own
    replan_policy: ReplanPolicy = ReplanPolicy.WAYPOINT
    announce_m: float = 5.0  # the autopilot announces a waypoint 3 to 5 m early
    lead_s: float = 12.0  # the new tail is asked for this long before the waypoint
    keep_gain: float = 0.02  # a sound old tail stays unless the new one is at least 2 % faster
    keep_gain_s: float = 2.0  # ... and at least this much
    horizon_m: float = 5000.0  # the local plan covers the next few miles only (Büsser 4)
    # Büsser's skipper, section 3.2.1
    wind_change_rad: float = 0.349066  # 20 deg
    wind_change_level: float = 0.80  # ... and outside this interval of the forecast that the plan used
    plan_age_s: float = 3600.0
    grid_size_m: float = 20.0
    manoeuvre_m: float = 3.0  # D_maneuver
    buoy_angle_rad: float = 0.523599  # 30 deg, experimentally his
    traffic_clearance_m: float = 50.0  # between hulls, beyond what is not known of where a vessel will be
    traffic_time_s: float = 90.0  # an approach within that distance and this time is an alarm
    traffic_policy: Policy = Policy.KEEP_CLEAR
    # uploads
    settle_s: float = 5.0  # a mode or sequence number that was asked for shows within this
    reread_s: float = 300.0  # the mission on board is read again this often
    upload_timeout_s: float = 60.0  # no outcome: counted as failed, the mission on the autopilot unknown
    read_timeout_s: float = 180.0  # a hundred items one by one, where every second message is lost
    # Then the numbering starts again: a transfer takes 7 ms an item, and the smallest board holds 655.
    max_items: int = 200
    safe_end: SafeEnd = SafeEnd.LOITER
    loiter_radius_m: float = 15.0  # how far from its place a loiter takes her, at the least (``loiter_swing_m``)
    # patience
    min_replan_interval_s: float = 20.0  # Büsser 5.2: never a new plan more often than every 20 s
    no_go_patience_s: float = 4.0  # the present wind must close the leg for this long ...
    no_go_off_leg_m: float = 4.0  # ... and take the boat this far off it, or below the margin's floor
    no_go_replan_interval_s: float = 8.0  # a leg that became unsailable is more urgent
    look_ahead_s: float = 40.0  # the mission reaches at least this far ahead while goals remain
    command_timeout_s: float = 10.0
    backoff_first_s: float = 10.0
    backoff_factor: float = 2.0
    backoff_max_s: float = 300.0
    announce_interval_s: float = 30.0  # the same sentence is not said again sooner
    wind_settle_s: float = 30.0  # wind is believed after this long at the start
    # Steered in GUIDED the mission is on board all the same, its count kept in step; but a companion that dies leaves a
    # boat that loiters where it is.
    guidance: Guidance = Guidance.PLAN
    learn: Learning = Learning.USE
    station_s: float = 0.0  # how long to stay at the last goal
    adopts: bool = False  # the goals were drawn on the autopilot: others may be, under way
    ends: Ends = Ends()
    voyage_timeout_s: float | None = None  # under way for longer than this the goals are given up; None: never

    def autopilot_no_go_rad(self, limits: AutopilotLimits | None) -> float:
        """Return where the autopilot stops following the line: SAIL_NO_GO_ANGLE; nowhere where it does not sail."""
        if not self.sails:
            return 0.0
        return self.no_go_half_rad if limits is None else limits.sail_no_go_angle_rad

    def planned_no_go_rad(self, boat: Boat, limits: AutopilotLimits | None) -> float:
        """Return the half angle that plans keep out of, before it is widened by what is not known of the wind."""
        if not self.sails:
            return 0.0
        return max(self.autopilot_no_go_rad(limits) + self.no_go_pad_rad, boat.no_go_half_rad)

    def is_watched(self, watchdog: str, boat: Boat) -> bool:
        """Return whether the mission has the key without which this one is not (``Ending.asked_by``)."""
        ending = ENDINGS.get(watchdog)
        if ending is None or not ending.asked_by:
            return True
        elsewhere = {
            "voyage_timeout_s": self.voyage_timeout_s,
            "max_tws_mps": boat.max_tws_mps,
            "min_tws_mps": boat.min_tws_mps,
        }
        key = ending.asked_by
        return (elsewhere[key] if key in elsewhere else self.ends.figure(key)) is not None
