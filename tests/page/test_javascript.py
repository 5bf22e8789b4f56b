"""The page's JavaScript: its types, its pure functions, its size, and that it asks for nothing from elsewhere."""

import gzip
import hashlib
import json
import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

WEB = Path("companion/page/web")
EDITOR = Path("companion/editor/web")
CHECKS = Path("tests/page/web")
VENDOR = Path("tests/page/vendor")


def tsc():
    """Return the type checker: of $TSC, of npm ci in tests/page/web, or on the PATH."""
    own = CHECKS / "node_modules/.bin/tsc"
    return os.environ.get("TSC") or (str(own.resolve()) if own.exists() else shutil.which("tsc"))


@pytest.mark.parametrize("web", [WEB, EDITOR], ids=["page", "editor"])
def test_its_types_hold(web):
    checker = tsc()
    if checker is None:
        pytest.skip("no tsc here: `npm ci` in tests/page/web brings the one that is pinned")
    done = subprocess.run([checker, "-p", str(web)], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


def test_its_pure_functions():
    node = shutil.which("node")
    if node is None:
        pytest.skip("no node here: apt install nodejs")
    done = subprocess.run(
        [node, "--test", *map(str, sorted(CHECKS.glob("*.test.mjs")))], capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stdout[-3000:] + done.stderr


def test_over_the_wire_it_is_small():
    size = sum(len(gzip.compress(path.read_bytes(), 9)) for path in WEB.iterdir())
    editor = sum(len(gzip.compress(path.read_bytes(), 9)) for path in EDITOR.iterdir())
    assert size < 60_000  # 400 kB are allowed
    assert editor < 40_000  # what it needs of the page beside


def test_no_file_of_it_names_another_host():
    for path in (*WEB.iterdir(), *EDITOR.iterdir()):
        found = set(re.findall(r"(?:https?:|wss?:)?//[\w.-]+\.\w+", path.read_text()))
        assert found <= {"http://www.w3.org"}, path  # the name of SVG, asked for by nobody


def test_words_of_others_never_become_markup():
    markup = re.compile(r"innerHTML|outerHTML|insertAdjacentHTML|document\.write|\beval\(|new Function")
    for path in (*WEB.glob("*.js"), *EDITOR.glob("*.js")):
        assert not markup.search(path.read_text())


def test_what_is_vendored_is_what_its_manifest_says():
    manifest = json.loads((VENDOR / "manifest.json").read_text())
    assert set(manifest) == {path.name for path in VENDOR.glob("*.js")}
    for name, entry in manifest.items():
        assert hashlib.sha256((VENDOR / name).read_bytes()).hexdigest() == entry["sha256"]
        assert (VENDOR / entry["licence_file"]).is_file()
        assert entry["version"]
