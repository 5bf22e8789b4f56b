"""Logs of a boat as one value each: voyage folders, .tlog, .BIN, CSV and NMEA 0183.

What cannot be used is said and skipped: a log without wind, one of two boats, one that another program cut off. Time
is the autopilot's own where there is one, because the clock of whoever wrote the log may jump.
"""

from __future__ import annotations

import csv
import datetime as dt
import gzip
import hashlib
import io
import math
import zlib
from collections.abc import Callable, Iterator
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.boat.log import BoatLog
from companion.boat.steering import STEP_S as STEP_OF_STEERING_S
from companion.boat.steering import SteeringLog
from companion.errors import InputError, unreadable
from companion.geo import MPS_PER_KNOT
from companion.geo.angles import wrap_pi_array
from companion.geo.frame import LocalFrame
from companion.mavlink.tlog import read_tlog
from companion.mavlink.wire import Dialect
from companion.messages import GeoPoint, Mode, VehicleState, WindSample
from companion.telemetry.folder import TLOG, TRACK, parts
from companion.wind import apparent_wind
from companion.wind.study import Record

LEAST_SAMPLES = 60
STEP_S = 0.95  # samples are so far apart at least
STALE_S = 2.5  # a reading older than this is none
REBOOT_BACK_S = 5.0
TURN_S, TURN_RAD = 10.0, math.radians(25.0)  # the bow so far round within it: vane and compass lag
JUMP_S = 5.0  # the logger's clock against the autopilot's
MOTOR_PERCENT = 5.0
MOST_WIND_MPS = 100.0  # more is no reading
# The sheets are eased, the boat lies or is not a boat yet.
AT_REST = frozenset({Mode.HOLD, Mode.LOITER, Mode.INITIALISING, Mode.DOCK})
ENDINGS = (".tlog", ".bin", ".csv", ".nmea", ".txt", ".log")
_NAN = math.nan
_NOWHERE = GeoPoint(lat_deg=0.0, lon_deg=0.0)  # what the wind on board does not depend on
_BIN_HEAD = bytes([0xA3, 0x95, 0x80])  # a log describes its own format first


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


@dataclass(slots=True)
class _Rows:
    """Samples in the making: what was read last of everything, and when [s]."""

    rows: list[tuple[float, ...]] = field(default_factory=list)
    now: dict[str, tuple[float, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    last_s: float = -math.inf
    shift_s: float = 0.0

    def take(self, t_s: float, **values: float) -> None:
        for name, value in values.items():
            self.now[name] = (t_s, float(value))

    def of(self, t_s: float, name: str, stale_s: float = STALE_S) -> float:
        at_s, value = self.now.get(name, (-math.inf, _NAN))
        return value if abs(t_s - at_s) <= stale_s else _NAN

    def sample(self, t_s: float) -> None:
        """Keep what is known at ``t_s``, unless the last sample is hardly older."""
        if t_s < self.last_s - REBOOT_BACK_S:
            self.notes.append(f"its time steps back by {self.last_s - t_s:.0f} s: what follows is another outing")
            self.last_s = -math.inf
            if self.rows:
                self.shift_s = self.rows[-1][0] - t_s + 3600.0
        if t_s - self.last_s < STEP_S:
            return
        self.last_s = t_s
        heading, ve, vn = self.of(t_s, "heading"), self.of(t_s, "ve"), self.of(t_s, "vn")
        awa, aws = self.of(t_s, "awa"), self.of(t_s, "aws")
        if not math.isfinite(awa + aws):
            awa, aws = self._felt(t_s, heading, ve, vn)
        self.rows.append(
            (
                t_s + self.shift_s,
                ve,
                vn,
                heading,
                awa,
                aws,
                self.of(t_s, "lon"),
                self.of(t_s, "lat"),
                self.of(t_s, "stw"),
                self.of(t_s, "rest", 1e9),
                self.of(t_s, "motor", 5.0),
            )
        )

    def _felt(self, t_s: float, heading: float, ve: float, vn: float) -> tuple[float, float]:
        """Return the apparent wind's angle and speed by the true wind that was told; NaN where one is unknown."""
        twd, tws = self.of(t_s, "twd"), self.of(t_s, "tws")
        if not (math.isfinite(heading + ve + vn + twd) and 0.0 <= tws <= MOST_WIND_MPS):
            return _NAN, _NAN
        boat = VehicleState(t_s=t_s, boot_s=0.0, position=_NOWHERE, velocity_en_mps=(ve, vn), heading_rad=heading)
        felt = apparent_wind(WindSample(t_s=t_s, twd_from_rad=twd, tws_mps=tws), boat)
        return felt.awa_rad, felt.aws_mps

    def log(self, name: str) -> BoatLog:
        """Return the log. Raises _Useless: it is none to learn from."""
        table = np.array(self.rows, dtype=np.float64).reshape(len(self.rows), 11)
        for what, column, remedy in (
            ("the boat's speed", 1, "GLOBAL_POSITION_INT, or RMC"),
            ("the heading", 3, "ATTITUDE, or HDG"),
            ("the wind", 5, "WIND or the apparent wind (AppWndDir), or MWV"),
        ):
            known = int(np.sum(np.isfinite(table[:, column])))
            if known < LEAST_SAMPLES:
                raise _Useless(f"it tells {what} in {known} of {len(table)} samples ({remedy})")
        return BoatLog(
            name=name,
            t_s=table[:, 0],
            velocity_en_mps=table[:, 1:3],
            heading_rad=table[:, 3],
            awa_rad=table[:, 4],
            aws_mps=table[:, 5],
            position_en_m=_places(table[:, 6:8]),
            stw_mps=table[:, 8],
            is_sailed=~(table[:, 9] > 0.0),
            has_motor_on=table[:, 10] > MOTOR_PERCENT,
            notes=tuple(self.notes),
        )


@dataclass(slots=True)
class _Winds(_Rows):
    """Every reading of the true wind, in place of a sample a second; the bow is then what it was last."""

    winds: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    bows: list[tuple[float, float]] = field(default_factory=list)

    def take(self, t_s: float, **values: float) -> None:
        super(_Winds, self).take(t_s, **values)  # slots make the class anew, and super() forgets it
        if "heading" in values:
            self.bows.append((t_s, values["heading"]))
        if "twd" in values and (not self.winds or t_s > self.winds[-1][0]):
            last = self.of(t_s, "heading", math.inf), self.of(t_s, "awa", math.inf)
            self.winds.append((t_s, values["twd"], values["tws"], *last))

    def sample(self, t_s: float) -> None:
        """Keep nothing: the wind's own readings are kept."""

    def record(self, name: str) -> Record:
        """Return the record. Raises _Useless: there is no wind in it."""
        known = [row for row in self.winds if all(math.isfinite(v) for v in row[:3]) and row[2] >= 0.0]
        if len(known) < 2:
            raise _Useless(f"{len(known)} WIND messages")
        t, twd, tws, heading, awa = np.array(known, dtype=np.float64).T
        turning = np.zeros(t.shape, dtype=np.bool_)
        if self.bows:
            at, bow = np.array(self.bows).T
            before = np.searchsorted(at, at - TURN_S)
            for moment in at[np.abs(wrap_pi_array(bow - bow[before])) > TURN_RAD]:
                turning[np.searchsorted(t, moment - TURN_S) : np.searchsorted(t, moment + TURN_S)] = True
        return Record(
            name=name,
            t_s=t - t[0],
            twd_from_rad=twd,
            tws_mps=tws,
            turning=turning,
            heading_rad=heading if bool(np.all(np.isfinite(heading))) else None,
            awa_rad=awa if bool(np.all(np.isfinite(awa))) else None,
        )


class _Useless(Exception):  # noqa: N818 - it never leaves this module
    pass


def _places(lonlat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return places (n, 2) east and north of the first that is known [m]; NaN unknown."""
    known = np.isfinite(lonlat_deg).all(axis=1) & (np.abs(lonlat_deg[:, 1]) <= 90.0)
    out = np.full(lonlat_deg.shape, _NAN)
    if bool(np.any(known)):
        lon_deg, lat_deg = lonlat_deg[known][0].tolist()
        frame = LocalFrame(GeoPoint(lat_deg=lat_deg, lon_deg=math.remainder(lon_deg, 360.0)))
        out[known] = frame.array_en_from_lonlat(lonlat_deg[known])
    return out


def logs_under(names: list[Path]) -> list[Path]:
    """Return the logs among files and folders: a folder is a voyage's, or holds voyages and logs.

    Raises:
        InputError: there is none of that name.
    """
    found: list[Path] = []
    for name in names:
        if not name.exists():
            raise InputError(str(name), "", "no such file or folder", "give voyage folders, .tlog, .BIN, CSV or NMEA")
        found += [name] if name.is_file() else _in_folder(name)
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
        except _Useless as why:
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
    rows, data = _Winds(), _bytes(path)
    if not data:
        raise InputError(str(path), "", "is empty", "name a tlog or .bin")
    try:
        _fill([path], [data], rows)
        return rows.record(path.name)
    except _Useless as why:
        raise InputError(str(path), "", str(why), "log or request WIND (message 168)") from None


def _read(path: Path) -> ReadLog:
    if path.is_dir():
        heard = [p for p in parts(path / TLOG) if p.stat().st_size > 0]
        files = heard or [path / TRACK]
    else:
        files = [path]
    if not files[0].is_file():
        raise _Useless("it is no file")
    data = [_bytes(p) for p in files]
    digest = hashlib.sha256(b"".join(data)).hexdigest()[:16]
    rows = _Rows()
    system = _fill(files, data, rows)
    return ReadLog(log=rows.log(str(path)), digest=digest, system=system)


def _fill(files: list[Path], data: list[bytes], rows: _Rows) -> int | None:
    """Read what the files of one log hold into ``rows``; return the autopilot's system number, None: it says none."""
    ending = files[0].name.lower().removesuffix(".gz").rpartition(".")[2]
    try:
        if ending == "tlog" or TLOG in files[0].name:
            return _tlog(files, rows)
        if ending == "bin":
            _bin(files[0], data[0], rows)
        elif ending == "csv":
            _csv(data[0], rows)
        else:
            _nmea(data[0], rows)
    except (zlib.error, EOFError, gzip.BadGzipFile, csv.Error) as error:
        raise _Useless(f"it is damaged ({str(error)[:60]})") from None
    return None


def _bytes(path: Path) -> bytes:
    try:
        return path.read_bytes()
    except OSError as error:
        raise unreadable(str(path), error) from error


# ------------------------------------------------------------------------------------------ MAVLink
_WANTED = frozenset(
    {
        wire.MAVLINK_MSG_ID_HEARTBEAT,
        wire.MAVLINK_MSG_ID_ATTITUDE,
        wire.MAVLINK_MSG_ID_GLOBAL_POSITION_INT,
        wire.MAVLINK_MSG_ID_WIND,
        wire.MAVLINK_MSG_ID_NAMED_VALUE_FLOAT,
        wire.MAVLINK_MSG_ID_VFR_HUD,
    }
)


def _autopilots(files: list[Path], numbers: AbstractSet[int]) -> Iterator[tuple[float, Any]]:
    """Yield when each message of the autopilot with one of these numbers was heard [Unix s], and the message."""
    dialect = Dialect(None)
    for record in (r for file in files for r in read_tlog(file)):
        frame = record.frame
        number = frame[5] if frame[0] == 0xFE else frame[7] | frame[8] << 8 | frame[9] << 16
        if number not in numbers:
            continue
        try:
            message = dialect.decode(bytearray(frame))
        except wire.MAVError:
            continue
        if message.get_srcComponent() == 1:
            yield record.unix_us / 1e6, message


def _tlog(files: list[Path], rows: _Rows) -> int | None:
    systems: set[int] = set()
    offset_s: float | None = None
    last_boot_s, jumps, most_s = -math.inf, 0, 0.0
    for heard_s, message in _autopilots(files, _WANTED):
        kind = message.get_type()
        if kind == "HEARTBEAT" and message.autopilot != wire.MAV_AUTOPILOT_INVALID:
            systems.add(message.get_srcSystem())
            if len(systems) > 1:
                said = " and ".join(str(s) for s in sorted(systems))
                raise _Useless(f"it tells of two boats, systems {said}: record them apart")
        boot_ms = getattr(message, "time_boot_ms", None)
        if boot_ms is not None:
            boot_s = boot_ms / 1e3
            if offset_s is None or boot_s < last_boot_s - REBOOT_BACK_S:
                offset_s = heard_s - boot_s
            elif kind == "GLOBAL_POSITION_INT" and abs(heard_s - boot_s - offset_s) > JUMP_S:
                jumps, most_s = jumps + 1, max(most_s, abs(heard_s - boot_s - offset_s))
            last_boot_s = boot_s
        t_s = heard_s if offset_s is None else last_boot_s + offset_s
        _message(t_s, kind, message, rows)
    if jumps:
        rows.notes.append(f"the logger's clock jumps, by up to {most_s:.0f} s: the autopilot's own is taken")
    return next(iter(systems), None)


def _message(t_s: float, kind: str, message: Any, rows: _Rows) -> None:
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


def _bin(path: Path, data: bytes, rows: _Rows) -> None:
    """Read an autopilot's own log. What is cut off at its end is left out, and said."""
    from pymavlink import DFReader

    if data[:3] != _BIN_HEAD:
        raise _Useless("it is no .BIN log: it does not begin as one")
    try:
        log = DFReader.DFReader_binary(str(path))
    except Exception as error:  # it raises what its parsing happens to meet
        raise _Useless(f"it is no .BIN log ({str(error)[:60] or type(error).__name__})") from None
    try:
        _bin_messages(log, rows)
    except AttributeError as missing:
        raise _Useless(f"its messages are another release's: they have no column {missing}") from None
    finally:
        log.close()


def _bin_messages(log: Any, rows: _Rows) -> None:
    armed, mode = True, -1
    offset_s: float | None = None
    while True:
        try:
            m = log.recv_match(type=["ATT", "XKF1", "POS", "GPS", "WIND", "MODE", "ARM", "THR"])
        except Exception:
            rows.notes.append("it is cut off or damaged: what is before that is used")
            break
        if m is None:
            break
        kind, t_s = m.get_type(), m.TimeUS / 1e6
        if kind == "GPS":
            if offset_s is None and m.Status >= 3 and m.GWk > 0:
                offset_s = 315_964_800.0 + m.GWk * 604_800.0 + m.GMS / 1e3 - 18.0 - t_s
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
            armed = bool(m.ArmState) if kind == "ARM" else armed
            mode = int(m.ModeNum) if kind == "MODE" else mode
            rows.take(t_s, rest=float(not armed or mode in AT_REST))
    if offset_s is not None:
        rows.rows = [(row[0] + offset_s, *row[1:]) for row in rows.rows]


# ---------------------------------------------------------------------------------------------- CSV
# A column's name without its unit, and the unit's factor.
_UNITS = {"mps": 1.0, "kn": MPS_PER_KNOT, "kt": MPS_PER_KNOT, "kts": MPS_PER_KNOT, "kmh": 1.0 / 3.6}
_SPEEDS = ("sog", "aws", "tws", "stw")
_ANGLES = ("heading", "cog", "awa", "twd")


def _csv(data: bytes, rows: _Rows) -> None:
    """Read columns ``t_s`` (or ``time``, ISO 8601), ``heading_deg, cog_deg, sog_mps`` or ``sog_kn`` and their like."""
    text = (
        gzip.decompress(data).decode("utf-8", "replace") if data[:2] == b"\x1f\x8b" else data.decode("utf-8", "replace")
    )
    reader = csv.DictReader(io.StringIO(text.lstrip("\ufeff")))
    names = {(n or "").strip().lower(): n for n in reader.fieldnames or []}
    if not {"t_s", "time"} & set(names):
        raise _Useless("its first line names no column t_s or time")
    for row in reader:
        t_s = _time(row.get(names["t_s"]) if "t_s" in names else row.get(names["time"]))
        if t_s is None:
            continue
        found: dict[str, float] = {}
        for name, column in names.items():
            what, _, unit = name.rpartition("_")
            value = _number(row.get(column))
            if value is None:
                continue
            if what in _SPEEDS and unit in _UNITS:
                found[what] = value * _UNITS[unit]
            elif what in _ANGLES and unit == "deg":
                found[what] = math.radians(value)
            elif what in {"lat", "lon"} and unit == "deg":
                found[what] = value
        mode = (row.get(names.get("mode", "")) or "").strip().upper()
        if mode:
            found["rest"] = float(mode in {m.name for m in AT_REST})
        if "sog" in found and "cog" in found:
            sog, cog = found.pop("sog"), found.pop("cog")
            found |= {"ve": sog * math.sin(cog), "vn": sog * math.cos(cog)}
        rows.take(t_s, **found)
        rows.sample(t_s)


def _number(text: str | None) -> float | None:
    try:
        value = float(text or "")
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def _time(text: str | None) -> float | None:
    value = _number(text)
    if value is not None or not text:
        return value
    try:
        at = dt.datetime.fromisoformat(text.strip())
    except ValueError:
        return None
    return (at if at.tzinfo else at.replace(tzinfo=dt.UTC)).timestamp()


# --------------------------------------------------------------------------------------------- NMEA
def _sentences(text: str) -> Iterator[list[str]]:
    for line in text.splitlines():
        start = line.find("$")
        body, star, told = line[start + 1 :].partition("*") if start >= 0 else ("", "", "")
        if not body or len(body) < 6:
            continue
        if star:
            wanted = 0
            for character in body:
                wanted ^= ord(character) & 0xFF
            try:
                if int(told.strip()[:2], 16) != wanted:
                    continue
            except ValueError:
                continue
        yield body.split(",")


def _nmea(data: bytes, rows: _Rows) -> None:
    t_s: float | None = None
    for cells in _sentences(data.decode("latin-1")):
        kind = cells[0][-3:]
        value = [_number(c) for c in cells]
        n = len(cells)
        if kind == "RMC" and n > 9:
            t_s = _rmc_time(cells) if cells[2] == "A" else None
            if t_s is None or value[7] is None:
                continue
            rows.sample(t_s)
            course = math.radians(value[8] or 0.0)
            sog = value[7] * MPS_PER_KNOT
            rows.take(t_s, ve=sog * math.sin(course), vn=sog * math.cos(course))
            lat, lon = _degrees(cells[3], cells[4]), _degrees(cells[5], cells[6])
            if lat is not None and lon is not None:
                rows.take(t_s, lat=lat, lon=lon)
            if n > 11 and value[10] is not None and "variation" not in rows.now:
                rows.take(t_s, variation=math.radians(value[10] * (-1.0 if cells[11] == "W" else 1.0)))
        elif t_s is None:
            continue
        elif kind == "HDT" and n > 1 and value[1] is not None:
            rows.take(t_s, heading=math.radians(value[1]))
        elif kind in {"HDG", "HDM"} and n > 1 and value[1] is not None:
            variation = rows.now.get("variation", (0.0, 0.0))[1]
            if kind == "HDG" and n > 5 and value[4] is not None:
                variation = math.radians(value[4] * (-1.0 if cells[5] == "W" else 1.0))
            rows.take(t_s, heading=math.radians(value[1]) + variation)
        elif kind == "VHW" and n > 6 and value[5] is not None:
            rows.take(t_s, stw=value[5] * MPS_PER_KNOT)
        elif kind == "MWV" and n > 5 and cells[2] == "R" and value[1] is not None and value[3] is not None:
            unit = {"N": MPS_PER_KNOT, "M": 1.0, "K": 1.0 / 3.6}.get(cells[4], _NAN)
            rows.take(t_s, awa=math.radians(math.remainder(value[1], 360.0)), aws=value[3] * unit)
        elif kind == "RPM" and n > 3 and cells[1] == "E" and value[3] is not None:
            rows.take(t_s, motor=100.0 if value[3] > 300.0 else 0.0)
    if t_s is not None:
        rows.sample(t_s)


def _rmc_time(cells: list[str]) -> float | None:
    try:
        at = dt.datetime.strptime(cells[9] + cells[1].partition(".")[0], "%d%m%y%H%M%S").replace(tzinfo=dt.UTC)
    except ValueError:
        return None
    fraction = _number("0." + cells[1].partition(".")[2]) if "." in cells[1] else 0.0
    return at.timestamp() + (fraction or 0.0)


def _degrees(text: str, side: str) -> float | None:
    value = _number(text)
    if value is None:
        return None
    whole = math.floor(value / 100.0)
    return (whole + (value - 100.0 * whole) / 60.0) * (-1.0 if side in {"S", "W"} else 1.0)


# ----------------------------------------------------------------------------------------- steering
_STEERING = _WANTED | {
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


@dataclass(slots=True)
class _Series:
    """Readings by name in the making, (t_s, value) each, and what else a log tells of steering."""

    values: dict[str, list[tuple[float, float]]] = field(default_factory=dict)
    parameters: dict[str, float] = field(default_factory=dict)
    servos: list[tuple[float, tuple[float, ...]]] = field(default_factory=list)
    tacks_s: list[float] = field(default_factory=list)
    time_outs: int = 0

    def take(self, t_s: float, **values: float) -> None:
        for name, value in values.items():
            readings = self.values.setdefault(name, [])
            if not readings or t_s > readings[-1][0]:
                readings.append((t_s, float(value)))

    def text(self, t_s: float, text: str) -> None:
        if text.startswith("Sailboat: Tacking timed out"):
            self.time_outs += 1
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
            raise _Useless("it tells too little of the heading")
        if self.servos:
            self._rudder_from_servos()
        if len(self.values.get("rudder", [])) < LEAST_SAMPLES:
            raise _Useless("it does not tell where the rudder was (STER in a .BIN, SERVO_OUTPUT_RAW in a .tlog)")
        t = np.arange(bow[0][0], bow[-1][0], STEP_OF_STEERING_S)
        heading = self.angle_at("heading", t)
        ahead = self.at("ve", t) * np.sin(heading) + self.at("vn", t) * np.cos(heading)
        rudder = self.at("rudder", t)
        if self.servos:  # what a servo is told is scaled by speed already
            base = self.parameters.get("MOT_SPD_SCA_BASE", 1.0)
            rudder = rudder * (np.maximum(np.abs(ahead) / base, 1.0) if base > 0.0 else 1.0)
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
            is_steered=self.state_at("steered", t) > 0.5,
            tacks_s=tuple(self.tacks_s),
            time_outs=self.time_outs,
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


def read_steering(paths: list[Path]) -> tuple[list[SteeringLog], list[Skipped]]:
    """Return how the autopilot steered in each .BIN, .tlog and voyage folder, and which tell nothing of it."""
    read: list[SteeringLog] = []
    skipped: list[Skipped] = []
    for path in paths:
        try:
            read.append(_steering(path))
        except _Useless as why:
            skipped.append(Skipped(name=str(path), why=str(why)))
        except InputError as error:
            skipped.append(Skipped(name=str(path), why=error.problem))
        except (zlib.error, EOFError, gzip.BadGzipFile) as error:
            skipped.append(Skipped(name=str(path), why=f"it is damaged ({str(error)[:60]})"))
    return read, skipped


def _steering(path: Path) -> SteeringLog:
    series = _Series()
    files = [p for p in parts(path / TLOG) if p.stat().st_size > 0] if path.is_dir() else [path]
    name = files[0].name.lower().removesuffix(".gz") if files else ""
    if name.endswith(".bin"):
        _steering_of_bin(path, _bytes(path), series)
    elif name.endswith(".tlog") or TLOG in name:
        _steering_of_tlog(files, series)
    else:
        raise _Useless("only .BIN and .tlog tell how it was steered")
    return series.log(str(path))


def _steering_of_tlog(files: list[Path], series: _Series) -> None:
    for t_s, m in _autopilots(files, _STEERING):
        kind = m.get_type()
        if kind == "ATTITUDE":
            series.take(t_s, heading=m.yaw, rate=m.yawspeed, heel=m.roll)
        elif kind == "GLOBAL_POSITION_INT":
            series.take(t_s, ve=m.vy / 100.0, vn=m.vx / 100.0)
        elif kind == "SERVO_OUTPUT_RAW":
            if m.port == 0:
                series.servos.append((t_s, tuple(float(getattr(m, f"servo{n}_raw")) for n in range(1, 9))))
        elif kind == "NAV_CONTROLLER_OUTPUT":
            series.take(t_s, wanted_heading=math.radians(m.nav_bearing))
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
    from pymavlink import DFReader

    if data[:3] != _BIN_HEAD:
        raise _Useless("it is no .BIN log: it does not begin as one")
    try:
        log = DFReader.DFReader_binary(str(path))
    except Exception as error:  # it raises what its parsing happens to meet
        raise _Useless(f"it is no .BIN log ({str(error)[:60] or type(error).__name__})") from None
    armed, mode = True, -1
    try:
        while True:
            try:
                m = log.recv_match(type=["ATT", "XKF1", "STER", "NTUN", "PARM", "MSG", "MODE", "ARM"])
            except Exception:  # it is cut off or damaged: what is before that is used
                break
            if m is None:
                break
            kind, t_s = m.get_type(), m.TimeUS / 1e6
            if kind == "ATT":
                series.take(t_s, heading=math.radians(m.Yaw), heel=math.radians(m.Roll))
            elif kind == "XKF1":
                if getattr(m, "C", 0) == 0:
                    series.take(t_s, ve=m.VE, vn=m.VN)
            elif kind == "STER":
                rates = {"wanted_rate": math.radians(m.DesTurnRate), "rate": math.radians(m.TurnRate)}
                series.take(t_s, rudder=m.SteerOut / _FULL_STEER, **rates)
            elif kind == "NTUN":
                series.take(t_s, wanted_heading=math.radians(m.DesYaw))
            elif kind == "PARM":
                series.parameters[m.Name] = m.Value
            elif kind == "MSG":
                series.text(t_s, m.Message)
            else:
                armed = bool(m.ArmState) if kind == "ARM" else armed
                mode = int(m.ModeNum) if kind == "MODE" else mode
                series.take(t_s, steered=float(armed and mode not in _HANDS_ON))
    except AttributeError as missing:
        raise _Useless(f"its messages are another release's: they have no column {missing}") from None
    finally:
        log.close()
