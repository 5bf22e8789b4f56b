"""What every test shares: which tests wait to be asked for, and why they were left out."""

import pytest


def pytest_collection_modifyitems(config, items):
    """Leave out, with the reason in the summary, what needs a program that a clone does not bring."""
    if "ardurover" in (config.option.markexpr or ""):
        return
    skip = pytest.mark.skip(reason="sails the real ArduRover: asked for by `pytest -m ardurover` (see `sitl fetch`)")
    for item in items:
        if "ardurover" in item.keywords and item.get_closest_marker("ardurover"):
            item.add_marker(skip)
