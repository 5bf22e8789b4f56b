"""The list of long tests: what it names is there, or a test that was renamed would be a short one without a word."""

import pytest

from tests.conftest import ASIDE

LINES = [line for line in ASIDE.read_text().splitlines() if not line.startswith("#")]


@pytest.mark.parametrize("name", LINES)
def test_each_name_is_a_test(name):
    path, _, rest = name.partition("::")
    assert f"def {rest.partition('[')[0]}(" in (ASIDE.parents[1] / path).read_text()


def test_each_stands_once_and_in_order():
    assert sorted(set(LINES)) == LINES
