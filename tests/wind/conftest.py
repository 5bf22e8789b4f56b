"""Winds and boats that the tests make themselves."""

import os
from pathlib import Path

import pytest

from companion.wind import NAMES, make


@pytest.fixture(params=NAMES)
def name(request):
    """Every estimator by name."""
    return request.param


@pytest.fixture
def estimator(name):
    """A new estimator."""
    return make(name)


@pytest.fixture
def wind_data():
    """The folder of recorded wind, when there is one."""
    folder = os.environ.get("COMPANION_WIND_DATA", "")
    if not folder or not any(Path(folder).glob("*.csv")):
        pytest.skip("no recorded wind: set COMPANION_WIND_DATA to a folder of CSV records")
    return Path(folder)
