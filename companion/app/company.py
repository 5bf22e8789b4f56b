"""Who else is on the link: neighbours of our autopilot, and a second companion."""

from __future__ import annotations

import asyncio
from dataclasses import dataclass

from companion.errors import LinkError
from companion.mavlink.link import Link
from companion.mavlink.trust import LISTEN_S, OWN_COMPONENT, type_words, yields_to


@dataclass(frozen=True, slots=True, kw_only=True)
class Others:
    """Who else is heard: autopilots in words, where ours has no name, a companion at work, a ground station."""

    neighbours: tuple[str, ...] = ()
    has_company: bool = False
    has_shore: bool = False

    def to_record(self) -> dict[str, object]:
        """Return it as a record of the voyage."""
        return {"kind": "others", "neighbours": list(self.neighbours), "company": self.has_company,
                "shore": self.has_shore}


NOBODY = Others()


async def make_way(link: Link, *, named: int | None, token: int) -> None:
    """Listen for another companion on our autopilot, and give way to one that is at work.

    Raises:
        LinkError: there is one.
    """
    if named is not None:
        await asyncio.sleep(LISTEN_S)   # without a name the link has listened this long already
    other = link.other_companion()
    if other is not None and yields_to(token, other):
        raise LinkError(
            f"{link.transport.name}: another companion is at work on this boat (component {OWN_COMPONENT} of "
            f"system {link.party.target_system}): stop it first, two would give her different orders")


def others_on(link: Link, *, named: int | None) -> Others:
    """Return who else is heard at present."""
    other = link.other_companion()
    return Others(
        neighbours=() if named is not None else tuple(
            f"system {s.system}, {type_words(s.vehicle_type)}" for s in link.neighbours()),
        has_company=other is not None and not other.is_starting, has_shore=link.hears_station)
