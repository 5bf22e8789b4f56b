"""A companion that is killed and started again: what is told of the voyage is of all its lives."""

from __future__ import annotations

import pytest

from sitl.run.embedded import of_all_lives

FIRST = {"replans": 8, "no_go_entries": 1, "promised_risk": 0.2, "promised_clearance_m": 7.7, "arrived": False}
LAST = {"replans": 1, "no_go_entries": 0, "promised_risk": 0.1, "promised_clearance_m": 10.9, "arrived": True}
ALL = {"replans": 9, "no_go_entries": 1, "promised_risk": 0.2, "promised_clearance_m": 7.7, "arrived": True}
SILENT = {"replans": 0, "promised_risk": None, "promised_clearance_m": None}


@pytest.mark.parametrize(
    ("lives", "told"), [((FIRST, LAST), ALL), ((SILENT, LAST), LAST), ((LAST,), LAST), ((), LAST), (({}, LAST), LAST)]
)
def test_counts_and_promises_are_those_of_all_lives(lives, told):
    """ "1 replan" was said of 9, and "promised 10.9 m" where a plan before the kill had 7.7."""
    assert of_all_lives(LAST, lives) == told
