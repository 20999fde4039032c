"""Results of ``tcrctl rig`` as rows for people."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from tcrctl.plant.rig.finding import Finding
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
    from tcrctl.experiment.headline import number

    return number(item)


def print_rows(title: str, rows: dict[str, str]) -> None:
    """Print a title and rows."""
    from tcrctl.cli.table import print_facts

    styles = {"trouble": "red"}
    print_facts([(f"  {name}", text, styles.get(name, "")) for name, text in rows.items()], title)


def print_findings(lines: list[tuple[str, Finding]]) -> None:
    """Print what a check found, by robot."""
    from tcrctl.cli.table import print_table

    rows = [
        (robot, finding.what, "NOT OK" if finding.exit_code else "ok", finding.text)
        for robot, finding in lines
    ]
    styles = ["red" if finding.exit_code else "" for _, finding in lines]
    print_table(("robot", "check", "verdict", "found"), rows, styles=styles)
