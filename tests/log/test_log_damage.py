"""Every byte of a log is checked: what was changed is named, and what is whole is saved."""

from __future__ import annotations

import shutil
import struct

import numpy as np
import pytest
import zstandard
from mcap.writer import CompressionType, Writer

from support import records
from support.log_files import N_STEPS, open_log, write_steps
from support.log_mutants import accepted, chunk_starts, mutants, starts
from tcrctl.errors import LogError
from tcrctl.log import chunks
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover
from tcrctl.log.seal import SEAL, sealed, unsealed


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    """A finished log with a chunk every 15 steps: 1 + 4 chunks."""
    path = tmp_path_factory.mktemp("whole") / "log.mcap"
    write_steps(path, flush_steps=15)
    return path


def changed(whole, path, offset, value):
    data = bytearray(whole.read_bytes())
    data[offset : offset + len(value)] = value
    path.write_bytes(data)
    return path


@pytest.mark.slow
def test_no_changed_byte_or_bit_anywhere_is_accepted(whole, tmp_path):
    data = whole.read_bytes()
    for place, mutant in mutants(data, 250, np.random.default_rng(0)):
        path = tmp_path / "mutant.mcap"
        path.write_bytes(mutant)
        assert accepted(path) is None, f"byte {place} of {len(data)}"


def test_a_changed_attachment_is_named_and_left_out(whole, tmp_path):
    (offset,) = (
        at
        for at, code in starts(whole.read_bytes())
        if code == 9 and b"spec.yaml" in whole.read_bytes()[at : at + 60]
    )
    damaged = changed(whole, tmp_path / "damaged.mcap", offset + 70, b"\x00")
    with pytest.raises(LogError, match=r"attachment spec\.yaml"):
        read_log(damaged)
    result = recover(damaged, tmp_path / "mended.mcap")
    assert (result.lossy, result.steps, result.damages) == (True, N_STEPS, ("attachment spec.yaml",))
    assert set(read_log(whole).attachments) - set(read_log(tmp_path / "mended.mcap").attachments) == {
        "spec.yaml"
    }


def test_a_changed_metadata_record_is_named_also_in_a_log_that_was_never_finished(whole, tmp_path):
    data = whole.read_bytes()
    place = data.index(records.START["run_id"].encode())
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(data[: chunk_starts(data)[3]])
    assert not read_log(cut).complete
    for path in (whole, cut):
        damaged = changed(path, tmp_path / "damaged.mcap", place, b"X")
        with pytest.raises(LogError, match=r"metadata tcrctl\.run\.start"):
            read_log(damaged)


@pytest.mark.parametrize("length", [1, 200, 2**31, 2**63])
def test_a_wrong_length_of_a_chunk_costs_that_chunk_and_no_more(whole, tmp_path, length):
    middle = chunk_starts(whole.read_bytes())[2]
    damaged = changed(whole, tmp_path / "damaged.mcap", middle + 1, struct.pack("<Q", length))
    with pytest.raises(LogError, match=f"the record at byte {middle}"):
        read_log(damaged)
    result = recover(damaged, tmp_path / "mended.mcap")
    mended = read_log(tmp_path / "mended.mcap")
    assert (result.steps, result.lossy) == (45, True)
    assert [step.k for step in mended.steps()] == [k for k in range(N_STEPS) if not 15 <= k < 30]
    assert mended.stop["status"] == "success"


def test_a_wrong_length_of_the_first_attachment_costs_no_step(whole, tmp_path):
    first = next(at for at, code in starts(whole.read_bytes()) if code == 9)
    damaged = changed(whole, tmp_path / "damaged.mcap", first + 1, struct.pack("<Q", 3))
    result = recover(damaged, tmp_path / "mended.mcap")
    assert (result.steps, result.lossy) == (N_STEPS, True)
    assert len(read_log(tmp_path / "mended.mcap").attachments) == len(records.ATTACHMENTS) - 1


def test_a_wrong_kind_of_record_is_skipped(whole, tmp_path):
    middle = chunk_starts(whole.read_bytes())[2]
    for code in (0x46, 0x86, 0x07):
        damaged = changed(whole, tmp_path / "damaged.mcap", middle, bytes([code]))
        mended = tmp_path / f"{code}.mcap"
        assert recover(damaged, mended).steps == 45


def bomb(path, size, told):
    """A log whose one chunk becomes ``size`` bytes and says ``told``."""
    with path.open("wb") as stream:
        writer = Writer(stream, 2**62, CompressionType.NONE)
        writer.start(profile="", library="tcrctl/0")
        writer.add_metadata("tcrctl.run.start", {"run_id": "bomb"})
        stream.flush()
        compressor = zstandard.ZstdCompressor(level=3).compressobj()
        block, data = bytes(2**20), b""
        for _ in range(size // 2**20):
            data += compressor.compress(block)
        data += compressor.flush()
        body = struct.pack("<QQQII", 0, 0, told, 0, 4) + b"zstd" + struct.pack("<Q", len(data)) + data
        stream.write(struct.pack("<BQ", 6, len(body)) + body)
        end = struct.pack("<BQI", 0x0F, 4, 0) + struct.pack("<BQ", 2, 20)
        stream.write(end + struct.pack("<QQI", 0, 0, 0) + b"\x89MCAP0\r\n")
    return path


@pytest.mark.parametrize("told", [2**28, 1000])
def test_a_chunk_that_becomes_gigabytes_is_refused(tmp_path, told):
    path = bomb(tmp_path / "bomb.mcap", 2**28, told)
    assert path.stat().st_size < 100_000
    with pytest.raises(LogError, match=r"limit is 8388608|chunk 0"):
        list(read_log(path).steps())


def test_many_chunks_have_one_budget(whole, tmp_path, monkeypatch):
    monkeypatch.setattr(chunks, "MAX_ALL", 1000)
    monkeypatch.setattr(chunks, "MAX_RATIO", 0)
    for read in (lambda: read_log(whole), lambda: recover(whole, tmp_path / "mended.mcap")):
        with pytest.raises(LogError, match="all chunks expand to"):
            read()
    assert not (tmp_path / "mended.mcap").exists()


def test_a_seal_changes_with_name_and_entries_and_older_logs_have_none():
    entries = {"a": "1", "b": "2"}
    assert unsealed("x", sealed("x", entries)) == entries
    assert unsealed("y", sealed("x", entries)) is None
    assert unsealed("x", sealed("x", entries) | {"a": "2"}) is None
    assert unsealed("x", entries) == entries
    assert sealed("x", sealed("x", entries)) == sealed("x", entries)
    assert SEAL in sealed("x", {})


@pytest.mark.parametrize("end", ["renamed", "deleted", "replaced"])
def test_a_file_that_is_not_at_its_path_any_more_is_no_success(tmp_path, end):
    folder = tmp_path / "run"
    folder.mkdir()
    log = open_log(folder / "log.mcap")
    log.step(records.record(0))
    if end == "renamed":
        folder.rename(tmp_path / "kept")
    elif end == "deleted":
        shutil.rmtree(folder)
    else:
        (folder / "log.mcap").rename(tmp_path / "kept.mcap")
        (folder / "log.mcap").write_bytes(b"another")
    said = "lost" if end == "deleted" else "moved while it was written"
    with pytest.raises(LogError, match=f"is not there any more: .*{said}"):
        log.finish({"status": "success"})
    if end == "renamed":
        assert read_log(tmp_path / "kept" / "log.mcap").complete
