"""The picture judged: each vessel's approach, alarm and rule, the worst first."""

from __future__ import annotations

import math
from dataclasses import dataclass

from companion.traffic.approach import Alarm, AlarmLimits, Approach, OwnShip, alarm_of, cpa
from companion.traffic.colregs import Encounter, classify
from companion.traffic.picture import TrafficPicture
from companion.traffic.vessel import Vessel


@dataclass(frozen=True, slots=True, kw_only=True)
class Assessment:
    """One vessel seen from our boat."""

    vessel: Vessel
    approach: Approach
    alarm: Alarm
    encounter: Encounter
    age_s: float

    def sentence(self) -> str:
        """Return one line for the status."""
        a = self.approach
        kind = self.alarm.name.lower() if self.alarm is not Alarm.NONE else "clear"
        when = f"in {a.time_s:.0f} s" if a.is_closing else "opening"
        return (
            f"{self.vessel.label}: {kind}, {a.now_m:.0f} m at {math.degrees(a.bearing_rad):03.0f}°, "
            f"CPA {a.distance_m:.0f} m {when}, "
            f"{self.encounter.role.value} (rule {self.encounter.rule.value}: {self.encounter.reason}), "
            f"report {self.age_s:.0f} s old"
        )


def assess(
    own: OwnShip, picture: TrafficPicture, limits: AlarmLimits, twd_from_rad: float | None = None
) -> tuple[Assessment, ...]:
    """Return every vessel's assessment, the worst alarm first, then the nearest approach, then the soonest."""
    out = []
    for vessel in picture.vessels:
        approach = cpa(own, vessel, picture.t_s)
        encounter = classify(own, vessel, approach, twd_from_rad)
        # An old report's spread counts against us: a stale track must not look safe. One sigma is taken off.
        alarm = alarm_of(approach, limits, growth_m=approach.sigma_m if picture.age_s(vessel) > 30.0 else 0.0)
        out.append(Assessment(vessel=vessel, approach=approach, alarm=alarm, encounter=encounter,
                              age_s=picture.age_s(vessel)))
    return tuple(sorted(out, key=lambda x: (
        -x.alarm, x.approach.distance_m, x.approach.time_s, x.vessel.mmsi, x.vessel.branch)))
