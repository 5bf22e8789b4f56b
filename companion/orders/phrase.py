"""Orders in words, as a person types them: ``hold``, ``refuge Bay``, ``goal 51.1 -1.3``."""

from __future__ import annotations

from collections.abc import Sequence

from companion.errors import InputError
from companion.orders.order import Place, Wanted
from companion.orders.verbs import BY_VERB, Verb, unknown, verb_named


def phrase(words: Sequence[str]) -> Wanted:
    """Return what the words want.

    Raises:
        InputError: no verb of ours, or not what it takes.

    >>> phrase(["goal", "51.1", "-1.3"]).words
    'goal 51.10000 -1.30000'
    """
    if not words:
        raise InputError("VERB", "", "is missing", f"there are {', '.join(Verb)}")
    verb = verb_named(words[0])
    if verb is None:
        said, _, remedy = unknown(words[0]).partition("; ")
        raise InputError(words[0][:40], "", said, remedy)
    rest = list(words[1:])
    if verb is Verb.REFUGE:
        number = int(rest[0]) if len(rest) == 1 and rest[0].isdecimal() and len(rest[0]) < 7 else 0
        return Wanted(verb=verb, number=number, name="" if number else " ".join(rest))
    if verb is Verb.GOAL:
        return Wanted(verb=verb, place=_place(rest))
    if rest:
        raise InputError(str(verb), "", f"takes nothing, and was given {' '.join(rest)[:40]!r}")
    return Wanted(verb=verb)


def _place(words: list[str]) -> Place:
    usage = f"write {Verb.GOAL} {BY_VERB[Verb.GOAL].takes} in degrees, as in goal 51.1234 -1.3456"
    parts = [part for word in words for part in word.split(",") if part]
    try:
        lat_deg, lon_deg = (float(part) for part in parts)
    except ValueError:
        raise InputError(Verb.GOAL, "", f"{' '.join(words)[:40]!r} is not a position", usage) from None
    place = Place(lat_deg=lat_deg, lon_deg=lon_deg)
    if place.trouble:
        raise InputError(Verb.GOAL, "", place.trouble, usage)
    return place
