"""How true the quantiles of passages are: PIT and reliability over successive runs, as they come and dressed.

``python -m lab.passage_quantiles --plot FILE`` makes weathers whose truth is known, and of each successive runs of an
ensemble that is too sure of itself, learns by how much runs are off from the first half of them, and sails a passage
from each run of the second half: in all members, and in the truth by a boat that is not quite her polar. Of quantiles
that are true, what came is beneath each as often as it says.
"""

from __future__ import annotations

import argparse
import functools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from companion.boat import Boat, Polar
from companion.messages import GeoPoint
from companion.passage import Craft, Land, Passage, PassageFrame, craft_of, land_of, shares_of
from companion.weather import Cube, ForecastError, Weather, dressed, errors_of, fitted

Floats = NDArray[np.float64]
HOUR_S = 3600.0
DAY_S = 86_400.0
STEP_S = 6 * HOUR_S
RUNS_EVERY_S = 12 * HOUR_S
RUN_S = 7 * DAY_S
MEMBERS = 11
SHARPNESS = 0.4  # of the error, what members differ by
SPEED_ERROR = 0.08
ANOMALY_MPS = 3.0
MEAN_EN_MPS = np.array([5.0, -3.0])
A, B = GeoPoint(lat_deg=0.0, lon_deg=0.0), GeoPoint(lat_deg=0.0, lon_deg=3.0)
LAT, LON = np.linspace(-2.0, 2.0, 5), np.linspace(-2.0, 5.0, 8)
POLAR = Polar(
    twa_rad=np.array([0.0, math.pi]), tws_mps=np.array([0.0, 12.0]), speed_mps_table=np.array([[0.0, 3.6]] * 2)
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Scored:
    """Of each departure where what came lies among what was told, 0 to 1: as runs come, and dressed; the fit."""

    plain: Floats
    dressed: Floats
    error: ForecastError
    passages: int


def scored(worlds: int, runs: int, seed: int = 0) -> Scored:
    """Return it for so many weathers, each of so many runs to learn from and as many to be judged by."""
    made = [_World(seed + k, 2 * runs) for k in range(worlds)]
    # What is learned from one weather's first half is learned from all of them: a season's record.
    error = fitted(np.concatenate([errors_of(world.runs[:runs]) for world in made]))
    plain: list[float] = []
    worn: list[float] = []
    for world in made:
        for run in world.runs[runs:]:
            departs = float(run.wind[0].utc_s[0])
            share = math.exp(SPEED_ERROR * world.rng.standard_normal())
            true = _times(world.truth, departs, (share,), world.land)[0]
            pick = world.rng.random()
            for found, weather in ((plain, run), (worn, dressed(run, error, seed=seed))):
                told = _times(weather, departs, shares_of(SPEED_ERROR), world.land)
                # Among n told the truth is in one of n + 1 gaps, and anywhere in it.
                found.append((float((told < true).sum()) + pick) / (told.size + 1))
    return Scored(plain=np.array(plain), dressed=np.array(worn), error=error, passages=len(plain))


@functools.cache
def _craft() -> Craft:
    return craft_of(Boat(polar=POLAR, no_go_half_rad=0.0))


def _times(weather: Weather, departs: float, shares: Sequence[float], land: Land) -> Floats:
    frame = PassageFrame(A, B)
    ready = Passage(start=A, goal=B, radius_m=1000.0, craft=_craft(), weather=weather, land=land, frame=frame)
    found = ready.sail((A, B), departs, weather.members, shares)
    return np.array([run.time_s if run.arrived else math.inf for run in found])


class _World:
    """A weather of its own: the truth, and the runs that told of it."""

    def __init__(self, seed: int, runs: int) -> None:
        self.rng = np.random.default_rng(seed)
        self.land = land_of(PassageFrame(A, B), (), (-10.0, -20.0, 15.0, 20.0), 0.0)
        whole = runs * RUNS_EVERY_S + RUN_S
        times = np.arange(0.0, whole + 1.0, STEP_S)
        shape = (LAT.size, LON.size)
        anomaly = ANOMALY_MPS * self._wander(times, 1.5 * DAY_S)
        front = MEAN_EN_MPS + anomaly
        slope = 0.8 * self._wander(times, 2.0 * DAY_S)
        east = np.linspace(-1.0, 1.0, LON.size)[None, None, :, None]
        true = front[:, None, None, :] + slope[:, None, None, :] * east + np.zeros((1, *shape, 1))
        self.truth = Weather(wind=(self._cube(times, true[None], (0,)),))
        self.runs = [self._run(times, true, anomaly, k * RUNS_EVERY_S) for k in range(runs)]

    def _run(self, times: Floats, true: Floats, anomaly: Floats, begins: float) -> Weather:
        part = (times >= begins - 1.0) & (times <= begins + RUN_S + 1.0)
        lead = times[part] - begins
        sd = np.minimum(0.95 * ANOMALY_MPS, np.hypot(0.5, 0.9 * lead / DAY_S))[:, None]
        # Best guesses are smoother than the weather: what came is the guess and an error that it knows nothing of.
        skill = 1.0 - (sd / ANOMALY_MPS) ** 2
        guess = skill * anomaly[part] + ANOMALY_MPS * np.sqrt(skill * (1.0 - skill)) * self._wander(lead, DAY_S)
        off = guess - anomaly[part]
        told = []
        for _ in range(MEMBERS):
            apart = SHARPNESS * sd * self._wander(lead, DAY_S)
            told.append(true[part] + (off + apart)[:, None, None, :])
        return Weather(wind=(self._cube(times[part], np.stack(told), tuple(range(MEMBERS))),))

    def _wander(self, times: Floats, memory_s: float) -> Floats:
        left = math.exp(-STEP_S / memory_s)
        out = np.empty((times.size, 2))
        state = self.rng.standard_normal(2)
        for k in range(times.size):
            out[k] = state
            state = left * state + math.sqrt(1.0 - left**2) * self.rng.standard_normal(2)
        return out

    def _cube(self, times: Floats, values: Floats, members: tuple[int, ...]) -> Cube:
        return Cube(
            utc_s=1.7e9 + times,
            base_utc_s=np.full(times.size, 1.7e9 + times[0]),
            members=members,
            lat_deg=LAT.copy(),
            lon_deg=LON.copy(),
            values=values.astype(np.float32),
        )


def within(pit: Floats, low: float, high: float) -> float:
    """Return how often what came lies between two quantiles."""
    return float(((pit >= low) & (pit <= high)).mean())


def lines_of(found: Scored) -> list[str]:
    """Return the table: how often what came is beneath each quantile."""
    said = (
        f"{found.passages} passages of 333 km, {MEMBERS} members, dressed with {found.error.now_mps:.2f} m/s and"
        f" {found.error.per_day_mps:.2f} m/s a day"
    )
    lines = [said, "quantile     5 %   10 %   25 %   50 %   75 %   90 %   95 %   middle 80 %   PIT off even"]
    for name, pit in (("as it comes", found.plain), ("dressed", found.dressed)):
        cells = "".join(f"{100.0 * (pit <= q).mean():7.0f}" for q in (0.05, 0.1, 0.25, 0.5, 0.75, 0.9, 0.95))
        lines.append(f"{name:<11}{cells[1:]}{100.0 * within(pit, 0.1, 0.9):12.0f} %{100.0 * uneven(pit):13.1f} %")
    return lines


def uneven(pit: Floats) -> float:
    """Return the greatest distance of the shares beneath quantiles from what they say (Kolmogorov and Smirnov)."""
    ordered = np.sort(pit)
    at = np.arange(ordered.size)
    return float(np.maximum(ordered - at / ordered.size, (at + 1.0) / ordered.size - ordered).max())


def draw(found: Scored, path: Path) -> None:
    """Draw PIT and reliability into a file."""
    import matplotlib.pyplot as plt

    from companion.plots.chart import save

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 4.0), layout="constrained")
    for (name, pit), colour in zip(
        (("as it comes", found.plain), ("dressed", found.dressed)), ("tab:red", "tab:blue"), strict=True
    ):
        left.hist(
            pit,
            bins=np.linspace(0.0, 1.0, 11),
            weights=np.full(pit.size, 10.0 / pit.size),
            histtype="step",
            color=colour,
            lw=2,
            label=name,
        )
        q = np.linspace(0.0, 1.0, 41)
        right.plot(q, [(pit <= p).mean() for p in q], color=colour, lw=2, label=name)
    left.axhline(1.0, color="0.5", lw=1)
    left.set_xlabel("where the time that came lies among those told (PIT)")
    left.set_ylabel("as often as it should: 1")
    right.plot([0, 1], [0, 1], color="0.5", lw=1)
    right.set_xlabel("chance that is told")
    right.set_ylabel("how often it came so")
    right.legend()
    save(figure, path)


def main(argv: Sequence[str] | None = None) -> int:
    """Run the command."""
    parser = argparse.ArgumentParser(prog="python -m lab.passage_quantiles", description=__doc__)
    parser.add_argument("--worlds", type=int, default=20, metavar="N", help="weathers (20)")
    parser.add_argument("--runs", type=int, default=10, metavar="N", help="of each, to learn from and to judge by (10)")
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--plot", type=Path, metavar="FILE")
    args = parser.parse_args(argv)
    found = scored(args.worlds, args.runs, args.seed)
    for line in lines_of(found):
        print(line)
    if args.plot is not None:
        draw(found, args.plot)
        print(f"{args.plot}: written")
    return 0


if __name__ == "__main__":
    raise SystemExit(main())
