"""Help of every verb: what the terminal shows is what a user can type."""

from __future__ import annotations

import pytest

from tcrctl.cli.app import RIG_VERBS, VERBS, main

CALLS = [[name] for name in VERBS] + [["rig", name] for name in RIG_VERBS]


def _help(call: list[str], capsys: pytest.CaptureFixture[str]) -> str:
    assert main([*call, "--help"]) == 0
    return capsys.readouterr().out


@pytest.mark.slow
@pytest.mark.parametrize("call", CALLS, ids=" ".join)
def test_help_shows_no_backslash_but_the_shells_line_continuation(
    call: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    lines = [line.rstrip() for line in _help(call, capsys).splitlines()]
    assert not [line for line in lines if "\\" in line.removesuffix("\\") or "\b" in line]


def test_help_of_export_names_the_extra_that_parquet_needs(capsys: pytest.CaptureFixture[str]) -> None:
    assert "'tcrctl[parquet]'" in _help(["export"], capsys)
