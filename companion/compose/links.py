"""Whom a mission hears and tells: other vessels, and other displays."""

from __future__ import annotations

from collections.abc import Callable

from companion.addresses import Displays, OutputName, parse_nmea, parse_signalk
from companion.errors import InputError
from companion.geofence import Mission
from companion.traffic import TargetLimits
from companion.traffic.feeds import parse_feed


def target_limits_of(mission: Mission) -> TargetLimits:
    """Return how long an unheard vessel is remembered."""
    return TargetLimits(expire_s=mission.traffic.drop_after_s)


def feeds_of(mission: Mission) -> tuple[str, ...]:
    """Return the names of the AIS feeds to open; the autopilot's own AIS ("mavlink") needs none.

    Raises:
        InputError: a name is not a feed.
    """
    names = tuple(name for name in mission.traffic.feeds if name != "mavlink")
    for name in names:
        try:
            parse_feed(name)
        except InputError as error:
            raise InputError(str(mission.path), "[traffic] feeds", f"{name!r} is not a feed", error.remedy) from error
    return names


def displays_of(mission: Mission) -> Displays:
    """Return the other displays that are told of the voyage.

    Raises:
        InputError: a name is none, or there is a token for nobody.
    """
    output = mission.output
    nmea, signalk = (_named(mission, *named) for named in (
        ("nmea", output.nmea, parse_nmea), ("signalk", output.signalk, parse_signalk)))
    if output.signalk_token is not None and all(name.kind == "tcp" for name in signalk):
        raise InputError(str(mission.path), "[output] signalk_token", "there is no WebSocket to use it on",
                         'name the server: signalk = ["ws://HOST:3000"]')
    token = None if output.signalk_token is None else mission.path.parent / output.signalk_token
    return Displays(nmea=nmea, signalk=signalk, token_file=token)


def _named(
    mission: Mission, key: str, names: tuple[str, ...], parse: Callable[[str], OutputName],
) -> tuple[OutputName, ...]:
    try:
        return tuple(parse(name) for name in dict.fromkeys(names))
    except InputError as error:
        raise InputError(str(mission.path), f"[output] {key}", f"{error.place!r} {error.problem}",
                         error.remedy) from error
