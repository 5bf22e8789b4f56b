"""Figures of the moment, one row each: page, line, ``companion watch``, radio and ``companion report`` derive from it.

A row says how a figure is computed from a step, in SI units and radians, and what it is called. On board and from a
record it is computed; over the radio it comes under the row's name as a NAMED_VALUE_FLOAT, which any ground station
plots: in degrees where it is an angle, as the companion's other floats are.
What needs more than a number (a plan's legs, a vessel) is a part of the view (``companion.view.values``).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Literal

from companion.boat import factor
from companion.current import over_water
from companion.eta import FASTEST, SLOWEST
from companion.fold import Step
from companion.geo.angles import heading_of, wrap_pi

Kind = Literal["speed", "distance", "time", "bearing", "angle", "share", "number"]
EVERYWHERE = frozenset({"page", "line", "watch", "radio", "report"})


@dataclass(frozen=True, slots=True, kw_only=True)
class Figure:
    """One row. ``kind`` is its unit: m/s, m, s, rad clockwise from north, rad to starboard, a share of 1, or none."""

    name: str  # over the radio: co_ and at most seven characters more
    label: str
    kind: Kind
    of: Callable[[Step], float | None]  # None: it cannot be told now
    hint: str = ""  # what it means, where there is room
    told: str = ""  # the subject of a report's sentence, empty: the label
    within: tuple[float, float] = (-math.inf, math.inf)  # what it is kept within: an end of it may be more, or less
    shown: frozenset[str] = EVERYWHERE


def vmg_mps(step: Step) -> float | None:
    """Return the speed over ground to windward [m/s], negative to leeward."""
    vehicle, twd_rad = step.snapshot.vehicle, step.snapshot.wind.present_twd_from_rad
    if vehicle is None or twd_rad is None:
        return None
    return vehicle.speed_mps * math.cos(twd_rad - heading_of(*vehicle.velocity_en_mps))


def pace_share(step: Step) -> float | None:
    """Return what the boat lately made of the speeds that were predicted, 1: all of them; None: nothing was seen."""
    return step.pace.share if step.pace.tries > 0.0 and not step.is_off_plan else None


def _through_water(step: Step) -> tuple[float, float, float] | None:
    """Return the speed through the water along the bow [m/s], the true wind's angle [rad] and its speed over it."""
    vehicle, wind, (east, north) = step.snapshot.vehicle, step.snapshot.wind, step.snapshot.current.en_mps
    if vehicle is None or wind.present_twd_from_rad is None or wind.present_tws_mps is None:
        return None
    ahead_mps = (vehicle.velocity_en_mps[0] - east) * math.sin(vehicle.heading_rad) + (
        vehicle.velocity_en_mps[1] - north
    ) * math.cos(vehicle.heading_rad)
    from_rad, tws_mps = over_water(wind.present_twd_from_rad, wind.present_tws_mps, (east, north))
    return ahead_mps, wrap_pi(from_rad - vehicle.heading_rad), tws_mps


def sailed_mps(step: Step) -> float | None:
    """Return the speed through the water along the bow [m/s]; None: not known, or she does not sail."""
    seen = _through_water(step)
    return None if seen is None or not step.state.voyage.sailing else seen[0]


def predicted_mps(step: Step) -> float | None:
    """Return what the boat that plans are of would make in this wind on this heading [m/s]; None: as ``sailed_mps``."""
    seen = _through_water(step)
    return None if seen is None or not step.state.voyage.sailing else step.voyage.boat.polar.speed_mps(*seen[1:])


def learned_share(step: Step) -> float | None:
    """Return what of her file's speed here plans are told, 1: all of it; None: nothing that was learned is used."""
    seen, known = _through_water(step), step.state.afloat.known
    if seen is None or not known.is_used:
        return None
    return float(factor(known.told.x, seen[1], seen[2]))


# fmt: off
FIGURES: tuple[Figure, ...] = (
    Figure(name="co_vmg", label="VMG", kind="speed", of=vmg_mps, shown=frozenset({"page", "report"}),
           told="Speed made good to windward"),
    Figure(name="co_pace", label="pace, of the plan's", kind="share", of=pace_share,
           shown=frozenset({"page", "report"}),
           hint="how fast she got along her way in the last minutes, turns and all, of what plans expect",
           told="Pace, turns and all, of what plans expected", within=(SLOWEST, FASTEST)),
    Figure(name="co_sailed", label="sailed", kind="speed", of=sailed_mps, shown=frozenset({"page", "radio", "report"}),
           hint="through the water", told="Speed sailed, through the water"),
    Figure(name="co_predict", label="predicted", kind="speed", of=predicted_mps,
           shown=frozenset({"page", "radio", "report"}), hint="by the boat that plans are of, in this wind",
           told="Speed predicted for it, by the boat that plans are of in the wind there was"),
    Figure(name="co_learned", label="learned, of her file", kind="share", of=learned_share,
           shown=frozenset({"page", "radio", "report"}), hint="what of her file's speed here plans are told",
           told="Learned on the way, and told to plans, of her file's speed"),
)
# fmt: on
BY_NAME = {figure.name: figure for figure in FIGURES}
_UNITS = {"speed": " m/s", "distance": " m", "time": " s", "bearing": "°", "angle": "°", "share": " %", "number": ""}
_DECIMALS = {"speed": 1, "distance": 1, "time": 0, "bearing": 1, "angle": 1, "share": 1, "number": 2}
WHOLE_M = 10.0  # from here on a distance is told in whole metres


def figure_values(step: Step, where: str) -> dict[str, float]:
    """Return by name what can be told now of the figures that are shown there: page, line, watch, radio or report.

    Bearings are in degrees from 0 to 360, angles in degrees from -180 to 180, the rest as the rows compute it.
    """
    values = {figure: figure.of(step) for figure in FIGURES if where in figure.shown}
    return {
        figure.name: _outside(figure, value)
        for figure, value in values.items()
        if value is not None and math.isfinite(value)
    }


def _outside(figure: Figure, value: float) -> float:
    if figure.kind == "bearing":
        return round(math.degrees(value), 1) % 360.0
    return round(math.degrees(wrap_pi(value)), 1) if figure.kind == "angle" else value


def in_words(values: Mapping[str, float]) -> list[str]:
    """Return figures as a line has them: label, value, unit."""
    return [
        f"{figure.label} {_shown(figure, value)}"
        for name, value in values.items()
        if (figure := BY_NAME.get(name)) is not None
    ]


def _shown(figure: Figure, value: float) -> str:
    least, most = figure.within
    beyond = " or less" if value <= least else " or more" if value >= most else ""
    return _measured(figure, value) + beyond


def _measured(figure: Figure, value: float) -> str:
    if figure.kind == "angle":
        return f"{abs(value):g}° {'P' if value < 0.0 else 'S'}"
    scaled = 100.0 * value if figure.kind == "share" else value
    decimals = 0 if figure.kind == "distance" and abs(value) >= WHOLE_M else _DECIMALS[figure.kind]
    return f"{round(scaled, decimals) + 0.0:g}{_UNITS[figure.kind]}"  # + 0: no minus before a zero


@dataclass(slots=True)
class Ranges:
    """What the figures of a report have been since a voyage began: the least, the most and the mean of each.

    A bearing has none of these.
    """

    by_name: dict[str, list[float]] = field(default_factory=dict)  # least, most, sum, count

    def take(self, step: Step) -> None:
        """Take one step."""
        for name, value in figure_values(step, "report").items():
            least, most, total, count = self.by_name.get(name, (math.inf, -math.inf, 0.0, 0.0))
            self.by_name[name] = [min(least, value), max(most, value), total + value, count + 1.0]

    def to_dict(self) -> dict[str, dict[str, float]]:
        """Return them by the figures' names."""
        return {
            name: {"least": least, "most": most, "mean": total / count}
            for name, (least, most, total, count) in self.by_name.items()
            if BY_NAME[name].kind != "bearing"
        }


def ranges_in_words(ranges: Mapping[str, Mapping[str, float]]) -> list[str]:
    """Return what ``Ranges.to_dict`` has recorded, a sentence each; a figure of another release is left out."""
    return [
        f"{figure.told or figure.label}: {_shown(figure, of['least'])} to {_shown(figure, of['most'])}, "
        f"{_shown(figure, of['mean'])} in the mean."
        for name, of in ranges.items()
        if (figure := BY_NAME.get(name)) is not None
    ]
