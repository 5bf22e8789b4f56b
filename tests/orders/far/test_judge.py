"""The judge: each counter once, in any order, never after its time; and what it remembers outlives a restart."""

import json
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.orders import Verb, Wanted
from companion.orders.far import MOST_JUMP, WINDOW, Beginning, FarOrder, Reply, Taken, begun, judged, unix_of

NOW_MIN = 3_600_000
NOW_S = unix_of(NOW_MIN)


def order(counter, left_min=30, mark=""):
    return FarOrder(
        wanted=Wanted(verb=Verb.HOLD), counter=counter, expires_min=NOW_MIN + left_min, mark=mark or f"{counter:08x}"
    )


@pytest.mark.parametrize(
    ("left_min", "reply"),
    [
        (1, None),
        (0, Reply.EXPIRED),
        (-1, Reply.EXPIRED),
        (-600, Reply.EXPIRED),
        (7 * 1440, None),
        (7 * 1440 + 60, None),  # a week, and an hour for a clock that is wrong
        (7 * 1440 + 61, Reply.TOO_LONG),
        (7 * 1440 + 120, Reply.TOO_LONG),
        (10**7, Reply.TOO_LONG),
    ],
)
def test_an_order_counts_until_it_expires(left_min, reply):
    assert judged(order(1, left_min), Taken(), NOW_S)[0] == reply


def test_without_a_clock_nothing_counts_and_sent_again_with_one_it_does():
    reply, taken = judged(order(1), Taken(), None)
    assert (reply, taken) == (Reply.NO_CLOCK, Taken())
    assert judged(order(1), taken, NOW_S)[0] is None


def test_what_has_expired_stays_refused_whatever_the_clock_says_later():
    _, taken = judged(order(1, -5), Taken(), NOW_S)
    assert judged(order(1, -5), taken, NOW_S - 3600.0)[0] is Reply.EXPIRED


def test_a_duplicate_gets_the_reply_that_it_had_and_another_order_does_not():
    _, taken = judged(order(5), Taken(), NOW_S)
    assert judged(order(5), taken, NOW_S) == (Reply.TAKEN, taken)
    taken = taken.with_reply(order(5), Reply.NOT_NOW)
    assert judged(order(5), taken, NOW_S) == (Reply.NOT_NOW, taken)
    assert judged(order(5), taken, None)[0] is Reply.NOT_NOW
    assert judged(order(5, mark="other"), taken, NOW_S) == (Reply.USED, taken)


def test_of_the_window_each_is_taken_late_and_what_is_older_is_not():
    _, taken = judged(order(100), Taken(), NOW_S)
    assert judged(order(100 - WINDOW + 1), taken, NOW_S)[0] is None
    assert judged(order(100 - WINDOW), taken, NOW_S)[0] is Reply.OVERTAKEN


@pytest.mark.parametrize("highest", [0, 7, 40_000])
def test_a_counter_more_than_a_jump_ahead_is_refused_and_moves_nothing(highest):
    taken = Taken() if not highest else judged(order(highest), Taken({highest - 1: ("m", Reply.DONE)}), NOW_S)[1]
    assert judged(order(highest + MOST_JUMP + 1), taken, NOW_S) == (Reply.AHEAD, taken)
    assert judged(order(highest + MOST_JUMP), taken, NOW_S)[0] is None


@pytest.mark.parametrize(
    ("began", "left_min", "now_s", "reply"),
    [
        (NOW_MIN, 30, NOW_S, Reply.BEGUN),
        (NOW_MIN - 9000, 1, NOW_S, Reply.BEGUN),
        (NOW_MIN + 60, 90, NOW_S, Reply.BEGUN),
        (NOW_MIN + 61, 90, NOW_S, Reply.CLOCK),
        (NOW_MIN, 0, NOW_S, Reply.EXPIRED),
        (NOW_MIN, 30, None, Reply.NO_CLOCK),
        (NOW_MIN, 8 * 1440, NOW_S, Reply.TOO_LONG),
        (NOW_MIN - 9001, 30, NOW_S, Reply.OLD),
    ],
)
def test_a_beginning_counts_once_and_only_behind_every_one_before(began, left_min, now_s, reply):
    before = Taken({1: ("m", Reply.DONE)}, NOW_MIN - 9001 if reply is not Reply.OLD else NOW_MIN)
    given = Beginning(began=began, expires_min=NOW_MIN + left_min)
    said, taken = begun(given, before, now_s)
    assert said is reply
    assert taken == (Taken(began=began) if reply is Reply.BEGUN else before)
    _, used = judged(order(1), taken, NOW_S)
    assert begun(given, used, now_s)[1] == used, "come again it forgets nothing"
    assert Taken.from_dict(json.loads(json.dumps(used.to_dict("k"))), "k") == used


def test_the_words_of_a_refusal_have_the_figures_of_the_rule():
    assert f"more than {MOST_JUMP} ahead" in Reply.AHEAD
    assert f"more than {WINDOW - 1} behind" in Reply.OVERTAKEN


@settings(max_examples=200)
@given(st.lists(st.integers(1, 300), max_size=120), st.randoms(use_true_random=False))
def test_no_counter_is_ever_taken_twice_whatever_comes_and_however_often_it_restarts(counters, lots: random.Random):
    taken, done = Taken(), []
    for counter in counters:
        reply, taken = judged(order(counter, lots.choice([-1, 30])), taken, NOW_S)
        if reply is None:
            done.append(counter)
        taken = Taken.from_dict(json.loads(json.dumps(taken.to_dict("k"))), "k")
        assert len(taken.replies) <= WINDOW
        assert all(n > taken.highest - WINDOW for n in taken.replies)
    assert len(done) == len(set(done))


def test_with_another_key_the_counters_begin_anew():
    _, taken = judged(order(9), Taken(), NOW_S)
    assert Taken.from_dict(taken.to_dict("old"), "new") == Taken()


def test_a_memory_at_its_limits_is_believed():
    """The last counter that two bytes hold, a whole window, the first moment and the last."""
    whole = Taken(dict.fromkeys(range(65535 - WINDOW + 1, 65536), ("m", Reply.DONE)), (1 << 24) - 1)
    assert Taken.from_dict(json.loads(json.dumps(whole.to_dict("k"))), "k") == whole


@pytest.mark.parametrize(
    "data",
    [
        None,
        [],
        {},
        {"format": 3},
        {"format": 1, "key": "k"},
        {"format": 1, "key": "k", "replies": []},
        {"format": 1, "key": "k", "replies": {"x": ["m", "done"]}},
        {"format": 1, "key": "k", "replies": {"1": "done"}},
        {"format": 1, "key": "k", "replies": {"1": ["m", "sunk"]}},
        {"format": 1, "key": "k", "replies": {"0": ["m", "done"]}},
        {"format": 1, "key": "k", "replies": {"1": ["m", "done"], "0": ["m", "done"]}},
        {"format": 1, "key": "k", "replies": {"1": ["m", "done"], "65536": ["m", "done"]}},
        {"format": 2, "key": "k", "replies": {}},
        {"format": 2, "key": "k", "began": -1, "replies": {}},
        {"format": 2, "key": "k", "began": "1", "replies": {}},
        {"format": 2, "key": "k", "began": 1 << 24, "replies": {}},
        {"format": 1, "key": "k", "replies": {str(n): ["m", "done"] for n in range(1, 80)}},
    ],
)
def test_a_damaged_memory_is_not_believed(data):
    with pytest.raises(ValueError, match=r"."):
        Taken.from_dict(data, "k")


def test_a_voyage_of_two_hundred_orders_is_remembered_over_every_restart():
    """One counter more than the window in its memory, and the next start would not believe it."""
    taken = Taken()
    for counter in range(1, 201):
        reply, taken = judged(order(counter), taken, NOW_S)
        assert reply is None
        taken = Taken.from_dict(json.loads(json.dumps(taken.to_dict("k"))), "k")
    assert sorted(taken.replies) == list(range(201 - WINDOW, 201))
    assert judged(order(200 - WINDOW), taken, NOW_S)[0] is Reply.OVERTAKEN
    assert judged(order(201 - WINDOW), taken, NOW_S)[0] is Reply.TAKEN


def test_the_memory_of_an_earlier_release_is_believed():
    earlier = {"format": 1, "key": "k", "replies": {"7": ["m", "done"]}}
    assert Taken.from_dict(earlier, "k") == Taken({7: ("m", Reply.DONE)}, 0)


def test_a_thousand_and_twenty_four_orders_may_be_lost_in_a_row():
    assert judged(order(1024), Taken(), NOW_S)[0] is None
    assert judged(order(1025), Taken(), NOW_S)[0] is Reply.AHEAD


def test_an_order_is_the_same_order_whatever_bytes_it_came_in():
    assert order(5, mark="a") == order(5, mark="b") != order(6, mark="a")
