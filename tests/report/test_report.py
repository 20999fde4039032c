"""The page of a run: complete in itself, safe against what a log says, and alive in a browser."""

from __future__ import annotations

import base64
import dataclasses
import html
import json
import re
import shutil
import subprocess
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_allclose
from PIL import Image

from support import records
from support.log_files import STOP, open_log
from tcrctl.analysis.history import read_histories
from tcrctl.analysis.info import inspect
from tcrctl.cli.app import main
from tcrctl.experiment import provenance
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.report import packing, write_report
from tcrctl.report.numbers import payload

N_STEPS = 60
EVIL = "</script><script>document.documentElement.dataset.evil = 1</script><img src=http://evil.test/x>"
BROWSER = next(filter(None, map(shutil.which, ("chromium", "chromium-browser", "google-chrome"))), None)
in_browser = pytest.mark.skipif(BROWSER is None, reason="needs Chromium: apt-get install chromium")
SUMMARY = {
    "status": "failed",
    "steps": N_STEPS,
    "position_error_mm": {"max": 1.25, "rms": 0.5, "mean": 0.4},
    "reason": EVIL,
    "criteria": [
        {
            "name": "position_error_mm.max",
            "relation": "<=",
            "limit": 1.0,
            "value": 1.25,
            "unit": "mm",
            "passed": False,
        },
        {"name": "tension_n.min", "limit": 0.5, "value": None, "unit": "N", "passed": False},
        {
            "name": "theta_x_error_rad.max",
            "relation": "<=",
            "limit": 0.035,
            "value": 0.001864,
            "unit": "rad",
            "passed": True,
        },
    ],
    "task": {"targets": [{"position_error_mm": 0.5, "beam_passes": True}], EVIL: EVIL},
}


def step(k):
    made = records.record(k, 11)
    return dataclasses.replace(made, reference=dataclasses.replace(made.reference, normal=made.truth.normal))


def write(path, make_step=step, *, stop=None, attachments=None, steps=range(N_STEPS), start=records.START):
    spec = load_spec("letter_t")
    given = provenance.attachments(spec, spec.spec) if attachments is None else attachments
    with open_log(path, geometry=records.geometry(11), attachments=given, start=start, flush_steps=10) as log:
        for k in steps:
            log.step(make_step(k))
        log.event(0.5, EVIL, "error", EVIL)
        log.finish(STOP if stop is None else stop)
    return path


@pytest.fixture(scope="module")
def page(tmp_path_factory):
    """A page of a log that says evil things wherever a log can say something."""
    folder = tmp_path_factory.mktemp("report")
    spec = load_spec("letter_t")
    files = {**provenance.attachments(spec, spec.spec), EVIL: ("text/plain", EVIL.encode())}
    files |= {"binary": ("x/y", b"\xff\xfe\x00")}
    stop = {"status": "failed", "reason": EVIL, "summary": json.dumps(SUMMARY)}
    start = {"run_id": EVIL, "spec": EVIL, "robot": EVIL, EVIL: EVIL}
    return write_report(write(folder / "log.mcap", stop=stop, attachments=files, start=start))


class Reader(HTMLParser):
    """Elements with their attributes, and the text of the scripts."""

    def __init__(self, text):
        super().__init__()
        self.elements, self.scripts, self.text, self._inside = [], [], [], ""
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.elements.append((tag, dict(attrs)))
        self._inside = tag

    def handle_endtag(self, tag):
        self._inside = ""

    def handle_data(self, data):
        (self.scripts if self._inside == "script" else self.text).append(data)


def numbers(text, dtype="<f4"):
    return np.frombuffer(base64.b64decode(text), dtype)


def data_of(page):
    return json.loads(Reader(page.read_text()).scripts[0])


def test_nothing_in_the_page_comes_from_elsewhere(page):
    found = Reader(page.read_text())
    assert [tag for tag, _ in found.elements].count("script") == 2
    assert not {"img", "iframe", "object", "embed", "base", "form"} & {tag for tag, _ in found.elements}
    named = [attrs[key] for _, attrs in found.elements for key in ("src", "href", "action") if key in attrs]
    assert {name for name in named if not re.fullmatch(r"#t=[\d.]+", name)} == {"data:,"}
    policy = [attrs["content"] for tag, attrs in found.elements if tag == "meta" and "http-equiv" in attrs]
    assert "default-src 'none'" in policy[0]
    assert not re.search(r"https?://|\bfetch\(|XMLHttpRequest|WebSocket|\bimport\b", found.scripts[1])


def test_what_a_log_says_is_text_and_stays_text(page):
    text = page.read_text()
    assert EVIL not in text
    assert text.count(html.escape(EVIL)) >= 8
    found = Reader(text)
    assert "".join(found.text).count(EVIL) >= 8
    assert "binary" not in [t.strip() for t in found.text]


def test_the_page_shows_result_criteria_task_and_files(page):
    said = "".join(Reader(page.read_text()).text)
    assert "1.25 mm max" in said
    assert re.search(r"FAILED\s*position_error_mm.max\s*1.25 mm\s*<= 1 mm", said)
    assert re.search(r"target\s*the beam goes through, position error 0.5 mm", said)
    assert "The end draws a capital T" in said
    assert "versions.json" in said


def test_the_curves_are_those_of_the_log(page):
    data = data_of(page)
    (run,) = data["runs"]
    charts = {chart["name"]: chart for chart in data["charts"]}
    steps = [step(k) for k in range(N_STEPS)]
    assert_allclose(numbers(run["t"]), records.PERIOD_S * np.arange(N_STEPS), rtol=1e-6)
    for c, line in enumerate(charts["tension"]["lines"]):
        assert_allclose(numbers(line["values"]), [s.truth.tension[c] for s in steps], rtol=1e-6)
    actual, wanted = charts["x"]["lines"]
    assert_allclose(numbers(actual["values"]), [1e3 * s.truth.position[0] for s in steps], rtol=1e-6)
    assert_allclose(numbers(wanted["values"]), [1e3 * s.reference.position[0] for s in steps], rtol=1e-6)
    marks = np.stack([numbers(line["marks"], "u1") for line in charts["drive speed"]["lines"]], axis=1)
    assert np.array_equal(marks, [s.info.saturated for s in steps])
    assert [limit["at"] for limit in charts["tension"]["limits"]] == [1.0, 60.0, 100.0]
    assert "orientation error" in charts


def test_the_shapes_are_those_of_the_log_within_a_hundredth_of_a_millimetre(page):
    robot = data_of(page)["runs"][0]["robot"]
    frames = numbers(robot["nodes"], "<i2").reshape(-1, robot["count"], 3)
    nodes = np.array(robot["middle"]) + robot["scale"] * frames
    assert robot["scale"] < 2e-5
    for t, shape in zip(numbers(robot["t"]), nodes, strict=True):
        k = round(t / records.PERIOD_S)
        assert_allclose(shape, step(k).truth.q.reshape(-1, 3), atol=1e-5)
    assert len(robot["cables"]) == 3
    assert len(robot["springs"]) == 33
    assert robot["tip"] == 11


def test_of_several_runs_it_is_said_which_was_stopped(tmp_path):
    stop = {"status": "aborted", "reason": "safety stop"}
    logs = [write(tmp_path / f"{name}.mcap", stop=stop) for name in ("one", "other")]
    text = write_report(logs, tmp_path / "both.html", labels=["one & all", "other"]).read_text()
    assert re.findall(r'<p class="reason"><b>(.+?)</b> ', text) == ["one &amp; all", "other"]


def test_a_page_opens_where_the_first_of_its_runs_was_stopped(tmp_path):
    ends = {
        "whole": ({"status": "success"}, 60),
        "late": ({"status": "aborted"}, 50),
        "early": ({"status": "error"}, 30),
    }
    logs = {
        name: write(tmp_path / f"{name}.mcap", stop={"reason": "", **stop}, steps=range(n))
        for name, (stop, n) in ends.items()
    }
    for names, opens in (("whole",), 59), (("whole", "late"), 49), (("late", "whole", "early"), 29):
        page = write_report([logs[name] for name in names], tmp_path / f"{len(names)}.html", labels=names)
        found = re.search(r'"open": ?([\d.]+)', page.read_text())
        assert float(found[1]) == pytest.approx(opens * records.PERIOD_S)


def test_thinning_out_keeps_every_peak_and_mark():
    rng = np.random.default_rng(0)
    n = 5 * packing.MOST_POINTS + 123
    values, marks = rng.standard_normal(n), np.zeros(n, bool)
    values[1234], values[20000], values[40] = 50.0, -60.0, np.nan
    marks[777] = True
    thin, t = packing.bundled(values), packing.bundled_times(np.arange(float(n)))
    assert len(thin) == len(t) == len(packing.bundled_marks(marks)) <= packing.MOST_POINTS
    assert (np.nanmax(thin), np.nanmin(thin)) == (50.0, -60.0)
    assert (np.diff(t) > 0.0).all()
    size = t[2] - t[0]
    assert abs(t[np.nanargmax(thin)] - 1234) <= size
    assert np.abs(t[packing.bundled_marks(marks)] - 777).max() <= size
    few = values[:100]
    assert packing.bundled(few) is few


@pytest.mark.slow
def test_the_page_of_a_long_run_is_small(page):
    """Ten minutes at 100 Hz."""
    (short,) = read_histories([page.parent])
    times, n = 1000, 1000 * N_STEPS
    long = {
        field.name: np.concatenate([getattr(short, field.name)] * times)
        for field in dataclasses.fields(short)
        if isinstance(getattr(short, field.name), np.ndarray)
    }
    long |= {"t": 0.01 * np.arange(n), "shape_step": np.arange(n)}
    size = len(json.dumps(payload([dataclasses.replace(short, **long)], [{}])))
    assert size < 3e6


def test_a_run_without_truth_normals_files_or_end_is_shown_as_far_as_it_goes(tmp_path):
    def bare(k):
        made = records.record(k, 11)
        return dataclasses.replace(
            made,
            truth=None,
            reference=dataclasses.replace(made.reference, normal=None),
            estimate=dataclasses.replace(made.estimate, q=np.zeros(0)),
        )

    log = write(tmp_path / "log.mcap", bare, attachments={})
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[: log.stat().st_size * 2 // 3])
    kept = sum(1 for _ in read_log(cut).steps())
    page = write_report(cut, tmp_path / "cut.html")
    data, said = data_of(page), "".join(Reader(page.read_text()).text)
    assert data["runs"][0]["robot"] is None
    assert "orientation error" not in [chart["name"] for chart in data["charts"]]
    assert data["runs"][0]["path"]["wanted_normal"] is None
    assert "unfinished" in said
    assert f"tcrctl recover {cut}" in said
    assert 0 < kept < N_STEPS
    error = max(
        1e3 * np.linalg.norm(bare(k).estimate.position - bare(k).reference.position) for k in range(N_STEPS)
    )
    assert f"{error:.4g} mm max" in said


@pytest.mark.slow
def test_the_command_names_the_file_and_never_replaces_one_unasked(tmp_path, capsys):
    log = write(tmp_path / "log.mcap")
    assert main(["report", str(tmp_path)]) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "report.html")
    assert main(["report", str(log)]) == 2
    assert "exists already" in capsys.readouterr().err
    assert main(["report", str(log), "--force", "--json"]) == 0
    said = json.loads(capsys.readouterr().out)
    assert said == {
        "status": "ok",
        "file": str(tmp_path / "report.html"),
        "bytes": (tmp_path / "report.html").stat().st_size,
    }
    assert main(["report", str(log), "-o", str(tmp_path / "new" / "a.html")]) == 0
    assert (tmp_path / "new" / "a.html").is_file()
    assert main(["report", str(log), "-o", str(log / "a.html")]) == 5


def chromium(page, *options, hash_="", size=(1300, 1500)):
    command = [
        BROWSER,
        "--headless",
        "--no-sandbox",
        "--disable-gpu",
        "--disable-background-networking",
        "--no-first-run",
        "--disable-dev-shm-usage",
        f"--user-data-dir={page.parent / 'chromium'}",
        "--virtual-time-budget=3000",
        "--enable-logging=stderr",
        f"--window-size={size[0]},{size[1]}",
        *options,
        f"file://{page}{hash_}",
    ]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=True)
    assert "CONSOLE" not in done.stderr, done.stderr
    return done.stdout


@pytest.mark.slow
@in_browser
def test_slider_curves_robot_and_keys_work_together_in_a_browser(page, tmp_path):
    copy = tmp_path / "used.html"
    user = (Path(__file__).parents[1] / "support" / "report_user.js").read_text()
    copy.write_text(page.read_text().replace("</body>", f"<script>{user}</script></body>"))
    found = dict(Reader(chromium(copy, "--dump-dom")).elements)
    root = found["html"]
    said, end = json.loads(root["data-said"]), (N_STEPS - 1) * records.PERIOD_S
    assert root["data-ready"] == "true"
    assert "data-evil" not in root
    assert said["slider"] == pytest.approx(1.5, abs=0.01)
    assert said["hover"] == pytest.approx(0.5 * end, abs=0.02)
    assert said["zoomed"] == pytest.approx([0.25 * end, 0.75 * end], abs=0.02)
    assert said["whole"] == pytest.approx([0.0, end], abs=1e-6)
    assert said["turnedByKey"]
    assert said["zoomedByKey"] == pytest.approx(0.5 * end, abs=0.3 * end)
    assert said["event"] == pytest.approx(0.5)
    assert [said["turned"], said["closer"], said["moved"]] == [True, True, True]
    assert said["theme"] == "dark"
    assert said["end"] == pytest.approx(end)
    assert said["playing"]
    assert [said["began"], said["played"]] == pytest.approx([0.0, 0.5])  # again from 0; a frame


def overlap(a, b):
    """Whether two rectangles have an inside in common."""
    across = min(a["right"], b["right"]) - max(a["left"], b["left"])
    return across > 0.5 and min(a["bottom"], b["bottom"]) - max(a["top"], b["top"]) > 0.5


@pytest.mark.slow
@in_browser
@pytest.mark.parametrize("size", [(1400, 900), (500, 900)])
@pytest.mark.parametrize("runs", [1, 2])
def test_nothing_covers_anything_and_the_stage_is_in_view(page, tmp_path, size, runs):
    """500 px is as narrow as a window of Chromium gets; its body is made 400 px wide."""
    log = page.with_name("log.mcap")
    copy = tmp_path / "page.html"
    write_report([log] * runs, copy, labels=["a", "b"][:runs])
    layout = (Path(__file__).parents[1] / "support" / "report_layout.js").read_text()
    narrow = " style='width:400px;margin:0'" if size[0] < 900 else ""
    text = copy.read_text().replace("<body", f"<body{narrow}", 1)
    copy.write_text(text.replace("</body>", f"<script>{layout}</script></body>"))
    root = dict(Reader(chromium(copy, "--dump-dom", size=size)).elements)["html"]
    found = json.loads(root["data-layout"])
    assert found["wide"] <= found["width"]
    parts = ["robot", "plan", "player", "views", "scale", "charts"]
    pairs = [(a, b) for i, a in enumerate(parts) for b in parts[:i] if overlap(found[a], found[b])]
    inside = [("play", "clock"), ("clock", "speed"), ("play", "speed")]
    assert pairs + [(a, b) for a, b in inside if overlap(found[a], found[b])] == []
    assert (found["unnamed"], found["torn"], found["hidden"]) == (0, [], 0)
    if size == (1400, 900):
        assert found["player"]["bottom"] <= found["height"]
        assert found["robot"]["bottom"] - found["robot"]["top"] >= 300
        assert found["plan"]["bottom"] <= found["height"]
    else:
        assert max(found[part]["right"] for part in parts) <= 400


@pytest.mark.slow
@in_browser
def test_robot_and_curves_are_drawn_in_a_browser(page, tmp_path):
    picture = tmp_path / "page.png"
    chromium(page, f"--screenshot={picture}", hash_="#t=1")
    with Image.open(picture) as image:
        pixels = np.asarray(image.convert("RGB")).reshape(-1, 3)
    for colour in ("#6b7580", "#0072b2", "#d55e00", "#009e73"):
        wanted = np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)])
        assert (np.abs(pixels.astype(int) - wanted).max(axis=1) < 12).sum() > 50, colour


@pytest.mark.parametrize(
    "summary",
    [
        {"steps": "many", "criteria": 5, "position_error_mm": ["x"], "task": [1, {"a": None}]},
        {"steps": 3, "criteria": ["x", None], "control_ms": {"p50": {}}, "status": [], "reason": {}},
        {"steps": None, "criteria": {"name": 1}, "tension_n": {"min": None}, "status": None},
        [1, 2],
    ],
)
def test_a_summary_of_other_types_is_no_fault_of_the_program(summary, tmp_path):
    path = tmp_path / "log.mcap"
    with open_log(path) as log:
        for k in range(3):
            log.step(records.record(k))
        log.finish({"status": "success", "summary": json.dumps(summary)})
    made = write_report(path, tmp_path / "page.html")
    assert made.stat().st_size > 0
    assert inspect(path).steps == 3
