"""The view as Signal K, and the server that is told of it: full paths of the specification, SI units, alarms.

What the companion knows of the wind is against the ground (``speedOverGround``, ``angleTrueGround``): it has no speed
through the water. What is not known is not told; what is known no more is told once as null.

A server that does not take what it is sent says nothing of it. So over the WebSocket one value is asked back until
a new one is heard: what does not come back was not taken.
"""

from __future__ import annotations

import asyncio
import contextlib
import json
import logging
import math
import re
from collections.abc import Mapping
from typing import Any

from companion.addresses import OutputName
from companion.clock import effort_s
from companion.errors import InputError
from companion.geo.frame import LocalFrame
from companion.outputs.nmea import UNTRUSTED, course_of, is_fresh, place_of
from companion.outputs.outlet import Outlet, Say
from companion.program.commands import install
from companion.safety import TABLE
from companion.view import View
from companion.view.values import AlarmView, PointEn

# As $source: into a source with a label a server puts a label of its own.
LABEL = "sailboat-companion"
BATTERY = "electrical.batteries.autopilot"
# Alarms for which the specification has a name of its own; the others are under notifications.companion.
KNOWN = {dog.name: dog.notification for dog in TABLE if dog.notification}
STATES = {"critical": "emergency", "error": "alarm", "warning": "warn", "notice": "alert"}
LOUD = frozenset({"emergency", "alarm"})

Values = dict[str, Any]


def values_of(view: View, frame: LocalFrame) -> Values:
    """Return what is known by its path; places in the view are metres in ``frame``."""
    values: Values = {
        **_motion(view),
        **_wind(view),
        **_water(view),
        **_course(view, frame),
        **_performance(view),
        **_helm(view),
        # the loudest come first in the view, and are the last to be written
        **{path: value for alarm in reversed(view.alarms) for path, value in _notification(alarm).items()},
    }
    return {path: value for path, value in values.items() if value is not None}


def delta(values: Values, told: Mapping[str, Any]) -> dict[str, Any]:
    """Return the update for a server that was ``told`` values before; alarms only where they have changed."""
    news = [
        {"path": path, "value": value}
        for path, value in values.items()
        if not path.startswith("notifications.") or told.get(path) != value
    ]
    news += [{"path": path, "value": _over(path)} for path in told if path not in values and told[path] is not None]
    return {"context": "vessels.self", "updates": [{"$source": LABEL, "values": news}]}


def sent_after(values: Values, told: Mapping[str, Any]) -> Values:
    """Return what the server has been told behind an update; None: that it is over."""
    return {**dict.fromkeys(told), **values}


def _over(path: str) -> dict[str, Any] | None:
    if not path.startswith("notifications."):
        return None
    return {"state": "normal", "method": [], "message": "over"}


def _motion(view: View) -> Values:
    boat, place = view.boat, place_of(view)
    if place is None:
        return {}
    return {
        "navigation.position": {"latitude": place.lat_deg, "longitude": place.lon_deg},
        "navigation.speedOverGround": boat.sog_mps,
        "navigation.courseOverGroundTrue": _rad(boat.cog_deg),
        "navigation.headingTrue": _rad(boat.heading_deg),
        "navigation.attitude": None
        if boat.roll_deg is None
        else {"roll": math.radians(boat.roll_deg), "pitch": None, "yaw": None},
    }


def _wind(view: View) -> Values:
    wind = view.wind
    if wind is None or wind.health in UNTRUSTED or not is_fresh(wind.age_s):
        return {}
    moves = is_fresh(view.boat.age_s)  # an angle at the bow is as old as the heading
    return {
        "environment.wind.directionTrue": _rad(wind.twd_from_deg),
        "environment.wind.speedOverGround": wind.tws_mps,
        "environment.wind.angleTrueGround": _rad(wind.twa_deg) if moves else None,
        "environment.wind.angleApparent": _rad(wind.awa_deg) if moves else None,
        "environment.wind.speedApparent": wind.aws_mps if moves else None,
    }


def _water(view: View) -> Values:
    water = view.water
    if water is None or not water.is_planned:
        return {}
    return {
        "environment.current": {"setTrue": _rad(water.set_deg), "drift": water.drift_mps},
        "environment.wind.speedTrue": water.tws_mps,
    }


def _course(view: View, frame: LocalFrame) -> Values:
    course = course_of(view)
    if course is None:
        return {}
    way = "navigation.courseGreatCircle"
    closing = course.closing_mps
    return {
        f"{way}.crossTrackError": course.right_m,
        f"{way}.bearingTrackTrue": course.leg_rad,
        f"{way}.previousPoint.position": _place(frame, course.start_en_m),
        f"{way}.nextPoint.position": _place(frame, course.end_en_m),
        f"{way}.nextPoint.distance": course.distance_m,
        f"{way}.nextPoint.bearingTrue": course.bearing_rad,
        f"{way}.nextPoint.velocityMadeGood": closing,
        f"{way}.nextPoint.timeToGo": course.distance_m / closing if closing is not None and closing > 0.1 else None,
    }


def _performance(view: View) -> Values:
    boat, wind, polar = view.boat, view.wind, view.polar
    if not is_fresh(boat.age_s) or wind is None or wind.health in UNTRUSTED or not is_fresh(wind.age_s):
        return {}
    course = course_of(view)
    speed = None if polar is None or wind.twa_deg is None else polar.at_mps(wind.twa_deg)
    return {
        "performance.velocityMadeGood": boat.vmg_mps,
        "performance.velocityMadeGoodToWaypoint": None if course is None else course.closing_mps,
        "performance.polarSpeed": speed,
        "performance.polarSpeedRatio": boat.sog_mps / speed if boat.sog_mps is not None and speed else None,
        "performance.beatAngle": None if polar is None else _rad(polar.beat_deg),
        "performance.gybeAngle": None if polar is None else _rad(polar.run_deg),
        "performance.tackTrue": None
        if wind.twd_from_deg is None or wind.twa_deg is None
        else math.radians((wind.twd_from_deg + wind.twa_deg) % 360.0),
    }


def _helm(view: View) -> Values:
    state, boat = view.state, view.boat
    steers = {"AUTO": "route", "GUIDED": "auto"}
    return {
        "navigation.state": "sailing" if state.is_sailing else None,
        "steering.autopilot.state": None
        if state.mode is None
        else steers.get(state.mode, "standby")
        if state.is_armed
        else "standby",
        f"{BATTERY}.voltage": boat.battery_v,
        f"{BATTERY}.capacity.stateOfCharge": boat.battery_share,
    }


def _notification(alarm: AlarmView) -> Values:
    state = STATES.get(alarm.level)
    if state is None:
        return {}
    words = re.findall(r"[A-Za-z0-9]+", alarm.code) or ["alarm"]
    name = KNOWN.get(alarm.code, "companion." + words[0].lower() + "".join(word.capitalize() for word in words[1:]))
    return {
        f"notifications.{name}": {
            "state": state,
            "method": ["visual", "sound"] if state in LOUD else ["visual"],
            "message": f"{alarm.code}: {alarm.text}" if alarm.text else alarm.code,
        }
    }


def _place(frame: LocalFrame, en_m: PointEn) -> dict[str, float]:
    point = frame.geo_from_en(*en_m)
    return {"latitude": round(point.lat_deg, 7), "longitude": round(point.lon_deg, 7)}


def _rad(angle_deg: float | None) -> float | None:
    return None if angle_deg is None else round(math.radians(angle_deg), 4)


OPEN_S = 10.0  # for a connection to stand
STUCK_S = 20.0  # a server that takes nothing for so long is given up
ECHO_S = 15.0  # what we told comes back within this
ECHO_EVERY_MS = 2_000
ECHO = "navigation.position"
NOT_TAKEN = "it takes nothing from us: give a token with the right to write (--signalk-token FILE)"
REFUSED = frozenset({401, 403})


class TcpSignalK(Outlet[Values]):
    """Deltas as lines of JSON to a server's TCP port (8375), which takes them only where its security is off."""

    def __init__(self, name: OutputName, say: Say, *, seed: int = 0) -> None:
        super().__init__(f"Signal K {name.text}", say, seed=seed)
        self._address = (name.host, name.port)

    async def serve(self) -> None:
        """Connect and tell until the server goes."""
        async with asyncio.timeout(OPEN_S):
            reader, writer = await asyncio.open_connection(*self._address, limit=65_536)
        heard = asyncio.create_task(_drain(reader))
        self.became("connected", is_open=True)
        told: Values = {}
        try:
            while not heard.done():
                values = await _unless(heard, self.slot.take())
                if values is None:
                    return
                writer.write(json.dumps(delta(values, told)).encode() + b"\r\n")
                async with asyncio.timeout(STUCK_S):
                    await writer.drain()
                told = sent_after(values, told)
                self.sent += 1
        finally:
            heard.cancel()
            writer.transport.abort()


class WebSocketSignalK(Outlet[Values]):
    """Deltas over the server's stream. ``token`` is a JSON web token of the server's, empty where it asks for none."""

    def __init__(self, name: OutputName, say: Say, *, token: str = "", seed: int = 0) -> None:
        super().__init__(f"Signal K {name.text}", say, seed=seed)
        self._url, self._token = name.url, token
        self.is_taken: bool | None = None  # by the server; None: not known yet

    async def serve(self) -> None:
        """Connect and tell until the server goes."""
        from websockets.asyncio.client import connect
        from websockets.exceptions import InvalidStatus, WebSocketException

        quiet = logging.getLogger("companion.outputs.websocket")
        quiet.setLevel(logging.CRITICAL)
        headers = {"Authorization": f"Bearer {self._token}"} if self._token else {}
        try:
            async with connect(
                self._url,
                additional_headers=headers,
                compression=None,
                open_timeout=OPEN_S,
                close_timeout=1.0,
                max_queue=4,
                max_size=1 << 20,
                write_limit=65_536,
                logger=quiet,
                proxy=None,
                user_agent_header=None,
            ) as socket:
                await self._tell(socket)
        except InvalidStatus as error:
            status = error.response.status_code
            raise OSError(
                f"it refuses our token ({status}): make a new one"
                if status in REFUSED and self._token
                else f"it wants a token ({status}): --signalk-token FILE"
                if status in REFUSED
                else f"no Signal K stream is there (HTTP {status})"
            ) from error
        except WebSocketException as error:
            raise OSError(str(error) or type(error).__name__) from error

    async def _tell(self, socket: Any) -> None:
        asked_s, self.is_taken = None, None
        told: Values = {}
        heard = asyncio.create_task(self._hear(socket))
        self.became("connected", is_open=True)
        await socket.send(
            json.dumps(
                {"context": "vessels.self", "subscribe": [{"path": ECHO, "period": ECHO_EVERY_MS, "policy": "fixed"}]}
            )
        )
        try:
            while not heard.done():
                values = await _unless(heard, self.slot.take())
                if values is None:
                    break
                async with asyncio.timeout(STUCK_S):
                    await socket.send(json.dumps(delta(values, told)))
                told = sent_after(values, told)
                self.sent += 1
                if asked_s is None and ECHO in told:
                    asked_s = effort_s()  # of the server's time: beside a hurried simulator it is not ours
                if self.is_taken is None and asked_s is not None and effort_s() - asked_s > ECHO_S:
                    self.is_taken = False
                    self.became(NOT_TAKEN, is_open=True)
        finally:
            heard.cancel()

    async def _hear(self, socket: Any) -> None:
        """Read what comes, so that it never waits, and look for ourselves in it."""
        heard: set[str] = set()  # when what we told was taken: a server keeps the last of an earlier voyage
        async for message in socket:
            if self.is_taken:
                continue
            with contextlib.suppress(ValueError, AttributeError, TypeError):
                updates = json.loads(message).get("updates", ())
                heard |= {str(update["timestamp"]) for update in updates if update.get("$source") == LABEL}
            if len(heard) > 1:
                self.is_taken = True
                self.became("connected, and it takes what it is told", is_open=True)
                await socket.send(json.dumps({"context": "*", "unsubscribe": [{"path": "*"}]}))


def require_websockets() -> None:
    """Raise InputError where the library for WebSockets is not installed."""
    try:
        import websockets  # noqa: F401 - looked for, not used
    except ImportError:
        raise InputError(
            "--signalk",
            "",
            "ws:// needs a library that is not installed",
            f"{install('signalk')}, or name the server's TCP port",
        ) from None


async def _drain(reader: asyncio.StreamReader) -> None:
    while await reader.read(4096):
        pass


async def _unless(ended: asyncio.Task[None], coming: Any) -> Any:
    """Return what is coming, None when the other end hung up before."""
    waiting = asyncio.ensure_future(coming)
    try:
        await asyncio.wait({ended, waiting}, return_when=asyncio.FIRST_COMPLETED)
        return waiting.result() if waiting.done() else None
    finally:
        waiting.cancel()
