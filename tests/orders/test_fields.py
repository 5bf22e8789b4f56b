"""Orders as MAVLink fields: what we send is what is read, and nothing that anybody sends raises."""

import math

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from pymavlink.dialects.v20 import ardupilotmega as wire

from companion.orders import (
    COMMANDS,
    RESULTS,
    TABLE,
    Place,
    Result,
    Verb,
    Wanted,
    mark_of,
    message_of,
    wanted_of,
    which,
)
from companion.orders.mavlink_commands import GLOBAL_FRAMES, PLACE_COMMAND, VERB_COMMAND

FLOAT32 = st.floats(width=32, allow_nan=True, allow_infinity=True)
INT32 = st.integers(-(2**31), 2**31 - 1)


def on_the_wire(message):
    """Return the message as it arrives: packed and decoded by pymavlink."""
    sender, receiver = wire.MAVLink(None, 255, 190), wire.MAVLink(None, 1, 191)
    return receiver.decode(bytearray(message.pack(sender)))


def test_each_verb_has_a_number_of_its_own_and_a_row():
    assert {row.verb for row in TABLE} == set(Verb)
    assert [row.number for row in TABLE] == list(range(1, len(Verb) + 1))
    assert {31010, 31011} == COMMANDS
    assert {Result.NO_ANSWER} == set(Result) - set(RESULTS)


@pytest.mark.parametrize(
    "wanted",
    [
        *(Wanted(verb=v) for v in Verb if v is not Verb.GOAL),
        Wanted(verb=Verb.REFUGE, number=2),
        Wanted(verb=Verb.GOAL, place=Place(lat_deg=-33.8567844, lon_deg=151.2152967)),
    ],
)
def test_what_is_sent_is_what_is_read(wanted):
    message = on_the_wire(message_of(wanted, 7))
    assert (message.target_system, message.target_component) == (7, 191)
    read = wanted_of(message)
    assert (read.verb, read.number, read.fault) == (wanted.verb, wanted.number, "")
    if wanted.place is not None:
        assert read.place.lat_deg == pytest.approx(wanted.place.lat_deg, abs=1e-7)
        assert read.place.lon_deg == pytest.approx(wanted.place.lon_deg, abs=1e-7)


@given(st.lists(st.text(min_size=1).filter(str.strip), min_size=1, max_size=8, unique_by=mark_of), st.data())
@settings(max_examples=60)
def test_a_refuges_name_travels_as_a_number(names, data):
    wanted = data.draw(st.sampled_from(names))
    read = wanted_of(on_the_wire(message_of(Wanted(verb=Verb.REFUGE, name=wanted), 1)))
    assert which(read, names) == names.index(wanted)
    assert 1 <= mark_of(wanted) < 1 << 24
    assert mark_of(" mill BAY ") == mark_of("Mill Bay")


@pytest.mark.parametrize("number", [0, 1, 200])
def test_which_shoal_travels_as_a_number(number):
    wanted = Wanted(verb=Verb.FORGET_SHOAL, number=number)
    assert wanted_of(on_the_wire(message_of(wanted, 1))) == wanted
    odd = wire.MAVLink_command_long_message(1, 191, VERB_COMMAND, 0, 14.0, 1.5, 0, 0, 0, 0, 0)
    assert "the shoal's number" in wanted_of(on_the_wire(odd)).fault


@settings(max_examples=300)
@given(st.sampled_from(sorted(COMMANDS)), st.lists(FLOAT32, min_size=7, max_size=7))
@example(VERB_COMMAND, [math.nan] * 7)
@example(VERB_COMMAND, [6.0] + [0.0] * 6)
@example(VERB_COMMAND, [4.0, math.nan, math.nan] + [0.0] * 4)
@example(VERB_COMMAND, [4.0, 1e30, 0.0] + [0.0] * 4)
def test_any_command_long_is_read_or_says_why_not(command, params):
    wanted = wanted_of(on_the_wire(wire.MAVLink_command_long_message(1, 191, command, 0, *params)))
    assert wanted.verb is not None or wanted.fault
    if command == PLACE_COMMAND or (math.isfinite(params[0]) and params[0] not in range(1, len(TABLE) + 1)):
        assert wanted.fault
    assert wanted.words


@settings(max_examples=300)
@given(
    st.sampled_from(sorted(COMMANDS)),
    st.integers(0, 255),
    st.lists(FLOAT32, min_size=4, max_size=4),
    INT32,
    INT32,
    FLOAT32,
)
@example(PLACE_COMMAND, 0, [0.0] * 4, 0, 0, 0.0)
@example(PLACE_COMMAND, 6, [0.0] * 4, 2**31 - 1, 2**31 - 1, math.nan)
def test_any_command_int_is_read_or_says_why_not(command, frame, params, x, y, z):
    wanted = wanted_of(on_the_wire(wire.MAVLink_command_int_message(1, 191, frame, command, 0, 0, *params, x, y, z)))
    assert wanted.verb is not None or wanted.fault
    if command == PLACE_COMMAND:
        assert bool(wanted.fault) is (frame not in GLOBAL_FRAMES)
    if wanted.place is not None and not wanted.place.trouble:
        assert wanted.place.point.lat_deg == x / 1e7


@pytest.mark.parametrize(
    ("lat_deg", "lon_deg", "says"),
    [
        (0.0, 0.0, "no position that anybody means"),
        (math.nan, 1.0, "not a number"),
        (math.inf, 1.0, "not a number"),
        (151.2, -33.8, "not a latitude"),
        (51.0, 181.0, "not a longitude"),
        (51.0, -1.3, ""),
    ],
)
def test_a_place_says_what_is_wrong_with_it(lat_deg, lon_deg, says):
    place = Place(lat_deg=lat_deg, lon_deg=lon_deg)
    assert says in place.trouble
    assert bool(place.trouble) is bool(says)


def test_nothing_is_sent_that_cannot_be():
    for wanted in (
        Wanted(verb=None, fault="no"),
        Wanted(verb=Verb.GOAL),
        Wanted(verb=Verb.GOAL, place=Place(lat_deg=0.0, lon_deg=0.0)),
    ):
        with pytest.raises(ValueError, match=r"no|position"):
            message_of(wanted, 1)
