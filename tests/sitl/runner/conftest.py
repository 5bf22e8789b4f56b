"""A user's own scenario."""

import shutil
from pathlib import Path

import pytest

from sitl.runner import job
from sitl.scenario import load_scenario

ROCKS = Path(__file__).parents[3] / "sitl" / "scenarios" / "faults" / "rocks.toml"


@pytest.fixture
def own(tmp_path):
    """A scenario of a user's, its mission and the mission's files in folders of their own."""
    there = load_scenario(ROCKS).mission_path(ROCKS)
    (tmp_path / "own" / "missions").mkdir(parents=True)
    for name, path in job.files_of(ROCKS).items():
        if name and path != there:
            (tmp_path / "own" / "missions" / name).parent.mkdir(exist_ok=True)
            shutil.copy(path, tmp_path / "own" / "missions" / name)
    shutil.copy(there, tmp_path / "own" / "missions" / "mine.toml")
    path = tmp_path / "own" / "mine.toml"
    text = ROCKS.read_text().replace(load_scenario(ROCKS).mission, "missions/mine.toml")
    path.write_text(text.replace("limit_s = 300.0", "limit_s = 20.0"))
    return path
