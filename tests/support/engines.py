"""Engines without processes, for tests of what is done and not of where: to start one costs ten short runs."""

from __future__ import annotations

from concurrent.futures import Executor, Future
from contextlib import contextmanager

from tcrctl.executors.engine import Engine
from tcrctl.executors.workers import Workers


class Here(Executor):
    """Does everything at once, in this process."""

    def submit(self, function, /, *given, **named):
        future = Future()
        try:
            future.set_result(function(*given, **named))
        except Exception as error:
            future.set_exception(error)
        return future


@contextmanager
def _opened(engine, warm=None):
    del engine, warm
    yield Workers(Here(), 1)


def stay_here(monkeypatch):
    """Let every engine do its work in this process."""
    monkeypatch.setattr(Engine, "open", _opened)
