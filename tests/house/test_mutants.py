"""The mutants: each is one place of the code and nothing else, what is no code is left alone, and a child sees it."""

import ast
import json
import subprocess
import sys

import pytest

from bench import mutants
from bench.mutants import ROOMS, changes, codes, drawn, equivalents, mutated, places


def told(text):
    return {
        f"{ast.unparse(node)} -> {ast.unparse(other)}"
        for node, _, _, is_said in places(ast.parse(text))
        for other in changes(node)
        if not is_said
    }


@pytest.mark.parametrize(
    ("text", "changed"),
    [
        ("x = a < b", {"a < b -> a <= b", "a < b -> a >= b"}),
        ("x = a - 1", {"a - 1 -> a + 1", "1 -> 2"}),
        ("x = -a if b else a", {"-a if b else a -> a if b else -a", "-a -> a"}),
        (
            "x = math.sin(min(a, 0.0))",
            {"math.sin(min(a, 0.0)) -> math.cos(min(a, 0.0))", "min(a, 0.0) -> max(a, 0.0)", "0.0 -> 1.0"},
        ),
        ("watch(ctx)", {"watch(ctx) -> pass"}),
        ("x = a and not b", {"a and (not b) -> a or not b", "not b -> b"}),
        ("def f(a: Array[3] = 2) -> Row[4]:\n  'Say.'\n  assert a > 1\n  raise E(a + 1)", {"2 -> 3"}),
        ("@kernel\ndef f(a):\n  return a + 1", set()),
        ("__all__ = [1]\nif TYPE_CHECKING:\n  x = 1", set()),
        # the words of a message: which of two sentences, what a keyword of words is given, a function of words
        ("x = 'so it is' if a < b else f'{a} not so'", {"a < b -> a <= b", "a < b -> a >= b"}),
        ("x = 'one' if a else 'other'", {"'one' if a else 'other' -> 'other' if a else 'one'"}),
        ("x = say(a + 1, text=words(b + 2), every_s=3)", {"a + 1 -> a - 1", "1 -> 2", "3 -> 4"}),
        ("def in_words(a) -> str:\n  return f(a + 1)", set()),
        ("def words(a) -> int:\n  return a", {"return a -> return None"}),
        ("log.warning('%d', a + 1)\nlist.append(a + 1)", {"list.append(a + 1) -> pass", "a + 1 -> a - 1", "1 -> 2"}),
    ],
)
def test_what_is_put_in_a_place(text, changed):
    assert told(text) == changed


def test_a_mutant_is_one_place_of_one_function():
    (sign,) = [
        m for m in drawn(["true wind"], None, 0) if m.told == "apparent.t_s - vehicle.t_s -> apparent.t_s + vehicle.t_s"
    ]
    sound = codes(
        compile((mutants.ROOT / sign.file).read_text(), str(mutants.ROOT / sign.file), "exec", dont_inherit=True)
    )
    other = [c.co_qualname for was, c in zip(sound, codes(mutated(sign)), strict=True) if was.co_code != c.co_code]
    assert other == ["true_wind"]
    assert sign.where == "true_wind"


def test_rooms_have_files_and_tests_and_samples_are_by_seed():
    assert all(list(mutants.ROOT.glob(glob)) for files, _ in ROOMS.values() for glob in files)
    assert all((mutants.ROOT / top).exists() for _, tops in ROOMS.values() for top in tops)
    assert drawn(["signing"], 5, 1) == drawn(["signing"], 5, 1) != drawn(["signing"], 5, 2)


def test_what_is_said_to_be_equivalent_is_a_mutant_of_today():
    said = equivalents()
    there = {m.row for file in {row.partition(" | ")[0] for row in said} for m in mutants.mutants("", file)}
    assert said - there == set()
    assert (mutants.EQUIVALENT.read_text().count("  equivalent, because ")) == len(said) > 0


SAIL = """
import json, sys
from bench import mutants
mutants.KEPT = mutants.Path(sys.argv[1])
wanted, room, file, tests = json.loads(sys.argv[2]), *sys.argv[3:]
mutants.ROOMS = {room: ((file,), (tests,))}
whole = mutants.drawn
mutants.drawn = lambda *asked: [m for m in whole(*asked) if m.told in wanted]
raise SystemExit(mutants.main([]))
"""


TRUE_WIND = ("true wind", "companion/wind/true_wind.py", "tests/wind/test_true_wind.py")
LATE = ("formats", "companion/geofence/formats/kml.py", "tests/geofence/formats/test_parts.py")


def test_a_module_that_is_imported_by_a_test_meets_its_mutant_too(tmp_path):
    """It came from the disk in the child, unchanged, and each of its mutants survived."""
    pytest.importorskip("coverage")
    wanted = json.dumps(["role == 'track' -> role != 'track'"])
    command = [sys.executable, "-c", SAIL, str(tmp_path), wanted, *LATE]
    subprocess.run(command, cwd=mutants.ROOT, capture_output=True, check=True)
    [verdict] = map(json.loads, (tmp_path / "mutants.jsonl").read_text().splitlines())
    assert verdict["verdict"] == "killed"


def test_a_child_meets_the_mutant_at_run_and_at_import_and_the_tree_does_not(tmp_path):
    pytest.importorskip("coverage")
    wanted = [
        "math.sin(angle) -> math.cos(angle)",
        "10.0 -> 15.0",  # carried out at import: the rate of a turn
        "speed < LIGHT_MPS -> speed <= LIGHT_MPS",  # a speed that no reading has
    ]
    path = mutants.ROOT / "companion/wind/true_wind.py"
    before = path.stat().st_mtime_ns
    for expected in (3, 3):  # what is known is not asked again
        done = subprocess.run(
            [sys.executable, "-c", SAIL, str(tmp_path), json.dumps(wanted), *TRUE_WIND],
            cwd=mutants.ROOT,
            capture_output=True,
            text=True,
            check=True,
        )
        verdicts = [json.loads(line) for line in (tmp_path / "mutants.jsonl").read_text().splitlines()]
        assert len(verdicts) == expected
        assert "| true wind | 3 | 3 | 2 | 1 | 0 | 100 % |" in done.stdout  # one changes nothing, and is listed
    killed = {v["told"]: v["by"] for v in verdicts if v["verdict"] == "killed"}
    assert set(killed) == set(wanted[:2])  # by whom goes with how quick each test was
    assert all(by.startswith("tests/wind/test_true_wind.py::") for by in killed.values())
    assert path.stat().st_mtime_ns == before
