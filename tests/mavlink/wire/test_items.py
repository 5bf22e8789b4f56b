"""Lists as the autopilot keeps them: canonical items, hashes, padding, mission.dat."""

import hashlib
import math
import struct
from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.mavlink.wire.items import (
    canonical,
    first_difference,
    mission_hash,
    pack_mission_dat,
    padded,
    unpack_mission_dat,
)
from companion.messages import ENDING, Command, MissionItem, MissionType, sailed_part

PLACELESS = (20, 93, 177, 178, 207)
COMMANDS = st.sampled_from([int(c) for c in Command])
ITEM = st.builds(
    MissionItem,
    command=COMMANDS,
    lat_e7=st.integers(-900_000_000, 900_000_000),
    lon_e7=st.integers(-1_800_000_000, 1_800_000_000),
    alt_m=st.floats(-100.0, 100.0, width=32),
    frame=st.sampled_from([0, 3, 5, 6, 10, 11]),
    params=st.tuples(*[st.floats(-1000.0, 1000.0, width=32)] * 4),
)
ITEMS = st.lists(ITEM, min_size=1, max_size=8)


@settings(max_examples=150)
@given(ITEM)
def test_canonical_is_settled(item):
    assert canonical(canonical(item)) == canonical(item)
    if item.command not in PLACELESS:
        assert (canonical(item).lat_e7, canonical(item).lon_e7) == (item.lat_e7, item.lon_e7)


@settings(max_examples=100)
@given(ITEMS, st.integers(0, 12))
def test_padding_changes_the_length_and_nothing_that_is_sailed(items, count):
    items = [*items, MissionItem(command=Command.NAV_LOITER_UNLIM, lat_e7=1, lon_e7=2)]
    long = padded(items, count)
    assert len(long) == max(len(items), count)
    assert sailed_part(long) == sailed_part(items)
    assert mission_hash(long) == mission_hash(items)
    assert all(i.command in ENDING for i in long[len(items) :])


@settings(max_examples=100)
@given(ITEMS, st.data())
def test_the_hash_names_what_is_sailed(items, data):
    ended = sailed_part(items)
    assert mission_hash(items) == mission_hash([canonical(i) for i in items])
    places = [i for i, item in enumerate(ended) if item.command not in PLACELESS]
    if not places:
        return
    where = data.draw(st.sampled_from(places))
    moved = list(items)
    step = 1 if ended[where].lat_e7 < 900_000_000 else -1
    moved[where] = MissionItem(
        command=ended[where].command,
        lat_e7=ended[where].lat_e7 + step,
        lon_e7=ended[where].lon_e7,
        alt_m=ended[where].alt_m,
        frame=ended[where].frame,
        params=ended[where].params,
    )
    assert mission_hash(moved) != mission_hash(items)
    assert first_difference(items, moved).startswith(f"item {where + 1} written")


@settings(max_examples=100)
@given(ITEMS, st.integers(0, 5), st.sampled_from(list(MissionType)))
def test_mission_dat_holds_every_bit(items, start, kind):
    data = pack_mission_dat(items, kind, start=start)
    assert len(data) == 10 + 38 * len(items)
    assert unpack_mission_dat(data) == (kind, start, tuple(items))


@settings(max_examples=150)
@given(st.binary(max_size=120))
def test_no_bytes_but_a_mission_dat_are_one(data):
    try:
        _, _, items = unpack_mission_dat(b"\x3d\x76" + data)
    except ValueError:
        return
    assert all(math.isfinite(p) for i in items for p in i.params)


def test_a_torn_or_foreign_mission_dat_says_so():
    data = pack_mission_dat([MissionItem(command=16)], MissionType.MISSION)
    with pytest.raises(ValueError, match="says 1 items and holds 0"):
        unpack_mission_dat(data[:-1])
    with pytest.raises(ValueError, match="begins with"):
        unpack_mission_dat(b"\x00" * 60)


@pytest.mark.parametrize(
    ("written", "read"),
    [
        # written to ArduRover 4.7.0-dev and read back from it on 2026-11-21
        (
            {"command": 16, "alt_m": 1.236, "frame": 6, "params": (3.7, 2.0, 3.0, 4.0)},
            {"command": 16, "alt_m": 1.23, "frame": 3, "params": (3.0, 0.0, 0.0, 0.0)},
        ),
        ({"command": 17, "params": (1.0, 2.0, -12.0, 45.0)}, {"command": 17, "params": (0.0, 0.0, -12.0, 0.0)}),
        ({"command": 18, "params": (3.0, 0.0, 20.0, 1.0)}, {"command": 18, "params": (3.0, 0.0, 20.0, 1.0)}),
        ({"command": 19, "params": (30.0, 0.0, 10.0, 1.0)}, {"command": 19, "params": (30.0, 0.0, 1.0, 1.0)}),
        (
            {"command": 93, "params": (10.0, 0.0, 0.0, 0.0)},
            {"command": 93, "frame": 0, "params": (10.0, 0.0, 0.0, 0.0)},
        ),
        (
            {"command": 177, "params": (1.0, 2.0, 0.0, 0.0)},
            {"command": 177, "frame": 0, "params": (1.0, 2.0, 0.0, 0.0)},
        ),
        (
            {"command": 178, "params": (1.0, 2.5, 50.0, 0.0)},
            {"command": 178, "frame": 0, "params": (1.0, 2.5, 50.0, 0.0)},
        ),
        (
            {"command": 207, "params": (1.0, 0.0, 0.0, 0.0)},
            {"command": 207, "frame": 0, "params": (1.0, 0.0, 0.0, 0.0)},
        ),
        ({"command": 20, "params": (1.0, 2.0, 3.0, 4.0)}, {"command": 20, "frame": 0, "params": (0.0, 0.0, 0.0, 0.0)}),
    ],
)
def test_what_the_real_autopilot_returns_is_the_same_item(written, read):
    sent = MissionItem(lat_e7=511000000, lon_e7=-12900000, **written)
    place = {} if written["command"] in PLACELESS else {"lat_e7": 511000000, "lon_e7": -12900000}
    back = MissionItem(**place, **read, autocontinue=False)
    assert first_difference([sent], [back]) == ""
    assert mission_hash([sent]) == mission_hash([back])


@pytest.mark.parametrize(
    ("command", "params", "kept"),
    [
        (Command.NAV_FENCE_POLYGON_VERTEX_INCLUSION, (5.0, 1.0, 2.0, 3.0), (5.0, 0.0, 0.0, 0.0)),  # vertices
        (Command.NAV_FENCE_POLYGON_VERTEX_EXCLUSION, (4.0, 1.0, 2.0, 3.0), (4.0, 0.0, 0.0, 0.0)),
        (Command.NAV_FENCE_CIRCLE_INCLUSION, (250.5, 1.0, 2.0, 3.0), (250.5, 0.0, 0.0, 0.0)),  # metres
        (Command.NAV_FENCE_CIRCLE_EXCLUSION, (12.0, 1.0, 2.0, 3.0), (12.0, 0.0, 0.0, 0.0)),
        (Command.NAV_RALLY_POINT, (1.0, 2.0, 3.0, 4.0), (0.0, 0.0, 0.0, 0.0)),
        (Command.NAV_FENCE_RETURN_POINT, (1.0, 2.0, 3.0, 4.0), (0.0, 0.0, 0.0, 0.0)),
    ],
)
def test_of_a_fence_only_count_or_radius_is_kept_and_its_place(command, params, kept):
    """ArduPilot's fence has no frame of its own, a rally point always the relative one."""
    item = canonical(MissionItem(command=command, lat_e7=1, lon_e7=-2, frame=5, params=params))
    assert (item.params, item.lat_e7, item.lon_e7) == (kept, 1, -2)
    assert item.frame == (3 if command in {Command.NAV_RALLY_POINT, Command.NAV_FENCE_RETURN_POINT} else 0)


@pytest.mark.parametrize(("side", "kept"), [(-12.0, -1.0), (0.0, 1.0), (20.0, 1.0)])
@pytest.mark.parametrize(("exits", "exit_kept"), [(0.0, 0.0), (0.5, 1.0), (-1.0, 0.0)])
def test_of_a_timed_loiter_whole_seconds_the_side_and_the_way_out_are_kept(side, kept, exits, exit_kept):
    item = canonical(MissionItem(command=Command.NAV_LOITER_TIME, params=(30.9, 7.0, side, exits)))
    assert item.params == (30.0, 0.0, kept, exit_kept)


def test_what_is_no_number_is_0_and_what_is_too_great_for_four_bytes_too():
    item = canonical(MissionItem(command=Command.DO_CHANGE_SPEED, params=(1.0, math.nan, 1e300, 0.1)))
    assert item.params == (1.0, 0.0, 0.0, pytest.approx(0.1, rel=1e-7))
    assert item.params[3] != 0.1  # as four bytes hold it


def test_a_mission_dat_that_skips_a_number_is_torn():
    data = bytearray(pack_mission_dat([MissionItem(command=16)] * 3, MissionType.MISSION, start=2))
    assert unpack_mission_dat(bytes(data))[1] == 2
    second = 10 + 38 + 28  # header, an item, and what is before the number
    assert data[second : second + 2] == b"\3\0"
    data[second] = 7
    with pytest.raises(ValueError, match=r"item 3 of mission\.dat says it is number 7"):
        unpack_mission_dat(bytes(data))


def test_padding_repeats_the_last_item_and_the_name_ends_with_the_mission():
    way, end = MissionItem(command=16, lat_e7=5), MissionItem(command=Command.NAV_LOITER_UNLIM, lat_e7=9)
    assert padded([way, end], 4) == (way, end, end, end)
    assert padded([], 3) == ()
    assert sailed_part([way, end, way]) == (way, end)
    assert sailed_part([way, way]) == (way, way)
    home = MissionItem(command=Command.NAV_RETURN_TO_LAUNCH)
    assert mission_hash([way, home, way]) == mission_hash([way, home]) != mission_hash([way, way, home])


def test_an_item_that_differs_is_named_by_its_number_and_place():
    one, other = MissionItem(command=16, lat_e7=511000000), MissionItem(command=16, lat_e7=511000001)
    assert first_difference([one, one], [one, other]).startswith("item 2 written command 16 at 51.1000000, 0.0000000")


def test_lengths_differ_in_words():
    one = MissionItem(command=16)
    assert first_difference([one, one], [one]) == "2 items written, 1 read back"
    assert first_difference([one], [one]) == ""


def test_mission_dat_is_what_the_protocol_s_own_message_is_made_of():
    """An item of the file is the payload of a MISSION_ITEM_INT to the autopilot, as pymavlink packs it."""
    item = MissionItem(
        command=Command.NAV_LOITER_TIME,
        lat_e7=511_234_567,
        lon_e7=-13_456_789,
        alt_m=12.5,
        frame=3,
        params=(1.5, 2.5, 3.5, 4.5),
        autocontinue=False,
    )
    for kind in MissionType:
        data = pack_mission_dat([item, replace(item, autocontinue=True)], kind, start=3, options=2)
        assert data[:10] == b"\x3d\x76" + bytes([int(kind), 0, 2, 0, 3, 0, 2, 0])
        for n in range(2):
            message = wire.MAVLink_mission_item_int_message(
                1, 1, 3 + n, 3, item.command, 0, n, *item.params, item.lat_e7, item.lon_e7, item.alt_m, int(kind)
            )
            packed = message.pack(wire.MAVLink(None, 1, 1))
            payload = packed[10 : 10 + packed[1]].ljust(38, b"\0")
            assert data[10 + 38 * n : 48 + 38 * n] == payload
        assert unpack_mission_dat(data)[2] == (item, replace(item, autocontinue=True))


def test_what_is_no_number_in_a_mission_dat_is_0():
    data = bytearray(
        pack_mission_dat([MissionItem(command=16, alt_m=5.0, params=(1.0, 2.0, 3.0, 4.0))], MissionType.FENCE)
    )
    nan = struct.pack("<f", math.nan)
    for at in (10, 14, 18, 22, 34):
        data[at : at + 4] = nan
    (item,) = unpack_mission_dat(bytes(data))[2]
    assert (item.params, item.alt_m) == ((0.0, 0.0, 0.0, 0.0), 0.0)


@pytest.mark.parametrize(("frame", "kept"), [(0, 0), (3, 3), (5, 0), (6, 3), (10, 10), (11, 10), (2, 2)])
def test_of_a_frame_the_plain_one_is_kept(frame, kept):
    assert canonical(MissionItem(command=Command.NAV_WAYPOINT, frame=frame)).frame == kept


@pytest.mark.parametrize(
    ("command", "params", "kept", "frame"),
    [
        (Command.NAV_WAYPOINT, (3.7, 2.0, 3.0, 4.0), (3.0, 0.0, 0.0, 0.0), 3),
        (Command.NAV_LOITER_UNLIM, (1.0, 2.0, -12.7, 4.0), (0.0, 0.0, -12.0, 0.0), 3),
        (Command.NAV_RETURN_TO_LAUNCH, (1.0, 2.0, 3.0, 4.0), (0.0, 0.0, 0.0, 0.0), 0),
        (Command.NAV_DELAY, (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0), 0),
        (Command.DO_JUMP, (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0), 0),
        (Command.DO_CHANGE_SPEED, (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0), 0),
        (Command.DO_FENCE_ENABLE, (1.0, 2.0, 3.0, 4.0), (1.0, 2.0, 3.0, 4.0), 0),
        (Command.NAV_LOITER_TURNS, (3.0, 2.0, 20.0, 4.0), (3.0, 2.0, 20.0, 4.0), 3),
    ],
)
def test_what_is_kept_of_each_command(command, params, kept, frame):
    item = canonical(MissionItem(command=command, lat_e7=7, lon_e7=-9, alt_m=3.0, frame=3, params=params))
    assert (item.params, item.frame, item.alt_m, item.autocontinue) == (kept, frame, 0.0, True)
    assert (item.lat_e7, item.lon_e7) == ((0, 0) if frame == 0 else (7, -9))


def test_the_name_of_a_mission_is_the_digest_of_what_is_kept():
    """By its own definition, laid out by hand: it is in files that earlier versions wrote."""
    way = MissionItem(
        command=16, lat_e7=511_000_000, lon_e7=-13_000_000, alt_m=7.0, frame=6, params=(3.7, 1.0, 1.0, 1.0)
    )
    end = MissionItem(command=Command.NAV_LOITER_UNLIM, lat_e7=1, lon_e7=-2, params=(0.0, 0.0, -5.0, 0.0))
    told = struct.pack("<HBii4f", 16, 3, 511_000_000, -13_000_000, 3.0, 0.0, 0.0, 0.0)
    told += struct.pack("<HBii4f", 17, 3, 1, -2, 0.0, 0.0, -5.0, 0.0)
    assert mission_hash([way, end, way]) == hashlib.sha256(told).hexdigest()[:16]
