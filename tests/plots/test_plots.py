"""Figures of a run: every kind is drawn, and what is drawn is what the log holds."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.backends.backend_agg import FigureCanvasAgg
from numpy.testing import assert_allclose
from PIL import Image

from support import records
from support.log_files import STOP, open_log
from tcrctl.analysis.history import Limits, orientation_angles, read_histories
from tcrctl.analysis.structure import read_structure
from tcrctl.cli.app import main
from tcrctl.cli.plot import plot
from tcrctl.errors import InputError, UnknownNameError
from tcrctl.experiment import provenance
from tcrctl.experiment.run import log_geometry
from tcrctl.experiment.spec import load_spec
from tcrctl.log.drawing import Ball, Drawing
from tcrctl.numerics.rotation import angle_between, angles_from_normal
from tcrctl.plots import FIGURES, draw, plan, save, worth_drawing
from tcrctl.plots.look import Look
from tcrctl.plots.style import printed
from tcrctl.robot.robot import Robot

pytestmark = pytest.mark.slow

N_STEPS = 40
SPEC = load_spec("letter_t", ["controller.speed_limit_mm_s=6"])


def turning(k, n_modules=11):
    """A step whose wanted normal goes round on a cone, and whose actual one lags behind."""
    step = records.record(k, n_modules)
    wanted, actual = (
        np.array([np.sin(0.3) * np.cos(a), np.sin(0.3) * np.sin(a), np.cos(0.3)])
        for a in (0.2 * k, 0.2 * k - 0.05)
    )
    reference = dataclasses.replace(step.reference, normal=wanted)
    return dataclasses.replace(
        step, reference=reference, truth=dataclasses.replace(step.truth, normal=actual)
    )


def free(k):
    """A step in which the orientation is not tracked."""
    step = records.record(k, 11)
    return dataclasses.replace(
        step, reference=dataclasses.replace(step.reference, normal=None, ahead_normal=None)
    )


def on_a_rig(k):
    """A step without truth, and with a shape every fourth time only."""
    step = records.record(k, 11)
    q = step.estimate.q if k % 4 == 0 else np.zeros(0)
    return dataclasses.replace(step, truth=None, estimate=dataclasses.replace(step.estimate, q=q))


def write(path, make_step, *, start=(), attachments=None, steps=range(N_STEPS)):
    given = provenance.attachments(SPEC, SPEC.spec) if attachments is None else attachments
    options = {
        "geometry": records.geometry(11),
        "attachments": given,
        "start": {**records.START, **dict(start)},
    }
    with open_log(path, **options) as log:
        for k in steps:
            log.step(make_step(k))
        log.finish(STOP)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    return tmp_path_factory.mktemp("logs")


@pytest.fixture(scope="module")
def pose(folder):
    return read_histories([write(folder / "pose.mcap", turning)])


@pytest.fixture(scope="module")
def several(folder):
    """Runs that differ in every way: orientation free or not, longer, simulated or not."""
    paths = [
        write(folder / "turning.mcap", turning),
        write(folder / "free.mcap", free, steps=range(2 * N_STEPS)),
        write(folder / "rig.mcap", on_a_rig, attachments={}),
    ]
    return read_histories(paths, labels=["turning", "free", "rig"])


def lines(figure, label):
    """Data of the lines with a label, over all panels."""
    return [line.get_data() for axes in figure.axes for line in axes.lines if line.get_label() == label]


def colours(path):
    with Image.open(path) as picture:
        return picture.convert("RGB").getcolors(2**24)


@pytest.mark.parametrize("name", FIGURES)
def test_every_figure_is_drawn_for_every_kind_of_run_and_for_several(name, several, folder):
    draw(name, [several[1]])
    draw(name, [several[2]])
    figure = draw(name, several)
    figure.savefig(folder / f"{name}.png", dpi=50)
    assert len(colours(folder / f"{name}.png")) > 20


def test_the_command_writes_every_figure(tmp_path, capsys):
    log = str(write(tmp_path / "log.mcap", turning, steps=range(20)))
    assert main(["plot", log, "--width-mm", "88"]) == 0  # small ones are drawn sooner
    printed = capsys.readouterr().out.split()
    shown = [name for name in FIGURES if name not in ("task", "comparison")]  # it has no task, and is one run
    assert printed == [str(tmp_path / "plots" / f"{name}.png") for name in shown]
    assert all(len(colours(path)) > 20 for path in printed)


def test_the_command_writes_every_format(tmp_path, capsys):
    log = str(write(tmp_path / "log.mcap", turning, steps=range(5)))
    for file_format, magic in (("pdf", b"%PDF"), ("svg", b"<?xml"), ("png", b"\x89PNG")):
        out = tmp_path / file_format
        assert main(["plot", log, "-f", "error", "--format", file_format, "--out", str(out), "--json"]) == 0
        said = json.loads(capsys.readouterr().out)
        assert said == {"status": "ok", "files": [str(out / f"error.{file_format}")]}
        assert (out / f"error.{file_format}").read_bytes().startswith(magic)


def test_the_same_figure_is_the_same_file(pose, tmp_path):
    for name in ("a.svg", "b.svg"):
        save(draw("error", pose), tmp_path / name)
    date = b"<dc:date>"
    a, b = ((tmp_path / name).read_bytes().split(date) for name in ("a.svg", "b.svg"))
    assert a[0] == b[0]


def test_an_unknown_figure_or_format_is_an_error_that_lists_the_names(tmp_path, capsys):
    log = str(write(tmp_path / "log.mcap", turning, steps=range(5)))
    assert main(["plot", log, "--figure", "tension", "--out", str(tmp_path / "out")]) == 2
    said = capsys.readouterr().err
    assert all(name in said for name in FIGURES)
    assert "Did you mean tensions?" in said
    assert main(["plot", log, "--format", "gif", "--out", str(tmp_path / "out")]) == 2
    assert "png, pdf, svg" in capsys.readouterr().err
    assert main(["plot", log, "--label", "a", "--label", "b"]) == 2
    assert main(["plot", log, "--from", "50"]) == 2
    assert "from 0 to 0.2 s" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()


def test_the_help_names_every_figure():
    assert all(name in plot.__doc__ for name in FIGURES)


def test_a_folder_that_cannot_be_written_is_an_error(tmp_path, capsys):
    log = str(write(tmp_path / "log.mcap", turning, steps=range(5)))
    (tmp_path / "file").write_text("")
    assert main(["plot", log, "-f", "error", "--out", str(tmp_path / "file")]) == 5
    assert "cannot be written" in capsys.readouterr().err


def test_time_histories_show_the_bits_of_the_log(pose):
    (history,) = pose
    figure = draw("position", pose)
    for axis, (t, x), (_, wanted) in zip(
        range(3), lines(figure, "actual"), lines(figure, "wanted"), strict=True
    ):
        assert_allclose(t, records.PERIOD_S * np.arange(N_STEPS))
        assert_allclose(x, [1e3 * turning(k).truth.position[axis] for k in range(N_STEPS)])
        assert_allclose(wanted, [1e3 * turning(k).reference.position[axis] for k in range(N_STEPS)])
    for c, cable in enumerate(history.cables):
        ((_, drive),) = lines(draw("drives", pose), cable)
        assert_allclose(drive, [1e3 * turning(k).measurement.drive[c] for k in range(N_STEPS)])
        ((_, tension),) = lines(draw("tensions", pose), cable)
        assert_allclose(tension, [turning(k).truth.tension[c] for k in range(N_STEPS)])


def test_errors_are_those_of_the_run_itself(pose):
    (history,) = pose
    steps = [turning(k) for k in range(N_STEPS)]
    apart = [np.linalg.norm(s.truth.position - s.reference.position) for s in steps]
    angle = [angle_between(s.truth.normal, s.reference.normal) for s in steps]
    assert_allclose(history.position_error, apart)
    assert_allclose(history.orientation_error, angle, atol=1e-12)
    legends = [axes.get_legend() for axes in draw("error", pose).axes]
    first, last = (legends[i].get_texts()[0].get_text() for i in (0, -1))
    assert f"max {1e3 * max(apart):.4g} mm" in first
    assert f"max {np.degrees(max(angle)):.4g} deg" in last


def test_orientation_angles_are_those_of_the_controller_but_without_jumps():
    rng = np.random.default_rng(0)
    normals = rng.standard_normal((50, 3))
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    normals[7] = np.nan
    found = orientation_angles(normals)
    for normal, angles in zip(normals, found, strict=True):
        difference = angles - angles_from_normal(normal)
        assert_allclose(np.sin(difference), 0.0 * difference, atol=1e-12)
        assert_allclose(np.cos(difference), 1.0 + 0.0 * difference, atol=1e-12)
    turn = np.linspace(0.0, 4.0 * np.pi, 200)
    round_x = np.stack([np.zeros_like(turn), -np.sin(turn), np.cos(turn)], axis=1)
    assert_allclose(orientation_angles(round_x)[:, 0], turn, atol=1e-9)


def test_saturated_inputs_are_crossed_and_near_limits_drawn(pose):
    (history,) = pose
    figure = draw("speeds", pose)
    crosses = [line.get_data() for line in figure.axes[0].lines if line.get_marker() == "x"]
    for c, (t, speed) in enumerate(crosses):
        where = np.array([turning(k).info.saturated[c] for k in range(N_STEPS)])
        assert_allclose(t, history.t[where])
        assert_allclose(speed, 1e3 * history.speed[where, c])
    assert 0 < history.saturated.sum() < history.saturated.size
    level = [line.get_ydata()[0] for line in figure.axes[0].lines if list(line.get_xdata()) == [0, 1]]
    assert level == [-6.0, 6.0]


def test_far_limits_are_told_instead_of_drawn(pose):
    (panel,) = draw("drives", pose).axes
    assert "stroke −100 to 200 mm" in panel.get_title(loc="right")
    (panel,) = draw("tensions", pose).axes
    assert "ceiling 60 N, limit 100 N" in panel.get_title(loc="right")
    low, high = panel.get_ylim()
    assert (low, high < 20.0) == (0.0, True)


def test_limits_come_from_the_files_in_the_log_and_may_be_missing(pose, several):
    assert pose[0].limits == Limits(0.006, (-0.1, 0.2), 100.0, 1.0, 60.0)
    assert several[2].limits == Limits()


def test_a_run_without_truth_shows_the_estimate_and_the_shapes_there_are(several):
    rig = several[2]
    assert not rig.simulated
    assert_allclose(rig.position, [on_a_rig(k).estimate.position for k in range(N_STEPS)])
    assert list(rig.shape_step) == list(range(0, N_STEPS, 4))
    assert_allclose(rig.shape[1].ravel(), on_a_rig(4).estimate.q)
    assert "estimated" in draw("tensions", [rig]).axes[0].get_ylabel()


def test_several_runs_have_a_legend_with_their_names(several):
    (legend,) = draw("position", several).legends
    names = [text.get_text() for text in legend.get_texts()]
    assert {"turning", "free", "rig"} <= set(names)
    styles = {(line.get_color(), str(line._unscaled_dash_pattern)) for line in legend.get_lines()}
    assert len(styles) == len(names)


def test_labels_are_as_short_as_they_can_be(folder):
    def run(name, run_id, spec, *overrides):
        start = {"run_id": run_id, "spec": spec, "overrides": json.dumps(overrides)}
        return write(folder / f"{name}.mcap", free, start=start.items(), steps=range(2))

    a, b = run("a", "x_aaaa", "letter_t"), run("b", "x_bbbb", "heart")
    c, d = run("c", "x_cccc", "heart", "seed=2"), run("d", "x_dddd", "heart", "seed=2")
    assert [history.label for history in read_histories([a, b])] == ["letter_t", "heart"]
    assert [history.label for history in read_histories([b, c])] == ["heart", "heart seed=2"]
    assert [history.label for history in read_histories([c, d])] == [
        "heart seed=2 (cccc)",
        "heart seed=2 (dddd)",
    ]


def test_a_span_of_time_and_a_cut_log_show_what_is_there(tmp_path):
    whole = tmp_path / "log.mcap"
    with open_log(whole, flush_steps=10) as log:
        for k in range(N_STEPS):
            log.step(records.record(k))
        log.finish(STOP)
    (part,) = read_histories([whole], begin=0.5, end=1.0)
    assert_allclose(part.t, np.arange(0.5, 1.01, records.PERIOD_S))
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(whole.read_bytes()[: whole.stat().st_size * 2 // 3])
    (found,) = read_histories([cut])
    assert 0 < len(found.t) < N_STEPS
    with pytest.raises(InputError, match="no steps to show"):
        read_histories([cut], begin=99.0)


def test_drawing_leaves_the_users_style_alone(pose):
    before = dict(mpl.rcParams)
    draw("error", pose)
    assert dict(mpl.rcParams) == before
    with pytest.raises(UnknownNameError):
        draw("errors", pose)


def test_the_skeleton_is_that_of_the_robot_in_the_log(pose, several, tcr600: Robot):
    structure = read_structure(pose[0].log, 48)
    model = tcr600.model
    assert np.array_equal(structure.springs, model.bar_nodes[6 * 11 :])
    assert_allclose(structure.natural_length, model.bars[6 * 11 :, 0])
    assert structure.tip_ring == 11
    for ours, theirs in zip(structure.cables, log_geometry(tcr600).cables, strict=True):
        assert ours.name == theirs.name
        assert np.array_equal(ours.nodes, theirs.nodes)
        assert_allclose(ours.weights, theirs.weights)
    assert read_structure(pose[0].log, 44) is None
    assert read_structure(several[2].log, 48) is None


@pytest.mark.parametrize(
    "verb", [["plot", "-f", "error"], ["report"], ["export", "--csv"]], ids=lambda v: v[0]
)
def test_verbs_that_write_files_treat_those_that_exist_alike(tmp_path, capsys, verb):
    call = [*verb, str(write(tmp_path / "log.mcap", turning, steps=range(5)))]
    assert main(call) == 0
    written = Path(capsys.readouterr().out.split()[0])
    written.write_text("mine")
    assert main(call) == 2
    assert capsys.readouterr().err.splitlines()[0] == f"error: {written}: exists already"
    assert written.read_text() == "mine"
    assert main([*call, "--force"]) == 0
    assert written.read_bytes() != b"mine"


def test_theta_of_the_end_is_the_one_nearest_to_that_wanted(pose):
    history = pose[0]
    away = np.tile([1.0, 0.0, 0.0], (len(history.t), 1))  # where (45) has no theta_x, both turn as they like
    normal = np.where(np.arange(len(history.t))[:, None] == 7, away, history.normal)
    turned = dataclasses.replace(history, normal=normal)
    apart = turned.angles[:, 0] - turned.wanted_angles[:, 0]
    assert np.abs(apart).max() <= np.pi + 1e-12
    again = np.column_stack((np.sin(turned.angles[:, 0]), np.cos(turned.angles[:, 0])))
    alone = orientation_angles(turned.normal)[:, 0]
    assert_allclose(again, np.column_stack((np.sin(alone), np.cos(alone))), atol=1e-12)


@pytest.mark.parametrize(("width_mm", "style"), [(88.0, "paper"), (177.8, "paper"), (177.8, "talk")])
def test_a_figure_is_as_wide_as_asked(several, folder, width_mm, style):
    look = Look(width_mm=width_mm, style=style)
    for name in ("error", "overview", "comparison", "latency"):
        path = folder / f"{name}_{style}.png"
        save(draw(name, several, look), path, look)
        with Image.open(path) as image:
            assert image.width == pytest.approx(width_mm / 25.4 * 200, abs=1.5)


@pytest.mark.parametrize("style", ["paper", "talk"])
@pytest.mark.parametrize("width_mm", [40.0, 60.0, 88.0, 120.0, 180.0])
def test_every_figure_is_laid_out_at_every_width(pose, several, width_mm, style):
    look = Look(width_mm=width_mm, style=style)
    for histories in (pose, several):
        for name in worth_drawing(histories):
            with printed(look):
                draw(name, histories, look).draw_without_rendering()  # a warning is an error here


@pytest.mark.parametrize("style", ["paper", "talk"])
@pytest.mark.parametrize("width_mm", [40.0, 60.0, 88.0, 177.8])
def test_the_robot_stands_beside_the_drawing_or_above_it_and_has_room(pose, width_mm, style):
    look = Look(width_mm=width_mm, style=style)
    with printed(look):
        figure = draw("overview", pose, look)
        figure.draw_without_rendering()
    body, drawing, below = (panel.get_position() for panel in figure.axes)
    beside = body.x1 <= drawing.x0
    assert beside != (body.y0 >= drawing.y1)
    width_in, height_in = figure.get_size_inches()
    assert min(body.width * width_in, body.height * height_in) > 0.8
    assert min(drawing.width, below.width) > 0.5


def test_lines_of_a_narrow_figure_are_in_proportion_to_its_text():
    for width_mm in (40.0, 60.0, 88.0, 177.8):
        made = Look(width_mm=width_mm, style="talk").rc()
        assert made["lines.linewidth"] / made["font.size"] == pytest.approx(2.2 / 14.0, abs=0.001)


def test_a_figure_without_room_for_its_names_is_saved_without_a_word(several, tmp_path, recwarn):
    look = Look(width_mm=40.0)
    labelled = [dataclasses.replace(several[0], label=f"a run with a very long name {i}") for i in range(12)]
    for name in ("error", "comparison", "drives"):
        save(draw(name, labelled, look), tmp_path / f"{name}.png", look)
        assert (tmp_path / f"{name}.png").stat().st_size > 2000
    assert not recwarn.list


def test_a_look_that_there_is_not_is_an_error(tmp_path, capsys):
    log = str(write(tmp_path / "log.mcap", turning, steps=range(5)))
    for options, part in (
        (["--width-mm", "5"], "from 40 to 1000"),
        (["--style", "wall"], "paper, talk"),
        (["--font", "DejaVu Sanz"], "Did you mean DejaVu Sans"),
    ):
        assert main(["plot", log, "-f", "error", *options]) == 2
        assert part in capsys.readouterr().err
    assert not (tmp_path / "plots").exists()


def test_runs_that_wanted_different_things_are_drawn_with_all_of_them(pose):
    other = dataclasses.replace(pose[0], label="other", wanted_position=pose[0].wanted_position + 0.01)
    for name, panel in (("overview", -2), ("task", 0), ("path", 0)):
        same = draw(name, [pose[0], pose[0]]).axes[panel].get_legend_handles_labels()[1]
        both = draw(name, [pose[0], other]).axes[panel].get_legend_handles_labels()[1]
        assert [text for text in same if text.startswith("wanted") and "axis" not in text] == ["wanted"]
        wanted = [text for text in both if text.startswith("wanted, ") and "axis" not in text]
        assert wanted == [f"wanted, {pose[0].label}", "wanted, other"]


def boxes(figure, panel):
    """Where the words of a panel are on the picture."""
    FigureCanvasAgg(figure).draw()
    return {text.get_text(): text.get_window_extent() for text in panel.texts}


def test_names_of_objects_that_cover_each_other_do_not(pose, monkeypatch):
    place = pose[0].position[0]
    balls = tuple(
        Ball(name, place + np.array(at), 0.01)
        for name, at in (("mouse", [0.0, 0, 0]), ("handkerchief", [8e-3, 0, 2e-3]))
    )
    monkeypatch.setattr(plan, "read_drawing", lambda log: Drawing((), balls, (), None))
    figure = draw("task", pose[:1])
    panel = figure.axes[0]
    found = boxes(figure, panel)
    assert set(found) == {"mouse", "handkerchief"}
    assert not found["mouse"].overlaps(found["handkerchief"])
    assert panel.get_legend_handles_labels()[1].count("object") == 1


def test_the_numbers_of_a_comparison_stay_within_their_panels(several):
    figure = draw("comparison", several)
    for panel in figure.axes:
        for box in boxes(figure, panel).values():
            assert panel.bbox.x0 <= box.x0
            assert box.x1 <= panel.bbox.x1
