"""Laws of a log whose run ended badly: cut files, killed processes, full disks, bad folders."""

from __future__ import annotations

import errno
import io
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

import numpy as np
import pytest
import records
from test_log import STOP, doctor, open_log

from tcrctl.errors import InputError, LogError
from tcrctl.log import writer as writer_module
from tcrctl.log.mcap_file import McapFile
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover

TESTS = Path(__file__).parent
N_STEPS = 60


@pytest.fixture(scope="module")
def expected():
    return [records.fingerprint(records.record(k)) for k in range(N_STEPS)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished log with a chunk every 8 steps."""
    path = tmp_path_factory.mktemp("whole") / "log.mcap"
    write_steps(path, flush_steps=8)
    return path


def write_steps(path, **options):
    with open_log(path, flush_s=60.0, **options) as log:
        for k in range(N_STEPS):
            log.step(records.record(k))
        log.finish(STOP)


def is_prefix(path, expected):
    """Steps of a log, after checking that they are the first ones, each equal bit for bit."""
    found = [records.fingerprint(step) for step in read_log(path).steps()]
    assert found == expected[: len(found)]
    return len(found)


def test_a_file_cut_anywhere_yields_a_prefix_without_a_corrupt_step(whole, tmp_path, expected):
    data = whole.read_bytes()
    cuts = np.unique(np.random.default_rng(0).integers(0, len(data), 200))
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


def test_recovery_of_a_file_cut_anywhere_keeps_every_readable_step(whole, tmp_path, expected):
    data = whole.read_bytes()
    for i, cut in enumerate(np.linspace(200, len(data), 25).astype(int)):
        cut_file, mended = tmp_path / "cut.mcap", tmp_path / f"{i}.mcap"
        cut_file.write_bytes(data[:cut])
        result = recover(cut_file, mended)
        log = read_log(mended)
        assert log.complete
        assert is_prefix(mended, expected) == result.steps == is_prefix(cut_file, expected)
        assert result.lossy == (read_log(cut_file).stop is None)
        assert log.stop is not None
        assert (log.stop.get("recovered") == "true") == result.lossy
        if i in (0, 12):
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
import records
from test_log import open_log
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


def wait_until(condition, seconds=20.0):
    end = time.monotonic() + seconds
    while not condition() and time.monotonic() < end:
        time.sleep(0.05)
    return condition()


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


def test_a_program_that_forgets_the_log_still_ends_and_finishes_it(tmp_path, expected):
    path = tmp_path / "log.mcap"
    program = f"""
import sys; sys.path.insert(0, {str(TESTS)!r})
import records
from test_log import open_log
log = open_log({str(path)!r})
log.step(records.record(0))
raise SystemExit(7)
"""
    environment = {**os.environ, "PYTHONPATH": str(TESTS.parent)}
    run = subprocess.run([sys.executable, "-c", program], env=environment, timeout=30, check=False)
    assert run.returncode == 7
    assert read_log(path).complete
    assert is_prefix(path, expected) == 1


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


class FullDisk(io.FileIO):
    """A file on a disk with room for so many bytes; writes what fits, then fails as the kernel does."""

    def __init__(self, path, room):
        super().__init__(path, "xb")
        self.room = room

    def write(self, data):
        if self.room <= 0:
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))
        count = super().write(bytes(data)[: self.room])
        self.room -= count
        return count


def full_disk(room):
    return lambda path: io.BufferedWriter(FullDisk(path, room))


def log_until_failure(path, **options):
    """Step until the log fails; return the error and how many steps were accepted."""
    accepted = 0

    def run():
        nonlocal accepted
        with open_log(path, flush_steps=5, **options) as log:
            while accepted < 10_000:
                log.step(records.record(accepted % N_STEPS))
                accepted += 1
                time.sleep(0.001)

    with pytest.raises(LogError) as caught:
        run()
    return caught.value, accepted


def test_a_full_disk_stops_the_run_and_keeps_what_was_flushed(tmp_path, expected):
    room = 60_000
    path = tmp_path / "log.mcap"
    error, accepted = log_until_failure(path, opener=full_disk(room))
    assert "No space left on device" in str(error)
    assert error.exit_code == 5
    assert "recover" in error.hint
    found = is_prefix(path, expected)
    # a chunk of 5 steps takes less than a quarter of the room: all but the last one must be there
    assert 10 <= found <= accepted
    assert path.stat().st_size == room
    assert recover(path, tmp_path / "mended.mcap").steps == found


def test_a_disk_that_is_full_at_the_end_fails_finish(tmp_path, expected):
    path = tmp_path / "log.mcap"
    log = open_log(path, opener=full_disk(20_000), flush_s=60.0)
    for k in range(N_STEPS):
        log.step(records.record(k))
    with pytest.raises(LogError, match="No space left"):
        log.finish(STOP)
    is_prefix(path, expected)


def test_a_disk_too_full_to_start_leaves_nothing_behind(tmp_path):
    path = tmp_path / "log.mcap"
    with pytest.raises(LogError, match="No space left"):
        open_log(path, opener=full_disk(500))
    assert not path.exists()


@pytest.fixture
def tiny_filesystem(tmp_path):
    """A real file system of 256 KiB, where mounting one is allowed."""
    folder = tmp_path / "disk"
    folder.mkdir()
    command = ["mount", "-t", "tmpfs", "-o", "size=256k", "tmpfs", str(folder)]
    try:
        mounted = subprocess.run(command, capture_output=True, check=False).returncode == 0
    except OSError:
        mounted = False
    if not mounted:
        pytest.skip("a file system can be mounted by root only")
    yield folder
    subprocess.run(["umount", str(folder)], check=True)


def test_a_really_full_file_system_stops_the_run_and_keeps_what_was_flushed(
    tiny_filesystem, tmp_path, expected
):
    path = tiny_filesystem / "log.mcap"
    error, _ = log_until_failure(path)
    assert "No space left on device" in str(error)
    steps = [records.fingerprint(step) for step in read_log(path).steps()]
    assert len(steps) > N_STEPS
    assert all(step == expected[i % N_STEPS] for i, step in enumerate(steps))
    assert recover(path, tmp_path / "mended.mcap").steps == len(steps)
    with pytest.raises(LogError, match="cannot be written"):
        recover(path, tiny_filesystem / "mended.mcap")
    assert not (tiny_filesystem / "mended.mcap").exists()


def test_an_error_of_the_writer_thread_reaches_the_control_thread(tmp_path, monkeypatch):
    def fail(self, record):
        raise RuntimeError("cosmic ray")

    monkeypatch.setattr(McapFile, "step", fail)
    log = open_log(tmp_path / "log.mcap")
    log.step(records.record(0))
    assert wait_until(lambda: log._failure is not None)
    for call in (lambda: log.step(records.record(1)), lambda: log.event(0.0, "a", "info", "b")):
        with pytest.raises(LogError, match="cosmic ray"):
            call()
    with pytest.raises(LogError, match="cosmic ray"):
        log.finish(STOP)


def test_a_disk_that_lags_too_far_behind_is_an_error_and_never_drops(tmp_path, monkeypatch, expected):
    gate = threading.Event()
    write = McapFile.step
    monkeypatch.setattr(McapFile, "step", lambda self, record: (gate.wait(20), write(self, record)))
    monkeypatch.setattr(writer_module, "_QUEUE_MIN_STEPS", 20)
    monkeypatch.setattr(writer_module, "_QUEUE_S", 0.1)
    path = tmp_path / "log.mcap"
    accepted = 0

    def run():
        nonlocal accepted
        with open_log(path) as log:
            try:
                for k in range(N_STEPS):
                    log.step(records.record(k))
                    accepted += 1
            finally:
                gate.set()

    with pytest.raises(LogError, match="too slow"):
        run()
    assert 20 <= accepted <= 22
    assert is_prefix(path, expected) == accepted


def test_an_unpaced_run_waits_for_a_slow_disk(tmp_path, monkeypatch, expected):
    write = McapFile.step
    monkeypatch.setattr(McapFile, "step", lambda self, record: (time.sleep(0.002), write(self, record)))
    monkeypatch.setattr(writer_module, "_QUEUE_MIN_STEPS", 3)
    monkeypatch.setattr(writer_module, "_QUEUE_S", 0.0)
    path = tmp_path / "log.mcap"
    with open_log(path, wait_when_full=True) as log:
        for k in range(N_STEPS):
            log.step(records.record(k))
        log.finish(STOP)
    assert is_prefix(path, expected) == N_STEPS


def test_a_log_is_never_overwritten(whole, expected):
    before = whole.read_bytes()
    with pytest.raises(LogError, match="never overwritten") as caught:
        open_log(whole)
    assert caught.value.exit_code == 5
    assert whole.read_bytes() == before


def test_a_bad_folder_is_found_before_the_run_and_nothing_is_left(tmp_path):
    (tmp_path / "file").write_text("")
    for path in (tmp_path / "missing" / "log.mcap", tmp_path / "file" / "log.mcap"):
        with pytest.raises(LogError, match="cannot be created") as caught:
            open_log(path)
        assert caught.value.exit_code == 5
    assert [p.name for p in tmp_path.iterdir()] == ["file"]
    assert threading.active_count() == 1 or all(
        thread.name != "tcrctl-log" for thread in threading.enumerate()
    )


def test_a_finished_log_takes_nothing_more(tmp_path):
    with open_log(tmp_path / "log.mcap") as log:
        log.finish(STOP)
        for call in (lambda: log.step(records.record(0)), lambda: log.finish(STOP)):
            with pytest.raises(LogError, match="finished"):
                call()


def test_fsync_writes_the_same_log(tmp_path, expected):
    path = tmp_path / "log.mcap"
    write_steps(path, fsync=True, flush_steps=20)
    assert is_prefix(path, expected) == N_STEPS
    assert read_log(path).complete
