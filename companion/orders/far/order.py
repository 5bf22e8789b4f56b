"""An order in 24 bytes: what is wanted, until when it counts, its counter, and the code of who has the key.

A beginning in 15 bytes: from then on the counters count from 1 again.
"""

from __future__ import annotations

from dataclasses import dataclass, field

from companion.orders.far.layout import BitField, Layout
from companion.orders.far.seal import BEGINNING, ORDER, SEAL_BYTES, FarKey
from companion.orders.order import Place, Wanted, mark_of
from companion.orders.verbs import BY_VERB, Verb, verb_of

VERSION = 1
MOST_COUNTER = 0xFFFF
MARK_BYTES = 4
LAYOUT = Layout((
    BitField(name="version", size=1, says=f"{VERSION}"),
    BitField(name="verb", size=1, says="its number, as in [orders](orders.md)"),
    BitField(name="number", size=1, says="of a refuge in the mission, 0: the nearest, or by `lat`; else 0"),
    BitField(name="expires", size=3, unit="min since 2020-01-01 UTC", says="from this moment on it counts for nothing"),
    BitField(name="counter", size=2, says="from 1, never twice since one beginning"),
    BitField(name="lat", size=4, is_signed=True, unit="1e-7 deg",
          says="of a goal; of a refuge the number of its name (`param3` in [orders](orders.md)) or 0; else 0"),
    BitField(name="lon", size=4, is_signed=True, unit="1e-7 deg", says="of a goal; else 0"),
))
SIZE = LAYOUT.size + SEAL_BYTES
BEGINNING_LAYOUT = Layout((
    BitField(name="version", size=1, says=f"{VERSION}"),
    BitField(name="began", size=3, unit="min since 2020-01-01 UTC",
             says="when it was given: later than every one before"),
    BitField(name="expires", size=3, unit="min since 2020-01-01 UTC", says="from this moment on it counts for nothing"),
))
BEGINNING_SIZE = BEGINNING_LAYOUT.size + SEAL_BYTES


@dataclass(frozen=True, slots=True, kw_only=True)
class FarOrder:
    """An order that was given with the key. It counts before the minute ``expires_min`` since 2020.

    ``mark`` is of its bytes, once there are any: two orders with one counter are told apart by it.
    """

    wanted: Wanted
    counter: int
    expires_min: int
    mark: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Beginning:
    """Counters begin anew at the minute ``began``. It counts before the minute ``expires_min``; both since 2020."""

    began: int
    expires_min: int


def pack_beginning(beginning: Beginning, key: FarKey) -> bytes:
    """Return a beginning's 15 bytes. Raises ValueError: it lies at no time."""
    try:
        return key.sealed(BEGINNING, BEGINNING_LAYOUT.pack(
            {"version": VERSION, "began": beginning.began, "expires": beginning.expires_min}))
    except OverflowError:
        raise ValueError("a moment is too far away for its field") from None


def unpack_beginning(data: bytes, key: FarKey) -> Beginning:
    """Return the beginning in 15 bytes.

    Raises:
        ValueError: it is none, or none of ours; the sentence says why.
    """
    counts = BEGINNING_LAYOUT.unpack(key.opened(BEGINNING, data, BEGINNING_SIZE))
    if counts["version"] != VERSION:
        raise ValueError(f"it is of version {counts['version']}, and this is {VERSION}: another release made it")
    return Beginning(began=counts["began"], expires_min=counts["expires"])


def pack_order(order: FarOrder, key: FarKey) -> bytes:
    """Return an order's 24 bytes.

    Raises:
        ValueError: it cannot be said so: no verb, a goal that is no place, a number that does not fit.
    """
    wanted = order.wanted
    if wanted.verb is None or wanted.fault:
        raise ValueError(wanted.fault or "nothing is wanted")
    if not 0 < order.counter <= MOST_COUNTER:
        raise ValueError(f"the counter {order.counter} is not in 1 to {MOST_COUNTER}")
    counts = {"version": VERSION, "verb": BY_VERB[wanted.verb].number, "number": 0, "expires": order.expires_min,
              "counter": order.counter, "lat": 0, "lon": 0}
    if wanted.verb is Verb.GOAL:
        if wanted.place is None or wanted.place.trouble:
            raise ValueError("a goal needs a position" if wanted.place is None else wanted.place.trouble)
        counts |= {"lat": round(wanted.place.lat_deg * 1e7), "lon": round(wanted.place.lon_deg * 1e7)}
    elif wanted.verb is Verb.REFUGE:
        counts |= {"number": wanted.number, "lat": mark_of(wanted.name) if wanted.name else wanted.mark}
    try:
        return key.sealed(ORDER, LAYOUT.pack(counts))
    except OverflowError:
        raise ValueError("a number is too large for its field") from None


def unpack_order(data: bytes, key: FarKey) -> FarOrder:
    """Return the order in 24 bytes.

    Raises:
        ValueError: it is none, or none of ours; the sentence says why.
    """
    counts = LAYOUT.unpack(key.opened(ORDER, data, SIZE))
    if counts["version"] != VERSION:
        raise ValueError(f"it is of version {counts['version']}, and this is {VERSION}: another release made it")
    verb = verb_of(counts["verb"])
    number, lat, lon = counts["number"], counts["lat"], counts["lon"]
    if verb is None:
        raise ValueError(f"there is no order {counts['verb']}")
    if counts["counter"] == 0:
        raise ValueError("its counter is 0")
    if (number and verb is not Verb.REFUGE) or (lat and verb not in {Verb.REFUGE, Verb.GOAL}) or (
        lon and verb is not Verb.GOAL) or (verb is Verb.REFUGE and lat < 0):
        raise ValueError(f"{verb} takes no such number or place")
    place = Place(lat_deg=lat / 1e7, lon_deg=lon / 1e7) if verb is Verb.GOAL else None
    mark = lat if verb is Verb.REFUGE else 0
    return FarOrder(wanted=Wanted(verb=verb, number=number, mark=mark, place=place), counter=counts["counter"],
                    expires_min=counts["expires"], mark=data[-MARK_BYTES:].hex())
