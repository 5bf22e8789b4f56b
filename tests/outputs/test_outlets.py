"""The receivers: late, slow, gone, in numbers; the voyage that tells them is never held."""

import asyncio
import contextlib
import errno
import gc
import itertools
import json
import socket
import sys
import time
from dataclasses import replace

import pytest

from companion.clock import run
from companion.errors import InputError
from companion.guard import Guard
from companion.outputs import Outputs
from companion.outputs.nmea import MOST_CLIENTS
from companion.outputs.outlet import Slot
from companion.outputs.outputs import read_token
from companion.view.values import AlarmView
from sitl.scenario.traffic import free_port
from tests.outputs.conftest import chosen, view_of

STEP_S = 0.02
WAITED_S = 0.5  # a busy machine makes a step as late as a tenth of this; who waits for a client waits for seconds


async def tell(outputs, view, seconds):
    """Tell the view again and again; return the most processor time that it took, and see that it waits for nobody."""
    worst_s = 0.0
    until_s = time.perf_counter() + seconds
    gc.disable()  # a tenth of a second for all that a session of tests holds, at whatever moment it falls
    try:
        while time.perf_counter() < until_s:
            began_s, busy_s = time.perf_counter(), time.thread_time()
            outputs.tell(view, None)
            worst_s = max(worst_s, time.thread_time() - busy_s)
            assert time.perf_counter() - began_s < WAITED_S
            await asyncio.sleep(STEP_S)
    finally:
        gc.enable()
    return worst_s


def with_outputs(frame, nmea, signalk, body):
    """Run ``body(outputs, said)`` with outputs that are open."""

    async def main():
        said = []
        async with Outputs(chosen(nmea, signalk, None), frame, said.append) as outputs:
            await asyncio.sleep(0)
            return await body(outputs, said)

    return run(main())


def test_a_slot_holds_the_newest_and_counts_the_others():
    async def main():
        slot = Slot()
        for number in range(5):
            slot.put(number)
        assert (await slot.take(), slot.dropped) == (4, 4)

    asyncio.run(main())


def test_datagrams_of_one_sentence_each(frame, view):
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as heard:
        heard.bind(("127.0.0.1", 0))
        heard.settimeout(0.0)

        async def body(outputs, _):
            await tell(outputs, view, 0.3)

        with_outputs(frame, [f"udp:127.0.0.1:{heard.getsockname()[1]}"], (), body)
        lines = []
        with contextlib.suppress(BlockingIOError):
            while True:
                lines.append(heard.recv(2048))
    assert all(line.startswith(b"$II") and line.endswith(b"\r\n") and line.count(b"$") == 1 for line in lines)
    kinds = [line[3:6] for line in lines]
    assert kinds.count(b"RTE") == 1  # the route once, while it stays as it is
    assert kinds.count(b"RMC") == kinds.count(b"RMB") > 5


def test_a_broadcast_address_can_be_told(frame, view):
    async def body(outputs, said):
        await tell(outputs, view, 0.2)
        return outputs.nmea[0].sent, said

    sent, said = with_outputs(frame, ["udp:127.255.255.255:10111"], (), body)
    assert sent > 2
    assert [line.rpartition(": ")[2] for line in said] == ["sending"]


def test_who_connects_is_told_the_route_first_and_again_when_it_changes(frame, view):
    port = free_port()

    async def body(outputs, _):
        await tell(outputs, view, 0.1)
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        writer.write(b"$GPGLL,rubbish\xff\x00\n" * 100)
        await tell(outputs, view, 0.2)
        await tell(outputs, view_of(goals=()), 0.2)
        data = await reader.read(65_536)
        writer.close()
        return data.decode("ascii")

    lines = with_outputs(frame, [f"tcp:{port}"], (), body).splitlines()
    routes = [line for line in lines if "RTE" in line]
    assert [route.partition("*")[0] for route in routes] == [
        "$IIRTE,1,1,c,companion,W2,Northmar",
        "$IIRTE,1,1,c,companion,W2,W3",
    ]


def test_one_that_never_reads_costs_nobody_anything(frame, view, monkeypatch):
    """Nor do twenty: the voyage is not held, the memory is bounded, and in the end they are hung up on."""
    monkeypatch.setattr("companion.outputs.nmea.PATIENCE_S", 0.5)
    port = free_port()

    async def body(outputs, _):
        await asyncio.sleep(0.05)
        silent = [socket.socket() for _ in range(20)]
        for each in silent:
            each.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
            each.connect(("127.0.0.1", port))
        reader, writer = await asyncio.open_connection("127.0.0.1", port)
        await asyncio.sleep(0.1)
        server = outputs.nmea[0]
        most = len(server.clients)
        for client in server.clients:  # so that they are full within a test's time
            client._wire.get_extra_info("socket").setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 4096)
        worst_s = await tell(outputs, view, 3.0)
        for each in silent:
            each.close()
        writer.close()
        return most, worst_s, server.hung_up, server.dropped, len(server.clients), reader.at_eof()

    most, worst_s, hung_up, dropped, left, _ = with_outputs(frame, [f"tcp:{port}"], (), body)
    assert most == MOST_CLIENTS
    assert hung_up > 10
    assert dropped > 10
    assert left <= MOST_CLIENTS - hung_up
    assert worst_s < 0.01


def test_a_port_in_use_is_said_once_and_tried_again(frame, view):
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]

        async def body(outputs, said):
            await tell(outputs, view, 1.0)
            taken.close()
            async with asyncio.timeout(20.0):
                while not outputs.nmea[0].is_open:  # noqa: ASYNC110 - nothing tells of it
                    await asyncio.sleep(0.05)
            return said

        said = with_outputs(frame, [f"tcp:{port}"], (), body)
    assert said == [f"NMEA 0183 tcp:{port}: the port is in use; trying again", f"NMEA 0183 tcp:{port}: listening"]


def test_a_signal_k_server_that_takes_nothing_in_does_not_hold_the_voyage(frame, view, monkeypatch):
    """It is accepted and never read from: the slot drops, the connection is given up."""
    monkeypatch.setattr("companion.outputs.signalk.STUCK_S", 0.3)
    with socket.socket() as stuck:
        stuck.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 2048)
        stuck.bind(("127.0.0.1", 0))
        stuck.listen()

        big = AlarmView(code="x", level="error", text="a" * 100_000)  # fills it at once

        async def body(outputs, said):
            worst_s = 0.0
            async with asyncio.timeout(60.0):
                for number in itertools.count():
                    changed = replace(view, alarms=(replace(big, code=f"x{number}"),))
                    worst_s = max(worst_s, await tell(outputs, changed, 0.1))
                    if any("no answer" in line for line in said):
                        break
            return worst_s, outputs.signalk[0].dropped

        worst_s, dropped = with_outputs(frame, (), [f"tcp:127.0.0.1:{stuck.getsockname()[1]}"], body)
    assert worst_s < 0.01
    assert dropped > 5


@pytest.mark.parametrize(
    "answer", [b"", b"HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\n\r\n", b"rubbish\r\n\r\n" * 50]
)
def test_what_is_no_signal_k_server_is_told_of(frame, view, answer):
    async def body(outputs, said):
        async with asyncio.timeout(10.0):
            while not said:
                await tell(outputs, view, 0.1)
        return said

    async def main():
        async def serve(reader, writer):
            await reader.read(1024)
            writer.write(answer)
            writer.close()

        server = await asyncio.start_server(serve, "127.0.0.1", 0)
        port = server.sockets[0].getsockname()[1]
        said = []
        async with server, Outputs(chosen((), [f"ws://127.0.0.1:{port}"], None), frame, said.append) as outputs:
            return await body(outputs, said)

    said = run(main())
    assert said[0].startswith("Signal K ws://127.0.0.1:")
    assert said[0].endswith("; trying again")
    assert ("no Signal K stream is there (HTTP 404)" in said[0]) == (b"404" in answer)


def test_a_view_that_cannot_be_told_is_said_and_costs_nothing(frame, view):
    async def body(outputs, said):
        outputs.tell(replace(view, boat=replace(view.boat, lat_deg=500.0)), None)
        outputs.tell(view, None)
        await asyncio.sleep(0.1)
        return said, outputs.nmea[0].sent

    said, sent = with_outputs(frame, ["udp:127.0.0.1:10111"], (), body)
    assert any("not told" in line for line in said)
    assert sent == 1


# ------------------------------------------------------------------------------------------- names
@pytest.mark.parametrize(
    "name", ["", "udp:10110", "tcp", "tcp:0", "udp:h:99999", "ws://h", "udp:a b:1", "serial:/dev/x"]
)
def test_a_place_that_is_none_is_refused(name):
    with pytest.raises(InputError, match=r"--nmea.*write udp:HOST:PORT"):
        chosen([name], (), None)


@pytest.mark.parametrize(
    "name", ["", "h:3000", "http://h", "ws://", "ws://u:p@h", "ws://h?token=x", "tcp:8375", "ws://h:x"]
)
def test_a_signal_k_server_that_is_none_is_refused(name):
    with pytest.raises(InputError, match=r"--signalk.*write ws://HOST:3000"):
        chosen((), [name], None)


@pytest.mark.parametrize(
    ("text", "mode", "says"),
    [
        ("abc", 0o644, "can be read by others"),
        ("", 0o600, "holds no token"),
        ("a b", 0o600, "holds no token"),
        ("ä", 0o600, "holds no token"),
    ],
)
def test_a_token_that_must_not_be_used_is_not_and_that_is_known(tmp_path, text, mode, says):
    file, guard = tmp_path / "token", Guard()
    file.write_text(text)
    file.chmod(mode)
    with pytest.raises(InputError, match=says):
        read_token(file)
    whom = chosen((), ["ws://h"], file, guard)
    assert (whom.token, len(whom.signalk)) == ("", 1)
    assert says in guard.gone["Signal K token"]


def test_a_token_is_in_no_text(tmp_path):
    file = tmp_path / "token"
    file.write_text("sesame\n")
    file.chmod(0o600)
    whom = chosen((), ["ws://h"], file)
    assert whom.token == "sesame"
    assert "sesame" not in repr(whom)
    with pytest.raises(InputError, match="no such file"):
        read_token(tmp_path / "other")


def test_without_its_library_a_websocket_is_left_out_in_one_line(monkeypatch):
    guard = Guard()
    monkeypatch.setitem(sys.modules, "websockets", None)
    whom = chosen((), ["ws://h", "tcp:h:8375"], None, guard)
    assert [name.text for name in whom.signalk] == ["tcp:h:8375"]
    assert "pip install '.[signalk]', or name the server's TCP port" in guard.gone["other displays"]
    assert "\n" not in guard.gone["other displays"]
    assert chosen((), ["tcp:h:8375"]).signalk


def test_a_broadcast_that_is_not_permitted_is_told_of(frame, view, monkeypatch):
    """As in the service's sandbox; the voyage goes on, and so do the other outputs."""

    def refuse(self, data, addr=None):
        self._protocol.error_received(PermissionError(errno.EPERM, "x"))

    monkeypatch.setattr("asyncio.selector_events._SelectorDatagramTransport.sendto", refuse)

    async def body(outputs, said):
        await tell(outputs, view, 0.5)
        return said

    said = with_outputs(frame, ["udp:255.255.255.255:10110"], (), body)
    assert said[:2] == [
        "NMEA 0183 udp:255.255.255.255:10110: sending",
        "NMEA 0183 udp:255.255.255.255:10110: not permitted; trying again",
    ]


def test_a_delta_is_small_and_plain_json(frame, view):
    from companion.outputs.signalk import delta, values_of

    text = json.dumps(delta(values_of(view, frame), {}), allow_nan=False)
    assert len(text) < 4000
