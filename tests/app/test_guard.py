"""The guard: whatever lives beside a voyage fails at its start and under way, and she arrives and says so."""

import argparse
import asyncio
import itertools
import os
import re
from pathlib import Path

import pytest

from companion import cli
from companion.app import autopilot_upkeep, local_clients
from companion.app import sail as app
from companion.app.from_autopilot import Adoption
from companion.app.local_clients import OperatorCommands
from companion.app.options import SailOptions, SatelliteLink, at_once
from companion.app.satellite import SatelliteMailbox
from companion.clock import now_s, run_virtual
from companion.commands.run import charts_of, far_of, page_of, planned_of
from companion.compose import displays_of
from companion.errors import InputError
from companion.fold import VoyageFold
from companion.geofence import load_mission
from companion.guard import BACKOFF_CAP_S, HELD_S, Auxiliary, Guard, reason
from companion.mavlink.autopilot import Autopilot
from companion.outputs import Outputs, checked_displays, outputs
from companion.page import Address
from companion.planner.worker import InlinePlanner
from companion.telemetry import console
from companion.telemetry.folder import Logbook
from companion.telemetry.folder.recorder import read_jsonl
from companion.telemetry.state_file import StateFile
from companion.traffic.feeds import Feeds
from companion.view import ViewFold
from sitl.autopilot import AutopilotConfig, MemoryLink, SimulatedAutopilot, serve
from sitl.scenario.traffic import free_port
from sitl.world.environment import Constant
from tests.one_mark import one_mark

# When everything beside the voyage is broken [s]: from before its start, and again under way.
WINDOWS = ((0.0, 12.0), (80.0, 95.0))
OTHERS = {
    Auxiliary.VIEW: ((0.0, 12.0), (115.0, 130.0)),  # without a view nothing of it fails to be shown
    Auxiliary.OUTPUTS: ((0.0, 24.0), (80.0, 95.0)),
    Auxiliary.FENCE: ((0.0, 50.0),),
}  # once the boat is ours
MISSION = one_mark(
    "reach",
    (50.8170000, -1.3071600),
    90.0,
    rock=False,
    tables="""local_orders = ["hold"]
upload_fence = true
[traffic]
feeds = ["udpin:127.0.0.1:{feed}"]
[output]
nmea = ["udp:127.0.0.1:{nmea}"]
""",
)

# What is called of each of them, at its start and under way. What is added to ``Auxiliary`` is added here.
FAULTS = {
    Auxiliary.PAGE: ((local_clients, "served"), (local_clients.LivePage, "show")),
    Auxiliary.SOCKET: ((local_clients, "_clear"), (Path, "is_socket")),
    Auxiliary.OUTPUTS: ((outputs, "lines_of"),),
    Auxiliary.FAR: ((SatelliteMailbox, "_begin"), (SatelliteMailbox, "_take_orders"), (SatelliteMailbox, "_tell")),
    Auxiliary.RADIO: ((Autopilot, "send_status"),),
    Auxiliary.HIGH_LATENCY: ((app._Shell, "_seen"), (Autopilot, "send_high_latency")),
    Auxiliary.STATUS: ((app, "companion_status"),),
    Auxiliary.VIEW: ((ViewFold, "take"),),
    Auxiliary.RECORDS: ((Logbook, "begin"), (Logbook, "step"), (Logbook, "note")),
    Auxiliary.STATE: ((StateFile, "save"),),
    Auxiliary.LOOP_WATCH: ((app._Shell, "_held"),),
    Auxiliary.CREW: ((OperatorCommands, "unsigned"),),
    Auxiliary.ADOPTION: ((Adoption, "run"), (Adoption, "_trouble")),
    Auxiliary.IDENTITY: ((VoyageFold, "wants_uid"),),
    Auxiliary.PARAMETERS: ((VoyageFold, "unread"),),
    Auxiliary.FENCE: ((autopilot_upkeep, "fence_for_autopilot"),),
    Auxiliary.FEEDS: ((Feeds, "open"),),
}
ONCE = {Auxiliary.FENCE, Auxiliary.FEEDS}  # at the start, and then no more
# Of the command, before there is a voyage; and what it shows, below.
NAMED = {Auxiliary.ORDERS_BY_PAGE, Auxiliary.CHARTS, Auxiliary.PASSAGE, Auxiliary.SIGNALK_TOKEN}
NEEDED = {
    "executor",
    "orders",
    "plans",
    "whose boat",
    "stopped before",
    "link heartbeat",
    "link rates",
    "link turns",
    "order",
    "fence upload",
}


def break_it(monkeypatch, owner, name, windows):
    """Let something raise within ``windows``."""
    really = getattr(owner, name)
    call = really.fget if isinstance(really, property) else really

    def fails(*args, **kwargs):
        if any(begin <= now_s() < end for begin, end in windows):
            raise RuntimeError("broken")
        return call(*args, **kwargs)

    monkeypatch.setattr(owner, name, property(fails) if isinstance(really, property) else fails)


def test_every_auxiliary_has_its_faults():
    assert {*FAULTS, *NAMED, Auxiliary.CONSOLE} == set(Auxiliary)


class Watched(Guard):
    """A guard that notes what changes."""

    def __init__(self):
        super().__init__()
        self.changes = []

    def _tell(self, name, why):
        self.changes.append((name, why))
        super()._tell(name, why)


class Wanting(OperatorCommands):
    """A crew that wants HIGH_LATENCY2."""

    def __init__(self, *args, **kwargs):
        super().__init__(*args, **kwargs)
        self.wants_high_latency = True


def test_with_all_that_is_beside_her_broken_at_the_start_and_under_way_she_arrives(tmp_path, monkeypatch):
    """One fault of one of them ended the voyage: exit code 1 for ever, or 2 and never again."""
    for what, faults in FAULTS.items():
        for owner, name in faults:
            break_it(monkeypatch, owner, name, OTHERS.get(what, WINDOWS))
    tasks, adoptions, said, alerts, guard = set(), [], [], {}, Watched()
    begin, say = Adoption.__init__, Autopilot.say
    monkeypatch.setattr(Adoption, "__init__", lambda self, *args: (adoptions.append(self), begin(self, *args))[1])
    monkeypatch.setattr(
        Autopilot, "say", lambda self, severity, text: (said.append(text), say(self, severity, text))[1]
    )
    monkeypatch.setattr(app, "OperatorCommands", Wanting)
    (tmp_path / "m.toml").write_text(MISSION.format(feed=free_port(), nmea=free_port()))
    mission = load_mission(tmp_path / "m.toml")

    def look(status, step):
        tasks.update(task.get_name() for task in asyncio.all_tasks())
        alerts[round(now_s())] = status.alert_code
        if adoptions and 80.0 <= now_s() < 81.5:
            adoptions[0].ask()

    async def sailed():
        autopilot = SimulatedAutopilot(AutopilotConfig(home=mission.origin, is_warm=True), Constant(0.0, 5.0), seed=1)
        wires = MemoryLink("boat", seed=1)
        async with serve(autopilot, [wires.far]):
            tasks.update({f"not {task.get_name()}" for task in asyncio.all_tasks()})
            async with Outputs(
                checked_displays(displays_of(mission), guard), mission.frame(), lambda _: None, guard=guard
            ) as displays:
                return await app.sail(
                    mission,
                    wires.near,
                    InlinePlanner(),
                    tmp_path / "v",
                    SailOptions(
                        limit_s=190.0,
                        offload=at_once,
                        is_durable=False,
                        expansions=2000,
                        http=Address(host="127.0.0.1", port=0),
                        socket=tmp_path / "s",
                        far=SatelliteLink(folder=tmp_path / "far", key=bytes(32)),
                    ),
                    guard=guard,
                    on_status=look,
                    on_view=lambda view, _, step: displays.tell(view, None),
                )

    summary = run_virtual(sailed())
    assert summary["arrived"] is True
    assert summary["gone"] == {}
    ours = {task for task in tasks if not task.startswith("not ") and f"not {task}" not in tasks}
    assert {task for task in ours if not task.startswith("auxiliary: ")} <= NEEDED
    for name in FAULTS:
        mine = [why for changed, why in guard.changes if changed == name]
        assert [bool(why) for why in mine] == [True, False] * (1 if name in ONCE else 2), name
        assert "broken" in mine[0] + mine[-2], name
        assert f"the {name} is there again" in said
    assert sum(text.startswith("sailing on without the ") for text in said) >= 2 * len(FAULTS) - len(ONCE) - 3
    assert {alerts[6], alerts[90], alerts[189]} == {"gone", ""}


@pytest.mark.parametrize("from_s", [0.0, 1.5])
def test_a_console_that_fails_is_no_end(from_s, tmp_path, monkeypatch):
    """Before an autopilot is heard a step is made each second, too."""
    show, shown = console.ProgressLine.show, []

    def broken(self, status, step):
        shown.append(now_s())
        if now_s() - shown[0] >= from_s:
            raise RuntimeError("broken")
        show(self, status, step)

    monkeypatch.setattr(console.ProgressLine, "show", broken)
    mission = MISSION.format(feed=free_port(), nmea=free_port()).replace("upload_fence = true", "")
    (tmp_path / "m.toml").write_text(mission)
    assert (
        cli.main(
            [
                "run",
                str(tmp_path / "m.toml"),
                "--link",
                f"udpin:127.0.0.1:{free_port()}",
                "--wait",
                "1.5",
                "--speedup",
                "20",
                "--out",
                str(tmp_path / "v"),
                "--state",
                str(tmp_path / "s.json"),
            ]
        )
        == 1
    )
    assert len(shown) > 15
    records = read_jsonl(tmp_path / "v/decisions.jsonl")
    assert [(r["what"], r["text"]) for r in records if r["kind"] == "auxiliary"] == [
        ("console", "sailing on without the console: RuntimeError: broken")
    ]


def test_what_is_named_and_cannot_be_used_is_left_out(tmp_path):
    guard, nowhere = Guard(), tmp_path / "nowhere" / "file"
    args = argparse.Namespace(
        http=("", 80),
        http_name=(),
        http_token=nowhere,
        chart=[nowhere],
        far=tmp_path,
        far_key=nowhere,
        signing_key=None,
        far_every=10.0,
    )
    assert page_of(args, guard).token == ""
    assert charts_of(args, guard) == ()
    assert planned_of(args, tmp_path / "m.toml", guard) is None  # there is none: nothing is said
    assert Auxiliary.PASSAGE not in guard.gone
    (tmp_path / "m.passage.json").write_text('{"form": "companion.passage/2"}')
    assert planned_of(args, tmp_path / "m.toml", guard) is None
    assert "m.passage.json" in guard.gone[Auxiliary.PASSAGE]
    assert "\n" not in guard.gone[Auxiliary.PASSAGE]
    assert far_of(args, guard) is None
    (tmp_path / "m.toml").write_text(MISSION.format(feed=1, nmea=2) + 'signalk = ["ws://h"]\nsignalk_token = "t"\n')
    told = checked_displays(displays_of(load_mission(tmp_path / "m.toml")), guard)
    assert (told.token, len(told.signalk)) == ("", 1)
    assert {*guard.gone} == {*NAMED, Auxiliary.FAR}
    assert all("no such file" in why for name, why in guard.gone.items() if name != Auxiliary.PASSAGE)
    guard.look()
    assert len(guard.gone) == 5  # for good


@pytest.mark.parametrize("name", ["rocks.wkt", "boat.pol", "tide.csv", "m.toml"])
def test_a_fifo_in_place_of_a_file_is_one_line_and_nothing_waits_for_it(name, tmp_path, capfd):
    """The start hung for ever."""
    (tmp_path / "m.toml").write_text(
        MISSION.format(feed=1, nmea=2).replace("[area]", '[area]\nobstacles = ["rocks.wkt"]')
        + '[boat]\npolar = "boat.pol"\n[current]\ntable = "tide.csv"\n'
    )
    (tmp_path / "rocks.wkt").write_text("POLYGON ((-1.3 50.81, -1.299 50.81, -1.299 50.811, -1.3 50.81))")
    (tmp_path / "boat.pol").write_text("TWA\\TWS;4;8\n0;0;0\n90;3;5\n180;2;4\n")
    (tmp_path / "tide.csv").write_text("time,set_deg,drift_mps\n")
    (tmp_path / name).unlink()
    os.mkfifo(tmp_path / name)
    assert cli.main(["run", str(tmp_path / "m.toml"), "--link", "udpin:127.0.0.1:1"]) == 2
    err = capfd.readouterr().err
    assert "it is a FIFO and no regular file" in err
    assert name in err
    assert err.count("\n") == 1


def test_a_state_that_is_a_fifo_is_said_and_replaced(tmp_path):
    os.mkfifo(tmp_path / "state.json")
    os.mkfifo(tmp_path / "other.state.json")
    state = StateFile(tmp_path / "state.json", disk=app.Recorder(tmp_path)._disk, offload=at_once)
    assert state.load() is None
    assert state.known() == ()
    assert state.refusal == "state.json cannot be read: it is a FIFO and no regular file"


def test_pauses_grow_and_what_holds_is_well_again():
    async def lived():
        guard, begun = Watched(), []

        async def live():
            begun.append(now_s())
            if len(begun) < 12:
                raise InputError("a", "b", "is wrong")
            await asyncio.sleep(1e6)

        guard.keep("x", live)
        await asyncio.sleep(300.0)
        guard.look()
        pauses = [b - a for a, b in itertools.pairwise(begun)]
        assert len(begun) == 12
        assert max(pauses) <= BACKOFF_CAP_S
        assert max(pauses[6:]) > max(pauses[:2])
        assert guard.changes == [("x", "a: b: is wrong"), ("x", "")]
        assert now_s() - begun[-1] >= HELD_S
        await guard.end()

    run_virtual(lived())


def test_what_fails_as_it_is_ended_or_is_cancelled_from_within_hangs_nobody():
    async def lived():
        guard = Watched()

        async def unlinks():
            try:
                await asyncio.sleep(1e6)
            finally:
                raise OSError(30, os.strerror(30))

        async def cancelled():
            raise asyncio.CancelledError

        guard.keep("unlinks", unlinks)
        guard.keep("cancelled", cancelled)
        await asyncio.sleep(5.0)
        assert guard.gone == {"cancelled": "it was cancelled"}
        await guard.end()
        assert guard.gone["unlinks"] == "Read-only file system"
        assert [task for task in asyncio.all_tasks() if task.get_name().startswith("auxiliary")] == []

    run_virtual(lived())


def test_who_is_told_may_fail_and_may_be_what_is_gone():
    def told(name, why):
        guard.call("teller", lambda: 1 / 0)

    guard = Guard(told)
    assert guard.call("x", lambda: 1 / 0) is None
    assert guard.gone == {"x": "ZeroDivisionError: division by zero", "teller": "ZeroDivisionError: division by zero"}
    assert guard.sentence().count("without the ") == 2
    assert reason(TimeoutError()) == "no answer"


FLYING = (
    "app",
    "commands/run.py",
    "compose.py",
    "fold.py",
    "geofence",
    "mavlink",
    "outputs",
    "page",
    "skipper",
    "telemetry",
    "traffic",
)
# A key that is asked for by hand, exclusively; the log of a link, which is appended to.
NOT_WHOLE = {"mavlink/signing.py", "mavlink/tlog.py"}


def test_in_flying_code_the_disk_alone_makes_whole_files():
    """What a power cut leaves of a file that is written in its place is empty: so were the page's tokens."""
    root = Path(cli.__file__).parent
    rooms = [[root / room] if room.endswith(".py") else list((root / room).rglob("*.py")) for room in FLYING]
    assert all(rooms)
    files = [path for room in rooms for path in room]
    making = re.compile(r"write_text\(|write_bytes\(|O_CREAT|open\([^()]*[\"'][wax]\+?b?[\"']")
    assert {p.relative_to(root).as_posix() for p in files if making.search(p.read_text())} <= NOT_WHOLE
