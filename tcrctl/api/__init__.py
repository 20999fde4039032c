"""The program from Python: runs and their logs, plants step by step, and robots at rest; see :mod:`tcrctl`."""
