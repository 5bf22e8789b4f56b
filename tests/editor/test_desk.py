"""The editor's requests: drafts judged, planned, saved and exported; who may not, and rubbish."""

import asyncio
import base64
import json
import shutil
import time
from pathlib import Path

import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from companion.geofence import load_mission, read
from tests.editor.asking import TOKEN, with_editor


@pytest.fixture
def bay(tmp_path):
    for name in ("bay.toml", "bay.wkt", "bay-shore.wkt", "bay-with-care.toml"):
        shutil.copy(Path("missions") / name, tmp_path / name)
    return tmp_path / "bay.toml"


async def begun(asker):
    status, state = await asker.post("/api/mission")
    assert status == 200, state
    return state


def moved(sketch, lat, lon, goal=0):
    goals = [dict(g) for g in sketch["goals"]]
    goals[goal]["at"] = [lat, lon]
    return {**sketch, "goals": goals}


def test_what_the_page_begins_with(bay):
    async def talk(asker):
        return await begun(asker)

    state = with_editor(bay, talk)
    assert state["file"] == "bay.toml"
    assert not state["is_new"]
    assert {f["name"]: f["shared_by"] for f in state["files"]} == {
        "bay.wkt": ["bay-with-care.toml"],
        "bay-shore.wkt": ["bay-with-care.toml"],
    }
    assert {"plan", "wkt", "gpx", "kml", "geojson", "waypoints"} <= {f["ending"] for f in state["formats"]}
    assert "operator" in state["kept"]
    assert len(state["sketch"]["shapes"]) == len(load_mission(bay).area.obstacles) + 1


def test_a_draft_is_judged_as_the_check_does_and_nothing_is_written(bay):
    before = {p: p.read_bytes() for p in bay.parent.iterdir()}
    island = load_mission(bay).area.obstacles[0].shape.centroid

    async def talk(asker):
        sketch = (await begun(asker))["sketch"]
        good = await asker.post("/api/check", {"sketch": sketch})
        bad = await asker.post("/api/check", {"sketch": moved(sketch, island.y, island.x)})
        plan = await asker.post("/api/plan", {"sketch": moved(sketch, island.y, island.x), "from_deg": 0.0})
        return good, bad, plan

    good, bad, plan = with_editor(bay, talk)
    assert good[0] == 200
    assert good[1]["is_in_order"]
    hatched = shapely.union_all([shapely.Polygon(shape[0], shape[1:]) for shape in good[1]["grown"]])
    for solid in (load_mission(bay).area.obstacles[0].shape, load_mission(bay).area.fence.inclusions[0].shape):
        edge = shapely.transform(solid.exterior, lambda lonlat: lonlat[:, ::-1])
        assert shapely.covers(shapely.buffer(hatched, 1e-7), edge)  # the obstacle's margin, and the fence's
    errors = [f for f in bad[1]["findings"] if f["severity"] == "error"]
    assert (errors[0]["of"], errors[0]["number"]) == ("goal", 0)
    assert "is inside the obstacle" in errors[0]["text"]
    assert "is inside the obstacle" in plan[1]["error"]
    assert {p: p.read_bytes() for p in bay.parent.iterdir()} == before


def test_a_plan_is_made_in_the_wind_that_is_asked_and_a_newer_request_replaces_it(bay):
    async def talk(asker):
        sketch = (await begun(asker))["sketch"]
        await asker.post("/api/plan", {"sketch": sketch, "from_deg": 0.0, "speed_mps": 5.0})  # the worker is warm
        steady = await asker.post("/api/plan", {"sketch": sketch, "from_deg": 0.0, "speed_mps": 5.0})
        spread = await asker.post("/api/plan", {"sketch": sketch, "from_deg": 0.0, "speed_mps": 5.0, "spread_deg": 12})
        many = []
        for n in range(6):
            many.append(
                asyncio.create_task(asker.post("/api/plan", {"sketch": sketch, "from_deg": float(n), "speed_mps": 5.0}))
            )
            await asyncio.sleep(0.05)
        return steady[1], spread[1], [await each for each in many]

    steady, spread, many = with_editor(bay, talk)
    assert steady["error"] == ""
    assert [leg["to"] for leg in steady["legs"]] == ["goal 1, East mark", "goal 2, North mark", "home"]
    assert spread["time_s"] > steady["time_s"]  # a wider no-go zone
    assert many[-1][0] == 200
    assert {status for status, _ in many} == {200, 409}


def test_saving_changes_what_was_changed_and_says_whether_it_is_in_order(bay):
    text, water = bay.read_text(), (bay.parent / "bay.wkt").read_text()

    async def talk(asker):
        state = await begun(asker)
        sketch = moved(state["sketch"], 50.8182, -1.3076)
        saved = await asker.post("/api/save", {"sketch": sketch, "disk": state["disk"]})
        return saved, await asker.post("/api/save", {"sketch": saved[1]["sketch"], "disk": saved[1]["disk"]})

    (status, state), again = with_editor(bay, talk)
    assert status == 200
    assert state["said"].startswith("bay.toml saved: in order")
    assert again[1]["said"].startswith("nothing had changed")
    changed = [(a, b) for a, b in zip(text.split("\n"), bay.read_text().split("\n"), strict=True) if a != b]
    assert [b for _, b in changed] == ["lat = 50.8182", "lon = -1.3076"]
    assert (bay.parent / "bay.wkt").read_text() == water
    assert sorted(p.name for p in bay.parent.iterdir()) == [
        "bay-shore.wkt",
        "bay-with-care.toml",
        "bay.toml",
        "bay.wkt",
    ]


def test_an_island_moved_is_one_line_of_its_file_and_undone_after_saving_the_file_is_as_it_was(bay):
    path = bay.parent / "bay.wkt"
    before = path.read_text()

    async def talk(asker):
        state = await begun(asker)
        sketch = state["sketch"]
        shapes = [dict(s) for s in sketch["shapes"]]
        ring = [[lat + 1e-5, lon] for lat, lon in shapes[0]["rings"][0]]
        shapes[0]["rings"] = [ring]
        saved = await asker.post("/api/save", {"sketch": {**sketch, "shapes": shapes}, "disk": state["disk"]})
        between = path.read_text()
        undone = await asker.post("/api/save", {"sketch": sketch, "disk": saved[1]["disk"]})
        return between, saved[1]["said"], undone

    between, said, undone = with_editor(bay, talk)
    assert said.startswith("bay.wkt saved")
    assert len([1 for a, b in zip(before.split("\n"), between.split("\n"), strict=True) if a != b]) == 1
    assert undone[0] == 200
    assert path.read_text() == before


def test_what_another_program_has_written_is_not_written_over_unasked(bay):
    async def talk(asker):
        state = await begun(asker)
        sketch = moved(state["sketch"], 50.8182, -1.3076)
        bay.write_text(bay.read_text() + "# somebody was here\n")
        refused = await asker.post("/api/save", {"sketch": sketch, "disk": state["disk"]})
        kept = bay.read_text()
        forced = await asker.post("/api/save", {"sketch": sketch, "disk": state["disk"], "is_forced": True})
        return refused, kept, forced

    refused, kept, forced = with_editor(bay, talk)
    assert refused[0] == 409
    assert "bay.toml: changed by another program" in refused[1]["error"]
    assert kept.endswith("# somebody was here\n")
    assert forced[0] == 200
    assert "somebody" not in bay.read_text()


def test_a_mission_from_nothing_has_its_files_beside_it_and_writes_over_none(tmp_path):
    path = tmp_path / "New Bay.toml"
    (tmp_path / "new-bay-obstacles.wkt").write_text("POINT (1 1)\n")
    square = [[50.817, -1.31], [50.817, -1.30], [50.822, -1.30], [50.822, -1.31]]

    async def talk(asker):
        state = await begun(asker)
        sketch = {
            **state["sketch"],
            "start": {"at": [50.818, -1.308]},
            "goals": [{"kind": "point", "at": [50.82, -1.305]}],
            "shapes": [
                {"type": "polygon", "zone": "inclusion", "rings": [square]},
                {"type": "point", "rings": [[[50.819, -1.3065]]], "name": "Rock"},
                {"type": "circle", "rings": [[[50.819, -1.3035]]], "radius_m": 25.0},
            ],
        }
        return state, await asker.post("/api/save", {"sketch": sketch, "disk": state["disk"]})

    state, (status, saved) = with_editor(path, talk)
    assert state["is_new"]
    assert status == 200, saved
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "New Bay.toml",
        "new-bay-fence.wkt",
        "new-bay-obstacles-2.wkt",
        "new-bay-obstacles.geojson",
        "new-bay-obstacles.wkt",
    ]
    assert (tmp_path / "new-bay-obstacles.wkt").read_text() == "POINT (1 1)\n"
    mission = load_mission(path)
    assert mission.name == "New Bay"
    assert len(mission.area.obstacles) == 2
    assert mission.margin_m > mission.margin_floor_m > 0
    assert not mission.operator.set_auto


def test_a_shape_that_names_a_foreign_file_is_written_into_one_of_the_missions_own(bay):
    async def talk(asker):
        state = await begun(asker)
        shapes = [{**s, "of": "../../outside.wkt"} for s in state["sketch"]["shapes"]]
        return await asker.post("/api/save", {"sketch": {**state["sketch"], "shapes": shapes}, "disk": state["disk"]})

    status, state = with_editor(bay, talk)
    assert status == 200
    assert {s["of"] for s in state["sketch"]["shapes"]} == {"bay.wkt", "bay-shore.wkt"}
    assert not (bay.parent.parent.parent / "outside.wkt").exists()


def test_every_format_is_made_of_what_is_drawn(bay, tmp_path):
    async def talk(asker):
        state = await begun(asker)
        out = {}
        for form in state["formats"]:
            out[form["ending"], form["part"]] = await asker.post(
                "/api/export", {"sketch": state["sketch"], "format": form["ending"], "part": form["part"]}
            )
        return out

    made = with_editor(bay, talk)
    written = {key: answer for key, (status, answer) in made.items() if status == 200}
    assert {key[0] for key in written} >= {"plan", "wkt", "ewkt", "gpx", "kml", "kmz", "geojson", "waypoints", "poly"}
    for (ending, part), answer in written.items():
        path = tmp_path / f"out{part}.{ending}"
        path.write_bytes(base64.b64decode(answer["data"]))
        assert not read(path).is_empty, path
    # no word for what it would hold: said in one line
    assert all(status == 422 and "\n" not in answer["error"] for status, answer in made.values() if status != 200)


# ------------------------------------------------------------------------------------------------------ who may not
@pytest.mark.parametrize(
    ("headers", "status"),
    [
        ({"token": "a-wrong-token-of-24-letters"}, 401),
        ({"token": ""}, 401),
        ({"Origin": None}, 403),
        ({"Origin": "http://evil.example"}, 403),
        ({"Host": "evil.example"}, 421),
        ({"X_Companion": None}, 403),
        ({"Content_Type": "text/plain"}, 403),
    ],
)
def test_who_may_not(bay, headers, status):
    before = bay.read_bytes()

    async def talk(asker):
        return [
            (await asker.post(path, {}, **headers))[0]
            for path in ("/api/mission", "/api/check", "/api/plan", "/api/save", "/api/export")
        ]

    assert with_editor(bay, talk) == [status] * 5
    assert bay.read_bytes() == before


def test_who_may_not_is_told_so_before_the_four_megabytes_that_he_sends(bay):
    async def talk(asker):
        head = (
            f"POST /api/save HTTP/1.1\r\nHost: 127.0.0.1:{asker.port}\r\nContent-Length: 4000000\r\n"
            f"Origin: http://127.0.0.1:{asker.port}\r\nContent-Type: application/json\r\nX-Companion: 1\r\n"
        )
        return [
            await asker.raw(f"{head}{more}\r\n".encode(), at_most_s=1.5)
            for more in ("", f"Authorization: Bearer {TOKEN[:-1]}\r\n")
        ]

    assert [answer[:12] for answer in with_editor(bay, talk)] == [b"HTTP/1.1 401"] * 2


def test_a_body_in_chunks_of_a_byte_does_not_hold_the_loop(bay):
    """Each was put behind all before it: 20 ms of the sender's were seconds of the loop's."""

    async def talk(asker):
        head = (
            f"POST /api/check HTTP/1.1\r\nHost: 127.0.0.1:{asker.port}\r\nTransfer-Encoding: chunked\r\n"
            f"Origin: http://127.0.0.1:{asker.port}\r\nContent-Type: application/json\r\nX-Companion: 1\r\n"
            f"Authorization: Bearer {TOKEN}\r\n\r\n"
        )
        begun_s = time.thread_time()
        answer = await asker.raw(head.encode() + b"1\r\n \r\n" * 30_000 + b"0\r\n\r\n", at_most_s=20.0)
        return answer[:12], time.thread_time() - begun_s

    answer, took_s = with_editor(bay, talk)
    assert answer == b"HTTP/1.1 411"
    assert took_s < 0.1


def test_nothing_but_the_page_is_read_without_the_token(bay):
    async def talk(asker):
        paths = (
            "/",
            "/editor.js",
            "/map.js",
            "/style.css",
            "/api/mission",
            "/api/hello",
            "/bay.toml",
            "/../bay.toml",
            "/tsconfig.json",
            "/tiles/000000000000/1/1/1",
        )
        return {path: (await asker.get(path))[0] for path in paths}, (await asker.get("/"))[1]

    status, headers = with_editor(bay, talk)
    assert {path for path, code in status.items() if code == 200} == {"/", "/editor.js", "/map.js", "/style.css"}
    assert "default-src 'self'" in headers["content-security-policy"]


RUBBISH = [
    b"",
    b"{",
    b"[]",
    b"null",
    b"\xff\xfe",
    b"[" * 50_000,
    b'{"sketch": {}}',
    b'{"sketch": {"revision": "none"}}',
    b'{"sketch": {"revision": "x", "goals": [{"kind": "point", "at": [1e400, 0]}]}}',
]


def test_rubbish_is_answered_in_one_line_and_the_editor_lives(bay):
    before = {p: p.read_bytes() for p in bay.parent.iterdir()}

    async def talk(asker):
        state = await begun(asker)
        out = []
        sketch = state["sketch"]
        odd = [
            {**sketch, "goals": [{"kind": "point"}]},
            {**sketch, "goals": [{"kind": "gate"}]},
            {**sketch, "goals": [{"kind": "search", "ring": [[1, 1], [2, 2], [3, 1]]}]},
            {**sketch, "goals": [*sketch["goals"], *sketch["goals"]]},
            {**sketch, "goals": [{**sketch["goals"][0], "key": 99}]},
            {**sketch, "margin_m": -5},
            {**sketch, "laps": 0},
            {**sketch, "name": "x" * 1000},
            {**sketch, "more": 1},
            {**sketch, "goals": [{**sketch["goals"][0], "at": [91, 0]}]},
            {**sketch, "shapes": [{**sketch["shapes"][0], "key": 4000}]},
            {**sketch, "shapes": [sketch["shapes"][0], sketch["shapes"][0]]},
            {**sketch, "shapes": [{"type": "polygon", "rings": []}]},
            {**sketch, "shapes": [{"type": "polygon", "rings": [[]]}]},
            {**sketch, "shapes": [{"type": "point", "rings": [[]]}]},
            {**sketch, "shapes": [{"type": "circle", "rings": [[[1, 1]]]}]},
        ]
        for path in ("/api/check", "/api/plan", "/api/save", "/api/export"):
            for body in RUBBISH:
                out.append((path, body[:40], *await asker.post(path, body=body)))
            for one in odd:
                value = {"sketch": one, "disk": state["disk"], "format": "wkt"}
                if path != "/api/save":
                    out.append((path, str(one)[-60:], *await asker.post(path, value)))
        out.append(("/api/save", "disk", *await asker.post("/api/save", {"sketch": sketch, "disk": "nothing"})))
        out.append(("/api/export", "format", *await asker.post("/api/export", {"sketch": sketch, "format": "exe"})))
        big = await asker.post("/api/check", body=b"[" + b" " * 5_000_000)
        return out, big, await begun(asker)

    out, big, state = with_editor(bay, talk)
    for path, what, status, answer in out:
        assert status in {200, 400, 410, 422}, (path, what, status, answer)
        if status == 200:  # judged: what is wrong with it is a finding, or why there is no plan
            assert path in {"/api/check", "/api/plan", "/api/export"}
            assert path == "/api/export" or answer.get("error") or not answer["is_in_order"], (what, answer)
        else:
            assert "\n" not in answer["error"]
    assert big[0] == 413
    assert state["file"] == "bay.toml"
    assert {p: p.read_bytes() for p in bay.parent.iterdir()} == before


json_values = st.recursive(
    st.none() | st.booleans() | st.floats(allow_nan=False) | st.integers() | st.text(max_size=5),
    lambda inner: (
        st.lists(inner, max_size=3)
        | st.dictionaries(
            st.sampled_from(["sketch", "revision", "goals", "shapes", "kind", "at", "rings", "type"]), inner, max_size=4
        )
    ),
    max_leaves=12,
)


@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(values=st.lists(json_values, min_size=20, max_size=20))
def test_values_of_any_form_are_refused_in_one_line(bay, values):
    async def talk(asker):
        return [await asker.post("/api/save", body=json.dumps(value).encode()) for value in values]

    for status, answer in with_editor(bay, talk):
        assert status == 400
        assert "\n" not in answer["error"]


def test_a_full_disk_loses_nothing(bay):
    import errno

    from companion.clock import run
    from companion.disk import Disk
    from companion.editor.base import read_base
    from companion.editor.desk import EditorApi, PlanPreviews
    from companion.page import Address, listening
    from tests.editor.asking import Asker

    class Full(Disk):
        def write(self, fd, data):
            del fd, data
            raise OSError(errno.ENOSPC, "No space left on device")

    before = {p: p.read_bytes() for p in bay.parent.iterdir()}

    async def whole():
        desk = EditorApi(read_base(bay), TOKEN, PlanPreviews(None), disk=Full())
        async with listening(Address(host="127.0.0.1", port=0), desk) as server:
            asker = Asker(server.address.port)
            state = await begun(asker)
            sketch = moved(state["sketch"], 50.8182, -1.3076)
            return await asker.post("/api/save", {"sketch": sketch, "disk": state["disk"]})

    status, answer = run(whole())
    assert status == 422
    assert "No space left on device" in answer["error"]
    assert {p: p.read_bytes() for p in bay.parent.iterdir()} == before


def test_what_is_out_of_its_range_is_told_by_its_place_and_what_it_may_be(bay):
    """The parser's own sentence was shown: "Expected `float` > 0.0 - at `$.goal[0].radius_m`"."""

    async def talk(asker):
        sketch = (await begun(asker))["sketch"]
        goal, shape = sketch["goals"][0], sketch["shapes"][0]
        odd = [
            {**sketch, "goals": [{**goal, "radius_m": -5.0}]},
            {**sketch, "laps": 0},
            {**sketch, "goals": [{"kind": "field", "at": [50.8, -1.3], "field": "ring", "radius_m": 0.0}]},
            {**sketch, "shapes": [shape, {**shape, "margin_m": -1.0}]},
        ]
        return [(await asker.post("/api/check", {"sketch": one}))[1]["error"] for one in odd]

    said = with_editor(bay, talk)
    assert [words.removeprefix(f"{bay}: ") for words in said] == [
        "[[goal]] 1 radius_m: -5.0 is wrong: expected a number above 0.0",
        "[skipper] laps: 0 is wrong: expected a whole number of at least 1",
        "[[goal]] 1 radius_m: 0.0 is wrong: expected a number above 0.0",
        "this is no sketch: shape 2 margin_m: expected a number of at least 0.0",
    ]
