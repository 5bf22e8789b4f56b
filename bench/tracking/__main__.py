"""How far the real ArduRover sails from the track that is predicted.

python -m bench.tracking                       the tables, from the golden recordings; a few seconds
python -m bench.tracking --simulated           the same for the simulated autopilot, sailed now
python -m bench.tracking --l1                  the same for one that steers by L1, as before ArduRover 4.3
python -m bench.tracking --sail [--speedup 25] sails every trial on the real ArduRover again (15 minutes) and
                                               replaces the recordings
python -m bench.tracking --figures DIR         the pictures of docs/lab/tracking.md
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

from bench.tracking.pictures import draw
from bench.tracking.record import Track, sail_ardurover, sail_simulated
from bench.tracking.recordings import load, save, thinned
from bench.tracking.residuals import beat_table, l1_table, stream_table, table
from bench.tracking.trials import beats, corners, streams
from companion.boat.l1 import PERIOD_S


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--sail", action="store_true")
    parser.add_argument("--simulated", action="store_true")
    parser.add_argument("--l1", action="store_true")
    parser.add_argument("--speedup", type=float, default=25.0)
    parser.add_argument("--figures", type=Path)
    options = parser.parse_args()
    sailed: dict[str, Track] = {}
    if options.l1:
        settings = {"NAVL1_PERIOD": PERIOD_S}
        sailed = {trial.name: thinned(sail_simulated(trial, settings)) for trial in corners()}
        print(*l1_table(sailed, PERIOD_S), sep="\n")
        return
    if options.sail or options.simulated:
        for trial in [*corners(), *beats(), *streams()]:
            track = sail_ardurover(trial, options.speedup) if options.sail else sail_simulated(trial)
            sailed[trial.name] = thinned(track)
            print(f"{trial.name}: {track[-1, 0] - track[0, 0]:.0f} s", file=sys.stderr, flush=True)
        if options.sail:
            save(sailed)
    else:
        sailed = load()
    print(*table(sailed), "", *beat_table(sailed), "", *stream_table(sailed), sep="\n")
    if options.figures is not None:
        draw(sailed, options.figures)


main()
