"""Verbs about files: what they print where, and their exit codes."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

from tcrctl import __version__
from tcrctl.cli import app
from tcrctl.config import shipped, strict_yaml
from tcrctl.experiment.spec import ExperimentSpec, load_spec
from tcrctl.robot.description import RobotDescription, load_robot

Output = pytest.CaptureFixture[str]


def test_list_names_every_shipped_experiment_and_robot(capsys: Output) -> None:
    assert app.main(["list", "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert [entry["name"] for entry in found["experiments"]] == list(shipped.experiments())
    assert [entry["name"] for entry in found["robots"]] == list(shipped.robots())
    assert all(entry["robot"] and Path(entry["path"]).is_file() for entry in found["experiments"])
    assert app.main(["list"]) == 0
    lines = capsys.readouterr().out.splitlines()
    assert all(any(line.startswith(f"{name} ") for line in lines) for name in shipped.experiments())


def test_show_prints_a_file_that_means_the_same(capsys: Output) -> None:
    overrides = ["controller.tension=off", "seed=7"]
    assert app.main(["show", "letter_t", "--set", overrides[0], "--set", overrides[1]]) == 0
    captured = capsys.readouterr()
    expected = load_spec("letter_t", overrides).spec
    assert strict_yaml.validate(strict_yaml.loads(captured.out), ExperimentSpec) == expected
    assert captured.err == ""
    assert app.main(["show", "letter_t", "--json", "--set", overrides[0], "--set", overrides[1]]) == 0
    assert ExperimentSpec.model_validate_json(capsys.readouterr().out) == expected


def test_show_prints_robots_too(capsys: Output) -> None:
    assert app.main(["show", "--robot", "tcr700", "--json", "--set", "tip.ring=8"]) == 0
    found = json.loads(capsys.readouterr().out)
    assert (found["name"], found["tip"]["ring"]) == ("tcr700", 8)


def test_show_keeps_the_comments_of_a_robot_file(capsys: Output, tmp_path: Path) -> None:
    mine = tmp_path / "mine.yaml"
    mine.write_text(
        shipped.robots()["tcr700"].read_text() + "friction:  # ours\n  coefficient: 0.1 # a guess\n"
    )
    overrides = ["tip.ring=8", "cables.lead_mm=120", "friction.coefficient=0.2", "base.tilt_deg=[1, 0]"]
    for given in ((), overrides[:1], overrides):
        arguments = [part for one in given for part in ("--set", one)]
        assert app.main(["show", "--robot", str(mine), *arguments]) == 0
        shown = capsys.readouterr().out
        assert strict_yaml.validate(strict_yaml.loads(shown), RobotDescription) == load_robot(
            str(mine), overrides=given
        )
        comments = [line.partition("#")[2] for line in mine.read_text().splitlines() if "#" in line]
        assert [line.partition("#")[2] for line in shown.splitlines() if "#" in line] == comments


def test_validate_goes_through_all_files_and_lists_all_problems(capsys: Output, tmp_path: Path) -> None:
    bad = tmp_path / "bad.yaml"
    bad.write_text(shipped.experiments()["letter_t"].read_text() + "seed: 2\nlog: {flush_s: -1}\n")
    assert app.main(["validate", "letter_t", str(bad), "nothing", "letter_i"]) == 2
    captured = capsys.readouterr()
    assert captured.out == "letter_t: ok\nletter_i: ok\n"
    lines = captured.err.splitlines()
    assert len(lines) == 3
    assert "duplicate key" in lines[0]
    assert "log.flush_s: must be > 0" in lines[1]
    assert "no experiment named 'nothing'" in lines[2]


def test_validate_takes_robots_and_answers_in_json(capsys: Output) -> None:
    assert app.main(["validate", "--robot", "tcr600", "tcr700", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {"status": "ok", "valid": ["tcr600", "tcr700"]}
    assert app.main(["validate", "--robot", "tcr600", "--json", "--set", "tip.ring=99"]) == 2
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == "error"
    assert answer["problems"] == ["--set tip.ring: there is no ring 99; rings are 0 (base) to 11"]


def test_new_writes_a_valid_file_with_all_comments_and_never_overwrites(
    capsys: Output, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.main(["new", "mine", "--from", "letter_i"]) == 0
    assert capsys.readouterr().out == "mine.yaml\n"
    mine, start = load_spec("mine.yaml").spec, load_spec("letter_i").spec
    assert mine.model_copy(update={"name": start.name, "source": start.source}) == start
    before = Path("mine.yaml").read_bytes()
    assert before.count(b"#") == shipped.experiments()["letter_i"].read_bytes().count(b"#")
    assert app.main(["new", "mine"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert Path("mine.yaml").read_bytes() == before


def test_new_keeps_a_robot_file_of_ones_own_in_reach(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "robots").mkdir()
    (tmp_path / "sub").mkdir()
    Path("robots/own.yaml").write_bytes(shipped.robots()["tcr600"].read_bytes())
    text = shipped.experiments()["letter_t"].read_text()
    Path("first.yaml").write_text(text.replace("robot: tcr600", "robot: robots/own.yaml"))
    assert app.main(["new", "sub/second", "--from", "first.yaml"]) == 0
    assert load_spec("sub/second.yaml").robot_path.resolve() == Path("robots/own.yaml").resolve()


def test_a_new_robot_says_behind_every_key_what_it_means(
    capsys: Output, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.main(["new", "--robot", "mine", "--from", "tcr700"]) == 0
    assert capsys.readouterr().out == "mine.yaml\n"
    assert load_robot("mine.yaml").model_copy(update={"name": "tcr700"}) == load_robot("tcr700")
    lines = Path("mine.yaml").read_text().splitlines()
    keys = [line for line in lines if re.match(r" *\w+:", line) and not line.startswith("name:")]
    assert len(keys) > 20
    assert all(" # " in line for line in keys)
    before = Path("mine.yaml").read_bytes()
    assert app.main(["new", "--robot", "mine"]) == 2
    assert "exists already" in capsys.readouterr().err
    assert Path("mine.yaml").read_bytes() == before


@pytest.mark.parametrize("name", ["a b", "/proc/nowhere/x"])
def test_new_leaves_no_file_behind_when_it_fails(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert app.main(["new", name]) in (2, 5)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.slow
@pytest.mark.parametrize("arguments", [["schema"], ["schema", "--robot"]])
def test_the_schema_knows_the_keys_and_units_of_every_shipped_file(
    arguments: list[str], capsys: Output
) -> None:
    assert app.main(arguments) == 0
    schema = json.loads(capsys.readouterr().out)
    files = shipped.robots() if "--robot" in arguments else shipped.experiments()
    for path in files.values():
        data = strict_yaml.load(path).data
        assert set(data) <= set(schema["properties"])
        assert set(schema["required"]) <= set(data)
    text = json.dumps(schema)
    assert '"unit": "N"' in text


def test_the_schema_allows_off_where_the_file_may_say_off(capsys: Output) -> None:
    app.main(["schema"])
    definitions = json.loads(capsys.readouterr().out)["$defs"]
    assert {"const": "off"} in definitions["IocSettings"]["properties"]["tension"]["anyOf"]
    assert {"const": "off"} in definitions["SimulatedSettings"]["properties"]["mismatch"]["anyOf"]


@pytest.mark.slow
@pytest.mark.parametrize("verb", sorted(app.VERBS))
def test_every_verb_explains_itself_with_an_example(verb: str, capsys: Output) -> None:
    assert app.main([verb, "--help"]) == 0
    assert f"tcrctl {verb}" in capsys.readouterr().out.split("Example", 1)[1]


@pytest.mark.slow
@pytest.mark.parametrize(
    "arguments", [[], ["nonsense"], ["show"], ["list", "--nonsense"], ["show", "letter_q"]]
)
def test_wrong_usage_is_exit_code_2_and_nothing_but_help_goes_to_stdout(
    arguments: list[str], capsys: Output
) -> None:
    assert app.main(arguments) == 2
    captured = capsys.readouterr()
    assert captured.out == "" or not arguments
    assert captured.err or not arguments
    assert "Traceback" not in captured.err


@pytest.mark.parametrize(
    "arguments", [["show", "letter_q", "--json"], ["show", "--json"], ["list", "--json", "x"]]
)
def test_with_json_every_error_is_one_object_on_stdout(arguments: list[str], capsys: Output) -> None:
    assert app.main(arguments) == 2
    answer = json.loads(capsys.readouterr().out)
    assert answer["status"] == "error"
    assert answer["reason"]


@pytest.mark.parametrize(
    ("raised", "code", "words"),
    [
        (ZeroDivisionError("by zero"), 1, "internal error: ZeroDivisionError: by zero"),
        (PermissionError(13, "Permission denied", "x.yaml"), 5, "Permission denied"),
        (KeyboardInterrupt(), 130, ""),
    ],
)
def test_whatever_a_verb_raises_becomes_one_exit_code(
    raised: BaseException, code: int, words: str, capsys: Output, monkeypatch: pytest.MonkeyPatch
) -> None:
    def broken() -> None:
        raise raised

    monkeypatch.delenv("TCRCTL_TRACEBACK", raising=False)
    monkeypatch.setitem(app.VERBS, "list", broken)
    assert app.main(["list"]) == code
    captured = capsys.readouterr()
    assert words in captured.err
    assert "Traceback" not in captured.err
    if code == 1:
        assert "TCRCTL_TRACEBACK" in captured.err
        monkeypatch.setenv("TCRCTL_TRACEBACK", "1")
        app.main(["list"])
        assert "Traceback" in capsys.readouterr().err


@pytest.mark.slow
def test_the_program_starts_without_the_numerical_libraries() -> None:
    heavy = "{'numba', 'scipy', 'mcap', 'numpy', 'rich'}"
    verbs = "['list'], ['validate', 'letter_t'], ['validate', '--robot', 'tcr700']"
    code = (
        f"import sys; from tcrctl.cli import app; codes = [app.main(verb) for verb in ({verbs})]; "
        f"print(sorted({heavy} & set(sys.modules)), codes)"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[] [0, 0, 0]"


@pytest.mark.slow
def test_the_module_runs_as_a_program_and_without_colour_off_a_terminal() -> None:
    environment = {**os.environ, "NO_COLOR": "1"}
    for arguments, code in ((["--version"], 0), (["show", "letter_q"], 2), (["show"], 2)):
        command = [sys.executable, "-m", "tcrctl.cli.app", *arguments]
        done = subprocess.run(command, capture_output=True, text=True, env=environment)
        assert done.returncode == code
        assert "\x1b" not in done.stdout + done.stderr
        if code == 0:
            assert re.fullmatch(
                rf"tcrctl {re.escape(__version__)}( \(commit [0-9a-f]{{12}}\))?\n", done.stdout
            )


@pytest.mark.parametrize("name", ["./nowhere.yaml", "/dev/zero", "."])
def test_what_cannot_be_validated_is_named_once(name: str, capsys: Output) -> None:
    assert app.main(["validate", name]) == 2
    said = capsys.readouterr().err
    assert said.startswith(f"error: {name}")
    assert said.count(f"{name}:") == 1
