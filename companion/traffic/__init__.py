"""Other boats: what AIS says of them, where they will be, how near, and who gives way.

A pure fold and pure questions about its value; sockets are in ``companion.traffic.feeds`` alone::

    targets = Targets.empty(frame)                       # frame: companion.geo.frame.LocalFrame
    targets = targets.heard(report)                      # AisReport from MAVLink, NMEA or the JSON feed
    picture = targets.picture(t_s)                       # TrafficPicture: vessels with age, counts, events
    own = OwnShip(t_s=t_s, en_m=(e, n), velocity_en_mps=(ve, vn), heading_rad=h)
    approach = cpa(own, vessel, t_s)                     # Approach: distance between hulls, TCPA, bearing
    alarms = assess(own, picture, LAKE, twd_from_rad)    # per vessel: Approach, Alarm, Encounter (COLREGs)
    predict(vessel, t_s)                                 # Prediction: mean, covariance, radius_m(risk)
    discs = planning_discs(picture, t_s, own, ...)       # tuple[Target, ...]: what a planning problem has
    conflicts = check_legs(legs, discs)                  # the active plan against the targets

Times are absolute [s] on the companion's clock, except in a ``Target`` and a ``TimedLeg``, where they count from
the moment that the discs were made for (a plan's t = 0).
"""

from companion.traffic.approach import LAKE, SEA, Alarm, AlarmLimits, OwnShip, cpa, peril_m
from companion.traffic.colregs import Assessment, Policy, Role, Rule, assess, classify
from companion.traffic.nmea import decode_json
from companion.traffic.occupancy import planning_discs
from companion.traffic.plans import Conflict, Decision, check_legs, decide, path_distance_m
from companion.traffic.predict import predict
from companion.traffic.targets import TargetLimits, Targets, TrafficCounts, TrafficPicture
from companion.traffic.vessel import Vessel

__all__ = [
    "LAKE",
    "SEA",
    "Alarm",
    "AlarmLimits",
    "Assessment",
    "Conflict",
    "Decision",
    "OwnShip",
    "Policy",
    "Role",
    "Rule",
    "TargetLimits",
    "Targets",
    "TrafficCounts",
    "TrafficPicture",
    "Vessel",
    "assess",
    "check_legs",
    "classify",
    "cpa",
    "decide",
    "decode_json",
    "path_distance_m",
    "peril_m",
    "planning_discs",
    "predict",
]
