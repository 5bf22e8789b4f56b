"""The disk: whole files that a power cut leaves old or new, appended records whole or absent, the room that is left.

Everything that a voyage writes goes through a ``Disk``. Tests and the simulator put another in its place: one that
is full, sick or read-only, or that forgets what was not synced. A folder's lock and files with a secret are here, too.
"""

from __future__ import annotations

import contextlib
import errno
import fcntl
import gzip
import io
import os
import stat
import zlib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import BinaryIO

from companion.errors import InputError, unreadable

# A restart must find room for its state on a disk that records have filled: they stop at this much [bytes] ...
RESERVE_BYTES = 8 << 20
# ... or, on a small disk, at this share of it.
RESERVE_SHARE = 0.1
NEW, REPLACED = ".new", ".replaced"  # beside a file: what takes its place, and what it was until all are replaced

_KINDS = (
    (stat.S_ISFIFO, "a FIFO"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
    (stat.S_ISLNK, "a link"),
)
# What a wrong name raises, and a sick disk does not.
_MISTAKES = frozenset({errno.ENOTDIR, errno.EEXIST, errno.ENAMETOOLONG, errno.EINVAL, errno.ELOOP, errno.EISDIR})


@dataclass(frozen=True, slots=True, kw_only=True)
class Room:
    """What is left on a disk, and what records leave alone [bytes]."""

    free_bytes: int
    reserve_bytes: int

    @property
    def is_short(self) -> bool:
        """Whether records must stop."""
        return self.free_bytes < self.reserve_bytes

    @property
    def is_ample(self) -> bool:
        """Whether records may begin again: not at the very edge where they stopped."""
        return self.free_bytes >= self.reserve_bytes + self.reserve_bytes // 4


class Disk:
    """The operating system's files. Every method raises OSError as it does."""

    def make_folder(self, path: Path) -> None:
        """Make a folder and those above it."""
        path.mkdir(parents=True, exist_ok=True)

    def open_to_append(self, path: Path) -> int:
        """Open a file to be appended to, and make it if it is not there. Through a link nothing is written."""
        return os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND | os.O_NOFOLLOW | os.O_CLOEXEC, 0o644)

    def append(self, fd: int, data: bytes) -> None:
        """Append ``data`` whole, or not at all: a disk that fills in the middle of it leaves no half record."""
        done = 0
        try:
            done = self.write(fd, data)
            while done < len(data):
                done += self.write(fd, data[done:])
        except OSError:
            if done:
                with contextlib.suppress(OSError):
                    os.ftruncate(fd, os.fstat(fd).st_size - done)
            raise

    def replace(self, path: Path, data: bytes, *, is_durable: bool = True, mode: int | None = None) -> None:
        """Put ``data`` in the place of ``path``, whole or not at all; ``mode``: before there is anything in it.

        A new file beside it is written, synced and renamed, and then the folder is synced: only that makes the new
        name outlive a power cut.
        """
        self.replace_all({path: data}, is_durable=is_durable, mode=mode)

    def replace_all(self, files: Mapping[Path, bytes], *, is_durable: bool = True, mode: int | None = None) -> None:
        """Put each of ``files`` in its place, all or none; modes are kept where none is given.

        They are renamed when all are written. If then one cannot be, those before it are put back. A power cut among
        the renames leaves some old and some new, each of them whole.

        Raises:
            OSError: its ``filename`` cannot be written. What was there is there, but for ``filename2``, if that is
                not None: it is new and cannot be put back.
        """
        beside = {path: path.with_name(path.name + NEW) for path in files}
        kept: dict[Path, Path | None] = {}
        renamed: list[Path] = []
        path = Path()
        try:
            for path, data in files.items():
                self._write(path, beside[path], data, is_durable=is_durable, mode=mode)
            if len(files) > 1:
                kept = _kept(files)
            for path, new in beside.items():
                self.rename(new, path)
                renamed.append(path)
            if is_durable:
                for folder in {path.parent for path in files}:
                    self.sync_folder(folder)
        except OSError as error:
            left = [str(done) for done in renamed if not self._put_back(done, kept)]
            for new in beside.values():
                with contextlib.suppress(OSError):
                    new.unlink()  # a full disk needs the room
            error.filename, error.filename2 = str(path), left[0] if left else None
            raise
        finally:
            for old in kept.values():
                if old is not None:
                    with contextlib.suppress(OSError):
                        old.unlink(missing_ok=True)

    def _write(self, path: Path, new: Path, data: bytes, *, is_durable: bool, mode: int | None) -> None:
        """Write what ``path`` is to hold beside it, with the rights that it is to have."""
        fd = self.create(new)
        try:
            if mode is not None:
                os.fchmod(fd, mode)
            done = 0
            while done < len(data):
                done += self.write(fd, data[done:])
            with contextlib.suppress(OSError):
                before = path.lstat().st_mode if mode is None else stat.S_IFREG | mode
                if stat.S_ISREG(before):  # the rights of what a link leads to are another file's
                    os.fchmod(fd, before & 0o777)
            if is_durable:
                self.sync(fd)
        finally:
            os.close(fd)

    def _put_back(self, path: Path, kept: Mapping[Path, Path | None]) -> bool:
        """Put back what ``path`` was, and return whether that was done."""
        if path not in kept:
            return False
        old = kept[path]
        try:
            if old is None:
                path.unlink()
            else:
                self.rename(old, path)
        except OSError:
            return False
        return True

    # ---------------------------------------------------------------------------------- what the above is made of
    def create(self, path: Path) -> int:
        """Make and open a file. What has its name is removed, not written to: it may be a link to another's file."""
        flags = os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW | os.O_CLOEXEC
        try:
            return os.open(path, flags, 0o644)
        except FileExistsError:  # a power cut left it, or others did
            path.unlink()
            return os.open(path, flags, 0o644)

    def write(self, fd: int, data: bytes) -> int:
        """Write some of ``data``; return how many bytes."""
        return os.write(fd, data)

    def sync(self, fd: int) -> None:
        """Force a file's content to the disk."""
        os.fsync(fd)

    def rename(self, source: Path, target: Path) -> None:
        """Give a file another name, in place of the one that has it."""
        source.replace(target)

    def sync_folder(self, path: Path) -> None:
        """Force the names in a folder to the disk."""
        fd = os.open(path, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            self.sync(fd)
        except OSError as error:
            if error.errno not in {errno.EINVAL, errno.ENOTSUP}:  # some file systems cannot, and need not
                raise
        finally:
            os.close(fd)

    def room(self, folder: Path) -> Room:
        """Return what is left on the disk that ``folder`` is on."""
        status = os.statvfs(folder)
        share = int(status.f_blocks * status.f_frsize * RESERVE_SHARE)
        return Room(free_bytes=status.f_bavail * status.f_frsize, reserve_bytes=min(RESERVE_BYTES, share))


def _kept(paths: Iterable[Path]) -> dict[Path, Path | None]:
    """Return a second name of each file, which outlives the first; None: there is no file.

    One that cannot have two is left out: a directory, or any on a file system that knows no links, as FAT.
    """
    kept: dict[Path, Path | None] = {}
    for path in paths:
        old = path.with_name(path.name + REPLACED) if os.path.lexists(path) else None
        with contextlib.suppress(OSError):
            if old is not None:
                old.unlink(missing_ok=True)  # a power cut left it
                os.link(path, old, follow_symlinks=False)
            kept[path] = old
    return kept


def open_regular(path: Path, *, follows_links: bool = True) -> BinaryIO:
    """Open a file for reading that is one: a FIFO or a device might never answer, or do something when it is opened.

    Raises:
        OSError: it is none (EINVAL), is a link where none is followed, or cannot be opened.
    """
    _require_regular(path.stat(follow_symlinks=follows_links).st_mode)  # opening may do something to a device
    more = 0 if follows_links else os.O_NOFOLLOW
    return io.open(path, "rb", opener=lambda name, flags: _opened(name, flags | more))  # noqa: UP020 - as pathlib calls it


def _opened(path: str, flags: int) -> int:
    fd = os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC | os.O_NOCTTY)
    try:
        _require_regular(os.fstat(fd).st_mode)  # it may be another by now
    except OSError:
        os.close(fd)
        raise
    return fd


def read_regular(path: Path, most_bytes: int = -1, *, follows_links: bool = True) -> bytes:
    """Return what is in such a file, at most so much of it. Raises OSError."""
    with open_regular(path, follows_links=follows_links) as file:
        return file.read(most_bytes)


def unpacked(data: bytes) -> bytes:
    """Return what gzip packed.

    Raises:
        gzip.BadGzipFile: it is none, is cut off, or is damaged: the library raises an error of another kind for each.
    """
    try:
        return gzip.decompress(data)
    except (EOFError, zlib.error) as error:
        raise gzip.BadGzipFile(str(error)) from None


def _require_regular(mode: int) -> None:
    if stat.S_ISDIR(mode):
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
    if not stat.S_ISREG(mode):
        kind = next((word for is_one, word in _KINDS if is_one(mode)), "something else")
        raise OSError(errno.EINVAL, f"it is {kind} and no regular file")


def reason(error: OSError) -> str:
    """Return what a disk's error says, in the operating system's words."""
    return error.strerror or str(error) or type(error).__name__


def what_is_there(error: OSError) -> str:
    """Return what files hold of which ``replace_all`` could not replace one, in words."""
    return "what was there is there" if error.filename2 is None else f"{error.filename2} is new already"


def is_mistake(error: OSError) -> bool:
    """Return whether the name was wrong: whoever typed it must hear so, and waiting does not mend it."""
    return error.errno in _MISTAKES


class FolderLock:
    """The lock on ``folder``, held by one process for as long as it lives; not taken until ``take``.

    The folder itself is locked (flock), so nothing is written, nothing is left behind by a kill, and a full or
    read-only disk can be locked too.
    """

    def __init__(self, folder: Path) -> None:
        self._folder = folder
        self._fd: int | None = None

    @property
    def is_held(self) -> bool:
        """Whether this process holds it."""
        return self._fd is not None

    def take(self) -> bool:
        """Take the lock; False when somebody else holds it.

        Raises:
            OSError: the folder is not there, or its file system knows no locks.
        """
        fd = os.open(self._folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
        try:
            fcntl.flock(fd, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(fd)
            return False
        except OSError:
            os.close(fd)
            raise
        self._fd = fd
        return True

    def release(self) -> None:
        """Give it back, if it is held."""
        if self._fd is not None:
            os.close(self._fd)
            self._fd = None


MOST_BYTES = 65_536


def read_secret(path: Path, what: str, remedy: str) -> str:
    """Return the text of such a file, without the blanks around it.

    ``what`` is its name in a message, empty where who tells of it names it; ``remedy`` what to do when it is not there.

    Raises:
        InputError: it cannot be read, is not text, or others may read it.
    """
    try:
        with open_regular(path) as file:
            mode, text = os.fstat(file.fileno()).st_mode, file.read(MOST_BYTES).decode("utf-8").strip()
    except OSError as error:
        raise unreadable(str(path), error, what, remedy) from error
    except UnicodeDecodeError as error:
        raise InputError(str(path), "", f"{what} is not text".lstrip(), remedy) from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(str(path), "", f"{what} can be read by others".lstrip(), f"chmod 600 {path}")
    return text
