"""Splitting: draws that come near to contact are kept and moved a little, level by level, until one touches.

Whatever a campaign draws it draws from one stream of numbers between 0 and 1. A point is such a stream, so any campaign
can be searched by its own drawing. A generation sails as many points as every other; the share of it that came nearest
is kept, each is moved, and a move is taken back that does not come as near as the last of those kept. So the points of
a level are drawn as blind ones would be that happen to come so near (Au and Beck 2001, Estimation of small failure
probabilities in high dimensions by subset simulation), and the chance of a contact is the product of the shares.
"""

from __future__ import annotations

import math
import random
from collections.abc import Sequence
from dataclasses import dataclass, field

LENGTH = 160        # numbers of a stream; what a voyage draws beyond them is the same for all its descendants
KEPT = 0.25         # of a generation
TOUCHED = 0.2       # of the numbers of a stream are moved at a time ...
STEP = 0.15         # ... by this much, round the ends
ANEW = 0.03         # ... and these are drawn anew
OTHER_WEATHER = 0.2   # how often a move is into another weather, too


@dataclass(frozen=True, slots=True, kw_only=True)
class Point:
    """One voyage to be: what is drawn for it, and the seed of its weather and sensors."""

    seed: int
    numbers: tuple[float, ...]

    def draws(self) -> Tape:
        """Return what to draw it with."""
        return Tape(self.numbers)


class Tape(random.Random):
    """A generator that gives the numbers of a stream, and behind its end those of a seed made of them."""

    def __init__(self, numbers: tuple[float, ...]) -> None:
        super().__init__(repr(numbers[:3]))
        self._left = list(reversed(numbers))

    def random(self) -> float:
        """Return the next number. All other draws are made of it: integers too, for want of ``getrandbits``."""
        return self._left.pop() if self._left else super().random()


def blind(rng: random.Random) -> Point:
    """Return a point as anybody would draw it."""
    return Point(seed=rng.randrange(2**31), numbers=tuple(round(rng.random(), 6) for _ in range(LENGTH)))


def moved(rng: random.Random, point: Point) -> Point:
    """Return a point near another; as likely from the other back to it."""
    numbers = []
    for number in point.numbers:
        lot = rng.random()
        if lot < ANEW:
            numbers.append(round(rng.random(), 6))
        elif lot < ANEW + TOUCHED:
            numbers.append(round((number + rng.gauss(0.0, STEP)) % 1.0, 6))
        else:
            numbers.append(number)
    seed = rng.randrange(2**31) if rng.random() < OTHER_WEATHER else point.seed
    return Point(seed=seed, numbers=tuple(min(number, 0.999999) for number in numbers))


@dataclass(slots=True)
class Splitting:
    """A search under way: asked for a generation of points and told how near each came [m, 0: touched], in turn.

    ``is_blind``: each generation is drawn as the first was, to compare with.
    """

    rng: random.Random
    each: int
    is_blind: bool = False
    threshold_m: float = math.inf
    chance: float = 1.0      # of coming as near as the threshold
    level: int = 0
    _here: list[tuple[float, Point]] = field(default_factory=list)
    _asked: list[Point] = field(default_factory=list)
    _parents: list[tuple[float, Point]] = field(default_factory=list)

    def ask(self) -> list[Point]:
        """Return the next generation."""
        if self.is_blind or not self._here:
            self._asked, self._parents = [blind(self.rng) for _ in range(self.each)], []
            return self._asked
        kept = max(1, round(KEPT * self.each))
        ranked = sorted(self._here, key=lambda entry: entry[0])
        if ranked[kept - 1][0] < self.threshold_m:   # all alike: the level is not left yet
            self.threshold_m = ranked[kept - 1][0]
            self.chance *= sum(score <= self.threshold_m for score, _ in ranked) / len(ranked)
            self.level += 1
        survivors = [entry for entry in ranked if entry[0] <= self.threshold_m]
        self._parents = [survivors[n % len(survivors)] for n in range(self.each)]
        self._asked = [moved(self.rng, point) for _, point in self._parents]
        return self._asked

    def tell(self, scores_m: Sequence[float]) -> None:
        """Take how near each of the generation came."""
        came = list(zip(scores_m, self._asked, strict=True))
        self._here = came if not self._parents else [
            now if now[0] <= self.threshold_m else before for now, before in zip(came, self._parents, strict=True)]
