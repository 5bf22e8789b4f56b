"""The socket on board: who may open it, what is there already, lines that are no orders."""

import asyncio
import contextlib
import json
import socket
import stat

import pytest

from companion.app.crew import Crew
from companion.app.local import MAX_LINE, MOST, served
from companion.clock import run
from companion.errors import InputError
from companion.mavlink.link import Link
from companion.orders import Result, Verb
from companion.skipper.step import Acknowledge
from sitl.autopilot import MemoryLink


def showing():
    from pathlib import Path

    from companion.app.showing import Showing
    from companion.compose import config_of, voyage_of
    from companion.geofence import load_mission

    mission = load_mission(Path("missions/archipelago.toml"))
    return Showing(voyage_of(mission), config_of(mission), 0.0, print)


SHOWING = showing()


def with_socket(path, talk):
    """Run ``talk(crew)`` with the socket served; what nobody takes is answered by nobody."""
    async def whole():
        crew = Crew(Link(MemoryLink().near), has_key=False)
        crew.begin()
        async with served(path, crew, SHOWING):
            return await talk(crew)

    return run(whole())


async def said(path, *lines):
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(b"".join(lines))
    try:
        return [await asyncio.wait_for(reader.readline(), 5.0) for _ in lines]
    except ConnectionError:
        return [b""]   # hung up
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


def test_an_order_waits_for_its_answer_and_only_for_its_own(tmp_path):
    async def talk(crew):
        first = asyncio.create_task(said(tmp_path / "s", b"hold\n"))
        second = asyncio.create_task(said(tmp_path / "s", b"goal 50.8 -1.3\n"))
        orders = []
        while len(orders) < 2:
            await asyncio.sleep(0.01)
            orders += crew.take()
        assert {o.wanted.verb for o in orders} == {Verb.HOLD, Verb.GOAL}
        assert {(o.source.kind, o.authority) for o in orders} == {("local", "local")}
        for order in reversed(orders):
            crew.answered(Acknowledge(way="local", system=0, component=order.source.component, command=0,
                                      result=Result.DONE, text=order.wanted.verb))
        return [json.loads(line) for [line] in (await first, await second)]

    assert with_socket(tmp_path / "s", talk) == [{"result": "done", "text": "hold"}, {"result": "done", "text": "goal"}]


def test_only_its_owner_may_open_it_and_it_goes_with_the_companion(tmp_path):
    async def talk(_):
        return stat.S_IMODE((tmp_path / "s").stat().st_mode)

    assert with_socket(tmp_path / "s", talk) == 0o600
    assert not (tmp_path / "s").exists()


@pytest.mark.parametrize("line", [b"jump\n", b"goal\n", b"\n", b"\xff\xfe\n", b"goal north east\n"])
def test_what_is_no_order_is_answered_and_the_next_is_heard(tmp_path, line):
    async def talk(_):
        return await said(tmp_path / "s", line, line)

    for answer in map(json.loads, with_socket(tmp_path / "s", talk)):
        assert answer["result"] == "unknown"
        assert answer["text"]


def test_a_line_without_end_is_hung_up_on_and_a_crowd_is_not_let_in(tmp_path):
    async def talk(_):
        assert await said(tmp_path / "s", b"x" * 3 * MAX_LINE) == [b""]
        crowd = [await asyncio.open_unix_connection(tmp_path / "s") for _ in range(MOST)]
        await asyncio.sleep(0.05)
        late = await said(tmp_path / "s", b"jump\n")
        for _, writer in crowd:
            writer.close()
            await writer.wait_closed()
        await asyncio.sleep(0.05)
        return late, await said(tmp_path / "s", b"jump\n")

    late, after = with_socket(tmp_path / "s", talk)
    assert late == [b""]
    assert after != [b""]


def test_a_place_that_is_taken_is_left_alone_and_what_a_kill_left_is_not(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="no socket"):
        with_socket(tmp_path / "file", None)
    assert (tmp_path / "file").read_text() == "mine"
    with pytest.raises(InputError, match="cannot be made"):
        with_socket(tmp_path / "none" / "s", None)

    async def twice(crew):
        with pytest.raises(InputError, match="another program listens"):
            async with served(tmp_path / "s", crew, SHOWING):
                pass
        return await said(tmp_path / "s", b"jump\n")

    assert with_socket(tmp_path / "s", twice) != [b""]
    left = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    left.bind(str(tmp_path / "s"))
    left.close()

    async def mode(_):
        return (tmp_path / "s").is_socket()

    assert with_socket(tmp_path / "s", mode)
