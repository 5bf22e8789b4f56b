"""The judge: each counter once, in any order, never after its time; and what it remembers outlives a restart."""

import json
import random

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.orders import Verb, Wanted
from companion.orders.far import WINDOW, FarOrder, Reply, Taken, judged, unix_of

NOW_MIN = 3_600_000
NOW_S = unix_of(NOW_MIN)


def order(counter, left_min=30, mark=""):
    return FarOrder(wanted=Wanted(verb=Verb.HOLD), counter=counter, expires_min=NOW_MIN + left_min,
                    mark=mark or f"{counter:08x}")


@pytest.mark.parametrize(("left_min", "reply"), [
    (1, None), (0, Reply.EXPIRED), (-1, Reply.EXPIRED), (-600, Reply.EXPIRED), (7 * 1440, None),
    (7 * 1440 + 120, Reply.TOO_LONG), (10**7, Reply.TOO_LONG),
])
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


@pytest.mark.parametrize("data", [
    None, [], {}, {"format": 2}, {"format": 1, "key": "k"}, {"format": 1, "key": "k", "replies": []},
    {"format": 1, "key": "k", "replies": {"x": ["m", "done"]}}, {"format": 1, "key": "k", "replies": {"1": "done"}},
    {"format": 1, "key": "k", "replies": {"1": ["m", "sunk"]}},
    {"format": 1, "key": "k", "replies": {"0": ["m", "done"]}},
    {"format": 1, "key": "k", "replies": {str(n): ["m", "done"] for n in range(1, 80)}},
])
def test_a_damaged_memory_is_not_believed(data):
    with pytest.raises(ValueError, match=r"."):
        Taken.from_dict(data, "k")
