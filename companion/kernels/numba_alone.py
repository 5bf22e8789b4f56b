"""Numba without scipy, which it loads wherever it is installed: 15 MB a process, for linear algebra that no kernel has.

Whoever may be the first here to load numba takes it from this module.
"""

from __future__ import annotations

import importlib
import sys
from typing import Any

modules: dict[str, Any] = sys.modules
if "scipy" not in modules:
    modules["scipy"] = None   # an import of it fails
    try:
        importlib.import_module("numba.np.arraymath")
    finally:
        del modules["scipy"]

import numba  # noqa: E402 - now that it cannot ask for scipy any more

__all__ = ["numba"]
