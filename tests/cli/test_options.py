"""Laws of options in groups: the command line has every field as an option, the verb gets them together."""

from __future__ import annotations

import inspect
from dataclasses import dataclass
from typing import Annotated

import pytest
import typer
from typer.testing import CliRunner

from tcrctl.cli.app import RIG_VERBS, VERBS
from tcrctl.cli.options import unfolded


@dataclass(frozen=True)
class Group:
    needed: Annotated[str, typer.Option("--needed")]
    often: Annotated[int, typer.Option("--often")] = 3


def made():
    """An application with one verb, and what the verb was given."""
    seen = []

    @unfolded
    def verb(what: Annotated[str, typer.Argument()], group: Group, last: bool = False) -> None:
        """Do something."""
        seen.append((what, group, last))

    app = typer.Typer()
    app.command()(verb)
    return app, seen


def test_the_verb_gets_the_fields_of_a_group_together():
    app, seen = made()
    assert CliRunner().invoke(app, ["a", "--needed", "b", "--last"]).exit_code == 0
    assert CliRunner().invoke(app, ["a", "--needed", "b", "--often", "5"]).exit_code == 0
    assert seen == [("a", Group("b"), True), ("a", Group("b", 5), False)]


def test_a_field_without_a_default_is_required():
    app, seen = made()
    assert CliRunner().invoke(app, ["a"]).exit_code == 2
    assert seen == []


@pytest.mark.parametrize("verb", [*VERBS.values(), *RIG_VERBS.values()], ids=lambda verb: verb.__name__)
def test_no_group_is_left_for_the_command_line(verb):
    assert not any(
        isinstance(parameter.annotation, type) and hasattr(parameter.annotation, "__dataclass_fields__")
        for parameter in inspect.signature(verb, eval_str=True).parameters.values()
    )
