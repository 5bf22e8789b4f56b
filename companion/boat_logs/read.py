"""Logs to learn a boat or a wind from: those among files and folders, each read once, and why others are not."""

from __future__ import annotations

import csv
import gzip
import hashlib
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat import BoatLog
from companion.boat_logs.recordings import State, Tlog, dataflash, messages_of
from companion.boat_logs.rows import AT_REST, Rows, UnusableLogError, Winds
from companion.boat_logs.text import read_csv, read_nmea
from companion.errors import InputError, unreadable
from companion.telemetry.folder import TLOG, TRACK, parts
from companion.wind.study import Record

ENDINGS = (".tlog", ".bin", ".csv", ".nmea", ".txt", ".log")
GPS_EPOCH_S, WEEK_S, LEAP_S = (315_964_800.0, 604_800.0, 18.0)  # GPS time 0 [Unix s]; leap seconds since 2017
MESSAGES = frozenset(
    {
        wire.MAVLINK_MSG_ID_HEARTBEAT,
        wire.MAVLINK_MSG_ID_ATTITUDE,
        wire.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        wire.MAVLINK_MSG_ID_WIND,
        wire.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT,
        wire.MAVLINK_MSG_ID_VFR_HUD,
    }
)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadLog:
    """A log as it was read: ``digest`` is of its bytes, ``system`` the autopilot's (None: it says none)."""

    log: BoatLog
    digest: str
    system: int | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Skipped:
    """A log that is of no use, and why."""

    name: str
    why: str


def why_none(names: Sequence[Path], skipped: Sequence[Skipped]) -> str:
    """Return why no log is of use, where there was one at the most under these names: its name, and the reason."""
    if not skipped:
        return f"{', '.join(map(str, names))}: no log is in there"
    return f"{skipped[0].name}: {skipped[0].why}"


def logs_under(names: list[Path]) -> list[Path]:
    """Return the logs among files and folders: a folder is a voyage's, or holds voyages and logs.

    Raises:
        InputError: there is none of that name.
    """
    found: list[Path] = []
    for name in names:
        if not name.exists():
            raise InputError(str(name), "", "no such file or folder", "give voyage folders, .tlog, .BIN, CSV or NMEA")
        found += _in_folder(name) if name.is_dir() else [name]
    return found


def _in_folder(folder: Path) -> list[Path]:
    if _is_voyage(folder):
        return [folder]
    inside = sorted(folder.iterdir())
    found = [p for p in inside if p.is_file() and p.suffix.lower() in ENDINGS]
    for path in inside:
        if path.is_dir() and not path.is_symlink():
            found += _in_folder(path)
    return found


def _is_voyage(folder: Path) -> bool:
    return bool(parts(folder / TLOG)) or (folder / TRACK).is_file()


def read_logs(
    paths: list[Path], tell: Callable[[int, str], None] = lambda _count, _name: None
) -> tuple[list[ReadLog], list[Skipped]]:
    """Return the logs that can be read, each one once, and those that cannot; ``tell`` hears of each before it."""
    read: list[ReadLog] = []
    skipped: list[Skipped] = []
    digests: dict[str, str] = {}
    system: int | None = None
    for count, path in enumerate(paths):
        tell(count, str(path))
        try:
            one = _read(path)
        except UnusableLogError as why:
            skipped.append(Skipped(name=str(path), why=str(why)))
            continue
        except InputError as error:
            skipped.append(Skipped(name=str(path), why=error.problem))
            continue
        if one.digest in digests:
            skipped.append(Skipped(name=str(path), why=f"it is the same as {digests[one.digest]}"))
        elif system is not None and one.system is not None and one.system != system:
            skipped.append(
                Skipped(name=str(path), why=f"it is of system {one.system}, and those before it are of system {system}")
            )
        else:
            digests[one.digest] = str(path)
            system = one.system if system is None else system
            read.append(one)
    return read, skipped


def read_wind(path: Path) -> Record:
    """Return every reading of the true wind in a .tlog or .BIN; those within 10 s of a turn are marked.

    Raises:
        InputError: it cannot be read, or holds no wind.
    """
    rows, data = Winds(), bytes_of(path)
    if not data:
        raise InputError(str(path), "", "is empty", "name a tlog or .bin")
    try:
        _fill([path], [data], rows)
        return rows.record(path.name)
    except UnusableLogError as why:
        raise InputError(str(path), "", str(why), "log or request WIND (message 168)") from None


def _read(path: Path) -> ReadLog:
    if path.is_dir():
        heard = [p for p in parts(path / TLOG) if p.stat().st_size > 0]
        files = heard or [path / TRACK]
    else:
        files = [path]
    if not files[0].is_file():
        raise UnusableLogError("it is no file")
    data = [bytes_of(p) for p in files]
    if not any(data):
        raise UnusableLogError("it is empty")
    digest = hashlib.sha256(b"".join(data)).hexdigest()[:16]
    rows = Rows()
    system = _fill(files, data, rows)
    return ReadLog(log=rows.log(str(path)), digest=digest, system=system)


def _fill(files: list[Path], data: list[bytes], rows: Rows) -> int | None:
    """Read what the files of one log hold into ``rows``; return the autopilot's system number, None: it says none."""
    ending = files[0].name.lower().removesuffix(".gz").rpartition(".")[2]
    try:
        if ending == "tlog" or TLOG in files[0].name:
            return _tlog(files, rows)
        if ending == "bin":
            _bin(files[0], data[0], rows)
        elif ending == "csv":
            read_csv(data[0], rows)
        else:
            read_nmea(data[0], rows)
    except (gzip.BadGzipFile, csv.Error) as error:
        raise UnusableLogError(f"it is damaged ({str(error)[:60]})") from None
    return None


def bytes_of(path: Path) -> bytes:
    """Return what a file holds. Raises InputError."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise unreadable(str(path), error) from error


def _tlog(files: list[Path], rows: Rows) -> int | None:
    log = Tlog(files, MESSAGES)
    for t_s, message in log:
        _message(t_s, message.get_type(), message, rows)
    if log.jumps:
        rows.notes.append(f"the logger's clock jumps, by up to {log.most_s:.0f} s: the autopilot's own is taken")
    return log.system


def _message(t_s: float, kind: str, message: Any, rows: Rows) -> None:
    if kind == "ATTITUDE":
        rows.take(t_s, heading=message.yaw)
    elif kind == "WIND":
        rows.take(t_s, twd=math.radians(message.direction), tws=message.speed)
    elif kind == "NAMED_VALUE_FLOAT":
        if message.name == "AppWndDir":
            rows.take(t_s, awa=math.radians(message.value))
        elif message.name == "AppWndSpd":
            rows.take(t_s, aws=message.value)
    elif kind == "VFR_HUD":
        rows.take(t_s, motor=message.throttle)
    elif kind == "HEARTBEAT":
        armed = bool(message.base_mode & wire.MAV_MODE_FLAG_SAFETY_ARMED)
        rows.take(t_s, rest=float(not armed or message.custom_mode in AT_REST))
    elif kind == "GLOBAL_POSITION_INT":
        if message.lat or message.lon:
            rows.take(t_s, lat=message.lat / 1e7, lon=message.lon / 1e7)
        rows.take(t_s, ve=message.vy / 100.0, vn=message.vx / 100.0)
        rows.sample(t_s)


def _bin(path: Path, data: bytes, rows: Rows) -> None:
    """Read an autopilot's own log."""
    state, offset_s = State(), None
    with dataflash(path, data) as log:
        for t_s, kind, m in messages_of(log, ("ATT", "XKF1", "POS", "GPS", "WIND", "MODE", "ARM", "THR"), rows.notes):
            if kind == "GPS":
                if offset_s is None and m.Status >= 3 and m.GWk > 0:
                    offset_s = GPS_EPOCH_S + m.GWk * WEEK_S + m.GMS / 1e3 - LEAP_S - t_s
                if m.Status >= 3:
                    course = math.radians(m.GCrs)
                    rows.take(t_s, gps_ve=m.Spd * math.sin(course), gps_vn=m.Spd * math.cos(course))
            elif kind == "ATT":
                rows.take(t_s, heading=math.radians(m.Yaw))
                if not math.isfinite(rows.of(t_s, "ve")):
                    rows.take(t_s, ve=rows.of(t_s, "gps_ve"), vn=rows.of(t_s, "gps_vn"))
                rows.sample(t_s)
            elif kind == "XKF1":
                if getattr(m, "C", 0) == 0:
                    rows.take(t_s, ve=m.VE, vn=m.VN)
            elif kind == "POS":
                rows.take(t_s, lat=m.Lat, lon=m.Lng)
            elif kind == "WIND":
                rows.take(t_s, awa=math.radians(m.DrApp), aws=m.SpdApp)
                if hasattr(m, "DrTru"):
                    rows.take(t_s, twd=math.radians(m.DrTru), tws=m.SpdTru)
            elif kind == "THR":
                rows.take(t_s, motor=abs(m.ThrOut))
            else:
                state.take(kind, m)
                rows.take(t_s, rest=float(not state.is_armed or state.mode in AT_REST))
    if offset_s is not None:
        rows.rows = [(row[0] + offset_s, *row[1:]) for row in rows.rows]
