"""Orders as words, as records, as buttons and as a page."""

import json

import pytest

from companion.errors import InputError
from companion.orders import TABLE, Order, Place, Source, Verb, Wanted, permitted, phrase, qgc_actions


@pytest.mark.parametrize(
    ("words", "wanted"),
    [
        ("hold", Wanted(verb=Verb.HOLD)),
        ("go-on", Wanted(verb=Verb.GO_ON)),
        ("GO_ON", Wanted(verb=Verb.GO_ON)),
        ("refuge", Wanted(verb=Verb.REFUGE)),
        ("refuge 2", Wanted(verb=Verb.REFUGE, number=2)),
        ("refuge Mill Bay", Wanted(verb=Verb.REFUGE, name="Mill Bay")),
        ("forget_shoal", Wanted(verb=Verb.FORGET_SHOAL)),
        ("forget-shoal 3", Wanted(verb=Verb.FORGET_SHOAL, number=3)),
        ("goal 51.1 -1.3", Wanted(verb=Verb.GOAL, place=Place(lat_deg=51.1, lon_deg=-1.3))),
        ("goal 51.1,-1.3", Wanted(verb=Verb.GOAL, place=Place(lat_deg=51.1, lon_deg=-1.3))),
    ],
)
def test_words(words, wanted):
    assert phrase(words.split()) == wanted


@pytest.mark.parametrize(
    ("words", "says"),
    [
        ("", "VERB: is missing; there are hold, go_on"),
        ("hodl", "there is no order 'hodl'; did you mean hold?"),
        ("xyzzy", "there is no order 'xyzzy'; there are hold"),
        ("hold here", "hold: takes nothing"),
        ("forget_shoal all", "forget_shoal: 'all' is no number of a shoal"),
        ("forget_shoal 1 2", "'1 2' is no number of a shoal"),
        ("goal", "is not a position; write goal LAT LON"),
        ("goal 51", "is not a position"),
        ("goal 51 north", "is not a position"),
        ("goal 1 2 3", "is not a position"),
        ("goal 0 0", "no position that anybody means"),
        ("goal nan 1", "not a number"),
        ("goal 151.2 -33.8", "latitude"),
    ],
)
def test_words_that_are_no_order(words, says):
    with pytest.raises(InputError) as error:
        phrase(words.split())
    assert says in str(error.value)


@pytest.mark.parametrize(
    "wanted",
    [
        Wanted(verb=Verb.HOLD),
        Wanted(verb=None, fault="no order 17"),
        Wanted(verb=Verb.REFUGE, name="Bay", mark=7),
        Wanted(verb=Verb.GOAL, place=Place(lat_deg=51.1234567, lon_deg=-1.1)),
    ],
)
def test_an_order_survives_its_record(wanted):
    order = Order(wanted=wanted, source=Source(kind="mavlink", system=255, component=190), t_s=12.25, command=31010)
    assert Order.from_dict(json.loads(json.dumps(order.to_dict()))) == order


def test_a_record_keeps_what_is_not_a_number():
    order = Order(
        wanted=Wanted(verb=Verb.GOAL, place=Place(lat_deg=float("nan"), lon_deg=1.0)),
        source=Source(kind="mavlink"),
        t_s=0.0,
    )
    back = Order.from_dict(json.loads(json.dumps(order.to_dict())))
    assert back.wanted.place.trouble == "the position is not a number"


def test_reading_is_always_permitted_and_nothing_else_by_itself():
    assert [verb for verb in Verb if permitted(verb, ())] == [Verb.WHY]
    assert all(permitted(verb, ("all",)) for verb in Verb)
    assert [verb for verb in Verb if permitted(verb, ("home", "stop"))] == [Verb.HOME, Verb.STOP, Verb.WHY]


def test_the_buttons_are_what_qgroundcontrol_reads():
    """Any other key than those of its documentation and it ignores the whole file."""
    file = json.loads(qgc_actions())
    assert set(file) == {"version", "fileType", "actions"}
    assert (file["version"], file["fileType"]) == (1, "MavlinkActions")
    keys = {"label", "description", "mavCmd", "compId", *(f"param{n}" for n in range(1, 8))}
    for action in file["actions"]:
        assert set(action) == keys
        assert (action["mavCmd"], action["compId"]) == (31010, 191)
        assert all(isinstance(action[f"param{n}"], float) for n in range(1, 8))
    numbers = [action["param1"] for action in file["actions"]]
    assert numbers == [row.number for row in TABLE if row.button]
    assert len({action["label"] for action in file["actions"]}) == len(numbers)
    assert 6.0 not in numbers, "a goal needs typing"
