"""Memory given back to the system: what was freed and kept, and pages of a library that was needed only to load."""

from __future__ import annotations

import contextlib
import ctypes
import gc
import mmap
import re
from collections.abc import Iterator
from pathlib import Path

_HEAD = re.compile(r"([0-9a-f]+)-([0-9a-f]+) r-.p \S+ \S+ \d+ +/.*")  # private, and cannot be written
_SMAPS = Path("/proc/self/smaps")
_M_MMAP_THRESHOLD = -3  # of <malloc.h>
LARGE_BYTES = 1 << 18  # what is given back to the system as soon as it is freed


def settle() -> None:
    """Keep what a process has loaded as what it will always have, share it with its forks, and give back the rest."""
    part_with_large()
    gc.collect()
    gc.freeze()  # what is there now is never looked at again, so its pages stay shared
    trim()
    let_go()  # of the libraries that were read to be loaded, half is never called: what is comes back by itself


def part_with_large() -> None:
    """Have the C library (glibc) give back what is large when it is freed, and not keep it for later.

    It begins so, and no longer does when it has seen one large array freed: from then on the arrays of a search stay in
    the heap under what was put there after them.
    """
    with contextlib.suppress(OSError, AttributeError):
        ctypes.CDLL(None).mallopt(_M_MMAP_THRESHOLD, LARGE_BYTES)


def trim() -> None:
    """Give back what was freed, where the C library keeps it for later (glibc): after a plan, some 5 MB."""
    try:
        ctypes.CDLL(None).malloc_trim(0)
    except (OSError, AttributeError):
        return


def let_go() -> int:
    """Drop the clean pages of the libraries that are loaded; return how many bytes were mapped there.

    What was read of a library to load it lies in the memory of a process that never calls it again: 70 MB of LLVM's
    own code where kernels were compiled, 15 MB of the others. A page of a file that nobody has written to can be
    dropped at any time: who does call it reads it again. Where the system does not say what is mapped, or has no such
    call, nothing is dropped.
    """
    try:
        advise = ctypes.CDLL(None).madvise
        text = _SMAPS.read_text(encoding="utf-8", errors="replace")
    except (OSError, AttributeError):
        return 0
    advise.argtypes = ctypes.c_void_p, ctypes.c_size_t, ctypes.c_int
    return sum(end - begin for begin, end in clean(text) if advise(begin, end - begin, mmap.MADV_DONTNEED) == 0)


def clean(smaps: str) -> Iterator[tuple[int, int]]:
    """Yield where the parts of files that were never written to begin and end.

    What the linker has put in (relocations) is not in the file: a part with one such page, which counts as anonymous,
    is left alone.
    """
    place = None
    for line in smaps.splitlines():
        head = _HEAD.fullmatch(line)
        if head:
            place = int(head[1], 16), int(head[2], 16)
        elif place is not None and line.startswith("Anonymous:") and line.split()[1] == "0":
            yield place
        elif "-" in line.partition(" ")[0]:
            place = None
