"""Compiling what a package carries: all kernels, for the processor's plain family, into the package itself.

    python -m companion.kernels.carry

Run once where the package is built (by ``make deb``, the container, or before a wheel is built). Whoever installs it
compiles nothing: the files are found by their content, whatever their time stamps (``cache``). Interrupted, it goes on
where it was: by emulation it takes an hour.
"""

from __future__ import annotations

import os
import sys

from companion.kernels import places
from companion.kernels.build import is_ready, prepare
from companion.kernels.crew import planned
from companion.kernels.linked import INDEX, LIBRARY

PACKAGES = ("companion", "sitl")


def carry() -> int:
    """Fill the package's folder with what is missing and nothing else; return how many bytes it holds.

    Raises:
        OSError: it cannot be written; RuntimeError: what was compiled is not all there.
    """
    places.CARRIED.mkdir(exist_ok=True)
    (places.CARRIED / INDEX).unlink(missing_ok=True)   # kernels are compiled here, not called from there
    os.environ["COMPANION_KERNELS"] = str(places.CARRIED)   # of the processes that compile, too
    prepare(PACKAGES, say=_say)
    if not is_ready(PACKAGES) or not all((places.CARRIED / places.mark(name)).exists() for name in PACKAGES):
        raise RuntimeError(f"{places.CARRIED}: not all kernels are there")
    (places.CARRIED / places.MADE_FOR).write_text(f"{places.versions()}\n", encoding="utf-8")
    places.CARRIED.chmod(0o755)
    from companion.kernels.linking import link

    if not link(PACKAGES, places.CARRIED):
        _say("there is no ld here: kernels are carried for numba alone (apt install binutils)")
    wanted = {work.file for work in planned(PACKAGES)} | {places.mark(name) for name in PACKAGES}
    wanted |= {places.MADE_FOR, INDEX, LIBRARY}
    size = 0
    for path in places.CARRIED.iterdir():
        if path.name not in wanted:   # of another source, or half written when it was interrupted
            path.unlink()
            continue
        path.chmod(0o644)   # written for its owner alone; what is installed is for everyone
        size += path.stat().st_size
    return size


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.stdout.write(f"{places.CARRIED}: {carry() / 1e6:.1f} MB\n")
