"""The examination: every check of an autopilot and of this computer, and their findings, worst first."""

from __future__ import annotations

from companion.doctor.failsafes import failsafes, fence, sounder
from companion.doctor.report import DoctorFinding, Examined, Level, Needs, Report
from companion.doctor.sailing import boat, navigation, wind
from companion.doctor.vehicle import identity, mission, signing, streams, version
from companion.mavlink.wire import believable

LATE, NARROW = 0.03, 0.3  # of the reference core: plans come late; in narrow water they are not as fast


def examine(seen: Examined, needs: Needs) -> tuple[DoctorFinding, ...]:
    """Return the findings, worst first, each once."""
    report = Report(seen.parameters)
    if not seen.parameters:
        report.add(
            Level.ERROR,
            "no parameters",
            "no parameter was answered",
            "what is not signed is not answered on this link"
            if seen.is_signed and not seen.has_key
            else "is another program using the link, or does a router in between let nothing through to it?",
        )
    else:
        report.expect(Level.ERROR, "FRAME_CLASS", 2.0, "no order is given to anything but a boat")
        for why in believable(seen.parameters)[1]:
            report.add(
                Level.ERROR, "impossible", why, "the companion sails by the default in its place", name=why.split()[0]
            )
        if needs.sails:
            boat(report, needs)
            wind(report)
        else:
            report.expect(Level.ERROR, "SAIL_ENABLE", 0.0, "the mission is for a motor boat")
        navigation(report, needs)
        fence(report, seen, needs)
        failsafes(report, needs)
        sounder(report, needs)
        identity(report, seen)
    signing(report, seen)
    version(report, seen)
    mission(report, seen)
    streams(report, seen)
    _computer(report, seen)
    return tuple(sorted(report.findings, key=lambda f: (-f.level, f.code)))


def _computer(report: Report, seen: Examined) -> None:
    """Say how fast this computer plans, where that was measured, and what follows from it."""
    speed = seen.planner_speed
    if speed is None:
        return
    what = f"this computer plans at {100.0 * speed:.0f} % of the reference core"
    if speed >= NARROW:
        report.add(Level.INFO, "computer", what, "as good as plans can be, and in time")
    elif speed >= LATE:
        report.add(
            Level.INFO,
            "computer",
            what,
            "plans come in time; in narrow water they are somewhat slower ways: "
            "less is looked at in their budget ([skipper] planning_budget_s)",
        )
    else:
        report.add(
            Level.WARNING,
            "computer",
            what,
            "plans come late, and are asked for so much earlier; is something "
            "else at work on it, or is it throttled by heat or a weak supply?",
        )
