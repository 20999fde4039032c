"""One run says the same numbers wherever they stand: terminal, JSON, ``info``, report and figures."""

from __future__ import annotations

import contextlib
import html
import io
import json
import re

import pytest

from support.short_runs import BELOW
from tcrctl.analysis.history import read_histories
from tcrctl.cli.app import main
from tcrctl.plots import draw

pytestmark = pytest.mark.slow

PARTS = {"position_error_mm": "mm", "orientation_error_deg": "deg", "tension_n": "N", "control_ms": "ms"}


def squeezed(text):
    """Text without line breaks, borders and markup, as one line; where a word may be broken it is not."""
    return " ".join(html.unescape(re.sub(r"<[^>]*>", " ", text.replace("<wbr>", ""))).split())


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """Everything that is said of one run, by who says it; and its result as JSON."""
    folder = tmp_path_factory.mktemp("runs")
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", "200")
        settings = [part for setting in BELOW for part in ("--set", setting)]
        said = {"terminal": printed(["run", "laser_pipe", "--out", str(folder), *settings])}
        run = (folder / "latest").resolve()
        said["info"] = printed(["info", str(run)])
    assert main(["report", str(run)]) == 0
    page = (run / "report.html").read_text()
    said["report"] = squeezed(page.partition("<script")[0])
    return said, json.loads((run / "summary.json").read_text()), run


def printed(arguments):
    """What a verb says on stdout, as one line."""
    with contextlib.redirect_stdout(io.StringIO()) as out:
        assert main(arguments) == 0
    return squeezed(out.getvalue())


@pytest.mark.parametrize("where", ["terminal", "info", "report"])
def test_measures_criteria_and_task_say_what_the_result_says(told, where):
    said, result, _ = told
    for key, unit in PARTS.items():
        for part, value in result[key].items():
            text = f"{value:.4g} {unit}"
            assert f"{part} {text}" in said[where] or f"{text} {part}" in said[where], (key, part)
    for item in result["criteria"]:
        value = item["value"]
        shown = str(value).lower() if isinstance(value, bool) else f"{value:.4g} {item['unit']}".strip()
        assert re.search(rf"{re.escape(item['name'])}.*{re.escape(shown)}", said[where]), item
    (target,) = result["task"]["targets"]
    for key, unit in {"position_error_mm": "mm", "theta_x_error_rad": "rad", "dwell_s": "s"}.items():
        assert f"{target[key]:.4g} {unit}" in said[where]


def test_info_as_json_has_the_numbers_of_the_result(told, capsys):
    _, result, run = told
    assert main(["info", str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    for key in ("steps", "duration_s", "control_ms", "overruns", "unconverged_steps", "criteria"):
        assert found[key] == result[key], key
    assert found["summary"] == result


def test_legends_have_the_numbers_of_the_result(told):
    _, result, run = told
    histories = read_histories([run])
    legends = [axes.get_legend() for axes in draw("error", histories).axes]
    position, orientation = (legends[i].get_texts()[0].get_text() for i in (0, -1))
    for said, key, unit in (
        (position, "position_error_mm", "mm"),
        (orientation, "orientation_error_deg", "deg"),
    ):
        assert said == ", ".join(f"{part} {result[key][part]:.4g} {unit}" for part in ("max", "rms"))
    (time,) = draw("timing", histories).axes[0].get_legend().get_texts()
    assert time.get_text() == ", ".join(f"{part} {v:.4g} ms" for part, v in result["control_ms"].items())
    share = draw("speeds", histories).axes[0].get_title(loc="left")
    assert f"{100 * result['saturated_fraction']:.4g} % of the steps" in share
