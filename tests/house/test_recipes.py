"""The recipes of CONTRIBUTING.md, carried out as written in a copy of the tree: what they say is all there is to do.

Of each numbered step the words before a block of code say where it goes: ``a new file `PATH` ``, ``at the end of `NAME`
in `PATH` `` (a table of Python's), ``before `NAME` in `PATH` `` (a definition, a field, or the row of that name), ``to
the imports of `PATH` ``, ``after the row `NAME` in `PATH` `` (of a page's table). Commands are run.
"""

import ast
import os
import re
import shlex
import shutil
import subprocess
import sys
import textwrap
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
# How many files a recipe changes, the line in CHANGELOG.md among them: no more than these.
FILES = {
    "A wind estimator": 4,
    "A planner": 5,
    "A mission key": 5,
    "A safety trigger": 6,
    "A figure": 4,
    "A fence format": 6,
    "A scenario": 2,
}
BLOCK = re.compile(r"^ {3}```(\w+)\n(.*?)^ {3}```\n", re.MULTILINE | re.DOTALL)
COMMAND = re.compile(r"^ {7}(\.venv/bin/.*)$", re.MULTILINE)
PATH, NAME = r"`([\w./-]+\.\w+)`", r"`([^`]+)`"


def steps(title):
    """Return (words before it, language, text) of each block of code and each command of a recipe, in their order."""
    page = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8")
    text = page.partition(f"\n### {title}\n")[2].partition("\n### ")[0]
    found = [(m.start(), m.end(), m[1], textwrap.dedent(m[2])) for m in BLOCK.finditer(text)]
    found += [(m.start(), m.end(), "command", m[1]) for m in COMMAND.finditer(text)]
    last = 0
    for start, end, language, body in sorted(found):
        yield " ".join(text[last:start].split()), language, body
        last = end


def applied(tree, words, body):
    """Put a block where the words before it say; return the file."""
    if m := re.search(rf"[Aa] new file {PATH}:?$", words):
        assert not (tree / m[1]).exists()
        (tree / m[1]).write_text(body, encoding="utf-8")
        return m[1]
    how, name, path = re.search(
        rf"(at the end of|before|after the row|to the imports of) (?:{NAME} in )?{PATH}:?$", words
    ).groups()
    text = (tree / path).read_text(encoding="utf-8")
    lines = text.splitlines(keepends=True)
    if how == "at the end of":
        text = at_the_end(text, name, body)
    elif how == "after the row":
        at = next(n for n, line in enumerate(lines) if re.match(rf"\|( \|)? `?{re.escape(name)}\b", line))
        text = "".join([*lines[: at + 1], body, *lines[at + 1 :]])
    elif how == "to the imports of":
        imports = [node for node in ast.parse(text).body if isinstance(node, ast.Import | ast.ImportFrom)]
        later = [
            n.lineno - 1
            for n in imports
            if lines[n.lineno - 1].startswith("from companion.") and lines[n.lineno - 1] > body
        ]
        at = min(later, default=imports[-1].end_lineno)
        text = "".join([*lines[:at], body, *lines[at:]])
    else:
        said = re.escape(name)
        begins = re.compile(rf"(def |class )?{said}\b| .*\bname=\"{said}\"| +\"?{said}\"?[:=]")
        at = next(n for n, line in enumerate(lines) if begins.match(line))
        margin = lines[at][: len(lines[at]) - len(lines[at].lstrip())]
        text = "".join([*lines[:at], textwrap.indent(body, margin) if margin else f"{body}\n\n", *lines[at:]])
    (tree / path).write_text(text, encoding="utf-8")
    return path


def at_the_end(text, name, body):
    """Return a module's text with lines put before the closing bracket of the table that is bound to a name."""
    node = next(
        n
        for n in ast.parse(text).body
        if name in {t.id for t in getattr(n, "targets", [getattr(n, "target", None)]) if isinstance(t, ast.Name)}
    )
    lines = text.splitlines(keepends=True)
    end = sum(len(line) for line in lines[: node.end_lineno - 1]) + len(
        lines[node.end_lineno - 1].encode()[: node.end_col_offset].decode()
    )
    within = re.search(r"\s*[)\]}]+$", text[:end]).start()
    comma = "" if text[within - 1] in ",([{" else ","
    return f"{text[:within]}{comma}\n{textwrap.indent(body, '    ')}{text[within:end].strip()}{text[end:]}"


@pytest.fixture
def tree(tmp_path):
    """Return a copy of the tree as it stands: what is in version control, or would be."""
    told = subprocess.run(
        ["git", "ls-files", "--cached", "--others", "--exclude-standard"],
        cwd=ROOT,
        check=False,
        capture_output=True,
        text=True,
    )
    names = (
        told.stdout.splitlines()
        if told.returncode == 0
        else [str(p.relative_to(ROOT)) for p in ROOT.rglob("*") if p.is_file() and ".venv" not in p.parts]
    )
    for name in names:
        if (ROOT / name).is_file():
            (tmp_path / "tree" / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(ROOT / name, tmp_path / "tree" / name)
    return tmp_path / "tree"


def run(tree, command):
    """Run a command line of a recipe in the tree, by its own code."""
    program, *rest = shlex.split(command)
    start = [] if program.endswith("/python") else ["-m", Path(program).name]
    rest += ["-p", "no:cacheprovider", "-n0"] if "pytest" in rest else []
    done = subprocess.run(
        [sys.executable, *start, *rest],
        cwd=tree,
        capture_output=True,
        text=True,
        check=False,
        env={**os.environ, "PYTHONPATH": str(tree), "PYTHONSAFEPATH": "1"},
    )
    assert done.returncode == 0, f"{command}\n{done.stdout[-6000:]}\n{done.stderr[-2000:]}"


@pytest.mark.parametrize("title", FILES)
def test_a_recipe_is_followed_to_the_letter(title, tree):
    changed = {"CHANGELOG.md"}
    commands = 0
    for words, language, body in steps(title):
        if language == "command":
            run(tree, body)
            commands += 1
        else:
            changed.add(applied(tree, words, body))
    assert commands
    changed |= {
        str(page.relative_to(tree))
        for page in (tree / "docs").rglob("*.md")
        if page.read_bytes() != (ROOT / page.relative_to(tree)).read_bytes()
    }
    modules = [name for name in changed if name.endswith(".py")]
    if modules:
        run(tree, shlex.join([".venv/bin/python", "-m", "ruff", "check", *modules]))
    assert len(changed) <= FILES[title], sorted(changed)


def test_every_recipe_is_carried_out():
    text = (ROOT / "CONTRIBUTING.md").read_text(encoding="utf-8").partition("\n## Recipes\n")[2]
    assert set(re.findall(r"^### (.+)$", text, re.MULTILINE)) == set(FILES)
