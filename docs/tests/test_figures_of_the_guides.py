"""Figures that the guides give, measured again; a minute."""

from __future__ import annotations

import numpy as np
import pytest
import yaml

from tcrctl.config import shipped
from tcrctl.experiment.prepare import make_trajectory, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.robot.robot import build_robot


def errors(spec, out):
    """Errors of the end position [mm] of a whole run."""
    return run_experiment(prepare(load_spec(str(spec))), out=out).measures.position_error_mm


def test_a_letter_from_samples_at_20_hz_has_the_errors_of_its_strokes_within_5_per_cent(tmp_path):
    loaded = load_spec("letter_t")
    strokes = make_trajectory(loaded.spec, build_robot(loaded.robot))
    t = np.arange(0.0, strokes.duration + 1e-9, 0.05)
    rows = np.column_stack((t, 1e3 * strokes.position(t)))
    np.savetxt(
        tmp_path / "letter.csv", rows, fmt="%.9g", delimiter=",", header="t_s,x_mm,y_mm,z_mm", comments=""
    )
    experiment = yaml.safe_load(shipped.experiments()["letter_t"].read_text())
    experiment["trajectory"] = {"kind": "table", "file": "letter.csv", "lead_in_s": 0, "settle_s": 0}
    (tmp_path / "letter.yaml").write_text(yaml.safe_dump(experiment))
    found, wanted = (errors(spec, tmp_path / "runs") for spec in (tmp_path / "letter.yaml", "letter_t"))
    assert found == pytest.approx(wanted, rel=0.05)
