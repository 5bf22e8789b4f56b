"""Where a vessel will be: a mean and a covariance that grow with the age of its report.

Along its course the spread is made of the report's own error, of the speed's error times time, and of speed
changes; across it, of the course's error times the distance run and of turns to come. Each is a convex function
of time, so their root sum of squares is convex too: that is what lets ``occupancy`` bound it by straight lines.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from statistics import NormalDist

from companion.traffic.vessel import FISHING, STILL_MPS, TYPE_FISHING, TYPE_PLEASURE, TYPE_SAILING, Vessel

# A turn that is reported goes on for this long and then stops; no vessel is believed to circle for ever.
TURN_HOLD_S = 30.0
# The AIS "turning at more than 5 degrees per 30 s" value and gyros in a seaway do not deserve more than this.
TURN_LIMIT_RADPS = math.radians(6.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionUncertainty:
    """How surely a vessel keeps its course and speed: standard deviations.

    Attributes:
        position_m: of a reported position.
        speed_mps: of the reported speed, and of how far it will be kept.
        course_rad: of the course.
        accel_mps2: of speed changes, held for at most ``hold_s``.
        turn_radps: of turns not reported, held for at most ``hold_s``.
        hold_s: after this a manoeuvre is over: its effect grows linearly, no longer with the square of time.
        unknown_mps: speed, in any direction, of a vessel whose course or speed is not known.

    """

    position_m: float = 5.0
    speed_mps: float = 0.2
    course_rad: float = math.radians(1.2)
    accel_mps2: float = 0.005
    turn_radps: float = math.radians(0.03)
    hold_s: float = TURN_HOLD_S
    unknown_mps: float = 4.0


# Own assumptions, not from a standard: a ship holds its course, small craft, sailing and fishing boats do not.
SHIP = MotionUncertainty()
SMALL = MotionUncertainty(
    position_m=5.0,
    speed_mps=0.5,
    course_rad=math.radians(5.0),
    accel_mps2=0.02,
    turn_radps=math.radians(0.5),
    unknown_mps=3.0,
)
WANDERING = MotionUncertainty(
    position_m=5.0,
    speed_mps=0.7,
    course_rad=math.radians(8.0),
    accel_mps2=0.03,
    turn_radps=math.radians(1.0),
    unknown_mps=3.0,
)
STOPPED = MotionUncertainty(
    position_m=5.0, speed_mps=0.05, course_rad=0.0, accel_mps2=0.0, turn_radps=0.0, unknown_mps=0.05
)
STEADY = MotionUncertainty(
    position_m=1.0, speed_mps=0.05, course_rad=math.radians(0.5), accel_mps2=0.0, turn_radps=0.0, unknown_mps=1.0
)
"""An intruder that promises constant speed and heading (WRSC 2013)."""


def motion_of(vessel: Vessel) -> MotionUncertainty:
    """Return what may be expected of the vessel's class; a reported turn adds half its rate as doubt."""
    if vessel.is_stopped:
        return STOPPED
    if vessel.nav_status == FISHING or vessel.ship_type in {TYPE_FISHING, TYPE_SAILING}:
        base = WANDERING
    elif vessel.is_class_b or vessel.ship_type == TYPE_PLEASURE:
        base = SMALL
    else:
        base = SHIP
    turning = min(abs(vessel.turn_rate_radps or 0.0), TURN_LIMIT_RADPS)
    if vessel.derived:
        base = replace(base, speed_mps=2.0 * base.speed_mps, course_rad=2.0 * base.course_rad)
    if turning == 0.0:
        return base  # most vessels, each step: a copy costs more than all the arithmetic of a prediction
    return replace(base, turn_radps=math.hypot(base.turn_radps, 0.5 * turning))


@dataclass(frozen=True, slots=True, kw_only=True)
class Prediction:
    """A vessel's hull centre at ``t_s``: Gaussian, with axes along and across its course.

    ``reach_m`` is the radius of the hull about that centre, for any heading.
    """

    t_s: float
    mean_en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float]
    course_rad: float
    sigma_along_m: float
    sigma_across_m: float
    reach_m: float

    def radius_m(self, risk: float) -> float:
        """Return the radius about the mean that the hull leaves with probability ``risk`` at most [m].

        P(outside the ellipse of k sigma) = exp(-k² / 2) for a plane Gaussian, and the disc of k times the larger
        sigma holds that ellipse.
        """
        return self.reach_m + risk_factor(risk) * max(self.sigma_along_m, self.sigma_across_m)


def risk_factor(risk: float) -> float:
    """Return k with exp(-k² / 2) = ``risk``.

    Raises:
        ValueError: ``risk`` is not in (0, 1).

    """
    if not 0.0 < risk < 1.0:
        raise ValueError(f"risk {risk} is not between 0 and 1")
    return math.sqrt(-2.0 * math.log(risk))


def tail_factor(risk: float) -> float:
    """Return k with P(N(0, 1) > k) = ``risk``, 0 at least.

    A boat that is k sigma and the hulls away from a vessel's mean is met only if the vessel is off by more than k
    sigma towards the boat, and no direction has more than the larger sigma: one tail bounds the risk (the half-plane
    of Luders, Kothari and How 2010 and of Wolsieffer 2020). ``risk_factor`` asks that it be off in any direction.

    Raises:
        ValueError: ``risk`` is not in (0, 1).

    """
    if not 0.0 < risk < 1.0:
        raise ValueError(f"risk {risk} is not between 0 and 1")
    return max(0.0, -NormalDist().inv_cdf(risk))


def predict(vessel: Vessel, t_s: float, motion: MotionUncertainty | None = None) -> Prediction:
    """Return where the vessel's hull centre is at ``t_s``; for a moment before its report, at the report.

    The mean follows a reported turn for ``TURN_HOLD_S`` after the report and goes straight on from there.
    """
    m = motion if motion is not None else motion_of(vessel)
    tau = max(0.0, t_s - vessel.t_s)
    speed = 0.0 if vessel.is_stopped or vessel.course_rad is None else vessel.speed_mps or 0.0
    course = vessel.course_rad or 0.0
    (east, north), course = run(vessel.centre_en_m, course, speed, turn_rate(vessel), tau)
    along, across = spread(m, speed, tau, is_known=vessel.is_moving_known)
    return Prediction(
        t_s=t_s,
        mean_en_m=(east, north),
        velocity_en_mps=(speed * math.sin(course), speed * math.cos(course)),
        course_rad=course,
        sigma_along_m=along,
        sigma_across_m=across,
        reach_m=vessel.reach_m,
    )


def turn_rate(vessel: Vessel) -> float:
    """Return the rate of turn that the mean follows [rad/s]: none for a vessel that hardly moves."""
    rate = vessel.turn_rate_radps
    if rate is None or vessel.speed_mps is None or vessel.speed_mps < STILL_MPS or vessel.is_stopped:
        return 0.0
    return max(-TURN_LIMIT_RADPS, min(TURN_LIMIT_RADPS, rate))


def run(
    from_en_m: tuple[float, float], course_rad: float, speed_mps: float, turn_radps: float, tau_s: float
) -> tuple[tuple[float, float], float]:
    """Return position and course ``tau_s`` on: an arc for ``TURN_HOLD_S``, then straight."""
    east, north = from_en_m
    if abs(turn_radps) > 1e-6:
        arc = min(tau_s, TURN_HOLD_S)
        after = course_rad + turn_radps * arc
        radius = speed_mps / turn_radps
        east += radius * (math.cos(course_rad) - math.cos(after))
        north += radius * (math.sin(after) - math.sin(course_rad))
        course_rad, tau_s = after, tau_s - arc
    ahead = speed_mps * tau_s
    return (east + ahead * math.sin(course_rad), north + ahead * math.cos(course_rad)), course_rad


def spread(motion: MotionUncertainty, speed_mps: float, tau_s: float, *, is_known: bool) -> tuple[float, float]:
    """Return the standard deviations along and across the course [m], ``tau_s`` after the report."""
    if not is_known:
        sigma = math.hypot(motion.position_m, motion.unknown_mps * tau_s)
        return sigma, sigma
    held = manoeuvre_s2(tau_s, motion.hold_s)
    along = math.sqrt(motion.position_m**2 + (motion.speed_mps * tau_s) ** 2 + (motion.accel_mps2 * held) ** 2)
    yawed = speed_mps * math.hypot(motion.course_rad * tau_s, motion.turn_radps * held)
    across = math.hypot(motion.position_m, yawed)
    return along, across


def manoeuvre_s2(tau_s: float, hold_s: float) -> float:
    """Return ∫∫ of a unit manoeuvre that is over after ``hold_s``: tau²/2, then linear; convex, C¹ [s²]."""
    return 0.5 * tau_s * tau_s if tau_s <= hold_s else hold_s * (tau_s - 0.5 * hold_s)
