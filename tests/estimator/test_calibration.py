"""Laws of what is known of cameras and markers: it undoes what is wrong with them, and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from support.short_runs import short_spec
from tcrctl.config import strict_yaml
from tcrctl.errors import SpecError
from tcrctl.estimator.calibration import MarkerCalibration
from tcrctl.estimator.calibration_settings import CalibrationSettings, CameraFrameSettings
from tcrctl.experiment.spec import ExperimentSpec
from tcrctl.plant.cameras import draw_cameras
from tcrctl.plant.reality_settings import CameraSettings, FrameError
from tcrctl.robot.module import is_ring_node, node_names, ring_rows
from tcrctl.signals import Measurement

WRONG = CameraSettings(
    marker_bias_mm=1.0, frame_error=FrameError(rotation_deg=0.5, translation_mm=1.0), seed=4
)


def nodes_of(robot):
    return robot.rest.q.reshape(-1, 3)[ring_rows(robot.n_modules)]


def knowing(draw, n_modules):
    """The calibration that says what was drawn."""
    rings = [n for n in node_names(n_modules) if is_ring_node(n) and not n.startswith("base.")]
    markers = {name: tuple((1e3 * b).tolist()) for name, b in zip(rings, draw.bias, strict=True)}
    frame = CameraFrameSettings(
        rotation_deg=tuple(np.degrees(draw.rotation).tolist()),
        translation_mm=tuple((1e3 * draw.translation).tolist()),
    )
    return CalibrationSettings(frame=frame, markers_mm=markers)


def measured(nodes):
    return Measurement(0.0, nodes, np.ones(len(nodes), np.bool_), np.zeros(6))


def test_it_undoes_what_cameras_do(tcr700):
    nodes = nodes_of(tcr700)
    draw = draw_cameras(WRONG, len(nodes), 0)
    known = MarkerCalibration.of(knowing(draw, tcr700.n_modules), tcr700.n_modules)
    reported = draw.in_frame(draw.beside(nodes))
    assert np.abs(reported - nodes).max() > 1e-3
    np.testing.assert_allclose(known.corrected(measured(reported), nodes).nodes, nodes, atol=1e-9)


def test_without_a_calibration_a_frame_passes_as_it_is(tcr700):
    frame = measured(nodes_of(tcr700))
    assert MarkerCalibration.of(None, tcr700.n_modules).corrected(frame, frame.nodes) is frame


def test_a_calibration_that_says_nothing_changes_nothing(tcr700):
    frame = measured(nodes_of(tcr700))
    same = MarkerCalibration.of(CalibrationSettings(), tcr700.n_modules).corrected(frame, frame.nodes)
    np.testing.assert_allclose(same.nodes, frame.nodes, atol=1e-15)
    assert same.nodes.dtype == replace(frame).nodes.dtype


def written(path, settings):
    path.write_text(strict_yaml.dumps(settings.model_dump(mode="json", exclude_none=True)))
    return path


def test_an_experiment_takes_the_values_of_the_file_with_it(tmp_path):
    settings = CalibrationSettings(markers_mm={"m1.n1": (0.1, -0.2, 0.3)})
    path = written(tmp_path / "calibration.yaml", settings)
    spec = short_spec(f"estimator.calibration={path}").spec
    path.unlink()
    assert spec.estimator.calibrated == settings
    resolved = strict_yaml.loads(strict_yaml.dumps(spec.model_dump(mode="json")))
    assert resolved.data["estimator"]["calibration"]["markers_mm"] == {"m1.n1": [0.1, -0.2, 0.3]}


@pytest.mark.parametrize("name", ["m99.n1", "m1.apex", "base.n1", "tip"])
def test_markers_of_another_robot_are_refused(tmp_path, name):
    path = written(tmp_path / "c.yaml", CalibrationSettings(markers_mm={name: (0.0, 0.0, 1.0)}))
    with pytest.raises(SpecError, match="is no node of a moving ring"):
        short_spec(f"estimator.calibration={path}")


def test_a_file_that_is_not_there_is_named(tmp_path):
    with pytest.raises(SpecError, match=r"nowhere\.yaml"):
        short_spec(f"estimator.calibration={tmp_path / 'nowhere.yaml'}")


def test_the_resolved_values_are_read_again_as_they_are(tmp_path):
    settings = CalibrationSettings(
        frame=CameraFrameSettings(rotation_deg=(0.1, 0.2, 0.3)), markers_mm={"m1.n1": (0.1, -0.2, 0.3)}
    )
    spec = short_spec(f"estimator.calibration={written(tmp_path / 'c.yaml', settings)}").spec
    again = strict_yaml.validate(
        strict_yaml.loads(strict_yaml.dumps(spec.model_dump(mode="json"))), ExperimentSpec
    )
    assert again.estimator == spec.estimator
