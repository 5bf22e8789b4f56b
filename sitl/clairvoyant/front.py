"""The front: everywhere she can be after each step, the best place of each cell and tack kept as it is, not rounded.

Time goes on in steps. From each kept place all angles of its tack are sailed for a step, the heading following the
wind; a tack or gybe takes its whole number of steps and no way. Of two that come into one cell, tack and leg of the
course the one with the less time behind it and to go is kept: who is there later could have been the other and have
waited. Places are never moved to a cell's middle, so what comes out can be sailed exactly; the cells decide only what
is thrown away. A place from which no wind that comes would bring her to the goal in time (``rungs``) is left out.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from companion.kernels.jit import kernel
from sitl.clairvoyant.race import Floats
from sitl.clairvoyant.steps import PARTS

Ints = NDArray[np.int32]

FAR_S = 1e9
TIE_S = 1e-3    # so much less is not better: in a steady wind everything is equal


@kernel
def _between(table: Floats, corner_e: float, corner_n: float, cell_m: float, e: float, n: float) -> float:
    """Return the value at a place, straight between the middles of the cells about it."""
    rows, columns = table.shape
    x, y = (e - corner_e) / cell_m - 0.5, (n - corner_n) / cell_m - 0.5
    x, y = min(max(x, 0.0), columns - 1.001), min(max(y, 0.0), rows - 1.001)
    c, r = int(x), int(y)
    f, g = x - c, y - r
    low = (1.0 - f) * table[r, c] + f * table[r, c + 1]
    return float((1.0 - g) * low + g * ((1.0 - f) * table[r + 1, c] + f * table[r + 1, c + 1]))


@kernel
def _meets(ae: float, an: float, be: float, bn: float, goal: Floats) -> float:
    """Return the share of the way from a to b at which a disc (east, north, radius) is entered; 2 where it is not."""
    de, dn, pe, pn = be - ae, bn - an, ae - goal[0], an - goal[1]
    out = pe * pe + pn * pn - goal[2] * goal[2]
    if out <= 0.0:
        return 0.0
    a, b = de * de + dn * dn, pe * de + pn * dn
    under = b * b - a * out
    if a <= 0.0 or b >= 0.0 or under < 0.0:
        return 2.0
    share = (-b - math.sqrt(under)) / a
    return share if share <= 1.0 else 2.0


@kernel
def _is_late(e: float, n: float, row: int, j: int, stage: int, goals: Floats, units: Floats, most: Floats) -> bool:
    """Whether a goal that is ahead cannot be reached from here by the last step, whatever is done."""
    for i in range(units.shape[0]):
        for g in range(stage, goals.shape[0]):
            way = units[i, 0] * (goals[g, 0] - e) + units[i, 1] * (goals[g, 1] - n) - goals[g, 2]
            if way > most[row, j, i]:
                return True
    return False


@kernel
def _with_room(places: Floats, about: Ints, count: int) -> tuple[Floats, Ints]:
    """Return both with room for one more."""
    if count == places.shape[0]:
        return np.concatenate((places, np.empty_like(places))), np.concatenate((about, np.empty_like(about)))
    return places, about


@kernel
def march(
    start: Floats, goals: Floats, twd: Floats, speed: Floats, angle: Floats, step_s: float, tack_s: float, board: int,
    corner: Floats, cell_m: float, fine: int, off: Floats, clear_m: float, to_go: Floats, units: Floats, most: Floats,
    until_s: float,
) -> tuple[float, Floats, Ints, int]:
    """Return (time [s], places (n, 2), (n, 3) of their parent, step and state, the last place).

    ``goals`` (g, 3) are east, north, radius; ``most`` is that of ``rungs.most_m`` until ``until_s``; ``fine`` cells of
    the search make one of the chart. A state is 2 * goals passed + tack. The time is ``until_s`` and the last place -1
    where no track is faster.
    """
    last, parts, legs = most.shape[1] - 1, PARTS, goals.shape[0]
    part_s = step_s / parts
    rows, columns = off.shape[0] * fine, off.shape[1] * fine
    rank = np.full((2 * legs, rows * columns), np.float32(FAR_S))
    owner = np.full((2 * legs, rows * columns), np.int32(-1))
    places, about = np.empty((1 << 16, 2)), np.empty((1 << 16, 4), np.int32)   # ... and the next place of the step
    first = np.full(last + 1, np.int32(-1))
    count, best_s, best = 2, until_s, -1
    for row in range(2):
        places[row, 0], places[row, 1] = start[0], start[1]
        about[row, 0], about[row, 1], about[row, 2], about[row, 3] = -1, 0, row, row - 1
    first[0] = 1
    for j in range(last):
        if j * step_s >= best_s:
            break
        node = first[j]
        while node >= 0:
            here, node = node, about[node, 3]
            state = about[here, 2]
            r = int((places[here, 1] - corner[1]) / cell_m * fine)
            c = int((places[here, 0] - corner[0]) / cell_m * fine)
            if j > 0 and owner[state, r * columns + c] != here:
                continue   # somebody better came into this cell since
            for action in range(angle.shape[0] if j == 0 else 2 * angle.shape[0]):
                a, is_tack = action % angle.shape[0], action >= angle.shape[0]
                into = state ^ 1 if is_tack else state
                side = 1.0 if into % 2 == 0 else -1.0
                e, n = places[here, 0], places[here, 1]
                steps = board if is_tack else 1
                is_over = False
                for q in range(steps * parts):
                    k = j * parts + q
                    sailed_s = part_s
                    if is_tack:
                        sailed_s = min(part_s, max(0.0, (q + 1) * part_s - tack_s))
                    heading, way = twd[k] + side * angle[a], speed[k, a] * sailed_s
                    e1, n1 = e + way * math.sin(heading), n + way * math.cos(heading)
                    if _between(off, corner[0], corner[1], cell_m, e1, n1) < clear_m or _between(
                            off, corner[0], corner[1], cell_m, 0.5 * (e + e1), 0.5 * (n + n1)) < clear_m:
                        is_over = True
                        break
                    share = _meets(e, n, e1, n1, goals[into // 2])
                    if share <= 1.0:
                        if into // 2 + 1 == legs:
                            time_s = (k + 1) * part_s - (1.0 - share) * sailed_s
                            if time_s < best_s:
                                places, about = _with_room(places, about, count)
                                places[count, 0], places[count, 1] = e + share * (e1 - e), n + share * (n1 - n)
                                about[count, 0], about[count, 1], about[count, 2] = here, j + steps, into
                                best_s, best = time_s, count
                                count += 1
                            is_over = True
                            break
                        into += 2
                    e, n = e1, n1
                now = j + steps
                if is_over or now > last or now * step_s >= best_s:
                    continue
                r, c = math.floor((n - corner[1]) / cell_m * fine), math.floor((e - corner[0]) / cell_m * fine)
                if r < 0 or c < 0 or r >= rows or c >= columns:
                    continue
                cell = r * columns + c
                order = now * step_s + _between(to_go[into // 2], corner[0], corner[1], cell_m, e, n)
                if order > rank[into, cell] - TIE_S or _is_late(e, n, into % 2, now, into // 2, goals, units, most):
                    continue
                rank[into, cell] = order
                mine = owner[into, cell]
                if mine < 0 or about[mine, 1] != now:
                    places, about = _with_room(places, about, count)
                    mine = np.int32(count)
                    about[mine, 3] = first[now]
                    first[now] = owner[into, cell] = mine
                    count += 1
                places[mine, 0], places[mine, 1] = e, n
                about[mine, 0], about[mine, 1], about[mine, 2] = here, now, into
    return best_s, places[:count], about[:count], best
