"""What MAVSDK calls a link, an item of a list, and a failure, and what we call them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from companion.messages import Command, GeoPoint, MissionItem, MissionType

NAMES = {MissionType.MISSION: "mission", MissionType.FENCE: "fence", MissionType.RALLY: "rally"}


def mavsdk_url(link: str) -> str:
    """Return MAVSDK's words for a LINK. Raises InputError.

    >>> mavsdk_url("tcp:127.0.0.1:5760")
    'tcpout://127.0.0.1:5760'
    """
    from companion.mavlink.transports import parse_link

    name = parse_link(link)
    if name.kind == "serial":
        return f"serial://{name.device}:{name.baud}"
    kind = {"tcp": "tcpout"}.get(name.kind, name.kind)
    return f"{kind}://{name.host}:{name.port}"


def home_item(items: Sequence[MissionItem], home: GeoPoint | None) -> MissionItem:
    """Return item 0 of a mission: home, else the first place of the list."""
    point = home or next((i.point for i in items if i.lat_e7 or i.lon_e7), GeoPoint(lat_deg=0.0, lon_deg=0.0))
    return MissionItem(command=Command.NAV_WAYPOINT, lat_e7=round(point.lat_deg * 1e7),
                       lon_e7=round(point.lon_deg * 1e7), frame=0)


def to_mavsdk(number: int, item: MissionItem, kind: MissionType) -> Any:
    """Return an item as MAVSDK has it."""
    from mavsdk.plugins.mission_raw import MissionItem as RawItem

    p1, p2, p3, p4 = item.params
    return RawItem(number, item.frame, int(item.command), int(number == 0), int(item.autocontinue), p1, p2, p3, p4,
                   item.lat_e7, item.lon_e7, item.alt_m, int(kind))


def from_mavsdk(item: Any) -> MissionItem:
    """Return an item of MAVSDK's as ours."""
    params = tuple(float(p) if p == p else 0.0 for p in (item.param1, item.param2, item.param3, item.param4))  # noqa: PLR0124
    return MissionItem(
        command=int(item.command), lat_e7=int(item.x), lon_e7=int(item.y), alt_m=float(item.z), frame=int(item.frame),
        params=(params[0], params[1], params[2], params[3]), autocontinue=bool(item.autocontinue),
    )


def words(result: object) -> str:
    """Return a result of MAVSDK in plain words."""
    inner = getattr(result, "result", getattr(result, "_result", result))
    name = getattr(inner, "name", None)
    return str(name).lower().replace("_", " ") if name else str(result).split("\n", maxsplit=1)[0]
