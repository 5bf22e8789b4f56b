"""Compiling what a package carries: all kernels, for the processor's plain family, into the package itself.

    python -m companion.kernels.carry

Run once where the package is built (by ``make deb``, the container, or before a wheel is built). Whoever installs it
compiles nothing: the files are found by their content, whatever their time stamps (``cache``).
"""

from __future__ import annotations

import os
import shutil
import sys

from companion.kernels import places
from companion.kernels.build import is_ready, prepare

PACKAGES = ("companion", "sitl")


def carry() -> int:
    """Fill the package's folder anew; return how many bytes it holds.

    Raises:
        OSError: it cannot be written; RuntimeError: what was compiled is not all there.
    """
    shutil.rmtree(places.CARRIED, ignore_errors=True)
    places.CARRIED.mkdir()
    os.environ["COMPANION_KERNELS"] = str(places.CARRIED)   # of the processes that compile, too
    prepare(PACKAGES, say=_say)
    if not is_ready(PACKAGES) or not all((places.CARRIED / places.mark(name)).exists() for name in PACKAGES):
        raise RuntimeError(f"{places.CARRIED}: not all kernels are there")
    (places.CARRIED / places.MADE_FOR).write_text(f"{places.versions()}\n", encoding="utf-8")
    places.CARRIED.chmod(0o755)
    size = 0
    for path in places.CARRIED.iterdir():   # written for their owner alone; what is installed is for everyone
        path.chmod(0o644)
        size += path.stat().st_size
    return size


def _say(text: str) -> None:
    sys.stdout.write(f"{text}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.stdout.write(f"{places.CARRIED}: {carry() / 1e6:.1f} MB\n")
