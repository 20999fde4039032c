"""Results of ``tcrctl rig`` as rows for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tcrctl.cli.console import console, escaped

if TYPE_CHECKING:
    from tcrctl.commissioning.finding import Finding
    from tcrctl.robot.description import RobotDescription


def cable_names(description: RobotDescription) -> tuple[str, ...]:
    """Return the names of the cables in the order of the drives."""
    from tcrctl.robot.description import cable_routes

    return tuple(route.name for route in cable_routes(description))


def flat(value: dict[str, Any], prefix: str = "") -> dict[str, str]:
    """Write a result as one text per number, by its path; what is not known is left out."""
    rows: dict[str, str] = {}
    for key, item in value.items():
        if isinstance(item, dict):
            rows |= flat(item, f"{prefix}{key} ")
        elif item is not None:
            rows[prefix + key] = _text(item)
    return rows


def _text(item: Any) -> str:
    if isinstance(item, bool):
        return "yes" if item else "no"
    return f"{item:.3f}" if isinstance(item, float) else str(item)


def print_rows(title: str, rows: dict[str, str]) -> None:
    """Print a title and rows."""
    print(title)
    width = max(map(len, rows), default=0)
    for name, text in rows.items():
        print(f"  {name.ljust(width)}  {text}")


def print_findings(lines: list[tuple[str, Finding]]) -> None:
    """Print what a check found, by robot."""
    from rich.table import Table

    table = Table(show_header=False, box=None)
    for style in ("bold", "", "", ""):
        table.add_column(style=style, overflow="fold")
    for robot, finding in lines:
        verdict = "[green]ok[/green]" if finding.exit_code == 0 else "[red]NOT OK[/red]"
        table.add_row(escaped(robot), escaped(finding.what), verdict, escaped(finding.text))
    console().print(table)
