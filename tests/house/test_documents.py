"""The documents against the code: what is made of it is current, what they name is there, no page is lost."""

import importlib.util
import re
from pathlib import Path

import pytest

from bench import pages, rooms
from bench.layered import implied
from sitl import cli

ROOT = Path(__file__).parents[2]
TOP = ("README.md", "CONTRIBUTING.md", "CHANGELOG.md", "SECURITY.md", "packaging/blueos/README.md")
PAGES = sorted(path for path in (ROOT / "docs").rglob("*.md") if path.parent.name != "api")


@pytest.fixture(scope="module")
def conf():
    """docs/conf.py, as Sphinx reads it."""
    spec = importlib.util.spec_from_file_location("docs_conf", ROOT / "docs" / "conf.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.mark.parametrize("root", rooms.PICTURES)
def test_the_pictures_of_the_rooms_are_current(root):
    assert rooms.PICTURES[root].read_text() == rooms.picture(root), "run: python -m bench.rooms"


@pytest.mark.parametrize("path", pages.made(), ids=lambda path: path.name)
def test_what_is_made_of_the_code_is_current(path):
    assert path.read_text() == pages.made()[path], "run: python -m bench.pages"


def test_the_list_of_rooms_is_current():
    text = rooms.PAGE.read_text()
    assert text == rooms.page(text), "run: python -m bench.rooms"


def test_an_arrow_is_left_out_where_a_longer_way_says_it():
    assert implied({"a": {"b", "c"}, "b": {"c"}, "c": set()}) == {("a", "c")}


def test_rooms_in_a_circle_are_told():
    with pytest.raises(ValueError, match="a circle: a -> b -> a"):
        implied({"a": {"b"}, "b": {"a"}})


def test_every_name_in_the_glossary_is_in_the_code():
    source = "\n".join(file.read_text() for root in rooms.PICTURES for file in (ROOT / root).rglob("*.py"))
    words = set(re.findall(r"\w+", source))
    rows = [
        line.split("|")[-2]
        for line in (ROOT / "docs" / "reference" / "glossary.md").read_text().splitlines()
        if line.startswith("| ") and not line.startswith("|---")
    ]
    names = {name for row in rows for name in re.findall(r"`([^`]+)`", row) if not name.startswith("_en")}
    assert len(names) > 40
    modules = {name for name in names if "." in name}  # below companion, or of the others
    assert names - modules <= words
    paths = {
        m: (ROOT if m.partition(".")[0] in rooms.PICTURES else ROOT / "companion") / m.replace(".", "/")
        for m in modules
    }
    there = [m for m, p in paths.items() if p.with_suffix(".py").is_file() or (p / "__init__.py").is_file()]
    assert sorted(there) == sorted(modules)


def test_every_page_is_in_the_navigation(conf):
    pages = {str(path.relative_to(ROOT / "docs").with_suffix("")) for path in PAGES} - {"index"}
    listed = set(re.findall(r"<(?:\.\./)?([\w/-]+)>", conf.navigation((ROOT / "docs" / "index.md").read_text())))
    assert listed == pages | {"README", "CONTRIBUTING", "CHANGELOG"}


@pytest.mark.parametrize(
    "text",
    [
        '<script src="https://cdn.example/x.js">',
        "<link rel='stylesheet' href='//fonts.example/a.css'>",
        '<img alt="" src="http://badge.example/b.svg">',
        "body{background:url(https://example/c.png)}",
        '@import "//example/d.css";',
    ],
)
def test_a_site_that_would_ask_another_host_is_refused(conf, tmp_path, text):
    (tmp_path / "page.html").write_text(text)
    assert len(conf.foreign_requests(tmp_path)) == 1


def test_a_link_that_a_reader_may_follow_is_no_request(conf, tmp_path):
    (tmp_path / "page.html").write_text('<a href="https://example.org">there</a><img src="b.png"><link href="a.css">')
    assert conf.foreign_requests(tmp_path) == []


@pytest.mark.parametrize("page", ["README.md", *(str(path.relative_to(ROOT)) for path in PAGES)])
def test_every_file_that_a_page_names_is_there(page):
    folders = "companion|sitl|tests|bench|missions|deploy|docs"
    named = re.findall(rf"`((?:{folders})/[\w/.-]+\.\w+)", (ROOT / page).read_text())
    assert [name for name in named if not (ROOT / name).exists()] == []


CODE = [path.relative_to(ROOT) for path in ROOT.glob("[!.]*/**/*.py")]


@pytest.mark.parametrize("page", [str(p.relative_to(ROOT)) for p in PAGES if p.parent.name in {"lab", "reference"}])
def test_every_module_that_a_page_names_without_its_folder_is_there(page):
    """The page of `auto` named five files that had other names by then."""
    named = re.findall(r"`((?:\w+/)*\w+\.py)`", (ROOT / page).read_text())
    assert [name for name in named if not any(path.match(name) for path in CODE)] == []


def invariants():
    """Return the rows of the skipper's table of invariants: (invariant, held in, tests, campaign)."""
    text = (ROOT / "docs" / "reference" / "skipper.md").read_text()
    table = text.partition("\n## Invariants\n")[2].partition("\n## ")[0]
    return [
        tuple(cell.strip() for cell in line.strip("| ").split(" | "))
        for line in table.splitlines()
        if line.startswith("| ") and not line.startswith("| invariant")
    ]


def test_the_table_of_invariants_is_there():
    rows = invariants()
    assert len(rows) >= 10
    assert {len(row) for row in rows} == {4}


@pytest.mark.parametrize("row", invariants(), ids=lambda row: row[0][:40])
def test_an_invariant_names_code_tests_and_a_campaign_that_are_there(row):
    _, held_in, tests, campaign = row
    places = re.findall(r"`(companion/[\w/]+\.py)`(?: \(((?:`\w+`(?:, )?)+)\))?", held_in)
    assert places
    for file, names in places:
        defined = re.findall(r"^\s*(?:def|class) (\w+)|^(\w+)(?:: [^=]+)? = ", (ROOT / file).read_text(), re.MULTILINE)
        assert set(re.findall(r"\w+", names)) <= {name for pair in defined for name in pair}, file
    named = re.findall(r"`(tests/[\w/.]+)`", tests)
    assert named
    assert [name for name in named if not (ROOT / name).exists()] == []
    scenarios = re.findall(r"`([\w-]+)`", tests.partition(";")[2])
    assert [name for name in scenarios if not list((ROOT / "sitl" / "scenarios").rglob(f"{name}.toml"))] == []
    [command] = re.findall(r"`([^`]+)`", campaign)
    program, what, *options = command.split()
    if program == "make":
        assert re.search(rf"^{what}:", (ROOT / "Makefile").read_text(), re.MULTILINE)
    else:
        known = cli.PROGRAM.parser(what).commands[what]._option_string_actions
        assert [o for o in options if o.startswith("--") and o not in known] == []


def anchors(text):
    """Return the anchors of a page's headings, as a forge makes them."""
    heads = re.findall(r"^#+ +(.+)$", re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL), re.MULTILINE)
    said = (re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", head).lower() for head in heads)
    return {re.sub(r"[^\w\- ]", "", head).strip().replace(" ", "-") for head in said}


@pytest.mark.parametrize("page", [*TOP, *(str(path.relative_to(ROOT)) for path in PAGES)])
def test_every_link_leads_somewhere(page):
    text = (ROOT / page).read_text()
    prose = re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)
    lost = []
    for link in re.findall(r"\]\(([^)\s]+)\)", prose):
        file, _, anchor = link.partition("#")
        if ":" in file:
            continue
        there = (ROOT / page).parent / file if file else ROOT / page
        if not there.exists() or (anchor and there.suffix == ".md" and anchor not in anchors(there.read_text())):
            lost.append(link)
    assert lost == []
