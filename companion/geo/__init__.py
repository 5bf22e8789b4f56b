"""Geometry shared by every room: angles on the circle and the local east-north frame."""
