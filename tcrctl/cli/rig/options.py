"""Arguments that the verbs of ``tcrctl rig`` share."""

from __future__ import annotations

from typing import Annotated, TypeAlias

import typer

Rig: TypeAlias = Annotated[str, typer.Argument(metavar="RIG", help="Shipped rig, or path of a rig file.")]
Robot: TypeAlias = Annotated[
    str | None, typer.Option("--robot", metavar="NAME", help="Which robot, if several hang on the rig.")
]
DryRun: TypeAlias = Annotated[
    bool, typer.Option("--dry-run", help="Look, but write nothing and move nothing.")
]
Yes: TypeAlias = Annotated[bool, typer.Option("--yes", help="Agree in advance; nobody is asked.")]
