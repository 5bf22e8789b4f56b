"""A rehearsal: voyages until the answer is sure enough, changes by pairs, the worst again, and what is written."""

from __future__ import annotations

import contextlib
import json
import math
import os
import shutil
import sys
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

from companion.disk import Disk, reason
from companion.errors import CompanionError
from companion.program import control
from companion.program.commands import missing
from companion.words import counted
from sitl.options import CampaignOptions
from sitl.rehearse.changes import MissionChange, Tried, tried
from sitl.rehearse.estimates import Estimates, as_lines, estimates_of, share_of, why_bad
from sitl.rehearse.prepared import PreparedRehearsal
from sitl.rehearse.report import FIGURES, PAGE, PICTURE, RESULTS, WORST, RehearsalOutcome, page_of
from sitl.rehearse.voyage import RehearsalCase, rehearsal, sail
from sitl.runner import CampaignResults, Job

MOST_WORST = 3
CHANCES_SHARE = 0.6  # of the minutes, where changes are tried in the rest
PAGE_EVERY_S = 10.0  # the page fills


@dataclass(frozen=True, slots=True, kw_only=True)
class Limits:
    """When a rehearsal ends: its intervals are no wider than ``width``, ``runs`` voyages, ``minutes`` from ``began_s``.

    The minutes are those of the whole answer: the chances first, then what changes are worth, then the worst again.
    """

    width: float
    runs: int
    minutes: float | None = None
    began_s: float = field(default_factory=time.monotonic)

    def left_s(self, share: float = 1.0) -> float:
        """Return how long it is until that share of the minutes is over [s]; infinite where none are named."""
        return math.inf if self.minutes is None else self.began_s + 60.0 * share * self.minutes - time.monotonic()


@dataclass(slots=True)
class Follower:
    """Follows the results as they come, seed by seed, until they are sure enough or the time is over.

    A job that was lost is told, and holds up nothing.
    """

    limits: Limits
    share: float = 1.0  # of the minutes
    on_known: Callable[[Estimates], None] = lambda _: None
    count: int = 0
    ends: str = ""
    known: Estimates = field(default_factory=lambda: estimates_of(()))
    _of: int = 0
    _arrived: int = 0
    _low: int = 0

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
        if not self.ends and self.limits.left_s(self.share) <= 0.0:
            self.ends = "the time is over"
        self.known = estimates_of(there[: self.count])
        if self.known.records:
            self.on_known(self.known)
        return self.known.line() if self.count else "nothing known yet", bool(self.ends)


class _GrowingPage:
    """The page while voyages come: there from the first on, written again every ``PAGE_EVERY_S``."""

    def __init__(self, made: PreparedRehearsal, folder: Path) -> None:
        self._made, self._folder = made, folder
        self._written_s = -math.inf

    def fill(self, outcome: RehearsalOutcome) -> None:
        """Write it, if it is time; what the disk does not take is said in the end."""
        if time.monotonic() - self._written_s >= PAGE_EVERY_S:
            self._written_s = time.monotonic()
            with contextlib.suppress(OSError):
                Disk().replace(self._folder / PAGE, page_of(self._made, outcome, self._folder, is_whole=False))


def rehearse(
    made: PreparedRehearsal,
    folder: Path,
    limits: Limits,
    changes: Sequence[MissionChange],
    pairs: int,
    options: CampaignOptions,
    json_path: Path | None,
) -> int:
    """Sail, tell and write; return the exit code."""
    jobs = [Job(scenario=made.source, seed=seed, case=RehearsalCase(doubts=made.doubts)) for seed in range(limits.runs)]
    page = _GrowingPage(made, folder)
    follower = Follower(
        limits,
        share=CHANCES_SHARE if changes and pairs else 1.0,
        on_known=lambda known: page.fill(RehearsalOutcome(known=known, ends="more to come")),
    )
    if options.array[1] > 1:
        return _part(jobs, changes, pairs, options)
    try:
        sailed = rehearsal(jobs).results(options, watch=follower)
    except KeyboardInterrupt:
        sys.stdout.write("\n" + "\n".join(as_lines(follower.known)) + "\nended by hand: the same command goes on\n")
        raise
    code = sailed.exit_code(is_good=True)
    count = min(pairs, len(follower.known.records))
    found: list[Tried] = []
    voyage_s = sailed.wall_s / sailed.now * (options.workers or os.cpu_count() or 1) if sailed.now else 0.0
    if changes and count:
        sys.stdout.write("\n".join(as_lines(follower.known)) + "\n")  # the chances are known: nobody waits for the rest
        sys.stderr.write(f"{counted(len(changes), 'change')}, each for the first {counted(count, 'seed')}\n")

        def so_far(records: Sequence[dict[str, Any]]) -> list[Tried]:
            return [
                tried(change, follower.known.records[:count], mine)
                for change in changes
                if (mine := [r for r in records if r.get("change") == change.told])
            ]

        def is_time(there: Sequence[dict[str, Any] | None]) -> tuple[str, bool]:
            records = [record for record in there if record]
            page.fill(RehearsalOutcome(known=follower.known, ends="more to come", changes=tuple(so_far(records))))
            left_s = limits.left_s()
            words = "" if math.isinf(left_s) else f"at most {max(0.0, left_s):.0f} s left"
            return words, left_s <= voyage_s  # of the worst, once again

        # seed by seed: when the time is over, all changes have been tried alike
        again = rehearsal(changed(jobs[:count], changes)).results(options, watch=is_time)
        code |= again.exit_code(is_good=True)
        found = so_far(again.records)
    outcome = RehearsalOutcome(
        known=follower.known,
        ends=follower.ends or "not as sure as was asked for",
        changes=tuple(found),
        folders=_worst(follower.known, jobs, folder, limits, voyage_s),
    )
    sys.stdout.write("\n".join(_words(outcome, sailed, is_told=bool(changes and count))) + "\n")
    return code | _written(outcome, made, folder, json_path)


def changed(jobs: Sequence[Job[RehearsalCase]], changes: Sequence[MissionChange]) -> list[Job[RehearsalCase]]:
    """Return each job with each change, seed by seed."""
    return [replace(job, case=replace(job.case, change=change)) for job in jobs for change in changes]


def _part(
    jobs: Sequence[Job[RehearsalCase]], changes: Sequence[MissionChange], pairs: int, options: CampaignOptions
) -> int:
    """Sail a part of all voyages; what is known is told when the parts are together."""
    sailed = rehearsal([*jobs, *changed(jobs[:pairs], changes)]).results(options)
    number, of = options.array
    sys.stdout.write(
        f"{sailed.took}\npart {number} of {of}, in {options.file}; when all are sailed: sitl results join "
        f"{options.out.with_name(f'results.*-of-{of}.jsonl') if options.out else ''} --out {options.out}, "
        "and this command without --array tells what is known\n"
    )
    return sailed.exit_code(is_good=True)


def _worst(
    known: Estimates, jobs: Sequence[Job[RehearsalCase]], folder: Path, limits: Limits, voyage_s: float
) -> tuple[tuple[dict[str, Any], Path | None], ...]:
    """Sail the worst voyages again, while there is time, and keep their folders; a seed repeats to the last bit."""
    found: list[tuple[dict[str, Any], Path | None]] = []
    begin, end = ("\r", "   ") if sys.stderr.isatty() else ("", "\n")  # one line is written over and over
    for before in (folder / WORST).glob("*-seed-*"):  # ours, and nothing else that may be there
        shutil.rmtree(before) if before.is_dir() else before.unlink()
    for number, record in enumerate(known.worst(MOST_WORST), start=1):
        if limits.left_s() < voyage_s:
            found.append((dict(record), None))
            continue
        place = folder / WORST / f"{number}-seed-{record['seed']}"
        control(sys.stderr, f"{begin}the worst again: {number} of {min(MOST_WORST, len(known.records))}{end}")
        sys.stderr.flush()
        kept: Path | None = place
        try:
            place.parent.mkdir(parents=True, exist_ok=True)
            again = json.loads(json.dumps(sail(replace(jobs[record["seed"]], keep=place))))
            if again != record:
                sys.stderr.write(
                    f"\nseed {record['seed']} is another voyage here: was it sailed by another kind of processor?\n"
                )
        except OSError as error:
            sys.stderr.write(f"\n{place}: {reason(error)}: the folder is not kept, the result is\n")
            shutil.rmtree(place, ignore_errors=True)
            kept = None
        found.append((dict(record), kept))
    if found and sys.stderr.isatty():
        sys.stderr.write("\n")
    return tuple(found)


def _words(outcome: RehearsalOutcome, sailed: CampaignResults, *, is_told: bool) -> list[str]:
    lines = [f"{outcome.ends}; {sailed.took}"]
    if not outcome.known.records:
        return [*lines, "no chances yet, for the first seed is not done: more --minutes, and the same command goes on"]
    if not is_told:
        lines = [*as_lines(outcome.known), *lines]
    if is_told and not outcome.changes:
        lines.append("what changes are worth: there was no time for it; more --minutes, and the same command goes on")
    if outcome.changes:
        lines.append(
            "what to change, by pairs of voyages with the same seed (the difference and its 95 % interval; of "
            "twenty such intervals one is wrong):"
        )
        lines += [f"  {change.as_text()}" for change in outcome.changes]
    if outcome.folders:
        lines.append("the worst:")
        lines += [
            f"  seed {record['seed']}: {why_bad(record)}{f'; companion view {folder}' if folder else ''}"
            for record, folder in outcome.folders
        ]
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
        sys.stdout.write(
            f"not written: {why}; the voyages are safe in {folder / RESULTS}: make room, and the same command goes on\n"
        )
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
