"""One other vessel: its last state in the local frame, what it is, how big it is."""

from __future__ import annotations

import math
from dataclasses import dataclass

# Sizes assumed for a vessel that does not say its own: a coaster for class A, a yacht for class B.
CLASS_A_LENGTH_M, CLASS_A_BEAM_M = 100.0, 16.0
CLASS_B_LENGTH_M, CLASS_B_BEAM_M = 12.0, 4.0

# ITU-R M.1371 navigational status.
AT_ANCHOR, NOT_UNDER_COMMAND, RESTRICTED, BY_DRAUGHT, MOORED, AGROUND, FISHING, UNDER_SAIL = 1, 2, 3, 4, 5, 6, 7, 8
STOPPED_STATUS = frozenset({AT_ANCHOR, MOORED, AGROUND})
STILL_MPS = 0.3  # slower a vessel lies
LAIN_S = 120.0  # who has lain still for so long goes on to, until a report says otherwise
# ITU-R M.1371 ship types.
TYPE_FISHING, TYPE_SAILING, TYPE_PLEASURE = 30, 36, 37


@dataclass(frozen=True, slots=True, kw_only=True)
class VesselDimensions:
    """A rectangle about the antenna: metres from it to bow, stern, port and starboard side.

    ``is_known`` is False for the size assumed for the vessel's class, which is centred on the antenna.
    """

    bow_m: float
    stern_m: float
    port_m: float
    starboard_m: float
    is_known: bool = True

    @property
    def length_m(self) -> float:
        """Length [m]."""
        return self.bow_m + self.stern_m

    @property
    def beam_m(self) -> float:
        """Beam [m]."""
        return self.port_m + self.starboard_m

    @property
    def half_diagonal_m(self) -> float:
        """Radius of the disc about the hull's centre that holds the hull at any heading [m]."""
        return 0.5 * math.hypot(self.length_m, self.beam_m)

    @property
    def centre_body_m(self) -> tuple[float, float]:
        """Hull centre seen from the antenna: (forward, to starboard) [m]."""
        return 0.5 * (self.bow_m - self.stern_m), 0.5 * (self.starboard_m - self.port_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Vessel:
    """A vessel as last reported; what is not known is None.

    ``t_s`` is when ``antenna_en_m`` was true (report time minus its age), ``heard_s`` when anything was last heard.
    ``branch`` counts vessels that share one MMSI (0 for an honest one).
    """

    mmsi: int
    branch: int = 0
    t_s: float
    heard_s: float
    antenna_en_m: tuple[float, float]
    course_rad: float | None = None
    speed_mps: float | None = None
    heading_rad: float | None = None
    turn_rate_radps: float | None = None
    nav_status: int | None = None
    ship_type: int | None = None
    name: str | None = None
    hull: VesselDimensions
    is_class_b: bool = False
    reports: int = 1
    is_shared_mmsi: bool = False
    derived: bool = False  # speed and course come from positions, not from the report
    lain_s: float = 0.0  # for how long its reports have shown it lying still, as far as they were heard, and ...
    lain_en_m: tuple[float, float] | None = None  # ... where at the beginning of that, or of its last ``LAIN_S``

    @property
    def label(self) -> str:
        """Name or MMSI, with the branch where one MMSI has several vessels."""
        text = self.name or str(self.mmsi)
        return f"{text}#{self.branch}" if self.is_shared_mmsi else text

    @property
    def is_stopped(self) -> bool:
        """Return whether it says that it is at anchor, moored or aground, or has lain still for ``LAIN_S``."""
        says_so = self.nav_status in STOPPED_STATUS and (self.speed_mps is None or self.speed_mps < 0.5)
        return says_so or self.lain_s >= LAIN_S

    @property
    def is_moving_known(self) -> bool:
        """Are its course and speed known (or is it known to be stopped)?"""
        return self.is_stopped or (self.speed_mps is not None and (self.speed_mps < 0.1 or self.course_rad is not None))

    @property
    def velocity_en_mps(self) -> tuple[float, float]:
        """Velocity over ground [m/s]; (0, 0) where it is not known."""
        if self.is_stopped or self.speed_mps is None or self.course_rad is None:
            return 0.0, 0.0
        return self.speed_mps * math.sin(self.course_rad), self.speed_mps * math.cos(self.course_rad)

    @property
    def lies(self) -> bool:
        """Return whether it is known to go nowhere: slower than ``STILL_MPS`` its course is the fixes' noise."""
        return self.is_moving_known and math.hypot(*self.velocity_en_mps) < STILL_MPS

    @property
    def bow_rad(self) -> float | None:
        """Where the bow points: heading, else the course of a vessel that moves, else None."""
        if self.heading_rad is not None:
            return self.heading_rad
        return self.course_rad if self.speed_mps is not None and self.speed_mps >= STILL_MPS else None

    @property
    def centre_en_m(self) -> tuple[float, float]:
        """The hull's centre at ``t_s`` [m]; the antenna where the bow's direction is not known."""
        bow = self.bow_rad
        if bow is None:
            return self.antenna_en_m
        ahead, right = self.hull.centre_body_m
        s, c = math.sin(bow), math.cos(bow)
        return self.antenna_en_m[0] + ahead * s + right * c, self.antenna_en_m[1] + ahead * c - right * s

    @property
    def reach_m(self) -> float:
        """Radius about ``centre_en_m`` that holds the hull, whatever its heading becomes [m]."""
        ahead, right = self.hull.centre_body_m
        extra = 0.0 if self.bow_rad is not None else math.hypot(ahead, right)
        return self.hull.half_diagonal_m + extra


def hull_of(
    bow_m: float | None, stern_m: float | None, port_m: float | None, starboard_m: float | None, *, is_class_b: bool
) -> VesselDimensions:
    """Return the hull reported, or the size assumed for the class where length or beam is missing or zero.

    AIS writes the length alone as bow 0, stern length: the position of the antenna is then not known and is
    taken to be the middle.
    """
    length, beam = (bow_m or 0.0) + (stern_m or 0.0), (port_m or 0.0) + (starboard_m or 0.0)
    if length <= 0.0:
        length, beam = (CLASS_B_LENGTH_M, CLASS_B_BEAM_M) if is_class_b else (CLASS_A_LENGTH_M, CLASS_A_BEAM_M)
        return VesselDimensions(
            bow_m=length / 2, stern_m=length / 2, port_m=beam / 2, starboard_m=beam / 2, is_known=False
        )
    if not bow_m:
        bow_m = stern_m = length / 2
    if beam <= 0.0:
        beam = length / 5.0
        port_m = starboard_m = beam / 2
    elif not port_m:
        port_m = starboard_m = beam / 2
    return VesselDimensions(bow_m=bow_m, stern_m=stern_m or 0.0, port_m=port_m or 0.0, starboard_m=starboard_m or 0.0)
