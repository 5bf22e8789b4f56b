"""A disk that is full, sick or read-only under way: the boat sails on, says so, and records again when it can.

Whole voyages under the virtual clock on a disk that fails as Linux says it (``sitl.faults.computer_faults``); a real
full file system and a real read-only one are in test_recorder.py and test_run_process.py.
"""

import csv
import json
import shutil
from pathlib import Path

import pytest

from companion import cli
from companion.app import sail as app
from companion.app.options import SailOptions, at_once
from companion.clock import run_virtual
from companion.commands.run import outcome_of
from companion.geofence import load_mission
from companion.mavlink.wire.frames import Codec
from companion.planner.worker import InlinePlanner
from companion.replay import replay
from companion.telemetry.folder.recorder import read_jsonl
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, Scenario, WindSpec
from sitl.world.environment import Constant
from tests.one_mark import one_mark

# A reach of 200 m past a rock.
MISSION = one_mark("reach", (50.8170000, -1.3071600), 90.0)
ROCK = "rock|exclusion|POLYGON ((-1.3088 50.8167, -1.3085 50.8167, -1.3085 50.8169, -1.3088 50.8169, -1.3088 50.8167))"


class Shore:
    """Hears what the companion says on its link."""

    def __init__(self):
        self.link, self.bytes = None, bytearray()

    def truth(self, t_s, autopilot, link):
        if self.link is None:
            self.link, write = link, link.near.write
            link.near.write = lambda data: (self.bytes.extend(data), write(data))[1]

    def life(self, start_s, end_s):
        pass

    @property
    def said(self):
        messages = Codec(1, 191).feed(bytes(self.bytes))
        return "".join(m.text for m in messages if m.get_type() == "STATUSTEXT")  # in parts of 50 letters


@pytest.fixture(scope="module")
def short(tmp_path_factory):
    folder = tmp_path_factory.mktemp("short")
    (folder / "mission.toml").write_text(MISSION)
    (folder / "rock.wkt").write_text(ROCK)
    return folder


def sail(short, out, *events, limit_s=600.0, exit_on_arrival=True):
    scenario = Scenario(
        name="reach",
        mission="mission.toml",
        limit_s=limit_s,
        events=events,
        wind=WindSpec(sd_deg=6.0),
        exit_on_arrival=exit_on_arrival,
        expect=ExpectSpec(min_clearance_m=2.0),
    )
    shore = Shore()
    verdict = run_virtual(run_embedded(scenario, short / "scenario.toml", 1, out, expansions=4000, observer=shore))
    return verdict, shore


@pytest.mark.parametrize("state", ["full", "sick", "read_only"])
def test_a_voyage_outlives_its_disk_and_is_recorded_again_when_it_is_well(state, short, tmp_path):
    """The state's OSError ended the companion, the boat under way."""
    verdict, shore = sail(short, tmp_path, EventSpec(at_s=40.5, kind="disk", state=state, for_s=30.0))
    assert verdict.passed, verdict.checks
    summary = json.loads((tmp_path / "summary.json").read_bytes())
    assert summary["arrived"] is True
    assert summary["records_dropped"] > 100
    assert summary["disk_trouble"] == ""
    gaps = [d for d in read_jsonl(tmp_path / "decisions.jsonl") if d["kind"] == "gap"]
    assert len(gaps) == 1
    assert 38.0 <= gaps[0]["since_s"] <= 46.0
    assert gaps[0]["t_s"] - gaps[0]["since_s"] < 40.0
    assert gaps[0]["dropped"] == summary["records_dropped"]
    assert "nothing is recorded" in shore.said
    assert "sailing on" in shore.said
    assert "the disk is well again" in shore.said
    report = replay(tmp_path)
    assert not report.differences
    assert report.steps > 30
    assert report.unrecorded > 20


def test_started_again_on_a_full_disk_it_takes_over_by_the_mark_in_its_mission(short, tmp_path):
    """Not even the restart got through: exit code 1, again and again."""
    verdict, _ = sail(
        short,
        tmp_path,
        EventSpec(at_s=20.0, kind="disk", state="full"),
        EventSpec(at_s=70.0, kind="kill_companion", restart_after_s=4.0),
    )
    assert verdict.passed, verdict.checks
    # of the first life nothing after the 20th second, of the second nothing at all
    rows = (tmp_path / "track.csv").read_text().splitlines()
    assert float(rows[-1].split(",")[0]) < 25.0


def test_a_disk_that_is_never_well_from_the_beginning(short, tmp_path):
    verdict, shore = sail(short, tmp_path / "v", EventSpec(at_s=0.0, kind="disk", state="read_only"))
    assert verdict.passed, verdict.checks
    assert "no state for a restart is saved: Read-only file system" in shore.said


def test_a_mission_that_has_arrived_says_what_would_sail_it_again(short, tmp_path):
    """It ended with "arrived; 0 s"."""
    assert sail(short, tmp_path)[0].passed
    first = json.loads((tmp_path / "summary.json").read_bytes())
    assert outcome_of("reach", first)[0] == 0
    assert outcome_of("reach", first)[1].startswith("arrived; ")
    # Another state file, the boat in the loiter of this list: it takes the list over and is there ("arrived; 1 s").
    code, said = outcome_of("reach", first | {"plans": 0, "uploads": 0, "time_s": 2.0, "tacks": 0})
    assert code == 0
    assert said.startswith("arrived, with nothing sailed anew: at this start she lay at the goal of reach already")
    sail(short, tmp_path)  # another boat, the same state
    again = json.loads((tmp_path / "summary.json").read_bytes())
    assert again["arrived_before"] is True
    assert again["uploads"] == 0
    assert outcome_of("reach", again) == (2, "not sailed: reach had arrived before this start; --again sails it again")
    given_up = again | {"goals": 3, "goals_given_up": 2}
    assert (
        "had arrived before this start (1 of 3 goals reached, 2 given up by order);" in outcome_of("reach", given_up)[1]
    )


def test_a_dry_run_leaves_the_state_of_a_voyage_that_is_interrupted(short, tmp_path):
    """It wrote its own in the place of it, and the voyage could not be taken up again."""
    state = tmp_path / "state.json"
    sail(short, tmp_path, EventSpec(at_s=60.0, kind="kill_companion"), limit_s=65.0)
    before = state.read_bytes()
    mission = load_mission(short / "mission.toml")

    async def dry():
        autopilot = SimulatedAutopilot(AutopilotConfig(home=mission.origin, is_warm=True), Constant(0.0, 5.0), seed=1)
        wires = MemoryLink("dry", seed=1)
        async with serve(autopilot, [wires.far]):
            return await app.sail(
                mission,
                wires.near,
                InlinePlanner(),
                tmp_path / "dry",
                SailOptions(
                    dry_run=True, limit_s=50.0, offload=at_once, is_durable=False, state_path=state, expansions=2000
                ),
            )

    summary = run_virtual(dry())
    assert summary["end_why"].startswith("a plan is ready")
    assert state.read_bytes() == before


def test_a_voyage_is_replayed_where_its_mission_is_no_more(short, tmp_path, monkeypatch, capsys):
    """It could be replayed only in the folder that it was sailed from."""
    there = tmp_path / "there"
    shutil.copytree(short, there / "missions")
    (there / "missions/shore").mkdir()
    (there / "missions/rock.wkt").rename(there / "missions/shore/rock.wkt")
    mission = MISSION.replace('"rock.wkt"', '"shore/rock.wkt", "../rock.wkt"').replace(
        "[operator]", '[boat]\npolar = "own.csv"\n[operator]'
    )
    (there / "missions/mission.toml").write_text(mission.replace('name = "reach"\n', "", 1))
    (there / "rock.wkt").write_text(ROCK.replace("-1.308", "-1.338"))
    (there / "missions/own.csv").write_text(POLAR)
    verdict, _ = sail(there / "missions", there / "voyage")
    assert verdict.passed, verdict.checks
    with (there / "voyage/track.csv").open() as track:  # she sailed by her own polar, 2.5 kn at best
        assert max(float(row["sog_mps"] or 0.0) for row in csv.DictReader(track)) < 1.4
    here = tmp_path / "elsewhere"
    shutil.move(there / "voyage", here)
    shutil.rmtree(there)
    monkeypatch.chdir(tmp_path)
    report = replay(Path("elsewhere"))
    assert report.steps > 60
    assert not report.differences
    assert cli.main(["replay", "elsewhere"]) == 0
    assert capsys.readouterr().out.endswith("\ntoday's code decides as it did under way; nothing was written\n")
    assert cli.main(["report", "elsewhere", "--json"]) == 0


POLAR = """TWA\\TWS;4;6;10
0;0.0;0.0;0.0
45;1.4;1.8;2.1
90;1.8;2.2;2.5
135;1.7;2.1;2.4
180;1.3;1.7;2.1
"""


def test_started_again_beside_the_boat_in_her_loiter_it_says_so_too(short, tmp_path):
    """On the same boat it took its own list over and said "all 0 goals reached", "arrived; 2 s" and 0."""
    verdict, _ = sail(
        short,
        tmp_path,
        EventSpec(at_s=150.0, kind="kill_companion", restart_after_s=4.0),
        limit_s=180.0,
        exit_on_arrival=False,
    )
    assert verdict.passed, verdict.checks
    again = json.loads((tmp_path / "summary.json").read_bytes())
    assert (again["arrived"], again["arrived_before"], again["uploads"]) == (True, True, 0)
    assert (again["goals_reached"], again["goals_given_up"]) == (1, 0)
    assert again["end_why"].startswith("the goal is reached before this start")
    assert outcome_of("reach", again)[0] == 2
