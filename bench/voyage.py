"""What the companion costs: processor, memory, start, event loop, and how fast a voyage runs under the virtual clock.

    python -m bench.voyage            about two minutes

The companion sails the demo mission in real time (1x) beside the simulated autopilot for a minute, with its page open
and the kernels that a package carries; its processes are measured from outside (/proc). Then a whole demo voyage runs
under the virtual clock in this process. Figures of a busy machine are too high: run it on a quiet one.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import json
import os
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from companion.kernels.carry import as_packaged
from sitl.scenario import free_port

SCENARIO = Path("sitl/scenarios/demo.toml")
MISSION = Path("missions/archipelago.toml")
TICKS_PER_S = os.sysconf("SC_CLK_TCK")
PACKAGED = """
import sys
from pathlib import Path
from companion.kernels import places
places.CARRIED = Path(sys.argv.pop(1))
from companion.cli import main
sys.exit(main())
"""


def children(pid: int) -> list[int]:
    found = []
    for task in Path(f"/proc/{pid}/task").iterdir():
        text = (task / "children").read_text()
        for child in map(int, text.split()):
            found += [child, *children(child)]
    return found


def cpu_s(pid: int) -> float:
    """Return the processor time of one process [s]."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return (int(fields[11]) + int(fields[12])) / TICKS_PER_S


def memory_mb(pid: int) -> float:
    """Return what one process takes of the memory [MB]: pages shared with others count by their share (PSS)."""
    for line in Path(f"/proc/{pid}/smaps_rollup").read_text().splitlines():
        if line.startswith("Pss:"):
            return int(line.split()[1]) / 1e3
    return 0.0


def alone_mb(pids: Sequence[int]) -> float:
    """Return what processes take together where nothing else runs [MB]: pages of files that they share count once.

    What is written to is a program's own, but for what a fork shares with it, and is divided among them as PSS divides
    it. Of files that are not written to each mapping counts with the process that has most of it; other programs of
    this machine, which would bear a part of them, are left aside. By the page frames, which root alone can count, it
    was 0.5 % more.
    """
    own_kb, files_kb = 0.0, dict[tuple[str, str], int]()
    for pid in pids:
        place, found = ("", ""), dict[str, int]()
        for line in Path(f"/proc/{pid}/smaps").read_text().splitlines():
            name, _, rest = line.partition(":")
            if "-" in line.split(" ", 1)[0]:
                words = line.split(maxsplit=5)
                place = (words[5] if len(words) > 5 else "", words[0])
            elif name in {"Rss", "Pss"}:
                found[name] = int(rest.split()[0])
            elif name == "Anonymous":
                anonymous = int(rest.split()[0]) if place[0].startswith("/") else found["Rss"]
                own_kb += found["Pss"] * anonymous / max(1, found["Rss"])
                files_kb[place] = max(files_kb.get(place, 0), found["Rss"] - anonymous)
    return 1024 * (own_kb + sum(files_kb.values())) / 1e6


def written_bytes(pid: int) -> int:
    """Return what one process has sent to the disk, in whole pages, as the kernel counts it."""
    return int(Path(f"/proc/{pid}/io").read_text().partition("\nwrite_bytes:")[2].split()[0])


@contextlib.contextmanager
def afloat(folder: Path, *options: str, **more: Any) -> Iterator[tuple[subprocess.Popen[bytes], float]]:
    """Sail the demo in real time: the companion as a process of its own, and how long its first step took [s].

    ``more`` goes to the companion's process. It is ended with the body, if it has not ended by itself.
    """
    port = free_port()
    boat = subprocess.Popen(
        [sys.executable, "-m", "sitl.run.live_boat", str(SCENARIO), "--endpoint", f"udpout:127.0.0.1:{port}"]
    )
    began = time.monotonic()
    companion = subprocess.Popen(
        [
            sys.executable,
            "-c",
            PACKAGED,
            str(as_packaged()),
            "run",
            str(MISSION),
            "--link",
            f"udpin:127.0.0.1:{port}",
            "--out",
            str(folder),
            "--state",
            str(folder.parent / "state.json"),
            *options,
        ],
        **more,
    )
    track = folder / "track.csv"
    try:
        while companion.poll() is None and not (track.is_file() and track.read_bytes().count(b"\n") > 1):
            time.sleep(0.02)
        yield companion, time.monotonic() - began
    finally:
        companion.send_signal(signal.SIGINT)
        companion.wait(30)
        boat.terminate()
        boat.wait(30)


async def ask(port: int, path: str) -> tuple[asyncio.StreamReader, asyncio.StreamWriter]:
    while True:
        try:
            reader, writer = await asyncio.open_connection("127.0.0.1", port)
        except OSError:  # not there yet
            await asyncio.sleep(0.2)
        else:
            writer.write(
                f"GET {path} HTTP/1.1\r\nHost: 127.0.0.1:{port}\r\nAccept-Encoding: gzip\r\n"
                "Connection: close\r\n\r\n".encode()
            )
            return reader, writer


async def whole(port: int, path: str) -> None:
    reader, writer = await ask(port, path)
    await reader.read()
    writer.close()


async def watch(port: int) -> None:
    """Have the page open."""
    for path in ("/api/hello", "/api/area", "/api/past", "/api/log"):
        await whole(port, path)
    reader, _ = await ask(port, "/api/stream")
    with contextlib.suppress(ConnectionError):
        while await reader.read(65_536):
            pass


def live(seconds: float, *options: str) -> dict[str, float]:
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch) / "voyage"
        with afloat(folder, *options, stdout=subprocess.DEVNULL) as (companion, start_s):
            # The wind settles for half a minute; then plan and sail. Planning is left out of the idle figure.
            time.sleep(45.0)
            main, workers = companion.pid, children(companion.pid)
            cpu0, written0 = cpu_s(main), written_bytes(main)
            loads, worst, alone, seen = [], 0.0, 0.0, list[float]()
            began = time.monotonic()
            while time.monotonic() - began < seconds:
                before, at = cpu_s(main), time.monotonic()
                time.sleep(5.0)
                loads.append((cpu_s(main) - before) / (time.monotonic() - at))
                living = [p for p in (main, *workers) if Path(f"/proc/{p}").exists()]
                seen.append(alone_mb(living))
                worst, alone = max(worst, sum(map(memory_mb, living))), max(alone, seen[-1])
            took_s = time.monotonic() - began
            mean_load, card_bytes_per_s = (cpu_s(main) - cpu0) / took_s, (written_bytes(main) - written0) / took_s
        summary = json.loads((folder / "summary.json").read_text())
    return {
        "start_s": start_s,
        "cpu_core_mean": mean_load,
        "cpu_core_median": sorted(loads)[len(loads) // 2],
        "memory_mb": worst,
        "alone_mb": sorted(seen)[len(seen) // 2],
        "alone_most_mb": alone,
        "card_mb_per_day": card_bytes_per_s * 86_400.0 / 1e6,
        "loop_held_max_s": summary["loop_held_max_s"],
    }


def virtual() -> dict[str, float]:
    from companion.clock import run_virtual
    from sitl.run.embedded import run_embedded
    from sitl.scenario import load_scenario

    scenario = load_scenario(SCENARIO)
    ratios = []
    with tempfile.TemporaryDirectory() as scratch:
        for seed in range(4):  # the first one loads the kernels
            began = time.perf_counter()
            verdict = run_virtual(run_embedded(scenario, SCENARIO, seed, Path(scratch) / str(seed)))
            if seed:
                ratios.append((verdict.figures["time_s"] + 33.0) / (time.perf_counter() - began))
    return {"times_real_time": sorted(ratios)[1]}


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.voyage", description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="of sailing that is measured (default: 60)")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    port = free_port()
    threading.Thread(target=lambda: asyncio.run(watch(port)), daemon=True).start()
    figures = live(args.seconds, "--http", str(port)) | virtual()
    print(f"start, kernels carried           {figures['start_s']:.1f} s")
    print(
        f"companion while sailing          {100 * figures['cpu_core_median']:.1f} % of a core "
        f"(mean {100 * figures['cpu_core_mean']:.1f} %)"
    )
    print(
        f"memory with the planner's worker {figures['memory_mb']:.0f} MB beside the simulator, whose libraries it "
        f"shares; counted alone {figures['alone_mb']:.0f} MB, "
        f"{figures['alone_most_mb']:.0f} MB at most of one look in five seconds"
    )
    print(f"what reaches a card              {figures['card_mb_per_day']:.0f} MB a day")
    print(f"event loop held at most          {1000 * figures['loop_held_max_s']:.0f} ms")
    print(f"demo under the virtual clock     {figures['times_real_time']:.0f} times real time")
    if args.json:
        args.json.write_text(json.dumps(figures, indent=1) + "\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
