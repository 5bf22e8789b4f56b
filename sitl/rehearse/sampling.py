"""What a seed of a rehearsal is: its wind, and a boat, sea and sensors that are not the plan's; faults on request.

Boat, sea and sensors are drawn as ``sitl mismatch`` draws them, and then made smaller where the mission knows more than
nothing: a polar of the boat's own was measured, leeway and current that are given are about right. Trouble is that of
``sitl faults``, but for what is only that campaign's water.
"""

from __future__ import annotations

import csv
import datetime as dt
import math
import os
import random
from argparse import ArgumentTypeError
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec
import numpy as np

from companion.compose import water_of
from companion.errors import InputError, unreadable
from companion.geofence import Mission
from companion.program import arguments
from companion.weather import iso
from companion.words import counted
from sitl.rehearse.fault_sampling import sampled_faults, with_faults
from sitl.rehearse.mismatch_sampling import departing
from sitl.scenario import CurrentSpec, HullSpec, LeeSpec, Scenario, SensorsSpec, WavesSpec, WindSpec, forecast
from sitl.world import Recorded

# How far a forecast of the mean of the next hours is off on a coast, direction [deg] and speed [m/s].
ERROR = (10.0, 0.5)
LEAST_MPS = 0.5
MOST_MPS = 40.0
CLIMATE = ("wind_from_deg", "wind_speed_ms", "share")
FORECASTS = (".grb", ".grb2", ".grib", ".grib2")
_REMEDY = "write SPEED@FROM, as 5@350, or name forecasts (GRIB) or a CSV: a record or a table of a climate"


@dataclass(frozen=True, slots=True, kw_only=True)
class ClimateCell:
    """One wind of a climate: how strong, where from, and how often it is that."""

    tws_mps: float
    from_deg: float
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Given:
    """What is known of the wind before the voyage.

    Attributes:
        told: in words.
        spec: the weather about its mean; of a record, the record.
        error: by how much the mean may be off, direction [deg] and speed [m/s], standard deviations.
        cells: of a climate; a seed draws one of them in place of the mean.
        record_s: how long a record is, 0 for what is none.
        members: of a forecast; a seed draws one of them.
    """

    told: str
    spec: WindSpec
    error: tuple[float, float] = ERROR
    cells: tuple[ClimateCell, ...] = ()
    record_s: float = 0.0
    members: tuple[int, ...] = ()

    def drawn(self, rng: random.Random, voyage_s: float) -> WindSpec:
        """Return the weather of a seed, whose voyage takes about so long."""
        if self.spec.model == "recorded":
            return msgspec.structs.replace(
                self.spec, from_s=round(rng.uniform(0.0, max(0.0, self.record_s - voyage_s)), 1)
            )
        if self.members:
            return msgspec.structs.replace(
                self.spec,
                member=rng.choice(self.members),
                off_deg=round(rng.gauss(0.0, self.error[0]), 2),
                off_mps=round(rng.gauss(0.0, self.error[1]), 3),
            )
        mean = (self.spec.from_deg, self.spec.tws_mps)
        if self.cells:
            cell = rng.choices(self.cells, weights=[c.share for c in self.cells])[0]
            mean = (cell.from_deg, cell.tws_mps)
        return msgspec.structs.replace(
            self.spec,
            from_deg=round((mean[0] + rng.gauss(0.0, self.error[0])) % 360.0, 2),
            tws_mps=round(min(max(mean[1] + rng.gauss(0.0, self.error[1]), LEAST_MPS), MOST_MPS), 3),
        )

    @property
    def middle(self) -> tuple[float, float]:
        """The wind in which a first plan is tried, where from [deg] and how strong [m/s]: a climate's most frequent."""
        if self.cells:
            most = max(self.cells, key=lambda cell: cell.share)
            return most.from_deg, most.tws_mps
        return self.spec.from_deg, self.spec.tws_mps

    def beside(self, folder: Path) -> Given:
        """Return it with its files named relative to a folder."""
        spec = self.spec
        if spec.file is not None:
            spec = msgspec.structs.replace(spec, file=os.path.relpath(spec.file, folder))
        return replace(
            self, spec=msgspec.structs.replace(spec, files=tuple(os.path.relpath(f, folder) for f in spec.files))
        )


def forecast_wind(
    paths: Sequence[Path],
    mission: Mission,
    depart: dt.datetime | None,
    hour: dt.datetime,
    spec: WindSpec,
    error: tuple[float, float] | None,
) -> tuple[Given, dt.datetime]:
    """Return the wind of forecasts, and when she sets sail: ``depart``, else ``hour``, else when it is first known.

    Raises:
        InputError: they cannot be believed, or do not know the wind of the start when she departs.
    """
    names = ", ".join(map(str, paths))
    files = tuple(path.resolve() for path in paths)
    weather = forecast(files, mission)
    start = mission.start or mission.origin

    def why(at: dt.datetime) -> str:
        return weather.why_unknown(at.timestamp(), start.lat_deg, start.lon_deg)

    begins = depart or hour
    if depart is None and why(begins):
        first_s = min(float(cube.utc_s[0]) for cube in weather.wind)
        begins = dt.datetime.fromtimestamp(first_s, dt.UTC)
    if why(begins):
        said = f"the wind of the start is not known at {begins:%Y-%m-%d %H:%M} UTC: {why(begins)}"
        raise InputError(names, "", said, "name a time that it knows (--depart), or another forecast")
    blows = weather.wind_en_mps(begins.timestamp(), start.lat_deg, start.lon_deg)
    east, north = (float(v) for v in np.nanmean(blows, axis=0))
    members, end_s = weather.members, max(float(cube.utc_s[-1]) for cube in weather.wind)
    off = error or ((0.0, 0.0) if len(members) > 1 else ERROR)
    about = "" if off == (0.0, 0.0) else f", off by {off[1]:g} m/s and {off[0]:g}° (standard deviations)"
    given = Given(
        told=f"{counted(len(members), 'member')} of {names}, to {iso(end_s)}{about}, wandering by {spec.sd_deg:g}°",
        spec=msgspec.structs.replace(
            spec,
            model="forecast",
            files=tuple(map(str, files)),
            from_deg=round(math.degrees(math.atan2(-east, -north)) % 360.0, 2),
            tws_mps=round(max(math.hypot(east, north), LEAST_MPS), 3),
        ),
        error=off,
        members=members,
    )
    return given, begins


def given_wind(text: str | None, spec: WindSpec, error: tuple[float, float] | None) -> Given:
    """Return the wind that ``--wind`` says, but for forecasts; without it that of ``spec``.

    Raises:
        InputError: it is none, or its file cannot be believed.
    """
    off = ERROR if error is None else error
    if text is None:
        return Given(told=_told(spec, off), spec=spec, error=off)
    path = Path(text)
    if path.suffix.lower() == ".csv":
        return _of_file(path, spec, error)
    try:
        speed_mps, from_deg = arguments.wind(text)
    except ArgumentTypeError as none:
        raise InputError("--wind", "", str(none), _REMEDY) from None
    if speed_mps > MOST_MPS:
        raise InputError("--wind", text, f"is out of range: up to {MOST_MPS:g} m/s", _REMEDY)
    spec = msgspec.structs.replace(spec, tws_mps=speed_mps, from_deg=from_deg)
    return Given(told=_told(spec, off), spec=spec, error=off)


def _told(spec: WindSpec, off: tuple[float, float]) -> str:
    return (
        f"{spec.tws_mps:g} m/s from {spec.from_deg:g}°, the mean of each voyage off by {off[1]:g} m/s and "
        f"{off[0]:g}° (standard deviations), wandering by {spec.sd_deg:g}°"
    )


def _of_file(path: Path, spec: WindSpec, error: tuple[float, float] | None) -> Given:
    try:
        with path.open(newline="", encoding="utf-8-sig") as lines:
            names = next(csv.reader(line for line in lines if not line.startswith("#")), [])
    except OSError as trouble:
        raise unreadable("--wind", trouble, str(path), _REMEDY) from None
    except UnicodeDecodeError as trouble:
        raise InputError("--wind", str(path), f"cannot be read ({trouble})", _REMEDY) from None
    if set(CLIMATE) <= set(names):
        return _climate(path, spec, error or (0.0, 0.0))
    if error is not None:
        raise InputError("--wind-error", "", "is of a wind that is given, and a record has none", "leave it out")
    record = Recorded.from_csv(path)
    from_deg, tws_mps = (math.degrees(record.at(0.0)[0]), record.at(0.0)[1])
    return Given(
        told=f"measured, {record.duration_s / 3600.0:.1f} h of {path.name}, each voyage from a time of its own on",
        spec=msgspec.structs.replace(
            spec, model="recorded", file=str(path.resolve()), from_deg=round(from_deg, 2), tws_mps=round(tws_mps, 3)
        ),
        error=(0.0, 0.0),
        record_s=record.duration_s,
    )


def _climate(path: Path, spec: WindSpec, off: tuple[float, float]) -> Given:
    cells: list[ClimateCell] = []
    with path.open(newline="", encoding="utf-8-sig") as lines:
        reader = csv.DictReader(line for line in lines if not line.startswith("#"))
        for row in reader:
            try:
                from_deg, tws_mps, share = (float(row[name]) for name in CLIMATE)
            except (TypeError, ValueError):
                raise InputError(
                    str(path), f"line {reader.line_num}", "is not three numbers", f"write {','.join(CLIMATE)}"
                ) from None
            if not (0.0 < tws_mps <= MOST_MPS and -360.0 <= from_deg <= 360.0 and 0.0 <= share <= 1e9):
                raise InputError(
                    str(path),
                    f"line {reader.line_num}",
                    "is out of range",
                    f"speeds up to {MOST_MPS:g} m/s, degrees, shares from 0",
                )
            cells.append(ClimateCell(tws_mps=tws_mps, from_deg=from_deg % 360.0, share=share))
    if not cells or sum(cell.share for cell in cells) <= 0.0:
        raise InputError(str(path), "", "holds no wind", f"write lines of {','.join(CLIMATE)}")
    about = "" if off == (0.0, 0.0) else f", each off by {off[1]:g} m/s and {off[0]:g}°"
    return Given(
        told=f"a climate of {counted(len(cells), 'wind')}, {path.name}{about}", spec=spec, error=off, cells=tuple(cells)
    )


DRAWN_PERCENT = 8.7  # the deviation of what a drawn polar errs by as a whole
OF_ONES_OWN = 0.5  # the error of a polar that was made for this boat, as a share of another's
LEEWAY_SPREAD = 0.3  # of a leeway that the mission gives, as a share of it
# Where a stranger sends the boat is clear water only where `sitl faults` sails.
ELSEWHERE = frozenset({"foreign_mission"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Doubts:
    """What is not taken for granted.

    Attributes:
        wind: what is known of it.
        boat: how far boat, sea and sensors may be others, 1: as ``sitl mismatch`` draws them; 0: as the plan has them.
        faults: whether trouble is drawn, too.
        voyage_s: about how long a voyage takes; trouble begins by then.
    """

    wind: Given
    boat: float
    faults: bool
    voyage_s: float


def drawn(seed: int, base: Scenario, mission: Mission, doubts: Doubts) -> tuple[Scenario, tuple[str, ...]]:
    """Return the scenario of a seed, and what in it is not the plan's, by name."""
    scenario = msgspec.structs.replace(
        base, wind=doubts.wind.drawn(random.Random(f"rehearsed wind {seed}"), doubts.voyage_s)
    )
    rng = random.Random(f"rehearsed boat {seed}")
    other, kinds = departing(rng, scenario, mission)
    scenario = _nearer(other, mission, doubts.boat) if doubts.boat > 0.0 else scenario
    scenario = _as_given(random.Random(f"rehearsed givens {seed}"), scenario, mission, doubts.boat)
    if doubts.faults:
        rng = random.Random(f"rehearsed faults {seed}")
        lots = [
            lot for lot in sampled_faults(rng, doubts.voyage_s) if not ELSEWHERE & {event.kind for event in lot.events}
        ]
        scenario = with_faults(scenario, lots)
        scenario = msgspec.structs.replace(scenario, is_service=True)
    return scenario, kinds if doubts.boat > 0.0 else ()


def _nearer(scenario: Scenario, mission: Mission, share: float) -> Scenario:
    """Return a scenario whose boat, sea and sensors are nearer to the plan's, or farther from it."""
    polar = share * (OF_ONES_OWN if mission.polar_path is not None else 1.0)
    if mission.boat.speed_error_percent is not None:
        polar = share * mission.boat.speed_error_percent / DRAWN_PERCENT
    wind = scenario.wind
    wind = msgspec.structs.replace(
        wind,
        gust_spread=min(1.0, share * wind.gust_spread),
        stronger_per_km=share * wind.stronger_per_km,
        bends_deg_per_km=share * wind.bends_deg_per_km,
        lees=tuple(_lee(lee, share) for lee in wind.lees),
    )
    return msgspec.structs.replace(
        scenario,
        wind=wind,
        current=None if scenario.current is None else _stream(scenario.current, share),
        waves=None if scenario.waves is None else _sea(scenario.waves, share),
        boat=None if scenario.boat is None else _hull(scenario.boat, share, polar),
        sensors=None if scenario.sensors is None else _sensors(scenario.sensors, share),
    )


def _lee(lee: LeeSpec, share: float) -> LeeSpec:
    return msgspec.structs.replace(lee, loss=min(1.0, share * lee.loss))


def _stream(spec: CurrentSpec, share: float) -> CurrentSpec:
    return msgspec.structs.replace(spec, drift_mps=share * spec.drift_mps, tide_mps=share * spec.tide_mps)


def _sea(spec: WavesSpec, share: float) -> WavesSpec:
    return msgspec.structs.replace(spec, loss=min(1.0, share * spec.loss), yaw_deg=share * spec.yaw_deg)


def _hull(spec: HullSpec, share: float, polar: float) -> HullSpec:
    def factor(value: float) -> float:
        return min(max(1.0 + polar * (value - 1.0), 0.2), 2.0)

    return msgspec.structs.replace(
        spec,
        beat=factor(spec.beat),
        reach=factor(spec.reach),
        run=factor(spec.run),
        leeway_deg=share * spec.leeway_deg,
        tack_fails=min(1.0, share * spec.tack_fails),
    )


def _sensors(spec: SensorsSpec, share: float) -> SensorsSpec:
    return msgspec.structs.replace(
        spec,
        vane_deg=share * spec.vane_deg,
        compass_deg=share * spec.compass_deg,
        deviation_deg=share * spec.deviation_deg,
        gps_noise_m=share * spec.gps_noise_m,
        gps_lag_s=share * spec.gps_lag_s,
    )


def _as_given(rng: random.Random, scenario: Scenario, mission: Mission, share: float) -> Scenario:
    """Return a scenario with the leeway and the current that the mission gives, each off by its own doubt."""
    if mission.boat.leeway_deg > 0.0:
        leeway_deg = mission.boat.leeway_deg * max(0.0, 1.0 + share * rng.gauss(0.0, LEEWAY_SPREAD))
        scenario = msgspec.structs.replace(
            scenario,
            boat=msgspec.structs.replace(scenario.boat or HullSpec(), leeway_deg=round(min(leeway_deg, 30.0), 3)),
        )
    if mission.current is not None:
        expected = water_of(mission).at(scenario.epoch_s)
        east = expected.east_mps + share * rng.gauss(0.0, expected.sigma_mps)
        north = expected.north_mps + share * rng.gauss(0.0, expected.sigma_mps)
        scenario = msgspec.structs.replace(
            scenario,
            current=CurrentSpec(
                set_deg=round(math.degrees(math.atan2(east, north)) % 360.0, 2),
                drift_mps=round(math.hypot(east, north), 3),
            ),
        )
    return scenario
