"""Whoever is told about a run must not be able to end it."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from typing import ParamSpec

P = ParamSpec("P")


def unfailing(tell: Callable[P, None]) -> Callable[P, None]:
    """Return a function that tells the same and raises nothing but what ends a program, such as Ctrl-C.

    Args:
        tell: Takes a message or a number for the user.
    """

    def told(*given: P.args, **named: P.kwargs) -> None:
        with suppress(Exception):
            tell(*given, **named)

    return told
