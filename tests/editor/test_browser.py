"""The editor in a real browser: a mission drawn from nothing, saved, checked and sailed; one changed, and changed back.

With $SCREENSHOTS naming a folder, pictures are left there.
"""

import itertools
import shutil
from pathlib import Path

import msgspec
import pytest

from companion import cli
from companion.commands.view import read_record
from companion.editor import open_waters
from companion.geofence import load_mission
from companion.page import open_charts
from sitl.cli import main as sitl
from tests.editor.asking import edited
from tests.editor.test_water import features
from tests.page.browsing import Window, needs_browser
from tests.page.charting import mbtiles
from tests.page.test_browser import is_own, keep
from tests.view.planning import planned

pytestmark = needs_browser


class Board(Window):
    """A window with the editor, and a hand that draws in it."""

    def spot(self, place):
        x, y = self.js(
            "const s = editing.screen(arguments[0]), b = document.getElementById('map')"
            ".getBoundingClientRect(); return [b.left + s[0], b.top + s[1]]",
            list(place),
        )
        return round(x), round(y)

    def act(self, *moves):
        """Press at the first place, move to the others, let go."""
        from selenium.webdriver.common.action_chains import ActionChains

        chain = ActionChains(self.driver, duration=30)
        pointer = chain.w3c_actions.pointer_action
        pointer.move_to_location(*self.spot(moves[0]))
        pointer.pointer_down()
        for place in moves[1:]:
            pointer.move_to_location(*self.spot(place))
        pointer.pointer_up()
        chain.perform()

    def draw(self, tool, *places):
        self.click(f"[data-tool={tool}]")
        for place in places:
            self.act(place)

    def type_in(self, name, text):
        self.js(
            "const f = document.getElementById(arguments[0]); f.value = arguments[1]; "
            "f.dispatchEvent(new Event('input')); f.dispatchEvent(new Event('change'))",
            name,
            text,
        )

    def settled(self):
        self.until("return editing.found() !== null && !editing.isAsking()")

    def saved(self):
        self.click("#save")
        self.until("return document.getElementById('kept').textContent === 'saved'")


def test_a_mission_drawn_from_nothing_is_saved_checked_and_sailed(tmp_path, capsys):
    path = tmp_path / "drawn.toml"
    with edited(path) as url, Board() as board:
        board.open(url)
        assert "#" not in board.js("return location.href")
        board.until("return document.getElementById('wherelat') !== null")
        board.type_in("wherelat", "50 49.08 N")
        board.type_in("wherelon", "1 18.48 W")
        board.click("#dialog .primary")
        board.until("return !document.getElementById('dialog').open")
        board.draw("start", (50.8172, -1.3100))
        board.draw("goal", (50.8180, -1.3082), (50.8186, -1.3098))
        board.draw(
            "obstacle",
            (50.8177, -1.3098),
            (50.8177, -1.3092),
            (50.81795, -1.3092),
            (50.81795, -1.3098),
            (50.8177, -1.3098),
        )
        board.draw("rock", (50.8182, -1.3076))
        board.draw("refuge", (50.817, -1.3072))
        board.draw("fence", (50.8167, -1.3108), (50.8167, -1.3064), (50.8191, -1.3064), (50.8191, -1.3108))
        board.keys("\ue007")  # Enter closes it
        board.until("return editing.now().shapes.length === 3")
        board.click("#pick-goal-0")
        board.type_in("name-goal-0", "East mark")
        board.click("#pick-shape-0")
        board.type_in("name-shape-0", "Rocky Island")
        board.until("return editing.plan() && editing.plan().legs.length === 2", 60.0)
        assert board.js("return editing.found().is_in_order"), board.text("findings")
        assert board.barriers() == []
        keep(board, "editor-drawn")
        assert not path.exists()
        board.saved()
        assert board.complaints() == []
        assert is_own(board, url.split("#")[0])
    assert sorted(p.name for p in tmp_path.iterdir()) == ["drawn-fence.wkt", "drawn-obstacles.wkt", "drawn.toml"]
    assert "Rocky Island|exclusion|POLYGON" in (tmp_path / "drawn-obstacles.wkt").read_text()
    assert cli.main(["mission", "check", str(path)]) == 0
    assert "in order" in capsys.readouterr().out
    mission = load_mission(path)
    assert [goal.name for goal in mission.goals] == ["East mark", ""]
    assert len(mission.area.obstacles) == 2
    assert len(mission.refuges) == 1
    path.write_text(path.read_text().replace("auto = false", "auto = true").replace("arm = false", "arm = true"))
    scenario = tmp_path / "scenario.toml"
    scenario.write_text(
        f'name = "drawn"\ntitle = "Drawn"\nmission = "{path}"\nlimit_s = 1800.0\n[wind]\nmodel = "ou"\n'
        "from_deg = 0.0\ntws_mps = 5.0\nsd_deg = 9.0\ntau_s = 28.0\n[expect]\ncontacts = 0\n"
    )
    assert sitl(["run", str(scenario), "--out", str(tmp_path / "v")]) == 0, capsys.readouterr()
    assert read_record(tmp_path / "v").last.state.has_arrived


@pytest.fixture
def archipelago(tmp_path):
    for name in ("archipelago.toml", "archipelago.wkt", "archipelago-shore.wkt"):
        shutil.copy(Path("missions") / name, tmp_path / name)
    return tmp_path / "archipelago.toml"


def test_what_is_dragged_typed_and_put_in_order_is_saved_and_undone(archipelago):
    text = archipelago.read_text()
    with edited(archipelago) as url, Board() as board:
        took = board.open(url)
        board.settled()
        first = board.js("return editing.now()")
        board.act((50.8203440, -1.3101419), (50.8202, -1.3105), (50.8201, -1.3108))
        board.until("return Math.abs(editing.now().goals[0].at[1] + 1.3108) < 2e-5")
        board.act((50.8185, -1.3103))  # Great Heron
        board.until("return editing.selected() && editing.selected().of === 'shape'")
        heron = board.js("return editing.now().shapes[editing.selected().n].name")
        assert heron == "Great Heron"
        corners = board.js("return editing.now().shapes[editing.selected().n].rings[0].length")
        corner = board.js("return editing.now().shapes[editing.selected().n].rings[0][0]")
        board.act(corner, (corner[0] + 1e-4, corner[1] + 1e-4))
        board.settled()
        keep(board, "editor-corner")
        board.keys("\ue017")  # Delete: the corner that is chosen
        board.until(
            "return editing.now().shapes[editing.selected().n].rings[0].length === arguments[0]", 5.0, corners - 1
        )
        board.draw("goal", (50.8170, -1.3110))
        board.keys("\ue00c")
        board.type_in("rounding-goal-1", "port")
        board.click("#earlier-goal-1")
        assert board.js("return editing.now().goals.map((g) => g.rounding)") == ["port", None]
        board.type_in("lat-goal-0-at--", "50 49.02 N")
        assert board.js("return editing.now().goals[0].at[0]") == 50.817
        board.type_in("lat-goal-0-at--", "somewhere")
        assert board.js("return editing.now().goals[0].at[0]") == 50.817
        board.settled()
        assert board.barriers() == []
        keep(board, "editor-changed")
        board.click("#help")
        assert board.js("return [document.activeElement.id, document.getElementById('dialog').scrollTop]") == [
            "dialogtitle",
            0,
        ]
        board.keys("\ue00c")
        board.saved()
        goals = [(goal.rounding, goal.point.lat_deg) for goal in load_mission(archipelago).goals]
        assert goals[0] == ("port", 50.817)
        assert "# The demonstration voyage" in archipelago.read_text()
        while not board.js("return document.getElementById('undo').disabled"):
            board.click("#undo")
        assert board.js("return editing.now()") == first
        board.saved()
        assert archipelago.read_text() == text
        assert (archipelago.parent / "archipelago.wkt").read_bytes() == Path("missions/archipelago.wkt").read_bytes()
        assert board.complaints() == []
        assert took < 5.0


def test_a_file_changed_meanwhile_is_told_and_a_lost_editor_too(archipelago):
    with edited(archipelago) as url, Board() as board:
        board.open(url)
        board.settled()
        board.act((50.8203440, -1.3101419), (50.8201, -1.3108))
        archipelago.write_text(archipelago.read_text() + "# somebody\n")
        board.click("#save")
        board.until("return document.getElementById('dialog').open")
        assert "changed by another program" in board.text("dialog")
        assert board.barriers() == []
        keep(board, "editor-changed-meanwhile")
        assert archipelago.read_text().endswith("# somebody\n")
        board.js("document.querySelector('#dialog .buttons button').click()")  # write over it
        board.until("return document.getElementById('kept').textContent === 'saved'")
        assert "somebody" not in archipelago.read_text()
        board.complaints()  # of the 409
    with Board() as board:
        with edited(archipelago) as url:
            board.open(url)
            board.settled()
        board.act((50.8201, -1.3108), (50.8202, -1.3105))
        board.until("return !document.getElementById('trouble').hidden")
        assert "What is drawn is still here" in board.text("trouble")
        assert board.text("kept") == "not saved"
        drawn = board.js("return editing.now().goals[0].at")
        with edited(archipelago, port=int(url.split(":")[2].split("/")[0])):  # begun again at its port
            board.click("#save")
            board.until("return document.getElementById('kept').textContent === 'saved'")
        assert load_mission(archipelago).goals[0].point.lat_deg == drawn[0]


def test_by_keys_alone_a_mark_is_put_and_a_finding_leads_to_its_place(archipelago):
    with edited(archipelago) as url, Board() as board:
        board.open(url)
        board.settled()
        board.js("document.getElementById('map').focus()")
        board.keys("g", "\ue012", "\ue015", " ")  # left, down, a point under the cross
        board.until("return editing.now().goals.length === 2")
        board.keys("\ue00c", "\ue012")  # the tool is put away; what is chosen goes a metre west
        first = board.js("return editing.now().goals[1].at")
        board.keys("\ue012")
        west = board.js("return editing.now().goals[1].at")
        assert west[0] == first[0]
        assert 0.9 < (first[1] - west[1]) * 70_400 < 1.1
        board.settled()
        board.js("document.querySelector('#findings button').click()")
        middle = board.js(
            "const b = document.getElementById('map').getBoundingClientRect(), "
            "s = editing.screen(editing.found().findings[0].at || editing.now().goals[1].at); "
            "return [s[0] - b.width / 2, s[1] - b.height / 2]"
        )
        assert max(map(abs, middle)) < 3
        keep(board, "editor-keys")
        assert board.complaints() == []


def test_by_day_and_by_night_on_a_phone_and_exported(archipelago, tmp_path):
    with edited(archipelago) as url, Board() as board:
        board.open(url)
        board.settled()
        for palette in ("day", "dusk", "night"):
            board.js(
                "const p = document.getElementById('palette'); p.value = arguments[0]; "
                "p.dispatchEvent(new Event('change'))",
                palette,
            )
            assert board.barriers() == [], palette
            assert (board.glaring() == 0) is (palette == "night")
            keep(board, f"editor-{palette}")
        board.click("#export")
        board.js(
            "const f = document.getElementById('format'); f.value = [...f.options].find((o) => "
            "o.textContent.includes('.plan')).value"
        )
        board.click("#make")
        board.until("return document.getElementById('download') !== null")
        assert board.js("return document.getElementById('download').download") == "archipelago.plan"
        assert board.barriers() == []
        keep(board, "editor-export")
        assert board.complaints() == []
    with edited(archipelago) as url, Board(390, 844, phone=True) as board:
        board.open(url)
        board.settled()
        assert board.js("return document.documentElement.scrollWidth") <= 390
        assert board.barriers() == []
        keep(board, "editor-phone")
        board.js("document.getElementById('name').textContent = 'wanaka.toml'")
        board.js("const kept = document.getElementById('kept'); kept.textContent = 'not saved'")
        # a name of a file is in one line: it was broken, and its last letter alone in the next
        assert board.js("return document.getElementById('name').getClientRects().length") == 1
        assert board.js("return document.getElementById('name').clientHeight") < 30
        board.js("document.getElementById('pick-goal-0').click()")
        board.js("document.getElementById('course').scrollIntoView()")
        keep(board, "editor-phone-tables")
        assert board.complaints() == []


@pytest.mark.parametrize("window", [{}, {"width": 390, "height": 844, "phone": True}])
def test_where_a_course_ends_where_it_begins_each_word_can_be_read(window):
    """The lake's last goal, its safe end, is 5 m from its start."""
    with edited(Path("missions") / "lake.toml") as url, Board(**window) as board:
        board.open(url)
        board.settled()
        words = board.js(
            "return [...document.querySelectorAll('#map text.word')].map((word) => { "
            "const r = word.getBoundingClientRect();"
            "return [word.textContent, r.left, r.top + 3, r.right, r.bottom - 3]; })"
        )
    assert {"start", "safe end"} <= {word for word, *_ in words}
    for (one, *a), (other, *b) in itertools.combinations(words, 2):
        assert a[2] <= b[0] or b[2] <= a[0] or a[3] <= b[1] or b[3] <= a[1], (one, other)


def test_a_chart_lies_under_the_drawing_and_an_empty_mission_begins_on_it(tmp_path):
    chart = tmp_path / "chart.mbtiles"
    mbtiles(chart)
    with edited(tmp_path / "m.toml", charts=open_charts([chart])) as url, Board() as board:
        board.open(url)
        board.until("return document.querySelectorAll('#map image').length > 0")
        assert not board.js("return document.getElementById('dialog').open")
        board.draw("start", (50.70, -1.80))
        assert board.js("return editing.now().start.at[0]") == pytest.approx(50.70, abs=1e-4)
        keep(board, "editor-chart")
        assert board.barriers() == []
        assert board.complaints() == []
        assert is_own(board, url.split("#")[0])


# Pan by so many pixels a frame, and tell what each frame cost [ms] and what was painted.
PAN = """
const [scale, steps, done] = arguments, m = editing.map, w = editing.water, before = w.figures.paintings;
m.zoom(scale / m.middle().scale);
const from = m.middle().en, took = [];
let n = 0, corners = 0;
function step() {
  const now = performance.now();
  corners = Math.max(corners, w.figures.corners);
  if (n++ >= steps) return done({ took: took.sort((a, b) => a - b), corners, paintings: w.figures.paintings - before });
  m.centre([from[0] + 100 * Math.sin(n / 12) / scale, from[1] + 100 * Math.sin(n / 19) / scale]);
  took.push(performance.now() - now);
  requestAnimationFrame(step);
}
requestAnimationFrame(step);
"""
PIXEL = (
    "const c = document.getElementById('water'), d = c.getContext('2d'); "
    "return [...d.getImageData(Math.round(c.width * arguments[0]), Math.round(c.height * arguments[1]), 1, 1).data]"
)


def test_a_new_mission_on_a_phone_draws_nothing_and_has_its_water_from_the_chart(tmp_path):
    """The chart lies below in its own colours, and is moved with the water at what a phone has for a frame."""
    (tmp_path / "bay.geojson").write_text(features())
    waters = open_waters([tmp_path / "bay.geojson"])
    with edited(tmp_path / "m.toml", waters=waters) as url, Board(390, 844, phone=True) as board:
        board.driver.set_script_timeout(60)
        board.open(url)
        first = board.js("return document.querySelector('#dialog button').textContent")
        assert first == "Draw nothing: use the chart"
        for name, value in (("wherelat", "50.82"), ("wherelon", "-1.31"), ("chartreach", "1500"), ("chartfree", "2")):
            board.type_in(name, value)
        assert board.barriers() == []
        board.click("#takechart")
        board.until("return !document.getElementById('dialog').open")
        board.until("return !editing.water.isBusy()")
        assert "3 obstacles of bay.geojson" in board.text("hint")
        assert board.js("return editing.now().shapes.length") == 4
        keep(board, "editor-water")
        day = board.js(PIXEL, 0.5, 0.42)
        board.js(
            "const f = document.getElementById('palette'); f.value = 'night'; f.dispatchEvent(new Event('change'))"
        )
        board.until("return !editing.water.isBusy()")
        night = board.js(PIXEL, 0.5, 0.42)
        assert sum(day[:3]) > 300 > 120 > sum(night[:3])
        assert night[0] > 2 * night[2], "red alone"
        assert board.glaring() == 0
        keep(board, "editor-water-night")
        told = board.driver.execute_async_script(PAN, 0.5, 120)
        # Of 16.7 ms: what the page itself spends on a frame in which the water moves. Most frames paint nothing anew.
        assert told["took"][60] < 8.0
        assert told["paintings"] < 40
        assert told["corners"] < 50_000
        board.click("#whole")
        board.draw("start", (50.8150, -1.3110))
        board.draw("goal", (50.8250, -1.3150))
        board.until("return editing.now().goals.length === 1 && editing.found().is_in_order")
        board.saved()
        assert board.barriers() == []
        assert [line for line in board.complaints() if "getImageData" not in line] == []  # of this test's own looking
        assert is_own(board, url.split("#")[0])
    assert len(load_mission(tmp_path / "m.toml").area.obstacles) == 3


def test_water_that_dries_is_drawn_with_its_hours_from_when_the_table_begins(tmp_path):
    for name in ("tide-gate.toml", "tide-gate-water.geojson", "tide-gate-drying.geojson", "tide-gate.csv"):
        shutil.copy(Path("sitl/missions") / name, tmp_path)
    with edited(tmp_path / "tide-gate.toml") as url, Board() as board:
        board.open(url)
        assert board.js("return document.querySelector('#map .drying path').getAttribute('class')") == "solid"
        said = board.js("return document.querySelector('#map text.drying').textContent")
        assert said == "The bar (drying height): solid until 08:32 UTC"
        assert "as it is at 2026-06-09 05:34 UTC" in board.text("dryingkey")
        keep(board, "editor-drying")
        assert board.barriers() == []
        assert board.complaints() == []


def test_the_passage_that_a_mission_was_planned_as_lies_under_it(tmp_path):
    """Only shown: a mark that is moved is said to be no place of it, and what cannot be read is one line."""
    from companion.geofence.mission import toml
    from companion.passage.mission import mission_of

    asked, found, drawn = planned()
    path, beside = tmp_path / "m.toml", tmp_path / "m.passage.json"
    path.write_text(toml(mission_of(found.route, asked, "line")))
    beside.write_bytes(msgspec.json.encode(drawn))
    with edited(path) as url, Board() as board:
        board.open(url)
        board.until("return document.querySelectorAll('#map .pband').length === 1")
        for kind in ("pbarb", "pflow", "ppoint", "proute"):
            assert board.js("return document.querySelectorAll('#map .' + arguments[0]).length", kind) > 0, kind
        assert board.js("return document.querySelectorAll('#map .pnow, #map .pmember').length") == 0
        said = board.text("passagewords")
        assert "forecast of 04-20 00:00 UTC" in said
        assert "other goals" not in said
        assert "8 of 10 between" in board.text("passagebox")
        for palette in ("day", "night"):
            board.js("document.documentElement.dataset.palette = arguments[0]", palette)
            assert board.barriers() == [], palette
            keep(board, f"editor-passage-{palette}")
        board.draw("goal", (0.1, 0.25))
        board.until("return document.getElementById('passagewords').textContent.includes('other goals')")
        board.click("#passage")
        assert board.js("return document.querySelectorAll('#map .passagesigns *').length") == 0
        before = beside.read_bytes()
        board.saved()
        assert beside.read_bytes() == before
        assert board.complaints() == []
        beside.write_text("{")
        board.driver.get("about:blank")
        board.open(url)
        board.until("return document.getElementById('passagewords').textContent.includes('is no planned passage')")
        assert board.js("return document.getElementById('passage').hidden")
