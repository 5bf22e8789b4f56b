"""The autopilot's lists over a link, by MAVSDK: what fence and mission upload, download and compare with.

MAVSDK answers a dead link with empty lists and waits without saying so; here every wait has an end, a transfer
counts only if the autopilot was seen to take part in it, and a failure quotes what the autopilot said.
"""

from __future__ import annotations

import json
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from types import TracebackType
from typing import Any, Self

from companion.errors import LinkError, TransferError
from companion.messages import Command, GeoPoint, MissionItem, MissionType
from companion.words import counted

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
    return MissionItem(
        command=Command.NAV_WAYPOINT, lat_e7=round(point.lat_deg * 1e7), lon_e7=round(point.lon_deg * 1e7), frame=0
    )


def to_mavsdk(number: int, item: MissionItem, kind: MissionType) -> Any:
    """Return an item as MAVSDK has it."""
    from mavsdk.plugins.mission_raw import MissionItem as RawItem

    p1, p2, p3, p4 = item.params
    return RawItem(
        number,
        item.frame,
        int(item.command),
        int(number == 0),
        int(item.autocontinue),
        p1,
        p2,
        p3,
        p4,
        item.lat_e7,
        item.lon_e7,
        item.alt_m,
        int(kind),
    )


def from_mavsdk(item: Any) -> MissionItem:
    """Return an item of MAVSDK's as ours."""
    params = tuple(float(p) if p == p else 0.0 for p in (item.param1, item.param2, item.param3, item.param4))  # noqa: PLR0124
    return MissionItem(
        command=int(item.command),
        lat_e7=int(item.x),
        lon_e7=int(item.y),
        alt_m=float(item.z),
        frame=int(item.frame),
        params=(params[0], params[1], params[2], params[3]),
        autocontinue=bool(item.autocontinue),
    )


def words(result: object) -> str:
    """Return a result of MAVSDK in plain words."""
    inner = getattr(result, "result", getattr(result, "_result", result))
    name = getattr(inner, "name", None)
    return str(name).lower().replace("_", " ") if name else str(result).split("\n", maxsplit=1)[0]


OnProgress = Callable[[float], None]  # 0..1

CONNECT_TIMEOUT_S = 10.0
SILENCE_S = 8.0  # nothing of a transfer for this long: it is dead (ArduRover itself gives up after 8 s)
PARAM_TIMEOUT_S = 10.0


def find_system(link: str, timeout_s: float, system: int | None) -> int:
    """Return the system id of the autopilot on ``link``: as named, or the only one that is heard.

    MAVSDK takes the first autopilot that speaks, whosever it is; so this listens before.

    Raises:
        LinkError: nobody is heard, it cannot be told which is ours, or what is heard is no rover.
    """
    from companion.clock import run
    from companion.mavlink.link import Link
    from companion.mavlink.reception import SHORE
    from companion.mavlink.transports import open_link

    async def listen() -> int:
        async with Link(open_link(link), identity=SHORE, target_system=system, streams=(), is_quiet=True) as heard:
            return (await heard.wait_autopilot(timeout_s)).target_system

    return run(listen())


class MavsdkSession:
    """A connected autopilot, seen from the shore. Use as a context manager; blocking, one call at a time.

    ``system`` is the autopilot's system id, None: the only one that is heard.
    """

    def __init__(self, link: str, *, timeout_s: float = CONNECT_TIMEOUT_S, system: int | None = None) -> None:
        self._link, self._timeout_s, self._wanted = link, timeout_s, system
        self._mavsdk: Any = None
        self._system: Any = None
        self._raw: Any = None
        self._direct: Any = None
        self._handles: list[Any] = []
        self._lock = threading.Lock()
        self._heard_s = 0.0
        self._texts: list[str] = []
        self._count: int | None = None
        self._total = 0
        self._on_progress: OnProgress | None = None
        self.home: GeoPoint | None = None  # item 0 of the mission last downloaded

    def __enter__(self) -> Self:
        from mavsdk import Configuration, Mavsdk
        from mavsdk import logging as mavsdk_logging
        from mavsdk.component_type import ComponentType
        from mavsdk.plugins.mavlink_direct import MavlinkDirect
        from mavsdk.plugins.mission_raw import MissionRaw

        url = mavsdk_url(self._link)
        wanted = find_system(self._link, self._timeout_s, self._wanted)
        mavsdk_logging.log_subscribe(lambda *_: True)
        self._mavsdk = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
        result = self._mavsdk.add_any_connection(url)
        if result is not None and int(result) != 0:
            self._close()
            raise LinkError(f"{self._link} cannot be opened ({words(result)})")
        self._system = self._connected(wanted)
        if self._system is None:
            self._close()
            raise LinkError(f"{self._link}: system {wanted} was heard and is gone")
        self._raw = MissionRaw(self._system)
        self._direct = MavlinkDirect(self._system)
        self._heard_s = time.monotonic()
        for name in (
            "HEARTBEAT",
            "STATUSTEXT",
            "MISSION_COUNT",
            "MISSION_REQUEST",
            "MISSION_REQUEST_INT",
            "MISSION_ITEM_INT",
            "MISSION_ACK",
        ):
            self._handles.append(self._direct.subscribe_message(name, self._on_message))
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._close()

    def _connected(self, wanted: int) -> Any:
        """Return MAVSDK's system of the id that is ours, None when it does not find it in time."""
        deadline_s = time.monotonic() + self._timeout_s
        while time.monotonic() < deadline_s:
            for system in self._mavsdk.get_systems():
                # not before it is connected: requests would go unanswered, to a peer that is not yet known
                if system.get_system_id() == wanted and system.has_autopilot() and system.is_connected():
                    return system
            time.sleep(0.05)
        return None

    def _close(self) -> None:
        if self._direct is not None:
            for handle in self._handles:
                self._direct.unsubscribe_message(handle)
        for part in (self._direct, self._raw):
            if part is not None:
                part.destroy()
        if self._mavsdk is not None:
            self._mavsdk.destroy()
        self._direct = self._raw = self._mavsdk = None

    def _on_message(self, message: Any, _: object = None) -> None:
        """Take note of what the autopilot does in a transfer (called on MAVSDK's thread)."""
        if message.component_id != 1:
            return
        try:
            fields = json.loads(message.fields_json)
        except ValueError:
            return
        with self._lock:
            name = message.message_name
            if name == "STATUSTEXT":
                self._texts = [*self._texts[-7:], str(fields.get("text", "")).strip("\x00 ")]
                return
            if name == "HEARTBEAT":
                return
            self._heard_s = time.monotonic()
            if name == "MISSION_COUNT":
                self._count = self._total = int(fields.get("count", 0))
            elif name != "MISSION_ACK" and self._total > 0 and self._on_progress is not None:
                self._on_progress(min(1.0, (int(fields.get("seq", 0)) + 1) / self._total))

    def _silence_s(self) -> float:
        with self._lock:
            return time.monotonic() - self._heard_s

    def _said(self) -> str:
        with self._lock:
            return f" (autopilot: {'; '.join(self._texts[-2:])})" if self._texts else ""

    def _begin(self, total: int, on_progress: OnProgress | None) -> None:
        with self._lock:
            self._texts, self._count, self._total = [], None, total
            self._on_progress = on_progress
            self._heard_s = time.monotonic()

    def _wait(self, what: str, call: Callable[[], Any], cancel: Callable[[], Any] | None = None) -> Any:
        """Run a blocking call of MAVSDK; end it when the autopilot has been silent for too long."""
        answer: list[Any] = []
        failure: list[Exception] = []
        done = threading.Event()

        def work() -> None:
            try:
                answer.append(call())
            except Exception as error:
                failure.append(error)
            done.set()

        threading.Thread(target=work, name=f"shore-{what}", daemon=True).start()
        while not done.wait(0.05):
            if self._silence_s() > SILENCE_S:
                if cancel is not None:
                    cancel()
                done.wait(2.0)
                raise TransferError(f"{what}: the autopilot fell silent for {SILENCE_S:g} s{self._said()}")
        if failure:
            time.sleep(0.2)  # the reason, a STATUSTEXT, may follow the refusal
            raise TransferError(f"{what}: {words(failure[0])}{self._said()}")
        return answer[0]

    def upload(
        self,
        kind: MissionType,
        items: Sequence[MissionItem],
        *,
        home: GeoPoint | None = None,
        on_progress: OnProgress | None = None,
    ) -> None:
        """Write a list. A mission gets ``home`` (or its first place) as item 0. Raises TransferError."""
        wire = list(items)
        if kind is MissionType.MISSION:
            wire.insert(0, home_item(items, home))
        if not wire:
            self.clear(kind)
            return
        listed = [to_mavsdk(i, item, kind) for i, item in enumerate(wire)]
        self._begin(len(wire), on_progress)
        what = f"{NAMES[kind]} upload"
        if kind is MissionType.MISSION:
            self._wait(what, lambda: self._raw.upload_mission(listed), self._raw.cancel_mission_upload)
        elif kind is MissionType.FENCE:
            self._wait(what, lambda: self._raw.upload_geofence(listed))
        else:
            self._wait(what, lambda: self._raw.upload_rally_points(listed))

    def download(self, kind: MissionType, *, on_progress: OnProgress | None = None) -> tuple[MissionItem, ...]:
        """Read a list; a mission without its home. Raises TransferError, also when no autopilot took part."""
        self._begin(0, on_progress)
        what = f"{NAMES[kind]} download"
        calls = {
            MissionType.MISSION: self._raw.download_mission,
            MissionType.FENCE: self._raw.download_geofence,
            MissionType.RALLY: self._raw.download_rallypoints,
        }
        listed = self._wait(what, calls[kind], self._raw.cancel_mission_download)
        # our subscription runs behind MAVSDK's own handling of the same messages
        deadline_s = time.monotonic() + 1.0
        while (count := self._count) is None and time.monotonic() < deadline_s:
            time.sleep(0.02)
        if count is None or count != len(listed):
            told = "never said how many items it holds" if count is None else f"announced {counted(count, 'item')}"
            raise TransferError(f"{what}: the autopilot {told} and {len(listed)} arrived: is the link dead?")
        items = tuple(from_mavsdk(item) for item in listed)
        if kind is not MissionType.MISSION:
            return items
        self.home = items[0].point if items and (items[0].lat_e7 or items[0].lon_e7) else None
        return items[1:]

    def clear(self, kind: MissionType) -> None:
        """Empty a list. Raises TransferError."""
        self._begin(0, None)
        if kind is MissionType.MISSION:
            self._wait("mission clear", self._raw.clear_mission)
            return
        from mavsdk.plugins.mavlink_direct import MavlinkMessage

        fields = {"target_system": self._system.get_system_id(), "target_component": 1, "mission_type": int(kind)}
        message = MavlinkMessage(
            message_name="MISSION_CLEAR_ALL",
            system_id=0,
            component_id=0,
            target_system_id=0,
            target_component_id=0,
            fields_json=json.dumps(fields),
        )
        self._wait(f"{NAMES[kind]} clear", lambda: self._direct.send_message(message))

    def get_param(self, name: str) -> float:
        """Return a parameter. Raises TransferError."""
        from mavsdk.plugins.param import Param

        param = Param(self._system)
        try:
            for read in (param.get_param_float, param.get_param_int):
                try:
                    return float(self._timed(f"parameter {name}", read, name))
                except TransferError as error:
                    failure = error
            raise failure
        finally:
            param.destroy()

    def set_param(self, name: str, value: float) -> None:
        """Set a parameter and read it back. Raises TransferError."""
        from mavsdk.plugins.param import Param

        param = Param(self._system)
        try:
            for write, number in ((param.set_param_int, int(value)), (param.set_param_float, float(value))):
                try:
                    self._timed(f"parameter {name}", write, name, number)
                    break
                except TransferError as error:
                    failure = error
            else:
                raise failure
        finally:
            param.destroy()
        found = self.get_param(name)
        if found != value:
            raise TransferError(f"parameter {name}: wrote {value:g}, read back {found:g}")

    def _timed(self, what: str, call: Callable[..., Any], *args: object) -> Any:
        """Run a call that MAVSDK times out itself, with a deadline of our own behind it."""
        answer: list[Any] = []
        failure: list[Exception] = []

        def work() -> None:
            try:
                answer.append(call(*args))
            except Exception as error:
                failure.append(error)

        thread = threading.Thread(target=work, name=f"shore-{what}", daemon=True)
        thread.start()
        thread.join(PARAM_TIMEOUT_S)
        if thread.is_alive():
            raise TransferError(f"{what}: no answer within {PARAM_TIMEOUT_S:g} s")
        if failure:
            raise TransferError(f"{what}: {words(failure[0])}")
        return answer[0]


@contextmanager
def progress_bar(title: str) -> Iterator[OnProgress]:
    """Show a bar on a terminal's stderr; elsewhere nothing."""
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

    console = Console(stderr=True)
    columns = (
        TextColumn("{task.description:>18}"),
        BarColumn(),
        TextColumn("{task.percentage:3.0f} %"),
        TimeElapsedColumn(),
    )
    with Progress(*columns, console=console, disable=not console.is_terminal) as progress:
        task = progress.add_task(title, total=1.0)
        yield lambda done: progress.update(task, completed=done)
        progress.update(task, completed=1.0)


def upload_and_compare(
    session: MavsdkSession, kind: MissionType, items: Sequence[MissionItem], *, home: GeoPoint | None = None
) -> str:
    """Write a list, read it back, compare, and return its hash. Raises TransferError where they differ."""
    from companion.mavlink.wire import first_difference, mission_hash

    name = NAMES[kind]
    with progress_bar(f"{name} upload") as on_progress:
        session.upload(kind, items, home=home, on_progress=on_progress)
    with progress_bar("read back") as on_progress:
        found = session.download(kind, on_progress=on_progress)
    difference = first_difference(items, found)
    if difference:
        raise TransferError(f"{name} read back differs: {difference}")
    sent, back = mission_hash(items), mission_hash(found)
    if sent != back:
        raise TransferError(f"{name} read back differs: hash {back}, sent {sent}")
    return sent


def download_list(session: MavsdkSession, kind: MissionType) -> tuple[MissionItem, ...]:
    """Read a list with a progress bar."""
    with progress_bar(f"{NAMES[kind]} download") as on_progress:
        return session.download(kind, on_progress=on_progress)
