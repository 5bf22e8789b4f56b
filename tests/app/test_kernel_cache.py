"""The compiled kernels on a card that has become read-only."""

import os
import subprocess
import sys

import pytest

from companion import kernel_cache

ROOT = kernel_cache.PACKAGE.parent
USE = "from companion.planner import vessel_kernels as k; print(k._cdf(0.0))"
GUARDED = ("import os, sys; from pathlib import Path; from companion import kernel_cache as c; "
           "os.environ[c.VARIABLE] = str(c.keep_usable(os.environ, [Path(sys.argv[1])]) or ''); " + USE)
# a name space of its own, in which the program and its compiled kernels are on a read-only file system
SCRIPT = (f"mount --make-rprivate / && mount --bind '{ROOT}' '{ROOT}' && mount -o remount,ro,bind '{ROOT}' && "
          f"cd '{ROOT}' && exec \"$@\"")
READ_ONLY = ["unshare", "-m", "sh", "-c", SCRIPT, "sh"]


def test_where_numba_can_write_nothing_is_changed(tmp_path):
    assert kernel_cache.keep_usable({"NUMBA_CACHE_DIR": str(tmp_path / "new")}, [tmp_path]) is None
    assert kernel_cache.keep_usable({"HOME": str(tmp_path)}, [tmp_path]) is None
    assert not list(tmp_path.glob("companion-*"))


def run(program, *arguments):
    environment = {**os.environ, "HOME": "/proc", "NUMBA_DEBUG_CACHE": "1"}
    environment.pop("XDG_CACHE_HOME", None)
    environment.pop("NUMBA_CACHE_DIR", None)
    done = subprocess.run([*READ_ONLY, sys.executable, "-c", program, *arguments], env=environment, check=False,
                          capture_output=True, text=True, cwd=ROOT)
    if "unshare" in done.stderr or "mount:" in done.stderr:
        pytest.skip(f"nothing can be mounted here: {done.stderr.strip()[:80]}")
    return done


def test_on_a_read_only_card_they_are_used_from_memory(tmp_path):
    """The companion could not be started again, with a traceback (issue 12, point 13)."""
    subprocess.run([sys.executable, "-c", USE], check=True, capture_output=True, cwd=ROOT)   # they are compiled
    assert "no locator available" in run(USE).stderr
    for _ in range(2):
        guarded = run(GUARDED, str(tmp_path))
        assert guarded.returncode == 0, guarded.stderr
        assert "0.5" in guarded.stdout
        assert "data loaded from" in guarded.stdout    # not compiled again: on a Pi that takes minutes
    assert [p.name for p in tmp_path.iterdir()] == [f"companion-kernels-{os.getuid()}"]    # one copy, not one a start
    assert (tmp_path / f"companion-kernels-{os.getuid()}").stat().st_mode & 0o777 == 0o700


def test_a_folder_that_others_can_write_is_not_trusted(tmp_path):
    (tmp_path / f"companion-kernels-{os.getuid()}").mkdir()
    (tmp_path / f"companion-kernels-{os.getuid()}").chmod(0o777)
    assert "no locator available" in run(GUARDED, str(tmp_path)).stderr
