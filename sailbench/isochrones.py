"""Isochrones, as textbooks have them: where she could be after each step, the farthest place in each sector kept.

After R. W. James, Application of Wave Forecasts to Marine Navigation, 1957, and H. Hagiwara, Weather Routing of
(Sail-Assisted) Motor Vessels, 1989. Plain: no second pass and nothing smoothed; a baseline to be held against.
"""

from __future__ import annotations

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from companion.passage import Passage

Floats = NDArray[np.float64]
HEADINGS = 72
SECTORS = 720  # about the start
STEPS = 80  # from start to goal, about
_GUESSED_MPS = 3.0
_LEAST_STEP_S, _MOST_STEP_S = 900.0, 3 * 3600.0


def isochrones(asked: Passage, depart_utc_s: float) -> list[tuple[float, float]] | None:
    """Return latitudes and longitudes [deg] of the fastest way that fronts of equal time find; None where none does."""
    frame, goal = asked.frame, np.array([asked.frame.length_m, 0.0])
    step_s = min(_MOST_STEP_S, max(_LEAST_STEP_S, frame.length_m / _GUESSED_MPS / STEPS))
    ends_s = max(float(cube.utc_s[-1]) for cube in asked.weather.wind)
    course = 2.0 * math.pi * np.arange(HEADINGS) / HEADINGS
    fronts, before, now = [np.zeros((1, 2))], [np.zeros(1, dtype=np.int64)], depart_utc_s
    while now + step_s <= ends_s:
        here = fronts[-1]
        towards = goal - here
        away_m = np.hypot(*towards.T)
        last_s = away_m / np.maximum(1e-9, _speeds(asked, now, here, np.arctan2(*towards.T[::-1])[:, None])[:, 0])
        there = np.flatnonzero(
            (last_s <= step_s) & _is_free(asked, here, np.arange(len(here)), np.broadcast_to(goal, here.shape))
        )
        if there.size:
            way, at = [goal], int(there[np.argmin(last_s[there])])
            for front, back in zip(fronts[::-1], before[::-1], strict=True):
                way.append(front[at])
                at = int(back[at])
            lat, lon = frame.geo_from_xy(np.array(way[::-1]))
            return list(zip(lat.tolist(), lon.tolist(), strict=True))
        gone_m = step_s * _speeds(asked, now, here, np.broadcast_to(course, (len(here), HEADINGS)))
        wide = np.maximum(0.05, np.cos(here[:, 1] / frame.radius_m))[:, None]  # the frame is a chart
        moved = here[:, None] + gone_m[..., None] * np.stack(
            [np.cos(course) / wide, np.broadcast_to(np.sin(course), (len(here), HEADINGS))], axis=-1
        )
        # Who makes no way waits where she is.
        ends = np.concatenate([moved.reshape(-1, 2), here])
        of = np.concatenate([np.repeat(np.arange(len(here)), HEADINGS), np.arange(len(here))])
        free = _is_free(asked, here, of, ends)
        kept = _farthest(ends[free])
        if not kept.size:
            return None
        fronts.append(ends[free][kept])
        before.append(of[free][kept])
        now += step_s
    return None


def _farthest(places: Floats) -> NDArray[np.int64]:
    """Return which place is the farthest from the start in each sector about it."""
    sector = np.floor((np.arctan2(*places.T[::-1]) / math.pi + 1.0) * 0.5 * SECTORS)
    order = np.lexsort((-np.hypot(*places.T), sector))
    return order[np.unique(sector[order], return_index=True)[1]]


def _speeds(asked: Passage, utc_s: float, places: Floats, course_rad: Floats) -> Floats:
    """Return (n, c) speeds of courses from places in the frame, 0 where nothing is known or she is not to be out."""
    lat, lon = asked.frame.geo_from_xy(places)
    blows = asked.weather.wind_en_mps(utc_s, lat, lon)[0]
    along, aside = asked.frame.turned(blows[:, 0], blows[:, 1], lat, lon)
    tws_mps = np.hypot(along, aside)
    angle = np.abs(np.angle(np.exp(1j * (course_rad - np.arctan2(-aside, -along)[:, None]))))
    craft = asked.craft
    rows = np.nan_to_num(np.minimum(tws_mps / craft.tws_step_mps, len(craft.radial) - 1.0))
    low = np.minimum(rows.astype(int), len(craft.radial) - 2)
    column = np.rint(angle / math.pi * (craft.radial.shape[1] - 1.0)).astype(np.int64) if len(places) else angle
    column = np.where(np.isnan(angle), 0, column)
    share = (rows - low)[:, None]
    speed = (1.0 - share) * craft.radial[low[:, None], column] + share * craft.radial[low[:, None] + 1, column]
    return np.where((tws_mps <= craft.max_tws_mps)[:, None], craft.share * speed, 0.0)


def _is_free(asked: Passage, here: Floats, of: NDArray[np.int64], ends: Floats) -> NDArray[np.bool_]:
    """Return whether the ways from places ``here[of]`` to ``ends`` keep clear of land."""
    near = asked.land.distance_m(here)[of] <= np.hypot(*(ends - here[of]).T)
    out = np.ones(len(of), dtype=bool)
    lines = shapely.linestrings(np.stack([here[of][near], ends[near]], axis=1))
    out[near] = ~shapely.intersects(asked.land.shape, lines)
    return out
