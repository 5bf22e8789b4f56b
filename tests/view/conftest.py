"""One short beat under the virtual clock, seen live: its steps, its views, its folder."""

from dataclasses import dataclass, field
from pathlib import Path

import pytest

from companion.clock import run_virtual
from companion.compose import config_of, voyage_of
from companion.geofence import load_mission
from companion.telemetry.folder import VoyageFigures
from companion.view import ViewFold
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, Scenario, WindSpec
from tests.one_mark import one_mark

MISSION = one_mark(
    "beat",
    (50.8179000, -1.3100000),
    60.0,
    tables="""orders = ["hold", "go_on", "refuge"]
local_orders = "all"
[[refuge]]
name = "Bay"
lat = 50.8172000
lon = -1.3085000
""",
)
ROCK = "rock|exclusion|POLYGON ((-1.3104 50.8173, -1.3101 50.8173, -1.3101 50.8175, -1.3104 50.8175, -1.3104 50.8173))"


@dataclass
class Seen:
    """A voyage as it was seen live."""

    folder: Path
    mission: Path
    steps: list = field(default_factory=list)
    moments: list = field(default_factory=list)  # (View, events)
    area: object = None

    @property
    def views(self):
        return [view for view, _ in self.moments]

    @property
    def under_way(self):
        return [view for view in self.views if view.state.is_sailing and not view.state.is_over]


def write_mission(folder):
    (folder / "mission.toml").write_text(MISSION)
    (folder / "rock.wkt").write_text(ROCK)
    return folder / "mission.toml"


def sail(folder, out, *events, limit_s=240.0):
    path = write_mission(folder)
    scenario = Scenario(
        name="beat", mission="mission.toml", limit_s=limit_s, wind=WindSpec(from_deg=0.0, sd_deg=6.0), events=events
    )
    mission = load_mission(path)
    fold = ViewFold(voyage_of(mission), config_of(mission), epoch_s=scenario.epoch_s)
    figures, seen = VoyageFigures(), Seen(folder=out, mission=path, area=fold.area)

    def look(status, step):
        figures.take(step, status.clearance_m)
        seen.steps.append(step)
        seen.moments.append(fold.take(step, status, figures))

    run_virtual(run_embedded(scenario, folder / "scenario.toml", 1, out, expansions=3000, on_status=look))
    return seen


@pytest.fixture(scope="session")
def beat(tmp_path_factory):
    """Sailed once: held by an order on the way, and told to go on."""
    folder = tmp_path_factory.mktemp("beat")
    return sail(
        folder,
        folder / "voyage",
        EventSpec(at_s=70.0, kind="order", order="hold"),
        EventSpec(at_s=90.0, kind="order", order="go_on"),
    )
