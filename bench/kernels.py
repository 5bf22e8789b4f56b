"""What compiling costs, kernel by kernel: ``python -m bench.kernels``; with ``--write`` also the lists of kernels.

    python -m bench.kernels              the table: kernel, combinations of types, processor seconds (a few minutes)
    python -m bench.kernels --write      ... and companion/kernels.txt, sitl/kernels.txt, from what a voyage called

A voyage is: the planner's ``warm``, the forecaster's, many points against a coast, a short demonstration on the
simulated autopilot, and the plan of a passage. Everything is compiled in this one process, in an empty folder.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from pathlib import Path


def sail(folder):
    """Do what a voyage does."""
    import numpy as np
    from shapely.geometry import Point

    from companion.clock import run_virtual
    from companion.geo.segments import PolygonIndex
    from companion.planner.solve import warm
    from companion.wind.estimators import compile_kernels
    from sitl.run.embedded import run_embedded
    from sitl.scenario import load_scenario

    warm()
    compile_kernels()
    index = PolygonIndex([Point(0.0, 0.0).buffer(10.0)])
    points = np.array([[0.0, 0.0], [20.0, 5.0]])
    index.contains(points), index.distance_m(points), index.intersects([[0.0, 0.0, 30.0, 5.0]])
    told = []
    for name in ("demo", "crossing", "buoy-course"):
        path = Path("sitl/scenarios", f"{name}.toml")
        run_virtual(
            run_embedded(
                load_scenario(path),
                path,
                0,
                Path(folder, name),
                expansions=2000,
                on_status=lambda _, step: told.append(step.eta()),  # as the status line asks
            )
        )


def cross():
    """Plan a passage, as ``companion passage plan`` does."""
    import numpy as np

    from companion.boat import Boat, constant
    from companion.messages import GeoPoint
    from companion.passage import Passage, PassageFrame, craft_of, land_of, plan
    from companion.weather import Cube, Weather

    start, goal = GeoPoint(lat_deg=0.0, lon_deg=0.0), GeoPoint(lat_deg=0.0, lon_deg=0.5)
    axis, hours = np.linspace(-3.0, 3.0, 13), 3600.0 * np.arange(0.0, 49.0, 6.0)
    values = np.full((1, hours.size, axis.size, axis.size, 2), -5.0, dtype=np.float32)
    cube = Cube(utc_s=hours, base_utc_s=hours, members=(0,), lat_deg=axis, lon_deg=axis, values=values)
    frame = PassageFrame(start, goal)
    plan(
        Passage(
            start=start,
            goal=goal,
            radius_m=100.0,
            craft=craft_of(Boat(polar=constant(2.0), no_go_half_rad=0.7)),
            weather=Weather(wind=(cube,)),
            land=land_of(frame, (), (-3.0, -3.0, 3.0, 3.0), 0.0),
            frame=frame,
        ),
        0.0,
        nodes=12,
    )


def recorded(folder):
    """Return {(kernel, types): own processor seconds}, callees first, and the process's peak memory [MiB]."""
    os.environ["COMPANION_KERNELS"] = str(Path(folder, "kernels"))
    from numba.core import event

    taken, running = {}, []

    class Listener(event.Listener):
        def on_start(self, happened):
            del happened
            running.append([time.process_time(), 0.0])

        def on_end(self, happened):
            began, within = running.pop()
            took = time.process_time() - began
            if running:
                running[-1][1] += took
            dispatcher = happened.data["dispatcher"]
            key = (dispatcher, tuple(happened.data["args"]))
            taken[key] = taken.get(key, 0.0) + took - within

    event.register("numba:compile", Listener())
    sail(folder)
    cross()
    return taken


def main(argv=None):
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--write", action="store_true", help="write the lists of kernels")
    args = parser.parse_args(argv)
    with tempfile.TemporaryDirectory() as folder:
        taken = recorded(folder)
        kept = sum(p.stat().st_size for p in Path(folder, "kernels").iterdir())
    from companion.kernels.listed import Entry, as_text
    from companion.kernels.places import FILE

    lists, rows, inside_s = {"companion": [], "sitl": []}, {}, 0.0
    for (dispatcher, types), seconds in taken.items():
        module, name = dispatcher.py_func.__module__, dispatcher.py_func.__qualname__
        package = module.partition(".")[0]
        if package not in lists:
            inside_s += seconds
            continue
        lists[package].append(Entry(module=module, name=name, signature=as_text(types), seconds=seconds))
        count, total = rows.get(f"{module}.{name}", (0, 0.0))
        rows[f"{module}.{name}"] = (count + 1, total + seconds)
    print("| kernel | combinations of types | seconds |\n|---|---|---|")
    for name, (count, seconds) in sorted(rows.items(), key=lambda row: -row[1][1]):
        print(f"| {name} | {count} | {seconds:.2f} |")
    print(f"| numba's own, for them | | {inside_s:.2f} |")
    whole_s = inside_s + sum(seconds for _, seconds in rows.values())
    print(f"| {len(rows)} kernels | {sum(count for count, _ in rows.values())} | {whole_s:.1f} |")
    print(f"\n{kept / 2**20:.1f} MiB on the disk")
    if args.write:
        for package, entries in lists.items():
            head = "# What a voyage calls: seconds to compile, kernel, types. By `python -m bench.kernels --write`.\n"
            Path(package, FILE).write_text(head + "".join(f"{e}\n" for e in entries), encoding="utf-8")
    return 0


if __name__ == "__main__":
    sys.exit(main())
