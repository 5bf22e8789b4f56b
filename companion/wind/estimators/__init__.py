"""The estimators: one interface, Büsser's, Wolsieffer's and the default forecaster, by name."""

from companion.wind.estimators.catalogue import NAMES, make
from companion.wind.estimators.estimator import SIGMA_MAX_RAD, normal_half_width
from companion.wind.estimators.forecaster import CONSTANTS, compile_kernels

__all__ = ["CONSTANTS", "NAMES", "SIGMA_MAX_RAD", "compile_kernels", "make", "normal_half_width"]
