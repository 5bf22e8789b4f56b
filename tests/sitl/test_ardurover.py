"""The launcher of the real ArduRover, and the simulated boat beside it. Needs the program (``sitl fetch``)."""

from __future__ import annotations

import asyncio
import math
import os
from pathlib import Path

import pytest
from pymavlink.dialects.v20 import ardupilotmega as mav

from companion import clock
from companion.errors import InputError, JobError
from companion.geo.angles import difference_rad
from companion.mavlink.transports import open_link
from sitl.ardurover.simulation import ArduRover, check, fetch, find, free_instance
from sitl.autopilot import HOME
from sitl.world.environment import Constant, Scripted, WindEvent
from tests.sitl.boats import Client, sail

PROGRAM = find()
needs_program = [
    pytest.mark.ardurover,
    pytest.mark.skipif(PROGRAM is None, reason="no ardurover: run 'sitl fetch' or set $ARDUROVER"),
]
COURSE = [(0.0, 100.0), (60.0, 100.0), (60.0, 20.0)]


async def course(client: Client) -> list[float]:
    """Sail the course; return the times of the marks after arming [s of the autopilot's clock]."""
    client.rate(mav.MAVLINK_MSG_ID_SYSTEM_TIME, 20)
    boot: list[float] = []
    marks: list[float] = []
    client.answers["SYSTEM_TIME"] = lambda m: boot.append(m.time_boot_ms / 1000.0)
    client.answers["MISSION_ITEM_REACHED"] = lambda m: marks.append(boot[-1])
    await client.wait("SYSTEM_TIME")
    await client.set_sail(COURSE)
    start = boot[-1]
    await client.wait("STATUSTEXT", 400.0, lambda m: m.text == "Mission Complete")
    return [t - start for t in marks]


@pytest.mark.parametrize("mark", [pytest.param(None, marks=needs_program)])
def test_the_same_course_on_the_real_one(mark: None, tmp_path: Path) -> None:
    async def real() -> tuple[list[float], int]:
        async with ArduRover(
            PROGRAM, HOME, Constant(0.0, 5.0), speedup=15.0, parameters={"SAIL_XTRACK_MAX": 20.0}, folder=tmp_path
        ) as boat:
            link = open_link(boat.link)
            client = Client(link.write, None)
            await link.open(client.on_bytes)
            await client.wait("HEARTBEAT", 60.0)
            await asyncio.sleep(15.0)  # the wind has come up
            marks = await course(client)
            truth = boat.truth
            assert math.dist((truth.east_m, truth.north_m), COURSE[-1]) < 25.0
            assert abs(difference_rad(truth.twd_from_rad, 0.0)) < 1e-6
            await link.close()
            return marks, truth.tacks

    measured, tacks = clock.run(real(), speedup=15.0)
    ours, our_tacks = sail(_with_tacks, SAIL_XTRACK_MAX=20.0)
    assert ours == pytest.approx(measured, rel=0.12)
    assert abs(our_tacks - tacks) <= 1


async def _with_tacks(client: Client) -> tuple[list[float], int]:
    marks = await course(client)
    return marks, client.autopilot.truth.tacks


async def reset_before_auto(client: Client) -> list[object]:
    """Reset the mission outside AUTO before the first AUTO, and try to arm; return what is seen of it."""
    assert await client.upload(COURSE) == 0
    start = clock.now_s()
    seen: list[object] = [await client.ask(mav.MAV_CMD_DO_SET_MISSION_CURRENT, 1, 1)]
    await asyncio.sleep(3.0)
    current, status = client.last("MISSION_CURRENT"), client.last("SYS_STATUS")
    seen += [current.seq, current.mission_state, current.mission_mode, status.errors_count2]
    seen.append(await client.ask(mav.MAV_CMD_COMPONENT_ARM_DISARM, 1))
    await asyncio.sleep(1.0)
    return [*seen, *(text for text in client.texts(start) if "nternal" in text or text.startswith("Mission"))]


@pytest.mark.parametrize("mark", [pytest.param(None, marks=needs_program)])
def test_the_same_internal_error_on_the_real_one(mark: None, tmp_path: Path) -> None:
    async def real() -> list[object]:
        async with ArduRover(PROGRAM, HOME, Constant(0.0, 5.0), speedup=6.0, folder=tmp_path) as boat:
            link = open_link(boat.link)
            client = Client(link.write, None)
            await link.open(client.on_bytes)
            await client.wait("HEARTBEAT", 60.0)
            seen = await reset_before_auto(client)
            await link.close()
            return seen

    assert sail(reset_before_auto, is_moored=True) == clock.run(real(), speedup=6.0)


@pytest.mark.parametrize("mark", [pytest.param(None, marks=needs_program)])
def test_wind_follows_and_two_boats_side_by_side(mark: None) -> None:
    wind = Scripted(Constant(1.0, 4.0), (WindEvent(at_s=30.0, veer_rad=1.0),))

    async def main() -> None:
        first = free_instance()
        async with ArduRover(PROGRAM, HOME, wind, speedup=20.0, instance=first, heading_rad=2.0) as one:
            assert one.link.endswith(str(5760 + 10 * first))
            second = free_instance()
            assert second != first
            async with ArduRover(PROGRAM, HOME, wind, speedup=20.0, instance=second) as two:
                assert one.truth.heading_rad == pytest.approx(2.0, abs=0.1)
                await asyncio.sleep(50.0)
                for boat in (one, two):
                    assert boat.t_s > 35.0
                assert one._seen["WIND"].speed == pytest.approx(4.0, abs=0.3)
                assert one._seen["WIND"].direction == pytest.approx(math.degrees(2.0), abs=6.0)
        assert one._process is None or one._process.returncode is not None

    clock.run(main(), speedup=20.0)


# ------------------------------------------------------------------------------- without the program
def test_a_named_program_must_exist(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="--ardurover"):
        find(tmp_path / "none")


def test_environment_names_the_program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    program = tmp_path / "rover"
    program.write_text("#!/bin/sh\n")
    monkeypatch.setenv("ARDUROVER", str(program))
    with pytest.raises(InputError, match="ARDUROVER"):
        find()
    program.chmod(0o755)
    assert find() == program


def test_a_program_that_ends_is_reported(tmp_path: Path) -> None:
    program = tmp_path / "rover"
    program.write_text("#!/bin/sh\necho cannot sail today\nexit 3\n")
    program.chmod(0o755)

    async def main() -> None:
        async with ArduRover(program, HOME, Constant(0.0, 5.0), speedup=10.0):
            raise AssertionError("it cannot be ready")

    with pytest.raises(JobError, match="ended with 3: cannot sail today"):
        clock.run(main(), speedup=10.0)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (b"<html>not found</html>", "too small"),
        (b"\0" * 2_000_000, "not a Linux x86-64 program"),
        (b"\x7fELF\x02\x01".ljust(18, b"\0") + b"\x3e\0" + b"\0" * 2_000_000, "does not run here"),
    ],
)
def test_what_was_fetched_is_checked(tmp_path: Path, content: bytes, words: str) -> None:
    source, target = tmp_path / "source", tmp_path / "cache" / "ardurover"
    source.write_bytes(content)
    with pytest.raises(JobError, match=words):
        fetch(source.as_uri(), target, timeout_s=10.0)
    assert list(target.parent.iterdir()) == []


def test_fetch_without_a_network_says_so(tmp_path: Path) -> None:
    with pytest.raises(JobError, match="cannot be reached"):
        fetch("http://127.0.0.1:9/ardurover", tmp_path / "ardurover", timeout_s=5.0)


@pytest.mark.parametrize("mark", [pytest.param(None, marks=needs_program)])
def test_the_real_program_passes_the_check_and_can_be_fetched(mark: None, tmp_path: Path) -> None:
    assert "answers --help" in check_copy(PROGRAM, tmp_path)
    text = fetch(PROGRAM.as_uri(), tmp_path / "fetched", timeout_s=30.0)
    assert "answers --help" in text
    assert os.access(tmp_path / "fetched", os.X_OK)


def check_copy(program: Path, folder: Path) -> str:
    import shutil

    copy = folder / "copy"
    shutil.copy(program, copy)
    return check(copy)
