"""Processes that fill the cache leave what one process would; what goes wrong costs time and nothing else."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from contextlib import suppress
from pathlib import Path

import pytest

from support.program_copy import ProgramCopy
from tcrctl.kernels.crew import Crew
from tcrctl.kernels.needed import Needed, NeededKernels, read_needed, write_needed
from tcrctl.kernels.order import Order

#: What ``script.py`` calls.
MEASURE = "elements.rubbing_cable.measure"
AHEAD = """
import sys
from tcrctl.kernels.ahead import compile_ahead
told = []
failed = compile_ahead((), lambda *state: told.append(state), int(sys.argv[1]))
print(failed, len(told), *told[-1][:2] if told else ())
"""
#: Long enough for every process of a test.
LIMIT_S = 120.0


def with_callees(needed, number):
    below = [with_callees(needed, callee) for callee in needed.kernels[number].calls]
    return sorted({number}.union(*below))


@pytest.fixture
def program(tmp_path):
    """A copy of the program whose runs need one kernel, and what that calls."""
    needed = read_needed()
    (measure,) = (i for i, one in enumerate(needed.kernels) if one.kernel == MEASURE)
    numbers = with_callees(needed, measure)
    assert len(numbers) > 3
    copy = ProgramCopy(tmp_path)
    kernels = [
        Needed(
            one.kernel,
            one.arguments,
            tuple(numbers.index(callee) for callee in one.calls),
            one.seconds,
            frozenset() if one.kernel == MEASURE else None,
        )
        for one in (needed.kernels[i] for i in numbers)
    ]
    write_needed(NeededKernels(tuple(kernels), needed.tuples), copy.package / "kernels" / "needed.json")
    (copy.folder / "work" / "ahead.py").write_text(AHEAD)
    return copy


def names(program):
    return {path.name for path in program.kernels}


@pytest.mark.slow
def test_processes_leave_the_files_that_one_would_and_the_run_compiles_nothing(program, tmp_path):
    failed, told, done, total = program.python("ahead.py", "2").stdout.split()
    filled = names(program)
    assert failed == "0"
    assert int(told) > 1
    assert done == total == str(len(filled))
    assert program.lengths()[1] == ""
    alone = ProgramCopy(tmp_path / "alone")
    alone.lengths()
    assert names(alone) == filled


@pytest.mark.slow
def test_on_one_core_nothing_is_compiled_ahead(program):
    assert program.python("ahead.py", "1").stdout.split() == ["0", "0"]
    assert names(program) == set()


@pytest.mark.slow
def test_two_programs_that_start_at_once_both_fill_the_cache(program):
    with start(program) as first:
        program.python("ahead.py", "2")
        assert first.communicate(timeout=LIMIT_S)[0].split()[0] == "0"
    assert program.lengths()[1] == ""


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM, signal.SIGKILL])
def test_whatever_ends_the_program_ends_its_workers_and_leaves_whole_files(program, number):
    with start(program) as running:
        wait_until(lambda: program.kernels or running.poll() is not None)
        running.send_signal(number)
        running.wait(LIMIT_S)
    wait_until(lambda: not workers_of(program))
    before = {path: path.read_bytes() for path in program.kernels}
    assert before
    assert not list(program.home.rglob("*.part"))
    found, _ = program.lengths()
    assert found == pytest.approx([27**0.5])
    assert {path: path.read_bytes() for path in before} == before  # a damaged one would be made again


def start(program):
    environment = {**os.environ, "HOME": str(program.home), "PYTHONPATH": str(program.package.parent)}
    for name in ("NUMBA_CACHE_DIR", "XDG_CACHE_HOME"):
        environment.pop(name, None)
    return subprocess.Popen(
        [sys.executable, "ahead.py", "2"],
        cwd=program.folder / "work",
        env=environment | {"NUMBA_OPT": "1"},
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def workers_of(program):
    """Processes that compile for this copy of the program."""
    lines = []
    for path in Path("/proc").glob("[0-9]*/cmdline"):
        with suppress(OSError):  # it has just ended
            lines.append(path.read_bytes().replace(b"\0", b" ").decode(errors="replace"))
    return [line for line in lines if str(program.package.parent) in line and "worker" in line]


def wait_until(holds):
    deadline = time.monotonic() + LIMIT_S
    while not holds():
        assert time.monotonic() < deadline
        time.sleep(0.02)


def order(count=6):
    made = [Needed(f"a.k{i}", (), () if i == 0 else (i - 1,), 1.0, None) for i in range(count)]
    return Order(NeededKernels(tuple(made), {}), range(count))


@pytest.mark.parametrize(
    ("worker", "failed"),
    [
        ("[print('done', flush=True) for _ in __import__('sys').stdin]", 0),
        ("[print('failed', flush=True) for _ in __import__('sys').stdin]", 6),
        ("input(); print('done', flush=True); input()", 2),  # each of two processes ends after one kernel
        ("pass", 2),
    ],
)
def test_a_worker_that_fails_or_ends_is_gone_without(worker, failed):
    crew, told = Crew(order(), 2, lambda: [sys.executable, "-S", "-c", worker]), []
    crew.work(lambda *state: told.append(state))
    assert crew.failed == failed
    assert told[0][0] == 0
    assert all(total == 6 for _, total, _ in told)


def test_a_worker_that_cannot_be_started_is_gone_without():
    crew, told = Crew(order(), 2, lambda: ["/nowhere"]), []
    crew.work(lambda *state: told.append(state))
    assert crew.failed == 0
    assert told[-1][:2] == (0, 6)


def test_who_watches_may_end_it_at_once():
    def impatient(*state):
        raise KeyboardInterrupt

    crew = Crew(order(), 2, lambda: [sys.executable, "-S", "-c", "input(); input()"])
    begin = time.monotonic()
    with pytest.raises(KeyboardInterrupt):
        crew.work(impatient)
    assert time.monotonic() - begin < 10.0
