"""The comparison of two versions' runs: everything counts but what belongs to one run."""

from __future__ import annotations

import importlib.util
import json
import sys
from pathlib import Path

import pytest

SCRIPT = Path(__file__).parents[1] / "benchmarks" / "compare_runs.py"
RESULT = {
    "run_id": "a",
    "control_ms": {"p50": 1.0},
    "error": {"max": 0.1},
    "task": [{"seen": True, "at": None}],
}


@pytest.fixture
def compare(tmp_path, monkeypatch, capsys):
    """Compare folders with these results; returns exit code and table."""
    spec = importlib.util.spec_from_file_location("compare_runs", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)

    def compare(before, after):
        for side, results in (("before", before), ("after", after)):
            (tmp_path / side).mkdir()
            for name, result in results.items():
                (tmp_path / side / f"{name}.json").write_text(json.dumps(result))
        monkeypatch.setattr(
            sys, "argv", ["compare_runs.py", str(tmp_path / "before"), str(tmp_path / "after")]
        )
        return module.main(), capsys.readouterr().out

    return compare


def test_times_and_names_of_runs_do_not_count(compare):
    code, said = compare({"x": RESULT}, {"x": {**RESULT, "run_id": "b", "control_ms": {"p50": 2.0}}})
    assert code == 0
    assert "| x | 3 | identical |" in said


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"error": {"max": 0.10000000000000002}}, "error.max: 0.1 -> 0.10000000000000002"),
        ({"task": [{"seen": True}]}, "task.0.at: null -> absent"),
        ({"new": 1}, "new: absent -> 1"),
    ],
)
def test_one_bit_counts(compare, change, said):
    code, table = compare({"x": RESULT}, {"x": {**RESULT, **change}})
    assert code == 1
    assert f"1 differ, the first: {said}" in table


def test_a_missing_experiment_counts(compare):
    code, table = compare({"x": RESULT, "y": RESULT}, {"x": RESULT})
    assert code == 1
    assert "| y | 3 | missing after |" in table
