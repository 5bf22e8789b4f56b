"""``make measured``: what it makes of a page, and that the pages' marks are ones that it sees."""

import datetime as dt
import importlib.util
import re
import shlex

import pytest

from bench.measured import again, ages
from tests.house.test_typed import PAGES, PROGRAMS

PAGE = """Before.

<!-- measured: sitl faults --runs 3 | tail -n 1 -->

```text
old
```

*2026-01-01, commit 1234567, 9 s.*

Between.

<!-- measured: python -m bench.traffic -->

```text
old, too
```

*2026-01-01, commit 1234567, 9 s.*

After.
"""
MARKS = [(page, command) for page in PAGES for command in re.findall("<!-- measured: (.+) -->", page.read_text())]


def test_a_block_becomes_what_its_command_prints_and_the_rest_stays():
    text = again(PAGE, lambda command: (f"new of {command.split()[0]}\n", 2.4), "2026-11-25, commit abc")
    assert (
        text.replace("$ sitl faults --runs 3 | tail -n 1\nnew of sitl", "old")
        .replace("$ python -m bench.traffic\nnew of python", "old, too")
        .replace("2026-11-25, commit abc, 2 s", "2026-01-01, commit 1234567, 9 s")
        == PAGE
    )
    assert text.count("new of") == text.count("commit abc, 2 s") == 2


def test_a_command_that_fails_or_is_not_asked_for_leaves_its_block():
    assert again(PAGE, lambda _: None, "now") == PAGE
    asked = []
    again(PAGE, asked.append, "now", ("traffic", "page"))
    assert asked == ["python -m bench.traffic"]


def test_what_is_measured_by_hand_is_listed_with_its_age_the_oldest_first():
    pages = {"a.md": "<!-- by hand: 2026-11-20: sitl x --runs 9 -->", "../b.md": "<!-- by hand: 2026-11-18: y -->"}
    table = ages(pages, dt.date(2026, 11, 25))
    assert table.splitlines()[3:-1] == [
        "| `y` | [b](../b.md) | 2026-11-18 | 7 |",
        "| `sitl x --runs 9` | [a](a.md) | 2026-11-20 | 5 |",
    ]


def test_every_mark_has_a_block_behind_it():
    seen = []
    for page in PAGES:
        again(page.read_text(), seen.append, "now")
    assert seen == [command for _, command in MARKS]
    assert len(seen) > 5


@pytest.mark.parametrize("command", [command for _, command in MARKS])
def test_a_marked_command_is_one_that_there_is(command):
    program, *words = shlex.split(command.partition(" | ")[0])
    if program == "python":
        assert importlib.util.find_spec(words[1])
    else:
        PROGRAMS[program].parser(words[0]).parse_args(words)
