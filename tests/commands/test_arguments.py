"""What a command line is given: every option that takes a place takes the south, every number has its range."""

import argparse
import re

import pytest

from companion import cli
from companion.program import Parser, with_negative_values
from companion.program.arguments import moment
from sitl import cli as sitl_cli

PROGRAMS = {"companion": cli.PROGRAM, "sitl": sitl_cli.PROGRAM}


def _leaves(parser, words=()):
    """Yield every command of a parser, with the words that lead to it."""
    groups = [a for a in parser._actions if isinstance(a, argparse._SubParsersAction)]
    if not groups:
        yield words, parser
    for group in groups:
        for name, sub in group.choices.items():
            yield from _leaves(sub, (*words, name))


def _name(value):
    return "-".join(value) if isinstance(value, tuple) else value


OPTIONS = [
    (name, words, action)
    for name, program in PROGRAMS.items()
    for words, parser in _leaves(program.parser())
    for action in parser._actions
    if action.option_strings
]
PLACES = [(n, w, a.option_strings[0]) for n, w, a in OPTIONS if a.metavar and "LAT,LON" in a.metavar]
NUMBERS = [
    (n, w, a.option_strings[0])
    for n, w, a in OPTIONS
    if a.type is not None and getattr(a.type, "__qualname__", "").split(".")[0] in {"number", "whole"}
]


def _error(capsys, program, arguments):
    assert PROGRAMS[program].run(arguments) == 2
    return capsys.readouterr().err


def test_there_are_places_and_numbers():
    assert len(PLACES) >= 10
    assert len(NUMBERS) >= 25
    assert not [(w, a.option_strings) for _, w, a in OPTIONS if a.type in {float, int}]


@pytest.mark.parametrize(("program", "words", "option"), PLACES, ids=_name)
def test_every_place_may_lie_in_the_south(capsys, program, words, option):
    # What is refused is the bad option at the end, or what is missing: never the place.
    err = _error(capsys, program, [*words, option, "-33.85,151.26", "--no-such-option"])
    assert option not in err
    assert "-33.85" not in err
    err = _error(capsys, program, [*words, option, "-95,151.26"])
    assert f"argument {option}: latitude -95.0 is outside" in err
    assert err.count("\n") == 1


@pytest.mark.parametrize(("program", "words", "option"), NUMBERS, ids=_name)
@pytest.mark.parametrize("value", ["nan", "inf", "-1e9", "1e99", "much", "1_0e5x"])
def test_every_number_has_a_range(capsys, program, words, option, value):
    if value == "1e99" and option in BOUNDLESS:
        return
    err = _error(capsys, program, [*words, option, value])
    assert f"argument {option}: " in err
    assert "write a number" in err
    assert err.count("\n") == 1


# A time, an effort or a size may be as large as one likes.
BOUNDLESS = {
    "--timeout",
    "--wait",
    "--limit",
    "--for",
    "--budget",
    "--explain-budget",
    "--max-age",
    "--every",
    "--keep-gb",
}


@pytest.mark.parametrize(
    ("given", "taken"),
    [
        (["--start", "-33.85,151.26"], ["--start=-33.85,151.26"]),
        (["--start", "-.5,1"], ["--start=-.5,1"]),
        (["--start=-33,1", "-34,1"], ["--start=-33,1", "-34,1"]),
        (["--", "-33,1"], ["--", "-33,1"]),
        (["--force", "--goal", "1,-2"], ["--force", "--goal", "1,-2"]),
        (["-33,1"], ["-33,1"]),
    ],
)
def test_only_a_value_is_tied_to_its_option(given, taken):
    assert with_negative_values(given) == taken


@pytest.mark.parametrize("text", ["2026-11-24", "2026-11-24T08:00"])
def test_a_time_without_a_zone_is_told_one_that_is_taken(text):
    """It told to write 2026-11-24Z, and refused that, too."""
    with pytest.raises(argparse.ArgumentTypeError, match="has no zone") as refused:
        moment(text)
    remedy = re.search(r"write (\S+)", str(refused.value))
    assert moment(remedy[1]).date().isoformat() == "2026-11-24"


def test_a_place_in_the_south_is_a_word_of_an_order():
    """`order goal -42.9,147.37` was "unrecognized arguments", and north of the equator it was done."""
    parser = Parser(prog="companion order")
    parser.add_argument("words", nargs="*")
    parser.add_argument("--link")
    taken = parser.parse_args(["goal", "-42.9,147.37", "--link", "x"])
    assert (taken.words, taken.link) == (["goal", "-42.9,147.37"], "x")
