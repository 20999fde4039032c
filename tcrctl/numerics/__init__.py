"""Numerical methods that know no robot: arrays in, arrays out, most of them numba kernels."""
