"""Laws of a log on a disk that is full, slow, missing or broken."""

from __future__ import annotations

import errno
import io
import os
import threading
import time

import pytest

from support import records
from support.log_files import N_STEPS, STOP, doctor, is_prefix, open_log, wait_until, write_steps
from tcrctl.errors import LogError
from tcrctl.log import writer as writer_module
from tcrctl.log.mcap_file import McapFile
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover


@pytest.fixture(scope="module")
def expected():
    return [records.fingerprint(records.record(k)) for k in range(N_STEPS)]


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished log with a chunk every 8 steps."""
    path = tmp_path_factory.mktemp("whole") / "log.mcap"
    write_steps(path, flush_steps=8)
    return path


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


@pytest.mark.slow
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
    assert path.stat().st_size <= room
    assert "No space left on device" in read_log(path).stop["reason"]
    assert not read_log(path).complete
    mended = recover(path, tmp_path / "mended.mcap")
    assert (mended.steps, mended.lossy) == (found, True)
    assert read_log(mended.path).complete
    assert doctor(mended.path).returncode == 0


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


@pytest.mark.slow
def test_a_really_full_file_system_stops_the_run_and_keeps_what_was_flushed(
    tiny_filesystem, tmp_path, expected
):
    path = tiny_filesystem / "log.mcap"
    error, _ = log_until_failure(path)
    assert "No space left on device" in str(error)
    steps = [records.fingerprint(step) for step in read_log(path).steps()]
    assert len(steps) > N_STEPS
    assert all(step == expected[i % N_STEPS] for i, step in enumerate(steps))
    assert read_log(path).stop["status"] == "error"
    assert "No space left on device" in read_log(path).stop["reason"]
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
    assert read_log(log.path).complete
    assert read_log(log.path).stop["reason"] == "writing failed: cosmic ray"


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
