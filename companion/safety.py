"""Safety as one table of data: what can go wrong, how it is seen, what is done about it, and what a mission may say.

A row of ``TABLE`` is a watchdog: it is raised when its figure (``companion.skipper.watch.measures``, or what a script
on the autopilot tells) has been at or beyond ``enter`` for ``enter_s``, and cleared when it has been at or beyond
``exit``, which has a hysteresis, for ``exit_s``. Its number stands for it where there is no room for words. A row with
``ends`` ends the voyage early, as the mission's ``[safety]`` has it. All that names watchdogs derives from here: the
keys of ``[safety]`` and their defaults, the diversions and their order, what is announced, the numbers on the air, the
severities on the page and ashore, Signal K, and docs/reference/watchdogs.md (by
``python -m bench.pages``).

``FAILSAFES`` is the second table: why the autopilot changed its mode by itself. ArduRover keeps the reason in its log
and tells none over MAVLink: a cause is known by its signs. A sign is the beginning of a text, or of something that the
status shows from then on (``STANDING``); what has no sign is a person's doing.
"""

from __future__ import annotations

import enum
from collections.abc import Callable
from dataclasses import dataclass

from companion.messages import AutopilotStatus, Mode, Severity, StatusText

JUMP_M = 10.0  # a fix this much farther from where the boat is reckoned than it can have turned away is a jump
LIGHT_MPS = 0.8  # less wind than this makes no way that is worth a plan
SAILS_MPS = 0.5  # a boat that is slower in a calm only drifts


class Response(enum.Enum):
    """What a raised watchdog makes the skipper do, besides saying so."""

    SAY = "say so"
    FREEZE = "no actions until it clears; what is on the autopilot sails on"
    NO_BOAT_PLANS = "no plan from the boat's position until it clears, unless the way from there is shut"
    DOUBT = "no plan from it, LOITER where the reckoned place is not clear ahead, until there is evidence for it"
    HOLD = "LOITER where that may be set, no plan and no step of the ladder until it clears; then plan again"
    NO_WIND_PLANS = "no new plan because of the wind; the plan in place stays"
    WAIT_FOR_WIND = "no plans, no complaint about progress; LOITER where she drifts; plan again when the wind is back"
    STOP_DRIFT = "say where to and when, each minute; motor if there is one, LOITER if she can stem it, else the anchor"
    BEAR_AWAY = "bear away under GUIDED until the boat sails, back to AUTO, plan again; after two, gybe round"
    REPLAN = "plan again from the boat"
    RESTART = "read the mission, take it over if it is ours, and start again as far as permitted"
    COMPARE = "read the mission; ours: go on; not ours: stop acting and report"
    ADVANCE = "make the next item current"
    BY_FIELD = "steer by field under GUIDED, plan again from there, back to AUTO when the way is clear"
    AS_SET = "what the mission's `[safety]` says of it"
    TURN_BACK = "back over water that she has sounded to a loiter in it; then a plan, with the shoal in the area"
    BACK = "say so; where the straight way back is not clear, plan one; if the voyage is not over, LOITER first"


class End(enum.StrEnum):
    """What is done when something ends a voyage early (``[safety]``)."""

    SAY = "say"
    STAY = "stay"  # a loiter where there is room near by
    REFUGE = "refuge"  # the nearest; without one home if the mission ends there
    HOME = "home"  # where there is no way to it, the nearest refuge


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """A figure that a mission may set in ``[safety]``: its key with the unit, its bounds, and what it means."""

    key: str
    default: float | None  # None: not asked for
    above: float | None = None  # it is more than this ...
    least: float | None = None  # ... or at least this ...
    most: float | None = None  # ... and at most this
    says: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Ending:
    """How a watchdog ends a voyage early: the mission's key, what is done without it, the rank and the words."""

    key: str
    default: End
    rank: int  # the lower comes first where several are raised
    over_orders: bool = False  # it comes before the orders of the crew, too
    sails_on: bool = False  # where there is no place to go to what is left takes the boat on; else it stays near by
    because: str
    until: str = ""  # how long the boat waits there; empty: the voyage is over
    asked_by: str = ""  # a setting of its own, or a limit, without which it is not watched and not announced
    settings: tuple[Setting, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Watchdog:
    """One row: its thresholds are ``enter`` and ``exit`` in ``unit``, held for ``enter_s`` and ``exit_s``."""

    name: str
    number: int  # on the air; never changed and never given again
    watches: str
    enter: float
    exit: float
    unit: str
    enter_s: float
    exit_s: float
    severity: Severity
    response: Response
    why: str
    at_rest: bool = False  # watched before the boat sails and when the voyage is over, too
    loitering: bool = False  # watched when the voyage is over; without at_rest not before the boat sails
    unsailed_enter_s: float | None = None  # in place of ``enter_s`` where nothing but a drift can move the boat
    sensor: str = ""  # the NAMED_VALUE_FLOAT of a script on the autopilot whose value is the figure
    notification: str = ""  # Signal K's own name for it; empty: one made of the name
    told: str = ""  # the sentence that says it, with the figure in it; empty: the name and the figure
    ends: Ending | None = None  # it ends the voyage early, as the mission's ``[safety]`` says


W = Watchdog
S = Severity
BATTERY, DARK, OUT_OF_TIME = "battery critical", "dark", "out of time"
STRONG_WIND, LIGHT_WIND = "strong wind", "light wind"

# fmt: off
# A row is read across.
TABLE: tuple[Watchdog, ...] = (
    W(name="link silent", number=1,
      watches="time since the autopilot's last heartbeat", enter=3.0, exit=1.5, unit="s",
      enter_s=0.0, exit_s=2.0, severity=S.ERROR, response=Response.FREEZE, at_rest=True,
      why="nothing can be asked of an autopilot that is not heard; it sails its mission to the safe end alone"),
    W(name="position lost", number=2,
      watches="time since the last position", enter=5.0, exit=2.0, unit="s", enter_s=0.0,
      exit_s=2.0, severity=S.ERROR, response=Response.NO_BOAT_PLANS, at_rest=True, why="a plan needs a start"),
    W(name="position jump", number=3,
      watches="distance of a fix from where the boat is reckoned; stays while it is doubted",
      enter=JUMP_M, exit=5.0, unit="m", enter_s=0.0, exit_s=20.0, severity=S.WARNING, response=Response.DOUBT,
      at_rest=True,
      why="a GPS jump may put the start into an obstacle, and the autopilot sails by it, true or not"),
    W(name="wind untrusted", number=4,
      watches="the wind room's verdict (frozen, turned, silent vane, or none)", enter=1.0,
      exit=0.5, unit="", enter_s=5.0, exit_s=30.0, severity=S.WARNING, response=Response.NO_WIND_PLANS, at_rest=True,
      why="a plan made for a wind that is not there is worse than an old one"),
    W(name="wind contradicted", number=28, enter=1.0, exit=0.5, unit="", enter_s=0.0, exit_s=0.0, severity=S.ERROR,
      watches="whether wind, polar and a likely current explain how she moves; parameters that change what vane and "
              "compass say",
      response=Response.HOLD,
      why="who is told a wrong wind sails by it: a vane that turned on its mast looks like a current that cannot be"),
    W(name="becalmed", number=5,
      watches="mean true wind speed, of a boat that does not sail", enter=LIGHT_MPS, exit=1.2,
      unit="m/s", enter_s=60.0, exit_s=30.0, severity=S.NOTICE, response=Response.WAIT_FOR_WIND,
      loitering=True,
      why="without wind there is no progress to complain of and no direction to plan for"),
    W(name="drifting", number=6, notification="grounding",
      watches="time until a boat that does not sail drifts within the margin's floor of something",
      enter=300.0, exit=360.0, unit="s", enter_s=20.0, exit_s=30.0, severity=S.CRITICAL, response=Response.STOP_DRIFT,
      loitering=True, unsailed_enter_s=5.0,
      why="a current takes her there without wind, and an anchor takes time to be let go; in a calm, or astern in a "
          "loiter by a doubted wind, nothing else can have moved her, and she is told of after 5 s"),
    W(name="in irons", number=7,
      watches="speed ahead while pointing within 35° of the wind", enter=0.3, exit=0.8, unit="m/s",
      enter_s=8.0, exit_s=3.0, severity=S.WARNING, response=Response.BEAR_AWAY,
      why="ArduRover has no recovery of its own; a tack takes 2 to 7 s"),
    W(name="vessel too near", number=8, notification="collision",
      watches="time until our way is within half the distance to keep of a vessel that moves",
      enter=30.0, exit=60.0, unit="s", enter_s=2.0, exit_s=8.0, severity=S.WARNING, response=Response.BY_FIELD,
      loitering=True,
      why="a plan, its upload and the turn take too long; while headings are sent, our own field keeps clear"),
    W(name="no progress", number=9,
      watches="way made good towards the target in 180 s; by field a twentieth of what she could sail in them is none",
      enter=5.0, exit=15.0, unit="m",
      enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.REPLAN,
      why="current, weed, a lee: whatever the plan did not know"),
    W(name="heading against course", number=10, watches="angle between heading and course over ground above 0.5 m/s",
      enter=60.0, exit=40.0, unit="deg", enter_s=20.0, exit_s=10.0, severity=S.WARNING, response=Response.SAY,
      why="a compass error, going astern, or a current stronger than the boat"),
    W(name="off the corridor", number=11, enter=1.0, exit=0.7,
      watches="distance off the leg against what the plan's margin allows, or a beat that is left to the autopilot",
      unit="of the corridor", enter_s=3.0, exit_s=5.0, severity=S.WARNING, response=Response.REPLAN,
      why="outside it the clearance that was planned is no longer there"),
    W(name="stuck waypoint", number=12,
      watches="time since the waypoint was passed by our own geometry", enter=15.0, exit=1.0,
      unit="s", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.ADVANCE,
      why="Büsser's double conditions against the autopilot's own count"),
    W(name="mission ended", number=13,
      watches="the autopilot has completed the mission while goals remain", enter=1.0, exit=0.5,
      unit="", enter_s=5.0, exit_s=1.0, severity=S.NOTICE, response=Response.REPLAN,
      why="a plan that came too late leaves the boat in its safe end"),
    W(name="fence breach", number=14,
      watches="the autopilot's FENCE_STATUS", enter=1.0, exit=0.5, unit="", enter_s=0.0,
      exit_s=3.0, severity=S.CRITICAL, response=Response.REPLAN, at_rest=True,
      why="no new fence action follows while a breach lasts: the way out is ours"),
    W(name="fence off", number=27, watches="the autopilot tells of its fence no more", enter=1.0, exit=0.5, unit="",
      enter_s=20.0, exit_s=1.0, severity=S.WARNING, response=Response.SAY,
      why="somebody switched the last line of defence off: only the plans keep her inside now"),
    W(name="foreign mission", number=15,
      watches="items on the autopilot that we did not put there", enter=1.0, exit=0.5, unit="",
      enter_s=0.0, exit_s=0.0, severity=S.ERROR, response=Response.COMPARE, at_rest=True,
      why="someone else changed the mission: it is theirs to decide"),
    W(name="reboot", number=16,
      watches="the autopilot's boot time going back", enter=1.0, exit=1.0, unit="s", enter_s=0.0,
      exit_s=0.0, severity=S.ERROR, response=Response.RESTART, at_rest=True,
      why="rates, mode and arming are lost; the mission survives in its memory"),
    W(name="battery low", number=17,
      watches="battery remaining, or the autopilot's own limits", enter=20.0, exit=25.0, unit="%",
      enter_s=10.0, exit_s=10.0, severity=S.WARNING, response=Response.SAY, at_rest=True,
      why="time to think of the way home"),
    W(name="battery critical", number=18, unit="%", enter=10.0, exit=15.0,
      watches="battery remaining, the autopilot's critical limit, the mission's `battery_v` and `battery_reserve`",
      enter_s=10.0, exit_s=10.0, severity=S.CRITICAL, response=Response.AS_SET, at_rest=True,
      why="a boat without power steers no more; better in a refuge",
      ends=Ending(key="battery", default=End.REFUGE, rank=1, over_orders=True, sails_on=True,
                  because="the battery is critical", until="until the battery is charged, or a person takes her",
                  settings=(
                      Setting(key="battery_v", default=None, above=0.0, says="critical at this voltage, too; else at "
                              "10 % or by the autopilot's own limits"),
                      Setting(key="battery_reserve", default=1.5, least=0.0, most=10.0, says="critical, too, when at "
                              "its rate the charge lasts less than so many times the way to the nearest refuge (or "
                              "home); 0: not looked at")))),
    W(name="leaking", number=19,
      watches="NAMED_VALUE_FLOAT LEAK, of a script on the autopilot", enter=0.5, exit=0.5, unit="", sensor="LEAK",
      notification="flooding", enter_s=2.0, exit_s=60.0, severity=S.CRITICAL, response=Response.AS_SET, at_rest=True,
      why="a hull that fills sails no more; the switch chatters as she rolls",
      ends=Ending(key="leak", default=End.REFUGE, rank=2, over_orders=True, because="she is leaking",
                  until="until the bilge is dry, or a person takes her")),
    W(name="out of time", number=22,
      watches="time under way against the mission's `voyage_timeout_s`", enter=1.0, exit=0.99,
      unit="of it", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.AS_SET,
      why="whoever waits for her must be able to reckon with an end",
      ends=Ending(key="out_of_time", default=End.REFUGE, rank=3, because="the voyage is out of time",
                  asked_by="voyage_timeout_s")),
    W(name="dark", number=20,
      watches="the sun's height over the mission's `dark_below_deg`, by the autopilot's time", enter=0.0,
      exit=1.0, unit="deg from the limit", enter_s=30.0, exit_s=30.0, severity=S.NOTICE, response=Response.AS_SET,
      told="it is dark: the sun is {:.0f} degrees lower than where dark begins (dark_below_deg)",
      why="who has no lights or no watch wants her to lie somewhere by night",
      ends=Ending(key="dark", default=End.SAY, rank=6, because="it is dark", until="until it is light", settings=(
          Setting(key="dark_below_deg", default=-6.0, least=-18.0, most=45.0, says="it is dark when the sun is lower "
                  "than this, at the boat, by the autopilot's time; -6 is the end of civil twilight"),))),
    W(name="shore lost", number=21,
      watches="time since a ground station was heard against the mission's `shore_lost_s`",
      enter=1.0, exit=0.99, unit="of it", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.AS_SET,
      why="nobody ashore sees her, and no order reaches her",
      ends=Ending(key="shore_lost", default=End.SAY, rank=5, because="no ground station is heard",
                  until="until a ground station is heard", settings=(
                      Setting(key="shore_lost_s", default=600.0, least=10.0, says="no station for this long"),))),
    W(name="dragged off", number=23,
      watches="distance from the place of the loiter in which she is to stay", enter=40.0,
      exit=25.0, unit="m", enter_s=10.0, exit_s=10.0, severity=S.ERROR, response=Response.BACK, loitering=True,
      why="a loiter keeps within 13 m of it; farther off the wind is gone, a current is stronger, or she is towed"),
    W(name="planner dead", number=24,
      watches="the planner's worker process", enter=1.0, exit=0.5, unit="", enter_s=5.0,
      exit_s=1.0, severity=S.ERROR, response=Response.SAY, at_rest=True,
      why="it is killed and replaced by itself; until then the plan in place sails"),
    W(name="strong wind", number=25, enter=1.0, exit=0.5, unit="of what is allowed",
      watches="the chance of more wind than `max_tws_mps` within the plan's time against `1 - delta_s`",
      enter_s=20.0, exit_s=120.0, severity=S.CRITICAL, response=Response.AS_SET,
      why="a gust that she is not built for may lay her flat",
      ends=Ending(key="strong_wind", default=End.REFUGE, rank=4, asked_by="max_tws_mps",
                  because="more wind is forecast than she is to be out in", until="until less wind is forecast")),
    W(name="light wind", number=26, enter=1.0, exit=0.5, unit="of what is allowed",
      watches="the chance of less wind than `min_tws_mps` within the plan's time against `1 - delta_s`",
      enter_s=20.0, exit_s=120.0, severity=S.WARNING, response=Response.AS_SET,
      why="what does not make way is carried by the water",
      ends=Ending(key="light_wind", default=End.SAY, rank=7, asked_by="min_tws_mps",
                  because="less wind is forecast than she makes way in", until="until more wind is forecast")),
    W(name="shoaling", number=29, notification="grounding",
      watches="the depth by the sounder in 20 s at its rate, over the mission's `draft_m` and `under_keel_m`",
      enter=0.0, exit=0.5, unit="m", enter_s=1.0, exit_s=10.0, severity=S.CRITICAL, response=Response.TURN_BACK,
      loitering=True,
      why="what no chart has is found by the keel; 20 s are for an upload and the turn, or for a person"),
    W(name="depth lost", number=30, watches="the sounder tells of the bottom no more", enter=1.0, exit=0.5, unit="",
      enter_s=5.0, exit_s=2.0, severity=S.WARNING, response=Response.SAY, loitering=True,
      why="from now on a shoal is not seen; water that is deeper than the sounder reaches is no loss"),
)
# fmt: on

BY_NAME = {w.name: w for w in TABLE}

ENDINGS = {dog.name: dog.ends for dog in TABLE if dog.ends is not None}
BY_RANK = tuple(sorted(ENDINGS, key=lambda name: ENDINGS[name].rank))
SENSORS = {dog.sensor: dog for dog in TABLE if dog.sensor}
SETTINGS = {setting.key: setting for ending in ENDINGS.values() for setting in ending.settings}
BY_NUMBER = {dog.number: dog.name for dog in TABLE}


def number_of(watchdog: str) -> int:
    """Return the number of a watchdog, 0 for none (an empty name)."""
    return BY_NAME[watchdog].number if watchdog else 0


def watchdog_of(number: int) -> str:
    """Return the watchdog of a number, empty for 0; one that is not known here is named by its number."""
    return BY_NUMBER.get(number, f"watchdog {number}") if number else ""


# --------------------
# Why the autopilot changed its mode by itself: the causes, how each is told, and what is done about it.

CRITICAL = 5  # MAV_STATE of a heartbeat while a failsafe of links or position has acted
AUTOPILOT = 1  # the component whose texts are signs
# What a failsafe puts a boat into; RTL and LOITER sail, but not where the voyage wants it.
HOMEWARD = frozenset({Mode.RTL, Mode.SMART_RTL})
STOPPING = frozenset({Mode.HOLD, Mode.LOITER, *HOMEWARD})
EMPTY = " is critical "  # in the battery's words, when the second of its limits is passed
OVER = "cleared"  # ends a text that says that something is over


class Recovery(enum.Enum):
    """What is done about a stop that nobody asked for, where the mission permits it (``set_auto``)."""

    LEAVE = "nothing: a person must look at her first"
    SAIL_ON = "plan from where she is (back inside the fence), AUTO, sail on"
    STAY = "AUTO and a loiter where there is room near by (put into RTL: planned home) until it is over; then sail on"
    SHELTER = "AUTO and the nearest refuge; without one home if she was sent there, else a loiter where there is room"

    @property
    def words(self) -> str:
        """What is done, in a few words."""
        return {
            Recovery.LEAVE: "left to a person",
            Recovery.SAIL_ON: "sail on",
            Recovery.STAY: "loiter near by",
            Recovery.SHELTER: "to the nearest refuge",
        }[self]


# What a mission may say of the failsafes in place of the table (``[safety] ..._failsafe``).
CHOICES = {"leave": Recovery.LEAVE, "sail_on": Recovery.SAIL_ON, "stay": Recovery.STAY, "refuge": Recovery.SHELTER}
WORD_OF = {answer: word for word, answer in CHOICES.items()}


@dataclass(frozen=True, slots=True, kw_only=True)
class Cause:
    """One row. ``texts`` are beginnings of the autopilot's, ``shown`` is the standing sign in words."""

    name: str
    texts: tuple[str, ...]
    shown: str
    answer: Recovery
    key: str = ""  # what a mission may say of it in ``[safety]``
    waits_for: str = ""  # what must be over before the answer begins
    press: str = "AUTO to sail on, LOITER to stay, MANUAL to take her"
    why: str


PERSON = "a person"
SHORE = "shore link"

# fmt: off
FAILSAFES: tuple[Cause, ...] = (
    Cause(name="position", key="position_failsafe", texts=("EKF variance", "EKF failsafe"),
          shown="HEARTBEAT critical with the filter ill",
          answer=Recovery.SAIL_ON, waits_for="the filter well again, evidence for the position; meanwhile LOITER",
          press="MANUAL to take her; AUTO when the position is back",
          why="ArduRover holds when its filter loses the position, and never goes back by itself"),
    Cause(name="crash", texts=("Crash:",), shown="", answer=Recovery.LEAVE,
          press="MANUAL to take her; AUTO if she floats upright",
          why="knocked down or aground: whether she may sail is not to be told from here"),
    Cause(name="battery", key="battery_failsafe", texts=("Battery ",),
          shown="SYS_STATUS: battery not healthy", answer=Recovery.SHELTER,
          press="AUTO to sail on, MANUAL to take her",
          why="what is left takes her to a place that was chosen for it"),
    Cause(name="fence", key="fence_failsafe", texts=(),
          shown="FENCE_STATUS: breached, or one breach more", answer=Recovery.SAIL_ON,
          press="AUTO to let the mission sail her back, MANUAL to take her",
          why="a sailboat in HOLD drifts on outside, RTL sails straight; no new action follows while a breach lasts"),
    Cause(name="shore link", key="shore_failsafe", texts=("Radio Failsafe", "GCS Failsafe"),
          shown="HEARTBEAT critical with the filter well",
          answer=Recovery.STAY,
          why="who wants her to stop out of range of radio or station wants her to stay, not to drift; ArduRover gives "
              "the loss of the one the other's name where it looks for both"),
)
# fmt: on
CAUSES = {cause.name: cause for cause in FAILSAFES}


def is_filter_ill(status: AutopilotStatus) -> bool:
    """Return whether the position filter has failed and its failsafe acted."""
    return status.system_status == CRITICAL and not status.ekf_ok


RECEIVER = "receiver"  # no cause by itself: without FS_THR_ENABLE its silence does nothing
STANDING: dict[str, Callable[[AutopilotStatus], bool]] = {
    "position": is_filter_ill,
    "battery": lambda status: bool(status.battery_failed),
    "fence": lambda status: bool(status.fence_breached),
    "shore link": lambda status: status.system_status == CRITICAL and status.ekf_ok,
    RECEIVER: lambda status: bool(status.receiver_lost),
}


def failsafe_named_by(text: StatusText) -> str:
    """Return the name of the cause that a text is a sign of, empty when of none."""
    if text.source_component != AUTOPILOT or OVER in text.text.lower():
        return ""
    return next((cause.name for cause in FAILSAFES if text.text.startswith(cause.texts)), "") if text.text else ""


def standing(status: AutopilotStatus) -> tuple[str, ...]:
    """Return the names of the standing signs that are up."""
    return tuple(name for name, is_up in STANDING.items() if is_up(status))
