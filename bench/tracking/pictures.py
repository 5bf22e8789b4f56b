"""The pictures of docs/lab/tracking.md: corners sailed and predicted, and the residuals' distribution."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

from bench.tracking.record import Track
from bench.tracking.residuals import curve_mps, predicted, residuals
from bench.tracking.trials import WINDS_MPS, corners

mpl.use("Agg")
from matplotlib import pyplot as plt

SHOWN = (("corners-1-10", (3, 9)), ("corners-3-3", (0, 8)), ("corners-6-10", (0, 6)))
SIZE_IN = (11.0, 4.2)


def draw(sailed: dict[str, Track], folder: Path) -> None:
    """Write tracking-corners.png and tracking-residuals.png."""
    trials = {t.name: t for t in corners()}
    figure, axes = plt.subplots(1, len(SHOWN), figsize=SIZE_IN)
    for ax, (name, (first, last)) in zip(axes, SHOWN, strict=True):
        trial, track = trials[name], sailed[name]
        path = np.asarray([(0.0, 0.0), *trial.points_en_m])[first : last + 2]
        ours = predicted(trial)
        part = (ours.leg >= first) & (ours.leg <= last)
        real = track[(track[:, 3] > first) & (track[:, 3] <= last + 1)]
        ax.plot(*path.T, "o--", color="0.6", ms=3, lw=0.8, label="legs")
        ax.plot(*ours.en_m[part].T, color="tab:blue", lw=2.2, alpha=0.55, label="predicted")
        ax.plot(real[:, 1], real[:, 2], color="tab:red", lw=1.0, label="sailed by ArduRover")
        ax.set_aspect("equal", adjustable="datalim")
        ax.set_title(f"WP_RADIUS {trial.wp_radius_m:g} m, {np.max(curve_mps(trial.tws_mps)):.1f} m/s", fontsize=9)
        ax.tick_params(labelsize=7)
    axes[0].legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(folder / "tracking-corners.png", dpi=110)

    figure, (left, right) = plt.subplots(1, 2, figsize=(9.0, 3.6), sharey=True)
    for tws in WINDS_MPS:
        rows = [residuals(t, sailed[t.name]) for t in trials.values() if t.tws_mps == tws]
        for ax, want in ((left, False), (right, True)):
            values = np.sort(np.concatenate([r.track_m[r.is_short == want] for r in rows]))
            if len(values):
                ax.semilogx(
                    np.maximum(values, 0.02),
                    np.linspace(0.0, 100.0, len(values)),
                    label=f"{np.max(curve_mps(tws)):.1f} m/s",
                )
    for ax, title in ((left, "long legs"), (right, "near a leg of less than 4.5 s")):
        ax.axhline(99.0, color="0.7", lw=0.8)
        ax.set_title(title, fontsize=9)
        ax.set_xlabel("distance of the sailed from the predicted track, m")
        ax.grid(alpha=0.3)
    left.set_ylabel("share, %")
    left.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "tracking-residuals.png", dpi=110)
