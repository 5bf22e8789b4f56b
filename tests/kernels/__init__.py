"""Tests of companion.kernels."""
