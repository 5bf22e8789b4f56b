"""What came before a view: samples for the track and the strips, in columns, thinned so that a day fits."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from companion.geo.frame import LocalFrame
from companion.geo.shift import Shift
from companion.view.numbers import place
from companion.view.values import View

MOST = 3600        # samples kept: an hour at one a second, a day at one in 24 s


@dataclass(frozen=True, slots=True, kw_only=True)
class Sample:
    """One moment of the track and the strips; the forecast is the one that was made then, for a minute ahead."""

    t_s: float
    east_m: float | None = None
    north_m: float | None = None
    heading_deg: float | None = None
    sog_mps: float | None = None
    twd_from_deg: float | None = None
    tws_mps: float | None = None
    clearance_m: float | None = None
    starboard: bool | None = None          # tack
    ahead_twd_deg: float | None = None     # the forecast's mean for a minute ahead ...
    ahead_half_deg: float | None = None    # ... and the half width that holds 80 %
    ahead_tws_mps: float | None = None
    ahead_tws_sigma_mps: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Past:
    """Samples by column, each as long as ``t_s``; names as in ``Sample``."""

    unix_s: float | None = None            # of t_s = 0
    t_s: tuple[float, ...] = ()
    east_m: tuple[float | None, ...] = ()
    north_m: tuple[float | None, ...] = ()
    heading_deg: tuple[float | None, ...] = ()
    sog_mps: tuple[float | None, ...] = ()
    twd_from_deg: tuple[float | None, ...] = ()
    tws_mps: tuple[float | None, ...] = ()
    clearance_m: tuple[float | None, ...] = ()
    starboard: tuple[bool | None, ...] = ()
    ahead_twd_deg: tuple[float | None, ...] = ()
    ahead_half_deg: tuple[float | None, ...] = ()
    ahead_tws_mps: tuple[float | None, ...] = ()
    ahead_tws_sigma_mps: tuple[float | None, ...] = ()

    @classmethod
    def of(cls, samples: Sequence[Sample], unix_s: float | None) -> Past:
        """Return samples as columns."""
        return cls(unix_s=unix_s, **{f.name: tuple(getattr(s, f.name) for s in samples) for f in fields(Sample)})


class Trail:
    """The samples of a voyage under way: the newest in full, and from ``MOST`` on every second of the older half."""

    def __init__(self, most: int = MOST) -> None:
        self._most = most
        self.samples: list[Sample] = []

    def follow(self, before: LocalFrame, after: LocalFrame) -> None:
        """Let the metres of all samples count in another frame."""
        if before != after:
            shift = Shift(before, after)
            self.samples = [_carried(sample, shift) for sample in self.samples]

    def add(self, sample: Sample) -> None:
        """Take the next one."""
        self.samples.append(sample)
        if len(self.samples) > self._most:
            half = self._most // 2
            self.samples = [*self.samples[:half][::2], *self.samples[half:]]


def _carried(sample: Sample, shift: Shift) -> Sample:
    if sample.east_m is None or sample.north_m is None:
        return sample
    east_m, north_m = place(shift.point((sample.east_m, sample.north_m)))
    return replace(sample, east_m=east_m, north_m=north_m)


def sample_of(view: View) -> Sample:
    """Return what the track and the strips keep of a view."""
    boat, wind = view.boat, view.wind
    minute = None if wind is None else next((b for b in wind.bands if b.horizon_s == 60.0), None)
    east, north = boat.at_en_m or (None, None)
    return Sample(
        t_s=view.t_s, east_m=east, north_m=north, heading_deg=boat.heading_deg, sog_mps=boat.sog_mps,
        clearance_m=boat.clearance_m, starboard=None if boat.tack is None else boat.tack == "starboard",
        twd_from_deg=None if wind is None else wind.twd_from_deg, tws_mps=None if wind is None else wind.tws_mps,
        ahead_twd_deg=None if minute is None else minute.twd_from_deg,
        ahead_half_deg=None if minute is None or len(minute.half_deg) < 2 else minute.half_deg[1],
        ahead_tws_mps=None if minute is None else minute.tws_mps,
        ahead_tws_sigma_mps=None if minute is None else minute.tws_sigma_mps)
