"""The page of a composed field: it computes what the companion does, in a real browser; small, and asks for nothing."""

import gzip
import json
import math
import re
import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import msgspec
import numpy as np
import pytest

from companion.cli import main
from companion.geofence import load_mission
from companion.geofence.mission import BoatOptions
from companion.mission_check import field_preview, heading_fan
from companion.page.fields import field_page, page_data
from tests.page.browsing import Window, needs_browser
from tests.page.test_javascript import tsc

WEB = Path("companion/page/fields/web")
MIXED = """
name = "mixed"
[start]
lat = 50.8170
lon = -1.3100
[[goal]]
kind = "field"
name = "</script><b>a & b"
lat = 50.8178
lon = -1.3100
field = "max(project(ring) + 2 * (islet + shoal), 0.5 * lane + east) + 0.25 * stay"
[field.ring]
kind = "circle"
lat = 50.8185
lon = -1.3100
radius_m = 60.0
turn = "anticlockwise"
[field.islet]
kind = "repulsive_point"
lat = 50.8180
lon = -1.3105
range_m = 40.0
[field.shoal]
kind = "repulsive_line"
start = { lat = 50.8170, lon = -1.3120 }
end = { lat = 50.8185, lon = -1.3130 }
range_m = 70.0
[field.lane]
kind = "line"
start = { lat = 50.8170, lon = -1.3100 }
end = { lat = 50.8185, lon = -1.3090 }
zone_m = 30.0
[field.east]
kind = "heading"
heading_deg = 80.0
[field.stay]
kind = "station"
lat = 50.8172
lon = -1.3098
[operator]
set_auto = true
guided = true
"""
CASES = {
    "ring": ("field-ring", 1, (5.0, 0.0)),
    "lane": ("field-lane", 1, (8.0, 20.0)),
    "rock": ("field-rock", 1, (3.0, 250.0)),
    "leave": ("field-square", 2, (5.0, 43.0)),
    "motor": ("motor", 3, (5.0, 0.0)),
    "mixed": (None, 1, (6.0, 330.0)),
}


def seen_of(case, tmp_path):
    name, number, wind = CASES[case]
    folder = "missions" if name == "field-ring" else "sitl/missions"
    path = Path(folder, f"{name}.toml") if name else tmp_path / "mixed.toml"
    if name is None:
        path.write_text(MIXED)
    mission = load_mission(path)
    return mission, field_preview(mission, number=number, wind=wind)


def points_of(seen):
    rng = np.random.default_rng(5)
    points = rng.uniform(-seen.half_m, seen.half_m, (40, 2)) + np.asarray(seen.centre_en)
    return np.vstack([points, [seen.here_en, seen.place_en]])


ASK = """
const data = arguments[0], f = data.field, wind = data.wind;
return {
  wanted: arguments[1].map((p) => wantedAt(f, p, wind)),
  right: arguments[1].map((p) => sailableAt(f, p, wind, 1)), left: arguments[1].map((p) => sailableAt(f, p, wind, -1)),
  fans: arguments[1].map((p) => fanAt(f, p, wind)), rose: candidates(f, data.boat, wind)};
"""


def told_by_python(seen):
    points = points_of(seen)
    fan = heading_fan(seen)
    projection = seen.projection
    return {
        "wanted": seen.wanted(points),
        "right": seen.sailable(points, 1),
        "left": seen.sailable(points, -1),
        "fans": None if projection is None else np.column_stack(projection.fan(points)),
        "rose": np.column_stack([fan.headings_rad, fan.speeds_mps, fan.worth_mps]),
    }


def compare(told, seen):
    for name, expected in told_by_python(seen).items():
        if expected is not None:
            pair = np.asarray(told[name]), np.asarray(expected)
            if name == "fans":  # angles: half a turn may be either
                pair = np.exp(1j * pair[0]), np.exp(1j * pair[1])
            assert np.abs(pair[0] - pair[1]).max() < 1e-6, name


@pytest.mark.parametrize("case", CASES)
def test_node_computes_what_the_companion_does(case, tmp_path):
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node here: apt install nodejs")
    mission, seen = seen_of(case, tmp_path)
    ask = ASK.replace("arguments[0]", "given[0]").replace("arguments[1]", "given[1]")
    (tmp_path / "given.json").write_text(json.dumps([page_data(mission, seen, []), points_of(seen).tolist()]))
    script = (
        (WEB / "calc.js").read_text()
        + f"\nconst given = JSON.parse(require('fs').readFileSync({str(tmp_path / 'given.json')!r}));\n"
        + f"console.log(JSON.stringify((() => {{{ask}}})()));"
    )
    (tmp_path / "ask.cjs").write_text(script)
    done = subprocess.run([node, str(tmp_path / "ask.cjs")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    compare(json.loads(done.stdout), seen)


@needs_browser
def test_in_a_browser_the_wind_is_turned_and_the_boat_dragged(tmp_path):
    out = tmp_path / "ring.html"
    assert main(["field", "missions/field-ring.toml", "--page", str(out)]) == 0
    mission, seen = seen_of("ring", tmp_path)
    with Window() as window:
        window.open(out.as_uri())
        told = window.js(ASK, page_data(mission, seen, []), points_of(seen).tolist())
        compare(told, seen)
        assert "The field says 352°" in window.text("told")
        assert "she is steered 047°" in window.text("told")
        assert window.js("return document.querySelectorAll('.arrow')[1].getAttribute('d').length") > 1000
        window.js("const s = document.getElementById('from'); s.value = '180'; s.dispatchEvent(new Event('input'));")
        window.until("return document.getElementById('told').textContent.includes('steered 352°')")
        window.js("document.getElementById('fans').click()")
        window.until("return document.querySelector('.fans').getAttribute('d').length > 1000")
        place = window.js("return document.querySelector('.boat').getAttribute('transform')")
        drag(window, "chart", (0.5, 0.72), (0.55, 0.2))
        window.until("return document.querySelector('.boat').getAttribute('transform') !== arguments[0]", 5.0, place)
        here = window.js("return document.querySelector('.boat').getAttribute('transform')")
        x, y = map(float, re.findall(r"translate\(([\d.]+) ([\d.]+)\)", here)[0])
        assert (x, y) == pytest.approx((550.0, 200.0), abs=5.0)
        done(window, out)


@needs_browser
def test_a_button_switches_to_the_field_of_another_boat(tmp_path):
    out = tmp_path / "ring.html"
    assert main(["field", "missions/field-ring.toml", "--page", str(out), "--other", "avalon"]) == 0
    mission, seen = seen_of("ring", tmp_path)
    other = replace(mission, options=msgspec.structs.replace(mission.options, boat=BoatOptions(polar="avalon")))
    hers = field_preview(other, number=seen.number, wind=CASES["ring"][2])
    with Window() as window:
        window.open(out.as_uri())
        data = page_data(mission, seen, [], ("avalon", other))
        compare(window.js(ASK, {**data, "field": data["other"]["field"]}, points_of(hers).tolist()), hers)
        mine = window.text("told")
        window.js("document.getElementById('other').click()")
        window.until("return document.getElementById('told').textContent !== arguments[0]", 5.0, mine)
        fastest = max(heading_fan(hers).speeds_mps)
        assert f"Outer ring {fastest:.1f} m/s" in window.text("told")
        window.js("document.getElementById('other').click()")
        window.until("return document.getElementById('told').textContent === arguments[0]", 5.0, mine)
        done(window, out)


def test_another_boat_that_is_not_there_is_one_line_and_no_page(tmp_path, capsys):
    out = tmp_path / "ring.html"
    assert main(["field", "missions/field-ring.toml", "--page", str(out), "--other", str(tmp_path / "no.toml")]) == 2
    assert "no such file" in capsys.readouterr().err
    assert not out.exists()


def drag(window, name, begin, end):
    from selenium.webdriver.common.action_chains import ActionChains
    from selenium.webdriver.common.by import By

    chart = window.driver.find_element(By.ID, name)
    width, height = chart.size["width"], chart.size["height"]
    moves = [((x - 0.5) * width, (y - 0.5) * height) for x, y in (begin, end)]
    hand = ActionChains(window.driver)
    hand.move_to_element_with_offset(chart, *moves[0]).click_and_hold()
    hand.move_to_element_with_offset(chart, *moves[1]).release().perform()


def done(window, out):
    """It asked for nothing but itself, and complained about nothing."""
    asked = [a for a in window.requests() if not a.startswith("data:")]
    assert asked in ([], [out.as_uri()]), asked
    assert [e for e in window.driver.get_log("browser") if e["level"] == "SEVERE"] == []


@needs_browser
def test_names_of_others_are_words_and_a_motorboat_has_no_wind(tmp_path):
    for case in ("mixed", "motor", "leave"):
        mission, seen = seen_of(case, tmp_path)
        out = tmp_path / f"{case}.html"
        out.write_bytes(field_page(mission, seen, ["one </script><b>", seen.name]))
        with Window(480, 900) as window:
            window.open(out.as_uri())
            assert window.js("return document.querySelectorAll('b').length") == 0
            assert window.js("return document.getElementById('sailing').hidden") is (case == "motor")
            assert window.js("return document.documentElement.scrollWidth <= innerWidth")
            done(window, out)


def test_it_is_small_and_names_no_other_host(tmp_path):
    mission, seen = seen_of("ring", tmp_path)
    page = field_page(mission, seen, [])
    assert len(gzip.compress(page, 9)) < 16_000
    assert set(re.findall(rb"(?:https?:|wss?:)?//[\w.-]+\.\w+", page)) <= {b"http://www.w3.org"}
    assert not re.search(rb"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function", page)


def test_its_types_hold():
    checker = tsc()
    if checker is None:
        pytest.skip("no tsc here: `npm ci` in tests/page/web brings the one that is pinned")
    found = subprocess.run([checker, "-p", str(WEB)], capture_output=True, text=True, check=False)
    assert found.returncode == 0, found.stdout + found.stderr


def test_the_fan_of_the_page_is_shut_to_windward(tmp_path):
    mission, seen = seen_of("lane", tmp_path)
    data = page_data(mission, seen, [])
    assert data["field"]["noGo"] == pytest.approx(math.radians(47.0))
    assert data["wind"] == {"twd": pytest.approx(math.radians(20.0)), "tws": 8.0}
