"""The page in a real browser: recorded, packed into a file, live with orders, with the link lost and back.

Nothing may be complained about on its console, and nothing asked for but from its own server. With $SCREENSHOTS naming
a folder, pictures of it are left there.
"""

import asyncio
import contextlib
import copy
import dataclasses
import os
import subprocess
import sys
import threading
import time
from pathlib import Path

import pytest

from companion.clock import run
from companion.commands.view import read_record
from companion.messages import GeoPoint
from companion.page import Address, LiveSource, export, served
from companion.page.charts import open_chart
from companion.view.area import DryingView
from tests.page.asking import Asked, free_port
from tests.page.browsing import Window, needs_browser
from tests.page.charting import mbtiles, share_in_tile, tile_of
from tests.page.conftest import line_passage

pytestmark = needs_browser


@contextlib.contextmanager
def serving(source, token="", port=None, charts=()):
    """Serve a page from a thread; yields its address and a way to run something in its loop."""
    port = port or free_port()
    ready, over = threading.Event(), None
    loops = []

    async def whole():
        nonlocal over
        over = asyncio.Event()
        loops.append(asyncio.get_running_loop())
        async with served(Address(host="127.0.0.1", port=port, token=token), source, charts=charts):
            ready.set()
            await over.wait()

    thread = threading.Thread(target=lambda: run(whole()), daemon=True)
    thread.start()
    assert ready.wait(10.0)
    try:
        yield f"http://127.0.0.1:{port}/", loops[0].call_soon_threadsafe
    finally:
        loops[0].call_soon_threadsafe(over.set)
        thread.join(10.0)


def keep(window, name):
    folder = os.environ.get("SCREENSHOTS")
    if folder:
        Path(folder).mkdir(parents=True, exist_ok=True)
        window.driver.save_screenshot(str(Path(folder) / f"{name}.png"))


def is_own(window, url):
    return [asked for asked in window.requests() if not asked.startswith((url, "data:"))] == []


def test_a_recorded_voyage_is_scrubbed_played_and_read_by_everybody(record):
    with serving(record) as (url, _), Window() as window:
        took = window.open(url)
        assert window.text("name") == "beat"
        window.js("companion.timeline.go(companion.timeline.index(80))")
        window.until("return document.getElementById('phase').textContent === 'holding'")
        assert "hold" in window.text("log")
        assert window.js("return document.querySelectorAll('#map .track path').length") >= 2
        assert window.js("return document.querySelectorAll('#dial .zone').length") == 3
        keep(window, "recorded")
        window.keys("]")
        window.until("return companion.view.t_s > 81")
        later = window.js("return companion.view.t_s")
        window.keys("[")
        window.until("return companion.view.t_s < arguments[0]", 10.0, later)
        window.js("document.getElementById('rate').value = '60'")
        window.keys(" ")
        window.until("return companion.timeline.at === companion.timeline.times.length - 1")
        assert window.text("phase") == "done"
        # what came later is no part of what is shown of a moment
        window.js("companion.timeline.go(companion.timeline.index(60))")
        window.until("return companion.view.t_s < 62")
        assert "done" not in window.js("return document.getElementById('log').firstChild.textContent")
        for palette in ("day", "dusk", "night"):
            window.js(
                "const p = document.getElementById('palette'); p.value = arguments[0]; "
                "p.dispatchEvent(new Event('change'))",
                palette,
            )
            assert window.barriers() == [], palette
            keep(window, f"recorded-{palette}")
        assert window.complaints() == []
        assert is_own(window, url)
        assert took < 5.0


def test_a_chart_lies_under_the_own_water_where_it_belongs(record, tmp_path):
    """The tile that a goal lies in is where the goal is, at every zoom and with every side up."""
    area = record.area
    lat, lon = area.origin_lat_deg, area.origin_lon_deg
    bounds = (lon - 0.02, lat - 0.02, lon + 0.02, lat + 0.02)
    chart = open_chart(mbtiles(tmp_path / "a.mbtiles", bounds=bounds, zooms=range(12, 18)))
    with serving(record, charts=[chart]) as (url, _), Window() as window:
        window.open(url)
        window.js("companion.timeline.go(companion.timeline.index(60))")
        east_m, north_m = window.until("return companion.view && companion.view.boat.at_en_m")
        place = lat + north_m / area.lat_m, lon + east_m / area.lon_m
        for keys in ("a", "f", "w", "n", "+++", "------"):
            window.keys(*keys)
            window.until("return document.querySelectorAll('#map .chart image').length > 0")
            shown = window.until("""
                const all = [...document.querySelectorAll('#map .chart image')];
                const zoom = Math.max(...all.map((i) => Number(i.getAttribute('href').split('/')[3])));
                return all.every((i) => i.getAttribute('href').split('/')[3] == zoom) && zoom""")
            x, y = tile_of(*place, shown)
            inside = window.js(
                """
                return import('/map.js').then(({onScreen}) => {
                  const image = document.querySelector(`#map .chart image[href$="/${arguments[0]}"]`);
                  if (image === null) return null;
                  const at = onScreen([arguments[1], arguments[2]]), m = image.getScreenCTM().inverse();
                  const map = document.getElementById('map').getBoundingClientRect();
                  const p = new DOMPoint(at[0] + map.left, at[1] + map.top).matrixTransform(m);
                  const b = image.getBBox();
                  return [(p.x - b.x) / b.width, (p.y - b.y) / b.height]; })""",
                f"{shown}/{x}/{y}",
                east_m,
                north_m,
            )
            share = share_in_tile(*place, shown)
            assert inside == [pytest.approx(share[0], abs=0.02), pytest.approx(share[1], abs=0.02)], (keys, shown)
        window.keys("a")
        for palette in ("day", "dusk", "night"):
            window.js(
                "const p = document.getElementById('palette'); p.value = arguments[0]; "
                "p.dispatchEvent(new Event('change'))",
                palette,
            )
            time.sleep(0.3)
            assert window.barriers() == [], palette
            assert (window.glaring() == 0) is (palette == "night")
            keep(window, f"chart-{palette}")
        window.keys("?")
        window.until("return document.getElementById('dialog').open")
        assert window.glaring() == 0
        window.click("#dialog button")
        assert "© nobody" in window.text("key")
        window.keys("c")
        assert window.js("return document.querySelectorAll('#map .chart image').length") == 0
        assert window.complaints() == []
        assert is_own(window, url)


def test_units_and_bearings_are_as_one_likes_and_stay_so(record):
    with serving(record) as (url, _), Window() as window:
        window.open(url)
        window.js("companion.timeline.go(companion.timeline.index(60))")
        window.until("return companion.view.boat.sog_mps > 0.5")
        knots = window.js("return document.querySelector('#figures').textContent")
        window.keys("u")
        assert window.js("return document.querySelector('#figures').textContent") != knots
        window.keys("d")
        chosen = window.js("return document.documentElement.dataset.palette")
        window.driver.refresh()
        window.until("return document.body.dataset.ready === '1'")
        assert window.js("return document.documentElement.dataset.palette") == chosen
        assert window.js("return document.getElementById('speeds').value") == "mps"
        for key, up in (("h", "head"), ("w", "wind"), ("n", "north")):
            window.keys(key)
            assert window.js("return document.querySelector('[data-up][aria-pressed=true]').dataset.up") == up
        assert window.complaints() == []


def test_on_a_phone_nothing_is_wider_than_the_screen(record):
    with serving(record) as (url, _), Window(390, 844, phone=True) as window:
        window.open(url)
        window.js("companion.timeline.go(companion.timeline.index(60))")
        window.until("return companion.view.t_s > 59")
        assert window.js("return document.documentElement.scrollWidth") <= 390
        assert (
            window.js(
                "return [...document.querySelectorAll('.scroll')].filter("
                "(box) => box.scrollWidth > box.clientWidth).map((box) => box.id)"
            )
            == []
        )
        assert window.barriers() == []
        keep(window, "phone")
        assert window.complaints() == []


def test_two_voyages_are_seen_beside_each_other_from_setting_sail_on(record, sailed):
    first, second = read_record(sailed.folder), record
    first.beside = second
    with serving(first) as (url, _), Window() as window:
        window.open(url)
        window.js("companion.timeline.go(companion.timeline.index(80))")
        window.until("return companion.view.t_s > 79")
        assert window.js("return document.querySelectorAll('#map .other path').length") > 0
        assert "beside" in window.text("voyagetable")
        assert window.js("return document.querySelectorAll('#stripchart .otherline').length") == 4
        # of one voyage twice the boats lie on each other
        assert window.js(
            "const at = (q) => document.querySelector(q).getAttribute('transform').match(/translate\\(([^)]*)/)[1];"
            "return at('#map .ghost path') === at('#map .boat .hull')"
        )
        keep(window, "beside")
        assert window.complaints() == []


def is_passage_drawn(window):
    return all(
        window.js("return document.querySelectorAll('#map .' + arguments[0]).length", kind) > 0
        for kind in ("pband", "proute", "piso", "ppoint", "pbarb", "pflow", "pmember", "pnow")
    )


def test_a_recorded_voyage_has_the_passage_that_she_was_planned_to_sail(record, tmp_path):
    """True of the moment that is shown, in the folder's page and in one file; it can be put away."""
    (tmp_path / "voyage.html").write_bytes(export(record))
    with serving(record) as (url, _), Window() as window:
        for address in (url, f"file://{tmp_path / 'voyage.html'}"):
            window.open(address)
            window.keys("a")
            for t_s in (60.0, 120.0):
                window.js("companion.timeline.go(companion.timeline.index(arguments[0]))", t_s)
                window.until("return Math.abs(companion.view.t_s - arguments[0]) < 1.5", 10.0, t_s)
                assert is_passage_drawn(window)
                assert "forecast of 06-09 08:13 UTC, 2 h 0" in window.text("passagewords")
                # by its middle run she is so far along after so long: the sign stands there
                north_m = window.js(
                    "return import(arguments[0]).then(({onScreen}) => {"
                    "const at = (q) => { const b = document.querySelector(q).getBBox(); return b.y + b.height / 2; };"
                    "const goal = companion.view.goals[0].at_en_m;"
                    "const [, y0] = onScreen([0, 0]), [, y1] = onScreen(goal);"
                    "return goal[1] * (at('#map .pnow') - y0) / (y1 - y0); })",
                    "/map.js" if address == url else "page/map.js",
                )
                assert north_m == pytest.approx(t_s / 3.0, abs=2.0)
            window.keys("p")
            assert not is_passage_drawn(window)
            window.keys("p")
            assert is_passage_drawn(window)
            keep(window, "recorded-passage")
        assert window.complaints() == []


def test_where_no_passage_can_be_shown_it_is_said_and_of_the_radio_whose_it_is(sailed):
    """Its layer is not there and empty: a line says why."""
    from dataclasses import replace

    from companion.commands.view import NOT_ON_THE_AIR

    view = replace(next(v for v in sailed.views if v.state.is_sailing), source="radio", goals=())
    silent = LiveSource(name="radio", kind="radio", passage_said=NOT_ON_THE_AIR)
    told = LiveSource(name="radio", kind="radio", planned=line_passage())
    with Window() as window:
        for live in (silent, told):
            live.show(view, (), sailed.area)
            with serving(live) as (url, _):
                window.open(url)
                window.until("return document.getElementById('passagewords').textContent !== ''")
                assert window.js("return document.getElementById('passage').hidden") is (live is silent)
                words = window.text("passagewords")
                assert ("a radio brings none" in words) is (live is silent)
                assert ("whether this is what she sails is not on the air" in words) is (live is told)
                assert ("off the route" in words) is (live is told)
                assert window.barriers() == []
                assert window.complaints() == []
                window.driver.get("about:blank")  # before its link is gone


def test_a_voyage_in_one_file_needs_nothing_and_nobody(record, tmp_path):
    path = tmp_path / "voyage.html"
    path.write_bytes(export(record))
    with Window() as window:
        window.open(path.as_uri())
        window.js("companion.timeline.go(companion.timeline.index(80))")
        window.until("return document.getElementById('phase').textContent === 'holding'")
        assert window.complaints() == []
        assert [a for a in window.requests() if not a.startswith(("file:", "data:", "blob:"))] == []
    assert path.stat().st_size < 1_500_000


def test_live_views_are_shown_the_link_is_lost_and_comes_back_and_old_data_look_old(sailed):
    port = free_port()
    live = LiveSource(name="beat", unix_s=0.0)
    moments = [m for m in sailed.moments if m[0].state.is_sailing]
    with Window() as window:
        with serving(live, port=port) as (url, call):
            for view, events in moments[:20]:
                call(live.show, view, events, sailed.area)
            window.open(url)
            window.until("return companion.view !== null")
            for view, events in moments[20:40]:
                call(live.show, view, events, sailed.area)
            window.until("return companion.view.t_s === arguments[0]", 10.0, moments[39][0].t_s)
            assert window.js("return document.body.classList.contains('stale')") is False
            window.until("return companion.past.t_s.length === 40")
            window.driver.refresh()
            window.until("return companion.view !== null && companion.past.t_s.length === 40")
            assert window.complaints() == []
            port_before = live.hub
        # the companion is gone, and comes back at the same port with what it goes on to do
        again = LiveSource(name="beat", unix_s=0.0)
        window.until("return companion.isOver || !companion.isUp")
        assert port_before.is_closed
        window.driver.refresh()  # who reloads meanwhile gets the browser's own page
        with serving(again, port=port) as (url, call):
            for view, events in moments[:50]:
                call(again.show, view, events, sailed.area)
            window.open(url)
            window.until("return companion.view && companion.view.t_s === arguments[0]", 10.0, moments[49][0].t_s)
            # the boat falls silent: the views come on, with its age
            from dataclasses import replace

            call(again.show, replace(moments[50][0], age_s=12.0), (), sailed.area)
            window.until("return document.body.classList.contains('stale')")
            assert "12 s old" in window.text("stale")
            keep(window, "stale")
            window.js("document.documentElement.dataset.palette = 'night'")
            assert window.glaring() == 0
            keep(window, "stale-night")
            assert window.barriers() == []
            assert is_own(window, f"http://127.0.0.1:{port}/")


SMALL = """
    const narrow = ([, b]) => b.width && b.height && (b.width < 40 || b.height < 40 || b.right > innerWidth);
    return [...document.querySelectorAll('button, select')]
      .map((e) => [e.id || e.textContent, e.getBoundingClientRect()]).filter(narrow).map(([name]) => name)"""
CUT = "const e = document.getElementById('instruments'); return e.scrollHeight - e.clientHeight"


def test_fingers_keys_and_eyes_reach_everything(record):
    """The mouse alone moved the chart, buttons were 29 px wide, one lay beyond the edge, the battery was cut."""
    with serving(record) as (url, _), Window(390, 844, phone=True) as window:
        window.open(url)
        assert window.js(SMALL) == []
    with serving(record) as (url, _), Window() as window:
        window.open(url)
        window.js("companion.timeline.go(companion.timeline.index(80))")
        window.until("return companion.view.t_s > 75")
        assert window.js(CUT) <= 1
        middle = "return import('/map.js').then((map) => map.middle().en[0])"
        before = window.js(middle)
        window.js("dispatchEvent(new KeyboardEvent('keydown', {key: 'ArrowRight', shiftKey: true}))")
        assert window.js(middle) > before


def test_a_link_that_breaks_is_said_and_healed_without_a_reload(sailed):
    port = free_port()
    moments = [m for m in sailed.moments if m[0].state.is_sailing]
    live = LiveSource(name="beat", unix_s=0.0)
    for view, events in moments[:10]:
        live.show(view, events, sailed.area)
    with Window() as window:
        with serving(live, port=port) as (url, _):
            window.open(url)
            window.until("return companion.view !== null")
            live.hub.close = lambda: None  # killed: nothing is said
        window.until("return !companion.isUp")
        window.until("return document.body.classList.contains('stale')")
        assert "No link" in window.text("stale")
        again = LiveSource(name="beat", unix_s=0.0)
        for view, events in moments[:30]:
            again.show(view, events, sailed.area)
        with serving(again, port=port):
            window.until("return companion.isUp && companion.view.t_s === arguments[0]", 20.0, moments[29][0].t_s)
            window.until("return companion.past.t_s.length === 30")
            window.until("return !document.body.classList.contains('stale')")


def test_words_of_others_are_shown_as_words(sailed):
    from dataclasses import replace

    from companion.view.values import AlarmView, VesselView

    nasty = "<img src=x onerror=alert(1)><script>alert(2)</script>"
    view = next(v for v in sailed.views if v.state.is_sailing)
    view = replace(
        view,
        name=nasty,
        alarms=(AlarmView(code="x", level="error", text=nasty, age_s=1.0),),
        vessels=(VesselView(name=nasty, at_en_m=(10.0, 10.0), alarm="act", range_m=10.0),),
    )
    live = LiveSource(name=nasty, unix_s=0.0)
    live.show(view, (), sailed.area)
    with serving(live) as (url, _), Window() as window:
        window.open(url)
        window.until("return companion.view !== null && document.querySelector('.alarm')")
        assert window.js("return document.querySelector('.alarm p').textContent") == nasty
        assert window.js("return document.querySelectorAll('img, main script').length") == 0
        assert window.barriers() == []
        assert window.complaints() == []


def test_an_order_asks_for_the_token_once_and_a_wrong_one_is_told(sailed):
    asked = Asked()
    live = LiveSource(name="beat", unix_s=0.0, ask=asked.ask, preview=asked.preview, permitted=("hold", "go_on", "why"))
    view = next(v for v in sailed.views if v.state.is_sailing)
    live.show(view, (), sailed.area)
    with serving(live, token="the-right-token-of-24-letters") as (url, _), Window() as window:
        window.open(url)
        window.until("return companion.view !== null")
        verbs = window.js("return [...document.querySelectorAll('[data-verb]')].map((b) => b.dataset.verb)")
        assert verbs == ["hold", "go_on"]

        def order(*tokens):
            window.click("[data-verb=hold]")
            for n, token in enumerate(tokens):
                window.until("return document.getElementById('token') !== null")
                window.keys(token, "\n")
                if n + 1 < len(tokens):  # refused where it is given
                    window.until("return document.getElementById('tokenanswer').textContent.includes('wrong')")
                    assert window.js("return document.getElementById('confirm')") is None
            window.until("return document.getElementById('confirm') !== null && document.getElementById('dialog').open")
            assert window.barriers() == []
            window.click("#confirm")
            window.until("return !document.getElementById('dialog').open")

        order("a-wrong-token-of-24-letters-x", "the-right-token-of-24-letters")
        window.until("return document.getElementById('answer').textContent.includes('holding')")
        order()
        assert asked.orders == ["hold", "hold"]


def test_the_demonstration_is_watched_live_an_order_is_given_and_obeyed(tmp_path):
    """The companion, the autopilot and the browser are processes of their own."""
    port, token = free_port(), tmp_path / "token"
    done = subprocess.Popen(
        [
            sys.executable,
            "-m",
            "sitl.cli",
            "demo",
            "--seed",
            "3",
            "--speedup",
            "6",
            "--out",
            str(tmp_path / "v"),
            "--http",
            str(port),
            "--http-token",
            str(token),
        ],
        stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE,
    )
    try:
        with Window() as window:
            url = f"http://127.0.0.1:{port}/"
            until_s = time.monotonic() + 90.0
            while True:
                try:
                    window.open(url, 5.0)
                    break
                except Exception:
                    assert time.monotonic() < until_s
                    assert done.poll() is None, done.stderr.read()
                    time.sleep(1.0)
            window.complaints()  # of the time before it listened
            window.until("return companion.view && companion.view.state.is_sailing && companion.view.plan", 60.0)
            window.until("return companion.view.boat.sog_mps > 1")
            keep(window, "live")
            window.click("[data-verb=hold]")
            window.until("return document.getElementById('token') !== null")
            window.keys(token.read_text().strip(), "\n")
            window.until("return document.getElementById('confirm') !== null")
            window.click("#confirm")
            window.until("return companion.view.orders.standing && companion.view.orders.standing.verb === 'hold'")
            window.until("return companion.view.state.phase === 'holding'")
            assert "done" in window.text("answer")
            window.click("[data-verb=home]")  # its plan is seen before it is confirmed
            window.until("return document.querySelector('#preview dl') !== null")
            assert window.js("return document.querySelectorAll('#map .preview path').length") > 0
            keep(window, "preview")
            window.click("#dialog .buttons button:not(.primary)")
            window.driver.refresh()
            window.until("return document.body.dataset.ready === '1' && companion.view !== null")
            window.until("return companion.past.t_s.length > 60")
            window.click("[data-verb=go_on]")  # the token is kept for the window
            window.until("return document.getElementById('confirm') !== null")
            window.click("#confirm")
            window.until("return companion.view.orders.standing === null")
            window.until("return companion.view.state.phase !== 'holding'")
            assert window.complaints() == []
            assert is_own(window, url)
    finally:
        done.terminate()  # a SIGINT is ignored by what was begun in a shell's background
        try:
            done.wait(30.0)
        except subprocess.TimeoutExpired:
            done.kill()
            done.wait()
        done.stderr.close()


def test_water_that_dries_is_as_it_is_at_the_moment_that_is_shown(record):
    opens_s = record.unix_s + 80.0  # of the voyage
    bar = DryingView(
        name="Bar",
        shapes=((((-200.0, 40.0), (200.0, 40.0), (200.0, 90.0), (-200.0, 90.0)),),),
        solid_unix_s=((None, opens_s), (opens_s + 7200.0, None)),
    )
    dried = copy.copy(record)
    dried.area = dataclasses.replace(record.area, drying=(bar,), hash=record.area.hash)
    with serving(dried) as (url, _), Window() as window:
        window.open(url)
        shown = "return document.querySelector('#map .drying path').getAttribute('class') === arguments[0]"
        words = "return document.querySelector('#map text.drying').textContent.startsWith(arguments[0])"
        for at_s, state in ((70, "solid"), (90, "open")):
            window.js("companion.timeline.go(companion.timeline.index(arguments[0]))", at_s)
            window.until(shown, 10.0, state)
            window.until(words, 10.0, f"Bar: {state} until")
            assert window.text("goaltable").count(f"dries: {state} until") == 1
            keep(window, f"drying-{state}")
        look = "return getComputedStyle(document.querySelector(arguments[0])).fill"
        assert window.js(look, "#map .drying path") != window.js(look, "#map .obstacles path")
        assert not window.js("return document.getElementById('dryingkey').hidden")
        assert window.barriers() == []
        assert window.complaints() == []


def test_a_passage_lies_under_her_way_and_says_where_she_should_be():
    """True of the moment: beside her is the middle run, the forecast has its age; and it can be put away."""
    from dataclasses import replace

    from companion.view.area import AreaView
    from companion.view.values import BoatView, GoalView, StateView, View
    from tests.passage.world import T0
    from tests.view.planning import planned

    layer = planned()[2]
    area = AreaView(hash="a", name="line", origin_lat_deg=0.0, origin_lon_deg=0.1, lat_m=110_574.0, lon_m=111_320.0)
    live = LiveSource(name="line", planned=layer)

    def view_at(hours, lon_deg, number, **more):
        # the goals are the waypoints of the route, as its mission has them
        goals = tuple(
            GoalView(
                kind="point", name=w.name, at_en_m=area.frame.en_from_geo(GeoPoint(lat_deg=w.at[0], lon_deg=w.at[1]))
            )
            for w in layer.waypoints[1:]
        )
        boat = BoatView(at_en_m=area.frame.en_from_geo(GeoPoint(lat_deg=0.004, lon_deg=lon_deg)), heading_deg=90.0)
        when = {"t_s": float(number), "unix_s": T0 + 3600.0 * hours, "age_s": 0.0}
        view = View(
            source="live",
            name="line",
            area=area.hash,
            boat=boat,
            goals=goals,
            state=StateView(phase="standard"),
            **when,
        )
        return replace(view, **more)

    with serving(live) as (url, call), Window() as window:
        call(live.show, view_at(2.0, 0.1, 10), (), area)
        window.open(url)
        window.until("return document.querySelectorAll('#map .pband').length === 1")
        window.keys("a")
        assert window.js("return document.querySelectorAll('#map .pmember').length") == 9
        for kind in ("pnow", "pbarb", "pflow", "ppoint", "proute", "piso"):
            assert window.js("return document.querySelectorAll('#map .' + arguments[0]).length", kind) > 0, kind
        said = window.text("passagewords")
        assert "behind the middle run" in said
        assert "forecast of 04-20 00:00 UTC, 2 h 00 old" in said
        assert "8 of 10 between" in window.text("passagebox")
        assert window.js("return document.querySelectorAll('.phist rect').length") >= 4
        call(live.show, view_at(2.1, 0.4, 11), (), area)
        window.until("return document.getElementById('passagewords').textContent.includes('ahead of the middle run')")
        call(live.show, view_at(120.0, 0.4, 12), (), area)
        window.until("return document.getElementById('passagewords').textContent.includes('it ended 24 h 00 ago')")
        assert window.js("return document.querySelectorAll('#map .pnow, #map .pmember').length") == 0
        call(
            live.show,
            view_at(2.2, 0.2, 13, goals=(GoalView(kind="point", name="x", at_en_m=(9000.0, 9000.0)),)),
            (),
            area,
        )
        window.until("return document.getElementById('passagewords').textContent.includes('other goals')")
        call(live.show, view_at(2.2, 0.2, 14, unix_s=None), (), area)
        window.until("return document.getElementById('passagewords').textContent.includes('time is not known')")
        call(live.show, view_at(2.2, 0.2, 15), (), area)
        window.until("return document.querySelectorAll('#map .pnow').length === 1")
        for palette in ("day", "night"):
            window.js("document.documentElement.dataset.palette = arguments[0]", palette)
            assert window.barriers() == [], palette
            assert (window.glaring() == 0) is (palette == "night")
            keep(window, f"passage-{palette}")
        window.js("document.getElementById('numbers').scrollIntoView()")
        keep(window, "passage-numbers")
        window.js("scrollTo(0, 0)")
        # the metres count from elsewhere: the same places are drawn of them
        moved = replace(area, hash="b", origin_lon_deg=0.3)
        call(live.show, view_at(2.3, 0.2, 16, area="b"), (), moved)
        window.until("return companion.area.hash === 'b'")
        window.until("return document.querySelector('#map .proute').getAttribute('d').startsWith('M-33')")
        window.click("#passage")
        assert window.js("return document.querySelectorAll('#map .passagesigns *').length") == 0
        assert window.js("return getComputedStyle(document.querySelector('#map .proute')).visibility") == "hidden"
        window.keys("p")
        window.until("return document.querySelectorAll('#map .passagesigns .pnow').length === 1")
        assert window.complaints() == []
        assert is_own(window, url)
