"""The watchdogs as a machine: each row of the table raised and cleared as the table says, whatever its figure does."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.messages import Mode, StatusText
from companion.safety import BY_NAME, TABLE, failsafe_named_by, number_of, standing, watchdog_of
from companion.skipper.step.actions import Announce
from companion.skipper.step.state import Raised
from companion.skipper.watch import watch as watching
from tests.skipper.moments import NOW_S, moment, route
from tests.skipper.world import with_parts

WAY = route((300.0, 0.0), (600.0, 0.0), (600.0, 0.0))


def told(dog, figures, *, gaps_s, change=None):
    """Fold the watch over one row's figures; return after each step (raised, fresh, what was said of it)."""
    ctx, out, t_s = moment(WAY), [], NOW_S
    state = ctx.state
    was, watching.measure = watching.measure, lambda _, name: figures[len(out)] if name == dog.name else None
    try:
        for gap_s in gaps_s:
            t_s += gap_s
            now = type(ctx)(ctx.voyage, ctx.config, state, replace(ctx.snapshot, t_s=t_s))
            if change is not None:
                change(now)
            watching.watch(now)
            state = now.state
            said = tuple(a.code for a in now.actions if isinstance(a, Announce))
            out.append((dog.name in [r.name for r in state.alarms.raised], dog.name in now.fresh, said))
    finally:
        watching.measure = was
    return out


def oracle(dog, figures, gaps_s):
    """The same by the words of the table: held so long at or beyond the entry, and so long at or beyond the exit."""
    grows = dog.enter >= dog.exit
    raised, held_s, cleared_s, out = False, None, None, []
    for n, figure in enumerate(figures):
        if held_s is not None:
            held_s += gaps_s[n]
        if cleared_s is not None:
            cleared_s += gaps_s[n]
        bad = figure is not None and (figure >= dog.enter if grows else figure <= dog.enter)
        good = figure is None or (figure <= dog.exit if grows else figure >= dog.exit)
        if dog.enter == dog.exit:
            good = not bad
        fresh = over = False
        if not raised:
            held_s = (held_s if held_s is not None else 0.0) if bad else None
            if held_s is not None and held_s >= dog.enter_s:
                raised, fresh, held_s, cleared_s = True, True, None, None
        else:
            cleared_s = (cleared_s if cleared_s is not None else 0.0) if good else None
            if cleared_s is not None and cleared_s >= dog.exit_s:
                raised, over, cleared_s = False, True, None
        out.append((raised, fresh, (dog.name,) if fresh else (f"{dog.name} over",) if over else ()))
    return out


ROWS = st.sampled_from([dog for dog in TABLE if dog.unsailed_enter_s is None])


@settings(max_examples=40, deadline=None)
@given(data=st.data(), dog=ROWS)
def test_a_watchdog_is_raised_and_cleared_as_its_row_says(data, dog):
    """At, beside and between its thresholds, in steps of about the times that they must last."""
    width = abs(dog.enter - dog.exit) or 1.0
    near = [dog.enter, dog.exit, 0.5 * (dog.enter + dog.exit)]
    near += [edge + side * 0.1 * width for edge in near[:2] for side in (-1.0, 1.0)]
    figures = data.draw(st.lists(st.one_of(st.none(), st.sampled_from(near)), min_size=6, max_size=14))
    beats = st.sampled_from([0.5, 1.0, 0.5 * dog.enter_s + 0.25, 0.5 * dog.exit_s + 0.25, dog.enter_s or 1.0])
    gaps_s = data.draw(st.lists(beats, min_size=len(figures), max_size=len(figures)))
    assert told(dog, figures, gaps_s=gaps_s) == oracle(dog, figures, gaps_s)


@pytest.mark.parametrize("dog", TABLE, ids=lambda dog: dog.name)
def test_each_row_at_its_very_thresholds(dog):
    """Raised in the step in which it has lasted long enough and not before; the same of its end."""
    last = dog.enter_s
    gaps_s = [1.0, max(0.0, last - 0.5), 0.5, 1.0, max(0.0, dog.exit_s - 0.5), 0.5]
    good = dog.exit if dog.enter != dog.exit else dog.enter - 1.0
    figures = [dog.enter] * 3 + [good] * 3
    seen = [raised for raised, *_ in told(dog, figures, gaps_s=gaps_s)]
    assert seen == [last == 0.0, last == 0.0, True, dog.exit_s > 0.0, dog.exit_s > 0.5, False]
    assert [fresh for _, fresh, _ in told(dog, figures, gaps_s=gaps_s)].count(True) == 1


def test_a_figure_between_the_thresholds_begins_the_end_anew():
    dog = BY_NAME["becalmed"]
    figures = [dog.enter] * 2 + [dog.exit, 1.0, dog.exit, dog.exit]
    seen = [raised for raised, *_ in told(dog, figures, gaps_s=[1.0, 60.0, 1.0, 20.0, 1.0, 29.0])]
    assert seen == [False, True, True, True, True, True]


# ------------------------------------------------------------------------------------- sooner, and when at all
@pytest.mark.parametrize(
    ("tws_mps", "unsure", "mode", "after_s"),
    [
        (5.0, "", Mode.AUTO, 20.0),
        (0.41, "", Mode.AUTO, 20.0),
        (0.39, "", Mode.AUTO, 5.0),  # nothing else can have moved her
        (5.0, "the vane turned", Mode.LOITER, 5.0),  # astern by a wind that is doubted
        (5.0, "", Mode.LOITER, 20.0),
    ],
)
def test_a_drift_is_told_sooner_where_nothing_else_can_have_moved_her(tws_mps, unsure, mode, after_s):
    dog = BY_NAME["drifting"]

    def change(ctx):
        ctx.snapshot = replace(
            ctx.snapshot,
            unsure=unsure,
            autopilot=replace(ctx.snapshot.autopilot, mode=mode),
            wind=replace(ctx.snapshot.wind, present_tws_mps=tws_mps),
            vehicle=replace(ctx.snapshot.vehicle, velocity_en_mps=(-0.5, 0.0)),  # the bow is east
        )
        ctx.state = with_parts(ctx.state, steering={"own_mode": mode})

    seen = told(dog, [200.0] * 40, gaps_s=[1.0] * 40, change=change)
    assert [raised for raised, *_ in seen].index(True) == after_s


def test_a_number_stands_for_a_watchdog_on_the_air_and_0_for_none():
    assert [number_of(""), watchdog_of(0)] == [0, ""]
    assert all(watchdog_of(number_of(dog.name)) == dog.name for dog in TABLE)
    assert len({dog.number for dog in TABLE}) == len(TABLE)
    assert watchdog_of(99) == "watchdog 99"


@pytest.mark.parametrize(
    ("status", "signs"),
    [
        ({}, ()),
        ({"system_status": 5}, ("shore link",)),
        ({"system_status": 5, "ekf_ok": False}, ("position",)),
        ({"system_status": 4, "ekf_ok": False}, ()),
        ({"battery_failed": True}, ("battery",)),
        ({"fence_breached": True, "receiver_lost": True}, ("fence", "receiver")),
    ],
)
def test_the_signs_that_a_status_shows(status, signs):
    assert standing(replace(moment(WAY).snapshot.autopilot, **status)) == signs


@pytest.mark.parametrize(
    ("text", "component", "cause"),
    [
        ("Radio Failsafe", 1, "shore link"),
        ("Radio Failsafe Cleared", 1, ""),
        ("Radio Failsafe", 191, ""),  # not the autopilot's word
        ("the Radio Failsafe", 1, ""),
        ("", 1, ""),
        ("Crash: Going to HOLD", 1, "crash"),
    ],
)
def test_the_cause_that_a_text_names(text, component, cause):
    told = StatusText(t_s=0.0, severity=4, text=text, source_component=component)
    assert failsafe_named_by(told) == cause


RESTING = {"voyage": {"sailing": True, "over": "all goals are reached"}, "mission": {"route": WAY, "index": 2}}
ASHORE = {"voyage": {"sailing": False}}
BOUND = {"voyage": {"sailing": True, "over": "all goals are reached"}}


@pytest.mark.parametrize(
    ("where", "parts", "status", "is_watched"),
    [
        ("under way", {}, {}, lambda dog: True),
        ("ashore", ASHORE, {}, lambda dog: dog.at_rest),
        ("disarmed", {}, {"is_armed": False}, lambda dog: dog.at_rest),
        ("another's", {}, {"mode": Mode.MANUAL}, lambda dog: dog.at_rest),
        ("our own mode", {"steering": {"own_mode": Mode.GUIDED}}, {"mode": Mode.GUIDED}, lambda dog: True),
        ("at rest", RESTING, {}, lambda dog: dog.at_rest or dog.loitering),
        ("at rest, disarmed", RESTING, {"is_armed": False}, lambda dog: dog.at_rest),
        ("on her way to rest", BOUND, {}, lambda dog: True),
    ],
    ids=lambda case: case if isinstance(case, str) else "",
)
def test_what_is_watched_when(where, parts, status, is_watched, monkeypatch):
    bad = {dog.name: dog.enter for dog in TABLE}
    monkeypatch.setattr(watching, "measure", lambda _, name: bad[name])
    ctx = moment(WAY, **parts)
    ctx.snapshot = replace(ctx.snapshot, autopilot=replace(ctx.snapshot.autopilot, **status))
    watching.watch(ctx)
    seen = {name for name, _ in ctx.state.alarms.entering} | {r.name for r in ctx.state.alarms.raised}
    assert seen == {dog.name for dog in TABLE if is_watched(dog)}, where


@pytest.mark.parametrize(("parts", "is_said"), [({}, True), (RESTING, False)], ids=["measured", "no longer watched"])
def test_over_is_said_of_what_is_measured_to_be_over(parts, is_said, monkeypatch):
    """At rest 36 s after the last goal "dark: over" was said of the middle of the night."""
    dog = BY_NAME["dark"]
    monkeypatch.setattr(watching, "measure", lambda _, name: dog.exit if name == dog.name else None)
    ctx = moment(WAY, **parts)
    ctx.set(alarms=replace(ctx.state.alarms, raised=(Raised(name=dog.name, since_s=0.0, clear_since_s=0.0),)))
    ctx.snapshot = replace(ctx.snapshot, t_s=dog.exit_s + 1.0)
    watching.watch(ctx)
    assert not ctx.state.alarms.raised
    assert (f"{dog.name} over" in [a.code for a in ctx.actions if isinstance(a, Announce)]) is is_said


def test_an_autopilot_that_is_not_heard_is_watched_only_for_that():
    ctx = moment(WAY, seen={"heartbeat_age_s": 10.0})
    watching.watch(ctx)
    assert ctx.fresh == ("link silent",)


def test_what_is_raised_stands_in_the_order_of_the_table_and_is_said_once(monkeypatch):
    monkeypatch.setattr(watching, "measure", lambda _, name: BY_NAME[name].enter)
    ctx = moment(WAY, up=("shoaling",), alarms={"raised": (Raised(name="shoaling", since_s=0.0),)})
    watching.watch(ctx)
    at_once = [dog.name for dog in TABLE if dog.enter_s == 0.0]
    assert [r.name for r in ctx.state.alarms.raised] == [d.name for d in TABLE if d.name in {*at_once, "shoaling"}]
    assert list(ctx.fresh) == at_once
    assert [name for name, _ in ctx.state.alarms.entering] == [
        d.name for d in TABLE if d.name not in {*at_once, "shoaling"}
    ]
    spoken = {a.code: a for a in ctx.actions if isinstance(a, Announce)}
    assert list(spoken) == at_once
    for name in at_once:
        dog = BY_NAME[name]
        assert spoken[name].severity is dog.severity
        assert (f" ({dog.enter:.1f} {dog.unit})" in spoken[name].text) is bool(dog.unit)
