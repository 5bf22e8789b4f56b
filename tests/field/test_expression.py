"""The text of a composed field: what is printed is read again, and whatever is written raises InputError alone."""

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from companion.errors import InputError
from companion.field.tree import Added, Longest, Named, Projected, Weighed, is_name, names_in, parse, printed, projects

NAMES = ("ring", "islet", "lane_2", "Ship")
PLACE = ("m.toml", "[[goal]] 1 field")
weights = st.floats(1e-6, 100.0, exclude_min=True)
expressions = st.recursive(
    st.sampled_from(NAMES).map(Named),
    lambda inner: st.one_of(
        st.builds(Weighed, weights, inner),
        st.builds(Projected, inner),
        st.lists(inner, min_size=2, max_size=3).map(lambda parts: Added(tuple(parts))),
        st.lists(inner, min_size=2, max_size=3).map(lambda parts: Longest(tuple(parts))),
    ),
    max_leaves=8,
)


@settings(max_examples=300)
@given(expressions)
def test_what_is_printed_is_read_again(expression):
    assert parse(printed(expression), NAMES, *PLACE) == expression


@settings(max_examples=500)
@given(st.one_of(st.text(max_size=80), st.text("ring+*(),.0123 -max", max_size=60)))
def test_whatever_is_written_raises_one_line_of_input_error_or_is_a_field(text):
    try:
        found = parse(text, NAMES, *PLACE)
    except InputError as error:
        said, remedy = str(error), error.remedy
    else:
        assert set(names_in(found)) <= set(NAMES)
        return
    assert said.startswith("m.toml: [[goal]] 1 field")
    assert "\n" not in said
    assert remedy


def test_what_it_means():
    assert parse("ring + 0.5 * islet", NAMES, *PLACE) == Added((Named("ring"), Weighed(0.5, Named("islet"))))
    assert parse("max(ring, 2*(islet+Ship))", NAMES, *PLACE) == Longest(
        (Named("ring"), Weighed(2.0, Added((Named("islet"), Named("Ship")))))
    )
    assert parse("((ring))", NAMES, *PLACE) == Named("ring")
    assert projects(parse("2 * project(ring) + islet", NAMES, *PLACE))
    assert not projects(parse("2 * ring + islet", NAMES, *PLACE))


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "character 1: is empty; write atoms that are added: ring, islet, lane_2, Ship"),
        ("rnig", "character 1: there is no atom 'rnig'; did you mean 'ring'?"),
        ("ring + qqq", "character 8: there is no atom 'qqq'; there is: ring, islet, lane_2, Ship"),
        ("ring +", "character 7: a field is missing at the end"),
        ("ring - islet", "character 6: '-' follows a field"),
        ("-ring", "character 1: fields are not taken from each other; add a repulsive one"),
        ("ring islet", "character 6: 'islet' follows a field"),
        ("0 * ring", "character 1: the weight 0 is out of range; write one above 0 and up to 100"),
        ("1e9 * ring", "the weight 1e9 is out of range"),
        ("0.5", "a number stands alone"),
        ("ring * 2", "character 6: '*' follows a field"),
        ("max(ring)", "max has one field alone; write two or more, with commas"),
        ("max ring", "max has no bracket; write max(...)"),
        ("(ring", "a bracket is not closed; write )"),
        ("ring & islet", "character 6: '&' is no part of an expression"),
        ("(" * 30 + "ring" + ")" * 30, "is nested too deeply; 20 brackets are the most"),
        ("ring + " * 300 + "ring", "is 2104 characters long; 1000 are the most"),
    ],
)
def test_what_is_wrong_is_said_with_the_character_and_what_to_write(text, says):
    with pytest.raises(InputError) as refused:
        parse(text, NAMES, *PLACE)
    assert says in str(refused.value)


def test_names():
    assert is_name("ring_2")
    assert not is_name("max")
    assert not is_name("2nd")
    assert not is_name("north-mark")
    assert not is_name("bouée")
