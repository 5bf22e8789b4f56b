"""What a boat can probably do that nobody has sailed yet, from its length, displacement and sail area.

Speeds are those of rated yachts, by Froude's law: two boats of one shape are as fast for the root of their length in a
wind that is as strong for it. On rated boats of 5.5 to 28 m, half of them fitted and half tested, that leaves 6.2 % of
error (root mean square of the logarithm) and next to no trend with length. A robot of a metre or two is outside that
range, has no crew and no clean bottom, and its vane is low: ``SPEED_ERROR_PERCENT`` stands for that.

>>> boat = guessed(Sizes(length_m=1.5, displacement_kg=20.0, sail_area_m2=0.9))
>>> round(boat.polar.speed_mps(math.radians(90.0), 4.0), 2), boat.no_go_half_deg
(1.34, 45.0)
"""

from __future__ import annotations

import csv
import json
import math
from dataclasses import dataclass
from importlib.resources import files

import numpy as np

from companion.boat.boat import coefficient_of, leeway_at
from companion.boat.polar import Polar

GRAVITY_MPS2, WATER_KGPM3 = 9.81, 1025.0
SAIL, WEIGHT = 0.6, 0.0042  # sail area over length squared, displacement over that of a cube of water: the middle
# A judgement, no measurement: AVALON's published polar is 50 % above what is guessed of her.
SPEED_ERROR_PERCENT = 35.0
NEAR_WIND_DEG = 4.0  # an autopilot by a vane sails so much less near to the wind than a crew by telltales
BEAT_TWS_MPS = 5.0
LEAST_NO_GO_DEG = 45.0  # ArduRover's own default
NO_GO_ERROR_DEG = 4.0  # a judgement: that of small robots that were published is 40 to 60
# Of a boat of a metre; by Froude's law a time grows as the root of the length.
TURN_RATE_DEG_S, TACK_LOSS_S = 30.0, 4.0
TACK_FAILS = 0.05  # one in twenty, until some were seen
LEEWAY_DEG = 5.0  # in a moderate wind; 5 to 12 close-hauled in a fresh one is told of small robots, and this makes 7
LEAST_M, MOST_M = 0.3, 40.0
BEAM = 0.3  # of the length


@dataclass(frozen=True, slots=True, kw_only=True)
class Sizes:
    """Length over all [m], displacement as it sails [kg], sails without a spinnaker [m2].

    Raises:
        ValueError: no boat is so long, so light or so heavy, or has so much or so little sail for its length.
    """

    length_m: float
    displacement_kg: float
    sail_area_m2: float

    def __post_init__(self) -> None:
        if not LEAST_M <= self.length_m <= MOST_M:
            raise ValueError(f"a length of {self.length_m:g} m; from {LEAST_M:g} to {MOST_M:g} m can be guessed at")
        for value, middle, what, unit in (
            (self.displacement_kg, WEIGHT * WATER_KGPM3 * self.length_m**3, "a displacement", "kg"),
            (self.sail_area_m2, SAIL * self.length_m**2, "a sail area", "m2"),
        ):
            if not middle / 6.0 <= value <= 6.0 * middle:
                about = float(f"{middle:.2g}")
                raise ValueError(
                    f"{what} of {value:g} {unit}; of a boat of {self.length_m:g} m it is about {about:g} {unit}"
                )


@dataclass(frozen=True, slots=True, kw_only=True)
class GuessedBoat:
    """What is guessed, in the units of a mission's ``[boat]``."""

    polar: Polar
    no_go_half_deg: float
    turn_rate_deg_s: float
    tack_loss_s: float
    tack_fails: float = TACK_FAILS
    leeway_deg: float = LEEWAY_DEG
    speed_error_percent: float = SPEED_ERROR_PERCENT
    no_go_error_deg: float = NO_GO_ERROR_DEG


def guessed(sizes: Sizes) -> GuessedBoat:
    """Return what a boat of these sizes can probably do."""
    polar = guessed_polar(sizes)
    beat_deg = math.degrees(polar.best_beat(BEAT_TWS_MPS).twa_rad)
    slow = math.sqrt(sizes.length_m)
    return GuessedBoat(
        polar=polar,
        no_go_half_deg=max(LEAST_NO_GO_DEG, float(round(beat_deg + NEAR_WIND_DEG))),
        turn_rate_deg_s=round(TURN_RATE_DEG_S / slow, 1),
        tack_loss_s=round(TACK_LOSS_S * slow, 1),
    )


def guessed_polar(sizes: Sizes) -> Polar:
    """Return the polar of a rated yacht of these proportions, scaled to the length."""
    rows = _rows()
    angles = [float(name) for name in list(rows[0])[3:]]
    fast_mps = math.sqrt(GRAVITY_MPS2 * sizes.length_m)
    sail = sizes.sail_area_m2 / sizes.length_m**2 / SAIL
    weight = sizes.displacement_kg / (WATER_KGPM3 * sizes.length_m**3) / WEIGHT
    columns = [
        np.array([float(row[f"{angle:g}"]) for angle in angles])
        * sail ** float(row["sail"])
        * weight ** float(row["weight"])
        * fast_mps
        for row in rows
    ]
    table = np.maximum.accumulate(np.column_stack(columns), axis=1)  # more wind makes no boat of the table slower
    return Polar(
        twa_rad=np.radians(np.array(angles)),
        tws_mps=np.array([float(row["wind"]) * fast_mps for row in rows]),
        speed_mps_table=table,
        name=f"guessed, {sizes.length_m:g} m",
    )


def _rows() -> list[dict[str, str]]:
    text = files("companion.boat").joinpath("data/orc_shape.csv").read_text(encoding="utf-8")
    return list(csv.DictReader(line for line in text.splitlines() if not line.startswith("#")))


def _most_leeway_deg(boat: GuessedBoat) -> float:
    """Return the leeway at the edge of the no-go zone where it is most [deg]."""
    beat_rad, full_mps = math.radians(boat.no_go_half_deg), boat.polar.full_tws_mps
    speed_mps = boat.polar.speed_mps(beat_rad, full_mps)
    return math.degrees(leeway_at(coefficient_of(math.radians(boat.leeway_deg)), beat_rad, full_mps, speed_mps))


def guessed_text(name: str, sizes: Sizes, boat: GuessedBoat, when: str, beam_m: float | None = None) -> str:
    """Return the boat file of a guess, made on the day ``when``; a beam is taken for ``BEAM`` of the length."""
    polar = boat.polar
    slips = f"{_most_leeway_deg(boat):.0f} in {polar.full_tws_mps:.1f} m/s or more"

    def share(value: float, by: float) -> str:
        return f"{value / by:.2g} to {value * by:.2g}"

    keys = (
        ("length_m", sizes.length_m, ""),
        ("beam_m", round(BEAM * sizes.length_m, 2) if beam_m is None else beam_m, ""),
        ("no_go_half_deg", boat.no_go_half_deg, "40 to 60: a rated yacht's beat and 4, at least ArduRover's 45"),
        ("no_go_error_deg", boat.no_go_error_deg, "standard deviation: it has its share in the risk of a plan"),
        ("turn_rate_deg_s", boat.turn_rate_deg_s, f"{share(boat.turn_rate_deg_s, 2.0)}: in a tack"),
        ("tack_loss_s", boat.tack_loss_s, f"{share(boat.tack_loss_s, 3.0)}: what a tack costs beside the turn"),
        ("tack_fails", boat.tack_fails, "0 to 0.15: the share of tacks that end where they began"),
        ("leeway_deg", boat.leeway_deg, f"2 to 9: beating, apparent wind 3 times her speed; {slips}"),
        ("speed_error_percent", boat.speed_error_percent, "all of [polar] may be off together by this"),
    )
    most = f"{polar.tws_mps[-1]:.1f}"
    made_of = f"{sizes.length_m:g} m, {sizes.displacement_kg:g} kg, {sizes.sail_area_m2:g} m2"
    lines = [
        f"name = {json.dumps(name)}",
        f'made = "guessed on {when} from {made_of}"',
        "# Nobody has sailed her yet: put in what you time and measure, and say so in `made`.",
        "",
        "[boat]   # the keys of a mission's [boat]; what a mission says itself counts before this",
        *(f"{f'{key} = {value:g}':<28}{comment and '# '}{comment}".rstrip() for key, value, comment in keys),
        "",
        f"[polar]   # through the water, in the wind at the height of the vane; in more than {most} m/s as in that",
        f"tws_mps = [{', '.join(f'{w:.1f}' for w in polar.tws_mps)}]",
        f"twa_deg = [{', '.join(f'{math.degrees(a):g}' for a in polar.twa_rad)}]",
        "speed_mps = [",
        *(f"    [{', '.join(f'{v:.2f}' for v in row)}]," for row in polar.speed_mps_table),
        "]",
    ]
    return "\n".join(lines) + "\n"
