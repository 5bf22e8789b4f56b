"""QGroundControl .plan: mission, geofence and rally points in one JSON file; [latitude, longitude], rings open.

Sources: QGroundControl developer guide, *Plan file format*. Survey items (ComplexItem) are expanded to the items
that QGroundControl stored with them, or reported when it stored none.
"""

from __future__ import annotations

import json
from typing import Any

from companion.geofence.document import Code, Document, FindingLevel
from companion.geofence.formats.fence_items import ring_of
from companion.geofence.formats.losses import Losses, Written, leave_out, without_holes
from companion.geofence.formats.rings import Findings, polygons_from_rings
from companion.geofence.formats.untrusted import JsonNode, parse_json
from companion.geofence.shapes import MOST_RADIUS_M, Circle, Zone, ZoneKind
from companion.messages import Command, GeoPoint, MissionItem

_FIRMWARE_ARDUPILOT = 3
_VEHICLE_SURFACE_BOAT = 11
_ALTITUDE_MODE = {0: 2, 3: 1, 5: 2, 6: 1, 10: 4, 11: 4}  # MAV_FRAME -> QGroundControl's altitude mode


def read_plan(text: str, source: str) -> Document:
    """Return what a .plan holds. Raises InputError where it is no plan."""
    root = parse_json(text, source)
    kind = root.member("fileType").text()
    if kind != "Plan":
        raise root.member("fileType").fail(f"is {kind[:30]!r}, not 'Plan'", "save a plan in QGroundControl")
    findings = Findings()
    zones: list[Zone] = []
    items: list[MissionItem] = []
    home: GeoPoint | None = None
    rally: list[MissionItem] = []
    return_point: GeoPoint | None = None
    mission = root.get("mission")
    if mission is not None:
        home_node = mission.get("plannedHomePosition")
        home = _point(home_node, findings) if home_node is not None else None
        if home == GeoPoint(lat_deg=0.0, lon_deg=0.0):
            home = None  # that is how "not set" is written
        items = _items(mission, findings)
    fence = root.get("geoFence")
    if fence is not None:
        zones = _zones(fence, findings)
        breach = fence.get("breachReturn")
        return_point = _point(breach, findings) if breach is not None else None
    rally_node = root.get("rallyPoints")
    points = rally_node.get("points") if rally_node is not None else None
    for node in points or ():
        point = _point(node, findings)
        if point is not None:
            values = list(node)
            altitude_m = values[2].number() if len(values) > 2 else 0.0
            rally.append(
                MissionItem(
                    command=Command.NAV_RALLY_POINT,
                    lat_e7=round(point.lat_deg * 1e7),
                    lon_e7=round(point.lon_deg * 1e7),
                    alt_m=altitude_m,
                )
            )
    return Document(
        source=source,
        format="plan",
        zones=tuple(zones),
        items=tuple(items),
        home=home,
        rally=tuple(rally),
        return_point=return_point,
        findings=tuple(findings),
    )


def _point(node: JsonNode, findings: Findings) -> GeoPoint | None:
    values = list(node)
    if len(values) < 2:
        raise node.fail(f"a position has {len(values)} numbers, not 2 (latitude, longitude)")
    lat_deg, lon_deg = values[0].number(-1e6, 1e6), values[1].number(-1e6, 1e6)
    if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
        swapped = abs(lat_deg) <= 180.0 and abs(lon_deg) <= 90.0
        findings.add(
            FindingLevel.ERROR,
            Code.SWAPPED_AXES if swapped else Code.OUT_OF_RANGE,
            node.path,
            f"{lat_deg:g}, {lon_deg:g} is not on the globe",
            "a .plan writes latitude first",
        )
        return None
    return GeoPoint(lat_deg=lat_deg, lon_deg=lon_deg)


def _items(mission: JsonNode, findings: Findings) -> list[MissionItem]:
    """Return the mission items; DO_JUMP targets (doJumpId) become positions in the list, from 1."""
    items: list[MissionItem] = []
    ids: dict[int, int] = {}
    for node in mission.get("items") or ():
        kind_node = node.get("type")
        kind = kind_node.text() if kind_node is not None else "SimpleItem"
        if kind == "SimpleItem":
            simple = [node]
        else:
            simple = _expanded(node, findings)
        for item_node in simple:
            items.append(_simple_item(item_node, findings))
            jump_id = item_node.get("doJumpId")
            if jump_id is not None:
                ids[jump_id.integer(0, 65535)] = len(items)
    for index, item in enumerate(items):
        if item.command == Command.DO_JUMP:
            target = ids.get(int(item.params[0]))
            if target is None:
                findings.add(
                    FindingLevel.ERROR,
                    Code.FORMAT,
                    f"mission.items[{index}]",
                    f"jumps to item {item.params[0]:g}, which is not there",
                    "set the jump's target again",
                )
            elif target != item.params[0]:
                items[index] = MissionItem(
                    command=item.command,
                    lat_e7=item.lat_e7,
                    lon_e7=item.lon_e7,
                    alt_m=item.alt_m,
                    frame=item.frame,
                    params=(float(target), *item.params[1:]),
                    autocontinue=item.autocontinue,
                )
    return items


def _expanded(node: JsonNode, findings: Findings) -> list[JsonNode]:
    name_node = node.get("complexItemType")
    name = str(name_node.value) if name_node is not None else "complex item"
    inner = node.get("TransectStyleComplexItem")
    stored = inner.get("Items") if inner is not None else None
    stored = stored if stored is not None else node.get("Items")
    simple = [n for n in stored] if stored is not None else []  # noqa: C416 - iterating checks the list
    if simple:
        findings.add(FindingLevel.NOTE, Code.EXPANDED, node.path, f"the {name} is expanded to its {len(simple)} items")
    else:
        findings.add(
            FindingLevel.ERROR,
            Code.EXPANDED,
            node.path,
            f"the {name} has no stored items to expand",
            "open the plan in QGroundControl 4 and save it again, or replace the survey by waypoints",
        )
    return simple


def _simple_item(node: JsonNode, findings: Findings) -> MissionItem:
    command = node.member("command").integer(0, 0xFFFF)
    frame_node = node.get("frame")
    frame = frame_node.integer(0, 255) if frame_node is not None else 3
    raw = list(node.member("params"))
    if len(raw) < 7:
        raise node.member("params").fail(f"has {len(raw)} values, not 7")
    values = [0.0 if p.value is None else p.number() for p in raw[:7]]
    lat_deg, lon_deg = values[4], values[5]
    if abs(lat_deg) > 90.0 or abs(lon_deg) > 180.0:
        findings.add(
            FindingLevel.ERROR,
            Code.SWAPPED_AXES,
            node.path,
            f"{lat_deg:g}, {lon_deg:g} is not on the globe",
            "a .plan writes latitude first",
        )
        lat_deg = lon_deg = 0.0
    continues = node.get("autoContinue")
    return MissionItem(
        command=command,
        lat_e7=round(lat_deg * 1e7),
        lon_e7=round(lon_deg * 1e7),
        alt_m=values[6],
        frame=frame,
        params=(values[0], values[1], values[2], values[3]),
        autocontinue=continues.flag() if continues is not None else True,
    )


def _zones(fence: JsonNode, findings: Findings) -> list[Zone]:
    zones: list[Zone] = []
    for node in fence.get("polygons") or ():
        kind = ZoneKind.INCLUSION if node.member("inclusion").flag() else ZoneKind.EXCLUSION
        ring: list[tuple[float, float]] = []
        for vertex in node.member("polygon"):
            values = list(vertex)
            if len(values) < 2:
                raise vertex.fail(f"a position has {len(values)} numbers, not 2 (latitude, longitude)")
            ring.append((values[1].number(-1e6, 1e6), values[0].number(-1e6, 1e6)))
        zones.extend(
            Zone(kind=kind, shape=p) for p in polygons_from_rings([ring], kind, node.path, findings, closed=False)
        )
    for node in fence.get("circles") or ():
        kind = ZoneKind.INCLUSION if node.member("inclusion").flag() else ZoneKind.EXCLUSION
        circle = node.member("circle")
        center = _point(circle.member("center"), findings)
        radius_m = circle.member("radius").number(0.0, MOST_RADIUS_M)
        if radius_m <= 0.0:
            findings.add(FindingLevel.ERROR, Code.DEGENERATE, node.path, "the circle's radius is 0", "give it a radius")
        elif center is not None:
            zones.append(Zone(kind=kind, shape=Circle(center, radius_m)))
    return zones


def write_plan(document: Document) -> Written:
    """Return the document as a .plan for ArduPilot and a surface boat.

    Polygons and circles go into two lists, so their order among each other is not kept (it has no meaning).
    """
    losses = Losses()
    leave_out(losses, document, {"zones", "items", "rally", "return", "home"})
    polygons: list[dict[str, Any]] = []
    circles: list[dict[str, Any]] = []
    for zone in without_holes(document.zones, losses):
        inclusion = zone.kind is ZoneKind.INCLUSION
        if isinstance(zone.shape, Circle):
            center = [zone.shape.center.lat_deg, zone.shape.center.lon_deg]
            circles.append(
                {"version": 1, "inclusion": inclusion, "circle": {"center": center, "radius": zone.shape.radius_m}}
            )
        else:
            ring = [list(v) for v in ring_of(zone.shape)]
            polygons.append({"version": 1, "inclusion": inclusion, "polygon": ring})
    home = document.home
    if home is None and document.items:
        first = next((i for i in document.items if i.lat_e7 or i.lon_e7), None)
        home = first.point if first is not None else None
        if home is not None:
            losses.add(FindingLevel.NOTE, "the planned home is set to the first waypoint, for want of a home")
    fence: dict[str, Any] = {"version": 2, "circles": circles, "polygons": polygons}
    if document.return_point is not None:
        fence["breachReturn"] = [document.return_point.lat_deg, document.return_point.lon_deg, 0]
    plan = {
        "fileType": "Plan",
        "version": 1,
        "groundStation": "QGroundControl",
        "mission": {
            "version": 2,
            "firmwareType": _FIRMWARE_ARDUPILOT,
            "vehicleType": _VEHICLE_SURFACE_BOAT,
            "cruiseSpeed": 2,
            "hoverSpeed": 2,
            "globalPlanAltitudeMode": 1,
            "plannedHomePosition": [home.lat_deg, home.lon_deg, 0] if home is not None else [0, 0, 0],
            "items": [_plan_item(i + 1, item) for i, item in enumerate(document.items)],
        },
        "geoFence": fence,
        "rallyPoints": {"version": 2, "points": [[i.lat_e7 / 1e7, i.lon_e7 / 1e7, i.alt_m] for i in document.rally]},
    }
    return Written((json.dumps(plan, indent=1) + "\n").encode(), tuple(losses))


def _plan_item(number: int, item: MissionItem) -> dict[str, Any]:
    params = [*item.params, item.lat_e7 / 1e7, item.lon_e7 / 1e7, item.alt_m]
    return {
        "type": "SimpleItem",
        "doJumpId": number,
        "command": int(item.command),
        "frame": item.frame,
        "autoContinue": item.autocontinue,
        "AMSLAltAboveTerrain": None,
        "Altitude": item.alt_m,
        "AltitudeMode": _ALTITUDE_MODE.get(item.frame, 1),
        "params": params,
    }
