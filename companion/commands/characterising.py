"""``companion wind --filter``: Wolsieffer's filter by its noise R and window N, printed, written and drawn."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from companion.errors import InputError

if TYPE_CHECKING:
    from companion.wind.study import Characterisation, HorizonScore, Record


def characterised(records: Sequence[Record], advance: Callable[[int], None]) -> Characterisation:
    """Return the grid over ``records``; raise InputError where none of them is long enough to score."""
    from companion.wind.study import characterise

    found = characterise(records, advance=advance)
    if not found.horizons_s:
        raise InputError(", ".join(found.records), "", "too short to score",
                         "a horizon needs 20 forecasts, one every 30 s after ten minutes")
    return found


def print_grid(found: Characterisation) -> None:
    """Print a table for each horizon, R downwards and N across, then the best cell beside the forecaster."""
    windows = sorted({cell.window for cell in found.cells})
    cells = {(cell.r_deg, cell.window): cell for cell in found.cells}
    for horizon in found.default:
        h = horizon.horizon_s
        print(f"{h:.0f} s ahead: CRPS of direction [deg] / inside the 95 % band [%]")
        print(f"{'R [deg]':>8}" + "".join(f"{f'N = {n}':>14}" for n in windows))
        for r_deg in sorted({cell.r_deg for cell in found.cells}):
            print(f"{r_deg:8g}" + "".join(f"{_words(cells[r_deg, n].at(h)):>14}" for n in windows))
        best = found.best(h)
        print(f"best: R = {best.r_deg:g} deg, N = {best.window}: {_words(best.at(h))}; "
              f"the default forecaster {_words(horizon)}")


def _words(score: HorizonScore | None) -> str:
    return "-" if score is None else f"{math.degrees(score.crps_rad):.2f} / {100.0 * score.coverage[-1]:.0f}"


def grid_document(found: Characterisation) -> dict[str, Any]:
    """Return the grid as a JSON document."""
    return {
        "records": list(found.records),
        "default": [_figures(s) for s in found.default],
        "filter": [
            {"r_deg": cell.r_deg, "window": cell.window, **_figures(s)} for cell in found.cells for s in cell.horizons
        ],
    }


def _figures(score: HorizonScore) -> dict[str, float]:
    return {
        "horizon_s": score.horizon_s, "count": score.count, "crps_deg": math.degrees(score.crps_rad),
        "mae_deg": math.degrees(score.mae_rad), "sigma_deg": math.degrees(score.sigma_rad),
        "coverage95": score.coverage[-1],
    }


def draw(found: Characterisation, picture: Path) -> None:
    """Draw the grid, and say where."""
    from companion.plots.filter import save_filter

    save_filter(found, picture)
    print(f"drawn in {picture}")
