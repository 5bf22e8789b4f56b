"""A voyage on record for the browser, with the passage that its mission was planned as."""

import msgspec
import pytest

from companion.commands.view import read_record
from companion.geofence.mission import planned_beside
from companion.view.passage import PlannedIsochrone, PlannedPassage, PlannedWaypoint, PlannedWeather
from sitl.scenario.scenario import EventSpec, Scenario
from tests.view.conftest import sail, write_mission

EPOCH_S = Scenario(name="beat", mission="mission.toml").epoch_s
WAY_M = 100.1


def line_passage():
    """Return a passage from the start of ``sail`` to its mark, for a boat of a third of a metre per second."""
    start, mark = (50.817, -1.31), (50.8179, -1.31)
    ends = {"at_s": (0.0, 300.0), "middle_m": (0.0, WAY_M)}
    hours = ({"early_s": 0.0, "middle_s": 0.0, "late_s": 0.0}, {"early_s": 250.0, "middle_s": 300.0, "late_s": 350.0})
    return PlannedPassage(
        name="to the mark",
        departs_unix_s=EPOCH_S,
        run_unix_s=EPOCH_S - 7200.0,
        until_unix_s=EPOCH_S + 86_400.0,
        members=2,
        runs=10,
        arrived=10,
        low=0.1,
        high=0.9,
        waypoints=(
            PlannedWaypoint(at=start, name="start", band_m=0.0, way_m=0.0, **hours[0]),
            PlannedWaypoint(at=mark, name="landfall", band_m=30.0, way_m=WAY_M, **hours[1]),
        ),
        line=((0.0, *start), (WAY_M, *mark)),
        members_m=((0.0, 0.9 * WAY_M), (0.0, WAY_M)),
        met=(
            PlannedWeather(
                at=(50.8174, -1.31),
                t_s=150.0,
                wind_from_deg=0.0,
                wind_mps=6.0,
                low_mps=5.0,
                high_mps=7.0,
                current_towards_deg=90.0,
                current_mps=0.2,
            ),
        ),
        isochrones=(PlannedIsochrone(hours=0.1, lines=(((50.8176, -1.3105), (50.8176, -1.3095)),)),),
        arrivals_s=(250.0, 270.0, 290.0, 300.0, 310.0, 350.0),
        **ends,
    )


@pytest.fixture(scope="session")
def sailed(tmp_path_factory):
    """A short beat, held by an order on the way."""
    folder = tmp_path_factory.mktemp("sailed")
    planned_beside(write_mission(folder)).write_bytes(msgspec.json.encode(line_passage()))
    return sail(
        folder,
        folder / "voyage",
        EventSpec(at_s=70.0, kind="order", order="hold"),
        EventSpec(at_s=90.0, kind="order", order="go_on"),
    )


@pytest.fixture(scope="session")
def record(sailed):
    return read_record(sailed.folder)
