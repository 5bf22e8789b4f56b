"""Position integrity: whether the reported position can be true, and where else the boat may be. Pure.

A boat cannot jump: of the places before and after a jump one is false, and the autopilot steers by the later one
whatever it is. From the earlier one the boat is reckoned on by the velocity that is reported, which a receiver measures
by itself. What ends the doubt is evidence, or so long a time that no echo and no jammer is known to last it:

- the position comes back to where the boat is reckoned, whatever it did meanwhile;
- the filter had lost its position before, and the jump is no longer than what it may have erred by: the earlier place
  was the guess;
- a second receiver says the same for a while;
- a person who has seen it gives it back;
- the place where the boat is reckoned lies inside something solid;
- it stays for ten minutes where the boat can be, filter and receiver agreeing. A forger who is more patient than that
  is not found out by a boat with one receiver.

A place deep inside something solid is none that the boat can be at, jump or not, and never the start of a plan.

A jump is one by the same test whether it is seen from one fix to the next, after a silence of the link, or by who comes
after a kill (``innovation_m``): the last place and speed could not have led the boat there.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from companion.skipper.way.geometry import leg_distance_m
from companion.skipper.way.voyage import AreaLike, PointEn

ERROR_M = 5.0  # of a good fix, and of a chart's outline beside its margin
BACK_M = 15.0  # back where it was reckoned misses that by no more, and ...
BACK_SHARE = 0.5  # ... by no more of the farthest that the position was off it
ERRS_MPS = 0.05  # the reckoned place errs by so much more each second that the velocity is heard
LOST_ERRS_MPS = 1.0  # a position without a receiver errs by so much more each second
LOST_S = 3.0  # a filter that was ill for less has not lost anything
AGREE_M = 15.0  # two receivers, each up to a second late, and the filter's lag
DISPUTED_S = 3.0  # receivers that say different things for so long have not just been heard one after the other
CONFIRMED_S = 30.0  # two receivers that are wrong alike: an antenna's shadow, over by then
LASTS_S = 600.0  # multipath, a jammer that passes, a filter that finds itself: all shorter
QUIET_S = 20.0  # fixes in a row without a jump, where there is other evidence, or nothing near
GAINS_MPS = 1.0  # what a boat gains or loses between two fixes, beside turning, and is carried by the water
SILENT_S = 3.0  # a longer time between two fixes is a silence: nobody knows what was sailed in it
SAILS_MPS = 0.8  # who is slower before or after a silence may have sailed faster in it
HELD_MPS = 0.5  # by which a boat that is held is carried off the place of it
STRAYS_M = 25.0  # what a boat in LOITER or HOLD is off its place when it is found again
REACH_MPS = 2.0  # nothing solid within what is sailed in ``LASTS_S`` at this: what is believed is nobody's danger


def innovation_m(
    way_en_m: PointEn, dt_s: float, before_mps: PointEn, now_mps: PointEn, *, fastest_mps: float, is_held: bool = False
) -> float:
    """Return how much farther off a fix is than its last place and speed can have led the boat [m].

    ``way_en_m`` is from the last fix to this one, ``dt_s`` later; ``before_mps`` and ``now_mps`` are the velocities
    at both [m/s, east north]. Between them the boat may have turned, once or several times, and gained
    ``GAINS_MPS``; who hardly sailed at one end of a silence may have sailed at ``fastest_mps`` in it, and who
    ``is_held`` in a loiter is where it was.

    >>> innovation_m((0.0, 60.0), 1.0, (0.0, 2.0), (0.0, 2.0), fastest_mps=5.0)
    57.0
    """
    speeds = math.hypot(*before_mps), math.hypot(*now_mps)
    speed_mps = max(speeds)
    if dt_s > SILENT_S and min(speeds) < SAILS_MPS:
        speed_mps = max(speed_mps, fastest_mps)
    strays_m = (speed_mps + GAINS_MPS) * dt_s
    if is_held:
        strays_m = min(strays_m, STRAYS_M + HELD_MPS * dt_s)
        return max(0.0, math.hypot(*way_en_m) - strays_m)
    straight, turned = ((v[0] * dt_s, v[1] * dt_s) for v in (before_mps, now_mps))
    return max(0.0, math.hypot(*way_en_m) - strays_m, leg_distance_m(way_en_m, straight, turned) - strays_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What a step shows of a position.

    Attributes:
        t_s: of the fix.
        en_m: the position as it is reported.
        velocity_en_mps: as reported.
        is_jump: it came here by a jump just now.
        is_possible: it is not inside anything solid.
        is_other_possible: nor is the reckoned place, by more than it may err.
        is_well: the filter is well, and its receiver says the same.
        second_en_m: what a second receiver says, None without one or its fix.
        room_m: to the nearest solid thing [m], here or where the boat is reckoned, whichever is less.
        is_given: a person has given it to the companion since the doubt began.
    """

    t_s: float
    en_m: PointEn
    velocity_en_mps: tuple[float, float]
    is_jump: bool = False
    is_possible: bool = True
    is_other_possible: bool = True
    is_well: bool = True
    second_en_m: PointEn | None = None
    room_m: float = math.inf
    is_given: bool = False

    @property
    def is_confirmed(self) -> bool:
        """Whether a second receiver says the same."""
        return self.second_en_m is not None and math.dist(self.second_en_m, self.en_m) <= AGREE_M

    @property
    def is_contradicted(self) -> bool:
        """Whether a second receiver says something else."""
        return self.second_en_m is not None and not self.is_confirmed


@dataclass(frozen=True, slots=True, kw_only=True)
class PositionDoubt:
    """A position that is not believed.

    Attributes:
        since_s: when it began.
        t_s: of the last fix reckoned with.
        reckoned_en_m: where the boat is if the position is false.
        velocity_en_mps: of that fix.
        error_m: how far off that it may be.
        lost_m: how far the earlier position may have been off because the filter had lost it.
        farthest_m: how far the reported position was off the reckoned one at the most.
        settled_s: since when it has neither jumped nor spoken against itself.
        confirmed_s: since when a second receiver has said the same, None: it does not.
        is_dispute: it came only of receivers that differ.
        why: what is wrong with it, in words.
    """

    since_s: float
    t_s: float
    reckoned_en_m: PointEn
    velocity_en_mps: PointEn
    error_m: float = 0.0
    lost_m: float = 0.0
    farthest_m: float = 0.0
    settled_s: float
    confirmed_s: float | None = None
    is_dispute: bool = False
    why: str

    def after(self, seen: Evidence) -> PositionDoubt:
        """Return the doubt with one more fix: the boat reckoned on, the evidence added up."""
        dt_s = max(0.0, seen.t_s - self.t_s)
        (east, north), errs_mps = seen.velocity_en_mps, ERRS_MPS
        if dt_s > SILENT_S:  # by the mean of both its ends, from which the boat may have turned
            east, north = 0.5 * (east + self.velocity_en_mps[0]), 0.5 * (north + self.velocity_en_mps[1])
            errs_mps = max(math.hypot(*seen.velocity_en_mps), math.hypot(*self.velocity_en_mps)) + GAINS_MPS
        place = (self.reckoned_en_m[0] + dt_s * east, self.reckoned_en_m[1] + dt_s * north)
        if seen.is_contradicted and seen.second_en_m is not None:
            place = seen.second_en_m  # where the other receiver has the boat is better than reckoned
        speaks_against = seen.is_jump or seen.is_contradicted or not (seen.is_possible and seen.is_well)
        confirmed_s = seen.t_s if self.confirmed_s is None else self.confirmed_s
        return replace(
            self,
            t_s=max(self.t_s, seen.t_s),
            reckoned_en_m=place,
            velocity_en_mps=seen.velocity_en_mps,
            error_m=self.error_m + errs_mps * dt_s,
            farthest_m=max(self.farthest_m, math.dist(place, seen.en_m)),
            settled_s=seen.t_s if speaks_against else self.settled_s,
            confirmed_s=confirmed_s if seen.is_confirmed and not speaks_against else None,
            is_dispute=self.is_dispute and not seen.is_jump,
        )

    def is_back(self, en_m: PointEn) -> bool:
        """Return whether a position that was off is back where the boat is reckoned."""
        off_m = math.dist(self.reckoned_en_m, en_m)
        return off_m <= max(BACK_M, self.error_m) and off_m < BACK_SHARE * self.farthest_m

    def believed_for(self, seen: Evidence) -> str:
        """Return why the position can be believed again, in words; empty: it cannot."""
        if not seen.is_possible or seen.is_contradicted:
            return ""
        if self.is_back(seen.en_m):
            return "it is back where it was reckoned"
        if self.is_dispute:
            return "the receivers agree, or one is silent"
        settled_s = seen.t_s - self.settled_s
        if self.lost_m > 0.0 and self.farthest_m <= self.lost_m and settled_s >= QUIET_S:
            return "the filter had lost its position before, and has found it"
        if self.confirmed_s is not None and seen.t_s - self.confirmed_s >= CONFIRMED_S:
            return "a second receiver says the same"
        if settled_s >= QUIET_S:
            if seen.is_given:
                return "a person has given her back there"
            if not seen.is_other_possible:
                return "the reckoned place cannot be: it was the earlier position that was false"
            if seen.room_m >= REACH_MPS * LASTS_S:
                return "nothing solid is near, wherever she is"
        return f"it has stayed for {LASTS_S / 60.0:.0f} minutes" if settled_s >= LASTS_S else ""


def is_impossible(area: AreaLike, en_m: PointEn, *, margin_m: float) -> bool:
    """Return whether a place is so deep inside something solid that no error of fix and chart explains it."""
    return float(area.unfenced.clearance_m([en_m])[0]) < -(margin_m + ERROR_M)
