"""Does the boat move as the wind that is measured and its polar say, in any water that is likely?

Water changes slowly, and no current turns the wind over the ground. So a boat that goes astern, or lies nearly still,
where it should run at 2 m/s has been told a wrong wind: a vane that was turned on its mast, or an offset that somebody
wrote, not a current of 3 m/s that came within a second. What tells:

- **Speed.** Along its heading it lacks (or has too much of) more than the polar's error and what is not known of the
  current could explain.
- **Heel.** It heels to windward.
- **The direction's leap.** A front turns the wind, too, but then it sails by it. A direction that has leapt before it
  ceased to sail as it should is the sensor's doing; less is enough then, and a shorter time. Few fronts turn
  the wind by ``TURNED_RAD`` within a minute: a direction that has leapt so far is doubted whatever the boat does, on
  a reach, where the wind from the other side would have it sail as fast, and at its mooring. It is believed once the
  boat has sailed by it for long enough, on headings far apart, held in a loiter as it is.

What sets it across its heading as well is no wind's doing: a current's, which the filter takes up, or a compass's,
which "heading against course" tells.
"""

from __future__ import annotations

import cmath
import math
from collections import deque
from dataclasses import dataclass

from companion.geo.angles import difference_rad

SWINGS_S = 4.0  # of the means of heading and velocity: waves swing the boat's bow within less
TURNING_RAD_S = math.radians(6.0)  # faster the boat manoeuvres ...
SETTLES_S = 4.0  # ... and has the boat's speed again so long after it, and the means with it
LEAST_TWA_RAD = math.radians(38.0)  # closer to the wind a polar says little, and the boat may be in irons
LEAST_TWS_MPS = 1.5
STANDS_MPS, SHOULD_MPS = 0.15, 0.6  # a boat that stands where it should sail is aground, moored or in irons
ODD_MPS, ODD_SHARE = 0.5, 0.35  # of a speed: gusts that the hull has not answered, and a polar that is a quarter off
SPREADS = 2.0  # of what is not known of the current, beside it
LEAPT_MPS, LEAPT_SHARE, LEAPT_SPREADS = 0.4, 0.2, 1.0  # likewise after the direction has leapt
ACROSS_SHARE = 0.3  # of what it lacks: a current sets it more across its heading, on most of them ...
LEAPT_ACROSS_SHARE = 0.6  # ... and a compass that is up to 120 degrees off does, with a direction that leapt
HEELS_RAD = math.radians(8.0)  # to windward: more than a wave's
LEAST_HEEL_TWA_RAD, MOST_HEEL_TWA_RAD = math.radians(30.0), math.radians(150.0)
HEEL_S = 10.0  # of the mean heel
SURE_S, JUMPED_S = 20.0, 8.0  # of odd readings, without a jump of the direction and after one
FORGETS = 0.5  # a reading that fits takes back so much of one that does not
FITS_S = 20.0  # of readings that fit end a doubt
NEW_WIND_S, NEW_WIND_RATIO = 60.0, 4.0  # likewise of a wind from elsewhere, and so many times those that do not, ...
FAR_APART_RAD = math.radians(70.0)  # ... on headings far apart, of the last ...
TALLY_S = 300.0  # ... so long: odd moments while a front passes are forgotten, too
GAINS_MPS2 = 0.1  # a boat that gains on its polar at that rate is on its way to it
JUMP_RAD = math.radians(40.0)  # of the direction's 5 s mean against what it was half a minute and more ago
TURNED_RAD, LASTS_S = math.radians(125.0), 5.0  # of the same, for so long: no shift
STEADY = 0.7  # the length of the mean of the directions before: less is a wind that swings about
MOORED_S = 600.0  # of a boat that does not sail by it: a wind that stays so long is a new one
BEFORE_S, MEMORY_S = 30.0, 90.0
KEPT_EVERY_S = 5.0
LEAST_BEFORE = 4  # of the directions before: fewer may be of the moment when the vane was put right


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionSample:
    """One moment: how the boat goes through the water that is believed, and what the polar says in the wind of now.

    Attributes:
        along_mps, across_mps: through the water, ahead and to starboard, means over ``SWINGS_S``.
        speed_mps: the polar's.
        twa_rad: the wind's angle to its bow, over the water, positive over starboard.
        twd_from_rad, tws_mps: the wind over the ground.
        heading_rad: of its bow, likewise a mean.
        sigma_mps: of the current along its heading.
        roll_rad: positive to starboard; None: not told.
        is_heard: the wind is what the vane says now, not the last that was believed of one that is frozen.
    """

    along_mps: float
    across_mps: float
    speed_mps: float
    twa_rad: float
    twd_from_rad: float
    tws_mps: float
    heading_rad: float
    sigma_mps: float
    roll_rad: float | None = None
    is_heard: bool = True


class _Tally:
    """Of the moments of a doubt: for how long the boat sailed as it should, on which headings, and for how long not.

    A row without a break is not to be had: a boat that is held circles, and a front comes with gusts.
    """

    def __init__(self) -> None:
        self._fits_s = self._odd_s = 0.0
        self._bows = 0j  # the sum of the bow's unit vectors over the time that fits

    def take(self, dt_s: float, heading_rad: float, *, fits: bool) -> None:
        keep = math.exp(-dt_s / TALLY_S)
        self._fits_s, self._odd_s, self._bows = keep * self._fits_s, keep * self._odd_s, keep * self._bows
        if fits:
            self._fits_s += dt_s
            self._bows += cmath.rect(dt_s, heading_rad)
        else:
            self._odd_s += dt_s

    @property
    def is_enough(self) -> bool:
        is_on_many_headings = abs(self._bows) <= self._fits_s * math.cos(0.5 * FAR_APART_RAD)
        return self._fits_s >= max(NEW_WIND_S, NEW_WIND_RATIO * self._odd_s) and is_on_many_headings


class MotionCheck:
    """A fold over moments of a boat that sails: is the wind, or the water, to be doubted?

    ``doubt`` says why in words, empty: nothing is. ``is_winds``: it is of the wind alone.
    ``is_odd``: the last moment did not fit; ``fits_s``: for how long all did.
    """

    def __init__(self) -> None:
        self.doubt, self.is_odd, self.is_winds = "", False, False
        self._t_s: float | None = None
        self._heading_rad = self._along_mps = 0.0
        self._turned_s = -math.inf
        self.fits_s = self._odd_s = 0.0
        self._heel_rad = 0.0
        self._directions: deque[tuple[float, float]] = deque()  # of the wind, one in 5 s
        self._before_rad: float | None = None  # where it came from before it leapt ...
        self._leapt_s = -math.inf  # ... and when it was seen to have
        self._wind_s: float | None = None  # of the last wind that was followed
        self._far_s = self._back_s = self._moored_s = 0.0  # it has been turned, back, and not sailed by, for
        self._is_leap = False  # it is doubted for its leap alone
        self._tally = _Tally()  # of the doubt that is

    @property
    def before_rad(self) -> float | None:
        """Where the wind came from before it leapt, while that is why it is doubted."""
        return self._before_rad if self.doubt and self.is_winds else None

    @property
    def is_refuted(self) -> bool:
        """Whether the boat has moved as it should since the doubt began, for long enough and on headings far apart."""
        return bool(self.doubt) and self._tally.is_enough

    def pause(self) -> None:
        """Take note that nobody knows how the boat is driven: what is settled begins anew."""
        self._t_s = None

    def update(self, t_s: float, now: MotionSample, at_once: MotionSample) -> None:
        """Take the moment at ``t_s``; ``at_once`` is it without the means, for a boat that turns every few seconds."""
        self.is_odd = False
        if self._t_s is None or t_s <= self._t_s:
            self._t_s, self._heading_rad, self._turned_s, self._along_mps = t_s, now.heading_rad, t_s, at_once.along_mps
            return
        dt_s, self._t_s = min(5.0, t_s - self._t_s), t_s
        gains_mps2, self._along_mps = (at_once.along_mps - self._along_mps) / dt_s, at_once.along_mps
        if now.roll_rad is not None:
            self._heel_rad += -math.expm1(-dt_s / HEEL_S) * (now.roll_rad - self._heel_rad)
        if abs(difference_rad(now.heading_rad, self._heading_rad)) > TURNING_RAD_S * dt_s:
            self._turned_s = t_s
        self._heading_rad = now.heading_rad
        if now.tws_mps < LEAST_TWS_MPS:
            return
        if self.doubt and (fits := self._fits(t_s, at_once)) is not None:
            is_on_its_way = gains_mps2 * math.copysign(1.0, at_once.speed_mps - at_once.along_mps) >= GAINS_MPS2
            if fits or not is_on_its_way:
                self._tally.take(dt_s, at_once.heading_rad, fits=fits)
            if self.is_winds and self.is_refuted:
                self.settle()
                return
        if t_s - self._turned_s < SETTLES_S:
            return
        fits = self._fits(t_s, now)
        if fits is None:
            return
        self.is_odd = not fits
        self.fits_s = self.fits_s + dt_s if fits else 0.0
        self._odd_s = max(0.0, self._odd_s - FORGETS * dt_s) if fits else self._odd_s + dt_s
        if self.doubt:
            self._look_for_an_end(now)
        elif self._odd_s >= (JUMPED_S if self._has_leapt(t_s) else SURE_S):
            self._begin(t_s, now)

    def _fits(self, t_s: float, now: MotionSample) -> bool | None:
        """Return whether the boat moves as the wind and its polar say, None where that cannot be told."""
        angle = abs(now.twa_rad)
        if self._heels_to_windward(now):
            return False
        if math.hypot(now.along_mps, now.across_mps) < STANDS_MPS and now.speed_mps > SHOULD_MPS:
            return None
        lacks = now.speed_mps - now.along_mps
        if lacks > 0.0 and angle < LEAST_TWA_RAD:
            return None
        fixed, share, spreads, across = ODD_MPS, ODD_SHARE, SPREADS, ACROSS_SHARE
        if self.is_winds or self._has_leapt(t_s):
            fixed, share, spreads, across = LEAPT_MPS, LEAPT_SHARE, LEAPT_SPREADS, LEAPT_ACROSS_SHARE
        if abs(lacks) <= fixed + share * now.speed_mps + spreads * now.sigma_mps:
            return True
        return None if abs(now.across_mps) > across * abs(lacks) else False

    def _heels_to_windward(self, now: MotionSample) -> bool:
        return (
            LEAST_HEEL_TWA_RAD < abs(now.twa_rad) < MOST_HEEL_TWA_RAD
            and abs(self._heel_rad) > HEELS_RAD
            and ((self._heel_rad > 0.0) == (now.twa_rad > 0.0))
        )

    # ------------------------------------------------------------------------------------ the direction
    def follow_wind(self, t_s: float, twd_from_rad: float, tws_mps: float, *, is_driven: bool) -> None:
        """Take the wind at ``t_s`` as the vane tells it, whether the boat sails by it or not."""
        if tws_mps < LEAST_TWS_MPS:
            return  # a light air has no direction
        dt_s = 0.0 if self._wind_s is None else max(0.0, min(5.0, t_s - self._wind_s))
        self._wind_s = t_s
        kept = self._directions
        if not kept or t_s - kept[-1][0] >= KEPT_EVERY_S:
            kept.append((t_s, twd_from_rad))
        while t_s - kept[0][0] > MEMORY_S:
            kept.popleft()
        if self._is_leap:
            self._look_for_its_return(twd_from_rad, dt_s, is_driven=is_driven)
        old = [direction for then_s, direction in kept if t_s - then_s > BEFORE_S]
        if self.doubt or not old:
            return
        east, north = sum(map(math.sin, old)) / len(old), sum(map(math.cos, old)) / len(old)
        was = math.atan2(east, north)
        by_rad = difference_rad(twd_from_rad, was)
        if abs(by_rad) > JUMP_RAD:
            if not self._has_leapt(t_s):
                self._before_rad = was
            self._leapt_s = t_s
        is_turned = abs(by_rad) >= TURNED_RAD and len(old) >= LEAST_BEFORE and math.hypot(east, north) >= STEADY
        self._far_s = self._far_s + dt_s if is_turned else 0.0
        if self._far_s >= LASTS_S:
            self._is_leap = self.is_winds = True
            self.fits_s, self._tally, self._before_rad = 0.0, _Tally(), was
            self._back_s = self._moored_s = 0.0
            self.doubt = (
                f"the wind's direction leapt by {math.degrees(by_rad):+.0f}°, farther than a wind shifts "
                "but in a front: the vane was turned, its offset was, or the wind is new"
            )

    def _look_for_its_return(self, twd_from_rad: float, dt_s: float, *, is_driven: bool) -> None:
        """End the doubt of a leap that is over, or that has stayed for so long where nobody sails by it."""
        assert self._before_rad is not None
        is_back = abs(difference_rad(twd_from_rad, self._before_rad)) <= JUMP_RAD
        self._back_s = self._back_s + dt_s if is_back else 0.0
        self._moored_s = 0.0 if is_driven else self._moored_s + dt_s
        if self._back_s >= FITS_S or self._moored_s >= MOORED_S:
            self.settle()

    def _has_leapt(self, t_s: float) -> bool:
        return t_s - self._leapt_s <= BEFORE_S

    # ---------------------------------------------------------------------------------------- the doubt
    def _begin(self, t_s: float, now: MotionSample) -> None:
        heels = self._heels_to_windward(now)
        self.fits_s, self._tally = 0.0, _Tally()
        self.is_winds = heels or not now.is_heard or self._has_leapt(t_s)
        how = "astern" if now.along_mps < 0.0 else "ahead"
        # as past: it is said for as long as the doubt lasts
        moves = f"she made {abs(now.along_mps):.1f} m/s {how} where {now.speed_mps:.1f} m/s were to be expected"
        if heels:
            moves = f"she heeled {math.degrees(abs(self._heel_rad)):.0f}° to windward"
        if self._has_leapt(t_s) and self._before_rad is not None:
            by = math.degrees(difference_rad(now.twd_from_rad, self._before_rad))
            self.doubt = f"the wind's direction leapt by {by:+.0f}° and {moves}: the vane was turned, or its offset"
        elif not now.is_heard:
            self.doubt = f"the vane is not believed, and {moves}: the wind is another than it said last"
        elif heels:
            self.doubt = f"{moves}: the wind is not where the vane says"
        else:
            self.doubt = f"{moves}: no current comes so suddenly, the wind or the water is another than is measured"

    def _look_for_an_end(self, now: MotionSample) -> None:
        is_back = (
            not self.is_winds
            or self._before_rad is None
            or (abs(difference_rad(now.twd_from_rad, self._before_rad)) <= JUMP_RAD)
        )
        if is_back and self.fits_s >= FITS_S:
            self.settle()

    def settle(self) -> None:
        """End a doubt: what is measured is believed from here on."""
        self.doubt, self.is_odd, self.is_winds = "", False, False
        self._odd_s = self.fits_s = 0.0
        self._tally, self._before_rad, self._leapt_s = _Tally(), None, -math.inf
        self._is_leap, self._far_s = False, 0.0
        self._directions.clear()
