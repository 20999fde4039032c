"""``tcrctl list``: what comes with the program."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tcrctl.cli.options import AsJson


def list_shipped(as_json: AsJson = False) -> None:
    """List the shipped experiments, identifications, studies, robots and rigs.

    Examples:
      tcrctl list
      tcrctl list --json | jq -r '.experiments[].name'
    """
    from tcrctl.config import shipped

    experiments = [
        _entry(name, path, ("description", "robot", "source")) for name, path in shipped.experiments().items()
    ]
    identifications = [
        _entry(name, path, ("description", "robot", "source"))
        for name, path in shipped.identifications().items()
    ]
    studies = [_entry(name, path, ("description",)) for name, path in shipped.studies().items()]
    robots = [_entry(name, path, ("description",)) for name, path in shipped.robots().items()]
    rigs = [_entry(name, path, ("description",)) for name, path in shipped.rigs().items()]
    if as_json:
        found = {
            "experiments": experiments,
            "identifications": identifications,
            "studies": studies,
            "robots": robots,
            "rigs": rigs,
        }
        print(json.dumps(found))
        return
    print_columns(("EXPERIMENT", "ROBOT", "DESCRIPTION"), ("name", "robot", "description"), experiments)
    print()
    print_columns(
        ("IDENTIFICATION", "ROBOT", "DESCRIPTION"), ("name", "robot", "description"), identifications
    )
    print()
    print_columns(("STUDY", "DESCRIPTION"), ("name", "description"), studies)
    print()
    print_columns(("ROBOT", "DESCRIPTION"), ("name", "description"), robots)
    print()
    print_columns(("RIG", "DESCRIPTION"), ("name", "description"), rigs)


def _entry(name: str, path: Path, keys: Sequence[str]) -> dict[str, Any]:
    """Return some text values of a file that may be invalid, without validating it."""
    from tcrctl.config import strict_yaml
    from tcrctl.errors import InputError

    try:
        data = strict_yaml.load(path).data
    except InputError:
        data = None
    values = (
        data
        if isinstance(data, dict)
        else {"description": f"not readable; see: tcrctl validate {shlex.quote(str(path))}"}
    )
    return {"name": name, **{key: str(values.get(key) or "") for key in keys}, "path": str(path)}


def print_columns(titles: Sequence[str], keys: Sequence[str], rows: Sequence[dict[str, Any]]) -> None:
    """Print rows in columns as wide as they need.

    Args:
        titles: Of the columns.
        keys: Of their values in the rows.
        rows: Text by key.
    """
    cells = [list(titles), *([row[key] for key in keys] for row in rows)]
    widths = [max(len(row[i]) for row in cells) for i in range(len(keys))]
    for row in cells:
        print("  ".join(text.ljust(width) for text, width in zip(row, widths, strict=True)).rstrip())
