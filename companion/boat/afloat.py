"""What a voyage tells of its boat while it is sailed: about what her file says, slowly, and in shadow at first.

Every stretch of steady sailing (``companion.boat.log``, by the same rules) is held against the file's polar:

    log ahead = log file(twa, tws) + x0 + x1 cos twa + x2 cos 2 twa + x3 log(tws / 5 m/s) + noise

A Kalman filter with Student's weights carries x; it forgets, and never is less sure than the file was. A stretch waits
ten minutes before it is learned from: until then what is found out about vane, position or a tow takes it back. What
plans are told (``Told``) follows every ten minutes of such sailing by small steps within bounds, and is predicted with
from the first: both it and the file are scored on each stretch before that is learned from, and it is used when it
was the better by a tenth over an hour of sailing, and no more when it is the worse.

No-go zone: where she stalls more often than she sails, in steps of ``BIN``, it is wider; never narrower than the
file's, for an autopilot that keeps off by its own setting never shows. Tacks and gybes: ``companion.boat.manoeuvres``.
How often a tack fails, how long she then lies and how she is set, the skipper counts itself.
"""

from __future__ import annotations

import math
import zlib
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from companion.boat.boat import Boat
from companion.boat.log import (
    AFTER_S,
    BEFORE_S,
    GAP_S,
    STRETCH_S,
    TURN_S,
    BoatLog,
    Why,
    driven_rows,
    steady,
    turning_of,
)
from companion.boat.manoeuvres import MOST_RECOVERY_S, manoeuvres_of
from companion.boat.polar import Polar
from companion.geo.angles import wrap_pi
from companion.geo.distinct import distinct

Floats = NDArray[np.float64]
Row = tuple[float, float, float, float]

AT_TWS_MPS = 5.0  # the shapes are zero in this wind
# Before the voyage: what all speeds may be off by at the least, and the shapes (as ``companion.boat.towed``).
LEAST_COMMON_SD, SHAPE_SD, LEAST_SHAPE_SD = 0.12, 0.12, 0.03
DAY_SD = 0.05  # what is never known better of all speeds together: sea, growth
NOISE, SLOW_MPS = 0.15, 0.06  # of a stretch's logarithm: gusts and seas are alike over minutes, so it is twice its own
FREEDOM, GATE = 4.0, 16.0
REOPEN = 10  # so many in a row that are unlike it, and she has changed
COMMON_FORGET, SHAPE_FORGET = 0.03, 0.015  # deviations that an hour of sailing adds
MOST_SDS = 3.0
SLOWEST, FASTEST = 0.5, 1.6  # of the file's speeds
LEAD_S, TAIL_S = AFTER_S + TURN_S, TURN_S + BEFORE_S  # seen before and after a stretch, for a manoeuvre there
KEPT_S = 180.0
WAITING, BATCH = 24, 4  # stretches; so many are learned from at a time
TAKEN_BACK_S = 300.0  # what is found out may have been so for this long
TOLD_EVERY_S, STEPS = 600.0, (0.05, 0.03, 0.03, 0.03)
PROOF_S, BETTER = 3600.0, 0.9
BIN, BINS, LEAST_STALLS, STALLED = math.radians(3.0), 3, 3, 0.5
MANY = 20  # stretches of a bin: then they count half
LOOK_BACK_S = 60.0  # how often manoeuvres are looked for
PRIOR_MANOEUVRES, LEAST_MANOEUVRES, MOST_MANOEUVRES = 5.0, 6, 40
LOSS_STEP, MOST_LOSS = 1.25, 3.0
LEAST_LOSS_S = 1.0  # that a file without one is taken to have meant
ZERO: Row = (0.0, 0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Look:
    """One second of sailing: the velocity through the water as it is believed, and how far that may be off [m/s]."""

    t_s: float
    here_en_m: tuple[float, float]
    velocity_en_mps: tuple[float, float]
    heading_rad: float
    wind_en_mps: tuple[float, float]  # over the water, where it comes from
    doubt_mps: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretch:
    """A stretch of steady sailing: its means, and what ``companion.boat.log`` makes of it."""

    row: tuple[float, ...]
    ahead_mps: float
    twa_rad: float
    tws_mps: float
    doubt_mps: float
    length_s: float

    @property
    def t_s(self) -> float:
        """The middle of it [s]."""
        return self.row[0]


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What plans are told in place of the file's figures; None: as the file has it."""

    x: Row = ZERO
    wider_rad: float = 0.0
    speed_error: float | None = None
    tack_loss_s: float | None = None
    gybe_loss_s: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class LearnedAfloat:
    """What is kept over a restart.

    Attributes:
        of: which file's figures it is about (``mark_of``).
        x, p: the filter; p is None before the first stretch.
        told: what plans are told once it ``is_used``.
        sailed_s: how much was learned from, and at how much of it ``told`` was last renewed.
        file_error, own_error: sums over the last hour of the absolute errors of both.
        unlike: refused in a row.
        held, stalled: stretches from the file's no-go angle on, in ``BINS`` steps of ``BIN``.
        losses: of tacks and of gybes: how many, and the sum of the logarithms of what they cost.
    """

    of: int = 0
    x: Row = ZERO
    p: tuple[Row, ...] | None = None
    told: Told = Told()
    sailed_s: float = 0.0
    told_at_s: float = 0.0
    file_error: float = 0.0
    own_error: float = 0.0
    unlike: int = 0
    held: tuple[int, ...] = (0,) * BINS
    stalled: tuple[int, ...] = (0,) * BINS
    losses: tuple[tuple[int, float], ...] = ((0, 0.0), (0, 0.0))
    is_used: bool = False
    is_frozen: bool = False

    @property
    def is_better(self) -> bool:
        """Whether it has predicted better than the file, by so much and for so long that it is used."""
        least = 1.0 if self.is_used else BETTER
        return self.sailed_s >= PROOF_S and self.own_error < least * self.file_error

    def to_dict(self) -> dict[str, Any]:
        """Return plain JSON values."""
        told = self.told
        return {
            "of": self.of,
            "x": list(self.x),
            "p": None if self.p is None else [list(row) for row in self.p],
            "told": [list(told.x), told.wider_rad, told.speed_error, told.tack_loss_s, told.gybe_loss_s],
            "sailed_s": [self.sailed_s, self.told_at_s],
            "errors": [self.file_error, self.own_error],
            "unlike": self.unlike,
            "held": list(self.held),
            "stalled": list(self.stalled),
            "losses": [list(pair) for pair in self.losses],
            "used": self.is_used,
            "frozen": self.is_frozen,
        }

    @classmethod
    def from_dict(cls, data: Any) -> LearnedAfloat:
        """Read ``to_dict``'s result. Raises KeyError, TypeError, IndexError or ValueError where it cannot be that."""
        p = None if data["p"] is None else tuple(_row(row) for row in data["p"])
        if p is not None and (len(p) != len(ZERO) or not bool(np.all(np.linalg.eigvalsh(_symmetric(p)) > 0.0))):
            raise ValueError("it is damaged: what is known of the boat is no covariance")
        x, wider, error, tack, gybe = data["told"]
        told = Told(
            x=_row(x),
            wider_rad=_within(wider, 0.0, BINS * BIN),
            speed_error=None if error is None else _within(error, 0.0, 1.0),
            tack_loss_s=None if tack is None else _within(tack, 0.0, 1e3),
            gybe_loss_s=None if gybe is None else _within(gybe, 0.0, 1e3),
        )
        held, stalled = (tuple(_count(n) for n in data[key]) for key in ("held", "stalled"))
        (tacks, tack_sum), (gybes, gybe_sum) = data["losses"]
        if not len(held) == len(stalled) == BINS:
            raise ValueError("it is damaged: a no-go zone in other steps")
        if not (isinstance(data["used"], bool) and isinstance(data["frozen"], bool)):
            raise TypeError("used and frozen are true or false")
        return cls(
            of=_count(data["of"], 2**32),
            x=_row(data["x"]),
            p=p,
            told=told,
            sailed_s=_within(data["sailed_s"][0], 0.0, 1e9),
            told_at_s=_within(data["sailed_s"][1], 0.0, 1e9),
            file_error=_within(data["errors"][0], 0.0, 1e9),
            own_error=_within(data["errors"][1], 0.0, 1e9),
            unlike=_count(data["unlike"]),
            held=held,
            stalled=stalled,
            losses=((_count(tacks), _within(tack_sum, -1e6, 1e6)), (_count(gybes), _within(gybe_sum, -1e6, 1e6))),
            is_used=data["used"],
            is_frozen=data["frozen"],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Afloat:
    """The boat as it is being learned: what is known, and the seconds and stretches that are still looked at.

    Attributes:
        known: it.
        saved: the same as it was when it was last worth writing to the disk.
        looks: the last seconds that may be learned from, without a gap.
        cut_s: where the next stretch begins.
        waiting: stretches that are not learned from yet.
        done_s: manoeuvres were looked for then, and ``last_s`` is the last that was taken.
        ended_s: the last look before those that may not be learned from.
        left_out: how many stretches were not, by reason.
    """

    known: LearnedAfloat = LearnedAfloat()
    saved: LearnedAfloat = LearnedAfloat()
    looks: tuple[Look, ...] = ()
    cut_s: float = 0.0
    waiting: tuple[Stretch, ...] = ()
    done_s: float = -math.inf
    last_s: float = -math.inf
    ended_s: float = -math.inf
    left_out: tuple[tuple[Why, int], ...] = ()

    @classmethod
    def of(cls, known: LearnedAfloat) -> Afloat:
        """Return what begins with what is known from before a restart."""
        return cls(known=known, saved=known)

    def with_known(self, known: LearnedAfloat) -> Afloat:
        """Return it with something that is to be on the disk at once."""
        return replace(self, known=known, saved=known)

    def without(self, why: Why) -> Afloat:
        """Return it where the present may not be learned from; what is found out late counts for the minutes before."""
        if not self.looks and not self.waiting:
            return self
        later = self
        if self.looks:
            later = replace(self._counted(why), looks=(), done_s=-math.inf, ended_s=self.looks[-1].t_s)
        if why not in {Why.DOUBTED, Why.FROZEN_VANE, Why.RESET, Why.MOTOR}:
            return later
        since_s = later.ended_s - TAKEN_BACK_S
        return replace(later, waiting=tuple(s for s in self.waiting if s.t_s < since_s))

    def _counted(self, why: Why, times: int = 1) -> Afloat:
        counts = dict(self.left_out)
        counts[why] = counts.get(why, 0) + times
        return replace(self, left_out=tuple(sorted(counts.items(), key=lambda item: item[0].name)))


def mark_of(boat: Boat) -> int:
    """Return the number that a boat's file is known by: what was learned about another is nothing to it."""
    return _mark(boat.polar, boat.no_go_half_rad)


@lru_cache(maxsize=4)
def _mark(polar: Polar, no_go_half_rad: float) -> int:
    table = np.ascontiguousarray(polar.speed_mps_table)
    rest = polar.twa_rad.tobytes() + polar.tws_mps.tobytes() + repr(no_go_half_rad).encode()
    return zlib.crc32(table.tobytes() + rest)


def as_learned(boat: Boat, told: Told) -> Boat:
    """Return a boat as it has been found to be; the same object for the same figures."""
    return _as_learned(boat, told)


@lru_cache(maxsize=8)
def _as_learned(boat: Boat, told: Told) -> Boat:
    twa = distinct(np.concatenate([boat.polar.twa_rad, np.radians(np.arange(0.0, 181.0, 15.0))]))
    twa = twa[np.concatenate([[True], np.diff(twa) > 1e-9])]
    twa = np.minimum(twa, math.pi)
    tws = boat.polar.tws_mps
    table = np.column_stack([boat.polar.speeds_mps(twa, w) * factor(told.x, twa, w) for w in tws.tolist()])
    return replace(
        boat,
        polar=Polar(twa_rad=twa, tws_mps=tws, speed_mps_table=table, name=boat.polar.name),
        no_go_half_rad=min(boat.no_go_half_rad + told.wider_rad, boat.max_twa_rad),
        speed_error=boat.speed_error if told.speed_error is None else told.speed_error,
        tack_loss_s=boat.tack_loss_s if told.tack_loss_s is None else told.tack_loss_s,
        gybe_loss_s=boat.gybe_loss_s if told.gybe_loss_s is None else told.gybe_loss_s,
    )


def factor(x: Row, twa_rad: ArrayLike, tws_mps: float) -> Floats:
    """Return what the file's speeds are multiplied by at these angles.

    >>> float(factor((0.0, 0.0, 0.0, 0.0), 1.0, 5.0))
    1.0
    """
    return np.asarray(np.exp(np.clip(_shapes(twa_rad, tws_mps) @ np.array(x), math.log(SLOWEST), math.log(FASTEST))))


def _shapes(twa_rad: ArrayLike, tws_mps: float) -> Floats:
    twa = np.asarray(twa_rad, dtype=np.float64)
    wind = math.log(min(max(tws_mps, 0.2 * AT_TWS_MPS), 4.0 * AT_TWS_MPS) / AT_TWS_MPS)
    return np.stack([np.ones_like(twa), np.cos(twa), np.cos(2.0 * twa), np.full_like(twa, wind)], axis=-1)


def followed(now: Afloat, look: Look, boat: Boat) -> Afloat:
    """Return what is known after one more second that may be learned from; ``boat`` is as its file has it."""
    known = now.known
    if known.is_frozen:
        return now
    if known.of != mark_of(boat):
        now = Afloat.of(LearnedAfloat(of=mark_of(boat)))
    if now.looks and not 0.0 < look.t_s - now.looks[-1].t_s <= GAP_S:
        now = now.without(Why.UNKNOWN)
    if not now.looks:
        return replace(now, looks=(look,), cut_s=look.t_s + LEAD_S)
    kept = now.looks
    if look.t_s - kept[0].t_s > KEPT_S + 30.0:  # not every second
        kept = tuple(k for k in kept if look.t_s - k.t_s <= KEPT_S)
    now = replace(now, looks=(*kept, look))
    if look.t_s >= now.cut_s + STRETCH_S + TAIL_S:
        now = _cut(now, boat)
    if look.t_s - now.done_s >= LOOK_BACK_S:
        now = _manoeuvred(replace(now, done_s=look.t_s), look.t_s)
    return now


# ------------------------------------------------------------------------------------------ stretches
def _log_of(looks: tuple[Look, ...]) -> BoatLog:
    velocity = np.array([k.velocity_en_mps for k in looks])
    felt = np.array([k.wind_en_mps for k in looks]) + velocity
    heading = np.array([k.heading_rad for k in looks])
    n = len(looks)
    return BoatLog(
        name="under way",
        t_s=np.array([k.t_s for k in looks]),
        velocity_en_mps=velocity,
        heading_rad=heading,
        awa_rad=np.asarray((np.arctan2(felt[:, 0], felt[:, 1]) - heading + math.pi) % (2.0 * math.pi) - math.pi),
        aws_mps=np.hypot(felt[:, 0], felt[:, 1]),
        position_en_m=np.array([k.here_en_m for k in looks]),
        stw_mps=np.full(n, math.nan),
        is_sailed=np.ones(n, dtype=np.bool_),
        has_motor_on=np.zeros(n, dtype=np.bool_),
    )


def _cut(now: Afloat, boat: Boat) -> Afloat:
    """Return it with the stretch that is over, waiting or left out."""
    start_s, end_s = now.cut_s, now.cut_s + STRETCH_S
    looks = tuple(k for k in now.looks if start_s - LEAD_S <= k.t_s <= end_s + TAIL_S)
    log = _log_of(looks)
    a, b = np.searchsorted(log.t_s, [start_s, end_s])
    now, window = replace(now, cut_s=end_s), slice(int(a), int(b))
    if b - a < 4:
        return now._counted(Why.UNKNOWN)  # noqa: SLF001 - the value's own module
    found = steady(log, window, turning_of(log, slice(0, len(looks))), boat.polar, boat.speed_error)
    if isinstance(found, Why):
        if found is Why.DRIFT:
            wind = np.mean([k.wind_en_mps for k in looks[window]], axis=0)
            bow = math.atan2(
                float(np.mean(np.sin(log.heading_rad[window]))), float(np.mean(np.cos(log.heading_rad[window])))
            )
            now = replace(now, known=_beaten(now.known, boat, wrap_pi(math.atan2(*wind) - bow), stalled=True))
        return now._counted(found)  # noqa: SLF001
    doubt = max(k.doubt_mps for k in looks[window])
    now = replace(now, waiting=(*now.waiting, _stretch(found, doubt)))
    if len(now.waiting) < WAITING:
        return now
    table = np.array([[0.0, *s.row] for s in now.waiting])
    by_motor = driven_rows(table, boat.polar, boat.speed_error).tolist()
    kept = tuple(s for s, is_driven in zip(now.waiting, by_motor, strict=True) if not is_driven)
    if any(by_motor):
        now = now._counted(Why.DRIVEN, sum(by_motor))  # noqa: SLF001
    if len(kept) < WAITING - BATCH:
        return replace(now, waiting=kept)
    for stretch in kept[:BATCH]:
        now = _learned(now, stretch, boat)
    return replace(now, waiting=kept[BATCH:])


def _stretch(row: tuple[float, ...], doubt_mps: float) -> Stretch:
    _, east, north, heading, awa, aws, _, length_s = row
    wind_e, wind_n = aws * math.sin(heading + awa) - east, aws * math.cos(heading + awa) - north
    return Stretch(
        row=row,
        ahead_mps=east * math.sin(heading) + north * math.cos(heading),
        twa_rad=wrap_pi(math.atan2(wind_e, wind_n) - heading),
        tws_mps=math.hypot(wind_e, wind_n),
        doubt_mps=doubt_mps,
        length_s=length_s,
    )


def _prior_sd(boat: Boat) -> Floats:
    shape = SHAPE_SD
    if boat.shape_error is not None:
        shape = min(max(float(np.mean(boat.shape_error.speed_mps_table)), LEAST_SHAPE_SD), SHAPE_SD)
    return np.array([max(boat.speed_error, LEAST_COMMON_SD), shape, shape, shape])


def _learned(now: Afloat, s: Stretch, boat: Boat) -> Afloat:
    """Return it with one stretch scored, and then learned from."""
    known, expected = now.known, boat.polar.speed_mps(s.twa_rad, s.tws_mps)
    if expected <= 0.05 or s.ahead_mps <= 0.0:
        return now._counted(Why.DRIFT)  # noqa: SLF001
    off = math.log(s.ahead_mps / expected)
    told = math.log(float(factor(known.told.x, s.twa_rad, s.tws_mps)))
    sd, x = _prior_sd(boat), np.array(known.x)
    p = np.diag(sd**2) if known.p is None else _symmetric(known.p)
    p = _capped(p + np.diag([COMMON_FORGET**2, *[SHAPE_FORGET**2] * 3]) * s.length_s / 3600.0, sd)
    h = _shapes(s.twa_rad, s.tws_mps)
    noise = (NOISE**2 + (SLOW_MPS**2 + s.doubt_mps**2) / s.ahead_mps**2) * STRETCH_S / max(s.length_s, 1.0)
    r, spread = off - float(h @ x), float(h @ p @ h) + noise
    known = _beaten(known, boat, s.twa_rad, stalled=r < math.log(STALLED))
    unlike = r * r / spread > GATE
    if unlike and known.unlike + 1 < REOPEN:
        return replace(now, known=replace(known, unlike=known.unlike + 1))._counted(Why.UNLIKE)  # noqa: SLF001
    if unlike:  # she has changed: believe the past no more than the file
        p = np.diag(sd**2)
        spread = float(h @ p @ h) + noise
    weighed = float(h @ p @ h) + noise * (FREEDOM + r * r / spread) / (FREEDOM + 1.0)
    gain = p @ h / weighed
    x = np.clip(x + gain * r, -MOST_SDS * sd, MOST_SDS * sd)
    p = p - np.outer(gain, h @ p)
    kept = math.exp(-s.length_s / PROOF_S)
    known = replace(
        known,
        x=_row(x.tolist()),
        p=tuple(_row(row) for row in (0.5 * (p + p.T)).tolist()),
        sailed_s=known.sailed_s + s.length_s,
        file_error=kept * known.file_error + s.length_s * abs(off),
        own_error=kept * known.own_error + s.length_s * abs(off - told),
        unlike=0,
    )
    if known.sailed_s - known.told_at_s >= TOLD_EVERY_S:
        known = replace(known, told=_told(known, boat), told_at_s=known.sailed_s)
        known = replace(known, is_used=known.is_better)
        return now.with_known(known)
    return replace(now, known=known)


def _capped(p: Floats, sd: Floats) -> Floats:
    """Return a covariance that is nowhere wider than the prior's."""
    share = np.minimum(1.0, sd / np.sqrt(np.diag(p)))
    return np.asarray(p * np.outer(share, share))


def _told(known: LearnedAfloat, boat: Boat) -> Told:
    """Return what plans are told now: what is known, by no more than a step from what they were told."""
    was = known.told
    x = np.clip(np.array(known.x) - np.array(was.x), -np.array(STEPS), np.array(STEPS)) + np.array(was.x)
    wider = min(max(_wider(known) - was.wider_rad, -BIN), BIN) + was.wider_rad
    common = math.sqrt(max(known.p[0][0], 0.0)) if known.p is not None else boat.speed_error
    return Told(
        x=_row(x.tolist()),
        wider_rad=wider,
        speed_error=min(boat.speed_error, math.hypot(common, DAY_SD)),
        tack_loss_s=_loss_s(known.losses[0], boat.tack_loss_s, was.tack_loss_s),
        gybe_loss_s=_loss_s(known.losses[1], boat.gybe_loss_s, was.gybe_loss_s),
    )


# ----------------------------------------------------------------------------------------- no-go zone
def _beaten(known: LearnedAfloat, boat: Boat, twa_rad: float, *, stalled: bool) -> LearnedAfloat:
    """Return it with one stretch close to the wind, held or stalled."""
    n = math.floor((abs(twa_rad) - boat.no_go_half_rad) / BIN)
    if not 0 <= n < BINS:
        return known
    held, lost = list(known.held), list(known.stalled)
    (lost if stalled else held)[n] += 1
    if held[n] + lost[n] > MANY:
        held[n], lost[n] = held[n] // 2, lost[n] // 2
    return replace(known, held=tuple(held), stalled=tuple(lost))


def _wider(known: LearnedAfloat) -> float:
    """Return by how much the no-go zone is wider than the file says [rad]."""
    lost = [n for n in range(BINS) if known.stalled[n] >= LEAST_STALLS and known.stalled[n] > known.held[n]]
    return BIN * (max(lost) + 1) if lost else 0.0


# ---------------------------------------------------------------------------------- tacks and gybes
def _manoeuvred(now: Afloat, t_s: float) -> Afloat:
    """Return it with what the tacks and gybes cost that are over since it was last looked."""
    if t_s - now.looks[0].t_s < 2.0 * MOST_RECOVERY_S:
        return now
    known, last_s = now.known, now.last_s
    for m in manoeuvres_of(_log_of(now.looks)):
        if m.t_s <= now.last_s + 1.0 or m.t_s > t_s - MOST_RECOVERY_S or m.loss_s is None:
            continue
        last_s = max(last_s, m.t_s)
        at = 0 if m.is_tack else 1
        count, total = known.losses[at]
        if count >= MOST_MANOEUVRES:
            count, total = count // 2, total * (count // 2) / count
        pair = (count + 1, total + math.log(max(m.loss_s, 0.3)))
        known = replace(known, losses=(pair, known.losses[1]) if m.is_tack else (known.losses[0], pair))
    return replace(now, known=known, last_s=last_s)


def _loss_s(seen: tuple[int, float], file_s: float, told_s: float | None) -> float | None:
    """Return what a manoeuvre costs, the file's figure counting as some that were seen; None: too few were."""
    count, total = seen
    if count < LEAST_MANOEUVRES:
        return None
    before_s = max(file_s, LEAST_LOSS_S)
    found_s = math.exp((PRIOR_MANOEUVRES * math.log(before_s) + total) / (PRIOR_MANOEUVRES + count))
    found_s = min(max(found_s, before_s / MOST_LOSS), before_s * MOST_LOSS)
    was_s = before_s if told_s is None else told_s
    return min(max(found_s, was_s / LOSS_STEP), was_s * LOSS_STEP)


# --------------------------------------------------------------------------------------------- checks
def _symmetric(p: tuple[Row, ...]) -> Floats:
    matrix = np.array(p, dtype=np.float64)
    return np.asarray(0.5 * (matrix + matrix.T))


def _row(values: Any) -> Row:
    a, b, c, d = (_within(v, -1e3, 1e3) for v in values)
    return a, b, c, d


def _within(value: Any, least: float, most: float) -> float:
    if isinstance(value, bool) or not isinstance(value, int | float) or not math.isfinite(value):
        raise ValueError("it is damaged: no number")
    return min(max(float(value), least), most)


def _count(value: Any, most: int = 10**6) -> int:
    if isinstance(value, bool) or not isinstance(value, int) or not 0 <= value <= most:
        raise ValueError("it is damaged: no count")
    return value
