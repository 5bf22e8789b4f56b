"""The real ArduRover's program: finding it, fetching it, telling it from anything else."""

from __future__ import annotations

import os
import platform
import shutil
import subprocess
import tempfile
import time
import urllib.error
import urllib.request
from pathlib import Path

from companion.errors import InputError, JobError

URL = "https://firmware.ardupilot.org/Rover/stable/SITL_x86_64_linux_gnu/ardurover"
_SMALLEST_BYTES = 1_000_000


def fetched_path() -> Path:
    """Return where ``sitl fetch`` puts the program."""
    cache = os.environ.get("XDG_CACHE_HOME")
    return (Path(cache) if cache else Path.home() / ".cache") / "sailboat-companion" / "ardurover"


def find(path: Path | None = None) -> Path | None:
    """Return the program: ``path``, $ARDUROVER, on the PATH, or the fetched one; None if there is none.

    Raises:
        InputError: a place was named and there is no program there.
    """
    for source, named in (("--ardurover", path), ("$ARDUROVER", os.environ.get("ARDUROVER"))):
        if named:
            candidate = Path(named)
            if not (candidate.is_file() and os.access(candidate, os.X_OK)):
                raise InputError(source, str(candidate), "is no program", "name the ardurover executable")
            return candidate
    on_path = shutil.which("ardurover")
    if on_path:
        return Path(on_path)
    fetched = fetched_path()
    return fetched if fetched.is_file() else None


def require(path: Path | None = None) -> Path:
    """Return the program as ``find`` does.

    Raises:
        JobError: there is none.
    """
    found = find(path)
    if found is None:
        raise JobError("no ardurover here: run 'sitl fetch', or give --ardurover PATH, or set $ARDUROVER")
    return found


def fetch(url: str, target: Path, *, timeout_s: float) -> str:
    """Download the program, check it and put it at ``target``; return what it says of itself.

    Raises:
        JobError: no network, or what came is not the program; nothing is left behind.
    """
    if not url.startswith(("https://", "http://", "file://")):
        raise InputError("--url", url, "is not an address", "write https://...")
    if platform.system() != "Linux" or platform.machine() not in {"x86_64", "AMD64"}:
        here = f"{platform.system()} {platform.machine()}"
        raise JobError(f"the official simulator is for Linux on x86-64, this is {here}")
    host = url.split("/")[2] or url
    deadline = time.monotonic() + timeout_s
    target.parent.mkdir(parents=True, exist_ok=True)
    partial = target.with_name(target.name + ".partial")
    try:
        with urllib.request.urlopen(url, timeout=min(20.0, timeout_s)) as answer, partial.open("wb") as out:  # noqa: S310
            expected = answer.headers.get("Content-Length")
            while piece := answer.read(1 << 16):
                out.write(piece)
                if time.monotonic() > deadline:
                    raise JobError(f"{host}: the download took longer than {timeout_s:.0f} s")
        size = partial.stat().st_size
        if expected is not None and size != int(expected):
            raise JobError(f"{host}: got {size} of {expected} bytes")
        version = check(partial)
        partial.chmod(0o755)
        partial.replace(target)
    except (urllib.error.URLError, OSError) as error:
        reason = getattr(error, "reason", error)
        raise JobError(f"{host} cannot be reached ({reason}); is there a network?") from error
    finally:
        partial.unlink(missing_ok=True)
    return version


def check(path: Path) -> str:
    """Return "N bytes, answers --help" for a program that is what it should be.

    Raises:
        JobError: too small, not an x86-64 ELF file, or not ArduPilot's.
    """
    size = path.stat().st_size
    with path.open("rb") as stream:
        head = stream.read(20)
    if size < _SMALLEST_BYTES:
        raise JobError(f"what came is {size} bytes, too small for ArduRover")
    # ELF magic, 64 bit, little-endian, machine 62 = x86-64
    if head[:6] != b"\x7fELF\x02\x01" or head[18:20] != b"\x3e\x00":
        raise JobError("what came is not a Linux x86-64 program")
    path.chmod(0o755)
    try:
        with tempfile.TemporaryDirectory() as folder:
            shown = subprocess.run(  # noqa: S603
                [str(path.resolve()), "--help"], capture_output=True, text=True, timeout=20.0, cwd=folder, check=False
            )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise JobError(f"what came does not run here ({error})") from error
    if "--model" not in shown.stdout + shown.stderr:
        raise JobError("what came does not answer --help as ArduPilot's simulator does")
    return f"{size} bytes, answers --help"
