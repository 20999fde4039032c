"""``tcrctl list``: what comes with the program."""

from __future__ import annotations

import json
import shlex
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from tcrctl.cli.options import AsJson
from tcrctl.cli.table import print_table

_SHOWN = ("name", "robot", "description")
_TITLES = {
    "experiments": "EXPERIMENT",
    "identifications": "IDENTIFICATION",
    "studies": "STUDY",
    "robots": "ROBOT",
    "rigs": "RIG",
}


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
    found = {
        "experiments": experiments,
        "identifications": identifications,
        "studies": studies,
        "robots": robots,
        "rigs": rigs,
    }
    if as_json:
        print(json.dumps(found))
        return
    for i, (kind, entries) in enumerate(found.items()):
        keys = [key for key in _SHOWN if key in entries[0]] if entries else []
        if i and keys:
            print()
        titles = [_TITLES[kind], *(key.upper() for key in keys[1:])]
        print_table(titles, [[entry[key] for key in keys] for entry in entries])


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
