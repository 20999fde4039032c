"""Laws of a log whose run ended badly: cut files, damage, killed processes, exceptions."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from support import records
from support.log_files import N_STEPS, doctor, is_prefix, open_log, wait_until, write_steps
from tcrctl.errors import InputError, LogError
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover

TESTS = Path(__file__).parents[1]


@pytest.fixture(scope="module")
def expected():
    return [records.fingerprint(records.record(k)) for k in range(N_STEPS)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished log with a chunk every 8 steps."""
    path = tmp_path_factory.mktemp("whole") / "log.mcap"
    write_steps(path, flush_steps=8)
    return path


@pytest.mark.slow
@pytest.mark.parametrize("count", [50, pytest.param(200, marks=pytest.mark.thorough)])
def test_a_file_cut_anywhere_yields_a_prefix_without_a_corrupt_step(whole, tmp_path, expected, count):
    data = whole.read_bytes()
    cuts = np.unique(np.random.default_rng(0).integers(0, len(data), count))
    path = tmp_path / "cut.mcap"
    lengths = []
    for cut in cuts:
        path.write_bytes(data[:cut])
        try:
            log = read_log(path)
        except InputError:
            assert cut < 100  # not even the header is whole
            continue
        assert not log.complete
        lengths.append(is_prefix(path, expected))
    assert lengths == sorted(lengths)
    assert len(set(lengths)) > 5
    assert lengths[-1] >= N_STEPS - 8


@pytest.mark.slow
@pytest.mark.parametrize("count", [9, pytest.param(25, marks=pytest.mark.thorough)])
def test_recovery_of_a_file_cut_anywhere_keeps_every_readable_step(whole, tmp_path, expected, count):
    data = whole.read_bytes()
    for i, cut in enumerate(np.linspace(200, len(data), count).astype(int)):
        cut_file, mended = tmp_path / "cut.mcap", tmp_path / f"{i}.mcap"
        cut_file.write_bytes(data[:cut])
        result = recover(cut_file, mended)
        log = read_log(mended)
        assert log.complete
        assert is_prefix(mended, expected) == result.steps == is_prefix(cut_file, expected)
        assert result.lossy == (read_log(cut_file).stop is None)
        assert log.stop is not None
        assert (log.stop.get("recovered") == "true") == result.lossy
        if i in (0, count // 2):
            assert doctor(mended).returncode == 0, doctor(mended).stdout


def test_recovery_of_a_complete_log_loses_nothing(whole, tmp_path, expected):
    result = recover(whole, tmp_path / "copy.mcap")
    before, after = read_log(whole), read_log(tmp_path / "copy.mcap")
    assert not result.lossy
    assert (before.start, before.stop, before.attachments) == (after.start, after.stop, after.attachments)
    assert is_prefix(tmp_path / "copy.mcap", expected) == N_STEPS
    with pytest.raises(InputError, match="never overwritten"):
        recover(whole, tmp_path / "copy.mcap")
    with pytest.raises(InputError, match="never overwritten"):
        recover(whole, whole)


@pytest.mark.slow
@pytest.mark.parametrize("which", [0, 3])
def test_a_damaged_chunk_is_reported_and_recovery_saves_all_others(whole, tmp_path, which):
    data = bytearray(whole.read_bytes())
    start = -1
    for _ in range(which + 1):
        start = data.index(b"\x04\x00\x00\x00zstd", start + 1)
    data[start + 200] ^= 0xFF
    damaged, mended = tmp_path / "damaged.mcap", tmp_path / "mended.mcap"
    damaged.write_bytes(data)
    with pytest.raises(LogError, match="damaged"):
        list(read_log(damaged).steps())
    result = recover(damaged, mended)
    assert (result.damaged_chunks, result.lossy) == (1, True)
    kept = [step.k for step in read_log(mended).steps()]
    # chunk 0 holds the schemas and the opening event; chunk i the steps 8 (i - 1) .. 8 i - 1
    lost = set() if which == 0 else set(range(8 * (which - 1), 8 * which))
    assert kept == [k for k in range(N_STEPS) if k not in lost]
    assert doctor(mended).returncode == 0, doctor(mended).stdout


CHILD = """
import signal, sys, time
sys.path.insert(0, {tests!r})
from support import records
from support.log_files import open_log
signal.signal(signal.SIGTERM, lambda *_: sys.exit(143))
with open_log({path!r}, flush_s={flush_s}, flush_steps={flush_steps}) as log:
    for k in range({n}):
        log.step(records.record(k))
    print("logged", flush=True)
    time.sleep(60)
"""


def start_child(path, **options):
    program = CHILD.format(tests=str(TESTS), path=str(path), **options)
    environment = {**os.environ, "PYTHONPATH": str(TESTS.parent)}
    child = subprocess.Popen(
        [sys.executable, "-c", program], stdout=subprocess.PIPE, text=True, env=environment
    )
    assert child.stdout is not None
    assert child.stdout.readline() == "logged\n"
    return child


@pytest.mark.slow
@pytest.mark.parametrize(
    ("flush_s", "flush_steps", "at_least", "at_most"), [(60.0, 10, 30, 35), (0.2, 1000, 35, 35)]
)
def test_kill_9_loses_at_most_one_flush_interval(tmp_path, expected, flush_s, flush_steps, at_least, at_most):
    path = tmp_path / "log.mcap"
    with start_child(path, flush_s=flush_s, flush_steps=flush_steps, n=35) as child:
        enough = wait_until(lambda: sum(1 for _ in read_log(path).steps()) >= at_least)
        child.kill()
    assert enough
    assert child.returncode == -signal.SIGKILL
    assert at_least <= is_prefix(path, expected) <= at_most
    assert read_log(path).stop is None
    assert recover(path, tmp_path / "mended.mcap").lossy
    assert doctor(tmp_path / "mended.mcap").returncode == 0


@pytest.mark.slow
def test_sigterm_leaves_a_finished_log(tmp_path, expected):
    path = tmp_path / "log.mcap"
    with start_child(path, flush_s=60.0, flush_steps=1000, n=35) as child:
        child.terminate()
        assert child.wait(20) == 143
    log = read_log(path)
    assert log.complete
    assert log.stop is not None
    assert log.stop["status"] == "aborted"
    assert is_prefix(path, expected) == 35


@pytest.mark.slow
def test_a_program_that_forgets_the_log_still_ends_and_finishes_it(tmp_path, expected):
    path = tmp_path / "log.mcap"
    program = f"""
import sys; sys.path.insert(0, {str(TESTS)!r})
from support import records
from support.log_files import open_log
log = open_log({str(path)!r})
log.step(records.record(0))
raise SystemExit(7)
"""
    environment = {**os.environ, "PYTHONPATH": str(TESTS.parent)}
    run = subprocess.run([sys.executable, "-c", program], env=environment, timeout=30, check=False)
    assert run.returncode == 7
    assert read_log(path).complete
    assert is_prefix(path, expected) == 1


@pytest.mark.slow
def test_an_exception_in_the_run_is_in_the_stop_record(tmp_path, expected):
    path = tmp_path / "log.mcap"

    def run():
        with open_log(path) as log:
            log.step(records.record(0))
            raise ZeroDivisionError("the plant fell off the wall")

    with pytest.raises(ZeroDivisionError):
        run()
    stop = read_log(path).stop
    assert stop is not None
    assert stop["status"] == "error"
    assert stop["reason"] == "ZeroDivisionError: the plant fell off the wall"
    assert is_prefix(path, expected) == 1
    assert doctor(path).returncode == 0
