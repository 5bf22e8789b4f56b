"""Geometry shared by every room: angles on the circle and the local east-north frame."""

from __future__ import annotations

M_PER_NM = 1852.0
MPS_PER_KNOT = M_PER_NM / 3600.0
