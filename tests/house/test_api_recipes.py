"""The recipes of docs/api.md, run as they stand; of the voyages only the first."""

import re
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "api.md").read_text()
RECIPES = re.findall(r"^```python\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)


@pytest.mark.parametrize("number", range(3))
def test_a_recipe_runs(number, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    exec(compile(RECIPES[number].replace("runs=20", "runs=1"), f"recipe {number}", "exec"), {})
    said = capsys.readouterr().out
    assert re.search(
        (
            r"optimal: \d legs, \d+ m, \d+ s \(at least \d+ s\), [\d.]+ % off the plan",
            r"in 5 min from \d+ \+- \d+ deg",
            r"1\d\d\.\d* \d+",
        )[number],
        said,
    ), said


def test_there_are_three():
    assert len(RECIPES) == 3
