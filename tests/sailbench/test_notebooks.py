"""The notebooks run, cell by cell as Jupyter would; they are committed without outputs."""

import json
from pathlib import Path

import pytest

NOTEBOOKS = sorted(Path("sailbench/notebooks").glob("*.ipynb"))


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda p: p.stem)
def test_a_notebook_runs(path, capsys):
    book = json.loads(path.read_text(encoding="utf-8"))
    names = {"__name__": "__main__"}
    assert (book["nbformat"], book["nbformat_minor"]) == (4, 5)
    for cell in book["cells"]:
        if cell["cell_type"] == "code":
            assert (cell["outputs"], cell["execution_count"]) == ([], None)
            exec(compile("".join(cell["source"]), f"{path.name}#{cell['id']}", "exec"), names)
    assert capsys.readouterr().out


def test_there_are_three():
    assert len(NOTEBOOKS) == 3
