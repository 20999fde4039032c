"""In which order kernels are compiled: after those that they call, and the longest way to the end first."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field

from tcrctl.kernels.needed import NeededKernels


@dataclass
class Order:
    """What is to be done, in the air, and done.

    Attributes:
        needed: All kernels.
        tasks: Numbers of those that are to be compiled, callees first.
        begun: Those that somebody has taken.
        ended: Those that are compiled, or were given up.
    """

    needed: NeededKernels
    tasks: Collection[int]
    begun: set[int] = field(default_factory=set)
    ended: set[int] = field(default_factory=set)

    def __post_init__(self) -> None:
        """Find how long it takes at least from the begin of each to the end of all [s]."""
        self._way: dict[int, float] = {}
        self._callers: dict[int, list[int]] = {task: [] for task in self.tasks}
        for task in self.tasks:
            for callee in self._callees(task):
                self._callers[callee].append(task)
        for task in sorted(self.tasks, reverse=True):
            rest = max((self._way[caller] for caller in self._callers[task]), default=0.0)
            self._way[task] = self.needed.kernels[task].seconds + rest

    def take(self) -> int | None:
        """Return what somebody who is free should begin with; None if there is nothing at the moment."""
        ready = [t for t in self.tasks if t not in self.begun and self.ended.issuperset(self._callees(t))]
        if not ready:
            return None
        task = max(ready, key=self._way.__getitem__)
        self.begun.add(task)
        return task

    @property
    def done(self) -> bool:
        """Whether nothing is left."""
        return len(self.ended) == len(self.tasks)

    @property
    def share(self) -> float:
        """Share of the work that is done, 0 .. 1."""
        whole = sum(self.needed.kernels[task].seconds for task in self.tasks)
        return sum(self.needed.kernels[task].seconds for task in self.ended) / whole if whole else 1.0

    def _callees(self, task: int) -> list[int]:
        return [callee for callee in self.needed.kernels[task].calls if callee in self._callers]
