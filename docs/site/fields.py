"""The page of all fields of the log, from its schema and the records' own words."""

from __future__ import annotations

from pathlib import Path
from typing import Final

from tcrctl.analysis.table import ERRORS
from tcrctl.log.columns import COLUMNS, meanings
from tcrctl.log.schema import MESSAGES, SPARSE
from tcrctl.log.viewer_topics import SCENE_RATE_HZ, TOPICS, VIEWER_RATE_HZ

_HEAD: Final = """# Every field of the log

Made from the schema that every log carries. How a log is laid out, and what is promised of it, is in
[the log](../docs/log.md).

## `/tcrctl/step`, one message per control step

The path is that of viewers, `/tcrctl/step.PATH`; the column is the name in `Run.columns` and, with its unit, in
`tcrctl export`. Fields with a star are left out of lean steps.

| path | type | column | unit | meaning |
| --- | --- | --- | --- | --- |
"""


def write(path: Path) -> None:
    """Write the page."""
    path.write_text(page(), encoding="utf-8")


def page() -> str:
    """Return the page."""
    return "\n".join([_HEAD + "\n".join(_steps()), _events(), _derived(), _errors()])


def _steps() -> list[str]:
    said, lean = meanings(), _left_out()
    return [
        _row(f"`{c.path}`{'*' * (c.path in lean)}", c.kind, f"`{name}`", c.unit, said.get(name, ""))
        for name, c in COLUMNS.items()
    ]


def _left_out() -> set[str]:
    """Return the paths of what lean steps leave out."""
    of = {field.name: field.kind for field in MESSAGES["Step"]}
    return {f"{part}.{name}" for part, kind in of.items() for message, name in SPARSE if message == kind}


def _events() -> str:
    rows = [_row(f"`{field.name}`", field.kind, field.unit) for field in MESSAGES["Event"]]
    return "\n## `/tcrctl/event`\n\n| field | type | unit |\n| --- | --- | --- |\n" + "\n".join(rows)


def _derived() -> str:
    rows = [_row(f"`{topic}`", f"`{kind.DESCRIPTOR.full_name}`") for topic, kind in TOPICS.items()]
    rows.append(_row("`/log`", "`foxglove.Log`"))
    return (
        f"\n## Topics for viewers\n\nDerived from the steps and rounded; at most {VIEWER_RATE_HZ:g} per second, of "
        f"`/scene` {SCENE_RATE_HZ:g}.\n\n| topic | schema |\n| --- | --- |\n" + "\n".join(rows)
    )


def _errors() -> str:
    rows = [_row(f"`{name}`", *told) for name, told in ERRORS.items()]
    head = "\n## What an export adds\n\n| column | unit | meaning |\n| --- | --- | --- |\n"
    return head + "\n".join(rows) + "\n"


def _row(*cells: str) -> str:
    return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"
