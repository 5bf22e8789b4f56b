"""What a result was made by: version, source and libraries. Two programs that agree in it give a seed the same bytes.

The commit says where to look it up and is not compared: a checkout may be changed, an installed program has none. The
digest of the source says what runs. Libraries of arithmetic and the kind of machine count, because the last bit does.
"""

from __future__ import annotations

import hashlib
import platform
import subprocess
from dataclasses import asdict, dataclass
from functools import cache
from importlib import import_module
from importlib.metadata import version
from pathlib import Path
from typing import Any

import companion
import sitl

LIBRARIES = ("numpy", "numba", "shapely", "pyproj", "pymavlink")
ROOTS = tuple(Path(package.__path__[0]).resolve() for package in (companion, sitl))


@dataclass(frozen=True, slots=True, kw_only=True)
class MadeBy:
    """A program that sails: its ``source`` is a digest of all its modules; ``commit`` ends in + where they differ."""

    version: str
    commit: str
    source: str
    python: str
    machine: str
    libraries: tuple[tuple[str, str], ...]

    def to_dict(self) -> dict[str, Any]:
        """Return it for JSON."""
        return {**asdict(self), "libraries": dict(self.libraries)}

    @classmethod
    def from_dict(cls, plain: dict[str, Any]) -> MadeBy:
        """Return it from JSON; KeyError, TypeError or ValueError where it is none."""
        return cls(**{**plain, "libraries": tuple(dict(plain["libraries"]).items())})

    def unlike(self, other: MadeBy) -> str:
        """Return in words how ``other`` differs in what decides a result, "" where it does not."""
        pairs = [("the project", self.version, other.version), ("its source", self.source, other.source),
                 ("Python", self.python, other.python), ("the machine", self.machine, other.machine)]
        theirs = dict(other.libraries)
        pairs += [(name, number, theirs.get(name, "none")) for name, number in self.libraries]
        return ", ".join(f"{name} is {there} there and {here} here" for name, here, there in pairs if here != there)


@cache
def made_by() -> MadeBy:
    """Return what this process is."""
    return MadeBy(
        version=companion.__version__, commit=_commit(), source=_source(), machine=platform.machine(),
        python=".".join(platform.python_version_tuple()[:2]),
        libraries=tuple((name, version(name)) for name in LIBRARIES))


@cache
def processor() -> str:
    """Return what numpy makes of the processor: with other instructions the last bit of a sine may be another."""
    features = import_module("numpy._core._multiarray_umath").__cpu_features__
    return hashlib.sha256(repr(sorted(name for name, has in features.items() if has)).encode()).hexdigest()[:8]


def _source() -> str:
    digest = hashlib.sha256()
    for root in ROOTS:
        for path in sorted(root.rglob("*.py")):
            name = path.relative_to(root.parent).as_posix()
            if "/kernels/carried/" not in name:
                digest.update(name.encode() + b"\0" + path.read_bytes() + b"\0")
    return digest.hexdigest()[:16]


def _commit() -> str:
    """Return the commit of the checkout that the packages lie in, "" where there is none or no git."""
    def git(*words: str) -> str:
        done = subprocess.run(["git", "-C", str(ROOTS[0].parent), *words],  # noqa: S603, S607 - the user's own git
                              capture_output=True, text=True, check=True, timeout=10.0)
        return done.stdout.strip()

    try:
        if not git("ls-files", *(str(root / "__init__.py") for root in ROOTS)):
            return ""   # installed somewhere below another project's checkout
        changed = git("status", "--porcelain", "--untracked-files=all", "--", *map(str, ROOTS))
        return git("rev-parse", "--short=12", "HEAD") + ("+" if changed else "")
    except (OSError, subprocess.SubprocessError):
        return ""
