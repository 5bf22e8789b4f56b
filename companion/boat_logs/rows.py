"""What was read last of everything, sampled: a log of a boat in the making, whatever it was read from."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from companion.boat import BoatLog
from companion.geo.angles import wrap_pi_array
from companion.geo.frame import LocalFrame
from companion.messages import GeoPoint, Mode, VehicleState, WindSample
from companion.wind import apparent_wind
from companion.wind.study import Record
from companion.words import counted

LEAST_SAMPLES = 60
STEP_S = 0.95  # samples are so far apart at least
STALE_S = 2.5  # a reading older than this is none
REBOOT_BACK_S = 5.0
TURN_S, TURN_RAD = 10.0, math.radians(25.0)  # the bow so far round within it: vane and compass lag
MOTOR_PERCENT = 5.0
MOST_WIND_MPS = 100.0  # more is no reading
# The sheets are eased, the boat lies or is not a boat yet.
AT_REST = frozenset({Mode.HOLD, Mode.LOITER, Mode.INITIALISING, Mode.DOCK})
_NAN = math.nan
_NOWHERE = GeoPoint(lat_deg=0.0, lon_deg=0.0)  # what the wind on board does not depend on


class UnusableLogError(Exception):  # never leaves this room
    """A log is of no use, and why."""


@dataclass(slots=True)
class Rows:
    """Samples in the making: what was read last of everything, and when [s]."""

    rows: list[tuple[float, ...]] = field(default_factory=list)
    now: dict[str, tuple[float, float]] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    last_s: float = -math.inf
    shift_s: float = 0.0

    def take(self, t_s: float, **values: float) -> None:
        """Take readings by name: angles [rad], speeds [m/s], lon and lat [deg]."""
        for name, value in values.items():
            self.now[name] = (t_s, float(value))

    def of(self, t_s: float, name: str, stale_s: float = STALE_S) -> float:
        """Return what was read last by a name; NaN where it is older than ``stale_s``."""
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
        """Return the log. Raises UnusableLogError: it is none to learn from."""
        table = np.array(self.rows, dtype=np.float64).reshape(len(self.rows), 11)
        if 0 < len(table) < LEAST_SAMPLES:
            raise UnusableLogError(
                f"it is too short: {counted(len(table), 'sample')}, one a second, of {LEAST_SAMPLES} at least"
            )
        for what, column, remedy in (
            ("the boat's speed", 1, "GLOBAL_POSITION_INT, or RMC"),
            ("the heading", 3, "ATTITUDE, or HDG"),
            ("the wind", 5, "WIND or the apparent wind (AppWndDir), or MWV"),
        ):
            known = int(np.sum(np.isfinite(table[:, column])))
            if known < LEAST_SAMPLES:
                raise UnusableLogError(
                    f"it tells {what} in {known} of {counted(len(table), 'sample')}, of {LEAST_SAMPLES} at least "
                    f"({remedy})"
                )
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
class Winds(Rows):
    """Every reading of the true wind, in place of a sample a second; the bow is then what it was last."""

    winds: list[tuple[float, float, float, float, float]] = field(default_factory=list)
    bows: list[tuple[float, float]] = field(default_factory=list)

    def take(self, t_s: float, **values: float) -> None:
        """Take readings by name, every wind among them."""
        super(Winds, self).take(t_s, **values)  # slots make the class anew, and super() forgets it
        if "heading" in values:
            self.bows.append((t_s, values["heading"]))
        if "twd" in values and (not self.winds or t_s > self.winds[-1][0]):
            last = self.of(t_s, "heading", math.inf), self.of(t_s, "awa", math.inf)
            self.winds.append((t_s, values["twd"], values["tws"], *last))

    def sample(self, t_s: float) -> None:
        """Keep nothing: the wind's own readings are kept."""

    def record(self, name: str) -> Record:
        """Return the record. Raises UnusableLogError: there is no wind in it."""
        known = [row for row in self.winds if all(math.isfinite(v) for v in row[:3]) and row[2] >= 0.0]
        if len(known) < 2:
            raise UnusableLogError(f"{len(known)} WIND messages")
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


def _places(lonlat_deg: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return places (n, 2) east and north of the first that is known [m]; NaN unknown."""
    known = np.isfinite(lonlat_deg).all(axis=1) & (np.abs(lonlat_deg[:, 1]) <= 90.0)
    out = np.full(lonlat_deg.shape, _NAN)
    if bool(np.any(known)):
        lon_deg, lat_deg = lonlat_deg[known][0].tolist()
        frame = LocalFrame(GeoPoint(lat_deg=lat_deg, lon_deg=math.remainder(lon_deg, 360.0)))
        out[known] = frame.array_en_from_lonlat(lonlat_deg[known])
    return out
