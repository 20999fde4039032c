"""Laws of lean steps: input bit for bit, digests of what is left out, and a small file."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from support import records
from support.log_files import STOP, doctor, open_log
from tcrctl.errors import LogError
from tcrctl.log.checksums import checksums
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover
from tcrctl.log.steps import StepDecoder, StepEncoder, from_planes, planes, unzigzag, zigzag

N_STEPS, FULL_EVERY, FLUSH = 45, 10, 7
LEFT_OUT = {
    "estimate": ("q", "v", "disturbance"),
    "info": ("predicted_tension", "integral"),
    "truth": ("q",),
}
ROUNDED = {"truth": ("position", "normal", "tension"), "timing": tuple(records.Timing.__dataclass_fields__)}
INT32 = st.integers(-(2**31), 2**31 - 1)


@pytest.fixture(scope="module")
def lean(tmp_path_factory):
    path = tmp_path_factory.mktemp("lean") / "log.mcap"
    with open_log(path, flush_steps=FLUSH, flush_s=60.0, full_state_s=FULL_EVERY * records.PERIOD_S) as log:
        for k in range(N_STEPS):
            log.step(records.record(k))
        log.finish(STOP)
    return path


def lean_parts(step):
    """Fingerprint of what a lean step must keep bit for bit."""
    found = records.fingerprint(step)
    for part, names in (*LEFT_OUT.items(), *ROUNDED.items()):
        for name in names:
            found[part].pop(name)
    return found


@given(st.lists(INT32, min_size=3, max_size=30))
def test_zigzag_and_planes_can_be_undone(numbers):
    array = np.array(numbers, np.int32)
    np.testing.assert_array_equal(unzigzag(zigzag(array)), array)
    np.testing.assert_array_equal(from_planes(planes(array)), array)


@pytest.mark.slow
@given(records.steps(), records.steps(), st.booleans())
@settings(max_examples=30)
def test_lean_steps_keep_arbitrary_input_bit_for_bit(first, second, same_markers):
    first = dataclasses.replace(first, k=1)
    second = dataclasses.replace(second, k=2)
    if same_markers:
        second = dataclasses.replace(second, measurement=first.measurement)
    encoder, decoder = StepEncoder(10), StepDecoder()
    for step in (first, second):
        found = decoder.decode(encoder.encode(step))
        if step.truth is None:
            assert found.truth is None
            empty = records.Truth(*[np.zeros(0)] * 4)
            step, found = (dataclasses.replace(each, truth=empty) for each in (step, found))
        assert lean_parts(found) == lean_parts(step)


def test_every_nth_step_is_full_and_the_others_keep_all_but_the_state(lean):
    steps = list(read_log(lean).steps())
    assert [step.k for step in steps] == list(range(N_STEPS))
    for step in steps:
        written = records.record(step.k)
        assert step.checksums == checksums(written)
        if step.k % FULL_EVERY == 0:
            assert records.fingerprint(step) == records.fingerprint(written)
            continue
        assert lean_parts(step) == lean_parts(written)
        for part, names in LEFT_OUT.items():
            assert all(getattr(getattr(step, part), name).size == 0 for name in names)
        for part, names in ROUNDED.items():
            for name in names:
                was, now = (getattr(getattr(each, part), name) for each in (written, step))
                np.testing.assert_allclose(now, was, rtol=2**-24, atol=0)


def test_columns_of_a_lean_log_have_nan_where_there_is_no_state(lean):
    columns = read_log(lean).columns()
    full = np.arange(N_STEPS) % FULL_EVERY == 0
    for name in ("estimate_q", "truth_q"):
        np.testing.assert_array_equal(np.isfinite(columns[name]).all(axis=1), full)
    assert np.isfinite(columns["estimate_position"]).all()
    assert np.isfinite(columns["measurement_nodes"]).all()


@pytest.mark.slow
def test_a_chunk_of_lean_steps_can_be_read_without_the_others(lean, tmp_path):
    data = bytearray(lean.read_bytes())
    start = -1
    for _ in range(3):
        start = data.index(b"\x04\x00\x00\x00zstd", start + 1)
    data[start + 200] ^= 0xFF
    damaged, mended = tmp_path / "damaged.mcap", tmp_path / "mended.mcap"
    damaged.write_bytes(data)
    with pytest.raises(LogError, match="damaged"):
        list(read_log(damaged).steps())
    recover(damaged, mended)
    found = list(read_log(mended).steps())
    lost = set(range(N_STEPS)) - {step.k for step in found}
    assert len(lost) == FLUSH
    assert all(lean_parts(step) == lean_parts(records.record(step.k)) for step in found)
    assert doctor(mended).returncode == 0


def test_a_lean_step_whose_predecessor_is_missing_is_not_invented():
    encoder = StepEncoder(100)
    data = [encoder.encode(records.record(k)) for k in range(1, 5)]
    decoder = StepDecoder()
    assert decoder.decode(data[0]) is not None
    assert decoder.decode(data[2]) is None
    assert decoder.decode(data[3]) is None


def test_any_changed_bit_of_the_input_or_the_state_changes_a_checksum():
    step, rng = records.record(3), np.random.default_rng(0)
    before = checksums(step)
    for path in ("measurement.nodes", "measurement.valid", "measurement.drive", "reference.ahead_position"):
        part, name = path.split(".")
        array = getattr(getattr(step, part), name)
        flat = array.reshape(-1).view(np.uint8)
        i, bit = rng.integers(flat.size), 1 if array.dtype == np.bool_ else 1 << rng.integers(8)
        flat[i] ^= bit
        after = checksums(step)
        assert (after.given != before.given, after.state) == (True, before.state)
        flat[i] ^= bit
    step.estimate.v[7] = np.nextafter(step.estimate.v[7], 1.0)
    assert checksums(step).state != before.state


def test_a_lean_step_is_less_than_a_third_of_a_full_one(lean, tmp_path):
    full = tmp_path / "full.mcap"
    with open_log(full, flush_steps=FLUSH, flush_s=60.0) as log:
        for k in range(N_STEPS):
            log.step(records.record(k))
        log.finish(STOP)
    step = records.record(1, 13, 6)
    assert len(StepEncoder(10).encode(step)) < 0.3 * len(StepEncoder(1).encode(step))
    assert lean.stat().st_size < full.stat().st_size
