"""A rehearsal: voyages until the answer is sure enough, changes by pairs, the worst again, and what is written."""

from __future__ import annotations

import json
import shutil
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from companion.disk import Disk, reason
from companion.errors import CompanionError
from companion.program import control
from companion.program.commands import missing
from companion.words import counted
from sitl.options import CampaignOptions
from sitl.rehearse.changes import CAMPAIGN, MissionChange, Tried, tried
from sitl.rehearse.estimates import Estimates, estimates_of, share_of, told, why_bad
from sitl.rehearse.prepared import PreparedRehearsal
from sitl.rehearse.report import FIGURES, PAGE, PICTURE, RESULTS, WORST, RehearsalOutcome, page_of
from sitl.rehearse.voyage import Job, key_of, sail_one
from sitl.runner import CampaignResults, run_jobs

MOST_WORST = 3


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """When a rehearsal ends: its intervals are no wider than ``width``, ``runs`` voyages, ``minutes`` from now."""

    width: float
    runs: int
    minutes: float | None = None


@dataclass(slots=True)
class Follower:
    """Follows the results as they come, seed by seed, until they are sure enough or the time is over.

    A job that was lost is told, and holds up nothing.
    """

    limits: Limits
    count: int = 0
    ends: str = ""
    known: Estimates = field(default_factory=lambda: estimates_of(()))
    _of: int = 0
    _arrived: int = 0
    _low: int = 0
    _began_s: float = field(default_factory=time.monotonic)

    def __call__(self, there: Sequence[dict[str, Any] | None]) -> tuple[str, bool]:
        """Return what is known so far, in words, and whether that is enough."""
        while not self.ends and self.count < len(there) and (record := there[self.count]) is not None:
            self.count += 1
            self._of += bool(record)
            self._arrived += bool(record.get("arrived"))
            self._low += bool(record.get("below_floor"))
            widths = (share_of(came, self._of).width for came in (self._arrived, self._low))
            if max(widths) <= self.limits.width:
                self.ends = "sure enough"
        minutes = self.limits.minutes
        if not self.ends and minutes is not None and time.monotonic() - self._began_s >= 60.0 * minutes:
            self.ends = "the time is over"
        self.known = estimates_of(there[:self.count])
        return self.known.line() if self.count else "nothing known yet", bool(self.ends)


def rehearse(
    made: PreparedRehearsal, folder: Path, limits: Limits, changes: Sequence[MissionChange], pairs: int,
    means: CampaignOptions, json_path: Path | None,
) -> int:
    """Sail, tell and write; return the exit code."""
    jobs = [Job(scenario=made.source, seed=seed, doubts=made.doubts) for seed in range(limits.runs)]
    follower = Follower(limits)
    if means.array[1] > 1:
        return _part(jobs, changes, pairs, means)
    try:
        sailed = _sailed(jobs, means, follower)
    except KeyboardInterrupt:
        sys.stdout.write("\n" + "\n".join(told(follower.known)) + "\nended by hand: the same command goes on\n")
        raise
    code = sailed.exit_code(is_good=True)
    count = min(pairs, len(follower.known.records))
    found: list[Tried] = []
    if changes and count:
        sys.stderr.write(f"{counted(len(changes), 'change')}, each for the first {counted(count, 'seed')}\n")
        again = _sailed([replace(job, change=change) for change in changes for job in jobs[:count]], means, None)
        code |= again.exit_code(is_good=True)
        for change in changes:
            if mine := [record for record in again.records if record["change"] == change.told]:
                found.append(tried(change, follower.known.records[:count], mine))
    outcome = RehearsalOutcome(known=follower.known, ends=follower.ends or "not as sure as was asked for",
                      changes=tuple(found), folders=_worst(follower.known, jobs, folder))
    sys.stdout.write("\n".join(_words(outcome, sailed)) + "\n")
    return code | _written(outcome, made, folder, json_path)


def _sailed(jobs: Sequence[Job], means: CampaignOptions, follower: Follower | None) -> CampaignResults:
    return run_jobs(CAMPAIGN, sail_one, jobs, means, key=key_of, watch=follower,
                    is_failed=lambda record: "error" in record)


def _part(jobs: Sequence[Job], changes: Sequence[MissionChange], pairs: int, means: CampaignOptions) -> int:
    """Sail a part of all voyages; what is known is told when the parts are together."""
    others = [replace(job, change=change) for change in changes for job in jobs[:pairs]]
    sailed = _sailed([*jobs, *others], means, None)
    number, of = means.array
    sys.stdout.write(f"{sailed.took}\npart {number} of {of}, in {means.file}; when all are sailed: sitl results join "
                     f"{means.out.with_name(f'results.*-of-{of}.jsonl') if means.out else ''} --out {means.out}, and "
                     "this command without --array tells what is known\n")
    return sailed.exit_code(is_good=True)


def _worst(known: Estimates, jobs: Sequence[Job], folder: Path) -> tuple[tuple[dict[str, Any], Path | None], ...]:
    """Sail the worst voyages again and keep their folders; a seed repeats to the last bit."""
    found: list[tuple[dict[str, Any], Path | None]] = []
    for before in (folder / WORST).glob("*-seed-*"):   # ours, and nothing else that may be there
        shutil.rmtree(before) if before.is_dir() else before.unlink()
    for number, record in enumerate(known.worst(MOST_WORST), start=1):
        place = folder / WORST / f"{number}-seed-{record['seed']}"
        control(sys.stderr, f"\rthe worst again: {number} of {min(MOST_WORST, len(known.records))}   ")
        sys.stderr.flush()
        kept: Path | None = place
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            again = json.loads(json.dumps(sail_one(replace(jobs[record["seed"]], keep=place))))
            if again != record:
                sys.stderr.write(f"\nseed {record['seed']} is another voyage here: was it sailed by another kind of "
                                 "processor?\n")
        except OSError as error:
            sys.stderr.write(f"\n{place}: {reason(error)}: the folder is not kept, the result is\n")
            shutil.rmtree(place, ignore_errors=True)
            kept = None
        found.append((dict(record), kept))
    if found:
        sys.stderr.write("\n")
    return tuple(found)


def _words(outcome: RehearsalOutcome, sailed: CampaignResults) -> list[str]:
    lines = [*told(outcome.known), f"{outcome.ends}; {sailed.took}"]
    if outcome.changes:
        lines.append("what to change, by pairs of voyages with the same seed (the difference and its 95 % interval; of "
                     "twenty such intervals one is wrong):")
        lines += [f"  {change.told()}" for change in outcome.changes]
    if outcome.folders:
        lines.append("the worst:")
        lines += [f"  seed {record['seed']}: {why_bad(record)}{f'; companion view {folder}' if folder else ''}"
                  for record, folder in outcome.folders]
    return lines


def _written(outcome: RehearsalOutcome, made: PreparedRehearsal, folder: Path, json_path: Path | None) -> int:
    """Write figures, picture and page; say what the disk does not take. Return the exit code."""
    figures = json.dumps(outcome.to_dict(made), indent=1).encode() + b"\n"
    try:
        for path in {folder / FIGURES, json_path or folder / FIGURES}:
            Disk().replace(path, figures)
        _draw(outcome, made, folder / PICTURE)
        Disk().replace(folder / PAGE, page_of(made, outcome, folder))
    except (OSError, CompanionError) as error:
        why = f"{error.filename}: {reason(error)}" if isinstance(error, OSError) else str(error)
        sys.stdout.write(f"not written: {why}; the voyages are safe in {folder / RESULTS}: make room, and the same "
                         "command goes on\n")
        return 1
    sys.stdout.write(f"page: {folder / PAGE}\n")
    return 0


def _draw(outcome: RehearsalOutcome, made: PreparedRehearsal, path: Path) -> None:
    """Draw the picture where there is something to draw with."""
    path.unlink(missing_ok=True)
    try:
        from sitl.rehearse.picture import save_rehearsal
    except ModuleNotFoundError as error:
        why = missing(error)
        if why is None:
            raise
        sys.stdout.write(f"there is no picture: {why}\n")
        return
    save_rehearsal(made, outcome, path)
