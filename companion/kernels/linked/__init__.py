"""Linked kernels: a library of the system that a package carries, made of all of them, and called without numba."""

from companion.kernels.linked.calling import Linked, is_linked

__all__ = ["Linked", "is_linked"]
