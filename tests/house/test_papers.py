"""docs/lab/papers.md against the code: files and tests that it names are there, no part of a paper is left out."""

import ast
import re
from functools import cache
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAPERS = ("Wolsieffer 2020", "Büsser 2009", "Schmitt 2013")
FILE = re.compile(r"`((?:companion|sitl|lab|sailbench|bench|docs|missions)/[\w./-]+)`")
TEST = re.compile(r"`(tests/[\w./-]+\.py)::(\w+)`")


def chapter(paper):
    """Return a paper's parts as they are listed, and the rows of its table as four cells each."""
    text = (ROOT / "docs" / "lab" / "papers.md").read_text()
    body = text.split(f"\n## {paper}\n")[1].split("\n## ")[0]
    listed = re.search(r"\nParts: (.+?)\.\n\n", body, re.DOTALL)
    lines = [line for line in body.splitlines() if line.startswith("| ")]
    rows = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]
    return parts(listed[1]), rows[1:]


def parts(text):
    return [part.strip() for part in text.replace("\n", " ").split(",")]


@cache
def functions_of(file):
    """Return the names of the functions in a file."""
    tree = ast.parse((ROOT / file).read_text())
    return {node.name for node in ast.walk(tree) if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)}


@pytest.mark.parametrize("paper", PAPERS)
def test_no_part_is_without_a_row_and_no_row_is_of_no_part(paper):
    listed, rows = chapter(paper)
    assert len(listed) == len(set(listed)) > 30
    assert {part for row in rows for part in parts(row[0])} == set(listed)


@pytest.mark.parametrize("paper", PAPERS)
def test_every_file_and_every_test_is_there(paper):
    for row in chapter(paper)[1]:
        assert len(row) == 4, row
        _, where, tested, _ = row
        assert [name for name in FILE.findall(where) if not (ROOT / name).is_file()] == []
        assert where.count("`") == 2 * len(FILE.findall(where)), row
        named = TEST.findall(tested)
        assert [f"{file}::{name}" for file, name in named if name not in functions_of(file)] == []
        assert tested.count("`") == 2 * len(named), row


@pytest.mark.parametrize("paper", PAPERS)
def test_a_row_without_a_test_says_so_and_a_row_without_code_has_nothing_but_words(paper):
    for part, where, tested, deviates in chapter(paper)[1]:
        assert tested == "no test" or TEST.search(tested), part
        assert where or deviates, part
