"""Planners on the problems: every answer judged by the exact scorer, one row each, and what they come to."""

from __future__ import annotations

import contextlib
import os
import signal
import threading
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Literal, TypedDict

import numpy as np

from companion.planner import Problem
from companion.planner.problem import evaluate
from companion.words import counted
from sailbench.planners import SAID, Answer, Planner, answer_of
from sailbench.problem_set import Known

Outcome = Literal["path", "impossible", "wrong", "nothing", "late"]
LATE = 2.0  # an answer after so many budgets of the processor's time ...
LATE_S = 4.0  # ... and so much longer (a library in another process loads first) is none
ENDED_S = 1.0  # after that it is ended


def processor_s() -> float:
    """Return a reading of what this process and those that it waited for took of a processor [s]."""
    return sum(os.times()[:4])


class Late(BaseException):
    """A planner that is ended: no planner catches it, as it may all errors."""


@contextlib.contextmanager
def ended_after(limit_s: float) -> Iterator[None]:
    """Raise ``Late`` in what takes more than ``limit_s`` of this process' time; compiled code is ended at its end.

    Only the main thread can be ended.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def end(*_: object) -> None:
        raise Late

    before = signal.signal(signal.SIGPROF, end)
    signal.setitimer(signal.ITIMER_PROF, limit_s)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0.0)
        signal.signal(signal.SIGPROF, before)


class PlanRow(TypedDict):
    """One answer. ``path``: feasible, ``time_s`` by the scorer; ``wrong``: a path that it refuses, an untrue claim."""

    problem: str
    planner: str
    budget_s: float
    seed: int
    outcome: Outcome
    time_s: float | None
    first_s: float | None
    bound_s: float | None
    elapsed_s: float
    why: str


def judge(problem: Problem, answer: Answer, known: Known | None) -> tuple[Outcome, float | None, str]:
    """Return what an answer is worth: its outcome, the time of its path [s], and why it is refused."""
    if answer.is_impossible:
        is_true = known is None or known.best_s is None
        return ("impossible", None, "") if is_true else ("wrong", None, "there is a path")
    if answer.waypoints_en is None:
        return "nothing", None, ""
    scored = evaluate(problem, answer.waypoints_en)
    return ("path", scored.time_s, "") if scored.is_feasible else ("wrong", None, scored.reasons[0])


def rows(
    planners: Mapping[str, Planner],
    problems: Sequence[Problem],
    known: Mapping[str, Known],
    *,
    budgets_s: Sequence[float],
    seeds: int,
    is_made: Callable[[str, str, float, int], bool] = lambda *_: False,
) -> Iterator[PlanRow]:
    """Yield a row for each problem, planner, budget and seed that is not made yet; a planner's error is its own."""
    for problem in problems:
        for name, planner in planners.items():
            for budget_s in budgets_s:
                for seed in range(seeds):
                    if is_made(problem.id, name, budget_s, seed):
                        continue
                    begun_s = processor_s()
                    answer, error = Answer(), ""
                    limit_s = LATE * budget_s + LATE_S
                    try:
                        with ended_after(limit_s + ENDED_S):
                            answer = answer_of(planner(problem, budget_s, seed))
                    except Late:
                        pass  # what it took says it
                    except Exception as raised:  # whose planner it is must not end the others'
                        error = f"{type(raised).__name__}: {raised}"
                    took_s = processor_s() - begun_s
                    outcome, time_s, why = judge(problem, answer, known.get(problem.id))
                    if took_s > limit_s:
                        outcome, time_s, why = "late", None, f"no answer in {limit_s:g} s: took {took_s:.1f} s"
                    yield PlanRow(
                        problem=problem.id,
                        planner=name,
                        budget_s=budget_s,
                        seed=seed,
                        outcome=outcome,
                        time_s=time_s,
                        first_s=answer.first_s,
                        bound_s=answer.bound_s,
                        elapsed_s=took_s,
                        why=error or why,
                    )


class PlanLine(TypedDict):
    """What a planner comes to at a budget; spreads are median, 90th percentile and worst."""

    planner: str
    budget_s: float
    solved: int
    solvable: int
    recognised: int
    hopeless: int
    wrong: int
    first_ms: list[float] | None
    over_bound_percent: list[float] | None
    over_best_percent: list[float] | None


def summary(made: Iterable[PlanRow], known: Mapping[str, Known]) -> list[PlanLine]:
    """Return a line for each planner and budget, the best of each budget first.

    Best and bound of a problem are those that are known or that any of these rows has, whichever is tighter. Solved is
    what was in every seed; recognised, where there is no path, what was said to be so in every seed.
    """
    held = list(made)
    names = sorted({row["problem"] for row in held})
    best = {n: k.best_s for n, k in known.items() if k.best_s is not None and n in names}
    bound = {n: k.bound_s for n, k in known.items() if k.bound_s is not None and n in names}
    for row in held:
        name = row["problem"]
        if row["time_s"] is not None:
            best[name] = min(best.get(name, np.inf), row["time_s"])
        if row["bound_s"] is not None and row["planner"] in SAID and row["outcome"] == "path":
            bound[name] = max(bound.get(name, 0.0), row["bound_s"])
    hopeless = [n for n in names if n not in best]
    lines: list[PlanLine] = []
    for planner, budget_s in dict.fromkeys((row["planner"], row["budget_s"]) for row in held):
        mine = [row for row in held if (row["planner"], row["budget_s"]) == (planner, budget_s)]
        paths = [(row["problem"], row["time_s"]) for row in mine if row["time_s"] is not None]
        firsts = [1e3 * row["first_s"] for row in mine if row["first_s"] is not None and row["time_s"] is not None]

        def in_all(outcome: Outcome, name: str, mine: Sequence[PlanRow] = mine) -> bool:
            its = [row["outcome"] == outcome for row in mine if row["problem"] == name]
            return bool(its) and all(its)

        lines.append(
            PlanLine(
                planner=planner,
                budget_s=budget_s,
                solved=sum(in_all("path", n) for n in best),
                solvable=len(best),
                recognised=sum(in_all("impossible", n) for n in hopeless),
                hopeless=len(hopeless),
                wrong=sum(row["outcome"] == "wrong" for row in mine),
                first_ms=_spread(firsts),
                over_bound_percent=_spread([100.0 * (t / bound[n] - 1.0) for n, t in paths if bound.get(n, 0.0) > 0.0]),
                over_best_percent=_spread([100.0 * (t / best[n] - 1.0) for n, t in paths]),
            )
        )
    return sorted(lines, key=lambda n: (n["budget_s"], -n["solved"], (n["over_best_percent"] or [np.inf])[0]))


def _spread(values: Sequence[float]) -> list[float] | None:
    return [float(np.median(values)), float(np.percentile(values, 90)), float(np.max(values))] if values else None


HEADS = ("planner", "budget s", "solved", "known", "wrong", "first path ms", "over the bound %", "over best %")


def cells(line: PlanLine) -> tuple[str, ...]:
    """Return a line as the cells of a table."""
    return (
        SAID.get(line["planner"], line["planner"]),
        f"{line['budget_s']:g}",
        f"{line['solved']} of {line['solvable']}",
        f"{line['recognised']} of {line['hopeless']}",
        f"{line['wrong']}",
        _told(line["first_ms"], 0),
        _told(line["over_bound_percent"], 2),
        _told(line["over_best_percent"], 2),
    )


def _told(spread: Sequence[float] | None, digits: int) -> str:
    return "" if spread is None else " / ".join(f"{v:.{digits if v < 10.0 else 0}f}" for v in spread)


def table(lines: Iterable[PlanLine]) -> str:
    """Return the lines as a Markdown table."""
    rule = "|---" * len(HEADS) + "|"
    return "\n".join(["| " + " | ".join(HEADS) + " |", rule, *("| " + " | ".join(cells(n)) + " |" for n in lines)])


def troubles(rows: Iterable[PlanRow]) -> list[str]:
    """Return what planners raised, were refused or were late with, each once with how often."""
    counts = Counter((row["planner"], row["why"].partition(": took ")[0]) for row in rows if row["why"])
    return [f"{planner}, {counted(n, 'answer')}: {why}" for (planner, why), n in counts.most_common()]
