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
import shapely
from numpy.typing import NDArray

from companion.boat.tracking import SHORT_S
from companion.geo.angles import wrap_pi
from companion.planner.effort import Effort, Outcome, Search
from companion.planner.plan import PlanStatus
from companion.planner.problem.evaluate import Evaluation, evaluate, shore_of
from companion.planner.problem.value import Problem, resolved
from companion.planner.risk.tacks import of_risky, tacks_at_risk
from companion.planner.track.expected import ExpectedTrack, curve_mps, expected
from companion.words import below_words

Path = list[tuple[float, float]]
Judge = Callable[[Path], Evaluation]
"""Says of a path whether it is feasible, and how long it takes."""

AT_MOST = 80  # changes to one path: each costs a check and a prediction
FOR_AN_ARC = 30  # ... and for each arc of short legs in it
SLOWEST_MPS = 0.3  # taken for a leg that the polar says nothing of
AROUND = 2  # waypoints on either side of a change, where it is judged
SHORTER_SHARE, SHORTER_S = 0.006, 0.4  # what a waypoint less may cost
SHORT_SHARE, SHORT_EXTRA_S = 0.03, 2.0  # ... and a leg less that cannot be followed
PUSH_M = (1.0, 2.5, 5.0)  # a corner is pushed by as much
AGAIN_S = 0.04  # another search is not begun with less: its water alone takes most of that
LESS_M = 0.05  # ... where that takes as much of what is lacking, or half of it
BEAT_MORE_M = 1.0  # of room for a beat whose boards come too near
MEET_M = 60.0  # legs that meet farther from their corners do not meet
BEYOND_M = (0.0, 3.0, 6.0)  # an arc's ends, on along the legs around it, before the leg between them is long enough
SPARE = 1.001  # of that length
NARROWER_M = (0.0, 4.0, 2.0)  # the water of another search, where the track of the first does not keep the floor
NARROWER_SHARE, NARROWER_TIME_SHARE = 0.15, 0.06  # of the expansions, or of the seconds, for each
BEND_RAD = math.radians(4.0)  # a corner that turns by less is a bend of one leg
MANY_BENDS = 3  # in a path: then it is looked for again, with a zone that is wider by ...
SPARE_RAD = (math.radians(0.5), math.radians(1.0))
SPARE_SHARE, SPARE_TIME_SHARE = 0.3, 0.08  # of the expansions, or of the seconds, for each
DEAR = 1.3  # times the time of the path that cannot be sailed: what takes longer is another way


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
            wider = replace(
                problem, beat=replace(problem.beat, clearance_m=problem.beat.clearance_m + seen.lack_m + BEAT_MORE_M)
            )
            effort.reserve(effort.needed_s)  # what was kept back for this is spent now
            again = search(wider, effort, seed)
            if again.waypoints_en is not None:
                outcome = again
                path, seen = laid(problem, [(float(x), float(y)) for x, y in again.waypoints_en], judge, effort)
        if seen.is_kept:
            return replace(outcome, waypoints_en=np.asarray(_straighter(search, problem, path, effort, seed, judge)))
        other = roomier(search, problem, path, effort, seed, judge)
        if other is not None:
            return replace(outcome, waypoints_en=np.asarray(other))
        return replace(outcome, waypoints_en=None, status=PlanStatus.NOT_FOUND, reason=lacking(problem, seen))

    return tracked


def _straighter(
    search: Search, problem: Problem, path: Path, effort: Effort, seed: int, judge: Judge | None = None
) -> Path:
    """Return the path, or one with half of its bends at the most that takes little longer.

    Where the wind's spread grows on the way, the path along the no-go zone is a curve. The search cuts it into ever
    shorter legs, and none of them can be left out: any two in one are inside the zone by a fraction of a degree. What
    is found in a zone that is wider by more than that has few legs in the problem itself.
    """
    bends = _bends(path)
    if bends < MANY_BENDS:
        return path
    exact = _scorer(problem) if judge is None else judge
    was = exact(path)
    limit_s, risk = was.time_s * (1.0 + SHORT_SHARE) + SHORT_EXTRA_S, of_risky(tacks_at_risk(problem, was.legs))
    for spare_rad in SPARE_RAD:
        again = effort.again(SPARE_SHARE, SPARE_TIME_SHARE)
        if not effort.has_time(AGAIN_S if math.isinf(again.budget_s) else again.budget_s):
            break
        wider = replace(problem, boat=replace(problem.boat, no_go_half_rad=problem.boat.no_go_half_rad + spare_rad))
        found = search(wider, again, seed)
        effort.spend(again.used)
        if found.waypoints_en is None:
            continue
        other, seen = laid(problem, [(float(x), float(y)) for x, y in found.waypoints_en], judge, effort, limit_s)
        judged = exact(other)
        is_fit = seen.is_kept and judged.is_feasible and judged.time_s <= limit_s and 2 * _bends(other) <= bends
        if is_fit and of_risky(tacks_at_risk(problem, judged.legs)) <= risk:
            return other
    return path


def _bends(path: Path) -> int:
    """Return how many of a path's corners are hardly turns."""
    courses = [math.atan2(b[0] - a[0], b[1] - a[1]) for a, b in itertools.pairwise(path)]
    return sum(abs(wrap_pi(after - before)) < BEND_RAD for before, after in itertools.pairwise(courses))


def roomier(
    search: Search,
    problem: Problem,
    path: Path,
    effort: Effort,
    seed: int,
    judge: Judge | None = None,
    laying_s: float | None = None,
    within_s: float = math.inf,
) -> Path | None:
    """Return a path that keeps the floor, of those that shorter searches find, in narrower water at last; or None.

    The longer a search has, the closer its path clings to what is solid, by arcs and tacks of ever shorter legs; where
    there is little room none of that can be sailed, and the way round everything, which can, is several times as long.

    Args:
        search: of the path that does not keep the floor.
        problem: its problem, in which what is found is judged.
        path: that does not keep it; one that takes little longer is not looked beyond.
        effort: of which the search takes its share.
        seed: of the search.
        judge: as of ``laid``.
        laying_s: what the changes to a path may take [s], None: what is left.
        within_s: what a path may take [s]; one that takes longer is not laid.
    """
    best: tuple[float, Path] | None = None
    exact = _scorer(problem) if judge is None else judge
    enough_s = DEAR * exact(path).time_s
    for more_m in NARROWER_M:
        again = effort.again(NARROWER_SHARE, NARROWER_TIME_SHARE)
        if not effort.has_time(AGAIN_S if math.isinf(again.budget_s) else again.budget_s):
            break
        found = search(replace(problem, clearance_floor_m=problem.clearance_floor_m + more_m), again, seed)
        effort.spend(again.used)
        line = [] if found.waypoints_en is None else [(float(x), float(y)) for x, y in found.waypoints_en]
        if not line or exact(line).time_s > within_s:
            continue
        other, seen = laid(problem, line, judge, effort if laying_s is None else Effort(laying_s, None))
        judged = exact(other)
        if seen.is_kept and judged.is_feasible and (best is None or judged.time_s < best[0]):
            best = judged.time_s, other
        if best is not None and best[0] <= enough_s:
            break
    return None if best is None else best[1]


def lacking(problem: Problem, seen: ExpectedTrack) -> str:
    """Return in words how near the track would come."""
    assert problem.tracking is not None
    floor = problem.tracking.floor_m
    east, north = seen.worst_en or (0.0, 0.0)
    what = "a beat left to the autopilot" if seen.is_beat else "the track that would be sailed"
    return (
        f"{what} comes to {below_words(floor - seen.lack_m, floor)} m of something solid "
        f"at {east:.0f} east, {north:.0f} north; "
        f"the floor is {floor:.1f} m"
    )


def laid(
    problem: Problem, path: Path, judge: Judge | None = None, effort: Effort | None = None, within_s: float = math.inf
) -> tuple[Path, ExpectedTrack]:
    """Return the path with few corners, all of which can be followed and keep the floor, as far as that is possible.

    Of an ``effort`` in seconds changes are tried while there is time. None makes the path longer than ``within_s``.
    """
    effort = effort or Effort(None, None)
    judge = _scorer(problem) if judge is None else judge
    judged = judge(path)
    if not judged.is_feasible:
        return path, expected(problem, path, judged.legs)
    path, judged = _fewer(problem, judge, path, judged, effort, within_s)
    pushed, seen = _pushed(problem, judge, path, expected(problem, path, judged.legs), effort)
    if pushed is not path:  # a corner that was put into a leg may have made two of it that are too short
        pushed, judged = _fewer(problem, judge, pushed, judge(pushed), effort, within_s)
        seen = expected(problem, pushed, judged.legs)
    return pushed, seen


def _scorer(problem: Problem) -> Judge:
    exact = resolved(problem)
    return lambda path: evaluate(exact, np.asarray(path))


def _fewer(
    problem: Problem, judge: Judge, path: Path, judged: Evaluation, effort: Effort, within_s: float
) -> tuple[Path, Evaluation]:
    """Leave out corners and short legs, the shortest first, while it costs little and brings it nearer to nothing.

    A change is judged where it is made: what has been tried there is not tried again for a change elsewhere.
    """
    tried: set[tuple[float, ...]] = set()
    least_m = SHORT_S * float(np.max(curve_mps(problem)))
    lengths = _lengths_m(path)
    arcs = sum(length < least_m and not (n and lengths[n - 1] < least_m) for n, length in enumerate(lengths))
    limit_s = min(within_s, judged.time_s * (1.0 + SHORT_SHARE) + max(arcs, 1) * SHORT_EXTRA_S)
    count, most = 0, AT_MOST + arcs * FOR_AN_ARC
    while count < most:
        best: tuple[float, float, Path, Evaluation] | None = None
        lengths = _lengths_m(path)
        for n in sorted(range(len(lengths)), key=lengths.__getitem__):
            allowed_s = limit_s
            if lengths[n] >= least_m:
                allowed_s = min(limit_s, judged.time_s * (1.0 + SHORTER_SHARE) + SHORTER_S)
            for option, was, now in _changes(problem, path, n, least_m, tried):
                if count >= most or (best is not None and best[0] <= 0.0) or not effort.has_time(0.0):
                    break
                count += 1
                found = judge(option)
                if not found.is_feasible or found.time_s > allowed_s:
                    continue
                # without the loops about what is short beside it, which goes later; or with them, where that is less
                lack_m, with_loops_m = _lacks_m(problem, option, found, now)
                was_m, was_with_loops_m = _lacks_m(problem, path, judged, was)
                if lack_m > was_m + 1e-9 and (lengths[n] >= least_m or with_loops_m >= was_with_loops_m):
                    continue
                if best is None or (lack_m, found.time_s) < best[:2]:
                    best = lack_m, found.time_s, option, found
            if best is not None:
                break
        if best is None:
            break
        _, _, path, judged = best
    return path, judged


def _changes(
    problem: Problem, path: Path, n: int, least_m: float, tried: set[tuple[float, ...]]
) -> list[tuple[Path, slice, slice]]:
    """Return what a path can be changed to about leg n, the fastest first, and ``_changed`` of each.

    Left out is what has been ``tried``, to which it is added, and what collides.
    """
    lengths = _lengths_m(path)
    is_short = lengths[n] < least_m
    longer = (*_rounded(path, n, lengths, least_m), *_stretched(path, n, lengths, least_m)) if is_short else ()
    found: list[tuple[float, Path, slice, slice]] = []
    for option in (*longer, *_without(path, n)):
        was, now = _changed(path, option)
        key = tuple(round(10.0 * c) for place in (*path[was], *option[now]) for c in place)
        if key not in tried and not _collides(problem, option[now]):
            found.append((_sailed_s(problem, option[now]) - _sailed_s(problem, path[was]), option, was, now))
        tried.add(key)
    return [each[1:] for each in sorted(found, key=lambda each: each[0])]


def _lacks_m(problem: Problem, path: Path, judged: Evaluation, part: slice) -> tuple[float, float]:
    """Return what a part of a path lacks of the floor [m]: as if no leg were short, and as they are."""
    plain, looped = (expected(problem, path, judged.legs, part=part, has_loops=has) for has in (False, True))
    return plain.lack_m, looped.lack_m


def _collides(problem: Problem, path: Path) -> bool:
    """Return whether a leg of a path collides: most changes do, and the scorer would walk the whole path."""
    shore = shore_of(problem)
    return any(shore.hits(shapely.LineString(leg)) for leg in itertools.pairwise(path))


def _sailed_s(problem: Problem, path: Path) -> float:
    """Return how long legs take by the polar alone, not less than drifting [s]: options are tried in this order."""
    twd = problem.wind.twd_from_rad
    return sum(
        math.dist(a, b) / max(problem.boat.speed_mps(wrap_pi(math.atan2(b[0] - a[0], b[1] - a[1]) - twd)), SLOWEST_MPS)
        for a, b in itertools.pairwise(path)
    )


def _changed(path: Path, option: Path) -> tuple[slice, slice]:
    """Return which waypoints of a path, and which of one that was made of it, a change concerns."""
    same = min(len(path), len(option))
    begin = next((n for n in range(same) if path[n] != option[n]), same)
    end = next((n for n in range(same) if path[-1 - n] != option[-1 - n]), same)
    begin, end = max(0, begin - AROUND), max(0, end - AROUND)
    return slice(begin, len(path) - end), slice(begin, len(option) - end)


def _lengths_m(path: Path) -> list[float]:
    return [math.dist(a, b) for a, b in itertools.pairwise(path)]


def _pushed(
    problem: Problem, judge: Judge, path: Path, seen: ExpectedTrack, effort: Effort
) -> tuple[Path, ExpectedTrack]:
    """Push corners away from what the track comes too near to, until it keeps the floor or nothing helps."""
    count = 0
    while not seen.is_kept and count < AT_MOST:
        best: tuple[float, float, Path, ExpectedTrack] | None = None
        for option in _pushes(problem, path, seen):
            if not effort.has_time(0.0):
                break
            count += 1
            found = judge(option)
            if not found.is_feasible:
                continue
            then = expected(problem, option, found.legs)
            is_better = then.lack_m < seen.lack_m - min(LESS_M, 0.5 * seen.lack_m)
            if is_better and (best is None or (then.lack_m, found.time_s) < best[:2]):
                best = then.lack_m, found.time_s, option, then
        if best is None:
            break
        _, _, path, seen = best
    return path, seen


def _pushes(problem: Problem, path: Path, seen: ExpectedTrack) -> Iterator[Path]:
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
        yield [*path[: leg + 1], (float(place[0]), float(place[1])), *path[leg + 1 :]]


def _rounded(path: Path, n: int, lengths: list[float], least_m: float) -> Iterator[Path]:
    """Yield the path with the whole arc of short legs about leg n as one corner, or as two."""
    first, last = _arc(n, lengths, least_m)
    if first == 0 or last + 2 > len(path) - 1 or first == last:
        return
    before, after = (path[first - 1], path[first]), (path[last + 1], path[last + 2])
    one = meeting(*before, *after)
    if one is not None:
        yield [*path[:first], one, *path[last + 2 :]]
    for middle in range(first, last + 1):
        a, b = meeting(*before, path[middle], path[middle + 1]), meeting(path[middle], path[middle + 1], *after)
        if a is not None and b is not None:
            yield [*path[:first], a, b, *path[last + 2 :]]


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
            option = [*path[:first], *ends, *path[last + 2 :]]
            if option[0] == path[0] and sum(math.dist(p, q) < least_m for p, q in itertools.pairwise(option)) < shorts:
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
            yield [*path[:n], meet, *path[n + 2 :]]
    if n > 0:
        yield [*path[:n], *path[n + 1 :]]
    if n + 1 < last:
        yield [*path[: n + 1], *path[n + 2 :]]


def meeting(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float], d: tuple[float, float]
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
