"""Nothing is compiled, or loaded, in a run: a drive that is not written to for that long stops for good."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

SCRIPT = """
import sys
from pathlib import Path
from numba.core.registry import CPUDispatcher
import tcrctl.experiment.run as run
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.spec import load_spec

def kernels():
    found = {}
    for name, module in list(sys.modules.items()):
        if name.startswith("tcrctl."):
            for key, value in vars(module).items():
                if isinstance(value, CPUDispatcher) and len(value.overloads):
                    found[f"{value.py_func.__module__}.{value.py_func.__qualname__}"] = len(value.overloads)
    return found

experiment = prepare(load_spec(sys.argv[1], sys.argv[2:]))
before, at_start = kernels(), {}
inner = run.run_loop
def watched(parts):
    at_start.update(kernels())
    return inner(parts)
run.run_loop = watched
run.run_experiment(experiment, out=Path.cwd())
late = {name for name, count in kernels().items() if at_start.get(name, 0) != count}
print(len(before), *sorted(late))
"""
#: Simulated things that no bench has: they are loaded when they are needed.
ONLY_SIMULATED = {"tcrctl.plant.creep._grow", "tcrctl.plant.spring_hysteresis._give_way"}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["letter_t", "fixed_point_rotation"])
def test_a_run_with_lost_markers_and_friction_compiles_nothing(name, tmp_path):
    options = ["plant.realistic=moderate", "plant.step_ms=5", "criteria=[]"]
    done = subprocess.run(
        [sys.executable, "-c", SCRIPT, name, *options],
        cwd=tmp_path,
        env={**os.environ, "NUMBA_OPT": "1"},
        capture_output=True,
        text=True,
        check=True,
    )
    count, *late = done.stdout.split()
    assert int(count) > 10
    assert set(late) <= ONLY_SIMULATED
