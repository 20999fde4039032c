"""Pieces of work that worker processes can be given."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path


def square(x):
    return x * x


def refuse(x):
    raise ValueError(f"not {x}")


def die(order):
    """Leave a mark; end the process of the worker as often as the order says, then return its name."""
    folder, name, deaths = order
    marks = len(list(Path(folder).glob(f"{name}.*")))
    (Path(folder) / f"{name}.{marks}").touch()
    if marks < deaths:
        os.kill(os.getpid(), signal.SIGKILL)
    return name


def sleep(seconds):
    time.sleep(seconds)
    return seconds


def mark(path):
    Path(path).write_text(str(os.getpid()))
    return os.getpid()


def marked_sleep(order):
    """Write the id of the process, and sleep."""
    path, seconds = order
    mark(path)
    return sleep(seconds)
