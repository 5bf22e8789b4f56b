"""MAVLink 2 signing on disk: the key, and a timestamp that never goes back over restarts.

The key is 32 bytes in a file of mode 0600: 64 hex digits, or a passphrase line from which the key is the SHA-256, as
Mission Planner and MAVProxy make it. A board without a clock that boots in the past would have its frames refused,
so the last timestamp is kept beside the key and stored ahead of its use.
"""

from __future__ import annotations

import contextlib
import hashlib
import logging
import os
import re
import secrets
from pathlib import Path

from companion.disk import Disk, read_regular, read_secret, reason
from companion.errors import InputError
from companion.mavlink.wire.frames import MOST_TIMESTAMP, SigningState

# 2015-01-01T00:00:00Z in Unix seconds: the zero of MAVLink signing timestamps, which count 10 µs.
EPOCH_S = 1_420_070_400.0
TICKS_PER_S = 100_000
# Stored this far ahead, so that a power cut between two stores cannot repeat a timestamp [s]. An autopilot refuses a
# newcomer that is more than 60 s behind the newest stamp it has seen, so we must not run that far ahead of others.
AHEAD_S = 40.0
# What begins ahead of the clock, because it was stored ahead, waits for it, and is stored this far ahead meanwhile:
# frames count on by a tick each. Else each restart would lead by a lead more, and never by less again.
SPARE_S = 1.0
# A clock that is farther behind what is stored is none (a board that boots in 1970): stamps go on from there with time.
NO_CLOCK_S = 3600.0
# A stored timestamp beyond this is damage: of the 48 bits of a timestamp the last year is left to be signed in.
_MOST_STORED = MOST_TIMESTAMP - 366 * 86_400 * TICKS_PER_S
_MOST_BYTES = 64  # of the file: 15 digits are needed
_LOG = logging.getLogger(__name__)


def read_key(path: Path) -> bytes:
    """Return the 32-byte key of a key file.

    Raises:
        InputError: it is missing, readable by others, or empty.
    """
    text = read_secret(path, "the signing key", f"check the path, or make one: companion key new {path}")
    if re.fullmatch(r"[0-9a-fA-F]{64}", text):
        return bytes.fromhex(text)
    if not text:
        raise InputError(str(path), "", "the signing key is empty", "write 64 hex digits or a passphrase")
    return hashlib.sha256(text.encode("utf-8")).digest()


def make_key(path: Path, passphrase: str = "") -> None:
    """Write a new key that only its owner can read: a random one, or the passphrase's.

    Raises:
        InputError: there is something at ``path`` already, or it cannot be written.
    """
    try:
        fd = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_CLOEXEC, 0o600)
        try:
            os.write(fd, f"{passphrase.strip() or secrets.token_hex(32)}\n".encode())
            os.fsync(fd)
        except OSError:
            path.unlink()  # half a key is none, and would stand in the way of the next
            raise
        finally:
            os.close(fd)
        Disk().sync_folder(path.parent)
    except FileExistsError:
        raise InputError(
            str(path), "", "is there already", "a key may be in use and is not written over: choose another"
        ) from None
    except OSError as error:
        raise InputError(str(path), "", f"cannot be written ({reason(error)})", "choose another place") from error


class SigningStore:
    """The signing state of one link and the file that its timestamp survives in."""

    def __init__(self, key_file: Path, unix_s: float) -> None:
        self._path = key_file.with_name(key_file.name + ".timestamp")
        stored, damage = _stored(self._path)
        clock = min(max(0, int((unix_s - EPOCH_S) * TICKS_PER_S)), _MOST_STORED)
        self.state = SigningState(key=read_key(key_file), link_id=0, timestamp=max(clock, stored))
        self._clock = clock if stored - clock < int(NO_CLOCK_S * TICKS_PER_S) else stored
        self._zero_s: float | None = None
        self._stored = 0
        self.save()
        if damage:
            _LOG.warning(
                "%s: %s: frames are signed by this computer's clock, and it is written anew; if the autopilot does not "
                "answer, that clock is behind the last frame that it took: set it right, or take the key off over USB "
                "and put it on again (companion key remove, set)",
                self._path,
                damage,
            )

    def follow(self, now_s: float) -> int:
        """Return the clock's timestamp at ``now_s``, of whatever clock runs on since the first call [s]."""
        if self._zero_s is None:
            self._zero_s = now_s - self._clock / TICKS_PER_S
        self._clock = max(self._clock, int((now_s - self._zero_s) * TICKS_PER_S))
        return self._clock

    def save(self) -> None:
        """Store the timestamp if what is stored is about to be reached, by the clock or by frames."""
        clock, used = self._clock + int(AHEAD_S * TICKS_PER_S), self.state.timestamp + int(SPARE_S * TICKS_PER_S)
        if max(clock - int(AHEAD_S * TICKS_PER_S) // 2, used - int(SPARE_S * TICKS_PER_S) // 2) < self._stored:
            return
        ahead = max(clock, used)
        # A disk that cannot keep it must not end a voyage: frames are signed all the same, and it is tried again.
        with contextlib.suppress(OSError):
            Disk().replace(self._path, str(ahead).encode("ascii"))
            self._stored = ahead


def _stored(path: Path) -> tuple[int, str]:
    """Return the timestamp in a file, 0 without one, and why what is there is not used, empty: it is."""
    try:
        text = read_regular(path, _MOST_BYTES, follows_links=False).strip()
    except FileNotFoundError:
        return 0, ""  # the first start with this key
    except OSError as error:
        return 0, f"cannot be read ({reason(error)})"
    if not re.fullmatch(rb"[0-9]{1,20}", text) or int(text) > _MOST_STORED:
        return 0, f"holds {text[:20]!r}, which is no timestamp of a signature"
    return int(text), ""
