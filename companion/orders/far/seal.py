"""The authentication code behind every message from far away: eight bytes that only who has the key can make.

HMAC-SHA-256 (RFC 2104), cut to 64 bits, with a key of its own for each purpose and boat: what was sealed as a status or
for another system is no order of this one. The key file is that of ``companion key new``.
"""

from __future__ import annotations

import hashlib
import hmac
from dataclasses import dataclass, replace

SEAL_BYTES = 8
ORDER, STATUS, BEGINNING, NAME = "order", "status", "beginning", "name"   # purposes


@dataclass(frozen=True, slots=True, repr=False)
class FarKey:
    """A key of 32 bytes and the MAVLink system id of the boat that it is used for.

    ``began`` is the minute (since 2020) from which the counters of orders count, 0: from the first order with this key.
    It is in the code of every order: what was sealed before a beginning is none of those behind it.
    """

    key: bytes
    system: int
    began: int = 0

    @property
    def name(self) -> str:
        """A name of the key for files, which tells nothing of it."""
        return self._code(NAME, b"").hex()

    def since(self, began: int) -> FarKey:
        """Return the key as it seals orders since a beginning."""
        return replace(self, began=began)

    def sealed(self, purpose: str, body: bytes) -> bytes:
        """Return ``body`` with its code behind it."""
        return body + self._code(purpose, body)

    def opened(self, purpose: str, data: bytes, size: int) -> bytes:
        """Return the body, which with its code has ``size`` bytes.

        Raises:
            ValueError: it is of another length, or its code is not ours.
        """
        if len(data) != size:
            raise ValueError(f"it has {len(data)} bytes, and not {size}: no {purpose}")
        body, code = data[:-SEAL_BYTES], data[-SEAL_BYTES:]
        if not hmac.compare_digest(code, self._code(purpose, body)):
            older = f", or of before {BEGINNING} {self.began}" if purpose == ORDER and self.began else ""
            raise ValueError(f"its code is wrong: damaged, another key, or not system {self.system}'s{older}")
        return body

    def _code(self, purpose: str, body: bytes) -> bytes:
        since = f" began {self.began}" if purpose == ORDER and self.began else ""
        own = hmac.digest(
            self.key, f"companion far {purpose} 1 system {self.system}{since}".encode("ascii"), hashlib.sha256)
        return hmac.digest(own, body, hashlib.sha256)[:SEAL_BYTES]
