"""Depth sentences to pings: DPT and DBT of any talker, checked, in metres below the transducer.

DPT says where the transducer lies, too: its offset is positive to the water's surface, negative to the keel. DBT says
the same depth in feet, metres and fathoms; those that are there must agree.
"""

from __future__ import annotations

import math

from companion.messages import Sounding
from companion.traffic.nmea import DecodeCounts, whole_sentence

FOOT_M, FATHOM_M = 0.3048, 1.8288
ALIKE_M, ALIKE_SHARE = 0.2, 0.02  # figures of one depth in several units are rounded, each by itself
MOST_M = 12_000.0
MOST_OFFSET_M = 20.0
DPT_S = 5.0  # so long after a DPT the DBT beside it is the same ping once more


class SoundingDecoder:
    """Sentences to pings; of an instrument that says one ping as DPT and as DBT the first is taken."""

    def __init__(self) -> None:
        self.counts = DecodeCounts()
        self._dpt_s = -math.inf

    def feed(self, line: str | bytes, t_s: float) -> Sounding | None:
        """Return the ping of a sentence that came at ``t_s``, None for any other. Never raises."""
        counts, text = self.counts, whole_sentence(line, "$", self.counts)
        if text is None:
            return None
        name, *fields = text[1:].partition("*")[0].split(",")
        if len(name) != 5 or name[0] == "P" or name[2:] not in {"DPT", "DBT"}:  # P: of one maker
            counts.other += 1
            return None
        try:
            ping = _dpt(fields, t_s) if name[2:] == "DPT" else _dbt(fields, t_s)
        except ValueError:
            counts.bad_payload += 1
            return None
        if name[2:] == "DPT":
            self._dpt_s = t_s
        elif t_s - self._dpt_s <= DPT_S:
            return None
        counts.reports += 1
        return ping

    def json(self, data: bytes, t_s: float) -> None:
        """Return None: no sounder speaks JSON."""


def _number(text: str, most: float) -> float | None:
    """Return a field's number, None of an empty one. Raises ValueError."""
    if not text.strip():
        return None
    number = float(text)
    if not abs(number) <= most:
        raise ValueError(text)
    return number


def _dpt(fields: list[str], t_s: float) -> Sounding:
    if len(fields) > 3:  # a decimal comma makes two of one
        raise ValueError("too many fields")
    depth_m, offset_m, most_m = (
        _number(text, most) for text, most in zip([*fields, "", "", ""], (MOST_M, MOST_OFFSET_M, MOST_M), strict=False)
    )
    if depth_m is not None and depth_m < 0.0:
        raise ValueError("below zero")
    return Sounding(t_s=t_s, depth_m=depth_m, offset_m=offset_m or None, most_m=most_m or math.inf)


def _dbt(fields: list[str], t_s: float) -> Sounding:
    told = dict(zip((unit.strip() for unit in fields[1::2]), fields[0::2], strict=False))
    depths_m = [
        number * unit_m
        for unit, unit_m in (("M", 1.0), ("f", FOOT_M), ("F", FATHOM_M))
        if (number := _number(told.get(unit, ""), MOST_M / unit_m)) is not None
    ]
    if not depths_m:
        return Sounding(t_s=t_s)
    if min(depths_m) < 0.0 or max(depths_m) - min(depths_m) > ALIKE_M + ALIKE_SHARE * max(depths_m):
        raise ValueError("its figures are of different depths")
    return Sounding(t_s=t_s, depth_m=depths_m[0])


def below_transducer_m(ping: Sounding, draft_m: float | None, transducer_m: float) -> float | None:
    """Return a ping as from where the mission says that the transducer lies [m]; None: no echo.

    What the instrument itself says of that (``offset_m``) counts more than the mission: to the surface, or to the keel,
    which lies ``draft_m`` deep.
    """
    if ping.depth_m is None or ping.offset_m is None:
        return ping.depth_m
    if ping.offset_m < 0.0 and draft_m is None:
        return ping.depth_m
    lies_m = ping.offset_m if ping.offset_m > 0.0 else max(0.0, (draft_m or 0.0) + ping.offset_m)
    return ping.depth_m + lies_m - transducer_m
