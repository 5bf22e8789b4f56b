"""The air in the view: wind, no-go zone, laylines, polar. Degrees; directions true, the wind's where it is from."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

PointEn = tuple[float, float]   # metres east and north of the area's origin
Tack = Literal["port", "starboard"]


@dataclass(frozen=True, slots=True, kw_only=True)
class Band:
    """The forecast at a horizon; ``half_deg``: half widths of the central intervals of ``Wind.levels``."""

    horizon_s: float
    twd_from_deg: float
    sigma_deg: float
    tws_mps: float
    tws_sigma_mps: float
    half_deg: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Wind:
    """The wind now (5 s mean), its 90 s mean, the forecast's quantiles; angles at the bow are positive to starboard.

    ``awa_deg`` and ``aws_mps`` follow from the true wind and the motion over ground. ``health`` is none, settling,
    good, light or untrusted, ``verdict`` says why it is not good.
    """

    health: str
    verdict: str = ""
    twd_from_deg: float | None = None
    tws_mps: float | None = None
    mean_twd_from_deg: float | None = None
    mean_tws_mps: float | None = None
    sigma_deg: float | None = None       # of the direction a minute ahead
    tws_sigma_mps: float | None = None
    twa_deg: float | None = None
    awa_deg: float | None = None
    aws_mps: float | None = None
    record_s: float | None = None
    correlation_s: float | None = None
    age_s: float | None = None
    levels: tuple[float, ...] = ()
    bands: tuple[Band, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Water:
    """The current: where it goes and how fast, the standard deviation in its most uncertain direction.

    ``is_planned``: it is strong and sure enough for plans to reckon with it; ``verdict`` says what is not known of it.
    ``twd_from_deg`` and ``tws_mps`` are the present wind over this water, which is what she sails by.
    """

    set_deg: float
    drift_mps: float
    sigma_mps: float | None = None
    is_planned: bool = False
    verdict: str = ""
    twd_from_deg: float | None = None
    tws_mps: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Wedge:
    """The no-go zone at a horizon: ``half_deg`` to either side of ``from_deg``, ``widening_deg`` of it the spread."""

    horizon_s: float
    from_deg: float
    half_deg: float
    widening_deg: float


@dataclass(frozen=True, slots=True, kw_only=True)
class NoGo:
    """The no-go zone: the boat's own half angle, and with the wind's spread so that it holds with ``probability``."""

    half_deg: float
    probability: float
    wedges: tuple[Wedge, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Layline:
    """The course that fetches the mark on ``tack``, and how far it swings to either side with the wind."""

    tack: Tack
    course_deg: float
    swing_deg: float
    reach_s: float | None = None         # until she meets it on her present course; None: she does not


@dataclass(frozen=True, slots=True, kw_only=True)
class Laylines:
    """The laylines of a mark that is sailed to against the wind, or before it (``is_beat`` False)."""

    name: str
    mark_en_m: PointEn
    is_beat: bool
    angle_deg: float
    level: float                         # probability of the swing's interval
    lines: tuple[Layline, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Polar:
    """The speed by true wind angle in the wind of ``tws_mps``: nodes, linear between; best angles; the boat on it."""

    name: str
    tws_mps: float
    twa_deg: tuple[float, ...]
    speed_mps: tuple[float, ...]
    beat_deg: float | None = None
    run_deg: float | None = None
    live_twa_deg: float | None = None
    live_mps: float | None = None

    def at_mps(self, twa_deg: float) -> float | None:
        """Return its speed at an angle, None where it has no nodes about it."""
        angle = abs(twa_deg)
        for (low, slow), (high, fast) in pairwise(zip(self.twa_deg, self.speed_mps, strict=True)):
            if low <= angle <= high and high > low:
                return slow + (fast - slow) * (angle - low) / (high - low)
        return None
