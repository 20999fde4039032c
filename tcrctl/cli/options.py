"""Options that several verbs share, spelt and explained once."""

from __future__ import annotations

import functools
import inspect
from collections.abc import Callable
from dataclasses import MISSING, dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias, get_type_hints

import typer

if TYPE_CHECKING:
    from tcrctl.executors.engine import Engine

#: Variable of the environment that says where runs go.
LOGS = "TCRCTL_LOGS"

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
Quiet: TypeAlias = Annotated[
    bool, typer.Option("--quiet", "-q", help="Print errors only; with --json the object too.")
]
IsRobot: TypeAlias = Annotated[bool, typer.Option("--robot", help="Robot files instead of experiments.")]


def to_make(name: str | Path) -> Path:
    """Read an option that names a file or a folder to make.

    Raises:
        InputError: If it is ``-``, which stands for standard output elsewhere; ``./-`` is a file of that name.
    """
    from tcrctl.errors import InputError

    if name == "-":
        raise InputError("-: standard output cannot take this", hint="Give the name of a file or folder.")
    return Path(name)


@dataclass(frozen=True)
class SideBySide:
    """How work is done side by side."""

    jobs: Annotated[
        int | None,
        typer.Option(
            "--jobs", "-j", metavar="N", min=1, help="Processes side by side; default: physical cores."
        ),
    ] = None
    dask: Annotated[
        str | None,
        typer.Option(
            "--dask",
            metavar="ADDRESS",
            help="A Dask scheduler instead, or: local. Needs 'tcrctl\\[cluster]'.",
        ),
    ] = None

    @property
    def engine(self) -> Engine:
        """Where work is done."""
        from tcrctl.executors.engine import Engine, physical_cores

        return Engine(self.jobs or physical_cores(), self.dask)


def unfolded(verb: Callable[..., None]) -> Callable[..., None]:
    """Make every field of a parameter that is a dataclass an option of its own; typer knows no such groups.

    Args:
        verb: What a command does; its options have ``Annotated`` types, here or in the fields of dataclasses.
            Another verb may call it: fields that are not given keep their defaults.
    """
    hints = get_type_hints(verb, include_extras=True)
    groups: dict[str, Any] = {name: hint for name, hint in hints.items() if is_dataclass(hint)}
    parameters: list[inspect.Parameter] = []
    for parameter in inspect.signature(verb).parameters.values():
        if parameter.name in groups:
            parameters += _fields(groups[parameter.name])
        else:
            parameters.append(parameter.replace(annotation=hints[parameter.name]))

    @functools.wraps(verb)
    def command(**given: Any) -> None:
        for name, group in groups.items():
            told = [field.name for field in fields(group) if field.name in given]
            given[name] = group(**{key: given.pop(key) for key in told})
        verb(**given)

    command.__signature__ = inspect.Signature(parameters)  # type: ignore[attr-defined]
    command.__annotations__ = {parameter.name: parameter.annotation for parameter in parameters}
    return command


def _fields(group: Any) -> list[inspect.Parameter]:
    """Return the fields of a dataclass as parameters; one without a default is required."""
    hints = get_type_hints(group, include_extras=True)
    kind = inspect.Parameter.POSITIONAL_OR_KEYWORD
    required = inspect.Parameter.empty
    return [
        inspect.Parameter(
            field.name,
            kind,
            default=required if field.default is MISSING else field.default,
            annotation=hints[field.name],
        )
        for field in fields(group)
    ]
