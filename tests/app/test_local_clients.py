"""The socket on board: who may open it, what is there already, lines that are no orders."""

import asyncio
import contextlib
import json
import socket
import stat
from dataclasses import replace

import msgspec
import pytest

from companion.app.local_clients import MAX_LINE, MOST, OperatorCommands, ViewBroadcast, orders_served
from companion.clock import run
from companion.compose import config_of, voyage_of
from companion.errors import InputError
from companion.geofence import load_mission
from companion.guard import Guard
from companion.mavlink.link import Link
from companion.orders import Result, Verb
from companion.skipper.step import Acknowledge
from companion.skipper.step.config import ALL_PERMITTED
from companion.skipper.way.voyage import Goal
from companion.view import Event, View
from sitl.autopilot import MemoryLink
from tests.skipper.test_voyage import make
from tests.terminal.test_dashboard import VIEW


def views(guard=None):
    mission = load_mission("missions/archipelago.toml")
    return ViewBroadcast(voyage_of(mission), config_of(mission), 0.0, guard or Guard())


def with_socket(path, talk, shown=None):
    """Run ``talk(crew)`` with the socket served; what nobody takes is answered by nobody."""

    async def whole():
        operator = OperatorCommands(Link(MemoryLink().near), has_key=False)
        operator.begin()
        async with orders_served(path, operator, shown or views()):
            return await talk(operator)

    return run(whole())


async def said(path, *lines):
    reader, writer = await asyncio.open_unix_connection(path)
    writer.write(b"".join(lines))
    try:
        return [await asyncio.wait_for(reader.readline(), 5.0) for _ in lines]
    except ConnectionError:
        return [b""]  # hung up
    finally:
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()


def test_who_watches_when_the_companion_ends_is_no_error(tmp_path):
    """Ctrl-C printed sixteen lines of asyncio where a ``watch --socket`` was open."""
    errors = []

    async def talk(_):
        asyncio.get_running_loop().set_exception_handler(lambda _, context: errors.append(context))
        _, writer = await asyncio.open_unix_connection(tmp_path / "s")
        writer.write(b"watch\n")
        await asyncio.sleep(0.05)
        served = [task for task in asyncio.all_tasks() if "talk" in repr(task) and task is not asyncio.current_task()]
        assert served
        for task in served:
            task.cancel()
        await asyncio.sleep(0.05)
        writer.close()
        with contextlib.suppress(ConnectionError):
            await writer.wait_closed()

    with_socket(tmp_path / "s", talk)
    assert not errors


def test_the_same_order_over_another_connection_is_a_repetition_and_each_gets_its_answer(tmp_path):
    """``companion order skip_goal --socket`` twice in a second gave two goals up."""
    goals = [Goal(en_m=en_m) for en_m in ((0.0, 300.0), (250.0, 300.0), (250.0, 0.0))]
    world = make(*goals, obstacles=(), permissions=replace(ALL_PERMITTED, local_orders=("skip_goal",)))
    world.run(5)

    async def talk(operator):
        async def given(words):
            asked, orders, seen = asyncio.create_task(said(tmp_path / "s", words)), [], len(world.actions)
            while not orders:
                await asyncio.sleep(0.01)
                orders = operator.take()
            world.events += orders
            world.step()
            for _, action in world.actions[seen:]:
                if isinstance(action, Acknowledge):
                    operator.answered(action)
            return json.loads((await asked)[0])

        first, again = await given(b"skip_goal\n"), await given(b"skip_goal\n")
        assert (first["result"], again) == ("done", first)
        assert world.state.progress.gate == 1

    with_socket(tmp_path / "s", talk)


def test_an_order_waits_for_its_answer_and_only_for_its_own(tmp_path):
    async def talk(operator):
        first = asyncio.create_task(said(tmp_path / "s", b"hold\n"))
        second = asyncio.create_task(said(tmp_path / "s", b"goal 50.8 -1.3\n"))
        orders = []
        while len(orders) < 2:
            await asyncio.sleep(0.01)
            orders += operator.take()
        assert {o.wanted.verb for o in orders} == {Verb.HOLD, Verb.GOAL}
        assert {(o.source.kind, o.authority) for o in orders} == {("local", "local")}
        for order in orders:
            operator.answered(
                Acknowledge(
                    way="local",
                    system=0,
                    component=order.source.component,
                    command=0,
                    result=Result.DONE,
                    text=order.wanted.verb,
                )
            )
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
    async def talk(operator):
        assert await said(tmp_path / "s", b"x" * 3 * MAX_LINE) == [b""]
        crowd = [await asyncio.open_unix_connection(tmp_path / "s") for _ in range(MOST)]
        for _, writer in crowd:
            writer.write(b"hold\n")  # each waits for its answer
        await asyncio.sleep(0.05)
        late = await said(tmp_path / "s", b"jump\n")
        for order in operator.take():
            operator.answered(
                Acknowledge(
                    way="local",
                    system=0,
                    component=order.source.component,
                    command=0,
                    result=Result.DONE,
                    text="so be it",
                )
            )
        for _, writer in crowd:
            writer.close()
            await writer.wait_closed()
        await asyncio.sleep(0.05)
        return late, await said(tmp_path / "s", b"jump\n")

    late, after = with_socket(tmp_path / "s", talk)
    assert late == [b""]
    assert after != [b""]


@pytest.mark.parametrize("sent", [b"", b"watch\n"])
def test_who_asks_for_nothing_and_who_watches_leave_room_for_an_order(tmp_path, sent):
    async def talk(_):
        crowd = [await asyncio.open_unix_connection(tmp_path / "s") for _ in range(MOST + 2)]
        for _, writer in crowd:
            writer.write(sent)
        await asyncio.sleep(0.05)
        answer = await said(tmp_path / "s", b"jump\n")
        for _, writer in crowd:
            writer.transport.abort()
        return answer

    assert json.loads(with_socket(tmp_path / "s", talk)[0])["result"] == "unknown"


def test_a_place_that_is_taken_is_left_alone_and_what_a_kill_left_is_not(tmp_path):
    (tmp_path / "file").write_text("mine")
    with pytest.raises(InputError, match="no socket"):
        with_socket(tmp_path / "file", None)
    assert (tmp_path / "file").read_text() == "mine"
    with pytest.raises(InputError, match="cannot be made"):
        with_socket(tmp_path / "none" / "s", None)

    async def twice(operator):
        with pytest.raises(InputError, match="another program listens"):
            async with orders_served(tmp_path / "s", operator, views()):
                pass
        return await said(tmp_path / "s", b"jump\n")

    assert with_socket(tmp_path / "s", twice) != [b""]
    left = socket.socket(socket.AF_UNIX, socket.SOCK_STREAM)
    left.bind(str(tmp_path / "s"))
    left.close()

    async def mode(_):
        return (tmp_path / "s").is_socket()

    assert with_socket(tmp_path / "s", mode)


# ------------------------------------------------------------------------------------------ views
def tell(shown, number, text=""):
    """Let a step be seen, as the voyage does."""
    event = Event(number=number, t_s=float(number), kind="said", title=f"event {number}", text=text)
    for watcher in tuple(shown.watchers):
        watcher(replace(VIEW, t_s=float(number)), (event,), None)


async def watching(path, shown):
    reader, writer = await asyncio.open_unix_connection(path, limit=1 << 20)
    writer.write(b"watch\n")
    async with asyncio.timeout(5.0):
        while not shown.watchers:  # noqa: ASYNC110 - nothing tells of it
            await asyncio.sleep(0.01)
    return reader, writer


def test_who_watches_is_told_of_each_step_and_orders_go_on(tmp_path):
    shown = views()

    async def talk(operator):
        reader, writer = await watching(tmp_path / "s", shown)
        tell(shown, 1)
        first = msgspec.json.decode(await reader.readline())
        tell(shown, 2)
        tell(shown, 3)  # before the one before it was fetched: the newest, and all that happened
        second = msgspec.json.decode(await reader.readline())
        assert (await said(tmp_path / "s", b"dance\n"))[0].startswith(b'{"result": "unknown"')
        writer.close()
        await asyncio.sleep(0.1)
        tell(shown, 4)
        await asyncio.sleep(0.1)
        tell(shown, 5)
        await asyncio.sleep(0.1)
        return first, second, len(shown.watchers)

    first, second, left = with_socket(tmp_path / "s", talk, shown)
    assert msgspec.convert(first["view"], View) == replace(VIEW, t_s=1.0)
    assert second["view"]["t_s"] == 3.0
    assert [event["number"] for event in second["events"]] == [2, 3]
    assert left == 0  # who is gone is told no more


def test_who_watches_and_never_reads_is_hung_up_on(tmp_path, monkeypatch):
    monkeypatch.setattr("companion.app.local_clients.STUCK_S", 0.3)
    shown = views()

    async def talk(operator):
        _, writer = await watching(tmp_path / "s", shown)
        writer.transport.pause_reading()
        for number in range(200):
            tell(shown, number, "x" * 100_000)
            await asyncio.sleep(0.005)
            if not shown.watchers:
                break
        async with asyncio.timeout(5.0):
            while shown.watchers:  # noqa: ASYNC110 - nothing tells of it
                await asyncio.sleep(0.01)
        writer.close()

    with_socket(tmp_path / "s", talk, shown)


def test_a_view_that_cannot_be_made_is_said_once_and_costs_nothing():
    faults, seen = [], []
    shown = views(Guard(lambda name, why: faults.append((name, why))))
    shown.take(None, None, None)  # nobody watches: nothing is made
    assert faults == []
    shown.watchers.append(lambda *told: seen.append(told))
    shown.take(None, None, None)
    shown.take(None, None, None)
    assert len(faults) == 1
    assert faults[0][0] == "view of the voyage"
    assert "AttributeError" in faults[0][1]
