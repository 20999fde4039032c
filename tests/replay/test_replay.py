"""Laws of replay: the same input gives the same bits, and whatever was changed is found where it was changed."""

from __future__ import annotations

import functools
import json
import math
from dataclasses import replace

import numpy as np
import pytest
from mcap.reader import make_reader

from support.log_files import doctor
from support.short_runs import short_spec
from tcrctl.cli.app import main
from tcrctl.config import strict_yaml
from tcrctl.controller.prediction_settings import MultiStepSettings
from tcrctl.errors import InputError, LogError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import log_geometry, run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.comparison import Comparison, Difference, quantities
from tcrctl.log.file_names import RESOLVED
from tcrctl.log.mcap_file import Opening
from tcrctl.log.reader import read_log
from tcrctl.log.recover import recover
from tcrctl.log.writer import LogWriter
from tcrctl.replay.figure import WhatIf
from tcrctl.replay.replay import replay
from tcrctl.replay.result import Tolerance, Window

pytestmark = pytest.mark.slow

VARIANTS = {
    "full": ("controller.settle_s=0",),  # W is the controller's own from the first step on
    "often_flushed": ("log.flush_steps=10", "log.flush_s=0.1"),
    "lean": ("log.full_state_s=0.5",),
    "literal": ("controller.prediction=literal", "controller.integral=off"),
    "one_step": ("controller.prediction={kind: one_step, horizon_s: 0.4}",),
    "exact": ("estimator={kind: exact}", "log.full_state_s=0.5"),
    "two_rings": ("plant.measured_rings=[4, 8, 11]",),
    "saturated": ("controller.speed_limit_mm_s=4",),
    "stopped": ("safety.position_error_mm=0.2",),
    "markers left out": ("plant.cameras.outliers={share: 0.05, size_mm: 30}",),
    "learnt gain": ("controller.prediction.rest_gain={}",),
    "held": ("plant.cameras.outliers={share: 0.15, size_mm: 60}", "safety.picture.least_share=0.7"),
}
BEFORE = (
    "controller.dither=off",
    "controller.drives.lag_s=0.0",
    "controller.settle_s=0.0",
    "estimator={kind: passive_observer, fit_start: false, hold_blank: false}",
)
#: Estimator and controller as they were before the keys that a log of then does not have.
FORMER = {
    "multi_step": (
        *BEFORE,
        "controller.prediction.tension_gap=off",
        "controller.prediction.hole_drag=off",
        "controller.prediction.rest_gain=off",
        "controller.prediction.offset.from_start=false",
    ),
    "literal": (*BEFORE, *VARIANTS["literal"]),
    "one_step": (*BEFORE, *VARIANTS["one_step"]),
}
REST_SHORT = [f"trajectory.{key}_s=0.5" for key in ("blend_in", "blend_out", "lead_in", "dwell", "settle")]


@pytest.fixture(scope="module")
def logs(tmp_path_factory):
    """A short run of every variant, by name."""
    folder, made = tmp_path_factory.mktemp("runs"), {}

    def log(name):
        if name not in made:
            overrides = FORMER[name.removeprefix("former ")] if name.startswith("former") else VARIANTS[name]
            made[name] = run_experiment(prepare(short_spec(*overrides)), out=folder).log
        return made[name]

    return log


@functools.cache
def geometry():
    return log_geometry(prepare(short_spec()).robot)


def rewritten(path, out, change=lambda step: step, attachments=None):
    """Copy of a log with changed steps (None leaves one out) or attachments, every checksum in the file right."""
    log = read_log(path)
    writer = LogWriter(
        out,
        Opening(
            attachments={**log.attachments, **(attachments or {})},
            start=log.start,
            geometry=geometry(),
            epoch_ns=int(log.start["epoch_ns"]),
            period_s=0.05,
        ),
        wait_when_full=True,
    )
    with writer:
        for step in log.steps():
            changed = change(step)
            if changed is not None:
                writer.step(changed)
        writer.finish(log.stop)
    return out


def flipped(array, byte, bit=0):
    """Copy of an array with one bit changed."""
    data = bytearray(array.tobytes())
    data[byte] ^= 1 << bit
    return np.frombuffer(bytes(data), array.dtype).reshape(array.shape).copy()


@pytest.mark.parametrize("name", VARIANTS)
def test_every_kind_of_run_replays_bit_for_bit(logs, name):
    path = logs(name)
    found = replay(path)
    steps = sum(1 for _ in read_log(path).steps())
    assert (found.status, found.reason) == ("identical", "")
    assert (found.steps, found.compared, found.different, found.exit_code) == (steps, steps, 0, 0)
    assert (found.environment, found.not_compared) == ((), ())


def test_steps_in_which_the_picture_was_in_doubt_are_recorded_as_such(logs):
    whole, left, held = ([*read_log(logs(name)).steps()] for name in ("full", "markers left out", "held"))
    assert all(step.measurement.valid.all() for step in whole)
    assert not all(step.measurement.valid.all() for step in left)
    reasons = [step.info.reason for step in held]
    assert any(reason.startswith("held: ring ") for reason in reasons)
    for step, reason in zip(held, reasons, strict=True):
        assert not reason.startswith("held: ") or not step.applied.speed.any()


#: Keys of a prediction that did not exist.
NEW = {"tension_gap", "hole_drag", "rest_gain"}


def as_before(settings, beside):
    """Resolved settings without the keys that did not exist; also with a prediction's keys beside it."""
    controller = {
        key: value for key, value in settings["controller"].items() if key not in ("dither", "drives")
    }
    prediction = {key: value for key, value in controller["prediction"].items() if key not in NEW}
    if "offset" in prediction:
        prediction["offset"] = {"filter_s": prediction["offset"]["filter_s"]}
    controller["prediction"] = prediction
    if beside:
        every = MultiStepSettings(kind="multi_step").model_dump(mode="json", exclude=NEW)
        every["offset"].pop("from_start")
        controller = {**controller, **every, **prediction, "kind": "ioc", "prediction": prediction["kind"]}
    estimator = {k: v for k, v in settings["estimator"].items() if k not in ("fit_start", "hold_blank")}
    return {**settings, "controller": controller, "estimator": estimator}


@pytest.mark.parametrize("beside", [False, True])
@pytest.mark.parametrize("name", FORMER)
def test_a_log_with_the_settings_of_an_older_version_replays_bit_for_bit(logs, tmp_path, name, beside):
    """What it could not say was not there; once all keys of a prediction stood beside it, with a meaning or not."""
    path = logs(f"former {name}")
    settings = as_before(strict_yaml.loads(read_log(path).attachments[RESOLVED][1]).data, beside)
    attachments = {RESOLVED: ("application/yaml", strict_yaml.dumps(settings).encode())}
    assert replay(rewritten(path, tmp_path / "old.mcap", attachments=attachments)).status == "identical"


def test_the_variants_are_what_they_claim(logs):
    assert read_log(logs("stopped")).stop["status"] == "aborted"
    assert any(step.info.saturated.any() for step in read_log(logs("saturated")).steps())
    sizes = [step.estimate.q.size for step in read_log(logs("lean")).steps()]
    assert sizes.count(0) > 5 * (len(sizes) - sizes.count(0)) > 0
    assert all(step.estimate.q.size for step in read_log(logs("exact")).steps())


@pytest.mark.parametrize("name", ["full", "lean"])
@pytest.mark.parametrize("what", ["nodes", "valid", "drive"])
def test_one_changed_byte_of_a_measurement_is_found_in_its_step(logs, tmp_path, name, what):
    def change(step):
        if step.k != 21:
            return step
        array = flipped(getattr(step.measurement, what), 4)
        return replace(step, measurement=replace(step.measurement, **{what: array}))

    path = rewritten_bytes(logs(name), tmp_path / "changed.mcap", change)
    found = replay(path)
    assert (found.status, found.exit_code) == ("different", 3)
    assert found.first_difference.step == 21
    assert found.reason.startswith("step 21: ")


def rewritten_bytes(path, out, change):
    """As ``rewritten``, but the steps keep the checksums they were recorded with, as after a change on disk."""
    from tcrctl.log import steps as codec

    recorded = {step.k: step.checksums for step in read_log(path).steps()}
    original = codec.checksums
    codec.checksums = lambda step: recorded[step.k]
    try:
        return rewritten(path, out, change)
    finally:
        codec.checksums = original


def test_a_change_of_a_marker_that_nobody_saw_is_found_by_its_checksum(logs, tmp_path):
    def change(step):
        if step.k != 7:
            return step
        assert not step.measurement.valid[0]
        nodes = flipped(step.measurement.nodes, 0)
        return replace(step, measurement=replace(step.measurement, nodes=nodes))

    found = replay(rewritten_bytes(logs("two_rings"), tmp_path / "changed.mcap", change))
    assert found.first_difference.step == 7
    assert found.first_difference.field == "checksums.given"
    assert found.different == 1


def test_a_reference_changed_by_one_ulp_is_found(logs, tmp_path):
    def change(step):
        ahead = step.reference.ahead_position.copy()
        if step.k == 9:
            ahead[3, 1] = np.nextafter(ahead[3, 1], 1.0)
        return replace(step, reference=replace(step.reference, ahead_position=ahead))

    found = replay(rewritten_bytes(logs("full"), tmp_path / "changed.mcap", change))
    assert (found.status, found.first_difference.step) == ("different", 9)


def test_a_weight_changed_by_1e_12_is_found_in_the_attachment_as_with_set(logs, tmp_path):
    path = logs("full")
    text = read_log(path).attachments[RESOLVED][1]
    changed = text.replace(b"speed_change: 220.0", b"speed_change: 220.00000000022")
    assert changed != text
    in_file = replay(
        rewritten(path, tmp_path / "a.mcap", attachments={RESOLVED: ("application/yaml", changed)})
    )
    by_hand = replay(path, overrides=["controller.weights.speed_change=220.00000000022"])
    assert in_file.first_difference == by_hand.first_difference
    assert in_file.first_difference.field.startswith("wanted.speed[")
    assert in_file.first_difference.step == 0
    assert 0 < in_file.first_difference.ulps < 1e6
    assert (in_file.exit_code, by_hand.exit_code) == (3, 3)


def test_a_replay_needs_no_file_but_the_log(logs, tmp_path, monkeypatch):
    path = rewritten(logs("full"), tmp_path / "copy.mcap")
    monkeypatch.setattr(
        "tcrctl.config.shipped.find_robot", lambda *arguments: pytest.fail("looked for a robot file")
    )
    monkeypatch.setattr("tcrctl.config.strict_yaml.read", lambda path: pytest.fail(f"read {path}"))
    assert replay(path).status == "identical"


def test_a_rig_log_without_truth_replays(logs, tmp_path):
    path = rewritten(logs("full"), tmp_path / "rig.mcap", lambda step: replace(step, truth=None))
    assert replay(path).status == "identical"


def test_a_cut_log_replays_as_far_as_it_goes(logs, tmp_path):
    whole = logs("often_flushed")
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    found = replay(cut)
    assert (found.status, found.exit_code) == ("incomplete", 0)
    assert "unfinished" in found.reason
    assert 0 < found.compared == found.steps < replay(whole).steps
    recover(cut, tmp_path / "mended.mcap")
    mended = replay(tmp_path / "mended.mcap")
    assert (mended.status, mended.compared) == ("identical", found.compared)


def test_what_comes_after_a_gap_is_not_replayed(logs, tmp_path):
    path = rewritten(logs("full"), tmp_path / "gap.mcap", lambda step: None if step.k in (10, 11) else step)
    found = replay(path)
    assert (found.status, found.steps, found.exit_code) == ("incomplete", 10, 3)
    assert "steps from 10 on are missing" in found.reason


def test_a_window_is_compared_and_the_steps_before_it_are_replayed(logs):
    found = replay(logs("full"), window=Window(10, 19))
    assert (found.status, found.steps, found.compared) == ("identical", 20, 10)
    later = replay(logs("full"), window=Window(10, 19), overrides=["controller.weights.speed_change=7e3"])
    assert (later.first_difference.step, later.compared) == (10, 10)
    beyond = replay(logs("full"), window=Window(10_000, None))
    assert (beyond.status, beyond.compared, beyond.exit_code) == ("incomplete", 0, 3)


def test_what_if_tells_how_far_every_quantity_differs_and_writes_a_log(logs, tmp_path):
    path, out = logs("full"), tmp_path / "softer.mcap"
    overrides = ["controller.weights.speed_change=7e3"]
    found = replay(path, overrides=overrides, out=out)
    recorded, replayed = list(read_log(path).steps()), list(read_log(out).steps())
    apart = np.array([b.wanted.speed - a.wanted.speed for a, b in zip(recorded, replayed, strict=True)])
    deviation = next(item for item in found.deviations if item.field == "wanted.speed")
    assert deviation.largest == np.abs(apart).max()
    assert deviation.rms == pytest.approx(
        math.sqrt(np.mean(apart[np.any(apart != 0, axis=1)] ** 2)), rel=1e-12
    )
    assert deviation.first_step == np.flatnonzero(apart.any(axis=1))[0]
    assert not any(item.field.startswith("estimate") for item in found.deviations)
    assert doctor(out).returncode == 0
    assert read_log(out).start["replayed_from"] == str(path)
    # the new log holds the new settings, so it replays to itself
    assert replay(out).status == "identical"
    with pytest.raises(LogError, match="never overwritten"):
        replay(path, out=out)


def test_a_longer_horizon_gets_its_references_from_the_trajectory(logs):
    found = replay(logs("full"), overrides=["controller.prediction.horizon_s=0.9"])
    fields = {item.field: item for item in found.deviations}
    assert found.status == "different"
    assert fields["reference.ahead_position"].largest < 0.01
    assert "reference.position" not in fields or fields["reference.position"].largest < 1e-15
    assert fields["wanted.speed"].largest > 0.0


def test_a_tolerance_forgives_small_differences_only(logs):
    overrides = ["controller.weights.speed_change=220.00000000022"]
    assert replay(logs("full"), overrides=overrides, tolerance=Tolerance(atol=1e-9)).status == "identical"
    assert replay(logs("full"), overrides=overrides, tolerance=Tolerance(rtol=1e-18)).status == "different"
    coarse = Tolerance(1e-9, 1e-9)
    large = replay(logs("full"), overrides=["controller.weights.speed_change=7e3"], tolerance=coarse)
    assert large.status == "different"


@pytest.mark.parametrize(
    ("override", "part"),
    [
        ("plant.noise_um=1", "only controller, estimator, safety"),
        ("controller.period_s=0.1", "controller.period_s"),
        ("estimator={kind: exact}", "log.full_state_s"),
        ("controller.wieghts.speed=1", "did you mean weights"),
    ],
)
def test_what_cannot_be_replayed_is_an_error_with_a_reason(logs, override, part):
    with pytest.raises(InputError, match=r"(?s).*") as caught:
        replay(logs("lean"), overrides=[override])
    assert part in str(caught.value) + caught.value.hint


def test_a_log_without_its_experiment_says_what_is_missing(logs, tmp_path):
    from support.log_files import open_log

    with open_log(tmp_path / "bare.mcap") as log:
        log.finish({"status": "success"})
    with pytest.raises(InputError, match=r"no attachment robot\.yaml"):
        replay(tmp_path / "bare.mcap")


def test_differences_of_bits_are_seen_where_values_are_equal():
    from support.records import record

    a, b = record(1), record(1)
    a.wanted.speed[:] = 0.0
    b.wanted.speed[:] = [0.0, -0.0, 0.0]
    comparison = Comparison(quantities())
    comparison.add(a, b)
    assert comparison.first == Difference(1, "wanted.speed[1]", 0.0, -0.0, 1)
    a.wanted.speed[:] = b.wanted.speed[:] = np.nan
    same = Comparison(quantities())
    same.add(a, b)
    assert same.first is None


def test_ulps_count_the_numbers_between():
    from tcrctl.log.comparison import ulps

    assert ulps(1.0, math.nextafter(1.0, 2.0)) == 1
    assert ulps(5e-324, -5e-324) == 3  # -0.0 and 0.0 lie between
    assert ulps(1.0, 2.0) == 2**52
    assert ulps(1.0, math.inf) is None
    assert ulps(True, False) is None


def test_the_command_prints_one_object_and_exits_0_or_3(logs, capsys):
    path = str(logs("full"))
    assert main(["replay", path, "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert found["status"] == "identical"
    assert found["first_difference"] is None
    assert found["steps"] == found["compared"] > 0
    change = ["--set", "controller.weights.speed_change=220.00000000022"]
    assert main(["replay", path, "--json", *change]) == 3
    found = json.loads(capsys.readouterr().out)
    first = found["first_difference"]
    assert set(first) == {"step", "field", "recorded", "replayed", "ulps"}
    assert first["step"] == 0
    assert main(["replay", path, *change]) == 3
    printed = capsys.readouterr()
    speed = next(item for item in found["deviations"] if item["field"] == "wanted.speed")
    step, most = speed["first_step"], f"{1e3 * speed['max']:.4g} mm/s"
    said = f"different: the command would differ from step {step} on by at most {most}"
    assert said in " ".join(printed.out.split())
    assert "wanted.drive" in printed.out
    assert main(["replay", path, "--from", "5", "--to", "2"]) == 2


def test_a_what_if_can_be_drawn(logs, tmp_path, capsys):
    path, change = str(logs("full")), ["--set", "controller.weights.speed_change=7e3"]
    picture = tmp_path / "what_if.png"
    assert main(["replay", path, *change, "--plot", str(picture)]) == 3
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert main(["replay", path, *change, "--plot", str(picture)]) == 2
    assert main(["replay", path, *change, "--plot", str(tmp_path / "what_if.doc")]) == 2
    assert ".pdf" in capsys.readouterr().err
    drawing = WhatIf()
    replay(path, overrides=change[1:], watch=drawing.add)
    recorded = [1e3 * step.wanted.speed[2] for step in read_log(path).steps()]
    above, below = drawing.figure().axes
    np.testing.assert_array_equal(above.lines[4].get_ydata(), recorded)
    apart = above.lines[5].get_ydata() - above.lines[4].get_ydata()
    np.testing.assert_array_equal(below.lines[2].get_ydata(), apart)
    assert np.abs(apart).max() > 0.0


def test_pose_control_at_100_hz_replays_and_takes_less_than_100_kb_per_second(tmp_path):
    settings = ["controller.period_s=0.01", "trajectory.turns=0.1", "trajectory.ramp_s=0.5", *REST_SHORT]
    summary = run_experiment(prepare(load_spec("cone_frustum", settings)), out=tmp_path)
    assert replay(summary.log).status == "identical"
    with open(summary.log, "rb") as stream:
        chunks = make_reader(stream).get_summary().chunk_indexes[1:-1]
    size = sum(chunk.chunk_length + chunk.message_index_length for chunk in chunks)
    seconds = 1e-9 * (chunks[-1].message_end_time - chunks[0].message_start_time)
    assert seconds > 1.0
    assert size / seconds < 100e3


def test_other_versions_are_told_before_anything_else(logs, tmp_path, capsys):
    path = logs("full")
    versions = json.loads(read_log(path).attachments["versions.json"][1])
    versions |= {"numpy": "1.0.0", "cpu": "z80"}
    attached = {"versions.json": ("application/json", json.dumps(versions).encode())}
    old = rewritten(path, tmp_path / "old.mcap", attachments=attached)
    assert main(["replay", str(old), "--json"]) == 0
    printed = capsys.readouterr()
    assert "numpy was 1.0.0" in printed.err
    assert "cpu was z80" in printed.err
    assert {item["name"] for item in json.loads(printed.out)["environment"]} == {"numpy", "cpu"}
