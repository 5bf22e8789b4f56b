"""Files with a secret in them: what only their owner may read is believed."""

from __future__ import annotations

import os
import stat
from pathlib import Path

from companion.disk import open_regular
from companion.errors import InputError, unreadable

MOST_BYTES = 65_536


def read_secret(path: Path, what: str, remedy: str) -> str:
    """Return the text of such a file, without the blanks around it.

    ``what`` is its name in a message, ``remedy`` what to do when it is not there.

    Raises:
        InputError: it cannot be read, is not text, or others may read it.
    """
    try:
        with open_regular(path) as file:
            mode, text = os.fstat(file.fileno()).st_mode, file.read(MOST_BYTES).decode("utf-8").strip()
    except OSError as error:
        raise unreadable(str(path), error, what, remedy) from error
    except UnicodeDecodeError as error:
        raise InputError(str(path), "", f"{what} is not text", remedy) from error
    if mode & (stat.S_IRWXG | stat.S_IRWXO):
        raise InputError(str(path), "", f"{what} can be read by others", f"chmod 600 {path}")
    return text
