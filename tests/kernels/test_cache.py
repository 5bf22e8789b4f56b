"""Machine code is found by what it was made of: what changes it asks for another file, and nothing else does."""

import itertools
import os
import subprocess
import sys
import time
import types

import pytest

from companion.errors import JobError
from companion.kernels import places
from companion.kernels.jit import begun

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
    first, before = load(), begun()
    assert first(3.0) == 7.0
    assert is_compiled_anew(first)
    assert begun() == before + 2
    for changed in (
        {},
        {"boat": f"# a comment\n\n\n{BOAT}"},
        {"knots": KNOTS.replace("(x):", '(x):\n    """Say what it does."""')},
    ):
        again = load(**changed)
        assert again(3.0) == 7.0
        assert not is_compiled_anew(again), changed
    assert begun() == before + 2


@pytest.mark.parametrize(
    ("changed", "answer"),
    [
        ({"knots": KNOTS.replace("2.0", "3.0")}, 10.0),
        ({"knots": KNOTS.replace("* x", "- x")}, 0.0),
        ({"boat": BOAT.replace("+ 1.0", "- 1.0")}, 5.0),
        ({"boat": BOAT.replace("knots(x)", "knots(x) + knots(x)")}, 13.0),
    ],
)
def test_an_edit_is_seen_in_the_callee_too(load, changed, answer):
    """Numba's own cache does not see an edit of a callee in another file: stale code sailed."""
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


@pytest.mark.parametrize("damage", [lambda b: b[:-7], lambda b: b[:50], lambda b: b"", lambda b: b[: len(b) // 2]])
@pytest.mark.parametrize("which", [".nbi", ".nbc"])
def test_a_torn_file_is_compiled_again(load, kept, damage, which):
    load()(3.0)
    for path in kept.glob(f"*{which}"):
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
    """A card that fails is mounted read-only; numba then did not load what was there either."""
    monkeypatch.setenv("COMPANION_KERNELS", "/proc/none")
    load()(3.0)
    place = tmp_path / "memory" / f"companion-kernels-{os.getuid()}"
    assert place.stat().st_mode & 0o777 == 0o700
    assert len(list(place.glob("*.nbi"))) == 2
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
def test_kernels_that_others_may_have_written_are_not_run_and_that_is_said_once(
    load, kept, monkeypatch, caplog, mode, uid
):
    """They were unpickled and run from any folder that was named."""
    places.refuse.cache_clear()
    load()(3.0)
    kept.chmod(mode)
    if uid is not None:
        monkeypatch.setattr(places.os, "geteuid", lambda: uid)  # what was ours is another's
        monkeypatch.setattr(places, "ROOT", uid)
    before = {path: path.read_bytes() for path in kept.iterdir()}
    caplog.clear()
    assert is_compiled_anew_after(load)
    said = [r.message for r in caplog.records if "none of it is used" in r.message]
    assert len(said) == len(set(said)) > 0
    assert {path: path.read_bytes() for path in kept.iterdir()} == before, "it is left alone"
    if uid is None:
        kept.chmod(0o755)
        assert not is_compiled_anew_after(load)
        assert kept.stat().st_mode & 0o777 == 0o700, "closed: a file in it may be as open as the umask had it"


def test_what_is_kept_is_read_where_nothing_can_be_written(load, kept, monkeypatch, tmp_path):
    """A card that has become read-only: what is there is used, and what is new is kept in memory."""
    load()(3.0)
    tried = places._tried

    def refused(place):
        if place == kept:
            raise OSError(30, "read-only", str(place))
        return tried(place)

    monkeypatch.setattr(places, "_tried", refused)
    assert not is_compiled_anew_after(load)
    assert not list((tmp_path / "memory").glob("*/*.nbi"))
    assert load(knots=KNOTS.replace("2.0", "9.0"))(3.0) == 28.0
    assert list((tmp_path / "memory").glob("*/*.nbi"))


def test_a_full_disk_costs_no_more_than_the_time_to_compile(load, monkeypatch, caplog):
    monkeypatch.setattr("numba.core.caching.IndexDataCacheFile.save", full)
    assert load()(3.0) == 7.0
    assert "cannot be kept" in caplog.text


def full(*_):
    raise OSError(28, "No space left on device")


TYPES = """
import sys
import time
sys.path.insert(0, sys.argv[1])
import numpy as np
from numba.core.caching import IndexDataCacheFile
save = IndexDataCacheFile._save_index
IndexDataCacheFile._save_index = lambda self, overloads: (time.sleep(0.5), save(self, overloads))   # a busy disk
from test_boat import speed
makes = [float, int, np.float32, np.int32, bool, np.int8]
makes = makes[int(sys.argv[2]):] + makes[:int(sys.argv[2])]
print(sorted(float(speed(make(1))) for make in makes))
"""


def test_processes_that_compile_one_kernel_for_other_types_do_not_mix_up_its_files(kept, tmp_path):
    """Numba's index of a kernel is read, changed and written without a lock: the last one wins."""
    (tmp_path / "test_knots.py").write_text(KNOTS)
    (tmp_path / "test_boat.py").write_text(BOAT)
    running = [
        subprocess.Popen([sys.executable, "-c", TYPES, str(tmp_path), str(n)], stdout=subprocess.PIPE, text=True)
        for n in range(4)
    ]
    assert {process.communicate()[0].strip() for process in running} == {str([3.0] * 6)}
    for name in ("test_boat.speed", "test_knots.knots"):
        (index,) = kept.glob(f"{name}-*.nbi")
        assert len(list(kept.glob(f"{index.name.removesuffix('.nbi')}.*.nbc"))) == 6


def test_beyond_the_limit_the_oldest_go(kept, monkeypatch):
    kept.mkdir(mode=0o700)
    now_s = time.time()
    for n in range(6):
        (kept / f"kernel{n}").write_bytes(bytes(100))
        os.utime(kept / f"kernel{n}", (now_s - n, now_s - n))
    monkeypatch.setattr(places, "KEPT_BYTES", 300)
    assert places.sweep() == 3
    assert sorted(p.name for p in kept.iterdir()) == ["kernel0", "kernel1", "kernel2"]


@pytest.mark.parametrize(
    ("environment", "there"),
    [
        ({"COMPANION_KERNELS": "/a", "CACHE_DIRECTORY": "/b", "XDG_CACHE_HOME": "/c"}, "/a"),
        ({"CACHE_DIRECTORY": "/b:/d", "XDG_CACHE_HOME": "/c"}, "/b/kernels"),
        ({"COMPANION_KERNELS": "relative", "XDG_CACHE_HOME": "/c"}, "/c/sailboat-companion/kernels"),
        ({"HOME": "/h"}, "/h/.cache/sailboat-companion/kernels"),
    ],
)
def test_one_place_says_where(monkeypatch, environment, there):
    for name in ("COMPANION_KERNELS", "CACHE_DIRECTORY", "XDG_CACHE_HOME"):
        monkeypatch.delenv(name, raising=False)
    for name, value in environment.items():
        monkeypatch.setenv(name, value)
    assert str(places.folder()) == there
