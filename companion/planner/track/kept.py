"""A search whose paths keep their clearance when they are sailed, with as few corners as that needs.

The search plans lines. Here its path is laid again: legs that are too short to be followed go, an arc of them becomes
one corner or two where the legs around it meet, or one leg that is long enough: round a wall's end there and back
those legs meet nowhere. Waypoints that nothing needs are left out. Where the predicted track still comes nearer than
the floor, the corners near that place are pushed away from what is solid. A path that cannot be made to keep it is no
answer: then the reason says where, and how near it would come.
"""

from __future__ import annotations

import itertools
import math
from collections.abc import Callable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from companion.boat.tracking import SHORT_S
from companion.planner.effort import Effort, Outcome, Search
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import Evaluation, evaluate
from companion.planner.problem.sharing import resolved
from companion.planner.problem.value import Problem
from companion.planner.track.expected import Expected, curve_mps, expected

Path = list[tuple[float, float]]
Judge = Callable[[Path], Evaluation]
"""Says of a path whether it is feasible, and how long it takes."""

AT_MOST = 80                # changes to one path: each costs a check and a prediction
LARGEST = 60                # waypoints: a longer path is looked at as it is
SHORTER_SHARE, SHORTER_S = 0.006, 0.4   # what a waypoint less may cost
SHORT_SHARE, SHORT_EXTRA_S = 0.03, 2.0  # ... and a leg less that cannot be followed
PUSH_M = (1.0, 2.5, 5.0)    # a corner is pushed by as much
AGAIN_S = 0.04              # another search is not begun with less: its water alone takes most of that
BEAT_MORE_M = 1.0           # of room for a beat whose boards come too near
MEET_M = 60.0               # legs that meet farther from their corners do not meet
BEYOND_M = (0.0, 3.0, 6.0)  # an arc's ends, on along the legs around it, before the leg between them is long enough
SPARE = 1.001               # of that length


def with_track(search: Search, judge: Judge | None = None) -> Search:
    """Return the search whose paths are laid so that their track keeps the floor.

    ``judge``: what the changes to a path have to pass; None: the exact scorer.
    """
    def tracked(problem: Problem, effort: Effort, seed: int) -> Outcome:
        outcome = search(problem, effort, seed)
        if outcome.waypoints_en is None:
            return outcome
        if effort.is_late:
            return replace(outcome, waypoints_en=None, reason="there was no time to judge another path")
        path, seen = laid(problem, [(float(x), float(y)) for x, y in outcome.waypoints_en], judge, effort)
        if seen.is_beat and problem.beat is not None and effort.has_time(AGAIN_S):
            # More water about what is beaten; what has none is sailed.
            wider = replace(problem, beat=replace(
                problem.beat, clearance_m=problem.beat.clearance_m + seen.lack_m + BEAT_MORE_M))
            effort.reserve(effort.needed_s)   # what was kept back for this is spent now
            again = search(wider, effort, seed)
            if again.waypoints_en is not None:
                outcome = again
                path, seen = laid(problem, [(float(x), float(y)) for x, y in again.waypoints_en], judge, effort)
        if seen.is_kept:
            return replace(outcome, waypoints_en=np.asarray(path))
        return replace(outcome, waypoints_en=None, status=PlanStatus.TIMEOUT, reason=lacking(problem, seen))

    return tracked


def lacking(problem: Problem, seen: Expected) -> str:
    """Return in words how near the track would come."""
    assert problem.tracking is not None
    floor = problem.tracking.floor_m
    east, north = seen.worst_en or (0.0, 0.0)
    what = "a beat left to the autopilot" if seen.is_beat else "the track that would be sailed"
    return (f"{what} comes to {floor - seen.lack_m:.1f} m of something solid at {east:.0f} east, {north:.0f} north; "
            f"the floor is {floor:.1f} m")


def laid(
    problem: Problem, path: Path, judge: Judge | None = None, effort: Effort | None = None,
) -> tuple[Path, Expected]:
    """Return the path with few corners, all of which can be followed and keep the floor, as far as that is possible.

    Of an ``effort`` in seconds changes are tried while there is time.
    """
    effort = effort or Effort(None, None)
    judge = _scorer(problem) if judge is None else judge
    judged = judge(path)
    seen = expected(problem, path, judged.legs)
    if len(path) > LARGEST or not judged.is_feasible:
        return path, seen
    path, judged, seen = _fewer(problem, judge, path, judged, seen, effort)
    pushed, seen = _pushed(problem, judge, path, seen, effort)
    if pushed is not path:   # a corner that was put into a leg may have made two of it that are too short
        pushed, _, seen = _fewer(problem, judge, pushed, judge(pushed), seen, effort)
    return pushed, seen


def _scorer(problem: Problem) -> Judge:
    exact = resolved(problem)
    return lambda path: evaluate(exact, np.asarray(path))


def _fewer(
    problem: Problem, judge: Judge, path: Path, judged: Evaluation, seen: Expected, effort: Effort,
) -> tuple[Path, Evaluation, Expected]:
    """Leave out corners and short legs, the shortest first, while it costs little and brings her nearer to nothing."""
    tried: set[tuple[int, ...]] = set()
    least_m = SHORT_S * float(np.max(curve_mps(problem)))
    limit_s = judged.time_s * (1.0 + SHORT_SHARE) + SHORT_EXTRA_S
    count = 0
    while count < AT_MOST:
        best: tuple[Path, Evaluation, Expected] | None = None
        lengths = [math.dist(a, b) for a, b in itertools.pairwise(path)]
        for n in sorted(range(len(lengths)), key=lengths.__getitem__):
            is_short = lengths[n] < least_m
            longer = (*_rounded(path, n, lengths, least_m), *_stretched(path, n, lengths, least_m)) if is_short else ()
            for option in (*longer, *_without(path, n)):
                key = tuple(round(10.0 * c) for point in option for c in point)
                if key in tried or count >= AT_MOST or not effort.has_time(0.0):
                    continue
                tried.add(key)
                count += 1
                found = judge(option)
                allowed_s = limit_s if is_short else min(
                    limit_s, judged.time_s * (1.0 + SHORTER_SHARE) + SHORTER_S)
                if not found.is_feasible or found.time_s > allowed_s:
                    continue
                before = seen.lack_m + 1e-9, math.inf
                then = _better(problem, option, found, before if best is None else min(
                    before, (best[2].lack_m, best[1].time_s)))
                if then is not None:
                    best = option, found, then
            if best is not None:
                break
        if best is None:
            break
        path, judged, seen = best
    return path, judged, seen


def _pushed(
    problem: Problem, judge: Judge, path: Path, seen: Expected, effort: Effort,
) -> tuple[Path, Expected]:
    """Push corners away from what the track comes too near to, until it keeps the floor or nothing helps."""
    count = 0
    while not seen.is_kept and count < AT_MOST:
        best: tuple[float, float, Path, Expected] | None = None
        for option in _pushes(problem, path, seen):
            if not effort.has_time(0.0):
                break
            count += 1
            found = judge(option)
            if not found.is_feasible:
                continue
            before = seen.lack_m - 0.05, -math.inf
            then = _better(problem, option, found, before if best is None else min(before, best[:2]))
            if then is not None:
                best = then.lack_m, found.time_s, option, then
        if best is None:
            break
        _, _, path, seen = best
    return path, seen


def _better(problem: Problem, path: Path, judged: Evaluation, than: tuple[float, float]) -> Expected | None:
    """Return what is expected of a path that lacks less than another, or as much and takes less time; None: it is not.

    ``than`` is the other's lack [m] and time [s]. Boards add to what a path lacks: of one that lacks more without them
    they are not looked at, and they take most of the time.
    """
    if not (expected(problem, path, judged.legs, has_boards=False).lack_m, judged.time_s) < than:
        return None
    found = expected(problem, path, judged.legs)
    return found if (found.lack_m, judged.time_s) < than else None


def _pushes(problem: Problem, path: Path, seen: Expected) -> Iterator[Path]:
    if seen.worst_en is None or seen.near_en is None:
        return
    away: NDArray[np.float64] = np.asarray(seen.worst_en) - np.asarray(seen.near_en)
    length = float(np.hypot(*away))
    if length < 1e-6:
        return
    unit = away / length
    goal = np.asarray(problem.goal_en)
    leg = min(seen.worst_leg, len(path) - 2)
    for corners in ((leg,), (leg + 1,), (leg, leg + 1), (leg - 1, leg)):
        if min(corners) < 1 or max(corners) > len(path) - 1:
            continue
        for push in sorted({*PUSH_M, round(seen.lack_m + 0.2, 1)}):
            option = list(path)
            for corner in corners:
                place = np.asarray(path[corner]) + push * unit
                option[corner] = (float(place[0]), float(place[1]))
            if float(np.hypot(*(np.asarray(option[-1]) - goal))) <= problem.goal_radius_m:
                yield option
    middle = np.asarray(path[leg]) + 0.5 * (np.asarray(path[leg + 1]) - np.asarray(path[leg]))
    for push in PUSH_M:
        place = middle + push * unit
        yield [*path[:leg + 1], (float(place[0]), float(place[1])), *path[leg + 1:]]


def _rounded(path: Path, n: int, lengths: list[float], least_m: float) -> Iterator[Path]:
    """Yield the path with the whole arc of short legs about leg n as one corner, or as two."""
    first, last = _arc(n, lengths, least_m)
    if first == 0 or last + 2 > len(path) - 1 or first == last:
        return
    before, after = (path[first - 1], path[first]), (path[last + 1], path[last + 2])
    one = meeting(*before, *after)
    if one is not None:
        yield [*path[:first], one, *path[last + 2:]]
    for middle in range(first, last + 1):
        a, b = meeting(*before, path[middle], path[middle + 1]), meeting(path[middle], path[middle + 1], *after)
        if a is not None and b is not None:
            yield [*path[:first], a, b, *path[last + 2:]]


def _arc(n: int, lengths: list[float], least_m: float) -> tuple[int, int]:
    """Return the first and the last of the short legs on end that leg n is one of."""
    first, last = n, n
    while first > 0 and lengths[first - 1] < least_m:
        first -= 1
    while last + 1 < len(lengths) and lengths[last + 1] < least_m:
        last += 1
    return first, last


def _stretched(path: Path, n: int, lengths: list[float], least_m: float) -> Iterator[Path]:
    """Yield the path with the arc of short legs about leg n as one leg that is long enough, its ends moved apart."""
    first, last = _arc(n, lengths, least_m)
    shorts = sum(length < least_m for length in lengths)
    for beyond_m in BEYOND_M if first > 0 and last + 2 < len(path) else BEYOND_M[:1]:
        a, b = path[first], path[last + 1]
        if beyond_m > 0.0:
            a, b = _on(path[first - 1], a, beyond_m), _on(path[last + 2], b, beyond_m)
        gap = SPARE * least_m - math.dist(a, b)
        for share in (0.5, 1.0, 0.0) if gap > 0.0 else (0.5,):
            # the start stays where it is
            ends = (_on(b, a, share * gap), _on(a, b, (1.0 - share) * gap)) if gap > 0.0 else (a, b)
            option = [*path[:first], *ends, *path[last + 2:]]
            if option[0] == path[0] and sum(
                    math.dist(p, q) < least_m for p, q in itertools.pairwise(option)) < shorts:
                yield option


def _on(a: tuple[float, float], b: tuple[float, float], more_m: float) -> tuple[float, float]:
    """Return the end of the leg from a to b when it is sailed on by ``more_m``."""
    length = math.dist(a, b)
    share = more_m / length if length > 0.0 else 0.0
    return b[0] + share * (b[0] - a[0]), b[1] + share * (b[1] - a[1])


def _without(path: Path, n: int) -> Iterator[Path]:
    """Yield the path without the leg from corner n to the next: the legs around it meet, or one end of it goes."""
    last = len(path) - 1
    if n > 0 and n + 1 < last:
        meet = meeting(path[n - 1], path[n], path[n + 1], path[n + 2])
        if meet is not None:
            yield [*path[:n], meet, *path[n + 2:]]
    if n > 0:
        yield [*path[:n], *path[n + 1:]]
    if n + 1 < last:
        yield [*path[:n + 1], *path[n + 2:]]


def meeting(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float],
) -> tuple[float, float] | None:
    """Return where the leg from a to b, sailed on, meets the leg from c to d, sailed back; None where they do not."""
    ux, uy = b[0] - a[0], b[1] - a[1]
    vx, vy = c[0] - d[0], c[1] - d[1]
    cross = ux * vy - uy * vx
    if abs(cross) < 1e-6 * max(1.0, math.hypot(ux, uy) * math.hypot(vx, vy)):
        return None
    wx, wy = c[0] - b[0], c[1] - b[1]
    along, back = (wx * vy - wy * vx) / cross, (wx * uy - wy * ux) / cross
    if along < 0.0 or back < 0.0:
        return None
    meet = (b[0] + along * ux, b[1] + along * uy)
    return meet if max(math.dist(b, meet), math.dist(c, meet)) <= MEET_M else None
