"""An executor and what is known of the workers behind it."""

from __future__ import annotations

from collections.abc import Callable
from concurrent.futures import Executor
from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Workers:
    """Workers that are up.

    Attributes:
        executor: Takes the work.
        width: How many pieces of work are handed out at a time.
        kill: Ends all worker processes at once, which breaks the executor; None where that cannot be done.
    """

    executor: Executor
    width: int
    kill: Callable[[], None] | None = None
