"""Geometry shared by every room: angles on the circle and the local east-north frame."""

from __future__ import annotations

EARTH_RADIUS_M = 6_371_008.8  # the mean of WGS 84
DEGREE_M = 111_195.0  # of latitude on that sphere
LEAST_DEGREE_M = 110_500.0  # no more than any degree of latitude
M_PER_NM = 1852.0
MPS_PER_KNOT = M_PER_NM / 3600.0
