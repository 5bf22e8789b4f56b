"""Orders and statuses as bytes: what is packed is read, by ours and by the page; what anybody else sends is refused."""

import math
from datetime import UTC, datetime

import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from companion.messages import GeoPoint
from companion.orders import Place, Verb, Wanted, mark_of
from companion.orders.far import (
    Beginning,
    FarKey,
    FarOrder,
    FarStatus,
    Reply,
    order,
    pack_beginning,
    pack_order,
    pack_status,
    status,
    unpack_beginning,
    unpack_order,
    unpack_status,
)
from companion.orders.far.order import BitField
from companion.safety import TABLE
from companion.skipper.step import Phase
from companion.traffic import Alarm
from tests.orders.far import by_the_page

KEY = FarKey(bytes(range(32)), 1)
ORDER, STATUS = "The order", "The status"


def maybe(strategy):
    return st.none() | strategy


def positive(most):
    return maybe(st.floats(0.0, most))


POSITION = st.builds(GeoPoint, lat_deg=st.floats(-90.0, 90.0), lon_deg=st.floats(-180.0, 180.0))
PLACE = st.builds(Place, lat_deg=st.floats(-90.0, 90.0), lon_deg=st.floats(-180.0, 180.0)).filter(
    lambda place: not place.trouble
)
WANTED = st.one_of(
    st.sampled_from(sorted(set(Verb) - {Verb.GOAL, Verb.REFUGE})).map(lambda verb: Wanted(verb=verb)),
    st.builds(Wanted, verb=st.just(Verb.GOAL), place=PLACE),
    st.builds(Wanted, verb=st.just(Verb.REFUGE), number=st.integers(0, 255), name=st.text(max_size=20)),
)
ORDERS = st.builds(FarOrder, wanted=WANTED, counter=st.integers(1, 0xFFFF), expires_min=st.integers(0, 0xFFFFFF))
STATUSES = st.builds(
    FarStatus,
    phase=st.sampled_from(status.PHASES),
    sequence=st.integers(0, 255),
    minute=maybe(st.integers(0, 2**24 - 2)),
    is_heard=st.booleans(),
    is_armed=st.booleans(),
    is_under_way=st.booleans(),
    has_trouble=st.booleans(),
    standing=maybe(st.sampled_from(list(Verb))),
    position=maybe(POSITION),
    goal_m=positive(655_000.0),
    waypoint_m=positive(65_000.0),
    speed_mps=positive(25.4),
    twd_from_rad=maybe(st.floats(-7.0, 7.0)),
    tws_mps=positive(50.0),
    twd_sigma_rad=positive(3.1),
    goal=maybe(st.integers(1, 254)),
    goals=maybe(st.integers(1, 254)),
    plan_age_s=positive(15_000.0),
    promised_risk=positive(1.0),
    clearance_m=positive(508.0),
    cpa_m=positive(1016.0),
    alarm=st.sampled_from(["", *status.ALARMS]),
    watchdog=st.sampled_from(["", *(dog.name for dog in TABLE)]),
    battery_v=positive(50.8),
    order=maybe(st.integers(1, 0xFFFF)),
    reply=maybe(st.sampled_from(list(Reply))),
)
# Half a count, and a little for the sum.
STEPS = {
    "goal_m": 5.0,
    "waypoint_m": 0.5,
    "speed_mps": 0.05,
    "tws_mps": 0.1,
    "twd_sigma_rad": math.radians(0.5),
    "plan_age_s": 30.0,
    "promised_risk": 0.002,
    "clearance_m": 1.0,
    "cpa_m": 2.0,
    "battery_v": 0.1,
}


@settings(max_examples=300)
@given(ORDERS)
def test_an_order_is_read_as_it_was_given(given_order):
    data = pack_order(given_order, KEY)
    assert len(data) == 24
    back, wanted = unpack_order(data, KEY), given_order.wanted
    assert (back.counter, back.expires_min) == (given_order.counter, given_order.expires_min)
    assert (back.wanted.verb, back.wanted.number) == (wanted.verb, wanted.number)
    assert back.wanted.mark == (mark_of(wanted.name) if wanted.name else 0)
    if wanted.place is not None:
        assert back.wanted.place.lat_deg == pytest.approx(wanted.place.lat_deg, abs=0.51e-7)
        assert back.wanted.place.lon_deg == pytest.approx(wanted.place.lon_deg, abs=0.51e-7)
    counts = by_the_page.read(ORDER, data, KEY.key)
    assert by_the_page.write(ORDER, KEY.key, 1, **counts) == data


@settings(max_examples=300)
@given(STATUSES)
def test_a_status_is_read_as_it_was_told_within_its_steps(told):
    data = pack_status(told, KEY)
    assert len(data) == 42
    back = unpack_status(data, KEY)
    for name in FarStatus.__slots__:
        was, now = getattr(told, name), getattr(back, name)
        if name == "position" and was is not None:
            assert (now.lat_deg, now.lon_deg) == pytest.approx((was.lat_deg, was.lon_deg), abs=0.51e-7)
        elif name == "twd_from_rad" and was is not None:
            assert abs(math.remainder(was - now, 2.0 * math.pi)) <= math.radians(1.0) + 1e-9
        elif name in STEPS and was is not None:
            assert now == pytest.approx(was, abs=STEPS[name] + 1e-9), name
        else:
            assert now == was, name
    counts = by_the_page.read(STATUS, data, KEY.key)
    assert by_the_page.write(STATUS, KEY.key, 1, **counts) == data
    assert counts["order"] == (told.order or 0)


@pytest.mark.parametrize(
    ("name", "value", "shown"),
    [
        ("speed_mps", 99.0, 25.4),
        ("battery_v", 60.0, 50.8),
        ("goal_m", 1e9, 655_340.0),
        ("clearance_m", -3.0, 0.0),
        ("plan_age_s", 1e6, 15_240.0),
        ("minute", 2**24, 2**24 - 2),
        ("minute", -5, 0),
        ("goal", 300, 254),
    ],
)
def test_what_does_not_fit_is_the_nearest_that_does_and_never_unknown(name, value, shown):
    assert getattr(
        unpack_status(pack_status(FarStatus(phase="idle", **{name: value}), KEY), KEY), name
    ) == pytest.approx(shown)


@pytest.mark.parametrize(
    ("name", "last", "says"),
    [
        ("phase", len(status.PHASES) - 1, lambda told: told.phase == status.PHASES[-1]),
        ("reply", len(status.REPLIES), lambda told: told.reply == status.REPLIES[-1]),
        ("reply", (len(status.ALARMS) - 1) << 4, lambda told: told.alarm == status.ALARMS[-1]),
        ("reply", 15 << 4, lambda told: not told.alarm),  # no vessel was ever heard
    ],
)
def test_the_last_word_of_a_list_is_read_and_the_one_behind_it_is_another_release_s(name, last, says):
    """One more than this release knows is refused in a line: shown, it would be another phase, or end the display."""
    assert says(unpack_status(by_the_page.write(STATUS, KEY.key, 1, **{"reply": 15 << 4, name: last}), KEY))
    behind = last + 1 if last < 16 else last + (1 << 4)
    if behind < 256:
        with pytest.raises(ValueError, match="another release made it"):
            unpack_status(by_the_page.write(STATUS, KEY.key, 1, **{"reply": 15 << 4, name: behind}), KEY)


GOOD_ORDER = pack_order(
    FarOrder(wanted=Wanted(verb=Verb.GOAL, place=Place(lat_deg=50.8, lon_deg=-1.3)), counter=7, expires_min=3_600_000),
    KEY,
)
GOOD_STATUS = pack_status(FarStatus(phase="standard"), KEY)
GOOD_BEGINNING = pack_beginning(Beginning(began=3_599_000, expires_min=3_600_000), KEY)


@pytest.mark.parametrize(
    ("data", "unpack"), [(GOOD_ORDER, unpack_order), (GOOD_STATUS, unpack_status), (GOOD_BEGINNING, unpack_beginning)]
)
def test_one_bit_changed_is_refused(data, unpack):
    unpack(data, KEY)
    for bit in range(8 * len(data)):
        bad = bytearray(data)
        bad[bit // 8] ^= 1 << bit % 8
        with pytest.raises(ValueError, match="its code is wrong"):
            unpack(bytes(bad), KEY)


@settings(max_examples=300)
@given(st.binary(max_size=60) | st.binary(min_size=24, max_size=24) | st.binary(min_size=42, max_size=42))
@example(b"")
@example(GOOD_ORDER[:-1])
@example(GOOD_ORDER + b"\0")
@example(bytes(24))
@example(bytes(42))
def test_what_is_not_ours_is_refused_in_one_line(data):
    for unpack in (unpack_order, unpack_status, unpack_beginning):
        with pytest.raises(ValueError, match=r"\Ait") as refusal:
            unpack(data, KEY)
        assert "\n" not in str(refusal.value)


@settings(max_examples=300)
@given(st.binary(min_size=16, max_size=16), st.binary(min_size=34, max_size=34))
def test_with_the_right_code_too_nothing_but_a_message_is_taken(body, other):
    """Who has the key may be of another release: what cannot be said by this one is refused, or read and said alike."""
    for unpack, pack, sealed in (
        (unpack_order, pack_order, KEY.sealed("order", body)),
        (unpack_status, pack_status, KEY.sealed("status", other)),
    ):
        for data in (sealed, KEY.sealed("order" if pack is pack_order else "status", b"\1" + sealed[1:-8])):
            try:
                read = unpack(data, KEY)
            except ValueError:
                continue
            if pack is pack_order and read.wanted.place is not None and read.wanted.place.trouble:
                continue
            if "watchdog" in getattr(read, "watchdog", ""):
                continue  # of a later release
            assert unpack(pack(read, KEY), KEY) == read


@pytest.mark.parametrize("stranger", [FarKey(bytes(32), 1), FarKey(KEY.key, 2)])
def test_another_key_and_another_boat_are_refused(stranger):
    with pytest.raises(ValueError, match="another key, or not system"):
        unpack_order(GOOD_ORDER, stranger)
    assert all(secret not in repr(KEY) for secret in (KEY.key.hex(), repr(KEY.key), str(list(KEY.key))))


@settings(max_examples=100)
@given(ORDERS, st.integers(1, (1 << 24) - 1), st.integers(0, (1 << 24) - 1))
def test_an_order_of_a_beginning_is_none_of_another(given_order, began, other):
    since = KEY.since(began)
    data = pack_order(given_order, since)
    assert unpack_order(data, since).counter == given_order.counter
    assert by_the_page.write(ORDER, KEY.key, 1, since=began, **by_the_page.read(ORDER, data, KEY.key, 1, began)) == data
    if other != began:
        with pytest.raises(ValueError, match="its code is wrong"):
            unpack_order(data, KEY.since(other))
    given_beginning = Beginning(began=began, expires_min=other)
    sealed = pack_beginning(given_beginning, since)
    assert unpack_beginning(sealed, KEY) == given_beginning, "it is read whatever counts before it"
    assert by_the_page.read("The beginning", sealed, KEY.key) == {"version": 1, "began": began, "expires": other}


def test_a_shoals_number_travels_far():
    wanted = Wanted(verb=Verb.FORGET_SHOAL, number=7)
    assert unpack_order(pack_order(FarOrder(wanted=wanted, counter=9, expires_min=5), KEY), KEY).wanted == wanted


def test_a_status_is_no_order_and_an_order_no_status():
    assert KEY.sealed("status", GOOD_ORDER[:16]) != GOOD_ORDER
    with pytest.raises(ValueError, match="its code is wrong"):
        unpack_order(KEY.sealed("status", GOOD_ORDER[:16]), KEY)


@pytest.mark.parametrize(
    ("counts", "why"),
    [
        ({"version": 2, "verb": 1, "counter": 1}, "version 2"),
        ({"verb": 77, "counter": 1}, "no order 77"),
        ({"verb": 1}, "counter is 0"),
        ({"verb": 1, "counter": 1, "lat": 5}, "hold takes no such"),
        ({"verb": 1, "counter": 1, "number": 5}, "hold takes no such"),
        ({"verb": 4, "counter": 1, "lon": 5}, "refuge takes"),
    ],
)
def test_an_order_that_says_too_much_is_refused(counts, why):
    with pytest.raises(ValueError, match=why):
        unpack_order(by_the_page.write(ORDER, KEY.key, 1, **counts), KEY)


@pytest.mark.parametrize(
    "bad",
    [
        FarOrder(wanted=Wanted(verb=None, fault="no such"), counter=1, expires_min=1),
        FarOrder(wanted=Wanted(verb=Verb.GOAL), counter=1, expires_min=1),
        FarOrder(wanted=Wanted(verb=Verb.GOAL, place=Place(lat_deg=0.0, lon_deg=0.0)), counter=1, expires_min=1),
        FarOrder(wanted=Wanted(verb=Verb.HOLD), counter=0, expires_min=1),
        FarOrder(wanted=Wanted(verb=Verb.HOLD), counter=70_000, expires_min=1),
        FarOrder(wanted=Wanted(verb=Verb.HOLD), counter=1, expires_min=1 << 24),
        FarOrder(wanted=Wanted(verb=Verb.REFUGE, number=300), counter=1, expires_min=1),
    ],
)
def test_what_cannot_be_said_is_not_packed(bad):
    with pytest.raises(ValueError, match=r"."):
        pack_order(bad, KEY)


def test_the_numbers_are_those_of_the_rooms_that_own_the_words():
    assert {phase.value for phase in Phase} == set(status.PHASES)
    assert {alarm.name.lower() for alarm in Alarm} == set(status.ALARMS)


def test_the_sizes_are_those_that_are_paid_for():
    assert (order.SIZE, order.BEGINNING_SIZE, status.SIZE) == (24, 15, 42)


@pytest.mark.parametrize(
    ("field", "least", "most"),
    [
        (BitField(name="x", size=1, says=""), 0, 255),
        (BitField(name="x", size=1, unknown=255, says=""), 0, 254),
        (BitField(name="x", size=1, unknown=0, says=""), 1, 255),
        (BitField(name="x", size=2, step=0.5, unknown=0xFFFF, says=""), 0, 65_534),
        (BitField(name="x", size=1, is_signed=True, says=""), -128, 127),
        (BitField(name="x", size=4, is_signed=True, unknown=-(2**31), says=""), -(2**31) + 1, 2**31 - 1),
        (BitField(name="x", size=1, is_signed=True, unknown=127, says=""), -128, 126),
    ],
)
def test_a_field_holds_what_its_bytes_do_but_for_what_says_unknown(field, least, most):
    assert (field.count(-1e12), field.count(1e12)) == (least, most)
    assert field.value(most) == most * field.step
    layout = order.Layout((field, field))
    assert layout.size == 2 * field.size
    for counts in ({"x": least}, {"x": most}):
        assert layout.unpack(layout.pack(counts)) == counts


def test_minutes_count_from_new_year_2020_and_a_moment_is_in_the_one_that_has_begun():
    new_year = datetime(2020, 1, 1, tzinfo=UTC).timestamp()
    assert [order.minutes_of(new_year + s) for s in (0.0, 59.9, 60.0, -0.1)] == [0, 0, 1, -1]
    assert order.unix_of(3) == new_year + 180.0
