"""Whose turn it is: a kernel after those that it calls, and what the others wait for first."""

from __future__ import annotations

import pytest

from tcrctl.kernels.needed import Needed, NeededKernels
from tcrctl.kernels.order import Order

#: Seconds and callees of each; 5 calls 3 and 4, they call 0 to 2.
KERNELS = [(1.0, ()), (5.0, ()), (2.0, ()), (1.0, (0, 1)), (1.0, (1, 2)), (3.0, (3, 4))]


def order(tasks=None):
    tasks = range(len(KERNELS)) if tasks is None else tasks
    made = [Needed(f"a.k{i}", (), calls, seconds, None) for i, (seconds, calls) in enumerate(KERNELS)]
    return Order(NeededKernels(tuple(made), {}), list(tasks))


def test_callees_come_before_their_callers_and_all_comes_once():
    going, taken = order(), []
    while not going.done:
        task = going.take()
        assert set(KERNELS[task][1]) <= going.ended
        going.ended.add(task)
        taken.append(task)
    assert sorted(taken) == list(range(len(KERNELS)))
    assert going.take() is None


def test_the_longest_way_is_begun_first():
    going = order()
    assert [going.take() for _ in range(4)] == [1, 2, 0, None]


def test_nobody_waits_for_what_is_in_the_cache_already():
    going = order([3, 5])
    assert going.take() == 3
    assert going.take() is None
    going.ended.add(3)
    assert going.take() == 5


def test_the_share_counts_work_and_not_kernels():
    going = order()
    assert going.share == 0.0
    going.ended.add(1)
    assert going.share == pytest.approx(5.0 / 13.0)
    assert order([]).share == 1.0
