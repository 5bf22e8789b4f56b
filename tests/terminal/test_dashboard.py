"""The dashboard: what it says at 80x24 and 60x20, what is old or unknown, and how few bytes it takes."""

import re
from dataclasses import replace

import pyte
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.terminal import Frame, History, KeyCommands, Shown, changes, draw, event_words, line_of
from companion.terminal.screen import Style, clean
from companion.view import View
from companion.view.fold import aged
from companion.view.values import (
    AlarmView,
    BoatView,
    Figures,
    GoalView,
    LegView,
    Part,
    PlanView,
    PolarView,
    StateView,
    VesselView,
    WindView,
)

UNIX_S = 1_795_000_000.0
LEGS = (LegView(from_en_m=(0.0, 0.0), to_en_m=(60.0, 80.0)), LegView(from_en_m=(60.0, 80.0), to_en_m=(160.0, 80.0)))
VIEW = View(
    source="live",
    name="bay",
    t_s=600.0,
    age_s=0.4,
    state=StateView(phase="standard", why="item 2 of 4 to North mark", mode="AUTO", is_armed=True, is_sailing=True),
    alarms=(
        AlarmView(code="drifting", level="critical", text="drifting: onto Rock in 120 s", age_s=42.0),
        AlarmView(code="battery low", level="warning", text="19 %", age_s=5.0),
    ),
    boat=BoatView(
        age_s=0.4,
        at_en_m=(28.0, 29.0),
        heading_deg=35.0,
        cog_deg=37.0,
        sog_mps=1.5,
        roll_deg=-12.0,
        vmg_mps=1.0,
        cross_track_m=5.0,
        waypoint_m=60.0,
        goal_m=140.0,
        clearance_m=11.4,
        tack="starboard",
        battery_v=12.13,
        battery_share=0.8,
    ),
    wind=WindView(
        health="settling",
        age_s=0.5,
        twd_from_deg=80.0,
        tws_mps=5.0,
        sigma_deg=9.0,
        tws_sigma_mps=0.6,
        twa_deg=45.0,
        awa_deg=36.0,
        aws_mps=6.1,
    ),
    polar=PolarView(name="p", tws_mps=5.0, twa_deg=(0.0, 90.0), speed_mps=(1.5, 1.5)),
    plan=PlanView(
        number=17,
        age_s=252.0,
        leg=2,
        count=4,
        promised_risk=0.1,
        path_risk=0.31,
        next_tack_s=100.0,
        legs=LEGS,
        there_s=192.0,
        there_late_s=250.0,
    ),
    vessels=(VesselView(name="FERRY", cpa_m=41.0, cpa_s=72.0, alarm="act"),),
    goals=(
        GoalView(
            name="North mark", kind="point", at_en_m=(160.0, 80.0), is_next=True, distance_m=141.0, bearing_deg=69.0
        ),
    ),
    figures=Figures(goals=2, goals_reached=0, tacks=3),
    health=(Part(name="wind", grade="poor", text="too short"),),
)


def shown(view, **changed):
    history = History()
    if view is not None:
        history.take(view, ())
    return Shown(
        **{"link": "udpin:x", "view": view, "history": history, "helm": KeyCommands(), "unix_s": UNIX_S, **changed}
    )


@pytest.mark.parametrize(("columns", "rows"), [(80, 24), (60, 20)])
def test_what_it_says(columns, rows):
    text = draw(shown(VIEW), columns, rows).text
    lines = text.split("\n")
    assert len(lines) == rows
    assert max(map(len, lines)) <= columns
    assert lines[0].startswith(" bay  STANDARD  AUTO armed")
    assert "age 0 s" in lines[0]
    for part in (
        "item 2 of 4 to North mark",
        "CRITICAL drifting 42 s: onto Rock in 120 s",
        "080°±9° 9.7±1.2 kn",
        "45°S, apparent 36°S 11.9",
        "HDG 035° COG 037° 2.9 kn",
        "2/4 60 m at 032°, xt +5 m",
        "1/2 141 m at 069° North",
        "in 1:40, 3 done",
        "there in 3:12",
        "11 m of land, FERRY 41 m",
        "wind too short",
        "now 080°",
        "q quit  ? help  w why  h hold",
    ):
        assert part in text, f"{part!r} is not in\n{text}"
    assert ("12.1 V 80 %" in text) == (rows >= 24)


def test_it_counts_the_alarms_that_it_has_no_room_for():
    assert "(+1 alarm)" in draw(shown(VIEW), 60, 20).text


@pytest.mark.parametrize(
    "view",
    [
        None,
        View(source="radio", name="", t_s=0.0, state=StateView(phase="not heard")),
        View(
            source="radio",
            name="",
            t_s=0.0,
            state=StateView(phase="x"),
            boat=BoatView(),
            wind=WindView(health="good"),
            plan=PlanView(),
        ),
    ],
)
def test_what_is_not_known_is_no_zero(view):
    text = draw(shown(view), 80, 24).text
    text = re.sub(r"\d\d:\d\d:\d\d|udpin:x|for 0 s", "", text)
    assert not re.search(r"\d", text), text


@pytest.mark.parametrize("age_s", [11.0, 3700.0, None])
def test_what_is_old_looks_old(age_s):
    frame = draw(shown(replace(VIEW, age_s=age_s)), 80, 24)
    assert ("not heard" if age_s is None else "OLD") in frame.text.split("\n")[0]
    assert {style for _, style in frame.cells[0]} == {Style.ALARM}
    plain = {style for row in frame.cells[5:-2] for character, style in row if character != " "}
    assert Style.PLAIN not in plain
    assert Style.DIM in plain


def test_the_spread_stands_beside_the_mean_that_it_is_of():
    """ "341±10" was the wind of the moment beside the spread of a mean of 348."""
    wind = replace(VIEW.wind, mean_twd_from_deg=88.0, mean_tws_mps=4.0)
    text = draw(shown(replace(VIEW, wind=wind)), 80, 24).text
    assert "Wind   088°±9° 7.8±1.2 kn, now 080°" in text


def test_a_goal_that_was_given_up_is_counted():
    """After skip_goal "goal 2 of 2" and "Goal 1/2" stood at the same time."""
    first, second = GoalView(name="A", kind="point", at_en_m=(0.0, 0.0)), replace(VIEW.goals[-1], is_next=True)
    figures = replace(VIEW.figures, goals=2, goals_reached=0)
    text = draw(shown(replace(VIEW, goals=(first, second), figures=figures)), 80, 24).text
    assert "Goal   2/2 " in text


def test_a_companion_that_is_silent_beside_an_autopilot_that_is_not_looks_old():
    parts = (Part(name="autopilot", grade="good", age_s=0.2), Part(name="companion", grade="bad", age_s=31.0))
    assert "OLD 31 s" in draw(shown(replace(VIEW, source="radio", health=parts)), 80, 24).text.split("\n")[0]


def test_nothing_that_somebody_sends_reaches_the_terminal_as_a_command():
    """A vessel may call herself anything."""
    evil = "\x1b[2J\x1b]0;x\x07\r\n\u202e\u0000\x9b31m"
    view = replace(
        VIEW,
        vessels=(replace(VIEW.vessels[0], name=evil),),
        state=replace(VIEW.state, why=evil),
        alarms=(AlarmView(code=evil, level="error", text=evil),),
    )
    frame = draw(shown(view, said=evil), 80, 24)
    assert all(len(c) == 1 and c.isprintable() for row in frame.cells for c, _ in row)


@given(st.text())
def test_any_text_takes_one_cell_a_character(text):
    assert len(clean(text)) == len(text)
    assert clean(text).isprintable()


@settings(max_examples=60)
@given(st.integers(1, 200), st.integers(1, 60), st.booleans(), st.booleans())
def test_it_can_be_drawn_at_any_size(columns, rows, knows, has_help):
    frame = draw(shown(VIEW if knows else None, helm=KeyCommands(has_help=has_help)), columns, rows)
    assert [len(row) for row in frame.cells] == [columns] * rows


cells = st.tuples(st.sampled_from("abc °S"), st.sampled_from(Style))


@given(st.data())
def test_the_changes_make_the_next_frame_of_the_one_before(data):
    """By a terminal that is not ours (pyte)."""
    size = data.draw(st.tuples(st.integers(1, 30), st.integers(1, 6)))
    screen = pyte.Screen(*size)
    stream = pyte.Stream(screen)
    before = None
    for _ in range(3):
        after = Frame(columns=size[0], rows=size[1])
        after.cells = [data.draw(st.lists(cells, min_size=size[0], max_size=size[0])) for _ in range(size[1])]
        stream.feed("\x1b[?7l" + changes(before, after))
        assert [line.rstrip() for line in screen.display] == [
            "".join(c for c, _ in row).rstrip() for row in after.cells
        ]
        bold = {Style.BOLD, Style.STARBOARD, Style.BAD, Style.WARN}
        for row, line in enumerate(after.cells):
            for column, (_, style) in enumerate(line):
                drawn = screen.buffer[row][column]
                assert (drawn.bold, drawn.reverse) == (style in bold, style in {Style.TITLE, Style.ALARM})
        assert changes(after, after) == ""
        before = after


def test_without_colours_there_is_none():
    frame = draw(shown(VIEW), 80, 24)
    assert not re.search(r"\x1b\[(?:\d+;)*3\dm", changes(None, frame, has_colour=False))
    assert re.search(r"\x1b\[(?:\d+;)*3\dm", changes(None, frame))


def test_it_redraws_little_all_the_voyage_long(beat):
    """Twice a second, the whole of a real voyage: under 300 bytes a second, where a frame is 1920 cells."""
    history, before, sizes = History(), None, []
    for view, events in beat.moments:
        history.take(view, events)
        for half in (0.0, 0.5):
            frame = draw(
                Shown(
                    link="x",
                    view=aged(view, half),
                    history=history,
                    helm=KeyCommands(),
                    unix_s=UNIX_S + view.t_s + half,
                ),
                80,
                24,
            )
            sizes.append(len(changes(before, frame).encode()))
            before = frame
    per_s = 2.0 * sum(sizes[1:]) / len(sizes[1:])
    assert len(sizes) > 200
    assert per_s < 300.0
    assert sizes[0] < 4000


def test_the_winds_history_is_that_of_the_voyage(beat):
    history = History()
    for view, events in beat.moments:
        history.take(view, events)
    bins = history.bins(beat.views[-1].t_s, 60.0, 10)
    assert sum(b is not None for b in bins) >= 2
    newest = [v.wind.twd_from_deg for v in beat.views[-50:] if v.wind is not None]
    off = [(b.twd_from_deg - newest[0] + 180.0) % 360.0 - 180.0 for b in bins if b is not None]
    assert max(map(abs, off)) < 40.0
    text = draw(Shown(link="x", view=beat.views[-1], history=history, helm=KeyCommands(), unix_s=UNIX_S), 80, 24).text
    assert any(event_words(e)[:20] in text for e in list(history.events)[-3:])


def test_the_age_of_what_is_heard_is_told_where_the_companion_is_not():
    """A line said "age unknown" beside what the autopilot had told three seconds before."""
    silent = Part(name="companion", grade="unknown", text="not heard")
    heard = replace(VIEW, source="radio", age_s=3.0, health=(silent,))
    assert "companion not heard, autopilot's age 3 s" in line_of(heard, UNIX_S, knots=True)
    pilot = Part(name="autopilot", grade="good", age_s=2.0)
    assert "autopilot's age 2 s" in line_of(replace(heard, age_s=None, health=(pilot, silent)), UNIX_S, knots=True)
    assert "nothing heard yet" in line_of(replace(heard, age_s=None), UNIX_S, knots=True)


def test_a_line_says_the_same(beat):
    text = line_of(VIEW, UNIX_S, knots=False)
    assert "STANDARD | AUTO armed | age 0 s | wind 080°±9° 5.0 m/s" in text
    assert "CRITICAL drifting" in text
    assert "OLD 31 s" in line_of(replace(VIEW, age_s=31.0), UNIX_S, knots=True)
    assert all(line_of(view, UNIX_S, knots=True).isprintable() for view in beat.views)
