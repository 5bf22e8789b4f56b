"""Folds a recorded voyage again: the same messages, outcomes and ticks must give the same actions.

The telemetry log holds every message, decisions.jsonl every outcome and action, track.csv when the skipper stepped
and how many messages and outcomes it had seen by then. Numbers are compared with a tolerance, since plans were
written in degrees.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from companion.compose import config_of, estimator_of, target_limits_of, voyage_of, water_of, waters_of
from companion.errors import InputError
from companion.fold import Step, VoyageFold
from companion.geofence import load_mission
from companion.mavlink.reception import OWN_COMPONENT
from companion.mavlink.tlog import TlogRecord, read_tlog
from companion.mavlink.wire import Codec, Message
from companion.messages import MissionItem
from companion.orders import Order
from companion.planner import Plan
from companion.skipper import Skipper
from companion.skipper.step import (
    CommandOutcome,
    CommandResult,
    Outcome,
    Permissions,
    Persisted,
    PlanOutcome,
    ReadOutcome,
    UploadOutcome,
    UploadResult,
)
from companion.telemetry.folder import (
    DECISIONS,
    TLOG,
    TRACK,
    VOYAGE,
    action_record,
    ais_of,
    believed,
    is_from_the_start,
    jsonable,
    parts,
    read_decisions,
    read_description,
    read_rows,
    require_files,
)
from companion.wind import WindTracker
from companion.words import counted

TOLERANCE = 1e-6
# Fields of a record that say when it was written, not what was decided.
_STAMPS = frozenset({"t_s", "utc"})
_AFTER_S = 3600.0  # messages may have come for so long behind the last row of the track


@dataclass(frozen=True, slots=True, kw_only=True)
class Difference:
    """One step whose actions came out differently."""

    t_s: float
    recorded: list[dict[str, Any]]
    replayed: list[dict[str, Any]]


@dataclass(frozen=True, slots=True, kw_only=True)
class ReplayReport:
    """What a replay did.

    ``unrecorded`` steps came after a gap in the records, and could not be folded again. ``lost`` messages were counted
    by the steps, and are not in the telemetry log.
    """

    steps: int
    unrecorded: int
    messages: int
    lost: int
    actions: int
    restarts: int
    differences: tuple[Difference, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Folded:
    """A step of a recorded voyage, folded again: what it decided, what was recorded of it.

    ``messages`` were counted by the step and ``lost`` of them are not in the telemetry log. Without a ``step`` it came
    after a gap in the records, and could not be folded.
    """

    t_s: float
    step: Step | None
    messages: int = 0
    lost: int = 0
    replayed: list[dict[str, Any]] = field(default_factory=list)
    recorded: list[dict[str, Any]] = field(default_factory=list)


class RecordedInput:
    """The voyage in ``folder``, to be folded again.

    Args:
        folder: what ``companion run`` or ``sitl run`` left.
        mission_path: the mission file, where it is not at the recorded place any more.

    Raises:
        InputError: a file is missing or is not one of a voyage.
    """

    def __init__(self, folder: Path, mission_path: Path | None = None) -> None:
        require_files(folder, VOYAGE, TLOG, DECISIONS, TRACK)
        if not all(is_from_the_start(folder / name) for name in (TLOG, DECISIONS, TRACK)):
            raise InputError(
                str(folder),
                "",
                "its first records were dropped for want of room",
                "it cannot be folded from its start; `companion report` draws what is there",
            )
        description = read_description(folder)
        with believed(folder / VOYAGE, "[run], [mission] and [permissions]"):
            self.epoch_s = float(description["run"]["epoch_s"])
            recorded_path = _mission_path(folder, description["mission"])
            permitted = description["permissions"]
            verbs: Any = {name: tuple(words) for name, words in permitted.items() if isinstance(words, list)}
            self._permissions = Permissions(**{**permitted, **verbs})
        self.folder = folder
        self.mission = load_mission(mission_path or recorded_path)
        self.voyage, self.config = voyage_of(self.mission), config_of(self.mission)
        self._decisions = read_decisions(folder)
        self.rows = _rows(folder / TRACK)
        with believed(folder / DECISIONS, "a start"):
            self._starts = [
                (
                    float(d["t_s"]),
                    None if d["persisted"] is None else Persisted.from_dict(d["persisted"]),
                    tuple(d.get("known", ())),
                    float(d.get("epoch_s", self.epoch_s)),
                )
                for d in self._decisions
                if d["kind"] == "start"
            ] or [(-1e18, None, (), self.epoch_s)]

    @property
    def restarts(self) -> int:
        """How often the companion was started again."""
        return len(self._starts) - 1

    def steps(self) -> Iterator[Folded]:
        """Yield the steps in their order."""
        skipper, waters = Skipper(voyage=self.voyage, config=self.config), waters_of(self.mission)
        # Frames of another life, stamped by a clock that was set since, are years off: not of the last one either.
        last_s = max((t_s for t_s, *_ in self.rows), default=0.0) + _AFTER_S
        ends = [*(start[0] for start in self._starts[1:]), last_s]
        fed: dict[float, list[dict[str, Any]]] = {}
        for record in self._decisions:
            if record["kind"] in _FED:
                fed.setdefault(float(record["t_s"]), []).append(record)
        for (start_s, persisted, known, epoch_s), end_s, gap_s in zip(
            self._starts, ends, _gaps(self._decisions), strict=True
        ):
            fold = VoyageFold(
                skipper,
                WindTracker(estimator=estimator_of(self.mission)),
                self._permissions,
                persisted,
                known=known,
                traffic=target_limits_of(self.mission),
                waters=waters,
                water=water_of(self.mission),
            )
            yield from self._life(fold, start_s, end_s, gap_s, fed, epoch_s)

    def _life(
        self,
        fold: VoyageFold,
        start_s: float,
        end_s: float,
        gap_s: float,
        fed: dict[float, list[dict[str, Any]]],
        epoch_s: float,
    ) -> Iterator[Folded]:
        """Yield the steps between a start of the companion and the next; the clock may have been set between them."""
        folder, mine = self.folder, [d for d in self._decisions if start_s <= d["t_s"] < end_s]
        found = next((d for d in mine if d["kind"] == "autopilot"), None)
        system, unheard = (0, 0) if found is None else (int(found["system"]), int(found["unheard"]))
        heard = _messages(folder / TLOG, epoch_s, start_s, end_s, fold, system, unheard)
        outcomes = iter([d for d in mine if d["kind"] in {"plan", "outcome"}])
        recorded = _actions_by_time(mine)
        for t_s, n_messages, n_outcomes in self.rows:
            if not start_s <= t_s < end_s:
                continue
            if t_s >= gap_s:
                yield Folded(t_s=t_s, step=None)
                continue
            # A power cut may take the last line of one file and leave the row that counted it in another.
            unread = n_messages
            for at_s, message in itertools.islice(heard, n_messages):
                fold.message(at_s, message)
                unread -= 1
            for record in itertools.islice(outcomes, n_outcomes):
                with believed(folder / DECISIONS, f"t_s = {record['t_s']}"):
                    outcome = _outcome(record)
                fold.take_outcome(float(record["t_s"]), outcome)
            for record in fed.get(t_s, ()):
                with believed(folder / DECISIONS, f"t_s = {record['t_s']}"):
                    _FED[record["kind"]](fold, record)
            step = fold.tick(t_s)
            yield Folded(
                t_s=t_s,
                step=step,
                messages=n_messages,
                lost=unread,
                recorded=recorded.get(t_s, []),
                replayed=[_plain(action_record(a, step.snapshot, self.config)) for a in step.actions],
            )


def replay(
    folder: Path, mission_path: Path | None = None, *, told: Callable[[int, int], object] | None = None
) -> ReplayReport:
    """Fold the voyage in ``folder`` again.

    Args:
        folder: what ``companion run`` or ``sitl run`` left.
        mission_path: the mission file, where it is not at the recorded place any more.
        told: is told after each step how many there were, and of how many.

    Raises:
        InputError: a file is missing or is not one of a voyage, or the telemetry log is empty.
    """
    voyage = RecordedInput(folder, mission_path)
    differences: list[Difference] = []
    steps = unrecorded = messages = lost = actions = 0
    for folded in voyage.steps():
        if told is not None:
            told(steps + unrecorded + 1, len(voyage.rows))
        if folded.step is None:
            unrecorded += 1
            continue
        steps, messages, lost = steps + 1, messages + folded.messages, lost + folded.lost
        actions += len(folded.replayed)
        if not _same(folded.replayed, folded.recorded):
            differences.append(Difference(t_s=folded.t_s, recorded=folded.recorded, replayed=folded.replayed))
    if lost and next(_frames(folder / TLOG), None) is None:
        raise InputError(
            str(folder / TLOG),
            "",
            f"is empty, and the steps heard {counted(messages, 'message')}",
            "nothing can be folded without them: copy the voyage's folder again",
        )
    return ReplayReport(
        steps=steps,
        unrecorded=unrecorded,
        messages=messages,
        lost=lost,
        actions=actions,
        restarts=voyage.restarts,
        differences=tuple(differences),
    )


def _gaps(decisions: list[dict[str, Any]]) -> list[float]:
    """Return, for each life of the companion, since when records of it are missing [s]."""
    gaps, has_begun = [1e18], False
    for record in decisions:
        if record["kind"] == "start":
            if has_begun:
                gaps.append(1e18)
            has_begun = True
        elif record["kind"] == "gap":
            since_s = record["since_s"]
            gaps[-1] = min(gaps[-1], -1e18 if since_s is None else float(since_s))
    return gaps


def _mission_path(folder: Path, recorded: dict[str, Any]) -> Path:
    """Return the voyage's own copy of its mission; where it has none, the place that the mission had."""
    copy = folder / recorded.get("copy", "")
    return copy if copy.is_file() else Path(recorded["path"])


def _rows(path: Path) -> list[tuple[float, int, int]]:
    with believed(path, "t_s, frames and outcomes"):
        return [(r["t_s"], int(r["frames"]), int(r["outcomes"])) for r in read_rows(path)]


def _frames(path: Path) -> Iterator[TlogRecord]:
    for part in parts(path):
        yield from read_tlog(part)


def _messages(
    path: Path, epoch_s: float, start_s: float, end_s: float, fold: VoyageFold, system: int, unheard: int
) -> Iterator[tuple[float, Message]]:
    """Yield the messages of the autopilot's ``system`` that are not our own, behind those that nobody heard."""
    codec = Codec(system=1, component=OWN_COMPONENT)
    for record in _frames(path):
        at_s = record.unix_us / 1e6 - epoch_s
        if not start_s <= at_s < end_s:
            continue
        for message in codec.feed(record.frame):
            if message.get_srcComponent() == OWN_COMPONENT or message.get_srcSystem() != system:
                continue
            if unheard > 0:
                unheard -= 1
            elif fold.objection(at_s, message) is None:
                yield at_s, message


def _actions_by_time(decisions: list[dict[str, Any]]) -> dict[float, list[dict[str, Any]]]:
    out: dict[float, list[dict[str, Any]]] = {}
    for record in decisions:
        if record["kind"] == "action":
            plain = {k: v for k, v in record.items() if k not in _STAMPS}
            out.setdefault(float(record["t_s"]), []).append(plain)
    return out


def _plain(record: dict[str, Any]) -> dict[str, Any]:
    plain: dict[str, Any] = json.loads(json.dumps(jsonable(record)))
    return plain


def _items(rows: list[list[Any]]) -> tuple[MissionItem, ...]:
    return tuple(
        MissionItem(command=c, lat_e7=lat, lon_e7=lon, alt_m=alt, frame=frame, params=(p[0], p[1], p[2], p[3]))
        for c, lat, lon, alt, frame, p in rows
    )


# What the fold is told between messages and outcomes, by the kind of record that says so.
_FED: dict[str, Callable[[VoyageFold, dict[str, Any]], None]] = {
    "ais": lambda fold, record: fold.take(ais_of(record)),
    "sounding": lambda fold, record: fold.sounded(record["t_s"], record["ping_m"], record.get("most_m", math.inf)),
    "order": lambda fold, record: fold.event(Order.from_dict(record["order"])),
    "fence read": lambda fold, record: fold.fence(_items(record["items"])),
    "planner process": lambda fold, record: fold.planner_alive(bool(record["alive"])),
    "others": lambda fold, record: fold.others(
        tuple(record["neighbours"]), has_company=record["company"], has_shore=record.get("shore", False)
    ),
}


def _outcome(record: dict[str, Any]) -> Outcome:
    if record["kind"] == "plan":
        plan = None if record["plan"] is None else Plan.from_dict(record["plan"])
        return PlanOutcome(request_id=record["request_id"], plan=plan, text=record["text"])
    kind = record["outcome"]
    if kind == "UploadOutcome":
        return UploadOutcome(upload_id=record["upload_id"], result=UploadResult[record["result"]], text=record["text"])
    if kind == "ReadOutcome":
        items = record["items"]
        return ReadOutcome(
            read_id=record["read_id"], text=record["text"], items=None if items is None else _items(items)
        )
    return CommandOutcome(command_id=record["command_id"], result=CommandResult[record["result"]], text=record["text"])


def _same(a: Any, b: Any) -> bool:
    if isinstance(a, bool) or isinstance(b, bool) or a is None or b is None:
        return a is b
    if isinstance(a, int | float) and isinstance(b, int | float):
        return abs(a - b) <= TOLERANCE * max(1.0, abs(a), abs(b))
    if isinstance(a, list) and isinstance(b, list):
        return len(a) == len(b) and all(_same(x, y) for x, y in zip(a, b, strict=True))
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_same(a[k], b[k]) for k in a)
    return bool(a == b)
