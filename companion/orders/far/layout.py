"""Fields of a message of a few bytes: where each is, its step, and what says that it is not known.

Little-endian, without gaps. A value that does not fit is told as the nearest that does: never as another one, never as
unknown. What is not known has a number of its own, which is never 0.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

EPOCH_S = 1_577_836_800      # 2020-01-01T00:00:00Z: minutes in three bytes from here on last until 2051


@dataclass(frozen=True, slots=True, kw_only=True)
class BitField:
    """One field: ``size`` bytes; ``step`` of one count, in the SI unit of the value; ``unit`` is what the table says.

    ``unknown``: the count for a value that is not known, None: it always is. ``circle``: so many counts make a turn.
    """

    name: str
    size: int
    says: str
    step: float = 1.0
    unit: str = ""
    unknown: int | None = None
    is_signed: bool = False
    circle: int | None = None

    @property
    def limits(self) -> tuple[int, int]:
        """The least and the greatest count."""
        bits = 8 * self.size
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if self.is_signed else (0, (1 << bits) - 1)
        return low + (self.unknown == low), high - (self.unknown == high)

    def count(self, value: float | None) -> int:
        """Return a value as a count: the nearest that there is."""
        if value is None:
            assert self.unknown is not None
            return self.unknown
        count = round(value / self.step)
        if self.circle is not None:
            return count % self.circle
        low, high = self.limits
        return max(low, min(high, count))

    def value(self, count: int) -> float | None:
        """Return the value of a count."""
        return None if count == self.unknown else count * self.step


@dataclass(frozen=True, slots=True)
class Layout:
    """Fields one behind the other."""

    fields: tuple[BitField, ...]

    @property
    def size(self) -> int:
        """Bytes in all."""
        return sum(field.size for field in self.fields)

    def pack(self, counts: Mapping[str, int]) -> bytes:
        """Return the bytes of the counts, one for each field."""
        return b"".join(counts[f.name].to_bytes(f.size, "little", signed=f.is_signed) for f in self.fields)

    def unpack(self, data: bytes) -> dict[str, int]:
        """Return the counts in ``size`` bytes."""
        counts, at = {}, 0
        for field in self.fields:
            counts[field.name] = int.from_bytes(data[at:at + field.size], "little", signed=field.is_signed)
            at += field.size
        return counts

    def rows(self) -> Sequence[str]:
        """Return the rows of its table in the documentation."""
        rows, at = [], 0
        for field in self.fields:
            kind = f"{'i' if field.is_signed else 'u'}{8 * field.size}"
            unknown = "-" if field.unknown is None else str(field.unknown)
            rows.append(f"| {at} | {kind} | `{field.name}` | {field.unit or '-'} | {unknown} | {field.says} |")
            at += field.size
        return rows


def minutes_of(unix_s: float) -> int:
    """Return a moment in whole minutes since 2020 (UTC), the one that it is in."""
    return int((unix_s - EPOCH_S) // 60.0)


def unix_of(minutes: int) -> float:
    """Return the moment [s since 1970] at which a minute begins."""
    return EPOCH_S + 60.0 * minutes
