"""Work in processes: everything is done once, whoever dies; nothing outlives its parent."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from functools import partial
from pathlib import Path

import pytest

from support import work
from tcrctl.errors import DeviceError, InputError, RunInterruptedError
from tcrctl.executors import cluster
from tcrctl.executors.carried import carried
from tcrctl.executors.engine import Engine, available_cores, physical_cores
from tcrctl.executors.outcomes import Crash, outcomes

TWO = Engine(jobs=2)


def results(function, items, **more):
    return dict(outcomes(TWO, function, items, **more))


def test_every_piece_of_work_is_done_once_and_the_iterator_is_not_run_ahead():
    taken = []

    def source():
        for i in range(20):
            taken.append(i)
            yield i

    for done, (item, result) in enumerate(outcomes(TWO, work.square, source()), start=1):
        assert result == item * item
        assert len(taken) <= done + 2
    assert done == 20


def test_an_exception_is_the_result_of_its_piece_alone():
    found = results(work.refuse, [1, 2])
    assert found == {1: Crash("ValueError: not 1"), 2: Crash("ValueError: not 2")}


@pytest.mark.slow
def test_what_kills_its_process_is_found_out_and_nothing_else_is_lost(tmp_path):
    orders = [(str(tmp_path), f"n{i}", {3: 99, 5: 1}.get(i, 0)) for i in range(8)]
    found = {order[1]: result for order, result in outcomes(TWO, work.die, orders)}
    assert isinstance(found.pop("n3"), Crash)
    assert found == {f"n{i}": f"n{i}" for i in range(8) if i != 3}  # n5 died once, and was done again
    assert (
        len(list(tmp_path.glob("n3.*"))) <= 3
    )  # in company, alone; perhaps once more beside another's death


@pytest.mark.slow
def test_a_late_piece_is_ended_and_the_others_are_not(tmp_path):
    found = results(work.sleep, [60.0, 0.1, 0.2, 0.3], deadline_s=4.0)
    assert isinstance(found.pop(60.0), Crash)
    assert found == {0.1: 0.1, 0.2: 0.2, 0.3: 0.3}


@pytest.mark.slow
def test_the_first_thing_that_is_done_is_to_warm_up(tmp_path):
    mark = tmp_path / "warm"
    ((_, result),) = outcomes(TWO, Path.exists, [mark], warm=partial(work.mark, str(mark)))
    assert result is True


@pytest.mark.slow
def test_an_interruption_ends_the_work_in_the_air(tmp_path):
    path = tmp_path / "pid"

    def check():
        if path.exists() and path.read_text():
            raise RunInterruptedError(signal.SIGINT, "SIGINT")

    with pytest.raises(RunInterruptedError):
        results(work.marked_sleep, [(str(path), 300.0)], check=check)
    assert not is_alive(int(path.read_text()))


def is_alive(pid):
    try:
        state = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


ORPHAN = """
import sys
from support import work
from tcrctl.executors.engine import Engine
from tcrctl.executors.outcomes import outcomes
if __name__ == "__main__":
    list(outcomes(Engine(1), work.marked_sleep, [(sys.argv[1], 300.0)]))
"""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks /proc")
def test_a_worker_does_not_outlive_a_parent_that_is_killed(tmp_path):
    path, program = tmp_path / "pid", tmp_path / "parent.py"
    program.write_text(ORPHAN)
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    parent = subprocess.Popen([sys.executable, str(program), str(path)], env=environment)
    patience = time.monotonic() + 60.0
    while not (path.exists() and path.read_text()) and time.monotonic() < patience:
        time.sleep(0.05)
    worker = int(path.read_text())
    parent.kill()
    parent.wait()
    while is_alive(worker) and time.monotonic() < patience:
        time.sleep(0.05)
    assert not is_alive(worker)


def test_what_is_carried_is_unpacked_once_per_process():
    parcel = carried({"a": [1, 2]})
    assert parcel.value == {"a": [1, 2]}
    assert parcel.value is carried({"a": [1, 2]}).value


def test_there_are_no_more_physical_than_logical_cores():
    assert 1 <= physical_cores() <= available_cores()


def test_without_dask_the_message_says_what_to_install(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match="not installed") as raised, Engine(1, "local").open():
        pass
    assert "tcrctl[cluster]" in raised.value.hint


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore::ResourceWarning")
def test_a_scheduler_that_is_not_there_is_a_device_error(monkeypatch):
    monkeypatch.setattr(cluster, "PATIENCE_S", 0.5)
    with (
        pytest.raises(DeviceError, match="there is no Dask scheduler"),
        Engine(1, "tcp://127.0.0.1:9").open(),
    ):
        pass


def test_a_worker_keeps_its_own_environment_and_gets_what_it_lacks(monkeypatch):
    monkeypatch.setenv("NUMBA_OPT", "3")
    monkeypatch.delenv("OPENBLAS_NUM_THREADS", raising=False)
    cluster.set_environment({"NUMBA_OPT": "1", "OPENBLAS_NUM_THREADS": "1"})
    assert cluster.environment() == {"NUMBA_OPT": "3", "OPENBLAS_NUM_THREADS": "1"}
