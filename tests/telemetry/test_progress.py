"""What a voyage shows on a console: nothing that was said is lost, nothing that stands is cut."""

import io
import math
import os
import re
import shutil
from dataclasses import replace

import numpy as np
import pytest
import shapely

from companion.commands.report import clearance_line
from companion.field.guidance import LastResort
from companion.fold import Step
from companion.messages import CompanionStatus, Mode, Severity
from companion.orders import Verb
from companion.skipper import Skipper
from companion.skipper.planning import next_tack
from companion.skipper.planning.next_tack import NextTack
from companion.skipper.step import Phase, is_off_plan
from companion.skipper.step.actions import Announce
from companion.skipper.step.config import Guidance, SkipperConfig
from companion.skipper.step.saved import Standing
from companion.telemetry.console import ProgressLine, left_behind, progress_text
from companion.telemetry.folder.records import VoyageFigures
from companion.telemetry.status import companion_status
from companion.terminal.dashboard import line_of
from companion.view.fold import ViewFold
from companion.view.parts import alarms, health_of
from companion.words import brief_time
from sitl.scenario import verdict_line
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
    eta = step.eta()
    assert f"there in {brief_time(eta.there_s)} (90 %: {brief_time(eta.there_late_s)})" in progress_text(step)
    assert re.search(r"there in \d+:\d\d ", progress_text(step)), "a minute and more as `companion watch` has it"
    assert "there in" not in progress_text(replace(step, state=with_parts(step.state, mission={"route": None})))


@pytest.mark.parametrize(("metres", "told"), [(-0.01, "0.0 m"), (3.25, "3.2 m"), (-2.2, "2.2 m inside NAME")])
@pytest.mark.parametrize("where", ["in it", "nowhere", "outside"])
def test_a_clearance_below_nought_is_told_as_how_far_she_is_where_she_must_not_be(metres, told, where):
    """ "clearance expected -2.2 m" stood there of a plan that began in a shoal that had just been sounded."""
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    assert world.run(120, lambda w: w.state.voyage.sailing)
    here = shapely.Point(world.position).buffer(8.0)
    far = shapely.transform(here, lambda en: en + 500.0)
    sea = voyage(obstacles=[here] if where == "in it" else [], limits=far if where == "outside" else None)
    route = replace(world.state.mission.route, expected_clearance_m=metres)
    state = with_parts(world.state, mission={"route": route})
    step = Step(snapshot=world.snapshot(), state=state, actions=(), voyage=sea)
    name = sea.area.names[0] if where == "in it" else "what was drawn or found since"
    told = told.replace("inside NAME", "outside the fence" if where == "outside" else f"inside {name}")
    assert f"clearance expected {told} |" in progress_text(step)


def test_in_the_report_and_the_verdict_too():
    told = "Nearest to an obstacle or the fence: "
    assert clearance_line(-1.0, -2.1, 1) == f"{told}past its edge (plans expected 2.1 m past its edge), 1 contact!"
    assert clearance_line(3.0, 2.0, 0) == f"{told}3.0 m (plans expected 2.0 m or more), no contact."
    figures = {"time_s": 1.0, "distance_m": 1.0, "tacks": 0, "replans": 0, "min_clearance_m": 5.0}
    verdict = {"figures": {**figures, "promised_clearance_m": -2.1}, "passed": True, "scenario": "x", "seed": 0}
    assert verdict_line(verdict).endswith(
        "clearance 5.0 m (a plan began 2.1 m inside an obstacle or outside the fence)"
    )


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


@pytest.mark.parametrize(("off_m", "told"), [(-0.04, "xt +0.0 m"), (0.0, "xt +0.0 m"), (-0.06, "xt -0.1 m")])
def test_no_distance_off_the_leg_has_no_side(off_m, told):
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()), shown={"cross_track_m": off_m})
    assert world.run(120, lambda w: w.mode is Mode.AUTO and w.speed > 1.0)
    world.run(5)
    step = Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=world.skipper.voyage)
    assert told in progress_text(step)


def test_the_next_tack_is_told_as_arrival_is():
    """ "next tack about 101 s" stood beside "there in 3:22"."""
    assert NextTack(in_s=101.2, is_planned=False).words == "about 1:41"
    assert NextTack(in_s=59.7, is_planned=True).words == "1:00"


def test_held_in_a_loiter_no_tack_comes_and_the_way_to_the_circles_middle_is_none_to_the_waypoint():
    """ "WP 1/3 0 m  next tack about 6 s" was told by radio of a boat that lay in LOITER 292 m before it."""
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()), shown={"waypoint_distance_m": 0.0})
    assert world.run(120, lambda w: w.mode is Mode.AUTO and w.speed > 1.0)
    world.run(5)
    sails = Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=world.skipper.voyage)
    world.set_mode(Mode.LOITER)
    held = replace(sails, snapshot=world.snapshot(), state=with_parts(world.state, phase=Phase.HOLDING))
    in_auto = replace(sails, state=held.state)
    told = {}
    for name, step in {"sails": sails, "held": held, "in auto": in_auto}.items():
        status = companion_status(step, step.voyage, VoyageFigures(), 9.0, None)
        view, _ = ViewFold(step.voyage, SkipperConfig()).take(step, status, VoyageFigures())
        told[name] = (status.waypoint_distance_m, view.boat.waypoint_m, status.next_tack_s, view.plan.next_tack_s)
        assert ("next tack" in progress_text(step)) == (name == "sails")
        assert bool(re.search(r"wp 1/\d+ \d+ m", progress_text(step))) == (name != "held")
    assert None not in told["sails"]
    assert set(told["held"]) == {None}
    assert told["in auto"][2:] == (None, None)


def test_the_winds_spread_by_radio_is_that_of_a_minute_ahead():
    """Of the strength it was that of now: a tenth of what the page showed at the same moment."""
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    snapshot = world.snapshot()
    forecast = snapshot.wind.forecast
    grows = np.linspace(0.1, 2.0, len(forecast.horizon_s))
    forecast = replace(forecast, sigma_tws_mps=grows, sigma_twd_rad=0.1 * grows)
    snapshot = replace(snapshot, wind=replace(snapshot.wind, forecast=forecast))
    step = Step(snapshot=snapshot, state=world.state, actions=(), voyage=world.skipper.voyage)
    status = companion_status(step, step.voyage, VoyageFigures(), None, None)
    ahead = grows[int(np.argmax(forecast.horizon_s >= 60.0))]
    assert status.tws_sigma_mps == pytest.approx(ahead)
    assert status.twd_sigma_rad == pytest.approx(0.1 * ahead)


@pytest.mark.parametrize("guidance", [Guidance.FIELD, Guidance.PLAN])
def test_by_field_nothing_is_told_of_the_plan_on_board(guidance):
    """ "there in 1303 s" stood there 15 s before the goal, and the clearance of a plan that was not sailed.

    In a mission sailed by plan it is the last resort that steers.
    """
    rock = voyage(obstacles=[shapely.box(40.0, 100.0, 60.0, 120.0)])
    world = World(Skipper(voyage=rock, config=SkipperConfig(guidance=guidance)))
    assert world.run(120, lambda w: w.mode in {Mode.GUIDED, Mode.AUTO} and w.speed > 1.0)
    snapshot, config = world.snapshot(), world.skipper.config
    by_plan = Step(snapshot=snapshot, state=world.state, actions=(), voyage=rock)
    state = with_parts(world.state, by_field={"resort": LastResort(engaged=guidance is Guidance.PLAN)})
    by_field = replace(by_plan, state=state, is_off_plan=is_off_plan(snapshot, state, config))
    told, figures = {}, {}
    for name, step in {"plan": by_plan, "field": by_field}.items():
        figures[name] = VoyageFigures()
        figures[name].take(step, 9.0)
        status = companion_status(step, rock, figures[name], 9.0, None)
        view, _ = ViewFold(rock, config).take(step, status, figures[name])
        told[name] = progress_text(step), status, view
    words = {"wp ", "xt ", "clearance expected", "there in"}
    assert {w for w in words if w in told["plan"][0]} == words
    line, status, view = told["field"]
    assert not [w for w in (*words, "next tack") if w in line]
    assert re.search(r"by field, goal (\d+) m", line)[1] == f"{status.goal_distance_m:.0f}"
    place = Standing(verb=Verb.GOAL, by="the ground station", name="51.10200 -1.30000", en_m=(0.0, 1000.0), since_s=0.0)
    ordered = progress_text(replace(by_field, state=with_parts(state, orders={"standing": place})))
    assert f"by field, {math.dist(snapshot.position_en_m, place.en_m):.0f} m to goal 51.10200 -1.30000 |" in ordered
    assert status.plan_id is not None  # it is on board
    radio = (status.waypoint_distance_m, status.cross_track_m, status.next_tack_s, status.promised_risk)
    shown = (view.plan.there_s, view.plan.there_late_s, view.plan.expected_clearance_m, view.plan.path_risk)
    assert {*radio, *shown, view.plan.leg, view.plan.next_tack_s, figures["field"].promised_clearance_m} == {None}
    assert view.predicted == ()
    assert "there in" not in line_of(view, 0.0, knots=False)
    page = told["plan"][2].plan
    assert None not in {page.there_s, page.expected_clearance_m, page.path_risk, page.leg}
    assert figures["plan"].promised_clearance_m is not None


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
    lines = stream.getvalue().splitlines()
    times = [line[:40] for line in lines if "WARNING" in line or line.startswith("it is")]
    assert all(re.match(r"(\d\d:){2}\d\d |it is ", line) for line in lines)  # the standing has its time, too
    assert times == [
        "10:00:00 WARNING: so it is",
        "it is 1970-01-01 01:00:01 UTC by the aut",
        "01:00:01 WARNING: so it is",
        "01:00:02 WARNING: so it is",
    ]


@pytest.mark.parametrize(("late_s", "told"), [(8.0, "03:00:01"), (3_000.0, "02:10:02")])
def test_a_frame_that_is_read_late_turns_no_clock_back_and_another_time_of_the_autopilots_is_said(steps, late_s, told):
    """Under load "08:57:54 STANDARD ..." stood above "08:57:52 ERROR: position lost"."""
    stream = io.StringIO()
    said = (Announce(severity=Severity.WARNING, code="x", text="so it is"),)
    with ProgressLine(stream, epoch_s=3_600.0) as progress:
        for n, step in enumerate(steps):
            boot_s = n - late_s if n == 2 else float(n)
            autopilot = replace(step.snapshot.autopilot, t_s=float(n), boot_s=boot_s, utc_at_boot_s=10_800.0)
            snapshot = replace(step.snapshot, t_s=float(n), autopilot=autopilot)
            progress.show(STATUS, replace(step, snapshot=snapshot, actions=said))
    lines = stream.getvalue().splitlines()
    assert [line[:8] for line in lines if "WARNING" in line] == ["03:00:00", "03:00:01", told]
    assert ("it is 1970-01-01 02:10:02 UTC by the autopilot's clock" in lines) == (late_s > 60.0)


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


def test_a_full_disk_is_told_while_it_lasts_whatever_else_speaks(steps):
    """It vanished with "dark", and nothing was recorded to the end; the page said "written"."""
    full = "nothing is recorded: 0.0 MB left on the disk"
    status = replace(STATUS, alert_code="dark", alert_text="dark", disk_trouble=full)
    stream = io.StringIO()
    with ProgressLine(stream) as progress:
        progress.show(status, steps[0])
    assert stream.getvalue().rstrip().endswith(f" | {full}")
    assert full in [alarm.text for alarm in alarms(steps[0], status, {})]
    (records,) = (part for part in health_of(steps[0], status) if part.name == "records")
    assert (records.grade, records.text) == ("bad", full)


def test_what_is_gone_beside_her_is_a_note_and_in_no_line_of_the_standing(steps):
    """Each line ended in "without the live page: ... the port is in use"."""
    gone = "without the live page: --http 127.0.0.1:8765: the port is in use; name another one"
    status = replace(STATUS, alert_code="gone", alert_text=gone, gone=gone)
    stream = io.StringIO()
    with ProgressLine(stream) as progress:
        progress.note(f"sailing on {gone}")
        for step in steps:
            progress.show(status, step)
    assert stream.getvalue().count(gone) == 1
    assert gone in [alarm.text for alarm in alarms(steps[0], status, {})]
    (beside,) = (part for part in health_of(steps[0], status) if part.name == "beside the voyage")
    assert beside.text == gone
