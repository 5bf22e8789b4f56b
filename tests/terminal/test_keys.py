"""Keys: which order each gives, what is asked before, what is not permitted."""

import string

import pytest
from hypothesis import given
from hypothesis import strategies as st

from companion.orders import BY_VERB, Verb, phrase
from companion.terminal import KeyCommands, words_of
from companion.terminal.keys import KEYS

ASKED = {
    Verb.GO_ON,
    Verb.REFUGE,
    Verb.HOME,
    Verb.GOAL,
    Verb.SKIP_GOAL,
    Verb.STOP,
    Verb.ADOPT,
    Verb.REPLACE,
    Verb.FORGET_SHOAL,
}


def typed(keys, orders=None):
    helm, given_ = KeyCommands(), []
    for key in keys:
        helm = helm.press(key, orders)
        if helm.order is not None:
            given_.append(words_of(helm.order))
    return helm, given_


def test_every_verb_has_a_key_of_its_own():
    assert {key.verb for key in KEYS} == set(Verb) == set(BY_VERB)
    assert len({key.key for key in KEYS} | set("qu?y")) == len(KEYS) + 4


@pytest.mark.parametrize("key", KEYS, ids=lambda key: key.verb.value)
def test_what_moves_her_is_asked_first(key):
    words = "50.1 -1.3\r" if key.verb is Verb.GOAL else "\r" if key.takes else ""
    helm, given_ = typed(key.key + words)
    assert bool(helm.asking) == (key.verb in ASKED)
    assert bool(given_) == (key.verb not in ASKED)
    if helm.asking:
        assert helm.prompt.startswith(key.verb.value)
        assert typed(key.key + words + "n")[1] == []
        assert [w.split()[0] for w in typed(key.key + words + "y")[1]] == [key.verb.value]


def test_words_are_typed_and_mended():
    assert typed("oxx\x7f\x7f50.81951 -1.30801\ry")[1] == ["goal 50.81951 -1.30801"]
    assert typed("rMill Bay\ry")[1] == ["refuge Mill Bay"]
    assert typed("r2\ry")[1] == ["refuge 2"]
    helm, given_ = typed("onowhere\r")
    assert given_ == []
    assert "'nowhere' is not a position" in helm.said
    assert typed("o50 1\x1b")[0].said == "goal: not given"
    assert typed("oqqq")[0].is_over is False


def test_what_the_mission_does_not_permit_is_not_asked_of_her():
    helm, given_ = typed("h", orders=("go_on",))
    assert given_ == []
    assert "does not permit" in helm.said
    assert typed("w", orders=())[1] == ["why"]  # always answered


def test_the_end():
    assert typed("q")[0].is_over
    assert typed("gq")[0].is_over is False  # an answer to the question: no
    assert typed("g\x03")[0].is_over  # Ctrl-C, wherever one is


@given(st.text(alphabet=string.printable, max_size=40))
def test_a_cat_on_the_keyboard_gives_nothing_that_was_not_asked(keys):
    """Without a y behind a question only why, hold, a plan and what moves nothing come of it."""
    _, given_ = typed(keys.replace("y", "").replace("Y", ""))
    assert {words.split()[0] for words in given_} <= {"why", "hold", "replan", "freeze", "learn"}


@given(st.sampled_from(["hold", "refuge", "refuge 3", "refuge Mill Bay", "goal 50.1234567 -1.3"]))
def test_the_words_of_an_order_are_read_as_it(words):
    wanted = phrase(words.split())
    assert phrase(words_of(wanted).split()) == wanted
