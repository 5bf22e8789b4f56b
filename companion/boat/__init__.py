"""What the boat can do: polar, limits, losses, and the margins that its autopilot's habits ask for.

>>> boat = Boat(polar=ardurover_sitl())
>>> boat.problem_boat(tws_mps=5.0)["no_go_half_deg"]
45.0
"""

from companion.boat.afloat import Afloat, LearnedAfloat, Look, as_learned, factor, followed, mark_of
from companion.boat.boat import (
    Boat,
    Hull,
    can_hold,
    made_good_mps,
    orc_text,
    outline_en_m,
    signalk_text,
    slowest_en_mps,
)
from companion.boat.guess import GuessedBoat, Sizes, guessed, guessed_text
from companion.boat.learned_file import learned_text
from companion.boat.lesson import Lesson, lesson_of
from companion.boat.log import BoatLog, Why
from companion.boat.margins import (
    AutopilotLimits,
    ProposedMargin,
    loiter_swing_m,
    narrowest_corridor_m,
    points_too_high,
    proposed_margin,
    required_margin,
    widest_corridor_m,
)
from companion.boat.polar import (
    Polar,
    ardurover_sitl,
    avalon,
    constant,
    parse_polar,
    pol_text,
    polar_of_table,
    read_polar,
)
from companion.boat.steering import Steering, SteeringBand, SteeringLog, steering_of
from companion.boat.trial import Trial, trial_in

__all__ = [
    "Afloat",
    "AutopilotLimits",
    "Boat",
    "BoatLog",
    "GuessedBoat",
    "Hull",
    "LearnedAfloat",
    "Lesson",
    "Look",
    "Polar",
    "ProposedMargin",
    "Sizes",
    "Steering",
    "SteeringBand",
    "SteeringLog",
    "Trial",
    "Why",
    "ardurover_sitl",
    "as_learned",
    "avalon",
    "can_hold",
    "constant",
    "factor",
    "followed",
    "guessed",
    "guessed_text",
    "learned_text",
    "lesson_of",
    "loiter_swing_m",
    "made_good_mps",
    "mark_of",
    "narrowest_corridor_m",
    "orc_text",
    "outline_en_m",
    "parse_polar",
    "points_too_high",
    "pol_text",
    "polar_of_table",
    "proposed_margin",
    "read_polar",
    "required_margin",
    "signalk_text",
    "slowest_en_mps",
    "steering_of",
    "trial_in",
    "widest_corridor_m",
]
