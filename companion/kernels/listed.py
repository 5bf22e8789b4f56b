"""The list of the kernels that a voyage needs: which, for which types, and about how long each compiles.

Each program's package has one, ``kernels.txt``, written by ``python -m bench.kernels --write`` and held complete
by a test. It makes no decision: what is missing from it is compiled when it is called.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

from numba.core.dispatcher import Dispatcher

from companion.errors import JobError
from companion.kernels.places import FILE, PACKAGES
from companion.kernels.signatures import from_text


@dataclass(frozen=True, slots=True, kw_only=True)
class Entry:
    """A kernel for one combination of types; ``seconds`` of a processor is what it took once to compile."""

    module: str
    name: str
    signature: str
    seconds: float

    def __str__(self) -> str:
        return f"{self.seconds:.2f} {self.module}:{self.name} {self.signature}".rstrip()

    def dispatcher(self) -> Dispatcher:
        """Return the kernel. Raises JobError when it is not there any more."""
        try:
            found = getattr(importlib.import_module(self.module), self.name)
        except (ImportError, AttributeError):
            found = None
        if not isinstance(found, Dispatcher):
            raise JobError(f"{self.module}.{self.name} is listed and is no kernel")
        return found

    def types(self) -> tuple[Any, ...]:
        """Return the types. Raises JobError when they are not there any more."""
        return from_text(self.signature)


def read_list(package: str) -> list[Entry]:
    """Return the package's kernels, those that are called before those that call them."""
    out = []
    for line in (PACKAGES / package / FILE).read_text(encoding="utf-8").splitlines():
        if line.strip() and not line.startswith("#"):
            seconds, place, *signature = line.split(maxsplit=2)
            module, _, name = place.partition(":")
            out.append(Entry(module=module, name=name, signature="".join(signature), seconds=float(seconds)))
    return out
