"""A voyage on record for the browser."""

import pytest

from companion.commands.view import read_record
from sitl.scenario.scenario import EventSpec
from tests.view.conftest import sail


@pytest.fixture(scope="session")
def sailed(tmp_path_factory):
    """A short beat, held by an order on the way."""
    folder = tmp_path_factory.mktemp("sailed")
    return sail(
        folder,
        folder / "voyage",
        EventSpec(at_s=70.0, kind="order", order="hold"),
        EventSpec(at_s=90.0, kind="order", order="go_on"),
    )


@pytest.fixture(scope="session")
def record(sailed):
    return read_record(sailed.folder)
