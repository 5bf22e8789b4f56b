"""The watchdogs: what can go wrong under way and at rest, as one table of data.

Each row has an entry (a condition that holds for ``enter_s``), an exit (its opposite, with a hysteresis, for
``exit_s``) and a response; ``measures`` has the figures and ``watch`` raises and clears. ``python -m
companion.skipper.watch.document`` prints docs/reference/watchdogs.md from the table.
"""

from __future__ import annotations

import enum
from dataclasses import dataclass

from companion.skipper.behaviors.drifting import LIGHT_MPS
from companion.skipper.step.actions import Severity
from companion.skipper.step.context import JUMP_M


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
    BACK = "say so; where the straight way back is not clear, plan one"


@dataclass(frozen=True, slots=True, kw_only=True)
class Watchdog:
    """One row: its thresholds are ``enter`` and ``exit`` in ``unit``, held for ``enter_s`` and ``exit_s``."""

    name: str
    watches: str
    enter: float
    exit: float
    unit: str
    enter_s: float
    exit_s: float
    severity: Severity
    response: Response
    why: str
    at_rest: bool = False      # watched before she sails and when the voyage is over, too
    loitering: bool = False    # watched when the voyage is over; without at_rest not before she sails
    calm_enter_s: float | None = None   # the entry in place of ``enter_s`` where there is no wind to be steered in


W = Watchdog
S = Severity

TABLE: tuple[Watchdog, ...] = (
    W(name="link silent", watches="time since the autopilot's last heartbeat", enter=3.0, exit=1.5, unit="s",
      enter_s=0.0, exit_s=2.0, severity=S.ERROR, response=Response.FREEZE, at_rest=True,
      why="nothing can be asked of an autopilot that is not heard; it sails its mission to the safe end alone"),
    W(name="position lost", watches="time since the last position", enter=5.0, exit=2.0, unit="s", enter_s=0.0,
      exit_s=2.0, severity=S.ERROR, response=Response.NO_BOAT_PLANS, at_rest=True, why="a plan needs a start"),
    W(name="position jump", watches="distance of a fix from where the boat is reckoned; stays while it is doubted",
      enter=JUMP_M, exit=5.0, unit="m", enter_s=0.0, exit_s=20.0, severity=S.WARNING, response=Response.DOUBT,
      at_rest=True,
      why="a GPS jump may put the start into an obstacle, and the autopilot sails by it, true or not"),
    W(name="wind untrusted", watches="the wind room's verdict (frozen, turned, silent vane, or none)", enter=1.0,
      exit=0.5, unit="", enter_s=5.0, exit_s=30.0, severity=S.WARNING, response=Response.NO_WIND_PLANS, at_rest=True,
      why="a plan made for a wind that is not there is worse than an old one"),
    W(name="wind contradicted", enter=1.0, exit=0.5, unit="", enter_s=0.0, exit_s=0.0, severity=S.ERROR,
      watches="whether wind, polar and a likely current explain how she moves; parameters that change what vane and "
              "compass say",
      response=Response.HOLD,
      why="who is told a wrong wind sails by it: a vane that turned on its mast looks like a current that cannot be"),
    W(name="becalmed", watches="mean true wind speed, of a boat that does not sail", enter=LIGHT_MPS, exit=1.2,
      unit="m/s", enter_s=60.0, exit_s=30.0, severity=S.NOTICE, response=Response.WAIT_FOR_WIND,
      loitering=True,
      why="without wind there is no progress to complain of and no direction to plan for"),
    W(name="drifting", watches="time until a boat that does not sail drifts within the margin's floor of something",
      enter=300.0, exit=360.0, unit="s", enter_s=20.0, exit_s=30.0, severity=S.CRITICAL, response=Response.STOP_DRIFT,
      loitering=True, calm_enter_s=5.0,
      why="a current takes her there without wind, and an anchor takes time to be let go; in a calm nothing else can "
          "have moved her, and she is told of after 5 s"),
    W(name="in irons", watches="speed ahead while pointing within 35° of the wind", enter=0.3, exit=0.8, unit="m/s",
      enter_s=8.0, exit_s=3.0, severity=S.WARNING, response=Response.BEAR_AWAY,
      why="ArduRover has no recovery of its own; a tack takes 2 to 7 s"),
    W(name="vessel too near", watches="time until our way is within half the distance to keep of a vessel that moves",
      enter=30.0, exit=60.0, unit="s", enter_s=2.0, exit_s=8.0, severity=S.WARNING, response=Response.BY_FIELD,
      why="a plan, its upload and the turn take too long; while headings are sent, our own field keeps clear"),
    W(name="no progress", watches="way made good towards the target in 180 s", enter=5.0, exit=15.0, unit="m",
      enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.REPLAN,
      why="current, weed, a lee: whatever the plan did not know"),
    W(name="heading against course", watches="angle between heading and course over ground above 0.5 m/s",
      enter=60.0, exit=40.0, unit="deg", enter_s=20.0, exit_s=10.0, severity=S.WARNING, response=Response.SAY,
      why="a compass error, going astern, or a current stronger than the boat"),
    W(name="off the corridor", enter=1.0, exit=0.7,
      watches="distance off the leg against what the plan's margin allows, or a beat that is left to the autopilot",
      unit="of the corridor", enter_s=3.0, exit_s=5.0, severity=S.WARNING, response=Response.REPLAN,
      why="outside it the clearance that was planned is no longer there"),
    W(name="stuck waypoint", watches="time since the waypoint was passed by our own geometry", enter=15.0, exit=1.0,
      unit="s", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.ADVANCE,
      why="Büsser's double conditions against the autopilot's own count"),
    W(name="mission ended", watches="the autopilot has completed the mission while goals remain", enter=1.0, exit=0.5,
      unit="", enter_s=5.0, exit_s=1.0, severity=S.NOTICE, response=Response.REPLAN,
      why="a plan that came too late leaves the boat in its safe end"),
    W(name="fence breach", watches="the autopilot's FENCE_STATUS", enter=1.0, exit=0.5, unit="", enter_s=0.0,
      exit_s=3.0, severity=S.CRITICAL, response=Response.REPLAN, at_rest=True,
      why="no new fence action follows while a breach lasts: the way out is ours"),
    W(name="fence off", watches="the autopilot tells of its fence no more", enter=1.0, exit=0.5, unit="",
      enter_s=20.0, exit_s=1.0, severity=S.WARNING, response=Response.SAY,
      why="somebody switched the last line of defence off: only the plans keep her inside now"),
    W(name="foreign mission", watches="items on the autopilot that we did not put there", enter=1.0, exit=0.5, unit="",
      enter_s=0.0, exit_s=0.0, severity=S.ERROR, response=Response.COMPARE, at_rest=True,
      why="someone else changed the mission: it is theirs to decide"),
    W(name="reboot", watches="the autopilot's boot time going back", enter=1.0, exit=1.0, unit="s", enter_s=0.0,
      exit_s=0.0, severity=S.ERROR, response=Response.RESTART, at_rest=True,
      why="rates, mode and arming are lost; the mission survives in its memory"),
    W(name="battery low", watches="battery remaining, or the autopilot's own limits", enter=20.0, exit=25.0, unit="%",
      enter_s=10.0, exit_s=10.0, severity=S.WARNING, response=Response.SAY, at_rest=True,
      why="time to think of the way home"),
    W(name="battery critical", unit="%", enter=10.0, exit=15.0,
      watches="battery remaining, the autopilot's critical limit, the mission's `battery_v` and `battery_reserve`",
      enter_s=10.0, exit_s=10.0, severity=S.CRITICAL, response=Response.AS_SET, at_rest=True,
      why="a boat without power steers no more; better in a refuge"),
    W(name="leaking", watches="NAMED_VALUE_FLOAT LEAK, of a script on the autopilot", enter=1.0, exit=0.5, unit="",
      enter_s=2.0, exit_s=60.0, severity=S.CRITICAL, response=Response.AS_SET, at_rest=True,
      why="a hull that fills sails no more; the switch chatters as she rolls"),
    W(name="dark", watches="the sun's height over the mission's `dark_below_deg`, by the autopilot's time", enter=0.0,
      exit=1.0, unit="deg", enter_s=30.0, exit_s=30.0, severity=S.NOTICE, response=Response.AS_SET,
      why="who has no lights or no watch wants her to lie somewhere by night"),
    W(name="shore lost", watches="time since a ground station was heard against the mission's `shore_lost_s`",
      enter=1.0, exit=0.99, unit="of it", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.AS_SET,
      why="nobody ashore sees her, and no order reaches her"),
    W(name="out of time", watches="time under way against the mission's `voyage_timeout_s`", enter=1.0, exit=0.99,
      unit="of it", enter_s=0.0, exit_s=0.0, severity=S.WARNING, response=Response.AS_SET,
      why="whoever waits for her must be able to reckon with an end"),
    W(name="dragged off", watches="distance from the place of the loiter when the voyage is over", enter=40.0,
      exit=25.0, unit="m", enter_s=10.0, exit_s=10.0, severity=S.ERROR, response=Response.BACK, loitering=True,
      why="a loiter keeps within 13 m of it; farther off the wind is gone, a current is stronger, or she is towed"),
    W(name="planner dead", watches="the planner's worker process", enter=1.0, exit=0.5, unit="", enter_s=5.0,
      exit_s=1.0, severity=S.ERROR, response=Response.SAY, at_rest=True,
      why="it is killed and replaced by itself; until then the plan in place sails"),
    W(name="strong wind", enter=1.0, exit=0.5, unit="of what is allowed",
      watches="the chance of more wind than `max_tws_mps` within the plan's time against `1 - delta_s`",
      enter_s=20.0, exit_s=120.0, severity=S.CRITICAL, response=Response.AS_SET,
      why="a gust that she is not built for may lay her flat"),
    W(name="light wind", enter=1.0, exit=0.5, unit="of what is allowed",
      watches="the chance of less wind than `min_tws_mps` within the plan's time against `1 - delta_s`",
      enter_s=20.0, exit_s=120.0, severity=S.WARNING, response=Response.AS_SET,
      why="what does not make way is carried by the water"),
)

BY_NAME = {w.name: w for w in TABLE}
