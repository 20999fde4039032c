"""Commands that the documents show: all are ones that there are; pages to be followed work as they stand."""

from __future__ import annotations

import re
from contextlib import suppress
from pathlib import Path

import matplotlib
import pytest
import typer

from support.shown_commands import blocks, shown, with_files
from support.typed_commands import is_quick, put_files, shortened, why_not
from tcrctl.cli.app import VERBS, build_app, main
from tcrctl.cli.rig.verbs import RIG_VERBS
from tcrctl.config import shipped
from tcrctl.errors import InputError

ROOT = Path(__file__).parents[1]
FOLDERS = ("docs", "examples", "hardware")
DOCUMENTS = sorted([*ROOT.glob("*.md"), *(path for name in FOLDERS for path in (ROOT / name).rglob("*.md"))])
#: Pages that are typed whole.
TYPED = ("start.md", "robot.md")
#: Exit codes that a page tells its reader to expect.
EXPECTED = {"diff": 3}
ALL = [
    pytest.param(arguments, id=f"{path.stem}: {' '.join(arguments)}"[:90])
    for path in DOCUMENTS
    for arguments in shown(path.read_text())
]


@pytest.fixture(scope="module")
def app():
    return typer.main.get_command(build_app())


def taken_apart(app, arguments):
    """Let verb and options be read as for a run, without running anything."""
    command, context = app, None
    rest = [part for argument in arguments for part in [argument] * (1 + ("*_" in argument))]  # several files
    while hasattr(command, "commands") and rest and rest[0] != "--help":
        name = rest.pop(0)
        assert name in command.commands, f"there is no verb {name}"
        command = command.commands[name]
    with suppress(
        InputError, typer.Exit
    ):  # a log that stands for the reader's; an option that prints and ends
        command.make_context(command.name, rest, parent=context)


def test_the_documents_show_commands_of_nearly_every_verb():
    verbs = {arguments.values[0][0] for arguments in ALL}
    assert len(ALL) > 70
    assert set(VERBS) - verbs <= {"kinds", "recover", "schema"}


@pytest.mark.parametrize("arguments", ALL)
def test_every_shown_command_has_the_verb_and_the_options_that_there_are(app, arguments):
    taken_apart(app, arguments)


@pytest.mark.parametrize("wrong", [["runn", "letter_t"], ["run", "letter_t", "--sett", "a=1"], ["export"]])
def test_a_command_that_is_none_would_be_noticed(app, wrong):
    with pytest.raises((AssertionError, typer.BadParameter, Exception), match=r"verb|such option|[Mm]issing"):
        taken_apart(app, wrong)


@pytest.mark.parametrize("document", DOCUMENTS, ids=lambda path: str(path.relative_to(ROOT)))
def test_every_verb_that_is_named_in_a_sentence_exists(document):
    named = re.findall(r"`tcrctl (rig )?([a-z]+)", document.read_text())
    assert {
        verb for rig, verb in named if verb not in (RIG_VERBS if rig else {**VERBS, "rig": None})
    } == set()


@pytest.fixture
def folder(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    return tmp_path


def typed(page, capsys):
    """Type the commands of a page from the top; return those that did not end as they should."""
    wrong = []
    for arguments in shown((ROOT / "docs" / page).read_text(), ("sh",)):
        code = main(with_files(arguments))
        said = capsys.readouterr()
        if code != EXPECTED.get(arguments[0], 0):
            wrong.append((arguments, code, said.err))
    return wrong


#: What makes the quick start's experiments short: text of their files, and what is there instead.
SHORTER = {
    "letter_t": {
        "[[-30, 40], [30, 40]]": "[[-3, 4], [3, 4]]",
        "[[0, 40], [0, -40]]": "[[0, 4], [0, -4]]",
        "offset_mm: [0, 0, 40]": "offset_mm: [0, 0, 6]",
        "lead_in_s: 1.0": "lead_in_s: 0.2",
        "dwell_s: 1.0": "dwell_s: 0",
        "settle_s: 3.0": "settle_s: 0.2",
    },
    "dynamic_10s": {
        "tilt_deg: [20, 20]": "tilt_deg: [2, 2]",
        "turn_s: 3.5": "turn_s: 0.7",
        "ramp_s: 1.5": "ramp_s: 0.3",
        "in_s: 2.5": "in_s: 0.5",
        "out_s: 2.5": "out_s: 0.5",
    },
}


@pytest.fixture(params=["short experiments", pytest.param("as shipped", marks=pytest.mark.thorough)])
def length(request, tmp_path_factory, monkeypatch):
    """Shipped experiments whose files are shorter, or those that there are."""
    if request.param == "as shipped":
        return
    files, shorter = shipped.experiments(), tmp_path_factory.mktemp("shipped")
    for name, changes in SHORTER.items():
        text = files[name].read_text()
        for old, new in changes.items():
            assert old in text, (name, old)
            text = text.replace(old, new)
        files[name] = shorter / f"{name}.yaml"
        files[name].write_text(text)
    monkeypatch.setattr(shipped, "experiments", lambda: files)


@pytest.mark.slow
@pytest.mark.usefixtures("length")
def test_the_quick_start_works_as_it_stands(folder, capsys):
    assert typed("start.md", capsys) == []


@pytest.mark.thorough
@pytest.mark.slow
def test_the_guide_to_a_robot_of_ones_own_works_as_it_stands(folder, capsys):
    assert typed("robot.md", capsys) == []
    (script,) = blocks((ROOT / "docs" / "robot.md").read_text(), ("python",))
    exec(compile(script, "robot.md", "exec"), {})
    told = capsys.readouterr().out
    assert "tensions [N]" in told
    assert "vibrations [Hz]" in told


@pytest.mark.slow
def test_every_shown_command_that_takes_no_time_works(folder, capsys):
    """The others: ``nox -s typed``, which takes its time."""
    put_files(folder)
    typed, wrong = set(), []
    for document in DOCUMENTS:
        if document.name in TYPED:
            continue
        for arguments in shown(document.read_text()):
            if is_quick(arguments) and not why_not(arguments) and tuple(arguments) not in typed:
                typed.add(tuple(arguments))
                code = main(shortened(arguments))
                said = capsys.readouterr()
                wrong += [(arguments, code, said.err)] if code else []
    assert wrong == []
    assert len(typed) >= 8


@pytest.mark.slow
def test_the_notebook_runs_without_jupyter(folder):
    matplotlib.use("agg")
    cells = list(blocks((ROOT / "docs" / "notebook.md").read_text(), ("{code-cell} python",)))
    names: dict[str, object] = {}
    for cell in cells:
        exec(compile(cell, "notebook.md", "exec"), names)
    assert len(cells) == 5
    assert 0 < 1e3 * names["run"].error.max() < 2  # type: ignore[attr-defined]
    assert 0 < 1e3 * max(names["errors"]) < 10  # type: ignore[call-overload]
