"""The search for failures: draws that are moved towards contact, in place of blind ones.

Whatever a campaign draws it draws from one stream of numbers between 0 and 1. A point is such a stream, so any campaign
can be searched by its own drawing. A generation sails as many points as every other; the share of it that came nearest
is kept, each is moved, and a move is taken back that does not come as near as the last of those kept. So the points of
a level are drawn as blind ones would be that happen to come so near (Au and Beck 2001, Estimation of small failure
probabilities in high dimensions by subset simulation), and the chance of a contact is the product of the shares.

How near a voyage came is the hull's least clearance. One that touched with an excuse (``sitl faults`` says which) leads
nowhere: it counts as one that came near nothing.
"""

from __future__ import annotations

import math
import os
import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import msgspec

from companion.disk import Disk
from companion.words import counted
from lab.campaigns import drawn_faults, drawn_mismatch, faults, mismatch
from lab.campaigns.fault_judge import UNEXCUSED
from sitl.options import CampaignOptions
from sitl.runner import Experiment, Job, file_hash
from sitl.scenario import Scenario, load_scenario, scenario_text

LENGTH = 160  # numbers of a stream; what a voyage draws beyond them is the same for all its descendants
KEPT = 0.25  # of a generation
TOUCHED = 0.2  # of the numbers of a stream are moved at a time ...
STEP = 0.15  # ... by this much, round the ends
ANEW = 0.03  # ... and these are drawn anew
OTHER_WEATHER = 0.2  # how often a move is into another weather, too


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
    chance: float = 1.0  # of coming as near as the threshold
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
        if ranked[kept - 1][0] < self.threshold_m:  # all alike: the level is not left yet
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
        self._here = (
            came
            if not self._parents
            else [
                now if now[0] <= self.threshold_m else before for now, before in zip(came, self._parents, strict=True)
            ]
        )


# The water of `sitl mismatch` in which the floor was broken.
NARROW = drawn_mismatch.WATERS[2]
What = Literal["mismatch", "faults"]


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchCase:
    """What is drawn by a point, the ``number``-th voyage of a search."""

    what: What
    point: Point
    number: int


def drawn_of(job: Job[SearchCase]) -> Scenario:
    """Return the scenario of a job, with all that was drawn for it."""
    if job.case.what == "faults":
        return drawn_faults.drawn_by(job.case.point.draws(), load_scenario(job.scenario))
    return drawn_mismatch.drawn_by(job.case.point.draws(), job.scenario).scenario


def sail(job: Job[SearchCase]) -> dict[str, Any]:
    """Sail a job; return how it went and how near it came."""
    if job.case.what == "faults":
        record = faults.sail_faults(drawn_of(job), Job(scenario=job.scenario, seed=job.seed, case=faults.FaultCase()))
        touched = [contact["excuse"] == UNEXCUSED for contact in record["contacts"]]
        near_m, drawn = record["clearance_m"], record["events"]
    else:
        drawn_boat = drawn_mismatch.drawn_by(job.case.point.draws(), job.scenario)
        record = mismatch.sail_drawn(drawn_boat, mismatch.job_of(job.seed))
        touched = [True] * (record.get("contacts") or 0)
        near_m, drawn = record.get("min_clearance_m"), record["kinds"]
    score_m = near_m if near_m is not None and math.isfinite(near_m) else None
    if touched:
        score_m = 0.0 if any(touched) else None
    return {
        "number": job.case.number,
        "seed": job.seed,
        "score_m": score_m,
        "violates": any(touched),
        "passed": record["passed"],
        "faults": record["faults"],
        "drawn": drawn,
    }


def generation(name: str, jobs: Sequence[Job[SearchCase]]) -> Experiment[SearchCase]:
    """Return a generation of the search that is called so: it and a voyage's number say what was drawn."""
    return Experiment(
        name="search",
        jobs=jobs,
        sail=sail,
        is_failed=lambda record: record["violates"],
        key=lambda job: {
            "search": name,
            "scenario": load_scenario(job.scenario).name,
            "hash": file_hash(job.scenario),
            "number": job.case.number,
        },
    )


def run_search(
    *,
    what: What,
    scenario: Path,
    runs: int,
    each: int,
    first_seed: int,
    is_blind: bool,
    found: Path,
    options: CampaignOptions,
) -> int:
    """Search until a voyage touches or ``runs`` are sailed; say how, and leave the scenario. Return the exit code."""
    name = f"{what} {'blind' if is_blind else 'splitting'} {each} {first_seed}"
    search = Splitting(random.Random(f"search {name}"), each=each, is_blind=is_blind)
    sailed = 0
    while sailed < runs:
        jobs = [
            Job(scenario=scenario, seed=point.seed, case=SearchCase(what=what, point=point, number=sailed + n))
            for n, point in enumerate(search.ask())
        ]
        there = generation(name, jobs).results(options)
        if there.lost:
            return there.exit_code(is_good=False)
        sailed += len(jobs)
        search.tell([math.inf if r["score_m"] is None else r["score_m"] for r in there.records])
        nearest = min((r["score_m"] for r in there.records if r["score_m"] is not None), default=math.inf)
        print(
            f"{sailed} sailed, level {search.level}: nearer than {search.threshold_m:.1f} m (chance "
            f"{search.chance:.2g}), nearest of this generation {nearest:.1f} m",
            flush=True,
        )
        bad = [record for record in there.records if record["violates"] or record["faults"]]
        for record in bad:
            path = _left(jobs[record["number"] - jobs[0].case.number], found)
            print(
                f"FOUND after {record['number'] + 1} voyages: {'; '.join(record['faults'])} "
                f"({', '.join(record['drawn'])}); again: sitl run {path} --seed {record['seed']}",
                flush=True,
            )
        if any(record["violates"] for record in bad):
            return 1
    print(f"no contact in {counted(sailed, 'voyage')}")
    return 0


def _left(job: Job[SearchCase], folder: Path) -> Path:
    """Write the scenario of a job into a folder; return its file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{job.case.what}-{job.case.number}-{job.seed}.toml"
    drawn = drawn_of(job)
    mission = os.path.relpath(drawn.mission_path(job.scenario), folder.resolve())
    Disk().replace(path, scenario_text(msgspec.structs.replace(drawn, mission=mission)).encode())
    return path
