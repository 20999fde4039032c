"""Nothing of a rig moves before somebody has agreed."""

from __future__ import annotations

import io

import pytest

from tcrctl.cli.consent import ask, check_can_ask
from tcrctl.errors import InputError


class Terminal(io.StringIO):
    def isatty(self):
        return True


@pytest.mark.parametrize(
    ("answer", "agreed"),
    [("y\n", True), ("YES\n", True), ("\n", False), ("no\n", False), ("", False), ("yep\n", False)],
)
def test_only_a_yes_is_a_yes(answer, agreed, monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", Terminal(answer))
    if agreed:
        ask("The robot moves.")
    else:
        with pytest.raises(InputError, match="nothing has moved"):
            ask("The robot moves.")
    printed = capsys.readouterr()
    assert printed.out == ""
    assert printed.err.startswith("The robot moves. Is the emergency stop within reach")


def test_without_a_terminal_nobody_is_asked(monkeypatch, capsys):
    monkeypatch.setattr("sys.stdin", io.StringIO("y\n"))
    for question in (check_can_ask, lambda: ask("The robot moves.")):
        with pytest.raises(InputError) as caught:
            question()
        assert "--yes" in caught.value.hint
    assert capsys.readouterr().err == ""
