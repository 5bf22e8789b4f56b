"""The editor in a real browser: a mission drawn from nothing, saved, checked and sailed; one changed, and changed back.

With $SCREENSHOTS naming a folder, pictures are left there.
"""

from companion import cli
from companion.commands.view import read_record
from companion.geofence import load_mission
from sitl.cli import main as sitl
from tests.editor.asking import edited
from tests.page.browsing import Window, needs_browser
from tests.page.test_browser import is_own, keep

pytestmark = needs_browser

class Board(Window):
    """A window with the editor, and a hand that draws in it."""

    def spot(self, place):
        x, y = self.js("const s = editing.screen(arguments[0]), b = document.getElementById('map')"
                       ".getBoundingClientRect(); return [b.left + s[0], b.top + s[1]]", list(place))
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
        self.js("const f = document.getElementById(arguments[0]); f.value = arguments[1]; "
                "f.dispatchEvent(new Event('input')); f.dispatchEvent(new Event('change'))", name, text)

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
        board.draw("obstacle", (50.8177, -1.3098), (50.8177, -1.3092), (50.81795, -1.3092), (50.81795, -1.3098),
                   (50.8177, -1.3098))
        board.draw("rock", (50.8182, -1.3076))
        board.draw("refuge", (50.8175, -1.3072))
        board.draw("fence", (50.8167, -1.3108), (50.8167, -1.3064), (50.8191, -1.3064), (50.8191, -1.3108))
        board.keys("\ue007")   # Enter closes it
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
    scenario.write_text(f'name = "drawn"\ntitle = "Drawn"\nmission = "{path}"\nlimit_s = 1800.0\n[wind]\nmodel = "ou"\n'
                        'from_deg = 0.0\ntws_mps = 5.0\nsd_deg = 9.0\ntau_s = 28.0\n[expect]\ncontacts = 0\n')
    assert sitl(["run", str(scenario), "--out", str(tmp_path / "v")]) == 0, capsys.readouterr()
    assert read_record(tmp_path / "v").last.state.has_arrived
