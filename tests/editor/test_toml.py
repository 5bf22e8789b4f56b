"""Mission files changed in place: what is meant is what is read again, and what was not touched stands as it stood."""

import re
import tomllib
from pathlib import Path

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.editor.toml import blocks_of, made, rewritten, text_of
from companion.geofence.mission import MissionOptions, parse_options, read_options
from companion.geofence.mission.options import (
    AreaOptions,
    BoxOptions,
    CurrentOptions,
    GateOptions,
    MarkOptions,
    PointOptions,
    RefugeOptions,
    SkipperOptions,
    SounderOptions,
    StartOptions,
)
from companion.geofence.mission.text import dump_options

MISSIONS = sorted([*Path("missions").glob("*.toml"), *Path("sitl/missions").glob("*.toml")])
latitudes = st.integers(-900_000_000, 900_000_000).map(lambda n: n / 1e7)
longitudes = st.integers(-1_800_000_000, 1_800_000_000).map(lambda n: n / 1e7)
names = st.text("abc 'é\"\\#[]=", max_size=8)
points = st.builds(
    PointOptions,
    lat=latitudes,
    lon=longitudes,
    name=names,
    radius_m=st.sampled_from([10.0, 12.0, 8.5]),
    rounding=st.sampled_from([None, "port", "starboard"]),
)
marks = st.builds(MarkOptions, lat=latitudes, lon=longitudes)
gates = st.builds(GateOptions, port_mark=marks, starboard_mark=marks, name=names, after_s=st.sampled_from([None, 60.0]))
boxes = st.builds(
    BoxOptions,
    polygon=st.sampled_from(["box.wkt", "POLYGON ((1 1, 2 1, 2 2, 1 1))"]),
    for_s=st.sampled_from([None, 300.0]),
    name=names,
)
goals = points | gates | boxes
refuges = st.builds(RefugeOptions, lat=latitudes, lon=longitudes, name=names)
areas = st.builds(
    AreaOptions,
    obstacles=st.lists(st.sampled_from(["a.wkt", "b.wkt"]), max_size=2).map(tuple),
    fence=st.sampled_from([None, "f.wkt"]),
    margin_m=st.sampled_from([12.0, 15.0]),
)
missions = st.builds(
    MissionOptions,
    goal=st.lists(goals, max_size=4).map(tuple),
    refuge=st.lists(refuges, max_size=2).map(tuple),
    name=st.none() | names,
    start=st.none() | st.builds(StartOptions, lat=latitudes, lon=longitudes),
    area=areas,
    skipper=st.builds(SkipperOptions, laps=st.sampled_from([1, 3]), end=st.sampled_from(["loiter", "home"])),
)


@st.composite
def texts(draw):
    """A mission and its file as a person may have written it: comments, odd order, dotted keys, tables in a line."""
    options = draw(missions)
    head, *tables = blocks_of(dump_options(msgspec.structs.replace(options, goal=(), refuge=())))
    tables = [b.text for b in tables]
    lists = [
        made(name, entry, is_one_of_many=True).text for name in ("goal", "refuge") for entry in getattr(options, name)
    ]
    order = draw(st.permutations([*range(len(tables)), *[-1] * len(lists)]))
    mixed, next_list = [head.text], iter(lists)
    mixed += [tables[n] if n >= 0 else next(next_list) for n in order]
    comments = iter(range(1000))
    lines = []
    for line in "\n".join(mixed).split("\n"):
        if draw(st.integers(0, 5)) == 0:
            lines.append(f"# comment {next(comments)}")
        is_commented = line and not line.endswith(",") and draw(st.integers(0, 4)) == 0
        lines.append(f"{line}   # comment {next(comments)}" if is_commented else line)
    text = "\n".join(lines) + draw(st.sampled_from(["\n", "", "\n# comment at the end\n"]))
    assert parse_options(text, "m") == options
    return text, options


@st.composite
def changed(draw, entries, new):
    """The entries in any order, some gone, some changed, some new; and their keys."""
    keys = list(draw(st.permutations(range(len(entries)))))[: draw(st.integers(0, len(entries)))]
    if draw(st.booleans()):
        keys.sort()
    keys = [*keys, *[None] * draw(st.integers(0, 2))]
    keys = draw(st.permutations(keys)) if draw(st.booleans()) else keys
    out = []
    for key in keys:
        entry = draw(new) if key is None or draw(st.integers(0, 3)) == 0 else entries[key]
        if key is not None and type(entry) is PointOptions and draw(st.booleans()):
            entry = msgspec.structs.replace(entry, lat=draw(latitudes))
        out.append(entry)
    return tuple(out), tuple(keys)


@given(data=st.data(), drawn=texts())
def test_what_is_meant_is_read_again_and_comments_stay(data, drawn):
    text, before = drawn
    goal, goal_keys = data.draw(changed(before.goal, goals))
    refuge, refuge_keys = data.draw(changed(before.refuge, refuges))
    other = data.draw(missions)
    after = msgspec.structs.replace(before, goal=goal, refuge=refuge)
    for field in ("name", "start", "area", "skipper"):
        if data.draw(st.booleans()):
            after = msgspec.structs.replace(after, **{field: getattr(other, field)})
    out = rewritten(text, before, after, {"goal": goal_keys, "refuge": refuge_keys})
    assert parse_options(out, "m") == after
    # a comment goes with its own entry, or with a table or key that goes; all others stay
    gone = len(before.goal) + len(before.refuge) - sum(k is not None for k in (*goal_keys, *refuge_keys))
    kinds = any(k is not None and type(g) is not type(before.goal[k]) for g, k in zip(goal, goal_keys, strict=True))
    same = ("name", "refuge")
    is_all_kept = (
        not gone
        and not kinds
        and after.start is not None
        and all(getattr(after, f) == getattr(before, f) for f in same)
        and all(getattr(after.area, f) == getattr(before.area, f) for f in ("fence", "obstacles"))
        and all(g == before.goal[k] for g, k in zip(goal, goal_keys, strict=True) if k is not None)
    )
    if is_all_kept:
        assert sorted(re.findall(r"# comment \d+", out)) == sorted(re.findall(r"# comment \d+", text))


@given(texts())
def test_without_a_change_not_a_byte_changes(drawn):
    text, options = drawn
    keys = {"goal": range(len(options.goal)), "refuge": range(len(options.refuge))}
    assert rewritten(text, options, options, keys) == text


@given(data=st.data(), drawn=texts())
def test_goals_that_only_change_places_keep_their_text(data, drawn):
    text, before = drawn
    keys = data.draw(st.permutations(range(len(before.goal))))
    after = msgspec.structs.replace(before, goal=tuple(before.goal[k] for k in keys))
    out = rewritten(text, before, after, {"goal": keys, "refuge": range(len(before.refuge))})
    written = [b.text.strip() for b in blocks_of(text) if b.name == "goal"]
    assert [b.text.strip() for b in blocks_of(out) if b.name == "goal"] == [written[k] for k in keys]


@given(st.text("ab=[]{}'\"\\\n #.1,", max_size=60))
def test_blocks_are_the_text_and_each_is_toml(text):
    try:
        whole = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError):
        return
    blocks = blocks_of(text)
    assert "".join(b.text for b in blocks) == text
    for block in blocks:
        assert set(tomllib.loads(block.text)) <= set(whole)
    assert text_of(blocks) == text


def test_headers_in_strings_and_arrays_are_none():
    text = 'a = """\n[[goal]]\n"""\nb = [\n  [1, 2],\n]\nc = \'\'\'x\n[area]\'\'\'\n[area]\nd = "\\""\n'
    assert [b.name for b in blocks_of(text)] == ["", "area"]


@pytest.mark.parametrize("path", MISSIONS, ids=lambda p: p.stem)
def test_one_goal_moved_is_two_numbers_in_the_file(path):
    text, before = path.read_text(), read_options(path)
    first = before.goal[0]
    if not isinstance(first, PointOptions):
        return
    after = msgspec.structs.replace(
        before, goal=(msgspec.structs.replace(first, lat=50.8200001, lon=-1.3100001), *before.goal[1:])
    )
    out = rewritten(text, before, after, {"goal": range(len(before.goal)), "refuge": range(len(before.refuge))})
    differing = [(a, b) for a, b in zip(text.split("\n"), out.split("\n"), strict=True) if a != b]
    assert [b.split("#")[0].strip() for _, b in differing] == ["lat = 50.8200001", "lon = -1.3100001"]


@pytest.mark.parametrize(
    "text",
    [
        'goal = [{lat = 1.0, lon = 2.0, name = "a"}, {lat = 3.0, lon = 4.0}]\nname = "m"\n',
        (
            'name = "m"\nstart.lat = 1.0\nstart.lon = 2.0 # c\n[[goal]]\nlat = 1.0\nlon = 2.0\n[area]\nmargin_m = 2\n'
            "[[goal]]\nlat=3.0\nlon=4.0"
        ),
        (
            '[[goal]]\nkind = "gate"\n[goal.port_mark]\nlat = 1.0 # here\nlon = 1.0\n[goal.starboard_mark]\nlat = 2.0\n'
            "lon = 1.0\n[[goal]]\nlat = 1.0\nlon = 2.0\n"
        ),
    ],
    ids=["inline", "dotted and apart", "tables in tables"],
)
def test_other_ways_to_write_a_mission(text):
    before = parse_options(text, "m")
    keys = {"goal": (1, 0), "refuge": ()}
    after = msgspec.structs.replace(
        before,
        goal=(before.goal[1], before.goal[0]),
        area=AreaOptions(margin_m=7.0, margin_floor_m=3.0),
        start=StartOptions(lat=5.0, lon=6.0),
        skipper=SkipperOptions(end="home"),
    )
    assert parse_options(rewritten(text, before, after, keys), "m") == after


def test_a_table_that_was_not_there_is_put_where_it_is_written():
    text = '[[goal]]\nlat = 1.0\nlon = 2.0\n\n[output]\nnmea = ["udp:127.0.0.1:10110"]\n'
    before = parse_options(text, "m")
    after = msgspec.structs.replace(
        before,
        current=CurrentOptions(set_deg=90.0, drift_mps=1.0),
        sounder=SounderOptions(feed="udpin:127.0.0.1:10111"),
    )
    out = rewritten(text, before, after, {"goal": (0,), "refuge": ()})
    assert [b.name for b in blocks_of(out) if b.name] == ["goal", "current", "sounder", "output"]
    assert parse_options(out, "m") == after
