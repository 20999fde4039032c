"""``tcrctl kinds``: what every section of an experiment can be, and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Iterator

from tcrctl.cli.list import print_columns
from tcrctl.cli.options import AsJson


def kinds(as_json: AsJson = False) -> None:
    """List the kinds of trajectory, controller, estimator and plant: built in, or registered by a package.

    An experiment may also name a module or a file: kind: my_package:NAME or
    kind: ./my_file.py:NAME.

    Examples:
      tcrctl kinds
      tcrctl kinds --json | jq -r '.[] | select(.from != "tcrctl") | .kind'
    """
    rows = list(_rows())
    if as_json:
        print(json.dumps(rows))
        return
    keys = ("section", "kind", "from", "description")
    print_columns([key.upper() for key in keys], keys, rows)


def _rows() -> Iterator[dict[str, str]]:
    from tcrctl.experiment.plugged import built_in
    from tcrctl.experiment.spec import ExperimentSpec
    from tcrctl.plugins.groups import GROUPS, package_of, registered

    for section in GROUPS:
        known = built_in(ExperimentSpec, section)
        for kind, settings in known.items():
            yield _row(section, kind, "tcrctl", (settings.__doc__ or "").splitlines()[0])
        for point in registered(section):
            yield _row(
                section,
                point.name,
                package_of(point),
                _described(section, point.name, taken=point.name in known),
            )


def _row(section: str, kind: str, source: str, description: str) -> dict[str, str]:
    return {"section": section, "kind": kind, "from": source, "description": description}


def _described(section: str, kind: str, *, taken: bool) -> str:
    """Return the first line about a registered kind, or why it cannot be used."""
    from pathlib import Path

    from tcrctl.errors import InputError
    from tcrctl.experiment.plugged import BASES
    from tcrctl.plugins.plugin import settings_of

    if taken:
        return "cannot be used: a built-in kind has this name"
    try:
        settings = settings_of(section, kind, BASES[section], Path)
    except InputError as error:
        return f"cannot be used: {error}"
    return ((settings.__doc__ if settings else "") or "").strip().partition("\n")[0]
