"""Scripts of users: their logs are those of the command line, and the shipped example does what it says."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import pytest

from tcrctl.log.reader import read_log

ROOT = Path(__file__).parents[2]
SCRIPT = """
import sys
import tcrctl

run = tcrctl.run("letter_t", set={SETTINGS}, out="runs")
print(run.path)
"""
SETTINGS = ["trajectory.lead_in_s=0.2", "trajectory.strokes=[{line: [[0, 0], [1, 0]]}]", "criteria=[]"]
MAIN = "import sys; from tcrctl.cli.app import main; sys.exit(main(sys.argv[1:]))"


def python(folder, *arguments):
    """A fresh interpreter, with no flags of a compiler in its environment; returns what it prints."""
    environment = {key: value for key, value in os.environ.items() if not key.startswith("NUMBA_")}
    environment["PYTHONPATH"] = os.pathsep.join((str(ROOT), str(ROOT / "hardware")))
    environment["MPLBACKEND"] = "Agg"
    done = subprocess.run(
        [sys.executable, *arguments], cwd=folder, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.mark.slow
def test_a_log_from_a_script_is_that_of_the_command_line_and_is_replayed_there_without_a_word(tmp_path):
    (tmp_path / "script.py").write_text(SCRIPT.replace("{SETTINGS}", repr(SETTINGS)))
    log = Path(python(tmp_path, "script.py").strip())
    replayed = json.loads(python(tmp_path, "-c", MAIN, "replay", str(tmp_path / log), "--json"))
    assert replayed["status"] == "identical"
    assert replayed["environment"] == []
    sets = [text for setting in SETTINGS for text in ("--set", setting)]
    told = json.loads(python(tmp_path, "-c", MAIN, "run", "letter_t", *sets, "--out", "runs", "--json"))
    one, other = (read_log(tmp_path / path) for path in (log, told["log"]))
    assert one.columns(["applied_speed"])["applied_speed"].tobytes() == (
        other.columns(["applied_speed"])["applied_speed"].tobytes()
    )
    assert json.loads(one.stop["summary"])["versions"] == told["versions"]


@pytest.mark.thorough
@pytest.mark.slow
def test_the_example_compares_two_controllers_and_its_own_one_is_replayed(tmp_path):
    told = python(tmp_path, str(ROOT / "examples" / "python" / "first_steps.py"), str(tmp_path))
    lines = {line.partition(":")[0]: line for line in told.splitlines()}
    assert "ioc: success" in lines["ioc"]
    assert "mine: success" in lines["mine"]
    assert (tmp_path / "first_steps.png").stat().st_size > 10_000
    log = lines["mine"].rpartition(", ")[2]
    plugins = ("--plugins", str(ROOT / "examples" / "python"), "--json")
    assert json.loads(python(tmp_path, "-c", MAIN, "replay", log, *plugins))["status"] == "identical"
