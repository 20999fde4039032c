"""A study gives the same table whatever the engine, the number of workers and the interruptions."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

from support.engines import stay_here
from support.short_runs import ROOT
from support.studies import SOFT, quick_study, study_file
from tcrctl.cli.app import main
from tcrctl.executors.engine import Engine
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.unrecorded import run_unrecorded
from tcrctl.study.address import address, program
from tcrctl.study.order import Order, do
from tcrctl.study.outputs import findings
from tcrctl.study.plan import planned
from tcrctl.study.row import Row, same_every_time
from tcrctl.study.store import ROWS
from tcrctl.study.sweep import folder_of, sweep

pytestmark = pytest.mark.slow
SIX = {"vary": {SOFT: [0.8, 1.0]}, "seeds": "0..2"}


def swept(study, out, engine, **more):
    more.setdefault("logs", "none")
    return sweep(study, planned(study), engine=engine, out=out, **more)


@pytest.fixture(scope="module")
def one_by_one(tmp_path_factory):
    """The study of six runs, and its table as one process makes it."""
    folder = tmp_path_factory.mktemp("one")
    study = quick_study(folder, **SIX)
    with pytest.MonkeyPatch.context() as monkeypatch:
        stay_here(monkeypatch)
        result = swept(study, folder, Engine(1))
    assert (result.new, result.missing, result.exit_code) == (6, 0, 0)
    return study, findings(study.spec, result).table.csv()


@pytest.mark.parametrize("engine", [Engine(2), Engine(1, "local")], ids=["processes", "dask"])
@pytest.mark.filterwarnings("ignore::ResourceWarning", "ignore::DeprecationWarning")
def test_the_table_is_the_same_whatever_the_engine(engine, one_by_one, tmp_path):
    study, expected = one_by_one
    assert findings(study.spec, swept(study, tmp_path, engine)).table.csv() == expected


def test_a_row_holds_the_numbers_of_a_recorded_run_bit_for_bit(tmp_path, one_by_one):
    study, expected = one_by_one
    first = planned(study)[0]
    summary = run_experiment(prepare(study.load(first.cell), seed=first.seed), out=tmp_path)
    line = next(csv.DictReader(expected.splitlines()))
    assert float(line["position_error_mm.max"]) == summary.measures.position_error_mm["max"]
    again = run_unrecorded(prepare(study.load(first.cell), seed=first.seed))
    assert same_every_time(again.as_json()) == same_every_time(summary.as_json())


def test_started_again_a_study_does_what_is_missing_and_nothing_twice(tmp_path, one_by_one, monkeypatch):
    stay_here(monkeypatch)
    study, expected = one_by_one
    few = replace(study, spec=study.spec.model_copy(update={"seeds": (0, 2)}))
    assert swept(few, tmp_path, Engine(1)).new == 4
    told = []
    result = swept(study, tmp_path, Engine(1), told=lambda run, row: told.append(run.seed))
    assert told == [1, 1]
    assert findings(study.spec, result).table.csv() == expected
    assert swept(study, tmp_path, Engine(1)).new == 0


def command(folder, path):
    return [
        sys.executable, "-m", "tcrctl.cli.app", "sweep", str(path), "--out", str(folder), "--logs", "none",
        "--jobs", "1",
    ]  # fmt: skip


ENVIRONMENT = {**os.environ, "PYTHONPATH": f"{ROOT}:{ROOT / 'hardware'}", "OPENBLAS_NUM_THREADS": "1"}


def started(folder, path):
    silent = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL}
    return subprocess.Popen(command(folder, path), env=ENVIRONMENT, **silent)


def await_a_row(rows, process):
    before = rows.stat().st_size if rows.exists() else 0
    while process.poll() is None and (not rows.exists() or rows.stat().st_size == before):
        time.sleep(0.01)


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="asks /proc")
def test_kill_9_of_a_worker_and_of_the_study_changes_nothing_but_the_time(tmp_path, one_by_one, monkeypatch):
    _, expected = one_by_one
    path, folder = study_file(tmp_path, **SIX), tmp_path / "quick.study"
    process = started(tmp_path, path)
    await_a_row(folder / ROWS, process)
    os.kill(children(process.pid)[0], signal.SIGKILL)
    await_a_row(folder / ROWS, process)  # of another worker
    process.kill()
    assert process.wait() == -signal.SIGKILL
    assert not (folder / "table.csv").exists()
    stay_here(monkeypatch)
    assert main(["sweep", str(path), "--out", str(tmp_path), "--logs", "none", "--quiet"]) == 0
    assert (folder / "table.csv").read_text() == expected
    addresses = [json.loads(line)["address"] for line in (folder / ROWS).read_text().splitlines()]
    assert len(addresses) == len({*addresses}) == 6


def children(pid):
    """Processes whose parent is a process, but the one that only keeps track of resources."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
            words = (path.parent / "cmdline").read_text()
        except OSError:
            continue
        if int(fields[1]) == pid and "spawn_main" in words:
            found.append(int(path.parent.name))
    return found


RESULTS = {
    "good": {},
    "missed": {"criteria": ["position_error_mm.max <= 0.001"]},
    "stopped": {"safety.position_error_mm": 0.01},
    "too far": {"trajectory.plane.offset_mm": [0, 0, 600]},
}


def test_runs_that_fail_are_rows_with_their_reasons(tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    cases = {**RESULTS, "late": {"trajectory.settle_s": 3000}}
    path = study_file(tmp_path, cases=cases, timeout_s=4.0)
    assert main(["sweep", str(path), "--out", str(tmp_path), "--jobs", "1", "--json"]) == 3
    made = json.loads(capsys.readouterr().out)
    assert (made["status"], made["reason"]) == ("failed", "1 of 5 runs without a result: 1 timeout")
    assert (made["runs"], made["missing"]) == (5, 0)
    with open(made["table"]) as file:
        table = {line["case"]: line for line in csv.DictReader(file)}
    states = {case: line["status"] for case, line in table.items()}
    assert states == {
        "good": "success", "missed": "failed", "stopped": "aborted", "too far": "infeasible", "late": "timeout",
    }  # fmt: skip
    assert all(bool(line["reason"]) == (case != "good") for case, line in table.items())
    stopped = {group["levels"]["case"]: group["stopped"]["count"] for group in made["groups"]}
    assert stopped == {"good": 0, "missed": 0, "stopped": 1, "too far": 1, "late": 1}
    with open(tmp_path / "quick.study" / "times.csv") as file:
        logs = [line["log"] for line in csv.DictReader(file)]
    kept = [case for case, log in zip(cases, logs, strict=True) if log and Path(log).exists()]
    assert {"missed", "stopped"} <= {*kept} <= {"missed", "stopped", "late"}  # of those that had begun


def fallen(monkeypatch, row):
    """Every run ends like this row."""
    monkeypatch.setattr("tcrctl.study.sweep.do", lambda order: replace(row, address=order.address))


def sweeping(path, out, capsys, *more):
    """Exit code, and what is printed as JSON and on stderr."""
    code = main(["sweep", str(path), "--out", str(out), "--jobs", "1", "--json", *more])
    printed = capsys.readouterr()
    return code, json.loads(printed.out), printed.err


@pytest.mark.parametrize("status", ["crashed", "timeout", "error"])
def test_a_study_whose_runs_have_no_result_says_so_until_they_have(status, tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    path = study_file(tmp_path, seeds=[0, 1])
    with monkeypatch.context() as once:
        fallen(once, Row("", status, "why", program=program()))
        for _ in range(2):  # the second time it is in the store
            code, made, said = sweeping(path, tmp_path, capsys)
            assert (code, made["status"], made["missing"]) == (3, "failed", 0)
            assert made["reason"] == f"2 of 2 runs without a result: 2 {status}"
            assert "error: 2 of 2 runs" in said
            assert "--retry" in said
    assert made["reason"] in (tmp_path / "quick.study" / "report.html").read_text()
    code, made, said = sweeping(path, tmp_path, capsys, "--retry")
    assert (code, made["status"], made["reason"], made["new"]) == (0, "success", "", 2)
    assert "error" not in said


def test_missed_criteria_limits_and_refused_paths_are_results(tmp_path, capsys, monkeypatch):
    stay_here(monkeypatch)
    shapeless = {"plant.mismatch.springs_youngs_modulus": 1e-3}
    path = study_file(tmp_path, cases={**RESULTS, "shapeless": shapeless})
    code, made, _ = sweeping(path, tmp_path, capsys)
    assert (code, made["status"], made["reason"]) == (0, "success", "")


def test_a_dry_run_prints_the_runs_and_touches_nothing(tmp_path, capsys):
    path = study_file(tmp_path, **SIX)
    assert main(["sweep", str(path), "--dry-run", "--out", str(tmp_path / "logs")]) == 0
    printed = capsys.readouterr().out
    assert "6 runs, 6 of them to be done" in printed
    assert not (tmp_path / "logs").exists()


def test_a_drawn_path_is_the_same_for_the_same_seed_and_is_kept_in_the_row(tmp_path):
    study = quick_study(
        tmp_path,
        experiments=["fixed_point_rotation"],
        paths="random",
        set={"plant.step_ms": 10.0},
        seeds=[23],
    )
    (run,) = planned(study)
    loaded = study.load(run.cell)
    assert run.address != address(loaded, run.seed, random_path=False)
    order = Order(run.address, loaded, run.seed, True, None, "none", tmp_path, None, tmp_path)
    row = do(order)
    assert row.path["refused"] == 0  # this seed's first path is feasible, and short
    assert row.path["trajectory"]["kind"] == "waypoints"
    assert row.result["steps"] * 0.05 >= 20.0
    drawn = replace(loaded, spec=loaded.spec.model_copy(update={"trajectory": _trajectory(row)}))
    again = run_unrecorded(prepare(drawn, seed=run.seed))
    assert same_every_time(again.as_json()) == row.result


def _trajectory(row):
    from tcrctl.trajectory.pose_settings import WaypointsSettings

    return WaypointsSettings.model_validate_json(json.dumps(row.path["trajectory"]))


def test_the_folder_of_a_study_is_found_by_its_name(tmp_path):
    assert folder_of(quick_study(tmp_path), Path("x")) == Path("x/quick.study")
