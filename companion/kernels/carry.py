"""Compiling what a package carries: one extension module with all listed kernels, into the package itself.

    python -m companion.kernels.carry [FOLDER]

Run once where the package is built (by ``make deb``, the container, or before a wheel is built). Needs a C compiler,
Python's headers and setuptools; whoever installs the package needs none of them, and compiles nothing. Numba compiles
it ahead of time (``numba.pycc``: deprecated since 0.57 with a successor promised and none yet, so the version of numba
is bounded); a minute or two, by emulation half an hour.
"""

from __future__ import annotations

import argparse
import fcntl
import hashlib
import json
import shutil
import subprocess
import sys
import warnings
from pathlib import Path
from typing import Any

from companion.kernels import places
from companion.kernels.carried import EXTENSION, PACKAGES, Carried, symbol
from companion.kernels.listed import from_text, read_list


def carry(folder: Path = places.CARRIED) -> Path:
    """Make the extension for the sources as they are now, and nothing else in the folder; return its path.

    Raises:
        OSError: it cannot be written; JobError: the list names what is no kernel; SystemExit, CompileError: of the C
            compiler.
    """
    folder.mkdir(exist_ok=True, parents=True)
    (folder / places.CARRIED_FOR).unlink(missing_ok=True)
    Carried.waiting = None  # kernels are compiled here, not called from what was carried before
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # that it is deprecated
        from numba.pycc import CC, compiler
    compiler.Flags = _flags(compiler.Flags)
    extension = CC(EXTENSION)
    extension.output_dir, extension.target_cpu = str(folder), "generic"
    for package in PACKAGES:
        for number, entry in enumerate(read_list(package)):
            extension.export(symbol(package, number), from_text(entry.signature))(entry.kernel().py_func)
    extension.compile()
    library = folder / str(extension.output_file)
    for path in folder.iterdir():
        if path != library:
            path.unlink()
    folder.chmod(0o755)
    library.chmod(0o644)
    index = {package: places.source(package) for package in PACKAGES}
    index |= {"library": library.name, "sha256": hashlib.sha256(library.read_bytes()).hexdigest()}
    (folder / places.CARRIED_FOR).write_text(json.dumps(index, indent=1) + "\n", encoding="utf-8")
    return library


def as_packaged() -> Path:
    """Return a folder of kernels as a package carries them, made once for this user and the sources as they are.

    For who measures or tests in a clone what a boat will have.
    """
    digest = hashlib.sha256("".join(map(places.source, PACKAGES)).encode()).hexdigest()[:24]
    kept = places.folder().with_name("carried-kernels")
    kept.mkdir(parents=True, exist_ok=True)
    folder = kept / digest
    with (kept / "lock").open("w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        if not (folder / places.CARRIED_FOR).exists():
            for old in kept.glob("?" * len(digest)):
                shutil.rmtree(old)
            subprocess.run([sys.executable, "-m", "companion.kernels.carry", str(folder)], check=True)  # noqa: S603 - this program
    return folder


def _flags(of_numba: Any) -> Any:
    """Return numba's flags with the interpreter's lock released while a kernel runs; ``CC`` has no option for it."""

    class Flags(of_numba):  # type: ignore[misc]
        def __init__(self, copy_from: Any = None) -> None:
            super().__init__(copy_from)
            self.release_gil = True

    return Flags


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(prog="python -m companion.kernels.carry", description=__doc__)
    arguments.add_argument("folder", nargs="?", type=Path, default=places.CARRIED, help="(default: the package's own)")
    made = carry(arguments.parse_args().folder)
    sys.stdout.write(f"{made}: {made.stat().st_size / 1e6:.1f} MB\n")
