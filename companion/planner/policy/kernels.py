"""One round of value iteration over the places of a chart, in the order of their time to go."""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from companion.geo.segments import EdgeTables, enters_disc, meets_any
from companion.kernels.jit import kernel

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

FAR_S = 1e6
"""The time to go from where there is no way [s]."""
HALF = 0.5
TOUCH_S = 3600.0
"""What a touch costs [s]: one in a hundred is worth 36 s."""
TACK = -1
"""The action that is a change of side."""
NEAR = 1e-9
"""So far outside of the goal's disc, in cells, is at it."""


class Field(NamedTuple):
    """What is looked ahead by.

    Attributes:
        hopes: (rows, columns, 2, m) what is expected a step later, by place, tack and shift now [s].
        beyond: (2, m) what is to go from the goal [s].
        water: east and north of the first place, metres of a cell.
        edges: of what is solid.
        goal: row, column, radius, in cells.
        sailing: (a, 2) angles to the wind [rad] and the speeds there [m/s].
        current: east and north [m/s].
        shift_rad: (m,) evenly apart.
        twd_rad: where the mean wind comes from.
        step_s: how far ahead is looked.
        tack: what one takes [s], its chance of failing, how long she then lies in irons [s], what a touch costs [s].
        lee: how fast she is set to leeward meanwhile, begun on port tack and on starboard [m/s].

    """

    hopes: Floats
    beyond: Floats
    water: Floats
    edges: EdgeTables
    goal: Floats
    sailing: Floats
    current: Floats
    shift_rad: Floats
    twd_rad: float
    step_s: float
    tack: Floats
    lee: Floats


@kernel
def between(table: Floats, row: float, column: float, q: int, s: int) -> float:
    """Return the table's value at a place in cells, straight between the four about it that have one."""
    rows, columns = table.shape[0], table.shape[1]
    if row < 0.0 or column < 0.0 or row > rows - 1.0 or column > columns - 1.0:
        return FAR_S
    r, c = min(int(row), rows - 2), min(int(column), columns - 2)
    f, g = row - r, column - c
    total, weight = 0.0, 0.0
    for i in range(2):
        for j in range(2):
            share = (f if i == 1 else 1.0 - f) * (g if j == 1 else 1.0 - g)
            value = table[r + i, c + j, q, s]
            if share > 0.0 and value < FAR_S * HALF:
                total += share * value
                weight += share
    return total / weight if weight >= HALF * HALF else FAR_S


@kernel
def sweep(
    values: Floats,
    hopes: Floats,
    best: NDArray[np.int16],
    order: Ints,
    moves: Floats,
    near: NDArray[np.int32],
    shut: NDArray[np.bool_],
    goal: Floats,
    beyond: Floats,
    step_s: float,
    chain: Floats,
    tack_chain: Floats,
    tack: Floats,
    drifts: Floats,
) -> float:
    """Go once over the places in their ``order``; return the largest change of a value [s].

    Args:
        values: (rows, columns, 2, m) expected time to go [s] on port and starboard tack, by shift. Changed.
        hopes: the same of what is expected a step later, where the shift is this now. Changed.
        best: the index of the angle that is sailed, ``TACK`` where she tacks. Changed.
        order: (n,) places, row * columns + column.
        moves: (2, m, a, 2) what a step does on each tack, shift and angle: rows and columns.
        near: (rows, columns) the row of ``shut`` for a place with something in its moves' way, -1: nothing is.
        shut: (k, 2, m, a + 1) moves that are not to be sailed; the last of each is a drift in irons.
        goal: row, column, radius, in cells.
        beyond: (2, m) the time to go from there.
        step_s: what a move takes.
        chain: (m, m) what each shift becomes in a step.
        tack_chain: (m, m) what each becomes in a tack.
        tack: what a tack takes [s], its chance of failing, how long she then lies in irons [s], what a touch costs [s].
        drifts: (2, m, 2) where she is set meanwhile, begun on either tack.

    """
    columns, shifts, angles = values.shape[1], values.shape[3], moves.shape[2]
    stand, action = np.empty((2, shifts)), np.empty((2, shifts), np.int16)
    new, lying = np.empty((2, shifts)), np.empty((2, shifts))
    largest = 0.0
    for n in range(order.shape[0]):
        r, c = order[n] // columns, order[n] % columns
        by = near[r, c]
        for q in range(2):
            for s in range(shifts):
                least, what = FAR_S, 0
                for a in range(angles):
                    if by >= 0 and shut[by, q, s, a]:
                        continue
                    down, right = moves[q, s, a, 0], moves[q, s, a, 1]
                    share = enters_disc(r, c, down, right, goal)
                    if share <= 1.0:
                        time_s = share * step_s + beyond[q, s]
                    else:
                        time_s = step_s + between(hopes, r + down, c + right, q, s)
                    if time_s < least:
                        least, what = time_s, a
                stand[q, s], action[q, s] = least, what
        for q in range(2):
            for s in range(shifts):
                lying[q, s] = 0.0
                if tack[1] > 0.0:
                    lying[q, s] = tack[3]
                    if not (by >= 0 and shut[by, q, s, angles]):
                        lying[q, s] = min(tack[3], between(hopes, r + drifts[q, s, 0], c + drifts[q, s, 1], q, s))
        for q in range(2):
            for s in range(shifts):
                off = 0.0
                for t in range(shifts):
                    off += tack_chain[s, t] * stand[1 - q, t]
                about = tack[0] + (1.0 - tack[1]) * off + tack[1] * (tack[2] + lying[q, s])
                new[q, s] = min(stand[q, s], about)
                best[r, c, q, s] = action[q, s] if stand[q, s] <= about else TACK
        for q in range(2):
            for s in range(shifts):
                change = abs(values[r, c, q, s] - new[q, s])
                if change > largest and new[q, s] < FAR_S * HALF:
                    largest = change
                values[r, c, q, s] = new[q, s]
                hope = 0.0
                for t in range(shifts):
                    hope += chain[s, t] * new[q, t]
                hopes[r, c, q, s] = hope
    return largest


@kernel
def between_shifts(shift_rad: Floats, shift: float) -> tuple[int, int, float]:
    """Return between which of the chain's shifts one lies, and the upper one's share; beyond them it is the last."""
    last = shift_rad.shape[0] - 1
    if last == 0:
        return 0, 0, 0.0
    place = (shift - shift_rad[0]) / (shift_rad[1] - shift_rad[0])
    place = min(max(place, 0.0), float(last))
    low = min(int(place), last - 1)
    return low, low + 1, place - low


@kernel
def set_in_irons(field: Field, tack: int, shift_rad: float) -> tuple[float, float]:
    """Return how far she is set, east and north, in a tack that fails [m]."""
    now = field.twd_rad + shift_rad
    right_m = (field.current[0] - field.lee[tack] * math.sin(now)) * field.tack[2]
    return right_m, (field.current[1] - field.lee[tack] * math.cos(now)) * field.tack[2]


@kernel
def tacked_s(field: Field, east: float, north: float, tack: int, shift_rad: float, other_s: float) -> float:
    """Return the time to go where she tacks, ``other_s`` being that of the other tack [s]."""
    if field.tack[1] <= 0.0:
        return float(field.tack[0] + other_s)
    right_m, up_m = set_in_irons(field, tack, shift_rad)
    lying_s = field.tack[3]
    if not meets_any(east, north, east + right_m, north + up_m, field.edges):
        row, column = (
            (north + up_m - field.water[1]) / field.water[2],
            (east + right_m - field.water[0]) / field.water[2],
        )
        low, high, share = between_shifts(field.shift_rad, shift_rad)
        near = between(field.hopes, row, column, tack, low)
        far = between(field.hopes, row, column, tack, high)
        lying_s = min(lying_s, (1.0 - share) * near + share * far)
    return float(field.tack[0] + (1.0 - field.tack[1]) * other_s + field.tack[1] * (field.tack[2] + lying_s))


@kernel
def looked_ahead(field: Field, east: float, north: float, tack: int, shift_rad: float) -> tuple[float, float, float]:
    """Return (time to go [s], heading [rad], speed through the water [m/s]) of the best step on a tack from here."""
    row, column = (north - field.water[1]) / field.water[2], (east - field.water[0]) / field.water[2]
    side = 1.0 if tack == 0 else -1.0
    low, high, share = between_shifts(field.shift_rad, shift_rad)
    best_s, best_rad, best_mps = FAR_S, field.twd_rad + shift_rad + side * field.sailing[0, 0], 0.0
    for a in range(field.sailing.shape[0]):
        heading = field.twd_rad + shift_rad + side * field.sailing[a, 0]
        right_m = (field.sailing[a, 1] * math.sin(heading) + field.current[0]) * field.step_s
        up_m = (field.sailing[a, 1] * math.cos(heading) + field.current[1]) * field.step_s
        if meets_any(east, north, east + right_m, north + up_m, field.edges):
            continue
        up, right = up_m / field.water[2], right_m / field.water[2]
        there = enters_disc(row, column, up, right, field.goal)
        if there <= 1.0:
            near, far = field.beyond[tack, low], field.beyond[tack, high]
            time_s = there * field.step_s + (1.0 - share) * near + share * far
        else:
            near = between(field.hopes, row + up, column + right, tack, low)
            far = between(field.hopes, row + up, column + right, tack, high)
            time_s = field.step_s + (1.0 - share) * near + share * far
        if time_s < best_s:
            best_s, best_rad, best_mps = time_s, heading, field.sailing[a, 1]
    return best_s, best_rad, best_mps


@kernel
def sail(
    field: Field, wander: Floats, begin: Floats, normal: Floats, uniform: Floats, track: Floats
) -> tuple[float, bool, int, int]:
    """Sail one drawn wind by the policy; return (time [s], whether she touched, tacks, places of the track).

    A voyage that is not there after its draws takes ``FAR_S``.

    Args:
        field: what is looked ahead by, each step from where she is.
        wander: spread [rad] and correlation time [s] of the shifts.
        begin: east, north, tack.
        normal: a draw for each step, the first for the shift that it begins in.
        uniform: a draw for each step.
        track: (n, 3) east, north, time [s]. Changed.

    """
    east, north, side = begin[0], begin[1], int(begin[2])
    shift, time_s, tacks, count, has_touched = wander[0] * normal[0], 0.0, 0, 0, False
    for n in range(1, normal.shape[0]):
        if count < track.shape[0]:
            track[count, 0], track[count, 1], track[count, 2] = east, north, time_s
            count += 1
        row, column = (north - field.water[1]) / field.water[2], (east - field.water[0]) / field.water[2]
        if math.hypot(row - field.goal[0], column - field.goal[1]) <= field.goal[2] + NEAR:
            return time_s, has_touched, tacks, count
        on_s, heading, speed = looked_ahead(field, east, north, side, shift)
        other_s = looked_ahead(field, east, north, 1 - side, shift)[0]
        if min(on_s, other_s) >= FAR_S * HALF:
            break
        if tacked_s(field, east, north, side, shift, other_s) < on_s:
            spent_s, right_m, up_m = field.tack[0], 0.0, 0.0
            tacks += 1
            if uniform[n] < field.tack[1]:
                spent_s += field.tack[2]
                right_m, up_m = set_in_irons(field, side, shift)
                has_touched = has_touched or meets_any(east, north, east + right_m, north + up_m, field.edges)
            else:
                side = 1 - side
        else:
            spent_s = field.step_s
            right_m = (speed * math.sin(heading) + field.current[0]) * spent_s
            up_m = (speed * math.cos(heading) + field.current[1]) * spent_s
            there = enters_disc(row, column, up_m / field.water[2], right_m / field.water[2], field.goal)
            if there <= 1.0:
                spent_s, right_m, up_m = there * spent_s, there * right_m, there * up_m
        east, north, time_s = east + right_m, north + up_m, time_s + spent_s
        kept = math.exp(-spent_s / wander[1])
        shift = kept * shift + wander[0] * math.sqrt(1.0 - kept * kept) * normal[n]
    return FAR_S, has_touched, tacks, count
