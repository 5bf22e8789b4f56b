"""What the guidance sees, wants, can do, remembers and says: values alone."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from companion.field.projection import HysteresisRing, HysteresisZone
from companion.field.vector_fields import Field

Clearance = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""Points (n, 2) [m] to their distances from what stands still (n,) [m]: positive in free water."""

RESEND_S = 1.0
STILL_MPS = 0.3  # slower an obstacle lies


@dataclass(frozen=True, slots=True, kw_only=True)
class MovingObstacle:
    """A moving disc to keep out of: centre, velocity, radius ``keep_m`` growing by ``growth_mps``.

    The outermost ``ring_m`` of it is distance kept beside it, of which some is given up before the boat goes ashore.
    """

    en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float] = (0.0, 0.0)
    keep_m: float = 10.0
    growth_mps: float = 0.0
    ring_m: float = 0.0

    @property
    def moves(self) -> bool:
        """Return whether it goes somewhere; slower it lies, and its course is the fixes' noise."""
        return math.hypot(*self.velocity_en_mps) > STILL_MPS


@dataclass(frozen=True, slots=True, kw_only=True)
class Situation:
    """What the guidance sees; ``twd_from_rad`` None: the wind is not known (a motorboat need not know).

    ``current_en_mps`` is what sets her over the ground, 0 where it is not known.
    """

    t_s: float
    en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float]
    heading_rad: float
    twd_from_rad: float | None
    tws_mps: float = 5.0
    obstacles: tuple[MovingObstacle, ...] = ()
    current_en_mps: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Intent:
    """Where to go: a field, its hysteresis zone, a box (west, south, east, north) not to leave, and the shore, if any.

    ``clearance`` says how far points are from obstacles that stand still and from the fence.
    """

    field: Field
    zone: HysteresisZone | HysteresisRing | None = None
    stay_in: tuple[float, float, float, float] | None = None
    clearance: Clearance | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidanceSettings:
    """What the boat can do, and how careful to be.

    ``polar_mps`` is the speed at ``polar_twa_rad`` (rising, 0..π) in the present wind. ``tack_s`` is how long a tack
    takes and ``tack_min_mps`` the way it needs (inf: it never tacks); ``lag_s`` how long the boat takes to gather the
    new speed. ``comfort_m`` outside an obstacle's disc still costs a little, and so does crossing ahead of it
    (``ahead_cost``).
    """

    is_sailing: bool = True
    no_go_half_rad: float = math.pi / 4.0
    polar_twa_rad: tuple[float, ...] = (0.0, math.pi)
    polar_mps: tuple[float, ...] = (2.0, 2.0)
    turn_rate_radps: float = math.radians(20.0)
    tack_s: float = 8.0
    tack_min_mps: float = 0.7
    lag_s: float = 5.0
    leeway_share: float = 0.0
    look_ahead: bool = True
    horizon_s: float = 90.0
    comfort_m: float = 15.0
    ahead_cost: float = 0.6
    repulsive_sigma_m: float = 100.0
    near_m: float = 300.0
    keep_m: float = 8.0  # from what stands still

    @property
    def shore_s(self) -> float:
        """How far ahead [s] what stands still is looked at: a tack, half a turn, and a little; later it can turn."""
        return 8.0 + self.tack_s + math.pi / self.turn_rate_radps


class Manoeuvre(enum.Enum):
    """What the boat is doing."""

    SAIL = "sail"
    TACK = "tack"
    WEAR = "wear"  # round by the stern
    IRONS = "irons"  # caught head to wind: bear away


@dataclass(frozen=True, slots=True, kw_only=True)
class GuidanceState:
    """The memory of the step machine."""

    q: int = 1
    manoeuvre: Manoeuvre = Manoeuvre.SAIL
    since_s: float = 0.0
    wanted_rad: float | None = None
    stuck_since_s: float | None = None
    failed_tacks: int = 0
    irons: int = 0
    irons_side: int = 1
    round_side: int = 0  # something stands in the way and is passed by turning right (1) or left (-1) of it


@dataclass(frozen=True, slots=True, kw_only=True)
class Setpoint:
    """A heading for GUIDED: resend every ``RESEND_S``, ArduRover stops a boat whose setpoint is older than 3 s.

    ``margin_m`` is the least distance outside every obstacle's disc that is foreseen, None without look-ahead.
    """

    t_s: float
    heading_rad: float
    thrust: float = 1.0
    reason: str = ""
    margin_m: float | None = None
