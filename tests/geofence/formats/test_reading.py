"""Large files: what reading costs grows with their size and no faster, and what is refused is refused soon."""

import sys
import time
from pathlib import Path

import pytest

import companion.geofence
from bench.reading import FILES
from companion.errors import InputError
from companion.geofence.formats.registry import parse
from companion.geofence.shapes import ZoneKind

FEW, MANY = 200, 800
OURS = str(Path(companion.geofence.__file__).parent)
WAYS = [(name, way) for name, ways in FILES.items() for way in ways if way != "a tangle"]


def work(format_name, text):
    """Return what reading the text takes: lines of our code, and characters and members of the values they make."""
    done = 0

    def trace(frame, event, _):
        if event == "call" and not frame.f_code.co_filename.startswith(OURS):
            return None
        nonlocal done
        done += 1
        made = dict(frame.f_locals)  # name -> the value that it had: what is handed in is no work

        def line(frame, *_):
            nonlocal done
            done += 1
            for name, value in frame.f_locals.items():
                if isinstance(value, str | list | tuple) and made.get(name) is not value:
                    made[name] = value
                    done += len(value)
            return line

        return line

    sys.settrace(trace)
    try:
        parse(text.encode(), f"file.{format_name}", extension=f".{format_name}")
    finally:
        sys.settrace(None)
    return done


@pytest.mark.parametrize(("format_name", "way"), WAYS)
def test_reading_is_linear(format_name, way):
    """WKT with a vertex a line took 7.7 s for 80,000 points: see `python -m bench.reading`."""
    make = FILES[format_name][way]
    ratio = work(format_name, make(MANY)) / work(format_name, make(FEW))
    assert ratio < 1.25 * MANY / FEW


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
