"""The estimators: one interface, Büsser's, Wolsieffer's and the default forecaster, by name."""

from companion.wind.estimators.catalogue import NAMES, make
from companion.wind.estimators.forecaster import compile_kernels

__all__ = ["NAMES", "compile_kernels", "make"]
