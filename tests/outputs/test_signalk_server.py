"""A real Signal K server takes what it is told, and its REST API gives it back."""

import asyncio
import math
from dataclasses import replace

import pytest

from companion.outputs import Outputs
from companion.view.values import AlarmView
from sitl.scenario.traffic import free_port
from tests.outputs.conftest import chosen, view_of
from tests.outputs.signalk_server import MISSING, PROGRAM, Server

pytestmark = [pytest.mark.signalk, pytest.mark.skipif(PROGRAM is None, reason=MISSING)]
LEAK = AlarmView(code="leaking", level="critical", text="to the nearest refuge")
SILENT = AlarmView(code="link silent", level="error", text="no actions")


@pytest.fixture(scope="module")
def server(tmp_path_factory):
    with Server(tmp_path_factory.mktemp("open")) as running:
        yield running


async def telling(outputs, views, every_s=0.1):
    """Tell a view after another, the last for ever."""
    for view in views[:-1]:
        outputs.tell(view, None)
        await asyncio.sleep(every_s)
    while True:
        outputs.tell(views[-1], None)
        await asyncio.sleep(every_s)


async def told(frame, whom, views, look):
    """Tell views while ``look`` looks; return what was said of the outputs."""
    said = []
    async with Outputs(whom, frame, said.append) as outputs:
        task = asyncio.create_task(telling(outputs, views))
        try:
            await look(outputs)
        finally:
            task.cancel()
    return said


async def became(is_so, within_s=15.0):
    async with asyncio.timeout(within_s):
        while not await asyncio.to_thread(is_so):  # noqa: ASYNC110 - of another process
            await asyncio.sleep(0.1)


@pytest.mark.parametrize("way", ["ws", "tcp"])
def test_what_is_told_can_be_read_back(server, frame, view, way):
    async def look(_):
        position = await server.value("navigation.position")
        assert position["latitude"] == pytest.approx(view.boat.lat_deg, abs=1e-7)
        assert position["longitude"] == pytest.approx(view.boat.lon_deg, abs=1e-7)
        for path, value in (
            ("navigation.speedOverGround", 1.5),
            ("navigation.courseOverGroundTrue", math.radians(36.87)),
            ("navigation.headingTrue", math.radians(35.0)),
            ("navigation.state", "sailing"),
            ("environment.wind.directionTrue", math.radians(80.0)),
            ("environment.wind.speedOverGround", 5.0),
            ("environment.wind.angleTrueGround", math.radians(45.0)),
            ("environment.wind.angleApparent", math.radians(36.0)),
            ("environment.wind.speedApparent", 6.1),
            ("navigation.courseGreatCircle.crossTrackError", 5.0),
            ("navigation.courseGreatCircle.bearingTrackTrue", math.atan2(60.0, 80.0)),
            ("navigation.courseGreatCircle.nextPoint.distance", math.hypot(32.0, 51.0)),
            ("performance.velocityMadeGood", 1.0),
            ("performance.polarSpeed", 1.5),
            ("performance.beatAngle", math.radians(46.0)),
            ("performance.tackTrue", math.radians(125.0)),
            ("steering.autopilot.state", "route"),
        ):
            got = await server.value(path)
            assert got == (value if isinstance(value, str) else pytest.approx(value, abs=2e-4)), path
        assert server.get("environment.wind.directionTrue")["$source"] == "sailboat-companion"
        assert server.get("environment.wind.angleApparent")["meta"]["units"] == "rad"  # a path that it knows

    said = asyncio.run(told(frame, chosen((), [getattr(server, way)], None), [view], look))
    assert said[0].endswith("connected")


def test_alarms_come_and_go(server, frame, view):
    async def up(_):
        alarm = await server.value("notifications.flooding", until=lambda v: v and v["state"] == "emergency")
        assert (alarm["method"], alarm["message"]) == (["visual", "sound"], "leaking: to the nearest refuge")
        alarm = await server.value("notifications.companion.linkSilent", until=lambda v: v and v["state"] == "alarm")

    async def both(_):
        await server.value("notifications.flooding", until=lambda v: v and v["state"] == "normal")
        await server.value("notifications.companion.linkSilent", until=lambda v: v and v["state"] == "alarm")

    async def look(_):
        await up(_)

    asyncio.run(told(frame, chosen((), [server.ws], None), [replace(view, alarms=(LEAK, SILENT))], look))
    views = [replace(view, alarms=(LEAK, SILENT))] * 10 + [replace(view, alarms=(SILENT,))]
    asyncio.run(told(frame, chosen((), [server.ws], None), views, both))


def test_what_is_known_no_more_is_told_as_null(server, frame, view):
    old = replace(view, boat=replace(view.boat, age_s=30.0))

    async def look(_):
        await server.value("navigation.speedOverGround", until=lambda v: v is None)
        assert server.get("navigation.speedOverGround") is not None

    asyncio.run(told(frame, chosen((), [server.ws], None), [view] * 10 + [old], look))


def test_a_server_that_comes_late_and_goes_and_comes_back(tmp_path, frame):
    """The loop is never held for it, and what it missed is not told afterwards."""
    server = Server(tmp_path / "home")
    view = view_of()

    async def look(outputs):
        await asyncio.sleep(1.0)
        await asyncio.to_thread(server.start)
        await server.value("navigation.state", within_s=30.0)
        await asyncio.to_thread(server.stop)
        await asyncio.sleep(1.0)
        assert not outputs.signalk[0].is_open
        await asyncio.to_thread(server.start)
        await server.value("navigation.state", within_s=40.0)
        assert outputs.signalk[0].dropped > 10
        await asyncio.to_thread(server.stop)

    said = asyncio.run(told(frame, chosen((), [server.ws], None), [view], look))
    assert [line.partition(": ")[2] for line in said[:2]] == ["nobody listens there; trying again", "connected"]


@pytest.fixture(scope="module")
def secure(tmp_path_factory):
    with Server(tmp_path_factory.mktemp("secure"), is_secure=True) as running:
        yield running


def token_file(path, text, mode=0o600):
    path.write_text(text)
    path.chmod(mode)
    return path


def test_with_its_security_on_a_token_opens_it(secure, frame, view, tmp_path):
    async def look(outputs):
        assert await secure.value("navigation.state") == "sailing"
        await became(lambda: outputs.signalk[0].is_taken is not None)

    file = token_file(tmp_path / "token", secure.token("boat"))
    said = asyncio.run(told(frame, chosen((), [secure.ws], file), [view], look))
    assert said[-1].endswith("connected, and it takes what it is told")


@pytest.mark.parametrize("user", [None, "guest"])
def test_a_server_that_takes_nothing_is_told_of(secure, frame, view, user, tmp_path, monkeypatch):
    monkeypatch.setattr("companion.outputs.signalk.ECHO_S", 5.0)

    async def look(outputs):
        await became(lambda: outputs.signalk[0].is_taken is not None)

    file = None if user is None else token_file(tmp_path / "token", secure.token(user))
    said = asyncio.run(told(frame, chosen((), [secure.ws], file), [view], look))
    assert "it takes nothing from us: give a token" in said[-1]


def test_a_token_that_is_none_is_told_of(secure, frame, view, tmp_path):
    async def look(outputs):
        await became(lambda: "token" in outputs.signalk[0].state)

    file = token_file(tmp_path / "token", secure.token("boat") + "x")
    said = asyncio.run(told(frame, chosen((), [secure.ws], file), [view], look))
    assert "it refuses our token (401): make a new one" in said[-1]


def test_its_own_reader_of_nmea_understands_our_sentences(tmp_path, frame, view):
    """The second independent parser; RMB makes the waypoint the server's destination (its course API)."""
    port = free_port()
    with Server(tmp_path / "home", nmea_port=port) as server:

        async def look(_):
            wind = await server.value("environment.wind.angleApparent")
            assert wind == pytest.approx(math.radians(36.0), abs=1e-3)
            assert await server.value("environment.wind.directionTrue") == pytest.approx(math.radians(80.0), abs=1e-3)
            assert await server.value("navigation.headingTrue") == pytest.approx(math.radians(35.0), abs=1e-3)
            assert await server.value("navigation.speedOverGround") == pytest.approx(1.5, abs=0.03)
            off = await server.value("navigation.courseRhumbline.crossTrackError")
            assert abs(off) == pytest.approx(5.0, abs=0.2)
            await became(lambda: (server.get("navigation.course", 2) or {}).get("nextPoint"))
            point = server.get("navigation.course", 2)["nextPoint"]["position"]
            goal = frame.geo_from_en(60.0, 80.0)
            assert point["latitude"] == pytest.approx(goal.lat_deg, abs=3e-6)
            assert point["longitude"] == pytest.approx(goal.lon_deg, abs=3e-6)

        asyncio.run(told(frame, chosen([f"udp:127.0.0.1:{port}"], (), None), [view], look))
