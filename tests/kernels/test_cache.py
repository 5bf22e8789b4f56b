"""Machine code is found by what it was made of: what changes it asks for another file, and nothing else does."""

import itertools
import os
import sys
import time
import types

import pytest

from companion.errors import JobError
from companion.kernels import cache, places

KNOTS = """
from companion.kernels.jit import kernel
FACTOR = 2.0

@kernel
def knots(x):
    return FACTOR * x
"""
BOAT = """
from companion.kernels.jit import kernel
from test_knots import knots

@kernel
def speed(x):
    return knots(x) + 1.0
"""


@pytest.fixture
def kept(tmp_path, monkeypatch):
    """The folder of machine code, empty."""
    monkeypatch.setenv("COMPANION_KERNELS", str(tmp_path / "kept"))
    monkeypatch.setattr(places, "IN_MEMORY", (tmp_path / "memory",))
    (tmp_path / "memory").mkdir()
    return tmp_path / "kept"


@pytest.fixture
def load(kept, tmp_path, monkeypatch):
    """Load two modules anew, as another process would from another checkout; return the kernel ``speed``."""
    del kept
    checkouts = itertools.count()

    def load(knots=KNOTS, boat=BOAT):
        folder = tmp_path / f"checkout{next(checkouts)}"
        folder.mkdir()
        for name, text in (("test_knots", knots), ("test_boat", boat)):
            module = types.ModuleType(name)
            path = folder / f"{name}.py"
            path.write_text(text)
            monkeypatch.setitem(sys.modules, name, module)
            exec(compile(text, str(path), "exec"), module.__dict__)
        return module.speed

    return load


def is_compiled_anew(kernel):
    return sum(kernel.stats.cache_misses.values()) > 0


def test_the_same_content_is_not_compiled_again(load):
    """Numba's own cache goes by the file's place, time and size: each clone, and each install, compiled anew."""
    first = load()
    assert first(3.0) == 7.0
    assert is_compiled_anew(first)
    for changed in ({}, {"boat": f"# a comment\n\n\n{BOAT}"},
                    {"knots": KNOTS.replace("(x):", '(x):\n    """Say what it does."""')}):
        again = load(**changed)
        assert again(3.0) == 7.0
        assert not is_compiled_anew(again), changed


@pytest.mark.parametrize(("changed", "answer"), [
    ({"knots": KNOTS.replace("2.0", "3.0")}, 10.0),
    ({"knots": KNOTS.replace("* x", "- x")}, 0.0),
    ({"boat": BOAT.replace("+ 1.0", "- 1.0")}, 5.0),
    ({"boat": BOAT.replace("knots(x)", "knots(x) + knots(x)")}, 13.0),
])
def test_an_edit_is_seen_in_the_callee_too(load, changed, answer):
    """Numba's own cache does not see an edit of a callee in another file: stale code sailed (issue 14, point 4)."""
    assert load()(3.0) == 7.0
    assert load(**changed)(3.0) == answer
    assert load()(3.0) == 7.0


def test_types_have_machine_code_of_their_own(load):
    kernel = load()
    assert kernel(3.0) == kernel(3) == 7.0
    assert len(kernel.signatures) == 2


@pytest.mark.parametrize("unseen", ["FACTOR = [2.0]", "FACTOR = {'a': 2.0}", "import companion.geo as FACTOR"])
def test_what_could_change_unseen_is_refused(load, unseen):
    with pytest.raises(JobError, match=r"test_knots\.knots, FACTOR"):
        load(KNOTS.replace("FACTOR = 2.0", unseen))(3.0)


@pytest.mark.parametrize("damage", [lambda b: b[:-7], lambda b: b[:50], lambda b: b"", lambda b: b[:-1] + b"x"])
def test_a_torn_file_is_compiled_again(load, kept, damage):
    load()(3.0)
    for path in kept.iterdir():
        path.write_bytes(damage(path.read_bytes()))
    again = load()
    assert again(3.0) == 7.0
    assert is_compiled_anew(again)
    assert not is_compiled_anew_after(load)


def is_compiled_anew_after(load):
    kernel = load()
    kernel(3.0)
    return is_compiled_anew(kernel)


def test_where_nothing_can_be_written_it_is_kept_in_memory(load, monkeypatch, tmp_path):
    """A card that fails is mounted read-only; numba then did not load what was there either (issue 12, point 13)."""
    monkeypatch.setenv("COMPANION_KERNELS", "/proc/none")
    load()(3.0)
    place = tmp_path / "memory" / f"companion-kernels-{os.getuid()}"
    assert place.stat().st_mode & 0o777 == 0o700
    assert len(list(place.iterdir())) == 2
    assert not is_compiled_anew_after(load)


def test_what_others_can_write_is_not_run(load, monkeypatch, tmp_path, caplog):
    monkeypatch.setenv("COMPANION_KERNELS", "/proc/none")
    place = tmp_path / "memory" / f"companion-kernels-{os.getuid()}"
    place.mkdir()
    place.chmod(0o777)
    assert load()(3.0) == 7.0
    assert not list(place.iterdir())
    assert is_compiled_anew_after(load)
    assert "cannot be kept" in caplog.text


@pytest.mark.parametrize(("mode", "uid"), [(0o770, None), (0o702, None), (0o700, 54321)])
@pytest.mark.parametrize("what", ["folder", "file"])
def test_kernels_that_others_may_have_written_are_not_run_and_that_is_said_once(
        load, kept, monkeypatch, tmp_path, caplog, what, mode, uid):
    """They were unpickled and run from any folder that was named (issue 43, point 9)."""
    places.refuse.cache_clear()
    load()(3.0)
    files = list(kept.iterdir())
    for path in [kept] if what == "folder" else files:
        path.chmod(mode)
        if uid is not None:
            monkeypatch.setattr(places.os, "geteuid", lambda: uid)   # what was ours is another's
            monkeypatch.setattr(places, "ROOT", uid)
    before = {path: path.read_bytes() for path in files}
    caplog.clear()
    assert is_compiled_anew_after(load)
    said = [r.message for r in caplog.records if "none of it is used" in r.message]
    assert len(said) == len(set(said)) > 0
    if what == "folder" or uid is not None:
        assert {path: path.read_bytes() for path in kept.iterdir()} == before, "it is left alone"
    if what == "folder" and uid is None:
        kept.chmod(0o700)
        assert not is_compiled_anew_after(load)


def test_what_is_carried_or_kept_is_read_where_nothing_can_be_written(load, kept, monkeypatch, tmp_path):
    load()(3.0)
    monkeypatch.setattr(places, "CARRIED", kept)
    monkeypatch.setenv("COMPANION_KERNELS", "/proc/none")
    assert not is_compiled_anew_after(load)
    assert not list((tmp_path / "memory").iterdir())


def test_what_nobody_uses_goes(kept, monkeypatch):
    kept.mkdir()
    now_s = time.time()
    for n in range(6):
        (kept / f"kernel{n}").write_bytes(bytes(100))
        os.utime(kept / f"kernel{n}", (now_s - n, now_s - n))
    os.utime(kept / "kernel1", (0.0, now_s - 31 * 86_400.0))
    monkeypatch.setattr(places, "KEPT_BYTES", 300)
    monkeypatch.setattr(places, "PACKAGES", kept)
    assert places.sweep(now_s) == 3
    assert sorted(p.name for p in kept.iterdir()) == ["kernel0", "kernel2", "kernel3"]
    places.used(kept / "kernel0", now_s + 2 * 86_400.0)
    assert cache.folder() == kept


@pytest.mark.parametrize(("environment", "there"), [
    ({"COMPANION_KERNELS": "/a", "CACHE_DIRECTORY": "/b", "XDG_CACHE_HOME": "/c"}, "/a"),
    ({"CACHE_DIRECTORY": "/b:/d", "XDG_CACHE_HOME": "/c"}, "/b/kernels"),
    ({"COMPANION_KERNELS": "relative", "XDG_CACHE_HOME": "/c"}, "/c/sailboat-companion/kernels"),
    ({"HOME": "/h"}, "/h/.cache/sailboat-companion/kernels"),
])
def test_one_place_says_where(monkeypatch, environment, there):
    for name in ("COMPANION_KERNELS", "CACHE_DIRECTORY", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert str(places.folder()) == there
