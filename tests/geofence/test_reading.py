"""Large files: what reading costs grows with their size and no faster, and what is refused is refused soon."""

import time

import pytest

from bench.reading import FILES, power
from companion.errors import InputError
from companion.geofence.formats import parse
from companion.geofence.shapes import ZoneKind

# Where the time grew with the square of the points, and how many show it: `python -m bench.reading` holds them all.
ONCE_SLOW = [
    ("wkt", "a coast, a vertex a line", 4000, 40_000), ("poly", "rocks", 1500, 7500),
    ("waypoints", "fence vertices without a ring", 1500, 7500),
]


def seconds(format_name, text):
    best = float("inf")
    for _ in range(2):
        began = time.process_time()
        parse(text.encode(), f"file.{format_name}", extension=f".{format_name}")
        best = min(best, time.process_time() - began)
    return best


@pytest.mark.parametrize(("format_name", "way", "few", "many"), ONCE_SLOW)
def test_reading_is_linear(format_name, way, few, many):
    make = FILES[format_name][way]
    first, last = seconds(format_name, make(few)), seconds(format_name, make(many))
    assert power((few, first), (many, last)) < 1.3, (first, last)


@pytest.mark.parametrize(("format_name", "way"), [(name, way) for name, ways in FILES.items() for way in ways])
def test_what_the_bench_reads_is_what_it_says(format_name, way):
    document = parse(FILES[format_name][way](500).encode(), f"file.{format_name}", extension=f".{format_name}")
    assert document.format == format_name
    assert not document.is_empty or document.findings


def test_the_points_of_one_geometry_are_counted_once():
    """They were counted again with each point: 1,001 of a MULTIPOINT were half a million too many."""
    assert len(parse(FILES["wkt"]["points"](2000).encode(), "file.wkt").marks) == 2000


@pytest.mark.parametrize("kind", ZoneKind)
@pytest.mark.parametrize("n", [1600, 30_000])
def test_a_tangle_is_refused_at_once(kind, n):
    """A star of 1,600 vertices took 100 s to repair, and nothing came of it."""
    text = FILES["wkt"]["a tangle"](n).encode()
    began = time.process_time()
    document = parse(text, "file.wkt", kind=kind)
    assert time.process_time() - began < 2.0
    assert not document.zones
    assert "too tangled" in document.findings[0].text


@pytest.mark.parametrize("text", ["POINT" + " " * 200_000 + "x", "1" * 200_000, "1 " + "2" * 200_000 + "x\n1 2"])
def test_no_pattern_looks_back_for_ever(text):
    began = time.process_time()
    with pytest.raises(InputError):
        parse(text.encode(), "file.txt")
    assert time.process_time() - began < 2.0
