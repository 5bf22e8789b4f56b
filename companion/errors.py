"""The one tree of exceptions.

    CompanionError
    ├── InputError          a file, mission, problem or option cannot be believed    -> exit 2
    │   └── UnreadableError it is not there, or the disk fails: perhaps soon         -> exit 2, of ``run`` 66
    ├── LinkError           the link to the autopilot is dead or never answered      -> exit 1
    │   └── TransferError   a mission, fence, parameter or file transfer failed      -> exit 1
    └── JobError            the job was understood and could not be done             -> exit 1

Outcomes that are part of normal life (no plan found, an upload refused) are enums in values, not exceptions.
"""

from __future__ import annotations

import errno
import re


class CompanionError(Exception):
    """Root of everything this program raises on purpose."""

    exit_code = 1


class InputError(CompanionError):
    """Bad input: names the source, the place in it, what is wrong and what to do.

    The text is one line: ``mission.toml: [goal] lat: 143.66 is not a latitude; write degrees within ±90``.
    """

    exit_code = 2

    def __init__(self, source: str, place: str, problem: str, remedy: str = "") -> None:
        self.source, self.place, self.problem, self.remedy = source, place, problem, remedy
        where = f"{source}: {place}" if place else source
        text = f"{where}: {problem}" + (f"; {remedy}" if remedy else "")
        super().__init__("\\n".join(text.split("\n")))  # a name may hold the end of a line

    def __reduce__(self) -> tuple[type[InputError], tuple[str, str, str, str]]:
        """Return how it is made again in another process."""
        return type(self), (self.source, self.place, self.problem, self.remedy)


class UnreadableError(InputError):
    """A file that is not there or a disk that fails: a card that is mounted late, or tried again, may have it."""


def unreadable(source: str, error: OSError, place: str = "", remedy: str = "") -> InputError:
    """Return what to raise for a file that could not be read: tried again unless its name or its rights are wrong."""
    is_wrong = isinstance(error, PermissionError | NotADirectoryError) or (
        error.errno == errno.EINVAL
    )  # a FIFO, a device: ``companion.disk.open_regular``
    if isinstance(error, IsADirectoryError):
        return InputError(source, place, "is a folder", remedy or "name a file in it")
    problem = "no such file" if isinstance(error, FileNotFoundError) else f"cannot be read ({error.strerror or error})"
    return (InputError if is_wrong else UnreadableError)(source, place, problem, remedy or "check the path")


class LinkError(CompanionError):
    """The link is dead, refused, or nobody answers on it."""


class TransferError(LinkError):
    """A transfer with the autopilot ended without success; the text says what it answered."""


class JobError(CompanionError):
    """The job was understood and could not be done."""


def not_toml(source: str, text: str, error: Exception) -> InputError:
    """Return the error of a text that is no TOML: with the line, and the remedy where a decimal comma is to blame."""
    what, _, where = str(error).partition(" (at ")
    line = re.match(r"line (\d+)", where)
    lines = text.splitlines()
    at_fault = lines[int(line[1]) - 1] if line and int(line[1]) <= len(lines) else ""
    has_comma = re.fullmatch(r"[^=#]*=\s*[+-]?\d+,\d+\s*(#.*)?", at_fault) is not None
    remedy = "decimals take a point, no comma" if has_comma else ""
    return InputError(source, where.rstrip(")"), f"is not TOML: {what[:1].lower()}{what[1:80]}", remedy)
