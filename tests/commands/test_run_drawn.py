"""``companion run --from-autopilot`` as a process: MAVSDK draws and uploads, the companion sails."""

import asyncio
import json
import math
import subprocess
import sys
import textwrap

import pytest

from companion import cli, clock
from companion.geofence import read
from sitl.ardurover.simulation import ArduRover, find
from sitl.autopilot import HOME
from sitl.world.environment import Constant
from tests.sitl.boats import boat_process

PACE = 20
COMPANION = [sys.executable, "-m", "companion.cli", "run"]
BOAT = """
[area]
margin_m = 10.0
[operator]
arm = true
set_auto = true
"""

_DRAW = textwrap.dedent("""
    import sys
    from mavsdk import Mavsdk, Configuration
    from mavsdk.component_type import ComponentType
    from mavsdk import logging
    from mavsdk.plugins.mission_raw import MissionRaw, MissionItem
    from tests.sitl.boats import e7

    logging.log_subscribe(lambda *a: True)
    m = Mavsdk(Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    assert int(m.add_any_connection(sys.argv[1])) in (0, 1), "connection"
    system = m.first_autopilot(10.0)
    assert system is not None and system.has_autopilot(), "no autopilot"
    raw = MissionRaw(system)

    def item(n, command, place, kind=0, p1=0.0, p2=0.0, frame=3):
        lat, lon = e7(*place) if place else (0, 0)
        return MissionItem(n, frame, command, 1 if n == 0 else 0, 1, p1, p2, 0.0, 0.0, lat, lon, 0.0, kind)

    drawn = [item(0, 16, (0.0, 0.0)), item(1, 16, (30.0, 0.0)), item(2, 16, (60.0, 15.0)),
             item(3, 177, None, p1=1.0, p2=1.0, frame=2), item(4, 17, (40.0, 25.0))]
    if sys.argv[2] == "bad":
        drawn[3] = item(3, 178, None, p1=1.0, p2=3.0, frame=2)
    raw.upload_mission(drawn)
    ring = [(-80.0, -80.0), (180.0, -80.0), (180.0, 120.0), (-80.0, 120.0)]
    raw.upload_geofence([item(n, 5001, p, 1, p1=4.0, frame=0) for n, p in enumerate(ring)]
                        + [item(4, 5004, (90.0, 45.0), 1, p1=10.0, frame=0)])
    raw.upload_rally_points([item(0, 5100, (5.0, 5.0), 2)])
    m.destroy()
""")


def draw(url, what):
    command = [sys.executable, "-c", _DRAW, url, what]  # a process of its own: MAVSDK keeps threads
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    """One boat: no drawing, a bad one, a dry run, no permission, a voyage, a second start; what came of each."""
    folder = tmp_path_factory.mktemp("drawn")
    (folder / "boat.toml").write_text(BOAT)

    def run(*arguments):
        command = [*COMPANION, "--link", f"tcp:{host}:{tcp}", "--speedup", str(PACE), *arguments]
        done = subprocess.run(command, cwd=folder, capture_output=True, text=True, timeout=180, check=False)
        return done.returncode, done.stderr, done.stdout

    options = ("--speedup", str(PACE), "--warm", "--moored", "--heading", "90", "--wind", "6@0")
    with boat_process(*options) as (host, tcp, udp):
        out = {"none": run("--from-autopilot")}
        draw(f"udpout://{host}:{udp}", "bad")
        out["bad"] = run("--from-autopilot", "boat.toml")
        draw(f"udpout://{host}:{udp}", "good")
        out["dry"] = run("--from-autopilot", "boat.toml", "--dry-run", "--limit", "30")
        out["is kept"] = (folder / "voyages" / "boat.drawn.plan").exists()
        out["alone"] = run("--from-autopilot", "--limit", "30")
        out["sailed"] = run("--from-autopilot", "boat.toml", "--exit-on-arrival", "--limit", "900")
        out["again"] = run("--from-autopilot", "boat.toml", "--exit-on-arrival", "--limit", "900")
    return folder, out


def test_a_drawing_of_mavsdk_is_sailed(said):
    folder, out = said
    code, err, text = out["sailed"]
    assert code == 0, err + text
    assert "sailing the drawing on the autopilot; it is kept at voyages/boat.drawn.plan" in err
    assert "all 5 goals reached" in text
    assert [i.command for i in read(folder / "voyages" / "boat.drawn.plan").items] == [16, 16, 177, 17]
    voyage = folder / text.split()[-1]
    assert json.loads((voyage / "summary.json").read_bytes())["mission"].startswith("boat ")
    assert (voyage / "mission" / "boat.drawn.plan").is_file()


def test_a_second_start_knows_our_list_and_that_it_has_arrived(said):
    code, err, text = said[1]["again"]
    assert code == 2
    assert "sailing the drawing kept at voyages/boat.drawn.plan" in err
    assert "had arrived before this start; --again sails it again" in text


def test_what_cannot_be_sailed_is_one_line_each_and_nothing_is_sent(said):
    code, err, _ = said[1]["bad"]
    assert code == 66
    assert "the drawing: item 3: error: DO_CHANGE_SPEED is nothing that a voyage does; take it out" in err
    assert "nothing was sent to the boat" in err
    code, err, _ = said[1]["none"]
    assert code == 66
    assert "there is no mission on the autopilot; draw waypoints and upload them" in err


def test_without_a_mission_file_nothing_is_permitted_and_it_says_what_to_write(said):
    folder, out = said
    code, err, text = out["alone"]
    assert code == 1
    assert "nothing is permitted" in err
    assert "from_autopilot = true" in err
    assert json.loads((folder / text.split()[-1] / "summary.json").read_bytes())["uploads"] == 0


def test_a_dry_run_keeps_the_drawing_in_its_own_folder_only(said):
    folder, out = said
    code, _, text = out["dry"]
    assert code == 1
    assert not out["is kept"]
    assert (folder / text.split()[-1] / "drawn.plan").is_file()


def test_neither_a_mission_nor_a_drawing_is_asked_for(capsys):
    assert cli.main(["run", "--link", "tcp:127.0.0.1:1"]) == 2
    said = "companion run: there is no mission; name a mission file, or sail what is drawn on the autopilot"
    assert capsys.readouterr().err.startswith(said)


@pytest.mark.ardurover
@pytest.mark.skipif(find() is None, reason="no ardurover: run 'sitl fetch' or set $ARDUROVER")
def test_a_drawing_of_mavsdk_is_sailed_on_the_real_ardurover(tmp_path):
    (tmp_path / "boat.toml").write_text(BOAT)

    async def call(*command):
        process = await asyncio.create_subprocess_exec(
            *command, cwd=tmp_path, stdout=asyncio.subprocess.PIPE, stderr=asyncio.subprocess.PIPE
        )
        out, err = await process.communicate()
        return process.returncode, out.decode(), err.decode()

    async def main():
        async with ArduRover(find(), HOME, Constant(0.0, 6.0), heading_rad=math.pi / 2, speedup=PACE / 2) as rover:
            shore = rover.shore_link.replace("tcp:", "tcpout://")
            await asyncio.to_thread(draw, shore, "good")
            options = ("--link", rover.link, "--speedup", str(PACE // 2), "--limit", "900")
            sailed = await call(*COMPANION, "--from-autopilot", "boat.toml", "--exit-on-arrival", *options)
            return sailed, await call(*COMPANION, "--from-autopilot", "boat.toml", "--exit-on-arrival", *options)

    (code, out, err), again = clock.run(main(), speedup=PACE / 2)
    assert code == 0, out + err
    assert "all 5 goals reached" in out
    assert "sailing the drawing kept at" in again[2]
    mission = (tmp_path / out.split()[-1] / "mission" / "mission.toml").read_text()
    assert "rally 1" in mission
