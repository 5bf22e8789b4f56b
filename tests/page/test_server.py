"""The page's server: views and log as they come, who comes back, who never reads, a port in use."""

import asyncio
import gzip
import json
import socket
import threading
import time
import tracemalloc
from dataclasses import replace

import pytest

from companion.clock import run
from companion.errors import JobError
from companion.page import Address, LiveSource, RecordedSource, connections, served
from companion.page.sources import Hub, Watcher
from companion.view import AreaView, Past
from tests.page.asking import event, free_port, hang_up, view_at, with_page


def parsed(stream):
    """Return (event, id, data) of server-sent events."""
    out = []
    for block in stream.decode().split("\n\n"):
        fields = dict(line.split(": ", 1) for line in block.splitlines() if ": " in line and not line.startswith(":"))
        if "data" in fields:
            out.append((fields.get("event"), fields.get("id"), json.loads(fields["data"])))
    return out


async def watch(browser, until, last=None):
    """Return the events of the stream until ``until(events)``."""
    reader, writer = await asyncio.open_connection("127.0.0.1", browser.port)
    more = "" if last is None else f"Last-Event-ID: {last}\r\n"
    writer.write(f"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1:{browser.port}\r\n{more}\r\n".encode())
    await reader.readuntil(b"\r\n\r\n")
    raw = b""
    async with asyncio.timeout(5.0):
        while not until(found := parsed(raw)):
            size = int(await reader.readline(), 16)
            raw += await reader.readexactly(size)
            await reader.readline()
    await hang_up(writer)
    return found


def test_views_come_as_they_are_made_and_the_log_with_numbers():
    async def talk(browser, live, _):
        live.show(view_at(1.0), (event(1), event(2)), None)
        watching = asyncio.create_task(watch(browser, lambda found: len(found) >= 5))
        await asyncio.sleep(0.2)
        live.show(view_at(2.0), (event(3),), None)
        return await watching

    found = with_page(talk)
    assert [(name, number) for name, number, _ in found] == [
        ("log", "1"),
        ("log", "2"),
        ("view", None),
        ("log", "3"),
        ("view", None),
    ]
    assert [data["t_s"] for name, _, data in found if name == "view"] == [1.0, 2.0]


def test_who_comes_back_gets_what_he_has_missed_and_no_more():
    async def talk(browser, live, _):
        live.show(view_at(1.0), [event(n) for n in range(1, 11)], None)
        return (
            await watch(browser, lambda found: len(found) >= 4, last=7),
            await watch(browser, lambda found: len(found) >= 11, last=99),
        )  # of a voyage before

    missed, whole = with_page(talk)
    assert [number for name, number, _ in missed if name == "log"] == ["8", "9", "10"]
    assert [number for name, number, _ in whole if name == "log"] == [str(n) for n in range(1, 11)]


def test_the_voyages_end_is_said():
    async def talk(browser, live, _):
        live.show(view_at(1.0), (), None)
        watching = asyncio.create_task(watch(browser, lambda found: found and found[-1][0] == "over"))
        await asyncio.sleep(0.1)
        live.hub.close()
        return await watching

    assert with_page(talk)[-1][0] == "over"


def test_a_slow_watcher_gets_the_newest_view_and_not_all():
    hub = Hub()

    async def look():
        with Watcher(hub, 0) as watcher:
            hub.publish(view_at(0.0), ())
            await watcher.wait(1.0)
            for n in range(1, 1000):
                hub.publish(view_at(float(n)), ())
            return parsed(await watcher.wait(1.0))

    assert [data["t_s"] for _, _, data in run(look())] == [999.0]


def test_what_takes_long_to_make_and_to_pack_is_not_made_on_the_voyages_loop(monkeypatch):
    """An hour's samples and a page's worth of log, while more come in: the columns stay of one length."""
    by = []

    def noted(work):
        return lambda *given, **more: by.append(threading.get_ident()) or work(*given, **more)

    async def talk(browser, live, _):
        monkeypatch.setattr(Past, "of", noted(Past.of))  # the page's own files are packed by now, once for all
        monkeypatch.setattr(gzip, "compress", noted(gzip.compress))
        for n in range(3000):
            live.show(view_at(float(n)), (event(n + 1),), None)
        asked = [asyncio.create_task(browser.get("/api/past", Accept_Encoding="gzip")) for _ in range(3)]
        n = 3000
        while not all(each.done() for each in asked):
            live.show(view_at(float(n)), (event(n + 1),), None)
            n += 1
            await asyncio.sleep(0.0)
        return [await each for each in asked], threading.get_ident()

    answers, loop = with_page(talk)
    for status, _, body in answers:
        past = json.loads(gzip.decompress(body))
        assert status == 200
        assert {len(past[name]) for name in past if name != "unix_s"} == {len(past["t_s"])}
    assert len(by) == 6
    assert loop not in by


def test_twelve_watch_and_one_never_reads_and_the_loop_is_not_held(monkeypatch):
    """Views of eight times the size, fifty a second; memory does not grow by the one who does not read: he is dropped.

    What a step of the loop takes is processor time of its thread, the clients' part included: a machine that others
    share makes it late, and not dearer.
    """
    monkeypatch.setattr(connections, "BLOCKED_S", 1.0)

    async def talk(browser, live, page):
        head = f"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1:{browser.port}\r\n\r\n".encode()
        counts = [0] * 12

        async def reads(n):
            reader, writer = await asyncio.open_connection("127.0.0.1", browser.port)
            writer.write(head)
            try:
                while got := await reader.read(65536):
                    counts[n] += got.count(b"event: view")
            finally:
                await hang_up(writer)

        readers = [asyncio.create_task(reads(n)) for n in range(12)]
        deaf = socket.socket()
        deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
        deaf.setblocking(False)
        await asyncio.get_running_loop().sock_connect(deaf, ("127.0.0.1", browser.port))
        await asyncio.get_running_loop().sock_sendall(deaf, head)
        big, peak, held = "w" * 60_000, 0, []
        tracemalloc.start()
        for n in range(400):
            began = time.thread_time()
            live.show(view_at(float(n), why=big), (), None)
            await asyncio.sleep(0.02)
            held.append(time.thread_time() - began)
            peak = max(peak, tracemalloc.get_traced_memory()[0])
            if page.dropped and n > 100:
                break
        tracemalloc.stop()
        for task in readers:
            task.cancel()
        await asyncio.gather(*readers, return_exceptions=True)
        deaf.close()
        return counts, sorted(held), page.dropped, peak

    counts, held, dropped, peak = with_page(talk)
    assert min(counts) > 30
    assert held[int(0.9 * len(held))] < 0.01
    assert dropped == 1
    assert peak < 8_000_000


def test_a_port_in_use_is_one_line():
    async def twice():
        address = Address(host="127.0.0.1", port=free_port())
        async with served(address, LiveSource(name="a")):
            with pytest.raises(JobError, match="the port is in use") as error:
                async with served(address, LiveSource(name="b")):
                    pass
        return str(error.value)

    assert "\n" not in run(twice())


def test_a_host_that_is_none_is_one_line():
    async def whole():
        async with served(Address(host="no-such-host.invalid", port=free_port()), LiveSource(name="a")):
            pass

    with pytest.raises(JobError, match="cannot listen there"):
        run(whole())


def test_files_are_known_by_their_hash_and_packed():
    async def talk(browser, *_):
        first = await browser.get("/index.html", Accept_Encoding="gzip")
        again = await browser.get("/index.html", If_None_Match=first[1]["etag"])
        return first, again, await browser.get("/index.html", "HEAD"), await browser.get("/index.html")

    packed, same, head, plain = with_page(talk)
    assert packed[1]["content-encoding"] == "gzip"
    assert gzip.decompress(packed[2]) == plain[2]
    assert (same[0], same[2]) == (304, b"")
    assert (head[0], head[2], head[1]["content-length"]) == (200, b"", str(len(plain[2])))


def test_blueos_finds_the_page():
    async def talk(browser, *_):
        return await browser.get("/register_service")

    status, _, body = with_page(talk)
    assert status == 200
    assert {"name", "description", "icon", "version", "company"} <= json.loads(body).keys()


def record_of(count, every=1):
    area = AreaView(name="test", origin_lat_deg=50.0, origin_lon_deg=-1.0, lat_m=111_000.0, lon_m=70_000.0, hash="x")
    record = RecordedSource("test", area, is_whole=True, count=count)
    for n in range(count):
        record.take(view_at(float(n)), (event(n + 1),) if n % 100 == every else ())
    record.finish()
    return record


def test_a_voyage_beside_another_is_in_its_metres():
    async def talk(browser, *_):
        return json.loads((await browser.get("/api/beside"))[2]), json.loads((await browser.get("/api/hello"))[2])

    record, other = record_of(5), record_of(5)
    other.area = replace(other.area, origin_lat_deg=record.area.origin_lat_deg + 0.001)
    other.trail.samples = [replace(s, east_m=1.0, north_m=2.0) for s in other.trail.samples]
    record.beside = other
    beside, hello = with_page(talk, record)
    assert hello["beside"] == "test"
    assert set(beside["past"]["north_m"]) == {113.0}  # 111 m to the degree's thousandth
    assert set(beside["past"]["east_m"]) == {1.0}
    assert with_page(lambda browser, *_: browser.get("/api/beside"), record_of(5))[0] == 404


def test_a_voyage_beside_another_over_the_date_line_is_beside_it():
    """They were drawn 40,000 km apart."""
    record, other = record_of(5), record_of(5)
    record.area = replace(record.area, origin_lon_deg=179.9995)
    other.area = replace(other.area, origin_lon_deg=-179.9995)
    other.trail.samples = [replace(s, east_m=0.0, north_m=0.0) for s in other.trail.samples]
    record.beside = other
    made = record.compared()
    assert set(json.loads(made())["past"]["east_m"]) == {round(0.001 * record.area.lon_m, 1)}


def test_a_record_is_read_by_chunks_and_a_day_is_thinned_but_for_what_happened():
    async def talk(browser, record, _):
        hello = json.loads((await browser.get("/api/hello"))[2])
        chunks = [json.loads((await browser.get(f"/api/moments/{n}"))[2]) for n in range(len(record.chunks))]
        return hello, chunks, json.loads((await browser.get("/api/log"))[2]), (await browser.get("/api/stream"))[0]

    hello, chunks, log, stream = with_page(talk, record_of(150))
    assert (hello["kind"], hello["count"], hello["orders"]) == ("recorded", 150, None)
    assert [view["t_s"] for chunk in chunks for view in chunk] == [float(n) for n in range(150)]
    assert len(log) == 2
    assert stream == 404
    day = record_of(20_000)
    assert len(day.times) < 7500
    assert {100.0 * n + 1.0 for n in range(200)} <= set(day.times)
