"""What the live page costs a voyage: ``python -m bench.page``, in real time, about four minutes, on a quiet machine.

The demo is sailed twice beside the simulated autopilot: alone, and with twelve who watch its page, one who asks for all
that was again and again, and one who asks for the stream and never reads.
"""

from __future__ import annotations

import argparse
import asyncio
import contextlib
import multiprocessing
import sys
from collections.abc import Iterator

from bench.voyage import ask, live, watch, whole
from sitl.scenario import free_port

WATCHERS = 12
AGAIN_S = 2.0


async def _again(port: int) -> None:
    while True:
        await whole(port, "/api/past")
        await asyncio.sleep(AGAIN_S)


async def _deaf(port: int) -> None:
    _, writer = await ask(port, "/api/stream")
    writer.transport.pause_reading()  # type: ignore[attr-defined]
    await asyncio.Event().wait()


def _all(port: int) -> None:
    async def everybody() -> None:
        watching = [watch(port) for _ in range(WATCHERS)]
        await asyncio.gather(*watching, _again(port), _deaf(port), return_exceptions=True)

    with contextlib.suppress(KeyboardInterrupt):
        asyncio.run(everybody())


@contextlib.contextmanager
def watched(port: int) -> Iterator[None]:
    others = multiprocessing.get_context("spawn").Process(target=_all, args=(port,), daemon=True)
    others.start()
    try:
        yield
    finally:
        others.terminate()
        others.join()


def main() -> int:
    parser = argparse.ArgumentParser(prog="python -m bench.page", description=__doc__.splitlines()[0])
    parser.add_argument("--seconds", type=float, default=60.0, help="of each voyage (default: 60)")
    args = parser.parse_args()
    port = free_port()
    alone = live(args.seconds)
    with watched(port):
        seen = live(args.seconds, "--http", str(port))
    for name, figures in (("alone", alone), (f"{WATCHERS} watch, one is deaf", seen)):
        print(
            f"{name}: {100 * figures['cpu_core_mean']:.1f} % of a core, {figures['memory_mb']:.0f} MB, "
            f"the loop held for at most {1e3 * figures['loop_held_max_s']:.1f} ms"
        )
    print(f"a client costs {100 * (seen['cpu_core_mean'] - alone['cpu_core_mean']) / WATCHERS:.2f} % of a core")
    return 0


if __name__ == "__main__":
    sys.exit(main())
