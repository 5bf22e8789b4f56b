"""The view from ashore: what a radio brings of a companion, and nothing else."""

from __future__ import annotations

import math

from companion.geo.angles import heading_of
from companion.geo.frame import LocalFrame
from companion.mavlink.wire import StatusReport
from companion.messages import AutopilotStatus, VehicleState
from companion.view import values
from companion.view.area import AreaView, drawn
from companion.view.events import Event
from companion.view.parts import by_age, heard_vessel, shown
from companion.view.values import compass, place, rounded, signed, tack_of

LATE_S = 10.0  # the companion speaks every two seconds; a radio loses some


class HeardFold:
    """Turns reports into views. The local metres begin where the boat was first heard of."""

    def __init__(self, name: str = "") -> None:
        self.area: AreaView | None = None
        self._name = name
        self._frame: LocalFrame | None = None
        self._phase, self._phase_s, self._alert = "", 0.0, ""
        self._number = 0

    def take(
        self,
        t_s: float,
        report: StatusReport | None,
        vehicle: VehicleState | None,
        autopilot: AutopilotStatus | None,
        unix_s: float | None = None,
    ) -> tuple[values.View, tuple[Event, ...]]:
        """Return the view at ``t_s``, and what has changed; ``report`` None: no companion was heard."""
        status = None if report is None else report.status
        position = vehicle.position if vehicle is not None else None if status is None else status.position
        if position is not None and self._frame is None:
            self._frame = LocalFrame(position)
            self.area = drawn(self._name, position, (), (), (), None)
        events = tuple(self._events(t_s, unix_s, report))
        age_s = None if report is None else report.age_s
        status_age_s = None if age_s is None else age_s.get("status", min(age_s.values()))
        ages = [a for a in (status_age_s, None if vehicle is None else t_s - vehicle.t_s) if a is not None]
        alarms: tuple[values.AlarmView, ...] = ()
        if status is not None and status.alert_code:
            alarms = (
                values.AlarmView(
                    code=status.alert_code, level="warning", text=status.alert_text, age_s=rounded(status_age_s, 1)
                ),
            )
        view = values.View(
            source="radio",
            name=self._name,
            t_s=round(t_s, 3),
            unix_s=unix_s,
            age_s=rounded(min(ages), 1) if ages else None,
            area=None if self.area is None else self.area.hash,
            state=values.StateView(
                phase="not heard" if status is None else status.state or "state not heard yet",
                why="no companion is heard on this link" if status is None else status.alert_text,
                age_s=None if status is None else rounded(t_s - self._phase_s, 1),
                mode=None if autopilot is None or autopilot.mode is None else autopilot.mode.name,
                is_armed=None if autopilot is None else autopilot.is_armed,
            ),
            alarms=alarms,
            boat=self._boat(t_s, report, vehicle),
            wind=_wind(report, vehicle),
            water=_water(report),
            plan=_plan(report),
            vessels=heard_vessel(
                None if status is None else status.traffic, None if age_s is None else age_s.get("traffic")
            ),
            orders=values.OrdersView(
                standing=None
                if status is None or not status.order
                else values.StandingView(verb=status.order, words=status.order, age_s=rounded(status.order_age_s, 0))
            ),
            figures=values.Figures(
                tacks=None if status is None else status.tacks,
                replans=None if status is None else status.replans,
                goals=None if status is None else status.goal_count,
                goals_reached=None if status is None else status.goal_index,
            ),
            shown=shown({} if status is None else dict(status.figures)),
            health=_health(t_s, report, vehicle, autopilot),
        )
        return view, events

    def _boat(self, t_s: float, report: StatusReport | None, vehicle: VehicleState | None) -> values.BoatView:
        status = None if report is None else report.status
        position = vehicle.position if vehicle is not None else None if status is None else status.position
        if position is None or self._frame is None:
            return values.BoatView()
        age_s = t_s - vehicle.t_s if vehicle is not None else None if report is None else report.age_s.get("status")
        twd_rad = None if status is None else status.twd_from_rad
        return values.BoatView(
            age_s=rounded(age_s, 1),
            lat_deg=rounded(position.lat_deg, 7),
            lon_deg=rounded(position.lon_deg, 7),
            at_en_m=place(self._frame.en_from_geo(position)),
            tack=None
            if twd_rad is None or vehicle is None
            else tack_of(math.remainder(twd_rad - vehicle.heading_rad, 2.0 * math.pi)),
            clearance_m=None if status is None else rounded(status.clearance_m),
            cross_track_m=None if status is None else rounded(status.cross_track_m),
            waypoint_m=None if status is None else rounded(status.waypoint_distance_m),
            goal_m=None if status is None else rounded(status.goal_distance_m),
            battery_v=None if status is None else rounded(status.battery_v),
            heading_deg=None if vehicle is None else compass(vehicle.heading_rad),
            cog_deg=None if vehicle is None else compass(heading_of(*vehicle.velocity_en_mps)),
            sog_mps=None if vehicle is None else rounded(vehicle.speed_mps),
        )

    def _events(self, t_s: float, unix_s: float | None, report: StatusReport | None) -> list[Event]:
        """Return what has changed since the last report."""
        out: list[Event] = []
        status = None if report is None else report.status
        if status is None:
            return out

        def add(kind: str, title: str, text: str, level: values.Level) -> None:
            self._number += 1
            out.append(
                Event(
                    number=self._number,
                    t_s=round(t_s, 2),
                    unix_s=unix_s,
                    kind=kind,
                    level=level,
                    title=title,
                    text=text,
                )
            )

        if status.state and status.state != self._phase:
            self._phase, self._phase_s = status.state, t_s
            add("phase", status.state, status.alert_text, "notice")
        if status.alert_code and status.alert_code != self._alert:
            add("said", status.alert_code, status.alert_text, "warning")
        self._alert = status.alert_code
        return out


def _wind(report: StatusReport | None, vehicle: VehicleState | None) -> values.WindView | None:
    status = None if report is None else report.status
    if report is None or status is None or status.twd_from_rad is None:
        return None
    return values.WindView(
        health="good",
        twd_from_deg=compass(status.twd_from_rad),
        tws_mps=rounded(status.tws_mps),
        mean_twd_from_deg=compass(status.twd_from_rad),
        mean_tws_mps=rounded(status.tws_mps),
        sigma_deg=None if status.twd_sigma_rad is None else rounded(math.degrees(status.twd_sigma_rad)),
        tws_sigma_mps=rounded(status.tws_sigma_mps),
        twa_deg=None if vehicle is None else signed(status.twd_from_rad - vehicle.heading_rad),
        age_s=rounded(min((a for n, a in report.age_s.items() if n in {"status", "wind", "co_twd"}), default=None), 1),
    )


def _water(report: StatusReport | None) -> values.WaterView | None:
    status = None if report is None else report.status
    if status is None or status.current_set_rad is None or status.current_drift_mps is None:
        return None
    return values.WaterView(
        set_deg=compass(status.current_set_rad), drift_mps=rounded(status.current_drift_mps), is_planned=True
    )


def _plan(report: StatusReport | None) -> values.PlanView | None:
    status = None if report is None else report.status
    if status is None or (status.plan_id is None and status.promised_risk is None):
        return None
    return values.PlanView(
        number=status.plan_id,
        age_s=rounded(status.plan_age_s, 1),
        promised_risk=rounded(status.promised_risk, 4),
        delta_s=None if status.promised_risk is None else rounded(1.0 - status.promised_risk, 4),
        replans=status.replans,
        next_tack_s=rounded(status.next_tack_s, 0),
        leg=status.waypoint_seq,
        count=status.waypoint_count,
    )


def _health(
    t_s: float, report: StatusReport | None, vehicle: VehicleState | None, autopilot: AutopilotStatus | None
) -> tuple[values.Part, ...]:
    parts = [
        values.Part(
            name="autopilot",
            grade=by_age(None if autopilot is None else t_s - autopilot.t_s),
            age_s=None if autopilot is None else rounded(t_s - autopilot.t_s, 1),
        )
    ]
    if vehicle is not None:
        parts.append(values.Part(name="position", grade=by_age(t_s - vehicle.t_s), age_s=rounded(t_s - vehicle.t_s, 1)))
    if report is None:
        return (*parts, values.Part(name="companion", grade="unknown", text="not heard"))
    grade: values.Grade = "good" if report.newest_age_s <= LATE_S else "bad"
    parts.append(values.Part(name="companion", grade=grade, age_s=rounded(report.newest_age_s, 1)))
    if report.status.plan_answer_s is not None:
        parts.append(
            values.Part(
                name="planner", grade="poor", text=f"slow, nine plans of ten in {report.status.plan_answer_s:.0f} s"
            )
        )
    parts += [
        values.Part(name=f"radio: {name}", grade="good" if age_s <= LATE_S else "poor", age_s=rounded(age_s, 1))
        for name, age_s in report.age_s.items()
    ]
    return tuple(parts)
