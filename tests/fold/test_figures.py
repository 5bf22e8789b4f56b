"""The table of figures: what of a step it tells, and that each row is shown wherever it says."""

import dataclasses
import math

import pytest
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion import figures
from companion.boat import Afloat, LearnedAfloat, mark_of
from companion.boat.afloat import Told
from companion.commands.report import boat_file_lines
from companion.current import WaterCurrent
from companion.eta import Pace
from companion.figures import BY_NAME, FIGURES, Figure, figure_values, in_words, ranges_in_words
from companion.fold import Step
from companion.mavlink.wire.companion_status import FLOATS, SLOW, StatusReader, status_messages
from companion.mavlink.wire.frames import Codec
from companion.messages import CompanionStatus
from companion.skipper import Skipper
from companion.skipper.step.config import SkipperConfig
from companion.telemetry.console import progress_text
from companion.telemetry.folder import SailingTime, Summary, VoyageFigures
from companion.terminal.dashboard import body_of
from companion.view import HeardFold
from tests.skipper.world import FRAME, World, voyage, with_parts


@pytest.fixture
def step():
    """A step of a boat under way, whose autopilot tells where home is."""
    world = World(Skipper(voyage=voyage(), config=SkipperConfig()))
    world.shown["home"] = FRAME.geo_from_en(0.0, 0.0)
    assert world.run(120, lambda w: w.state.voyage.sailing)
    world.run(5)
    return Step(snapshot=world.snapshot(), state=world.state, actions=(), voyage=world.skipper.voyage)


def test_each_row_has_a_name_of_its_own_that_the_radio_carries():
    names = [figure.name for figure in FIGURES]
    assert len({*names, *FLOATS, SLOW}) == len(names) + len(FLOATS) + 1
    for name in names:
        assert name.startswith("co_")
        assert len(name.encode("ascii")) <= 10
    assert len({figure.label for figure in FIGURES}) == len(FIGURES)


def test_what_cannot_be_told_is_left_out(step, monkeypatch):
    for value in (None, math.nan):
        row = Figure(name="co_test", label="x", kind="number", of=lambda step, value=value: value)
        monkeypatch.setattr(figures, "FIGURES", (row,))
        assert figure_values(step, "line") == {}


def test_vmg_is_the_speed_against_the_wind(step):
    vehicle, wind = step.snapshot.vehicle, step.snapshot.wind.present_twd_from_rad
    east, north = vehicle.velocity_en_mps
    assert figure_values(step, "page")["co_vmg"] == pytest.approx(east * math.sin(wind) + north * math.cos(wind))


def test_the_speed_that_was_predicted_is_told_against_what_was_sailed(step):
    assert "co_pace" not in figure_values(step, "page")  # nothing was seen yet
    slow = dataclasses.replace(step, pace=Pace(tries=5.0, prior=0.0, took_s=100.0, made_s=70.0))
    assert figure_values(slow, "page")["co_pace"] == pytest.approx(0.7)
    assert "pace, of the plan's 70 %" in in_words(figure_values(slow, "page"))


def test_the_speed_through_the_water_is_told_beside_what_the_boat_of_the_plans_makes_there(step):
    vehicle = step.snapshot.vehicle
    water = WaterCurrent(east_mps=0.3 * math.sin(vehicle.heading_rad), north_mps=0.3 * math.cos(vehicle.heading_rad))
    there = dataclasses.replace(step, snapshot=dataclasses.replace(step.snapshot, current=water))
    for where in ("page", "radio", "report"):
        values, now = figure_values(there, where), figure_values(step, where)
        assert values["co_sailed"] == pytest.approx(vehicle.speed_mps - 0.3, abs=0.02)
        assert now["co_sailed"] == pytest.approx(vehicle.speed_mps, abs=0.02)
        assert now["co_predict"] == pytest.approx(vehicle.speed_mps, rel=0.2)
        assert values["co_predict"] != pytest.approx(now["co_predict"], rel=0.005)  # the wind over the water is another
        assert "co_learned" not in now
    ashore = dataclasses.replace(step, state=with_parts(step.state, voyage={"sailing": False}))
    assert not {"co_sailed", "co_predict"} & figure_values(ashore, "radio").keys()


def test_what_was_learned_is_told_once_plans_are_of_it(step):
    known = LearnedAfloat(of=mark_of(step.voyage.boat), told=Told(x=(-0.3, 0.0, 0.0, 0.0)), is_used=True)
    learned = dataclasses.replace(step, state=dataclasses.replace(step.state, afloat=Afloat.of(known)))
    assert figure_values(learned, "radio")["co_learned"] == pytest.approx(math.exp(-0.3))
    assert "learned, of her file 74.1 %" in in_words(figure_values(learned, "radio"))


@pytest.mark.parametrize(
    ("kind", "value", "told"),
    [
        ("distance", 116.18, "116 m"),
        ("distance", 3.14159, "3.1 m"),
        ("speed", 2.236, "2.2 m/s"),
        ("time", 81.7, "82 s"),
        ("share", 0.7412, "74.1 %"),
        ("number", 0.126, "0.13"),
    ],
)
def test_a_figure_is_told_as_finely_as_its_kind_is_anywhere_else(monkeypatch, kind, value, told):
    monkeypatch.setitem(BY_NAME, "co_test", Figure(name="co_test", label="it", kind=kind, of=lambda step: value))
    assert in_words({"co_test": value}) == [f"it {told}"]


@pytest.mark.parametrize(
    ("kind", "of_deg", "line", "page", "watch"),
    [
        ("bearing", 41.26, "41.3°", 41.3, "041°"),
        ("bearing", 359.96, "0°", 0.0, "000°"),
        ("angle", -41.26, "41.3° P", -41.3, "41°P"),
        ("angle", 318.74 - 180.0, "138.7° S", 138.7, "139°S"),
    ],
)
def test_a_row_is_on_the_line_and_over_the_radio_on_page_and_watch(step, monkeypatch, kind, of_deg, line, page, watch):
    row = Figure(name="co_test", label="test way", kind=kind, of=lambda step: math.radians(of_deg), hint="why")
    monkeypatch.setattr(figures, "FIGURES", (*FIGURES, row))
    monkeypatch.setitem(BY_NAME, row.name, row)
    assert in_words(figure_values(step, "line"))[-1] == f"test way {line}"
    assert f"test way {line}" in progress_text(step)
    assert figure_values(step, "radio")["co_test"] == page
    status = CompanionStatus(t_s=1.0, state="standard", figures=tuple(figure_values(step, "radio").items()))
    sender, receiver, reader = Codec(1, 191), Codec(254, 25), StatusReader()
    for turn in range(4):
        for sent in status_messages(status, 50.0, turn):
            for message in receiver.feed(sender.pack(sent)):
                assert reader.take(1.0, message)
    view, _ = HeardFold().take(2.0, reader.report(2.0), None, None)
    assert [(f.label, f.kind, f.value, f.hint) for f in view.shown if f.name == "co_test"] == [
        ("test way", kind, page, "why")
    ]
    assert ("test way", watch) in [row[:2] for row in body_of(view, knots=True, columns=80)]
    assert HeardFold().take(60.0, reader.report(60.0), None, None)[0].shown == ()  # long not heard


def test_a_row_is_in_the_report_from_its_least_to_its_most(step, monkeypatch):
    values = iter([3.0, -1.0, 4.0])
    way = Figure(name="co_test", label="way", kind="distance", of=lambda step: next(values))
    course = Figure(name="co_course", label="course", kind="bearing", of=lambda step: 1.0)
    monkeypatch.setattr(figures, "FIGURES", (way, course))
    monkeypatch.setattr(figures, "BY_NAME", {"co_test": way, "co_course": course})
    recorded = VoyageFigures(sailing=SailingTime(first_s=0.0))
    for _ in range(3):
        recorded.take(step, None)
    assert recorded.to_dict()["figures"] == {"co_test": {"least": -1.0, "most": 4.0, "mean": 2.0}}
    assert ranges_in_words(recorded.to_dict()["figures"]) == ["way: -1 m to 4 m, 2 m in the mean."]
    assert ranges_in_words({"co_new": {"least": 1.0, "most": 1.0, "mean": 1.0}}) == []


@pytest.mark.parametrize(("made_s", "told"), [(70.0, "70 %"), (900.0, "160 % or more"), (1.0, "25 % or less")])
def test_a_pace_that_is_kept_within_bounds_is_told_as_no_figure(step, made_s, told):
    """ "pace, of the plan's 160 %" stood there as if it had been measured."""
    seen = dataclasses.replace(step, pace=Pace(tries=5.0, prior=0.0, took_s=100.0, made_s=made_s))
    assert in_words({"co_pace": figure_values(seen, "page")["co_pace"]}) == [f"pace, of the plan's {told}"]


@pytest.mark.parametrize(
    ("sailed", "pace", "time_s", "said"),
    [
        (1.2, 0.65, 900.0, "slower"),
        (2.6, 1.4, 900.0, "faster"),
        (1.9, 0.7, 900.0, ""),
        (1.2, 1.1, 900.0, ""),
        (1.2, 0.6, 99.0, ""),
    ],
)
def test_a_boat_file_that_is_another_boats_is_told_at_the_end(sailed, pace, time_s, said):
    means = {"co_sailed": sailed, "co_predict": 2.0, "co_pace": pace}
    lines = boat_file_lines(Summary(time_s=time_s, figures={name: {"mean": mean} for name, mean in means.items()}))
    assert bool(lines) == bool(said)
    assert all(
        f"{said} than her boat file says, by 15 % or more" in line and "`companion boat learn" in line for line in lines
    )


def test_what_another_release_sends_is_not_shown():
    reader, sender, receiver = StatusReader(), Codec(1, 191), Codec(254, 25)
    for message in receiver.feed(sender.pack(wire.MAVLink_named_value_float_message(0, b"co_new", 1.0))):
        assert reader.take(1.0, message)
    assert HeardFold().take(2.0, reader.report(2.0), None, None)[0].shown == ()
