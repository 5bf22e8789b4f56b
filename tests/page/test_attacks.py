"""Each attack on the page that is known of such pages, tried on it."""

import asyncio
import contextlib
import json
import stat

import pytest

from companion.clock import run
from companion.errors import InputError
from companion.orders import Answer, Result
from companion.page import LiveSource, connections, read_token
from companion.page.connections import MOST_CONNECTIONS, MOST_HEAD
from companion.page.server import MOST_BODY, MOST_WATCHERS
from tests.page.asking import TOKEN, Asked, hang_up, taking_orders, view_at, with_page


# ----------------------------------------------------------------------------------- names bent to this machine
@pytest.mark.parametrize(
    "host",
    [
        "evil.example",
        "evil.example:{port}",
        "127.0.0.1.evil.example:{port}",
        "localhost.evil.example:{port}",
        "127.0.0.1:1",
        "",
        "localhost:{port}@evil.example",
        "[::1",
        "local host:{port}",
    ],
)
def test_a_name_that_was_bent_to_this_machine_reads_nothing(host):
    async def talk(browser, live, _):
        live.show(view_at(1.0), (), None)
        bent = host.format(port=browser.port)
        return [await browser.get(path, Host=bent) for path in ("/", "/api/hello", "/api/past")]

    for status, _, body in with_page(talk):
        assert status in {400, 421}
        assert b"standard" not in body


def test_a_request_with_two_hosts_or_none_is_refused():
    async def talk(browser, *_):
        own = f"Host: 127.0.0.1:{browser.port}\r\n"
        return (
            await browser.raw(f"GET / HTTP/1.1\r\n{own}Host: evil.example\r\n\r\n".encode()),
            await browser.raw(b"GET / HTTP/1.1\r\n\r\n"),
            await browser.raw(b"GET / HTTP/1.0\r\n\r\n"),
        )

    assert all(answer.startswith((b"HTTP/1.1 400", b"HTTP/1.1 421")) for answer in with_page(talk))


@pytest.mark.parametrize(
    "host",
    [
        "127.0.0.1:{port}",
        "localhost:{port}",
        "LOCALHOST:{port}",
        "[::1]:{port}",
        "10.0.0.7:{port}",
        "blueos.local:{port}",
    ],
)
def test_our_own_names_and_addresses_are_known(host):
    async def talk(browser, *_):
        return await browser.get("/api/hello", Host=host.format(port=browser.port))

    assert with_page(talk, names=("blueos.local",))[0] == 200


# ------------------------------------------------------------------------------------------- pages of others
@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "https://127.0.0.1:{port}",
        "http://127.0.0.1",
        "http://127.0.0.1:{port}.evil.example",
        "http://localhost:{port}",
        None,
    ],
)
def test_an_order_of_a_page_from_elsewhere_is_refused(origin):
    async def talk(browser, *_):
        return await browser.order(Origin=None if origin is None else origin.format(port=browser.port))

    (status, _), orders = taking_orders(talk)
    assert (status, orders) == (403, [])


@pytest.mark.parametrize(("path", "method"), [("/api/stream", "GET"), ("/api/past", "GET"), ("/api/order", "OPTIONS")])
def test_nothing_is_read_by_a_page_from_elsewhere_and_no_slot_is_taken(path, method):
    async def talk(browser, live, _):
        live.show(view_at(1.0), (), None)
        status, headers, _ = await browser.get(path, method, Origin="http://evil.example")
        return status, headers, live.hub.watchers

    status, headers, watchers = with_page(talk)
    assert (status, watchers) == (403, 0)
    assert not any(name.startswith("access-control") for name in headers)


@pytest.mark.parametrize(
    "headers",
    [
        {"X_Companion": None},
        {"X_Companion": "0"},
        {"Content_Type": "text/plain"},
        {"Content_Type": "application/x-www-form-urlencoded"},
        {"Content_Type": None},
    ],
)
def test_what_a_form_can_send_is_no_order(headers):
    async def talk(browser, *_):
        return await browser.order(**headers)

    (status, _), orders = taking_orders(talk)
    assert (status, orders) == (403, [])


def test_every_answer_forbids_frames_and_whatever_is_foreign_and_none_allows_others():
    async def talk(browser, live, _):
        live.show(view_at(1.0), (), None)
        return [await browser.get(path) for path in ("/", "/main.js", "/api/hello", "/nothing", "/register_service")]

    for _, headers, _ in with_page(talk):
        policy = headers["content-security-policy"]
        assert policy.startswith("default-src 'self'")
        assert "frame-ancestors 'none'" in policy
        assert "unsafe" not in policy
        assert headers["x-content-type-options"] == "nosniff"
        assert headers["cross-origin-resource-policy"] == "same-origin"
        assert not any(name.startswith("access-control") for name in headers)


# ------------------------------------------------------------------------------------------------- the token
@pytest.mark.parametrize("path", ["/api/order", "/api/token"])
@pytest.mark.parametrize("token", ["", "wrong", TOKEN[:-1], TOKEN + "x", "ä" * 28])
def test_without_the_token_no_order_is_taken(token, path):
    async def talk(browser, *_):
        return await browser.order(token=token, path=path)

    (status, _), orders = taking_orders(talk)
    assert status in {400, 401}
    assert orders == []


def test_with_it_the_page_is_told_that_it_is_the_one():
    async def talk(browser, *_):
        return await browser.order("", path="/api/token")

    (status, answer), orders = taking_orders(talk)
    assert (status, answer, orders) == (200, {"error": None}, [])


def test_with_it_an_order_is_and_its_answer_comes_back():
    async def talk(browser, *_):
        return await browser.order("hold"), await browser.order("goal 50.8 -1.3", path="/api/preview")

    (given, seen), orders = taking_orders(talk)
    assert given == (200, {"result": "done", "text": "holding"})
    assert seen == (200, {"error": None, "order": "goal 50.80000 -1.30000"})
    assert orders == ["hold"]


def test_what_is_not_permitted_is_the_boats_own_answer():
    async def talk(browser, *_):
        return await browser.order("home")

    refusal = Answer(result=Result.REFUSED, text="not permitted")
    assert taking_orders(talk, Asked(refusal))[0] == (200, {"result": "refused", "text": "not permitted"})


def test_a_page_that_only_shows_takes_none():
    async def talk(browser, *_):
        return await browser.order()

    assert with_page(talk)[0] == 403


@pytest.mark.parametrize(
    "body",
    [
        b"",
        b"{",
        b"[]",
        b'{"order": 5}',
        b'{"order": "fly"}',
        b'{"order": ""}',
        b"\xff",
        b'{"order": "goal 0 0"}',
        b'{"other": "hold"}',
    ],
)
def test_what_is_no_order_is_told_so(body):
    async def talk(browser, *_):
        return await browser.get(
            "/api/order",
            "POST",
            body,
            Origin=f"http://127.0.0.1:{browser.port}",
            Content_Type="application/json",
            X_Companion="1",
            Authorization=f"Bearer {TOKEN}",
        )

    (status, _, answer), orders = taking_orders(talk)
    assert (status, orders) == (400, [])
    assert json.loads(answer)["error"]


def test_no_token_travels_in_an_address():
    async def talk(browser, *_):
        return await browser.order(path=f"/api/order?token={TOKEN}", token="")

    assert taking_orders(talk)[0][0] == 401


def test_a_token_is_made_for_its_owner_alone_and_one_that_others_read_is_refused(tmp_path):
    path = tmp_path / "page.token"
    token = read_token(path)
    assert len(token) >= 32
    assert stat.S_IMODE(path.stat().st_mode) == 0o600
    assert read_token(path) == token
    path.chmod(0o640)
    with pytest.raises(InputError, match="can be read by others"):
        read_token(path)
    path.chmod(0o600)
    for weak in ("short", "two words of enough characters"):
        path.write_text(weak)
        with pytest.raises(InputError, match="is no token"):
            read_token(path)


# ------------------------------------------------------------------------------------------------- rubbish
@pytest.mark.parametrize(
    "rubbish",
    [
        b"\x16\x03\x01\x02\x00\x01\x00\x01\xfc\x03\x03",
        b"\x00" * 500,
        b"GET\r\n\r\n",
        b"{}\r\n",
        b"GET / HTTP/9.9\r\n\r\n",
        b"GET / HTTP/1.1\r\nHost: a\r\n: b\r\n\r\n",
        b"SSH-2.0-x\r\n",
        b"POST /api/order HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Length: -1\r\n\r\n",
        b"POST /api/order HTTP/1.1\r\nHost: a\r\nContent-Length: 5\r\nTransfer-Encoding: chunked\r\n\r\n0\r\n\r\nGET",
        b"GET / HTTP/1.1\r\nHost: 127.0.0.1\r\nX: " + b"a" * (2 * MOST_HEAD) + b"\r\n\r\n",
    ],
)
def test_rubbish_is_answered_or_hung_up_on_and_the_next_is_served(rubbish):
    async def talk(browser, *_):
        answer = await browser.raw(rubbish, at_most_s=2.0)
        return answer, await browser.get("/api/hello")

    answer, (status, _, _) = with_page(talk)
    assert answer == b"" or answer.startswith(b"HTTP/1.1 4")
    assert status == 200


def test_a_body_is_bounded():
    async def talk(browser, *_):
        return await browser.order("hold " * MOST_BODY)

    (status, _), orders = taking_orders(talk)
    assert (status, orders) == (413, [])


@pytest.mark.parametrize(
    "path",
    [
        "/../server.py",
        "/%2e%2e/server.py",
        "/..%2f..%2fetc/passwd",
        "/web/index.html",
        "//etc/passwd",
        "/api/moments/0",
        "/api/moments/-1",
        "/tsconfig.json",
    ],
)
def test_nothing_but_the_pages_files_is_read(path):
    async def talk(browser, *_):
        return await browser.get(path)

    assert with_page(talk)[0] == 404


@pytest.mark.parametrize(
    ("asked", "status", "size"),
    [
        ("bytes=0-9", 206, 10),
        ("bytes=-5", 206, 5),
        ("bytes=0-0,2-2", 200, None),
        ("bytes=" + "0-0," * 3000, 200, None),
        ("bytes=9999999-", 416, 0),
        ("bytes=5-2", 416, 0),
        ("bytes=-", 200, None),
        ("lines=1-2", 200, None),
    ],
)
def test_one_range_is_served_and_never_many(asked, status, size):
    async def talk(browser, *_):
        return await browser.get("/index.html", Range=asked), await browser.get("/index.html")

    (got, headers, body), (_, _, whole) = with_page(talk)
    assert got == status
    assert len(body) == (len(whole) if size is None else size)
    assert int(headers["content-length"]) == len(body)


# --------------------------------------------------------------------------------------------- many and slow
def test_sixteen_watch_and_the_next_is_told_so():
    async def talk(browser, live, _):
        live.show(view_at(1.0), (), None)
        head = f"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1:{browser.port}\r\n\r\n".encode()
        watching = []
        for _ in range(MOST_WATCHERS):
            reader, writer = await asyncio.open_connection("127.0.0.1", browser.port)
            writer.write(head)
            await reader.readuntil(b"event: view")
            watching.append(writer)
        refused = await browser.get("/api/stream")
        await hang_up(watching[0])
        for _ in range(200):
            await asyncio.sleep(0.01)
            if live.hub.watchers < MOST_WATCHERS:
                break
        reader, writer = await asyncio.open_connection("127.0.0.1", browser.port)
        writer.write(head)
        again = await reader.readuntil(b"event: view")
        for each in (*watching, writer):
            await hang_up(each)
        return refused[0], again

    refused, again = with_page(talk)
    assert refused == 503
    assert again


def test_a_request_that_never_ends_is_hung_up_on(monkeypatch):
    monkeypatch.setattr(connections, "REQUEST_S", 0.2)

    async def talk(browser, *_):
        return await browser.raw(b"GET / HTTP/1.1\r\nHost: ", at_most_s=5.0), await browser.get("/api/hello")

    answer, (status, _, _) = with_page(talk)
    assert (answer, status) == (b"", 200)


def posting(browser, size=1000, host=None, origin=None, token=TOKEN, more=""):
    """Return the head of a POST whose body does not come."""
    own = f"127.0.0.1:{browser.port}"
    return (
        f"POST /api/order HTTP/1.1\r\nHost: {host or own}\r\nOrigin: {origin or f'http://{own}'}\r\n"
        f"Content-Type: application/json\r\nX-Companion: 1\r\nAuthorization: Bearer {token}\r\n"
        f"{more or f'Content-Length: {size}'}\r\n\r\n"
    ).encode()


@pytest.mark.parametrize(
    ("wrong", "status"),
    [
        ({"host": "evil.example"}, 421),
        ({"origin": "http://evil.example"}, 403),
        ({"token": "x" * 24}, 401),
        ({"size": MOST_BODY + 1}, 413),
        ({"more": "Transfer-Encoding: chunked"}, 411),
    ],
)
def test_who_may_not_is_told_so_before_a_byte_of_the_body_is_read(wrong, status):
    """A body was read to its end, four megabytes of the editor's, before it was looked at who sends it."""

    async def talk(browser, *_):
        return await browser.raw(posting(browser, **wrong), at_most_s=2.0)

    answer, orders = taking_orders(talk)
    assert (answer[:12], orders) == (f"HTTP/1.1 {status}".encode(), [])


@pytest.mark.parametrize("sent", [b"", b"GET / HTTP/1.1\r\nHost: ", "body"])
def test_sixty_four_who_ask_for_nothing_shut_nobody_out_and_who_watches_stays(sent):
    async def talk(browser, live, _):
        live.show(view_at(1.0), (), None)
        reader, watching = await asyncio.open_connection("127.0.0.1", browser.port)
        watching.write(f"GET /api/stream HTTP/1.1\r\nHost: 127.0.0.1:{browser.port}\r\n\r\n".encode())
        await reader.readuntil(b"event: view")
        idle = []
        for _ in range(MOST_CONNECTIONS):
            _, writer = await asyncio.open_connection("127.0.0.1", browser.port)
            writer.write(posting(browser) if sent == "body" else sent)
            idle.append(writer)
        statuses = [(await browser.get("/api/hello"))[0] for _ in range(3)]
        live.show(view_at(2.0), (), None)
        async with asyncio.timeout(2.0):
            await reader.readuntil(b"event: view")
        for writer in (*idle, watching):
            writer.transport.abort()
        return statuses

    live = LiveSource(name="test", ask=Asked().ask)
    assert with_page(talk, live, TOKEN) == [200, 200, 200]


def test_a_request_that_drips_is_hung_up_on_however_often_a_byte_comes(monkeypatch):
    monkeypatch.setattr(connections, "REQUEST_S", 0.3)

    async def talk(browser, *_):
        reader, writer = await asyncio.open_connection("127.0.0.1", browser.port)
        writer.write(posting(browser))
        gone = asyncio.create_task(reader.read())
        for _ in range(100):
            with contextlib.suppress(ConnectionError):
                writer.write(b" ")
            await asyncio.sleep(0.02)
            if gone.done():
                break
        await asyncio.gather(gone, return_exceptions=True)
        writer.transport.abort()
        return gone.done()

    assert taking_orders(talk)[0]


def test_who_has_waited_the_longest_makes_room_and_who_does_not_read_after_who_does_not_ask():
    class Writer:
        def __init__(self):
            self.transport, self.is_gone = self, False

        def abort(self):
            self.is_gone = True

    async def talk():
        guests, (a, b, c, d, e) = connections.Guests(3), (Writer() for _ in range(5))
        assert [guests.take(each) for each in (a, b, c)] == [True] * 3
        await asyncio.sleep(0.01)
        guests.is_answered(a)
        guests.waits(a, reads=False)
        guests.is_answered(b)
        assert guests.take(d)
        assert guests.take(e)
        assert [each.is_gone for each in (a, b, c, d, e)] == [False, False, True, True, False]
        guests.is_answered(e)
        assert guests.take(c), "and he who does not read"
        guests.is_answered(c)
        assert a.is_gone
        assert not guests.take(d), "who is answered stays"
        guests.leave(b)
        assert guests.take(d)

    run(talk())
