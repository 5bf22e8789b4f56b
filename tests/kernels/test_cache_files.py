"""The files of compiled kernels: the first that is written stays, for somebody may have loaded it and links with it."""

import os
import subprocess
import sys
from pathlib import Path

from companion.kernels.cache import _write, read


def test_of_two_processes_that_compile_one_kernel_the_first_one_s_file_stays(tmp_path):
    path = tmp_path / "kernel"
    _write(path, b"the first")
    _write(path, b"the second")
    assert read(path) == b"the first"
    assert list(tmp_path.iterdir()) == [path]


def test_a_damaged_file_is_replaced(tmp_path):
    path = tmp_path / "kernel"
    path.write_bytes(b"x" * 100)
    _write(path, b"whole")
    assert read(path) == b"whole"
    assert list(tmp_path.iterdir()) == [path]


def test_without_links_it_is_replaced(tmp_path, monkeypatch):
    def refused(*_):
        raise PermissionError(1, "no links here")

    monkeypatch.setattr("companion.kernels.cache.os.link", refused)
    _write(tmp_path / "kernel", b"whole")
    assert read(tmp_path / "kernel") == b"whole"
    assert list(tmp_path.iterdir()) == [Path(tmp_path, "kernel")]


LINKS = """
import sys
from pathlib import Path
from companion.errors import JobError
from companion.kernels.cache import _write
from companion.kernels.places import looked_in
from companion.kernels.xorshift import uniform
import numpy as np
state = np.array([1], dtype=np.uint64)
uniform(state)                       # compiled, or loaded
library = next(iter(uniform.overloads.values())).library
if sys.argv[1] == "again":
    (file,) = [p for place in looked_in() for p in Path(place).glob("companion.kernels.xorshift.uniform-*")]
    file.unlink()
    _write(file, b"somebody else's")
    try:
        library._get_module_for_linking()
    except JobError as error:
        print("refused:", error)
"""


def test_a_loaded_kernel_whose_file_has_changed_is_not_linked_with(tmp_path):
    said = [subprocess.run([sys.executable, "-c", LINKS, word], text=True, capture_output=True, check=True,
                           env={**os.environ, "XDG_CACHE_HOME": str(tmp_path)}).stdout for word in ("once", "again")]
    assert said[0] == ""
    assert "changed while a kernel was compiled" in said[1]
