"""The companion killed at seeded moments of one voyage, uploads included, and started again.

Two kills in three are a power cut as well: the last lines of decisions.jsonl and track.csv are torn, and half a
state.json.new is left over. ``pytest -m campaign tests/voyages/test_restart.py`` kills at all 200 moments.
"""

import json
import random
from dataclasses import dataclass, field
from pathlib import Path

import msgspec
import pytest

from companion.clock import run_virtual
from companion.replay import replay
from companion.telemetry.folder.recorder import read_jsonl
from lab.campaigns.faults import BASE
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, WindSpec, load_scenario

MOMENTS = 200
EXPANSIONS = 4_000
# The quick tests take these of the 200: kills in both kinds of upload and between, torn and not.
HANDFUL = (0, 1, 2, 3, 7)


@dataclass
class PowerCut:
    """Does to the folder what a power cut does, between two lives of the companion."""

    folder: Path
    rng: random.Random | None = None
    change: object = None
    lives: list = field(default_factory=list)
    said: list = field(default_factory=list)

    def truth(self, t_s, autopilot, link):
        pass

    def life(self, start_s, end_s):
        self.lives.append((start_s, end_s))
        if len(self.lives) > 1:
            return
        if self.rng is not None:
            tear(self.folder, self.rng)
        if self.change is not None:
            self.change(self.folder)


def tear(folder, rng):
    for name in ("decisions.jsonl", "track.csv"):
        path = folder / name
        data = path.read_bytes()
        last = len(data) - (data.rfind(b"\n", 0, len(data) - 1) + 1)
        path.write_bytes(data[: len(data) - rng.randint(1, max(1, last - 1))])
    state = folder / "state.json"
    if state.is_file():
        data = state.read_bytes()
        (folder / "state.json.new").write_bytes(data[: rng.randrange(len(data))])


def sail(folder, *, has_ftp=True, kill_at_s=None, torn=None, change=None, wait_s=4.0, limit_s=400.0, arrived=True):
    scenario = msgspec.structs.replace(
        load_scenario(BASE),
        has_ftp=has_ftp,
        limit_s=limit_s,
        wind=WindSpec(sd_deg=6.0, tws_mps=5.0),
        events=() if kill_at_s is None else (EventSpec(at_s=kill_at_s, kind="kill_companion", restart_after_s=wait_s),),
        expect=ExpectSpec(arrived=arrived, min_clearance_m=2.0 if arrived else None),
    )
    cut = PowerCut(folder, torn, change)
    return run_virtual(run_embedded(scenario, BASE, 1, folder, expansions=EXPANSIONS, observer=cut)), cut


def decisions(folder):
    return read_jsonl(folder / "decisions.jsonl")


def uploads_of(records):
    """Return (start, end) of every upload [s]."""
    ends = {r["upload_id"]: r["t_s"] for r in records if r.get("outcome") == "UploadOutcome"}
    return [
        (r["t_s"], ends[r["upload_id"]])
        for r in records
        if r.get("action") == "UploadMission" and r["upload_id"] in ends
    ]


@pytest.fixture(scope="module")
def calm_voyages(tmp_path_factory):
    """The voyage without a kill, by MAVFTP and item by item: its length and when it uploads."""
    out = {}
    for has_ftp in (True, False):
        folder = tmp_path_factory.mktemp("calm")
        verdict, _ = sail(folder, has_ftp=has_ftp)
        assert verdict.passed, verdict.checks
        records = decisions(folder)
        out[has_ftp] = (records[-1]["t_s"], uploads_of(records))
        assert out[has_ftp][1]
    return out


def moment(number, calm_voyages):
    """Return (MAVFTP or not, when to kill [s], torn or not) of one of the 200; half of the kills hit an upload."""
    rng = random.Random(f"restart {number}")
    has_ftp = number % 4 < 2
    length_s, uploads = calm_voyages[has_ftp]
    if number % 2:
        start_s, end_s = uploads[rng.randrange(len(uploads))]
        at_s = rng.uniform(start_s, end_s)
    else:
        at_s = rng.uniform(1.0, length_s - 8.0)
    return has_ftp, at_s, rng if number % 3 else None


def check_restart(number, calm_voyages, folder):
    has_ftp, at_s, torn = moment(number, calm_voyages)
    verdict, cut = sail(folder, has_ftp=has_ftp, kill_at_s=at_s, torn=torn)
    assert verdict.passed, (at_s, [c for c in verdict.checks if not c.passed])
    assert len(cut.lives) == 2, f"killed at {at_s:.2f} s: it had arrived"
    records = decisions(folder)
    begins = [n for n, r in enumerate(records) if r["kind"] == "start"]
    assert len(begins) == 2
    before, after = records[: begins[1]], records[begins[1] :]
    saved = after[0]["persisted"]
    if saved is None or (saved["route"] is None and saved["pending"] is None):
        return "nothing to adopt"
    codes = [r.get("code") for r in after if r.get("action") == "Announce"]
    assert "foreign mission" not in codes, at_s
    first_upload = next((n for n, r in enumerate(after) if r.get("action") == "UploadMission"), len(after))
    first_plan = next((n for n, r in enumerate(after) if r["kind"] == "plan"), len(after))
    if "adopted" in codes:
        # taken over as it is: the next upload belongs to a plan made after the restart
        assert first_plan < first_upload or first_upload == len(after), at_s
        return "adopted"
    cut_short = not read_back(before)
    assert cut_short, (at_s, codes)
    return "put right" if "mixture" in codes else "planned anew"


def read_back(before):
    """Return whether a mission was on board whole when the companion died: the last upload was answered."""
    asked = [r["upload_id"] for r in before if r.get("action") == "UploadMission"]
    done = {r["upload_id"] for r in before if r.get("outcome") == "UploadOutcome"}
    return bool(asked) and asked[-1] in done


@pytest.mark.parametrize("number", HANDFUL)
def test_killed_and_started_again_it_adopts_and_arrives(number, calm_voyages, tmp_path):
    check_restart(number, calm_voyages, tmp_path)


@pytest.mark.campaign
@pytest.mark.timeout(3600)
def test_killed_at_two_hundred_moments(calm_voyages, tmp_path):
    how = {}
    for number in range(MOMENTS):
        result = check_restart(number, calm_voyages, tmp_path / str(number))
        how[result] = how.get(result, 0) + 1
    print(how)
    assert how["adopted"] > MOMENTS / 2
    assert sum(how.values()) == MOMENTS


def test_a_torn_voyage_can_be_read_and_replayed(tmp_path):
    verdict, _ = sail(tmp_path, kill_at_s=100.0, torn=random.Random(5))
    assert verdict.passed, verdict.checks
    rows = (tmp_path / "track.csv").read_text().splitlines()
    assert {row.count(",") for row in rows} == {rows[0].count(",")}
    report = replay(tmp_path)
    assert report.restarts == 1
    assert report.steps > 100
    asked = [d["t_s"] for d in decisions(tmp_path) if d.get("action") == "RequestPlan" and d["reason"] != "start"]
    assert asked[0] < 100.0 < asked[-1]
    assert verdict.figures["replans"] == len(asked)  # of both lives


def stale(folder):
    """Another voyage's state lies where ours should."""
    state = json.loads((folder / "state.json").read_bytes())
    (folder / "state.json").write_text(json.dumps({**state, "voyage": "yesterday"}))


def strangers(folder):
    """Our voyage's name, but not the mission that is on the autopilot."""
    state = json.loads((folder / "state.json").read_bytes())
    for name in ("route", "pending"):
        if state[name] is not None:
            for item in state[name]["items"]:
                item[1] += 500
    (folder / "state.json").write_text(json.dumps(state))


def damage(folder):
    (folder / "state.json").write_bytes((folder / "state.json").read_bytes()[:100])


def lose(folder):
    (folder / "state.json").unlink()


@pytest.mark.parametrize(
    ("change", "refusal"),
    [(stale, "another voyage"), (damage, "it is kept as state.json.damaged"), (strangers, ""), (lose, "")],
)
def test_a_state_that_does_not_fit_is_reported_and_the_boat_is_sailed_on_by_the_mark_in_her_mission(
    change, refusal, tmp_path
):
    """It ended as "foreign" and without control."""
    verdict, _ = sail(tmp_path, kill_at_s=70.0, change=change)
    assert verdict.passed, verdict.checks
    records = decisions(tmp_path)
    begin = [n for n, r in enumerate(records) if r["kind"] == "start"][1]
    after = records[begin:]
    refused = [r["text"] for r in after if r["kind"] == "refusal"]
    assert (refusal in " ".join(refused)) if refusal else not refused
    codes = [r.get("code") for r in after if r.get("action") == "Announce"]
    assert "foreign mission" not in codes
    assert "adopted" in codes
    # what is on board is of no plan that is known: there is a plan before anything else is uploaded
    assert next(r for r in after if r.get("action") == "RequestPlan")["reason"] == "mismatch"
    assert not replay(tmp_path).differences


# What 0.1.0 wrote of a voyage and of a list on the autopilot.
OF_0_1_0 = {"format", "voyage", "gate", "sailing", "route", "pending", "own_mode"}
ROUTE_OF_0_1_0 = {
    "items",
    "points",
    "from",
    "gates",
    "plan_id",
    "plan_t_s",
    "plan_twd_from_rad",
    "plan_tws_mps",
    "plan_half_width_rad",
    "margin_m",
    "delta_s",
    "risk",
    "cost_s",
    "rung",
    "why",
}


def older(folder):
    """The companion is upgraded while it is away: the state is of 0.1.0."""
    state = json.loads((folder / "state.json").read_bytes())
    assert set(state) > OF_0_1_0
    state = {name: value for name, value in state.items() if name in OF_0_1_0}
    for name in ("route", "pending"):
        if state[name] is not None:
            assert set(state[name]) > ROUTE_OF_0_1_0
            state[name] = {key: value for key, value in state[name].items() if key in ROUTE_OF_0_1_0}
    (folder / "state.json").write_text(json.dumps(state))


def test_the_state_of_an_older_version_is_read_and_its_mission_sailed_on(tmp_path):
    """Not by the mark alone: the plan that is on board is known, and nothing is planned anew for want of it."""
    verdict, _ = sail(tmp_path, kill_at_s=70.0, change=older)
    assert verdict.passed, verdict.checks
    records = decisions(tmp_path)
    after = records[[n for n, r in enumerate(records) if r["kind"] == "start"][1] :]
    assert not [r["text"] for r in after if r["kind"] == "refusal"]
    assert "adopted" in [r.get("code") for r in after if r.get("action") == "Announce"]
    assert "mismatch" not in [r["reason"] for r in after if r.get("action") == "RequestPlan"]
    assert not replay(tmp_path).differences


@dataclass
class Stranger(PowerCut):
    """Changes the list on the autopilot, while the companion is away, into one that is nobody's."""

    autopilot: object = None

    def truth(self, t_s, autopilot, link):
        self.autopilot = autopilot

    def life(self, start_s, end_s):
        super().life(start_s, end_s)
        items = self.autopilot.pilot.helm.mission.items
        items[1:] = [item._replace(x=item.x + 500, z=0.0) for item in items[1:]]


def test_a_strangers_mission_is_not_resumed_and_nothing_is_asked_of_the_boat(tmp_path):
    scenario = msgspec.structs.replace(
        load_scenario(BASE),
        limit_s=130.0,
        expect=ExpectSpec(arrived=False),
        events=(EventSpec(at_s=70.0, kind="kill_companion", restart_after_s=4.0),),
    )
    run_virtual(run_embedded(scenario, BASE, 1, tmp_path, expansions=EXPANSIONS, observer=Stranger(tmp_path)))
    records = decisions(tmp_path)
    after = records[[n for n, r in enumerate(records) if r["kind"] == "start"][1] :]
    said = [(r["code"], r["text"]) for r in after if r.get("action") == "Announce"]
    assert any(code == "foreign mission" and "replace_foreign" in text for code, text in said)
    assert "adopted" not in dict(said)
    assert not [r for r in after if r.get("action") in {"UploadMission", "SetMode", "Arm"}]
