"""Element kernels: one element one file, numba functions over plain arrays, no objects."""
