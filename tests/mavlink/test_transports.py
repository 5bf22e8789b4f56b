"""LINK names and the endpoints of the real world: a pty, UDP, TCP."""

import asyncio
import contextlib
import os
import random
import tty

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from companion.clock import run
from companion.errors import InputError, LinkError
from companion.mavlink import transports
from companion.mavlink.transports import (
    BACKOFF_CAP_S,
    MAX_WRITE_BUFFER_BYTES,
    TransportState,
    backoff_s,
    open_link,
    parse_link,
)


@pytest.mark.parametrize(
    ("text", "kind", "where"),
    [
        ("/dev/serial0:921600", "serial", ("/dev/serial0", 921600)),
        ("/dev/ttyAMA0", "serial", ("/dev/ttyAMA0", 921600)),
        ("serial:/dev/ttyUSB0:57600", "serial", ("/dev/ttyUSB0", 57600)),
        (
            "/dev/serial/by-id/usb-1209_Pixhawk-if00:115200",
            "serial",
            ("/dev/serial/by-id/usb-1209_Pixhawk-if00", 115200),
        ),
        ("udpin:0.0.0.0:14551", "udpin", ("0.0.0.0", 14551)),
        ("udp:127.0.0.1:14550", "udpin", ("127.0.0.1", 14550)),
        ("udpout:boat.local:14550", "udpout", ("boat.local", 14550)),
        ("tcp:127.0.0.1:5760", "tcp", ("127.0.0.1", 5760)),
        ("tcpin:0.0.0.0:5760", "tcpin", ("0.0.0.0", 5760)),
        (
            "/dev/serial/by-path/platform-fd50-usb-0:1.2:1.0-port0:57600",
            "serial",
            ("/dev/serial/by-path/platform-fd50-usb-0:1.2:1.0-port0", 57600),
        ),
        ("tcp:[::1]:5760", "tcp", ("::1", 5760)),
    ],
)
def test_link_names(text, kind, where):
    link = parse_link(text)
    assert link.kind == kind
    assert (link.device or link.host, link.baud if kind == "serial" else link.port) == where


@pytest.mark.parametrize(
    "text",
    [
        "",
        "udpin",
        "udpin:14550",
        "udpin:host:",
        "udpin:host:0",
        "udpin:host:70000",
        "udpin:host:1e3",
        "bluetooth:x:1",
        "/dev/ttyS0:fast",
        "/dev/ttyS0:12",
        "tcp::5760",
        "udpin:h:²",
        "/dev/ttyUSB0:57600\n",
        "/dev/tty\nUSB0",
        "tcp:::1:5760",
        "tcp:a b:5760",
    ],
)
def test_bad_link_names_say_what_to_write(text):
    with pytest.raises(InputError, match="write /dev/serial0:921600"):
        parse_link(text)


@settings(max_examples=100)
@given(st.text(max_size=40))
@example("/dev/ttyUSB0:57600\n")
def test_any_text_is_a_link_or_an_input_error(text):
    try:
        parse_link(text)
    except InputError as error:
        lines = str(error).replace(text, "").count("\n")
    else:
        lines = 0
    assert lines == 0


def test_back_off_is_capped_full_jitter_and_repeats_with_its_seed():
    pauses = [backoff_s(i, random.Random(1)) for i in range(40)]
    assert pauses == [backoff_s(i, random.Random(1)) for i in range(40)]
    rng = random.Random(2)
    assert all(0.0 <= backoff_s(i, rng) <= BACKOFF_CAP_S for i in range(200))
    assert max(backoff_s(20, rng) for _ in range(200)) > 0.9 * BACKOFF_CAP_S


async def until(condition, timeout_s=100.0):
    async with asyncio.timeout(timeout_s):
        while not condition():  # noqa: ASYNC110 - the outside world has no event for it
            await asyncio.sleep(0.01)


def test_a_serial_port_carries_both_directions_and_belongs_to_one():
    async def main():
        ours, theirs = os.openpty()
        tty.setraw(ours)
        name = os.ttyname(theirs)
        heard = bytearray()
        transport = open_link(f"{name}:921600")
        await transport.open(heard.extend)
        await until(lambda: transport.state is TransportState.OPEN)
        data = bytes(range(256)) * 3
        os.write(ours, data)
        await until(lambda: len(heard) == len(data))
        assert bytes(heard) == data
        transport.write(data)
        got = bytearray()
        os.set_blocking(ours, False)
        async with asyncio.timeout(60.0):
            while len(got) < len(data):
                await asyncio.sleep(0.01)
                try:
                    got += os.read(ours, 4096)
                except BlockingIOError:
                    continue
        assert bytes(got) == data
        second = open_link(f"{name}:921600")
        await second.open(lambda _: None)
        await until(lambda: second.stats.failed_connections > 0)
        assert second.stats.last_error == "another program has it"
        await second.close()
        await transport.close()
        os.close(ours)
        os.close(theirs)

    run(main())


def test_a_serial_port_that_is_not_there_is_tried_again():
    async def main():
        transport = open_link("/dev/there-is-no-such-port:57600")
        await transport.open(lambda _: None)
        await until(lambda: transport.stats.failed_connections >= 2)
        assert transport.stats.last_error == "no such device"
        transport.write(b"lost")
        assert transport.stats.writes_dropped == 1
        await transport.close()

    run(main())


def free_port(kind="udp"):
    import socket

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM if kind == "udp" else socket.SOCK_STREAM) as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


def test_udp_in_answers_who_speaks_and_ignores_strangers():
    async def main():
        port = free_port()
        inside, outside, stranger = bytearray(), bytearray(), bytearray()
        a = open_link(f"udpin:127.0.0.1:{port}")
        b = open_link(f"udpout:127.0.0.1:{port}")
        c = open_link(f"udpout:127.0.0.1:{port}")
        await a.open(inside.extend)
        await b.open(outside.extend)
        await c.open(stranger.extend)
        a.write(b"nobody is there yet")
        assert a.stats.writes_dropped == 1
        b.write(b"hello")
        await until(lambda: bytes(inside) == b"hello")
        a.write(b"answer")
        await until(lambda: bytes(outside) == b"answer")
        c.write(b"intruder")
        await until(lambda: a.stats.foreign_datagrams == 1)
        a.write(b" two")
        await until(lambda: bytes(outside) == b"answer two")
        assert bytes(inside) == b"hello"
        assert not stranger
        with pytest.raises(LinkError, match="address already in use: another program listens there; stop it"):
            await open_link(f"udpin:127.0.0.1:{port}").open(lambda _: None)
        for transport in (a, b, c):
            await transport.close()
            await transport.close()

    run(main())


def test_udp_out_to_a_closed_port_goes_on():
    async def main():
        port = free_port()
        b = open_link(f"udpout:127.0.0.1:{port}")
        await b.open(lambda _: None)
        for _ in range(5):
            b.write(b"x")
            await asyncio.sleep(0.02)
        heard = bytearray()
        a = open_link(f"udpin:127.0.0.1:{port}")
        await a.open(heard.extend)
        b.write(b"now")
        await until(lambda: bytes(heard) == b"now")
        await a.close()
        await b.close()

    run(main())


def test_tcp_connects_again_when_the_server_comes_back():
    async def main():
        port = free_port("tcp")
        client, heard = open_link(f"tcp:127.0.0.1:{port}", seed=3), bytearray()
        await client.open(heard.extend)
        await until(lambda: client.stats.failed_connections >= 1)
        assert client.stats.last_error == "nobody listens there"
        for life in (1, 2):
            server, served = open_link(f"tcpin:127.0.0.1:{port}"), bytearray()
            await server.open(served.extend)
            await until(lambda n=life: client.stats.connections == n)
            await until(lambda s=server: s.state is TransportState.OPEN)
            client.write(b"to server")
            server.write(b"to client")
            await until(lambda s=served: bytes(s) == b"to server")
            await until(lambda n=life: bytes(heard) == b"to client" * n)
            await server.close()
            await until(lambda: client.state is not TransportState.OPEN)
        await client.close()

    # ten times as fast: the pauses of the back-off are loop time
    run(main(), speedup=10.0)


def test_a_client_that_waits_to_be_served_is_hung_up_when_the_server_closes(monkeypatch):
    monkeypatch.setattr(transports, "backoff_s", lambda *_: 60.0)

    async def main():
        port = free_port("tcp")
        server = open_link(f"tcpin:127.0.0.1:{port}")
        await server.open(lambda _: None)
        _, first = await asyncio.open_connection("127.0.0.1", port)
        await until(lambda: server.state is TransportState.OPEN)
        first.close()
        await until(lambda: bool(server.stats.last_error))
        reader, second = await asyncio.open_connection("127.0.0.1", port)
        await until(server._accepted.full)
        await server.close()
        with contextlib.suppress(ConnectionError):
            assert await asyncio.wait_for(reader.read(), 5.0) == b""
        second.close()

    run(main())


def test_a_peer_that_stops_reading_costs_frames_not_memory():
    async def main():
        port = free_port("tcp")
        stuck = asyncio.Event()

        async def never_reads(_, writer):
            await stuck.wait()
            writer.close()

        server = await asyncio.start_server(never_reads, "127.0.0.1", port, limit=1024)
        client = open_link(f"tcp:127.0.0.1:{port}")
        await client.open(lambda _: None)
        await until(lambda: client.state is TransportState.OPEN)
        for _ in range(20_000):
            client.write(bytes(1000))
        assert client.stats.writes_dropped > 0
        assert client._wire.get_write_buffer_size() <= MAX_WRITE_BUFFER_BYTES
        stuck.set()
        await client.close()
        server.close()

    run(main())


def test_a_half_open_connection_is_made_anew():
    async def main():
        port = free_port("tcp")
        calls = []

        async def silent(_, writer):
            calls.append(writer)

        server = await asyncio.start_server(silent, "127.0.0.1", port)
        client = open_link(f"tcp:127.0.0.1:{port}")
        await client.open(lambda _: None)
        await until(lambda: client.stats.connections == 2)
        assert client.stats.last_error == "silent for 15 s"
        await client.close()
        for writer in calls:
            writer.close()
        server.close()

    run(main(), speedup=20.0)
