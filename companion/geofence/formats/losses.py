"""What a format cannot carry: every writer says what is lost, before anyone relies on the file."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import shapely
from shapely.geometry import Polygon

from companion.geofence.document import Code, Document, Finding, FindingLevel
from companion.geofence.shapes import CIRCLE_SIDES, Circle, Zone, ZoneKind, drawn
from companion.words import counted


@dataclass(frozen=True, slots=True)
class Written:
    """A file to be: its bytes and what they do not carry.

    A finding of severity ERROR means that the file protects less than the document (a zone is missing); WARNING
    that a mission, track or mark is missing; NOTE that something is written otherwise (circles drawn, names gone).
    """

    data: bytes
    losses: tuple[Finding, ...] = ()

    @property
    def is_empty(self) -> bool:
        """Whether nothing of the document would be in the file."""
        return any(loss.code is Code.EMPTY for loss in self.losses)


# What a document holds that is worth a file, and what each is called.
_WORDS = {
    "zones": "zone",
    "marks": "point or line obstacle",
    "items": "mission",
    "rally": "rally point",
    "tracks": "track",
    "home": "home",
    "return": "return point",
}
_FIELDS = {"return": "return_point"}


class Losses(list[Finding]):
    """The losses of one writing."""

    def add(self, severity: FindingLevel, text: str, remedy: str = "") -> None:
        """Append one loss."""
        self.append(Finding(severity=severity, code=Code.NOT_CARRIED, place="", text=text, remedy=remedy))

    def drop(
        self, what: str, count: int, *, severity: FindingLevel = FindingLevel.WARNING, why: str = "", remedy: str = ""
    ) -> None:
        """Say that ``count`` things, ``what`` in the singular, are not carried."""
        if count:
            lost = f"{counted(count, what)} {'is' if count == 1 else 'are'} not carried by this format"
            self.add(severity, f"{lost} ({why})" if why else lost, remedy)


def leave_out(losses: Losses, document: Document, carried: Iterable[str]) -> None:
    """Announce everything in the document that a format which carries only ``carried`` leaves out.

    Words: zones, marks, items, rally, return, home, tracks, names, margins.
    """
    kept = set(carried)
    if not any(getattr(document, _FIELDS.get(what, what)) for what in _WORDS if what in kept):
        words = ", ".join(_WORDS[what] for what in _WORDS if what in kept)
        losses.append(
            Finding(
                severity=FindingLevel.ERROR,
                code=Code.EMPTY,
                place="",
                text=f"would hold nothing: the source has no {words}",
            )
        )
    if "zones" not in kept:
        losses.drop("zone", len(document.zones), severity=FindingLevel.ERROR)
    if "marks" not in kept:
        losses.drop(
            "point or line obstacle",
            len(document.marks),
            severity=FindingLevel.ERROR,
            remedy="say --point-radius M to draw them",
        )
    if "items" not in kept:
        losses.drop("mission item", len(document.items))
    if "rally" not in kept:
        losses.drop("rally point", len(document.rally))
    if "tracks" not in kept:
        losses.drop("track", len(document.tracks))
    if "return" not in kept and document.return_point is not None:
        losses.add(FindingLevel.WARNING, "the fence's return point is not carried by this format")
    if "home" not in kept and document.home is not None:
        losses.add(FindingLevel.NOTE, "the home position is not carried by this format")
    if "zones" in kept and "names" not in kept and any(z.name for z in document.zones):
        losses.add(FindingLevel.NOTE, "the names of zones are not carried by this format")
    if "items" in kept and "item names" not in kept and any(document.item_names):
        losses.add(FindingLevel.NOTE, "the names of waypoints are not carried by this format")
    if "margins" not in kept and any(z.margin_m is not None for z in document.zones):
        losses.add(FindingLevel.WARNING, "the zones' own margins are not carried by this format")


def as_polygon(zone: Zone, losses: Losses) -> Polygon:
    """Return the zone as a polygon; a circle is drawn, and that is announced."""
    if isinstance(zone.shape, Circle):
        side = "around" if zone.kind is ZoneKind.EXCLUSION else "inside"
        losses.add(
            FindingLevel.NOTE,
            f"the circle {zone.name or 'of ' + format(zone.shape.radius_m, 'g') + ' m'} is drawn as "
            f"{CIRCLE_SIDES} sides {side} it",
        )
    return drawn(zone)


def without_holes(zones: Sequence[Zone], losses: Losses) -> list[Zone]:
    """Return the zones for a format without holes, so that the sea does not grow.

    A keep-in zone with holes becomes the zone and a keep-out zone for each hole, a keep-out zone with holes is cut into
    pieces without any: the same water, announced.
    """
    out: list[Zone] = []
    for zone in zones:
        if isinstance(zone.shape, Circle) or not zone.shape.interiors:
            out.append(zone)
            continue
        holes, name = counted(len(zone.shape.interiors), "hole"), zone.name or "a zone"
        if zone.kind is ZoneKind.INCLUSION:
            out.append(filled(zone))
            out.extend(
                Zone(
                    kind=ZoneKind.EXCLUSION,
                    shape=Polygon(ring),
                    name=f"{zone.name} hole {i + 1}".strip(),
                    margin_m=zone.margin_m,
                )
                for i, ring in enumerate(zone.shape.interiors)
            )
            losses.add(FindingLevel.NOTE, f"{holes} of {name}: a keep-out zone for each")
        else:
            pieces = _cut(zone.shape)
            out.extend(replace(zone, shape=piece) for piece in pieces)
            losses.add(
                FindingLevel.NOTE,
                f"{name} is cut into {counted(len(pieces), 'piece')}, whose water is the same: {holes}",
            )
    return out


def filled(zone: Zone) -> Zone:
    """Return a zone without its holes."""
    return zone if isinstance(zone.shape, Circle) else replace(zone, shape=Polygon(zone.shape.exterior))


def _cut(polygon: Polygon) -> list[Polygon]:
    """Return the pieces without holes that a polygon falls into, cut through each of its holes from south to north."""
    if not polygon.interiors:
        return [polygon]
    west, south, east, north = polygon.bounds
    inside = sorted(shapely.point_on_surface(Polygon(ring)).x for ring in polygon.interiors)
    at = inside[len(inside) // 2]
    halves = [shapely.intersection(polygon, shapely.box(w, south, e, north)) for w, e in ((west, at), (at, east))]
    return [piece for part in shapely.get_parts(halves) if part.area > 0.0 for piece in _cut(part)]
