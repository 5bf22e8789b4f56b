"""Independent readers: pymavlink's loaders, MAVSDK's importers, and both ends of a transfer by MAVSDK.

MAVSDK keeps threads of its own, so each of its runs is a process.
"""

import json
import pathlib
import subprocess
import sys
import textwrap
import time

import pytest
from pymavlink import mavwp

from companion.geofence import load_mission, read
from companion.geofence.formats.registry import parse, write
from companion.geofence.mission.files import document_of
from companion.mavlink.wire.items import mission_hash
from tests.sitl.boats import boat_process

ROOT = pathlib.Path(__file__).parents[3]
DEMO = ROOT / "missions" / "archipelago.toml"
LAKE = ROOT / "missions" / "lake.toml"
WPL = (
    "QGC WPL 110\n0\t1\t0\t16\t0\t0\t0\t0\t51.1000000\t-1.3000000\t0\t1\n"
    "1\t0\t3\t16\t0\t0\t0\t0\t51.1012345\t-1.3012345\t0\t1\n2\t0\t3\t19\t30\t0\t0\t0\t51.1020000\t-1.2990000\t0\t1\n"
    "3\t0\t3\t177\t1\t2\t0\t0\t0\t0\t0\t1\n4\t0\t3\t17\t0\t0\t0\t0\t51.1030000\t-1.3000000\t0\t1\n"
)


def test_pymavlink_reads_our_missions(tmp_path):
    document = parse(WPL.encode(), "m.waypoints")
    (tmp_path / "m.waypoints").write_bytes(write(document, "m.waypoints").data)
    loader = mavwp.MAVWPLoader()
    assert loader.load(str(tmp_path / "m.waypoints")) == 5
    for number, item in enumerate(document.items, start=1):
        found = loader.wp(number)
        assert (found.command, round(found.x * 1e7), round(found.y * 1e7)) == (item.command, item.lat_e7, item.lon_e7)
        assert found.param1 == item.params[0]


def test_we_read_what_pymavlink_writes(tmp_path):
    loader = mavwp.MAVWPLoader()
    (tmp_path / "m.waypoints").write_text(WPL)
    loader.load(str(tmp_path / "m.waypoints"))
    loader.save(str(tmp_path / "theirs.waypoints"))
    ours, theirs = parse(WPL.encode(), "m.waypoints"), read(tmp_path / "theirs.waypoints")
    assert len(theirs.items) == len(ours.items)
    for a, b in zip(ours.items, theirs.items, strict=True):
        assert abs(a.lat_e7 - b.lat_e7) <= 5  # it keeps six decimals
        assert (a.command, a.params) == (b.command, b.params)


def test_pymavlink_reads_our_fences(tmp_path):
    document = document_of(load_mission(LAKE))
    (tmp_path / "lake.fen").write_bytes(write(document, "lake.fen").data)
    loader = mavwp.MAVFenceLoader()
    corners = len(document.zones[0].shape.exterior.coords) - 1
    assert loader.load(str(tmp_path / "lake.fen")) == corners + 2  # the return point, and the first vertex again
    ring = loader.polygon()
    assert ring[0] == pytest.approx(tuple(reversed(document.zones[0].shape.exterior.coords[0])))
    loader.save(str(tmp_path / "theirs.fen"))
    back = read(tmp_path / "theirs.fen").require_clean().zones[0].shape
    assert back.symmetric_difference(document.zones[0].shape).area < 1e-3 * back.area  # it keeps six decimals


_IMPORT = textwrap.dedent("""
    import json, sys
    from mavsdk import Mavsdk, Configuration, logging
    from mavsdk.component_type import ComponentType
    from mavsdk.plugins.mission_raw import MissionRaw

    logging.log_subscribe(lambda *a: True)
    m = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    m.add_any_connection(f"udpout://{sys.argv[1]}:{sys.argv[2]}")
    system = m.first_autopilot(20.0)
    assert system is not None, "no autopilot"
    raw = MissionRaw(system)
    plan = raw.import_qgroundcontrol_mission(sys.argv[3])
    wpl = raw.import_mission_planner_mission(sys.argv[4])
    rows = lambda items: [(i.command, i.x, i.y, i.param1) for i in items]
    print(json.dumps({"mission": rows(plan.mission_items), "fence": rows(plan.geofence_items),
                      "rally": rows(plan.rally_items), "wpl": rows(wpl.mission_items)}))
    m.destroy()
""")


def test_mavsdk_imports_our_plans_and_waypoints(tmp_path):
    from companion.geofence.formats.fence_items import zones_to_items

    document = document_of(load_mission(DEMO))
    (tmp_path / "demo.plan").write_bytes(write(document, "demo.plan").data)
    mission = parse(WPL.encode(), "m.waypoints")
    (tmp_path / "m.waypoints").write_bytes(write(mission, "m.waypoints").data)
    with boat_process("--warm", "--moored") as (host, _, udp):
        done = subprocess.run(
            [sys.executable, "-c", _IMPORT, host, str(udp), str(tmp_path / "demo.plan"), str(tmp_path / "m.waypoints")],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    assert done.returncode == 0, done.stdout + done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    goal = document.items[0]
    assert found["mission"][-1][:3] == [goal.command, goal.lat_e7, goal.lon_e7]
    fence, _ = zones_to_items(document.zones)
    assert sorted(map(tuple, found["fence"])) == sorted((i.command, i.lat_e7, i.lon_e7, i.params[0]) for i in fence)
    # MAVSDK puts home in front a second time and leaves jumps as they were (which is why we read .waypoints ourselves)
    rows = [(i.command, i.lat_e7, i.lon_e7) for i in mission.items]
    assert [tuple(r[:3]) for r in found["wpl"]][-len(rows) :] == rows


def companion(*argv) -> tuple[int, str, str]:
    done = subprocess.run(
        [sys.executable, "-m", "companion.cli", *map(str, argv)],
        capture_output=True,
        text=True,
        timeout=90,
        check=False,
    )
    return done.returncode, done.stdout, done.stderr


def check_shore_tools(tmp_path, link, other_link):
    """Fence, mission and rally list: up, read back, hash, down again, and into force."""
    (tmp_path / "m.waypoints").write_text(WPL)
    (tmp_path / "r.rally").write_text("RALLY\t50.8172\t-1.3101\t0\t0\t0\t0\n")
    code, out, err = companion("fence", "upload", DEMO, "--link", link, "--enable")
    assert code == 0, out + err
    assert "uploaded and read back the same, hash " in out
    assert "FENCE_TYPE 4" in out
    sent_hash = out.split("hash ")[1].split()[0]

    code, out, err = companion("fence", "download", tmp_path / "down.waypoints", "--link", other_link)
    assert code == 0, out + err
    assert sent_hash in out
    assert mission_hash(_fence_items(tmp_path / "down.waypoints")) == sent_hash

    code, out, err = companion("mission", "upload", tmp_path / "m.waypoints", "--link", link)
    assert code == 0, out + err
    assert mission_hash(parse(WPL.encode(), "m").items) in out
    code, out, err = companion("mission", "download", tmp_path / "down.plan", "--link", link)
    assert code == 0, out + err
    assert [i.command for i in read(tmp_path / "down.plan").items] == [16, 19, 177, 17]

    assert companion("mission", "upload", tmp_path / "r.rally", "--part", "rally", "--link", link)[0] == 0
    code, out, err = companion("mission", "download", tmp_path / "down.rally", "--part", "rally", "--link", link)
    assert code == 0, out + err
    assert read(tmp_path / "down.rally").rally[0].lat_e7 == 508172000


def test_shore_tools_against_the_simulated_autopilot(tmp_path):
    with boat_process("--warm", "--moored", "--speedup", "4", "--home", "50.817,-1.31") as (host, tcp, udp):
        check_shore_tools(tmp_path, f"udpout:{host}:{udp}", f"tcp:{host}:{tcp}")


def test_only_the_boat_that_is_named_is_touched(tmp_path):
    (tmp_path / "m.waypoints").write_text(WPL)
    with boat_process("--warm", "--moored", "--speedup", "4", "--sysid", "7") as (host, tcp, _):
        link = ("--link", f"tcp:{host}:{tcp}", "--timeout", "3")
        code, out, err = companion("mission", "upload", tmp_path / "m.waypoints", *link, "--system", "9")
        assert code == 1
        assert "no autopilot's heartbeat of system 9; heard: system 7 (surface boat, ArduPilot" in err
        assert not out
        code, _, err = companion("mission", "download", tmp_path / "x.plan", *link, "--system", "7")
        assert (code, err) == (1, "the autopilot holds no mission; nothing is written\n")
        code, _, err = companion("status", "--link", f"tcp:{host}:{tcp}", "--system", "9", "--once", "--timeout", "3")
        assert code == 3
        assert "of system 9; heard: system 7" in err
        code, _, err = companion("doctor", "--link", f"tcp:{host}:{tcp}", "--system", "9", "--wait", "3")
        assert code == 1
        assert "of system 9; heard: system 7" in err
        assert companion("doctor", "--link", f"tcp:{host}:{tcp}", "--system", "0")[0] == 2


@pytest.mark.ardurover
def test_shore_tools_against_the_real_ardurover(tmp_path):
    from sitl.ardurover.simulation import DEFAULTS, find, free_instance

    program = find()
    if program is None:
        pytest.skip("no ArduRover program: set $ARDUROVER or run 'sitl fetch'")
    instance = free_instance()
    folder = tmp_path / "ardurover"
    folder.mkdir()
    with (folder / "log").open("w") as log:
        boat = subprocess.Popen(
            [
                str(program),
                "--model",
                "sailboat",
                "--speedup",
                "4",
                f"-I{instance}",
                "--home",
                "50.817,-1.31,0,0",
                "--defaults",
                str(DEFAULTS),
                "-w",
                "--serial0",
                "tcp:0",
            ],
            cwd=folder,
            stdout=log,
            stderr=log,
        )
    try:
        link = f"tcp:127.0.0.1:{5760 + 10 * instance}"
        deadline = time.monotonic() + 60.0
        while companion("mission", "download", tmp_path / "none.plan", "--link", link)[2].count("no autopilot"):
            assert time.monotonic() < deadline, "ArduRover does not speak"
        time.sleep(12.0)  # 48 simulated seconds: home is set once the EKF has a position
        check_shore_tools(tmp_path, link, link)
    finally:
        boat.terminate()
        boat.wait(10.0)


def _fence_items(path):
    from companion.geofence.formats.fence_items import zones_to_items

    document = read(path).require_clean()
    return zones_to_items(document.zones)[0]


def test_a_fence_too_large_is_refused_before_anything_is_sent(tmp_path):
    big = tmp_path / "big.wkt"
    ring = ", ".join(f"{-1.3 + 0.001 * (i % 45)} {50.8 + 0.0005 * (i // 45) + 0.0001 * (i % 2)}" for i in range(45))
    last = ", -1.25 50.9, -1.3 50.9, -1.3 50.8"
    big.write_text("\n".join(f"z{n}|exclusion|POLYGON (({ring}{last}))" for n in range(2)))
    code, _, err = companion("fence", "upload", big, "--link", "udpout:127.0.0.1:1")
    assert code == 1
    assert "the autopilot holds 84" in err


def test_a_dead_link_is_one_line_within_the_timeout(tmp_path):
    (tmp_path / "m.waypoints").write_text(WPL)
    for argv in (("fence", "download", tmp_path / "x.wkt"), ("mission", "upload", tmp_path / "m.waypoints")):
        code, out, err = companion(*argv, "--link", "udpout:127.0.0.1:9", "--timeout", "1")
        assert code == 1
        assert "no autopilot in 1 s" in err
        assert err.count("\n") == 1
        assert not out
    assert not (tmp_path / "x.wkt").exists()


def test_a_link_that_dies_in_a_transfer_is_an_error(tmp_path):
    """The autopilot stops answering after the connection: an error, no empty fence."""
    script = textwrap.dedent("""
        import os, signal, sys
        from companion.commands import mavsdk_session
        from companion.errors import TransferError
        from companion.messages import MissionType

        mavsdk_session.SILENCE_S = 1.5
        with mavsdk_session.MavsdkSession(sys.argv[1], timeout_s=20.0) as end:
            os.kill(int(sys.argv[2]), signal.SIGSTOP)
            try:
                print("got", end.download(MissionType.FENCE))
            except TransferError as error:
                print("error:", error)
            finally:
                os.kill(int(sys.argv[2]), signal.SIGCONT)
    """)
    import socket

    from tests.sitl.boats import free_port

    udp = free_port(socket.SOCK_DGRAM)
    boat = subprocess.Popen(
        [sys.executable, "-m", "sitl.cli", "boat", "--port", "0", "--udp", str(udp), "--warm", "--moored"],
        stdout=subprocess.PIPE,
        text=True,
    )
    try:
        assert boat.stdout.readline().startswith("sitl boat:")
        done = subprocess.run(
            [sys.executable, "-c", script, f"udpout:127.0.0.1:{udp}", str(boat.pid)],
            capture_output=True,
            text=True,
            timeout=60,
            check=False,
        )
    finally:
        boat.terminate()
        boat.wait(10.0)
        boat.stdout.close()
    assert "error: fence download: the autopilot fell silent" in done.stdout, done.stdout + done.stderr
