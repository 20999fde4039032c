"""The verbs that read logs: info, recover, export."""

from __future__ import annotations

import csv
import dataclasses
import json
import sys

import numpy as np
import pytest
import typer
from typer.testing import CliRunner

from support import records
from support.log_files import open_log
from support.log_mutants import starts
from tcrctl.analysis.export import export_log
from tcrctl.analysis.info import inspect
from tcrctl.analysis.result import run_result
from tcrctl.cli.export import export
from tcrctl.cli.info import info
from tcrctl.cli.recover import recover
from tcrctl.errors import DeviceError, InputError, TcrctlError
from tcrctl.log.columns import COLUMNS, meanings
from tcrctl.log.reader import read_log
from tcrctl.signals import Timing

N_STEPS = 50
SUMMARY = {
    "status": "failed",
    "criteria": [
        {
            "name": "position_error_mm.max",
            "limit": 3.0,
            "value": 1.234,
            "unit": "mm",
            "passed": True,
        },
        {
            "name": "orientation_error_deg.max",
            "limit": 2.0,
            "value": 9.876,
            "unit": "deg",
            "passed": False,
        },
    ],
}
STOP = {"status": "failed", "reason": "a criterion failed", "summary": json.dumps(SUMMARY)}
APP = typer.Typer()
for _verb in (info, recover, export):
    APP.command()(_verb)


def tcrctl(*arguments):
    """Exit code, stdout, stderr of a verb; errors map to their exit code as in the program."""
    result = CliRunner().invoke(APP, [str(argument) for argument in arguments])
    if isinstance(result.exception, TcrctlError):
        return result.exception.exit_code, result.stdout, str(result.exception)
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        raise result.exception
    return result.exit_code, result.stdout, result.stderr


@pytest.fixture
def log(tmp_path):
    path = tmp_path / "log.mcap"
    with open_log(path, flush_steps=10) as writer:
        for k in range(N_STEPS):
            writer.step(records.record(k))
        writer.event(1.0, "limit", "warning", "cable c1 slack")
        writer.finish(STOP)
    return path


@pytest.fixture
def cut(log, tmp_path):
    path = tmp_path / "cut.mcap"
    path.write_bytes(log.read_bytes()[: log.stat().st_size * 2 // 3])
    return path


def test_info_says_what_was_logged(log):
    code, out, _ = tcrctl("info", log, "--json")
    found = json.loads(out)
    timings = [records.record(k).timing for k in range(N_STEPS)]
    control = [1e3 * (timing.estimate + timing.control) for timing in timings]
    assert code == 0
    assert (found["status"], found["reason"], found["complete"]) == ("failed", "a criterion failed", True)
    assert (found["steps"], found["lost_steps"], found["overruns"]) == (N_STEPS, 0, 0)
    assert found["duration_s"] == pytest.approx(N_STEPS * records.PERIOD_S)
    assert found["rate_hz"] == pytest.approx(1 / records.PERIOD_S)
    assert found["jitter_ms"]["max"] == pytest.approx(0.0, abs=1e-9)
    assert found["control_ms"]["p50"] == pytest.approx(np.median(control))
    assert found["control_ms"]["max"] == pytest.approx(max(control))
    assert found["start"]["run_id"] == records.START["run_id"]
    assert found["criteria"] == SUMMARY["criteria"]
    assert found["events"] == {"info": 1, "warning": 1}
    assert found["attachments"] == list(records.ATTACHMENTS)


def test_info_prints_a_table_that_names_failed_criteria(log):
    code, out, _ = tcrctl("info", log)
    assert code == 0
    assert "50 at 20 Hz" in out
    assert records.START["run_id"] in out
    first, last = [line for line in out.splitlines() if "orientation_error_deg.max" in line]
    assert "FAILED: orientation_error_deg.max is 9.876 deg" in first
    assert "FAILED: 9.876 deg" in last


def test_info_measures_jitter_lateness_and_lost_steps(tmp_path):
    path = tmp_path / "log.mcap"
    lost, late = {7, 8, 20}, {3, 30}
    with open_log(path) as writer:
        for k in range(N_STEPS):
            step = records.record(k)
            if k in late:
                object.__setattr__(step, "t", step.t + 0.004)
                object.__setattr__(step.timing, "lateness", 0.104)
            if k not in lost:
                writer.step(step)
        writer.finish(STOP)
    found = inspect(path)
    assert (found.steps, found.lost_steps, found.overruns) == (N_STEPS - 3, 3, 2)
    assert found.jitter_ms is not None
    assert found.lateness_ms is not None
    assert found.jitter_ms.max == pytest.approx(4.0)
    assert found.lateness_ms.max == pytest.approx(104.0)


def paced_log(path, lateness, status="success", busy=0.0):
    """A log whose steps began so late, as a run that the clock paces writes it."""
    start = {**records.START, "realtime": "true"}
    with open_log(path, start=start) as writer:
        for k, late in enumerate(lateness):
            timing = Timing(busy, 0.002, 0.003, 0.0, late)
            writer.step(dataclasses.replace(records.record(k), timing=timing))
        writer.finish({**STOP, "status": status})
    return path


@pytest.mark.parametrize("stopped_s", [0.12, 9.0])
def test_info_tells_the_time_that_a_paced_run_took_by_the_clock(tmp_path, stopped_s):
    """Its steps' own time leaves out what was missed."""
    lateness = np.full(N_STEPS, 0.0002)
    lateness[10] = stopped_s
    found = inspect(paced_log(tmp_path / "log.mcap", lateness))
    nominal = N_STEPS * records.PERIOD_S
    assert found.duration_s == pytest.approx(nominal + stopped_s)
    assert found.rate_hz == pytest.approx((N_STEPS - 1) / (nominal - records.PERIOD_S + stopped_s), rel=1e-6)
    assert found.jitter_ms.max == pytest.approx(1e3 * stopped_s, rel=0.01)
    assert found.jitter_ms.p50 == pytest.approx(0.0, abs=1e-9)
    assert found.period_s == pytest.approx(records.PERIOD_S)
    assert found.control_ms.p50 == pytest.approx(5.0)
    assert found.overruns == 1


def test_info_tells_the_period_that_a_computer_kept_which_does_not_keep_up(tmp_path):
    lateness = np.tile([0.02, 0.04, 0.06], 20)[:N_STEPS]  # every step takes 70 ms instead of 50
    found = inspect(paced_log(tmp_path / "log.mcap", lateness, busy=0.065))
    assert found.period_s == pytest.approx(0.07)
    assert found.rate_hz == pytest.approx(1 / 0.07, rel=0.02)
    assert found.overruns == N_STEPS
    assert "100 %" in tcrctl("info", found.path)[1]


def test_a_run_that_no_clock_paced_has_no_jitter_to_tell(log):
    assert "no clock paced the run" in tcrctl("info", log)[1]


@pytest.mark.parametrize("status", ["aborted", "error"])
def test_criteria_of_a_stopped_run_are_not_passed(tmp_path, status):
    """Also in logs of versions that said so."""
    met = {"name": "overruns", "limit": 3.0, "value": 0.0, "unit": "", "passed": True}
    path = tmp_path / "log.mcap"
    with open_log(path) as writer:
        writer.step(records.record(0))
        summary = {"steps": 1, "status": status, "criteria": [met]}
        writer.finish({"status": status, "reason": "x", "summary": json.dumps(summary)})
    assert [item["passed"] for item in json.loads(tcrctl("info", path, "--json")[1])["criteria"]] == [False]
    out = tcrctl("info", path)[1]
    assert "passed" not in out
    assert "open, the run was stopped" in out
    assert run_result(read_log(path))["criteria"][0]["passed"] is False


def test_events_are_in_order_whoever_reports_them(tmp_path):
    path = tmp_path / "log.mcap"
    with open_log(path) as writer:
        for t in (0.0, 0.3, 0.1, 0.4, 0.25):
            writer.event(t, "task", "info", f"at {t}")
        writer.finish(STOP)
    events = [event for event in read_log(path).events() if event.kind == "task"]
    assert [event.t for event in events] == [0.0, 0.3, 0.3, 0.4, 0.4]
    assert [event.message for event in events] == [f"at {t}" for t in (0.0, 0.3, 0.1, 0.4, 0.25)]


def test_info_describes_an_unfinished_and_an_empty_log(cut, tmp_path):
    found = inspect(cut)
    assert (found.status, found.complete) == ("unfinished", False)
    assert 0 < found.steps < N_STEPS
    assert "tcrctl recover" in tcrctl("info", cut)[1].replace("\n", " ")
    empty = tmp_path / "empty.mcap"
    with open_log(empty) as writer:
        writer.finish(STOP)
    code, out, _ = tcrctl("info", empty, "--json")
    assert code == 0
    assert json.loads(out)["control_ms"] is None
    assert tcrctl("info", empty)[0] == 0


def test_recover_exits_3_if_lossy_and_0_if_not(log, cut, tmp_path):
    kept = sum(1 for _ in read_log(cut).steps())
    code, out, _ = tcrctl("recover", cut, "--json")
    report = json.loads(out)
    assert code == 3
    assert (report["status"], report["steps"]) == ("lossy", kept)
    assert report["log"] == str(cut.with_name("cut.recovered.mcap"))
    assert inspect(report["log"]).recovered
    assert inspect(report["log"]).steps == kept
    code, out, _ = tcrctl("recover", log, "-o", tmp_path / "copy.mcap")
    assert (code, out.strip()) == (0, str(tmp_path / "copy.mcap"))
    assert not inspect(tmp_path / "copy.mcap").recovered
    assert tcrctl("recover", log, "-o", tmp_path / "copy.mcap")[0] == 2
    assert tcrctl("recover", log, "-o", tmp_path / "missing" / "copy.mcap")[0] == 5


def test_a_csv_reads_back_as_the_logged_bits(log, tmp_path):
    out = tmp_path / "all.csv"
    code, printed, _ = tcrctl("export", log, "--csv", "--nodes", "-o", out)
    assert (code, printed.split()) == (0, [str(out), str(tmp_path / "all.events.csv")])
    with open(out, newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == N_STEPS
    for k, row in enumerate(rows):
        step = records.record(k)
        assert int(row["k"]) == k
        assert float(row["t_s"]) == step.t
        assert [
            float(row[f"estimate_position_{axis}_m"]) for axis in "xyz"
        ] == step.estimate.position.tolist()
        assert [float(row[f"applied_speed_c{i}_m_s"]) for i in (1, 2, 3)] == step.applied.speed.tolist()
        assert [float(row[f"truth_tension_c{i}_n"]) for i in (1, 2, 3)] == step.truth.tension.tolist()
        assert [row[f"info_saturated_c{i}"] for i in (1, 2, 3)] == [str(int(s)) for s in step.info.saturated]
        apex = step.estimate.q.reshape(-1, 4, 3)[2, 3]
        assert [float(row[f"estimate_q_m2_apex_{axis}_m"]) for axis in "xyz"] == apex.tolist()
        marker = step.measurement.nodes[4]
        read = np.array([row[f"measurement_nodes_m2_n2_{axis}_m"] for axis in "xyz"], dtype=np.float32)
        np.testing.assert_array_equal(read, marker)


def test_a_csv_without_nodes_is_narrow_and_has_unique_names(log, tmp_path):
    names = export_log(log, "csv", tmp_path / "narrow.csv").names
    assert len(set(names)) == len(names) < 100
    assert not any("estimate_q" in name or "ahead" in name for name in names)
    more = export_log(log, "csv", tmp_path / "ahead.csv", ahead=True).names
    assert set(more) > set(names)
    assert all(name.startswith("reference_ahead_") for name in set(more) - set(names))


def test_an_npz_holds_every_quantity_as_logged(log):
    assert tcrctl("export", log, "--npz")[0] == 0
    with np.load(log.with_suffix(".npz")) as arrays:
        assert arrays["estimate_q_m"].shape == (N_STEPS, 48)
        assert list(arrays["cable_names"]) == ["c1", "c2", "c3"]
        raw = sum(name.startswith("measurement_raw_") for name in COLUMNS)  # no camera frames in simulation
        assert len(arrays.files) == len(COLUMNS) - raw + 3 + 2 + 4  # names, errors, events
        for k in range(N_STEPS):
            step = records.record(k)
            assert arrays["truth_q_m"][k].tobytes() == step.truth.q.tobytes()
            assert arrays["measurement_nodes_m"][k].tobytes() == step.measurement.nodes.tobytes()


@pytest.mark.slow
def test_a_parquet_file_has_the_columns_and_bits_of_the_csv(log, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    assert tcrctl("export", log, "--parquet", "--nodes")[0] == 0
    table = parquet.read_table(log.with_suffix(".parquet"))
    assert tuple(table.column_names) == export_log(log, "csv", tmp_path / "all.csv", nodes=True).names
    for name, expected in (("t_s", lambda s: s.t), ("applied_speed_c2_m_s", lambda s: s.applied.speed[1])):
        assert table[name].to_pylist() == [expected(records.record(k)) for k in range(N_STEPS)]
    assert str(table.schema.field("measurement_nodes_m1_n1_x_m").type) == "float"
    assert str(table.schema.field("info_saturated_c1").type) == "bool"


def test_parquet_without_its_package_names_what_to_install(log, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(InputError, match="pyarrow") as caught:
        export_log(log, "parquet", log.with_suffix(".parquet"))
    assert "tcrctl[parquet]" in caught.value.hint
    assert not log.with_suffix(".parquet").exists()


def test_an_unfinished_log_exports_what_it_has(cut, tmp_path):
    export_log(cut, "csv", tmp_path / "cut.csv")
    with open(tmp_path / "cut.csv", newline="") as stream:
        assert len(list(csv.reader(stream))) == 1 + inspect(cut).steps


def test_export_replaces_a_file_only_when_forced(log, tmp_path):
    out = tmp_path / "precious.csv"
    out.write_text("mine")
    with pytest.raises(InputError, match="exists"):
        export_log(log, "csv", out)
    assert out.read_text() == "mine"
    assert tcrctl("export", log, "--csv", "-o", out, "--force")[0] == 0
    assert out.read_text() != "mine"
    with pytest.raises(DeviceError, match="a file, not a folder"):
        export_log(log, "csv", out / "out.csv")


@pytest.mark.parametrize("verb", [["info"], ["recover"], ["export", "--csv"]])
def test_what_cannot_be_read_exits_2(verb, tmp_path):
    text = tmp_path / "notes.txt"
    text.write_text("not a log at all")
    for path in (tmp_path / "missing.mcap", text):
        code, out, message = tcrctl(*verb, path)
        assert (code, out) == (2, "")
        assert str(path) in message
    assert sorted(tmp_path.iterdir()) == [text]


def test_every_column_is_listed_with_unit_and_meaning():
    code, out, _ = tcrctl("export", "--columns")
    listed = {line.split()[0]: line for line in out.splitlines() if line.strip()}
    assert code == 0
    assert set(COLUMNS) <= set(listed)
    assert "at the end of the horizon (m,) [N]" in " ".join(out.split())
    said = meanings()
    assert set(said) == set(COLUMNS)
    assert said["estimate_tension"] == "Cable tensions of the model (m,) [N]."
    assert [name for name in COLUMNS if not said[name] and not name.startswith(("k", "t"))] == []


def test_export_wants_one_format(log):
    assert tcrctl("export", log)[0] == 2
    assert tcrctl("export", log, "--csv", "--npz")[0] == 2


@pytest.mark.slow
@pytest.mark.parametrize("form", ["--csv", "--npz", "--parquet", "--mat"])
def test_a_log_without_steps_is_an_empty_table(form, log, tmp_path):
    data = log.read_bytes()
    path, out = tmp_path / "killed.mcap", tmp_path / "out"
    path.write_bytes(data[: next(at for at, code in starts(data) if code == 6)])
    assert tcrctl("export", path, form, "-o", out)[0] == 0
    assert out.stat().st_size > 0
    if form == "--csv":
        (head,) = csv.reader(out.read_text().splitlines())
        assert "t_s" in head
    assert tcrctl("info", path)[0] == 0
