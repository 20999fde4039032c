"""Options that several verbs share, spelt and explained once."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

Spec: TypeAlias = Annotated[
    str, typer.Argument(metavar="SPEC", help="Shipped experiment, or path of a YAML file.")
]
Overrides: TypeAlias = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Replace a value, e.g. controller.period_s=0.1; repeatable."
    ),
]
AsJson: TypeAlias = Annotated[bool, typer.Option("--json", help="Print one JSON object on stdout.")]
IsRobot: TypeAlias = Annotated[bool, typer.Option("--robot", help="Robot files instead of experiments.")]
