"""Kernels are compiled ahead of a run, side by side in processes that fill the cache.

needed.json (which kernels, which types) -> needed -> missing (not in the cache) -> order (whose turn it is)
-> crew (processes) -> worker (in each of them)

Anything that goes wrong here costs time and nothing else: the run compiles what it does not find.
"""
