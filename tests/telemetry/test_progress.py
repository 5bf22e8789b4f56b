"""What a voyage shows on a console: nothing that was said is lost, nothing that stands is cut."""

import io
import math
import os
import re
import shutil
from dataclasses import replace

import pytest
import shapely

from companion.fold import Step
from companion.messages import CompanionStatus, Mode, Severity
from companion.skipper import Skipper
from companion.skipper.planning import next_tack
from companion.skipper.step.actions import Announce
from companion.skipper.step.config import Guidance, SkipperConfig
from companion.telemetry.console import ProgressLine, left_behind, progress_text
from tests.skipper.world import World, voyage, with_parts

STATUS = CompanionStatus(t_s=0.0, state="waiting")
LONG = "waiting for permission to upload the plan that is ready, which [operator] upload = true would give, or a person"


class Terminal(io.StringIO):
    def isatty(self):
        return True

    def screen(self):
        """Return the lines that a terminal shows: it knows \\r, \\n, cursor up and erase below."""
        lines, row, column = [""], 0, 0
        for part in re.findall(r"\x1b\[\d*[AJ]|[\r\n]|[^\x1b\r\n]+", self.getvalue()):
            if part == "\r":
                column = 0
            elif part == "\n":
                row, column = row + 1, 0
                lines += [""] * (row + 1 - len(lines))
            elif part.endswith("A") and part.startswith("\x1b"):
                row -= int(part[2:-1])
            elif part.endswith("J") and part.startswith("\x1b"):
                lines[row:] = [lines[row][:column]]
            else:
                lines[row] = lines[row][:column] + part + lines[row][column + len(part) :]
                column += len(part)
        return lines


@pytest.fixture
def steps():
    """Three steps of a boat that waits, with something said in the second."""
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    world.run(3)
    out = []
    for n in range(3):
        said = (Announce(severity=Severity.WARNING, code="x", text="the fence is not in force"),) if n == 1 else ()
        snapshot = replace(world.snapshot(), t_s=float(n))
        out.append(
            Step(snapshot=snapshot, state=_with(world.state, why=LONG), actions=said, voyage=world.skipper.voyage)
        )
    return out


def test_the_line_tells_the_clearance_and_when_she_is_there():
    world = World(Skipper(voyage=voyage(obstacles=[shapely.box(40.0, 100.0, 60.0, 120.0)]), config=SkipperConfig()))
    assert world.run(120, lambda w: w.state.voyage.sailing)
    world.run(5)
    step = Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=world.skipper.voyage)
    route = world.state.mission.route
    assert f"clearance expected {route.expected_clearance_m:.1f} m" in progress_text(step)
    tack = next_tack(step, step.voyage.boat)
    assert ("next tack" in progress_text(step)) == (tack is not None)
    assert ("next tack about" in progress_text(step)) == (tack is not None and not tack.is_planned)
    left = re.search(r"there in (\d+) s \(90 %: (\d+) s\)", progress_text(step))
    assert (float(left[1]), float(left[2])) == pytest.approx((step.eta().there_s, step.eta().there_late_s), abs=0.6)
    assert "there in" not in progress_text(replace(step, state=with_parts(step.state, mission={"route": None})))


def test_steered_by_headings_the_way_to_the_waypoint_is_her_own():
    """ArduRover knows of none then: "wp 60/62 0 m" and "xt -0.0 m" stood there all the way."""
    config = SkipperConfig(guidance=Guidance.HEADING)
    world = World(Skipper(voyage=voyage(), config=config), shown={"waypoint_distance_m": 0.0, "cross_track_m": 0.0})
    assert world.run(120, lambda w: w.mode is Mode.GUIDED and w.speed > 1.0)
    world.run(5)
    step = Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=world.skipper.voyage)
    left_m = math.dist(world.position, world.state.mission.route.points_en_m[world.state.mission.index])
    assert left_m > 10.0
    assert re.search(r"wp \d+/\d+ (\d+) m", progress_text(step))[1] == f"{left_m:.0f}"
    world.set_mode(Mode.AUTO)
    by_autopilot = replace(step, snapshot=world.snapshot())
    assert re.search(r"wp \d+/\d+ (\d+) m", progress_text(by_autopilot))[1] == "0"


def _with(state, **changes):
    return with_parts(state, voyage={"sailing": False}, **changes)


def test_at_80_columns_the_sentence_is_whole_and_what_was_said_stays(steps, monkeypatch):
    """It was cut to "waiting for permissi", and announcements were never printed."""
    monkeypatch.setattr(shutil, "get_terminal_size", lambda fallback: os.terminal_size((80, 24)))
    terminal = Terminal()
    with ProgressLine(terminal) as progress:
        for step in steps:
            progress.show(STATUS, step)
    lines = terminal.screen()
    assert all(len(line) < 80 for line in lines)
    text = " ".join(line.strip() for line in lines)
    assert text.count(LONG) == 1
    assert text.count("WARNING: the fence is not in force") == 1
    assert text.index("WARNING") < text.index(LONG)


def test_without_a_terminal_what_is_said_is_a_line_at_once(steps):
    stream = io.StringIO()
    with ProgressLine(stream, epoch_s=3600.0) as progress:
        for step in steps:
            progress.show(STATUS, step)
    lines = stream.getvalue().splitlines()
    assert re.fullmatch(r"01:00:\d\d WARNING: the fence is not in force", lines[1])
    assert lines[0].endswith(LONG)
    assert len(lines) == 2


@pytest.mark.parametrize(("off_s", "hour"), [(7_200.0, "03"), (3.0, "01")])
def test_what_is_said_has_the_autopilots_time_where_this_computers_is_another(steps, off_s, hour):
    """A demonstration that began on 9 June, 10:13, told its goal by the hour at the desk."""
    stream = io.StringIO()
    with ProgressLine(stream, epoch_s=3600.0) as progress:
        for step in steps:
            t_s = step.snapshot.t_s
            autopilot = replace(step.snapshot.autopilot, t_s=t_s, boot_s=t_s, utc_at_boot_s=3600.0 + off_s)
            progress.show(STATUS, replace(step, snapshot=replace(step.snapshot, autopilot=autopilot)))
    assert re.search(rf"^{hour}:00:\d\d WARNING: the fence", stream.getvalue(), re.MULTILINE)


def test_where_times_turn_to_the_autopilots_clock_that_is_said_and_they_never_turn_back(steps):
    """Lines of the hour at the desk stood above lines of the scenario's, and times went backwards without a word."""
    stream = io.StringIO()
    said = (Announce(severity=Severity.WARNING, code="x", text="so it is"),)
    with ProgressLine(stream, epoch_s=36_000.0) as progress:
        for n, step in enumerate(steps):
            autopilot = replace(step.snapshot.autopilot, t_s=float(n), boot_s=float(n), utc_at_boot_s=3_600.0)
            untold = replace(step.snapshot.autopilot, utc_at_boot_s=None)
            snapshot = replace(step.snapshot, autopilot=autopilot if n == 1 else untold)
            progress.show(STATUS, replace(step, snapshot=snapshot, actions=said))
    times = [line[:40] for line in stream.getvalue().splitlines() if line[0].isdigit() or line.startswith("it is")]
    assert times == [
        "10:00:00 WARNING: so it is",
        "it is 1970-01-01 01:00:01 UTC by the aut",
        "01:00:01 WARNING: so it is",
        "01:00:02 WARNING: so it is",
    ]


def test_what_is_left_behind_is_said_with_where_she_will_end():
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    made = world.skipper.voyage
    assert "disarmed" in left_behind(Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=made))
    world.run(60)
    step = Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=made)
    assert step.snapshot.autopilot.mode is Mode.AUTO
    end = world.state.mission.route.items[-1].point
    assert re.fullmatch(
        rf"the boat sails on in AUTO: \d+ items to go, the last a loiter at {end.lat_deg:.5f}, {end.lon_deg:.5f}",
        left_behind(step),
    )
