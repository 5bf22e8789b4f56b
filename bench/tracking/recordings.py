"""The golden recordings: tracks that the real ArduRover sailed, thinned to what their shape needs, in one file."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from bench.tracking.record import Track

FILE = Path("tests/boat/tracking/ardurover.npz")
STEP_M = 0.5  # nearer to the last one a sample is left out
CENTI = 100.0  # places are kept in whole centimetres, times in hundredths of a second, the wind in 0.01 rad


def thinned(track: Track) -> Track:
    """Return the track with a sample every ``STEP_M`` at the most, its ends included."""
    keep = [0]
    for i in range(1, len(track)):
        if np.hypot(*(track[i, 1:3] - track[keep[-1], 1:3])) >= STEP_M or i == len(track) - 1:
            keep.append(i)
    return track[keep]


def save(tracks: dict[str, Track], path: Path = FILE) -> None:
    """Write the tracks."""
    np.savez_compressed(
        path,
        **{
            name: np.round(track * CENTI).astype(np.int32)  # type: ignore[arg-type]
            for name, track in tracks.items()
        },
    )


def load(path: Path = FILE) -> dict[str, Track]:
    """Return the tracks by the names of their trials."""
    with np.load(path) as file:
        return {name: file[name].astype(np.float64) / CENTI for name in file.files}
