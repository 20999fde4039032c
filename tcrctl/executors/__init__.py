"""The one seam for parallel work: everything takes a ``concurrent.futures.Executor``.

engine (how many processes, or which cluster) -> workers (an executor, how wide) -> outcomes, as they come

Processes of the standard library by default, Dask behind the extra ``cluster``. What is sent must be picklable.
"""
