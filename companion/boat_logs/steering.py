"""How an autopilot steered, by its own log or what it sent: what its tuning is judged by."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat import SteeringLog
from companion.boat.steering import STEP_S, runs_of
from companion.boat_logs.read import MESSAGES, Skipped, bytes_of
from companion.boat_logs.recordings import State, Tlog, dataflash, messages_of
from companion.boat_logs.rows import AT_REST, LEAST_SAMPLES, UnusableLogError
from companion.errors import InputError
from companion.geo.angles import wrap_pi_array
from companion.messages import Mode
from companion.telemetry.folder import TLOG, parts
from companion.words import counted

_MESSAGES = MESSAGES | {
    wire.MAVLINK_MSG_ID_SERVO_OUTPUT_RAW,
    wire.MAVLINK_MSG_ID_NAV_CONTROLLER_OUTPUT,
    wire.MAVLINK_MSG_ID_PID_TUNING,
    wire.MAVLINK_MSG_ID_PARAM_VALUE,
    wire.MAVLINK_MSG_ID_STATUSTEXT,
}
_STEERER, _FULL_STEER = 26, 4500.0  # a servo's function, ground steering; the controller's full output in a .BIN
_PWM = (1100.0, 1500.0, 1900.0)  # least, middle and most of a servo, unless its parameters say otherwise
_HANDS_ON = AT_REST | {Mode.MANUAL}
_HELD_S = 1.5  # between samples that are farther apart nothing is known
# No leg is so near to its end for so long: she loiters there, and her circles are no turns onto a course.
_LOITER_M, _LOITER_S = 25.0, 60.0
_NAN = math.nan


@dataclass(slots=True)
class _Series:
    """Readings by name in the making, (t_s, value) each, and what else a log tells of steering."""

    values: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    servos: list[tuple[float, tuple[float, ...]]] = field(default_factory=list)
    tacks_s: list[float] = field(default_factory=list)
    time_outs_s: list[float] = field(default_factory=list)

    def take(self, t_s: float, **values: float) -> None:
        for name, value in values.items():
            readings = self.values.setdefault(name, [])
            if not readings or t_s > readings[-1][0]:
                readings.append((t_s, float(value)))

    def text(self, t_s: float, text: str) -> None:
        if text.startswith("Sailboat: Tacking timed out"):
            self.time_outs_s.append(t_s)
        elif text.startswith("Sailboat: Tacking"):
            self.tacks_s.append(t_s)

    def at(self, name: str, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        known = np.array(self.values.get(name, []), dtype=np.float64).reshape(-1, 2)
        if known.shape[0] < 2:
            return np.full(t_s.shape, _NAN)
        out = np.interp(t_s, known[:, 0], known[:, 1])
        i = np.clip(np.searchsorted(known[:, 0], t_s), 1, known.shape[0] - 1)
        apart = known[i, 0] - known[i - 1, 0]
        out[(apart > _HELD_S) | (t_s < known[0, 0]) | (t_s > known[-1, 0])] = _NAN
        return out

    def angle_at(self, name: str, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        known = self.values.get(name, [])
        turned = np.unwrap([value for _, value in known]) if known else np.zeros(0)
        self.values[f"{name} unwrapped"] = [(t, float(a)) for (t, _), a in zip(known, turned, strict=True)]
        return wrap_pi_array(self.at(f"{name} unwrapped", t_s))

    def state_at(self, name: str, t_s: NDArray[np.float64]) -> NDArray[np.float64]:
        known = np.array(self.values.get(name, []), dtype=np.float64).reshape(-1, 2)
        if known.shape[0] == 0:
            return np.zeros(t_s.shape)
        return np.asarray(known[np.maximum(np.searchsorted(known[:, 0], t_s, side="right") - 1, 0), 1])

    def log(self, name: str) -> SteeringLog:
        bow = self.values.get("heading", [])
        if len(bow) < LEAST_SAMPLES:
            raise UnusableLogError(f"it tells the heading {counted(len(bow), 'time')}, of {LEAST_SAMPLES} at least")
        if self.servos:
            self._rudder_from_servos()
        known = len(self.values.get("rudder", []))
        if known < LEAST_SAMPLES:
            told = f"it tells where the rudder was {counted(known, 'time')}, of {LEAST_SAMPLES} at least"
            raise UnusableLogError(f"{told} (STER in a .BIN, SERVO_OUTPUT_RAW in a .tlog)")
        t = np.arange(bow[0][0], bow[-1][0], STEP_S)
        heading = self.angle_at("heading", t)
        ahead = self.at("ve", t) * np.sin(heading) + self.at("vn", t) * np.cos(heading)
        rudder = self.at("rudder", t)
        if self.servos:  # what a servo is told is scaled by speed already
            base = self.parameters.get("MOT_SPD_SCA_BASE", 1.0)
            rudder = rudder * (np.maximum(np.abs(ahead) / base, 1.0) if base > 0.0 else 1.0)
        steered = (self.state_at("steered", t) > 0.5) & ~_loiters(self.at("wp_m", t))

        def on_legs(times_s: list[float]) -> tuple[float, ...]:
            return tuple(at for at in times_s if steered[min(int(np.searchsorted(t, at)), t.shape[0] - 1)])

        return SteeringLog(
            name=name,
            t_s=t,
            heading_rad=heading,
            rate_radps=self.at("rate", t),
            wanted_rate_radps=self.at("wanted_rate", t),
            wanted_heading_rad=self.angle_at("wanted_heading", t),
            rudder=np.clip(rudder, -1.0, 1.0),
            ahead_mps=ahead,
            heel_rad=self.at("heel", t),
            is_steered=steered,
            tacks_s=on_legs(self.tacks_s),
            time_outs=len(on_legs(self.time_outs_s)),
            parameters=self.parameters,
        )

    def _rudder_from_servos(self) -> None:
        names = (f"SERVO{n}" for n in range(1, 9))
        servo = next((n for n in names if self.parameters.get(f"{n}_FUNCTION") == _STEERER), "SERVO1")
        low, middle, high = (
            self.parameters.get(f"{servo}_{what}", pwm) for what, pwm in zip(("MIN", "TRIM", "MAX"), _PWM, strict=True)
        )
        turned = -1.0 if self.parameters.get(f"{servo}_REVERSED", 0.0) else 1.0
        for t_s, all_pwm in self.servos:
            pwm = all_pwm[int(servo[5:]) - 1]
            if pwm > 0.0:
                share = (pwm - middle) / max(high - middle if pwm > middle else middle - low, 1.0)
                self.take(t_s, rudder=turned * share)


def _loiters(wp_m: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Return (n,) whether she lies about a waypoint, by how far off it she is [m], ``STEP_S`` apart."""
    out = np.zeros(wp_m.shape, dtype=np.bool_)
    for run in runs_of(wp_m <= _LOITER_M, round(_LOITER_S / STEP_S)):
        out[run] = float(np.ptp(wp_m[run])) > 0.0  # steered by headings it is 0 all the time
    return out


def read_steering(paths: list[Path]) -> tuple[list[SteeringLog], list[Skipped]]:
    """Return how the autopilot steered in each .BIN, .tlog and voyage folder, and which tell nothing of it."""
    read: list[SteeringLog] = []
    skipped: list[Skipped] = []
    for path in paths:
        try:
            read.append(_steering(path))
        except UnusableLogError as why:
            skipped.append(Skipped(name=str(path), why=str(why)))
        except InputError as error:
            skipped.append(Skipped(name=str(path), why=error.problem))
    return read, skipped


def _steering(path: Path) -> SteeringLog:
    series = _Series()
    files = [p for p in parts(path / TLOG) if p.stat().st_size > 0] if path.is_dir() else [path]
    if files and not any(p.stat().st_size for p in files):
        raise UnusableLogError("it is empty")
    name = files[0].name.lower().removesuffix(".gz") if files else ""
    if name.endswith(".bin"):
        _steering_of_bin(path, bytes_of(path), series)
    elif name.endswith(".tlog") or TLOG in name:
        _steering_of_tlog(files, series)
    else:
        raise UnusableLogError("only .BIN and .tlog tell how it was steered")
    return series.log(str(path))


def _steering_of_tlog(files: list[Path], series: _Series) -> None:
    for t_s, m in Tlog(files, _MESSAGES):
        kind = m.get_type()
        if kind == "ATTITUDE":
            series.take(t_s, heading=m.yaw, rate=m.yawspeed, heel=m.roll)
        elif kind == "GLOBAL_POSITION_INT":
            series.take(t_s, ve=m.vy / 100.0, vn=m.vx / 100.0)
        elif kind == "SERVO_OUTPUT_RAW":
            if m.port == 0:
                series.servos.append((t_s, tuple(float(getattr(m, f"servo{n}_raw")) for n in range(1, 9))))
        elif kind == "NAV_CONTROLLER_OUTPUT":
            series.take(t_s, wanted_heading=math.radians(m.nav_bearing), wp_m=m.wp_dist)
        elif kind == "PID_TUNING":
            if m.axis == wire.PID_TUNING_STEER:
                series.take(t_s, wanted_rate=math.radians(m.desired))
        elif kind == "PARAM_VALUE":
            series.parameters[m.param_id] = m.param_value
        elif kind == "STATUSTEXT":
            series.text(t_s, m.text)
        elif kind == "HEARTBEAT" and m.autopilot != wire.MAV_AUTOPILOT_INVALID:
            armed = bool(m.base_mode & wire.MAV_MODE_FLAG_SAFETY_ARMED)
            series.take(t_s, steered=float(armed and m.custom_mode not in _HANDS_ON))


def _steering_of_bin(path: Path, data: bytes, series: _Series) -> None:
    state = State()
    with dataflash(path, data) as log:
        for t_s, kind, m in messages_of(log, ("ATT", "XKF1", "STER", "NTUN", "PARM", "MSG", "MODE", "ARM"), []):
            if kind == "ATT":
                series.take(t_s, heading=math.radians(m.Yaw), heel=math.radians(m.Roll))
            elif kind == "XKF1":
                if getattr(m, "C", 0) == 0:
                    series.take(t_s, ve=m.VE, vn=m.VN)
            elif kind == "STER":
                rates = {"wanted_rate": math.radians(m.DesTurnRate), "rate": math.radians(m.TurnRate)}
                series.take(t_s, rudder=m.SteerOut / _FULL_STEER, **rates)
            elif kind == "NTUN":
                series.take(t_s, wanted_heading=math.radians(m.DesYaw), wp_m=getattr(m, "WpDist", _NAN))
            elif kind == "PARM":
                series.parameters[m.Name] = m.Value
            elif kind == "MSG":
                series.text(t_s, m.Message)
            else:
                state.take(kind, m)
                series.take(t_s, steered=float(state.is_armed and state.mode not in _HANDS_ON))
