"""The examples in docstrings are what the code gives."""

import doctest
import importlib
from pathlib import Path

import pytest

MODULES = sorted(
    ".".join(path.with_suffix("").parts).removesuffix(".__init__")
    for top in ("companion", "sitl", "lab", "sailbench")
    for path in Path(top).rglob("*.py")
    if ">>> " in path.read_text(encoding="utf-8")
)


@pytest.mark.parametrize("name", MODULES)
def test_the_examples_of_a_module_hold(name):
    found = doctest.testmod(importlib.import_module(name))
    assert found.attempted
    assert not found.failed
