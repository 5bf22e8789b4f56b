"""A power cut at every write: whatever of them is lost or torn, the next start knows the mission on the autopilot.

A voyage is sailed once on a disk that notes each operation and what an honest card, a lying one and a torn one would
keep of it. Then every list that was on the autopilot, half-done uploads included, is met with each of these;
``-m campaign`` cuts the power of whole voyages too.
"""

import functools
import itertools
import json
import random
from dataclasses import dataclass, replace

import msgspec
import pytest

from companion.app.options import SailOptions
from companion.clock import run_virtual
from companion.compose import config_of, voyage_of
from companion.disk import Disk
from companion.geofence import load_mission
from companion.mavlink.vehicle_identity import Identity
from companion.messages import AutopilotStatus, MissionItem, MissionState, Mode
from companion.skipper import Skipper
from companion.skipper.step import actions
from companion.skipper.step.config import ALL_PERMITTED
from companion.skipper.step.saved import Persisted
from companion.skipper.step.snapshot import ReadOutcome, Snapshot
from lab.campaigns.faults import BASE
from sitl.run import embedded as runner
from sitl.run.embedded import run_embedded
from sitl.scenario.scenario import EventSpec, ExpectSpec, WindSpec, load_scenario
from tests.voyages.test_voyage import ROCK, SHORT_MISSION

STATE = "state.json"


@dataclass
class Moment:
    """What may be left of the state if the power fails now, and what is on the autopilot."""

    honest: bytes | None  # what was synced is there, what was not is lost
    kept: bytes | None  # all that was asked for is there
    torn: bytes | None  # half of what was written, under the name that it was to have


class ForgetfulDisk(Disk):
    """Notes at every operation on the state what a power cut would leave of it: what was not synced may be lost."""

    def __init__(self):
        self.moments, self.paths = [], {}
        self.written, self.synced = {}, {}  # by path: content that was written, and of it what was synced
        self.named, self.name_synced = None, None  # content of the state's name, and of it what was synced

    def create(self, path):
        fd = super().create(path)
        if path.name.startswith(STATE):
            self.paths[fd], self.written[path], self.synced[path] = path, b"", None
            self.note()
        return fd

    def write(self, fd, data):
        done = super().write(fd, data)
        if fd in self.paths:
            self.written[self.paths[fd]] += data[:done]
            self.note()
        return done

    def sync(self, fd):
        super().sync(fd)
        if fd in self.paths:
            path = self.paths.pop(fd)
            self.synced[path] = self.written[path]
            self.note()

    def rename(self, source, target):
        super().rename(source, target)
        if target.name == STATE:
            self.named = (self.synced[source], self.written[source])
            self.note()

    def sync_folder(self, path):
        super().sync_folder(path)
        if self.named is not None:
            self.name_synced = self.named
            self.note()

    def note(self):
        named, synced = self.named, self.name_synced
        self.moments.append(
            Moment(
                honest=None if synced is None else synced[0],
                kept=None if named is None else named[1],
                torn=None if named is None else named[1][: len(named[1]) // 2],
            )
        )


def scenario(**changes):
    return msgspec.structs.replace(
        load_scenario(BASE),
        limit_s=400.0,
        wind=WindSpec(sd_deg=6.0, tws_mps=5.0),
        has_ftp=False,
        expect=ExpectSpec(min_clearance_m=2.0),
        **changes,
    )


def items_of(autopilot):
    return tuple(
        MissionItem(command=i.command, lat_e7=i.x, lon_e7=i.y, alt_m=i.z, frame=i.frame, params=i[2:6])
        for i in autopilot.pilot.helm.mission.items[1:]
    )


class Witness:
    """Notes each list that is on the autopilot, and after how many operations on the disk."""

    def __init__(self, disk):
        self.disk, self.seen = disk, []

    def truth(self, t_s, autopilot, link):
        now = (len(self.disk.moments), items_of(autopilot))
        if now[1] and now not in self.seen[-1:]:
            self.seen.append(now)

    def life(self, start_s, end_s):
        pass


@pytest.fixture
def durable(monkeypatch):
    """Let the simulated companion sync as a boat's does."""
    monkeypatch.setattr(runner, "SailOptions", lambda **kw: SailOptions(**{**kw, "is_durable": True}))


def whose(skipper, saved, aboard):
    """Return what a companion that starts with this state says of the mission that it finds, the boat under way."""
    state = skipper.initial(saved)
    uid = state.vehicle.uid or "5a"
    ours = Identity(system=1, uid=uid, is_confirmed=True, vehicle_type=11, frame_class=2, sails=True)
    status = AutopilotStatus(
        t_s=0.0,
        mode=Mode.AUTO,
        is_armed=True,
        ekf_ok=True,
        mission_seq=1,
        mission_total=len(aboard),
        mission_state=MissionState.ACTIVE,
    )
    seen = Snapshot(
        t_s=0.0, autopilot=status, autopilot_age_s=0.0, heartbeat_age_s=0.0, permissions=ALL_PERMITTED, identity=ours
    )
    state, asked = skipper.step(state, seen)
    read = next(a for a in asked if isinstance(a, actions.ReadMission))
    state, said = skipper.step(
        state,
        Snapshot(
            t_s=1.0,
            autopilot=status,
            autopilot_age_s=0.0,
            heartbeat_age_s=0.0,
            permissions=ALL_PERMITTED,
            identity=ours,
            outcomes=(ReadOutcome(read_id=read.read_id, items=aboard),),
        ),
    )
    return state, {a.code for a in said if isinstance(a, actions.Announce)}


def test_after_a_power_cut_at_any_write_the_mission_on_board_is_known(durable, monkeypatch, tmp_path):
    """Renames were not synced: a state one upload older ended as "foreign", without control."""
    disk = ForgetfulDisk()
    witness = Witness(disk)
    monkeypatch.setattr(runner, "SimulatedWorld", functools.partial(runner.SimulatedWorld, disk=disk))
    (tmp_path / "mission.toml").write_text(SHORT_MISSION + "[skipper]\nautopilot_beats = false\n")
    (tmp_path / "rock.wkt").write_text(ROCK)
    source = tmp_path / "scenario.toml"
    many = scenario(
        mission="mission.toml",
        events=(
            EventSpec(at_s=55.0, kind="wind_shift", veer_deg=40.0, over_s=4.0),
            EventSpec(at_s=85.0, kind="wind_shift", veer_deg=-60.0, over_s=4.0),
        ),
    )
    verdict = run_virtual(run_embedded(many, source, 1, tmp_path / "v", expansions=3000, observer=witness))
    assert verdict.passed, verdict.checks
    mission = load_mission(many.mission_path(source))
    skipper = Skipper(voyage=voyage_of(mission), config=config_of(mission))
    assert len(disk.moments) >= 40
    assert len({aboard for _, aboard in witness.seen}) >= 6
    met = set()
    for number, aboard in witness.seen:
        plain = tuple(replace(item, alt_m=0.0) for item in aboard)
        now, older = disk.moments[number - 1], disk.moments[max(0, number - 13)]
        # an honest card has every list that may be there: no mark is needed
        for left, there in (
            (now.honest, plain),
            (now.kept, plain),
            (now.torn, aboard),
            (older.honest, aboard),
            (older.torn, aboard),
            (None, aboard),
        ):
            state, said = whose(skipper, believed(left), there)
            assert not state.mission.foreign
            assert said & {"adopted", "held back", "mixture"}
            met |= said
    # What is sent replaces item by item, behind a stopgap. Cut after that has gone, the list is of both missions.
    cuts = 0
    for (_, before), (number, after) in itertools.pairwise(witness.seen):
        same = sum(1 for _ in itertools.takewhile(lambda pair: pair[0] == pair[1], zip(before, after, strict=False)))
        half = (same + len(after)) // 2 + 1
        cut = (*before[:half], *after[half:])
        if cut in {before, after}:
            continue
        state, said = whose(skipper, believed(disk.moments[number - 1].honest), cut)
        assert not state.mission.foreign
        cuts += 1
        met |= said
    assert cuts >= 3
    assert met >= {"adopted", "held back", "mixture"}


def believed(left):
    """Return what a start makes of such a state."""
    try:
        return None if left is None else Persisted.from_dict(json.loads(left))
    except ValueError:
        return None


@pytest.mark.campaign
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("card", ["honest", "torn", "lost"])
def test_whole_voyages_whose_power_is_cut_arrive(card, durable, tmp_path):
    rng = random.Random(card)

    class Cut:
        lives = 0

        def truth(self, t_s, autopilot, link):
            pass

        def life(self, start_s, end_s):
            self.lives += 1
            state = self.folder / STATE
            if self.lives > 1 or not state.exists():
                return
            if card == "lost":
                state.unlink()
            elif card == "torn":
                state.write_bytes(state.read_bytes()[: rng.randrange(len(state.read_bytes()))])

    for number in range(40):
        cut = Cut()
        cut.folder = tmp_path / str(number)
        kill = EventSpec(at_s=rng.uniform(30.0, 180.0), kind="kill_companion", restart_after_s=3.0)
        verdict = run_virtual(
            run_embedded(scenario(events=(kill,)), BASE, number, cut.folder, expansions=4000, observer=cut)
        )
        assert verdict.passed, (number, kill.at_s, verdict.checks)
