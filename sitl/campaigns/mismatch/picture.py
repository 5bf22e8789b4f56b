"""The picture of reliability: promised beside what came, of boats as planned and of others."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl

mpl.use("Agg")

import matplotlib.pyplot as plt

from companion.plots.chart import save
from sitl.campaigns.mismatch.reliability import Bin, floor_curve, late_curve, no_go_curve, time_shares

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

GROUPS = (("as planned", "#1f5fa8", "o"), ("another boat and water", "#b3541e", "s"))
_LEAST = 1e-3       # what is less is drawn at this: the axes are of tenths and hundredths
LEAST_VOYAGES = 10  # of a group, or its interval would be all that is seen


def save_reliability(records: Sequence[Mapping[str, Any]], path: Path) -> None:
    """Write the picture. Raises InputError when the file cannot be written or its kind is unknown."""
    save(reliability_figure(records), path)


def reliability_figure(records: Sequence[Mapping[str, Any]]) -> Figure:
    """Return the curves: the no-go zone, the floor, the time."""
    figure, (left, middle, right) = plt.subplots(1, 3, figsize=(13.0, 4.4), layout="constrained")
    for is_control, (name, colour, mark) in zip((True, False), GROUPS, strict=True):
        mine = [r for r in records if bool(r.get("as_planned")) == is_control]
        if not mine:
            continue
        label = f"{name}: {len(mine)} voyages"
        bins = no_go_curve(mine)
        _bars(left, [max(b.promised or 0.0, _LEAST) for b in bins], bins, colour, mark, label)
        late = late_curve(mine)
        if late:
            left.plot([b.promised or _LEAST for b in late], [max(b.share, _LEAST) for b in late], color=colour,
                      marker="^", ls="none", mfc="none", label=f"{name}: later than a quantile")
        shares = time_shares(mine)
        if shares:
            right.step(shares, [(n + 1) / len(shares) for n in range(len(shares))], where="post", color=colour,
                       label=f"{name}: {len(shares)} arrivals")
    left.plot([_LEAST, 1.0], [_LEAST, 1.0], color="black", lw=0.8, ls=":", label="as promised")
    left.set(xscale="log", yscale="log", xlim=(0.7 * _LEAST, 1.3), ylim=(0.7 * _LEAST, 1.3), xlabel="promised",
             ylabel="came", title="In the no-go zone, half way along a leg; late")
    floors = floor_curve(records)
    floors = [b for b in floors if b.of >= LEAST_VOYAGES] or floors
    _bars(middle, list(range(len(floors))), floors, GROUPS[1][1], GROUPS[1][2], "")
    middle.axhline(0.01, color="black", lw=0.8, ls=":")
    middle.set(ylim=(0.0, None), xlabel="how many things are not the plan's", ylabel="share of voyages",
               title="Below the margin's floor (dotted: 1 %)")
    middle.set_xticks(range(len(floors)), [f"{b.name}\n({b.of})" for b in floors])
    right.axvline(1.0, color="black", lw=0.8, ls=":")
    right.set(xlabel="time, share of the first plan's", ylabel="share of arrivals", ylim=(0.0, 1.0),
              title="Time against the expected time")
    left.legend(loc="upper center", bbox_to_anchor=(0.5, -0.14), fontsize=8)   # below: no corner is free of points
    right.legend(loc="lower right", fontsize=8)
    return figure


def _bars(axes: Axes, places: Sequence[float], bins: Sequence[Bin], colour: str, mark: str, label: str) -> None:
    shares = [max(b.share, _LEAST) for b in bins]
    low = [max(0.0, share - max(b.interval[0], _LEAST)) for b, share in zip(bins, shares, strict=True)]
    high = [max(0.0, b.interval[1] - share) for b, share in zip(bins, shares, strict=True)]
    axes.errorbar(places, shares, yerr=[low, high], color=colour, marker=mark, ls="none", capsize=3, label=label)
