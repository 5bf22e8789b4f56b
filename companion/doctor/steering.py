"""How the autopilot steers, by its logs: what of its tuning to change, one group of parameters at a time."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from companion.boat import Steering, SteeringBand
from companion.doctor.report import DoctorFinding, Level, Report
from companion.words import counted

MOST_STEP = 0.3  # of a parameter, at once
FF_OFF, FF_APART = 0.15, 0.4  # from what logs show, and one band's from another's (shares)
HARD_OVER, SWINGS_RAD, MANY_REVERSALS = 0.2, math.radians(2.0), 40.0
OVERSHOOT_RAD, LEEWARD_RAD = math.radians(15.0), math.radians(3.0)
SLOW_TACK_S, LAG_S, ASTERN, HEELED = 5.0, 1.0, 0.02, 0.1
BUILDS_MPS = 1.0  # ArduRover's integrator builds above it alone
LATER = "; one group of parameters at a time: after the next log"


def examine_steering(steering: Steering, parameters: Mapping[str, float] | None = None) -> tuple[DoctorFinding, ...]:
    """Return what logs say of the autopilot's tuning; only the first group that wants a change has one proposed.

    Args:
        steering: what the logs tell.
        parameters: as the autopilot has them now; where they are not given, as the logs tell them.

    """
    report = Report(steering.parameters if parameters is None else parameters)
    _swings(report, steering)
    _rate_control(report, steering)
    _turns(report, steering)
    _steady(report, steering)
    report.add(
        Level.INFO,
        "tuning sails",
        "SAIL_ANGLE_IDEAL, _MIN and _MAX cannot be judged by these logs",
        "the sheet follows the apparent wind by them, so that each wind was sailed with one trim: sail a reach there "
        "and back with SAIL_ANGLE_IDEAL 5 more, and again with 5 less, and compare what is learned from each",
        name="SAIL_ANGLE_IDEAL",
    )
    first: DoctorFinding | None = None
    findings = []
    for f in report.findings:
        if first is not None and f.wanted is not None:
            findings.append(replace(f, level=Level.INFO, wanted=None, why=f.why + LATER))
            continue
        if f.wanted is not None:
            first = f
        findings.append(f)
    return tuple(findings)


def _step(value: float | None, share: float) -> float | None:
    """Return a parameter moved by a share of it, ``MOST_STEP`` at most; None: it is not known, or nothing."""
    if not value:
        return None
    return float(f"{value * min(max(share, 1.0 - MOST_STEP), 1.0 + MOST_STEP):.3g}")


def _speeds_of(band: SteeringBand) -> str:
    return f"at {band.low_mps:g} to {band.high_mps:g} m/s"


def _rate_control(report: Report, steering: Steering) -> None:
    told = [b for b in steering.bands if b.ff is not None]
    if not told:
        report.add(
            Level.INFO,
            "tuning FF",
            "the logs hold too few turns to tell ATC_STR_RAT_FF by",
            "two waypoints across the wind and back, ten times, tell it",
            name="ATC_STR_RAT_FF",
        )
        return
    total_s = sum(b.turning_s for b in told)
    seen = sum(b.turning_s * (b.ff or 0.0) for b in told) / total_s
    by_band = ", ".join(f"{b.ff:.2f} {_speeds_of(b)}" for b in told)
    now = report.get("ATC_STR_RAT_FF")
    off = now is not None and now > 0.0 and abs(seen / now - 1.0) > FF_OFF
    report.add(
        Level.WARNING if off else Level.INFO,
        "tuning FF",
        f"{total_s:.0f} s of turns ask for ATC_STR_RAT_FF {seen:.2f} ({by_band})",
        "the rate of turn is not what is asked for, and P and I work against it: FF first, then P and I below it"
        if off
        else "as it is"
        if now is not None
        else "the logs do not tell what it is",
        name="ATC_STR_RAT_FF",
        wanted=_step(now, seen / now) if off and now is not None else None,
    )
    ff = [b.ff for b in told if b.ff is not None]
    if max(ff) > (1.0 + FF_APART) * min(ff):
        report.add(
            Level.INFO,
            "tuning scale",
            f"it differs with her speed: {by_band}",
            "MOT_SPD_SCA_BASE is where the rudder begins to be scaled down by the speed: too low, and she overshoots "
            "when she is fast",
            name="MOT_SPD_SCA_BASE",
        )
    for band in steering.bands:
        if band.lag_s is not None and band.lag_s > LAG_S:
            report.add(
                Level.INFO,
                "tuning lag",
                f"{_speeds_of(band)} the rate of turn follows what is asked for by {band.lag_s:.1f} s",
                "a slow servo, play in the rudder, or ATC_STR_RAT_FLTT: gains above what this allows swing",
            )


def _swings(report: Report, steering: Steering) -> None:
    swinging = [b for b in steering.bands if b.swing_hz is not None and b.swing_rad > SWINGS_RAD]
    if swinging:
        worst = max(swinging, key=lambda b: b.swing_rad)
        report.add(
            Level.WARNING,
            "tuning P",
            f"{_speeds_of(worst)} bow and rudder swing together by {math.degrees(worst.swing_rad):.0f} degrees, "
            f"{worst.swing_hz:.2f} times a second",
            "too much ATC_STR_RAT_P, unless it is the waves: judge it in flat water",
            name="ATC_STR_RAT_P",
            wanted=_step(report.get("ATC_STR_RAT_P"), 1.0 - MOST_STEP),
        )
        return
    busy = [b for b in steering.bands if b.reversals_per_min is not None and b.reversals_per_min > MANY_REVERSALS]
    if busy:
        worst = max(busy, key=lambda b: b.reversals_per_min or 0.0)
        report.add(
            Level.WARNING,
            "tuning P",
            f"{_speeds_of(worst)} the rudder reverses {worst.reversals_per_min:.0f} times a minute on a course",
            "it wears the servo, brakes the boat and steers nothing: less ATC_STR_RAT_P",
            name="ATC_STR_RAT_P",
            wanted=_step(report.get("ATC_STR_RAT_P"), 1.0 - MOST_STEP),
        )


def _turns(report: Report, steering: Steering) -> None:
    if steering.overshoot_rad is not None and steering.overshoot_rad > OVERSHOOT_RAD:
        report.add(
            Level.WARNING,
            "tuning angle",
            f"after turns the bow goes {math.degrees(steering.overshoot_rad):.0f} degrees past the new course",
            "ATC_STR_ANG_P asks for more turn than the rudder stops in time",
            name="ATC_STR_ANG_P",
            wanted=_step(report.get("ATC_STR_ANG_P"), 0.8),
        )
    stuck = [b for b in steering.bands if b.saturated > HARD_OVER]
    if stuck:
        worst = max(stuck, key=lambda b: b.saturated)
        report.add(
            Level.WARNING,
            "tuning rate",
            f"{_speeds_of(worst)} the rudder is hard over for {100.0 * worst.saturated:.0f} % of the time",
            "more turn is asked for than she has: a rudder hard over is a brake",
            name="ATC_STR_RAT_MAX",
            wanted=_step(report.get("ATC_STR_RAT_MAX"), 1.0 - MOST_STEP),
        )
    slow = steering.tack_s is not None and steering.tack_s > SLOW_TACK_S
    if steering.time_outs or slow:
        took = "" if steering.tack_s is None else f"; one takes {steering.tack_s:.1f} s"
        report.add(
            Level.WARNING if steering.time_outs else Level.INFO,
            "tuning tacks",
            f"{steering.time_outs} of {counted(steering.tacks, 'tack')} were given up{took}",
            "where they stall, the bow is turned faster than way lasts: a lower WP_PIVOT_RATE turns by the rudder's "
            "flow, not against it",
            name="WP_PIVOT_RATE",
            wanted=_step(report.get("WP_PIVOT_RATE"), 0.8) if steering.time_outs else None,
        )


def _steady(report: Report, steering: Steering) -> None:
    for band in steering.bands:
        error = band.steady_error_rad
        if error is None or abs(error) <= LEEWARD_RAD:
            continue
        what = (
            f"{_speeds_of(band)} she lies {math.degrees(abs(error)):.0f} degrees to "
            f"{'leeward' if error > 0.0 else 'windward'} of the heading that is asked for, whichever side she heels to"
        )
        if band.low_mps < BUILDS_MPS:
            report.add(
                Level.INFO,
                "tuning I",
                what,
                "below 1 m/s ArduRover's integrator does not build: no gain mends it, the rig's balance does",
            )
        else:
            report.add(
                Level.WARNING,
                "tuning I",
                what,
                "ATC_STR_RAT_I takes too long, or ATC_STR_RAT_IMAX ends it",
                name="ATC_STR_RAT_I",
                wanted=_step(report.get("ATC_STR_RAT_I"), 1.0 + MOST_STEP),
            )
    if steering.astern > ASTERN:
        report.add(
            Level.INFO,
            "tuning astern",
            f"she goes astern for {100.0 * steering.astern:.0f} % of the time that she is steered",
            "the rudder is then turned round, as for one in reverse: in irons, or in an adverse stream, that holds her",
        )
    if steering.heeled is not None and steering.heeled > HEELED:
        report.add(
            Level.WARNING,
            "tuning heel",
            f"she heels more than SAIL_HEEL_MAX for {100.0 * steering.heeled:.0f} % of the time",
            "the sheet is not eased enough above it (ATC_SAIL_P), or it is lower than she sails by",
            name="ATC_SAIL_P",
            wanted=_step(report.get("ATC_SAIL_P"), 1.0 + MOST_STEP),
        )
