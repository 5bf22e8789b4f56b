"""The boat: everything about it that a plan depends on as one value; its leeway, its outline, what it makes good."""

from __future__ import annotations

import json
import math
import uuid
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.boat.polar import Polar, SailingAngle
from companion.geo import MPS_PER_KNOT
from companion.geo.distinct import distinct

Floats = NDArray[np.float64]

SHAPE_TWA_RAD = tuple(math.radians(a) for a in range(0, 181, 30))  # of a problem's ``shape_error``
BEST_STEP_RAD = math.radians(0.1)  # of the best angle to windward
SPEED_ANGLES = 73  # of ``Boat.problem_speeds``: 2.5 degrees apart


@dataclass(frozen=True, slots=True, kw_only=True)
class Hull:
    """Size of the hull [m] and how far the position of its antenna can be wrong [m]."""

    length_m: float = 1.0
    beam_m: float = 0.3
    position_error_m: float = 2.5  # a plain GPS receiver's 95 % figure

    def __post_init__(self) -> None:
        for name in ("length_m", "beam_m", "position_error_m"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be 0 m or more")

    @property
    def reach_m(self) -> float:
        """How far the hull reaches from the place that the position is of, which is amidships [m]."""
        return 0.5 * math.hypot(self.length_m, self.beam_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Boat:
    """Polar, limits and losses.

    Attributes:
        polar: Speed by true wind angle and speed.
        no_go_half_rad: Half angle of the no-go zone about the true wind [rad, 0..π).
        max_twa_rad: Deepest angle sailed [rad, above no_go_half_rad, to π].
        turn_rate_radps: Rate of turn in a manoeuvre [rad/s, above 0].
        tack_loss_s: Time lost in a tack beyond the turn itself [s].
        gybe_loss_s: The same for a gybe [s].
        can_tack: False for a boat that does not get through the wind's eye: its plans gybe round instead.
        gybe_room_m: Leg to leeward that gybing round needs [m]; None: five turning radii at full speed.
        hull: Its size.
        has_motor: It has an auxiliary motor that the autopilot can run.
        max_tws_mps: More wind than this the boat is not to be out in [m/s]; None: there is no such limit.
        min_tws_mps: In less than this the boat makes no way [m/s].
        tack_fails: The chance that a tack fails [0..1), before any was seen; 0: they are not reckoned to fail.
        no_go_error_rad: How far ``no_go_half_rad`` may be off, as a deviation [rad, 0..0.5].
        speed_error: How far all speeds of the polar may be off together, as the deviation of the logarithm [0..1].
        told_speed_error: The same as her file tells it, 0 where it tells nothing and ``speed_error`` is assumed.
        shape_error: How far each speed may be off beside that, as deviations of the logarithm; None: nobody says.
        leeway_rad: Where the apparent wind is 30 degrees off its bow and three times as fast as it: on a beat in a
            moderate wind. In more wind it grows until the boat goes no faster (``Polar.full_tws_mps``).
    """

    polar: Polar
    no_go_half_rad: float = math.radians(45.0)
    max_twa_rad: float = math.pi
    turn_rate_radps: float = math.radians(30.0)
    tack_loss_s: float = 0.0
    gybe_loss_s: float = 0.0
    can_tack: bool = True
    gybe_room_m: float | None = None
    hull: Hull = field(default_factory=Hull)
    has_motor: bool = False
    leeway_rad: float = 0.0
    max_tws_mps: float | None = None
    min_tws_mps: float | None = None
    tack_fails: float = 0.0
    speed_error: float = 0.0
    told_speed_error: float = 0.0
    no_go_error_rad: float = 0.0
    shape_error: Polar | None = None

    def __post_init__(self) -> None:
        if not 0.0 <= self.no_go_half_rad < math.pi:
            raise ValueError(f"no-go half angle {math.degrees(self.no_go_half_rad):.1f}° is outside 0..180°")
        if not self.no_go_half_rad <= self.max_twa_rad <= math.pi + 1e-9:
            raise ValueError(f"deepest angle {math.degrees(self.max_twa_rad):.1f}° is outside the no-go angle..180°")
        if not (math.isfinite(self.turn_rate_radps) and self.turn_rate_radps > 0.0):
            raise ValueError(f"turn rate {self.turn_rate_radps} rad/s must be positive")
        for name in ("tack_loss_s", "gybe_loss_s"):
            value = getattr(self, name)
            if not (math.isfinite(value) and value >= 0.0):
                raise ValueError(f"{name} is {value}; it must be 0 s or more")
        if not 0.0 <= self.leeway_rad < math.pi / 4.0:
            raise ValueError(f"leeway of {math.degrees(self.leeway_rad):.1f}° is outside 0..45°")
        if not 0.0 <= self.no_go_error_rad <= 0.5:
            raise ValueError(f"no_go_error_rad is {self.no_go_error_rad}; it must be from 0 to 0.5")
        if not 0.0 <= self.speed_error <= 1.0:
            raise ValueError(f"speed_error is {self.speed_error}; it must be from 0 to 1")
        if not 0.0 <= self.tack_fails < 1.0:
            raise ValueError(f"tack_fails is {self.tack_fails}; it must be a chance from 0 to below 1")
        if self.gybe_room_m is not None and not (math.isfinite(self.gybe_room_m) and self.gybe_room_m >= 0.0):
            raise ValueError(f"gybe_room_m is {self.gybe_room_m}; it must be 0 m or more")

    @property
    def tacks(self) -> bool:
        """Whether she turns through the wind under sail; a boat that does not sail has no no-go zone."""
        return self.can_tack and self.no_go_half_rad > 0.0

    def made_good_rad(self, twa_rad: float, tws_mps: float) -> float:
        """Return the angle to the wind of a course through the water, with the bow at ``twa_rad`` [rad, 0..π]."""
        if self.leeway_rad == 0.0:
            return twa_rad
        return min(twa_rad + float(self.leeways_rad(np.array([twa_rad]), tws_mps)[0]), math.pi)

    def best_beat(self, tws_mps: float, *, no_go_half_rad: float = 0.0) -> SailingAngle:
        """Return the bow's angle of the best way to windward that it may be sailed at, leeway taken off.

        ``no_go_half_rad`` is what is kept out of where that is more than the boat's own.
        """
        low_rad = max(self.no_go_half_rad, no_go_half_rad)
        best = self.polar.best_beat(tws_mps, no_go_half_rad=low_rad)
        if self.leeway_rad == 0.0:
            return best
        bows = np.linspace(min(low_rad, 0.5 * math.pi), 0.5 * math.pi, 1 + math.ceil(0.5 * math.pi / BEST_STEP_RAD))
        speeds = self.polar.speeds_mps(bows, tws_mps)
        slips = self.leeways_rad(bows, tws_mps)
        made = speeds * np.cos(bows + slips) / np.maximum(np.cos(slips), 0.1)
        i = int(np.argmax(made))
        return SailingAngle(twa_rad=float(bows[i]), speed_mps=float(speeds[i]), vmg_mps=float(made[i]))

    def best_run(self, tws_mps: float) -> SailingAngle:
        """Return the angle of the best way to leeward, no deeper than the boat sails."""
        return self.polar.best_run(tws_mps, max_twa_rad=self.max_twa_rad)

    def curve(self, tws_mps: float) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return angles to the wind of courses through the water [rad] and the speeds [m/s] along them, linear between.

        Without leeway it is the polar's own curve.
        """
        twa_rad, speed_mps = self.polar.curve(tws_mps)
        if self.leeway_rad == 0.0:
            return twa_rad, speed_mps
        bows = distinct(np.concatenate([twa_rad, np.radians(np.arange(0.0, 181.0, 5.0))]))
        speeds = np.interp(bows, twa_rad, speed_mps)
        slips = self.leeways_rad(bows, tws_mps)
        courses = np.minimum(bows + slips, math.pi)
        # Nearer to the wind than where its course comes nearest to it the boat only drifts more: not sailed by anybody.
        later = np.append(np.minimum.accumulate(courses[::-1])[::-1][1:], math.inf)
        kept = courses < later - 1e-6
        return courses[kept], (speeds / np.maximum(np.cos(slips), 0.1))[kept]

    def leeways_rad(self, bows_rad: NDArray[np.float64], tws_mps: float) -> NDArray[np.float64]:
        """Return how far to leeward of its bow the boat goes with the bow at angles to the wind [rad]."""
        if self.leeway_rad == 0.0:
            return np.zeros(len(bows_rad))
        speeds, full_mps = self.polar.speeds_mps(bows_rad, tws_mps), self.polar.full_tws_mps
        return leeway_at(coefficient_of(self.leeway_rad), bows_rad, tws_mps, speeds, full_mps)

    def problem_boat(self, tws_mps: float) -> dict[str, Any]:
        """Return the ``boat`` part of a planning problem in this wind (degrees, as its JSON has them).

        A polar that is the same at every angle becomes the constant model. Losses and what is
        unusual are written where there are any. Angles are those of courses through the water: with leeway they are
        wider than the bow's.
        """
        twa_rad, speed_mps = self.curve(tws_mps)
        speed: dict[str, Any]
        if bool(np.all(speed_mps == speed_mps[0])):
            speed = {"model": "constant", "v_mps": float(speed_mps[0])}
        else:
            twa_deg = [round(float(a), 9) for a in np.degrees(twa_rad)]
            speed = {"model": "polar", "twa_deg": twa_deg, "v_mps": [float(v) for v in speed_mps]}
        out: dict[str, Any] = {
            "no_go_half_deg": math.degrees(self.made_good_rad(self.no_go_half_rad, tws_mps)),
            "max_twa_deg": math.degrees(self.max_twa_rad),
            "turn_rate_rad_s": self.turn_rate_radps,
            "speed": speed,
        }
        if self.tack_loss_s > 0.0:
            out["tack_loss_s"] = self.tack_loss_s
        if self.gybe_loss_s > 0.0:
            out["gybe_loss_s"] = self.gybe_loss_s
        if self.leeway_rad > 0.0:
            out["leeway_deg"] = out["no_go_half_deg"] - math.degrees(self.no_go_half_rad)
        if self.speed_error > 0.0:
            out["speed_error"] = self.speed_error
        if self.shape_error is not None:
            out["shape_error"] = [round(float(e), 4) for e in self.shape_error.speeds_mps(SHAPE_TWA_RAD, tws_mps)]
        if not self.can_tack:
            out["can_tack"] = False
        for name in ("gybe_room_m", "max_tws_mps", "min_tws_mps"):
            if getattr(self, name) is not None:
                out[name] = getattr(self, name)
        return out

    def problem_speeds(self) -> dict[str, Any]:
        """Return the ``boat.speeds`` of a planning problem: its speed in every wind, as its polar's columns have it."""
        return _speeds_of(self)


@lru_cache(maxsize=4)
def _speeds_of(boat: Boat) -> dict[str, Any]:
    angles = np.linspace(0.0, math.pi, SPEED_ANGLES)
    rows = []
    for tws_mps in boat.polar.tws_mps.tolist():
        twa_rad, speed_mps = boat.curve(tws_mps)
        rows.append([round(float(v), 4) for v in np.interp(angles, twa_rad, speed_mps)])
    return {
        "tws_mps": boat.polar.tws_mps.tolist(),
        "twa_deg": [round(float(a), 6) for a in np.degrees(angles)],
        "v_mps": rows,
    }


# The winds [kn] and angles [deg] of an ORC certificate.
ORC_KN = (4.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 20.0, 24.0)
ORC_DEG = (52.0, 60.0, 75.0, 90.0, 110.0, 120.0, 135.0, 150.0)


def orc_text(boat: Boat, share: float = 1.0) -> str:
    """Return a boat's polar as an ORC certificate tells one, in knots and degrees; its speeds times ``share``.

    A wind that the polar does not reach is left out: a speed there would be a guess that looks like a rating.
    """
    polar = boat.polar
    least, most = float(np.min(polar.tws_mps)), float(np.max(polar.tws_mps))
    winds = [w for w in ORC_KN if least - 1e-9 <= w * MPS_PER_KNOT <= most + 1e-9 or least == most]
    beats, runs = ([best(w * MPS_PER_KNOT) for w in winds] for best in (boat.best_beat, boat.best_run))
    rows = [
        ("beat angle", [f"{math.degrees(b.twa_rad):.1f}" for b in beats]),
        ("beat VMG", [f"{share * b.vmg_mps / MPS_PER_KNOT:.2f}" for b in beats]),
        *(
            (
                f"{a:g}",
                [f"{share * polar.speed_mps(math.radians(a), w * MPS_PER_KNOT) / MPS_PER_KNOT:.2f}" for w in winds],
            )
            for a in ORC_DEG
        ),
        ("run VMG", [f"{share * r.vmg_mps / MPS_PER_KNOT:.2f}" for r in runs]),
        ("run angle", [f"{math.degrees(r.twa_rad):.1f}" for r in runs]),
    ]
    return "\n".join(["TWA/TWS," + ",".join(f"{w:g}" for w in winds), *(",".join([n, *c]) for n, c in rows)]) + "\n"


def signalk_text(boat: Boat, share: float = 1.0) -> str:
    """Return a boat's polar as Signal K has one (``performance/polars``: radians, m/s), its speeds times ``share``."""
    polar, winds = boat.polar, []
    for tws_mps in [w for w in polar.tws_mps.tolist() if w > 0.0] or [5.0]:
        beat, run = boat.best_beat(tws_mps), boat.best_run(tws_mps)
        winds.append(
            {
                "trueWindSpeed": tws_mps,
                "optimalBeats": [[round(beat.twa_rad, 4), round(share * beat.speed_mps, 3)]],
                "optimalGybes": [[round(run.twa_rad, 4), round(share * run.speed_mps, 3)]],
                "angleData": [
                    [round(a, 4), round(share * polar.speed_mps(a, tws_mps), 3)] for a in polar.twa_rad.tolist()
                ],
            }
        )
    number = str(uuid.uuid5(uuid.NAMESPACE_OID, polar.name))
    return json.dumps({number: {"id": number, "name": polar.name, "windData": winds}}, indent=1) + "\n"


# Leeway: how far to leeward of its bow a boat goes through the water.
#
# The sail's side force grows with the square of the apparent wind and the sine of its angle. The keel's lift, which
# grows with speed times side speed, and the drag of the flow across hull and keel, with the square of the side speed,
# hold against it. At small angles this is the well known leeway = K heel / speed^2 (Garrett, The Symmetry of Sailing,
# 1987), with the heel that goes with that force; without way on the drift stays finite.

# Cross-flow drag of hull and keel as a share of the slope of the keel's lift: a plate's drag of 1.17 across the stream
# (Hoerner, Fluid-Dynamic Drag, 3) over the slope 2 pi / (1 + 2 / A) of a keel whose aspect ratio A is about 1.
CROSS_FLOW = 0.5
# Where the leeway of a boat is stated: close-hauled, the apparent wind so many times its speed.
STATED_AWA_RAD = math.radians(30.0)
STATED_RATIO = 3.0


def coefficient_of(beat_rad: float) -> float:
    """Return the coefficient of a boat whose leeway is ``beat_rad`` where it is stated."""
    slope = math.tan(beat_rad)
    return (slope + CROSS_FLOW * slope * slope) / (STATED_RATIO**2 * math.sin(STATED_AWA_RAD))


def leeway_rad(
    coefficient: float, aws_mps: float | Floats, awa_rad: float | Floats, speed_mps: float | Floats
) -> Floats:
    """Return the angle from bow to course through the water [rad, 0 or more], sheeted as for full speed; of each.

    >>> round(math.degrees(leeway_rad(coefficient_of(math.radians(5.0)), 6.0, math.radians(30.0), 2.0)), 6)
    5.0
    """
    v = np.abs(speed_mps)
    push = coefficient * np.square(aws_mps) * np.abs(np.sin(awa_rad))
    flow = np.sqrt(v * v + 4.0 * CROSS_FLOW * push) + v
    return np.asarray(np.arctan2(2.0 * push / np.maximum(flow, 1e-12), v))  # neither wind nor way: no leeway


def leeway_at(
    coefficient: float,
    twa_rad: float | Floats,
    tws_mps: float | Floats,
    speed_mps: float | Floats,
    full_tws_mps: float = math.inf,
) -> Floats:
    """Return the same for headings at ``twa_rad`` to the true wind.

    A hull carries no more side force than its stability holds: in more wind than ``full_tws_mps`` it is as much as in
    that, the sails eased or reefed.

    >>> k, beat = coefficient_of(math.radians(5.0)), math.radians(45.0)
    >>> [round(math.degrees(leeway_at(k, beat, w, 1.1, 3.0)), 1) for w in (2.0, 3.0, 8.0)]
    [3.8, 7.3, 7.3]
    """
    tws = np.minimum(tws_mps, full_tws_mps)
    across, ahead = tws * np.sin(twa_rad), tws * np.cos(twa_rad) + speed_mps
    return leeway_rad(coefficient, np.hypot(across, ahead), np.arctan2(across, ahead), speed_mps)


def carried(twa_rad: float, tws_mps: float, speed_mps: float, full_tws_mps: float) -> float:
    """Return the share of the sails' side force in this wind that the hull carries, as ``leeway_at`` has it [0..1]."""
    if tws_mps <= full_tws_mps:
        return 1.0

    def force(tws: float) -> float:
        return tws * math.hypot(tws * math.sin(twa_rad), tws * math.cos(twa_rad) + speed_mps)

    return min(1.0, force(full_tws_mps) / max(force(tws_mps), 1e-9))


def outline_en_m(hull: Hull, en_m: ArrayLike, heading_rad: ArrayLike) -> NDArray[np.float64]:
    """Return the closed outline of the hull at each place (n, 5, 2) [m]: the rectangle that holds it.

    The position is amidships.

    Args:
        hull: Length and beam.
        en_m: Places (n, 2), east north.
        heading_rad: Headings (n,).

    >>> outline_en_m(Hull(length_m=4.0, beam_m=2.0), [(10.0, 0.0)], [0.0])[0, 0].round(9).tolist()
    [11.0, 2.0]

    """
    places = np.asarray(en_m, dtype=np.float64).reshape(-1, 1, 2)
    heading = np.asarray(heading_rad, dtype=np.float64).reshape(-1, 1)
    ahead = 0.5 * hull.length_m * np.array([1.0, -1.0, -1.0, 1.0, 1.0])
    aside = 0.5 * hull.beam_m * np.array([1.0, 1.0, -1.0, -1.0, 1.0])
    sin, cos = np.sin(heading), np.cos(heading)
    return np.asarray(places + np.stack([ahead * sin + aside * cos, ahead * cos - aside * sin], axis=-1))


# What a boat makes good over the ground in a current, on one heading and by beating.

_HEADINGS, _NORMALS = 180, 360


def made_good_mps(
    boat: Boat,
    course_rad: float,
    *,
    twd_from_rad: float,
    tws_mps: float,
    current_en_mps: tuple[float, float],
    no_go_half_rad: float,
) -> float | None:
    """Return the most that the boat makes good over the ground along a course [m/s], tacking and gybing as it takes.

    Its velocities over the ground are the convex hull of what its polar allows outside the no-go zone, moved by the
    current; it stays on the line on the whole where the line meets the hull. None: nowhere, it makes no way along it
    whatever it does, and is carried off it or back.

    Args:
        boat: its polar and deepest angle.
        course_rad: over the ground.
        twd_from_rad: where the wind over the water comes from.
        tws_mps: how fast it is.
        current_en_mps: where the water goes.
        no_go_half_rad: what it keeps out of.

    """
    # s (n . course) <= reach holds for every normal n of the hull
    normals, reach = _reach(boat, twd_from_rad, tws_mps, current_en_mps, no_go_half_rad, course_rad)
    along = normals @ np.array([math.sin(course_rad), math.cos(course_rad)])
    ahead, astern = along > 1e-9, along < -1e-9
    most = float(np.min(reach[ahead] / along[ahead]))
    least = float(np.max(reach[astern] / along[astern]))
    return most if most > 0.0 and most >= least else None


def slowest_en_mps(
    boat: Boat, *, twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float], no_go_half_rad: float
) -> tuple[float, float]:
    """Return the slowest that the boat can be carried over the ground [m/s east, north]; 0, 0: it can stay.

    It is the point of the hull of ``made_good_mps`` that is nearest to lying still (arguments as there).
    """
    normals, reach = _reach(boat, twd_from_rad, tws_mps, current_en_mps, no_go_half_rad, 0.0)
    worst = int(np.argmin(reach))
    if reach[worst] >= 0.0:
        return 0.0, 0.0
    return float(reach[worst] * normals[worst, 0]), float(reach[worst] * normals[worst, 1])


def _reach(
    boat: Boat,
    twd_from_rad: float,
    tws_mps: float,
    current_en_mps: tuple[float, float],
    no_go_half_rad: float,
    first_rad: float,
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return unit normals (n, 2), the first towards ``first_rad``, and how far the hull reaches along each [m/s]."""
    off = np.linspace(min(no_go_half_rad, boat.max_twa_rad), boat.max_twa_rad, _HEADINGS)
    speed = boat.polar.speeds_mps(off, tws_mps)
    headings = np.concatenate([twd_from_rad + off, twd_from_rad - off])
    both = np.concatenate([speed, speed])
    velocities = np.column_stack([both * np.sin(headings), both * np.cos(headings)]) + np.asarray(current_en_mps)
    bearings = np.linspace(-math.pi, math.pi, _NORMALS, endpoint=False) + first_rad
    normals = np.column_stack([np.sin(bearings), np.cos(bearings)])
    return normals, np.max(normals @ velocities.T, axis=1)


def can_hold(
    boat: Boat, *, twd_from_rad: float, tws_mps: float, current_en_mps: tuple[float, float], no_go_half_rad: float
) -> bool:
    """Return whether the boat can stay where it is on the whole, and so make way everywhere (arguments as above)."""
    return slowest_en_mps(
        boat, twd_from_rad=twd_from_rad, tws_mps=tws_mps, current_en_mps=current_en_mps, no_go_half_rad=no_go_half_rad
    ) == (0.0, 0.0)
