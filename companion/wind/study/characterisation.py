"""Wolsieffer's filter by its noise R and its window N: how good is it, over records? (2020, section 3.1).

R is "determined through characterization of the anemometer"; the window N "must be large enough to capture the full
variation of the wind". The paper gives neither number, so both are tried here, over records: every cell of the grid is
the filter with that R and N, scored by the rules of ``score``. The default forecaster is scored beside it.

What to expect: with a gain k the innovations of a settled filter have the variance R / (1 - k), by (3), (6) and (7). An
R above what the innovations show has no such k: the gain goes to nothing and the filter stops. One far below has k near
1: every reading is believed and Q is the whole unrest of the readings, added at every sample.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

from companion.wind.estimators.catalogue import make
from companion.wind.estimators.kalman import R_DEG, WINDOW
from companion.wind.study.records import Record
from companion.wind.study.score import HorizonScore, Score, average, score

NOISES_DEG = (0.25, 0.5, 1.0, 2.0, 3.0, 5.0, 8.0, 12.0, 20.0)
WINDOWS = (10, 30, 100, 300, 1000)
# The paper plans for 10 s at a time and gives no lengths of its plans: a board, and a short plan, beside that.
HORIZONS_S = (10.0, 60.0, 300.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """The filter of one R [deg] and one N [samples]: its scores, means over the records."""

    r_deg: float
    window: int
    horizons: tuple[HorizonScore, ...]

    def at(self, horizon_s: float) -> HorizonScore | None:
        """Return the score of a horizon."""
        return next((h for h in self.horizons if h.horizon_s == horizon_s), None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Characterisation:
    """The grid over ``records`` (their names), R before N, and the default forecaster on the same horizons.

    ``horizons_s`` are those with a score. Records too short for any have none, and no cells.
    """

    records: tuple[str, ...]
    cells: tuple[Cell, ...]
    default: tuple[HorizonScore, ...]

    @property
    def horizons_s(self) -> tuple[float, ...]:
        """Return the horizons that were scored [s]."""
        return tuple(h.horizon_s for h in self.default)

    @property
    def chosen(self) -> Cell | None:
        """Return the cell of a mission that says neither R nor N, None where the grid has none."""
        return next((cell for cell in self.cells if (cell.r_deg, cell.window) == (R_DEG, WINDOW)), None)

    def best(self, horizon_s: float) -> Cell:
        """Return the cell of the least CRPS at a horizon of ``horizons_s``."""
        def crps(cell: Cell) -> float:
            found = cell.at(horizon_s)
            return float("inf") if found is None else found.crps_rad

        return min(self.cells, key=crps)


def runs(noises_deg: Sequence[float] = NOISES_DEG, windows: Sequence[int] = WINDOWS) -> int:
    """Return how many times ``characterise`` goes over every record."""
    return 1 + len(noises_deg) * len(windows)


def characterise(
    records: Sequence[Record], *, noises_deg: Sequence[float] = NOISES_DEG, windows: Sequence[int] = WINDOWS,
    horizons_s: Sequence[float] = HORIZONS_S, advance: Callable[[int], None] | None = None,
) -> Characterisation:
    """Return the filter's scores over ``records`` for every R [deg] and N [samples].

    ``advance`` hears of the readings that were fed, record by record.
    """
    def over(name: str, **options: float) -> tuple[HorizonScore, ...]:
        found: list[Score] = []
        for record in records:
            found.append(score(record, make(name, **options), horizons_s=horizons_s))
            if advance is not None:
                advance(len(record))
        return tuple(average(found))

    default = over("default")
    grid = [(r_deg, n) for r_deg in noises_deg for n in windows] if default else []
    return Characterisation(
        records=tuple(record.name for record in records), default=default,
        cells=tuple(Cell(r_deg=r_deg, window=n, horizons=over("kalman", r_deg=r_deg, n=n)) for r_deg, n in grid),
    )
