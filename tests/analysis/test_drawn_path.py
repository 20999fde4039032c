"""A path is seen across its plane; pen-up travel is told from strokes; runs share a reference only if they do."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from support import records
from support.log_files import STOP, open_log
from tcrctl.analysis.history import read_histories
from tcrctl.analysis.pen import pen_down
from tcrctl.analysis.plane import plane_of
from tcrctl.analysis.references import shared
from tcrctl.experiment import provenance
from tcrctl.experiment.spec import load_spec


def history(folder, wanted, spec=None):
    """A run whose end shall go along ``wanted`` (n, 3) [m]."""
    files = {} if spec is None else provenance.attachments(load_spec(spec), load_spec(spec).spec)
    with open_log(folder / f"{len(list(folder.iterdir()))}.mcap", attachments=files) as log:
        for k, position in enumerate(wanted):
            made = records.record(k)
            reference = dataclasses.replace(made.reference, position=np.array(position, float), normal=None)
            log.step(dataclasses.replace(made, reference=reference))
        log.finish(STOP)
    (found,) = read_histories([max(folder.glob("*.mcap"), key=lambda path: int(path.stem))])
    return found


def test_only_what_lies_on_a_stroke_is_drawn(tmp_path):
    trajectory = load_spec("letter_t").spec.trajectory
    start, rise = np.array([0.01, -0.02, -0.5]), 1e-3 * np.array(trajectory.plane.offset_mm)
    way = 1e-3 * np.array([[-15, 20, 0], [-30, 40, 0], [15, 40, 0], [0, -20, 0], [20, -20, 0]])
    down = pen_down(history(tmp_path, [start, *(start + rise + way)], "letter_t"))
    assert down[1:].tolist() == [False, True, True, True, False]


def test_what_is_no_drawing_is_drawn_whole(tmp_path):
    assert pen_down(history(tmp_path, np.zeros((4, 3)))).all()
    assert pen_down(history(tmp_path, np.zeros((4, 3)), "box_scan")).all()


@pytest.mark.parametrize(("flat", "name"), [(2, "from above"), (1, "from the front"), (0, "from the side")])
def test_a_path_is_seen_where_it_is_largest(tmp_path, flat, name):
    path = np.random.default_rng(flat).uniform(-0.1, 0.1, (20, 3))
    path[:, flat] *= 0.1
    plane = plane_of([history(tmp_path, path)])
    assert plane.name == name
    normal = np.cross(plane.right, plane.up)
    assert np.flatnonzero(normal).tolist() == [flat]


def test_a_letter_is_seen_in_the_plane_it_is_drawn_in(tmp_path):
    plane = plane_of([history(tmp_path, np.zeros((3, 3)), "letter_t")])
    asked = load_spec("letter_t").spec.trajectory.plane
    assert (plane.right.tolist(), plane.up.tolist()) == (list(asked.x_axis), list(asked.y_axis))


def test_a_reference_is_shared_by_runs_that_differ_only_in_where_they_end(tmp_path):
    path = np.random.default_rng(3).uniform(-0.1, 0.1, (20, 3))
    other = path.copy()
    other[5] += 1e-6
    whole, short, apart = (history(tmp_path, p) for p in (path, path[:8], other))
    for runs, expected in (((short, whole), 1), ((whole, short), 0), ((whole, apart), None)):
        assert shared(runs, [run.wanted_position for run in runs]) == expected
