"""The package of docs/plugins.md, pasted: it runs, is recorded, replayed and swept; broken, it is refused."""

from __future__ import annotations

import csv
import importlib
import json
import re
import sys
import tomllib
from pathlib import Path

import pytest

from tcrctl.cli.app import main
from tcrctl.log.reader import read_log

GUIDE = (Path(__file__).parents[2] / "docs" / "plugins.md").read_text()
FILES = dict(re.findall(r"^`([\w/.]+)`:\n\n```\w+\n(.*?)^```$", GUIDE, re.MULTILINE | re.DOTALL))
SHORT = ("--set", "trajectory.duration_s=2", "--set", "trajectory.radius_mm=3")


@pytest.fixture
def guide(tmp_path, monkeypatch):
    """Writes and installs the files of the guide, with one text replaced by another; returns the working folder."""
    site = tmp_path / "site"
    monkeypatch.syspath_prepend(str(site))
    monkeypatch.setenv("PYTHONPATH", str(site))
    monkeypatch.chdir(tmp_path)

    def installed(old="", new=""):
        assert not old or any(old in text for text in FILES.values())
        files = {name: text.replace(old, new) if old else text for name, text in FILES.items()}
        install(site, files)
        (tmp_path / "mine.yaml").write_text(files["mine.yaml"])
        return tmp_path

    yield installed
    sys.modules.pop("my_lab", None)
    importlib.invalidate_caches()


def install(site, files):
    """Put into a folder what an installer would."""
    project = tomllib.loads(files["my_lab/pyproject.toml"])["project"]
    info = site / "my_lab-0.1.dist-info"
    info.mkdir(parents=True)
    (site / "my_lab.py").write_text(files["my_lab/my_lab.py"])
    name, version = project["name"], project["version"]
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: {version}\n")
    (info / "top_level.txt").write_text("my_lab\n")
    groups = (
        f"[{group}]\n" + "".join(f"{key} = {value}\n" for key, value in points.items())
        for group, points in project["entry-points"].items()
    )
    (info / "entry_points.txt").write_text("\n".join(groups))


def told(capsys, *arguments):
    """Exit code of a verb, and what it says."""
    code = main(list(arguments))
    printed = capsys.readouterr()
    return code, printed.out, printed.err


def test_the_guide_has_three_files():
    assert set(FILES) == {"my_lab/pyproject.toml", "my_lab/my_lab.py", "mine.yaml"}


@pytest.mark.slow
def test_it_is_listed_runs_as_written_and_is_replayed_bit_for_bit(guide, capsys):
    folder = guide()
    code, out, _ = told(capsys, "kinds", "--json")
    rows = {row["kind"]: row for row in json.loads(out)}
    assert code == 0
    assert rows["my_p"]["from"] == rows["my_circle"]["from"] == "my-lab 0.1"
    assert (
        rows["my_circle"]["description"]
        == "A horizontal circle through the rest position, from rest to rest."
    )
    code, out, _ = told(capsys, "run", "mine.yaml", "--json")
    assert code == 0, out
    log = folder / json.loads(out)["log"]
    origins = json.loads(read_log(log).attachments["plugins.json"][1])
    assert [(row["kind"], row["package"], row["version"]) for row in origins] == [
        ("my_circle", "my-lab", "0.1"),
        ("my_p", "my-lab", "0.1"),
    ]
    code, out, _ = told(capsys, "replay", str(log), "--json")
    assert (code, json.loads(out)["status"]) == (0, "identical")


@pytest.mark.slow
def test_it_is_swept(guide, capsys):
    folder = guide()
    gains = "controller.gain_1_s=0.5,1.5"
    code, out, _ = told(
        capsys, "sweep", "mine.yaml", *SHORT, "--set", gains, "--seeds", "0..1", "--jobs", "1", "--json"
    )
    assert code == 0, out
    (table,) = folder.glob("logs/*/table.csv")
    with table.open(newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["status"] for row in rows] == ["success"] * 4, rows
    assert len({row["position_error_mm.max"] for row in rows}) == 4


#: What is replaced in the guide's files, exit code, and what is said.
BROKEN = {
    "missing import": (
        "import numpy as np",
        "import no_such_package_1 as np",
        2,
        "Install what brings the module",
    ),
    "syntax": ("class Circle:", "class Circle", 2, "SyntaxError"),
    "wrong name": ('"my_lab:P"', '"my_lab:Q"', 2, "it defines no Q; kinds in it: CIRCLE, P"),
    "wrong module": ('"my_lab:P"', '"my_labs:P"', 2, "Install what brings the module my_labs"),
    "no pair": ("P = (PKeys, Controller)", "P = Controller", 2, "must be a pair (Settings, build)"),
    "other settings": ("P = (PKeys,", "P = (CircleKeys,", 2, "must derive from OwnControllerSection"),
    "misspelt key": ("kind: my_p, gain_1_s", "kind: my_p, gain_1s", 2, "did you mean gain_1_s?"),
    "out of bounds": ("gain_1_s: 1.5}", "gain_1_s: 50}", 2, "must be <= 5"),
    "not registered": ("kind: my_p,", "kind: my_q,", 2, "must be one of 'ioc'"),
    "builder raises": (
        "        self.settings = settings\n",
        "        1 / 0\n",
        2,
        "building it raised ZeroDivisionError",
    ),
    "lacks": ("def control(", "def steer(", 2, "has no control"),
    "no path": ("0 * angle), axis=1)", "0 * angle))", 2, "position raised ValueError"),
    "NaN path": ("x**3 *", "np.nan * x**3 *", 2, "position returned values that are no finite numbers"),
    "NaN": (
        "return self.drives_per_metre @",
        "return np.nan * self.drives_per_metre @",
        4,
        "no finite numbers",
    ),
    "wrong shape": (
        "return self.drives_per_metre @",
        "return self.drives_per_metre[:2] @",
        4,
        "speed of shape (2,), not (3,)",
    ),
    "raises": (
        "        error = ",
        "        estimate.nothing\n        error = ",
        4,
        "control raised AttributeError",
    ),
}


@pytest.mark.slow
@pytest.mark.parametrize("name", BROKEN)
def test_broken_it_is_one_clear_message_or_a_safe_stop_and_never_a_traceback(guide, capsys, name):
    old, new, wanted, message = BROKEN[name]
    guide(old, new)
    code, out, err = told(capsys, "run", "mine.yaml", *SHORT, "--quiet")
    said = " ".join((out + err).split())
    assert code == wanted, said
    assert message in said
    assert "Traceback" not in said
    assert "internal" not in said
