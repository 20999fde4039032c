"""``tcrctl kinds``: what every section of an experiment or rig file can be, and where it comes from."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from tcrctl.cli.options import AsJson
from tcrctl.cli.table import print_table

if TYPE_CHECKING:
    from tcrctl.config.settings import Settings


def kinds(as_json: AsJson = False) -> None:
    """List the kinds of trajectory, controller, estimator, plant and task, and of cameras and drives of a bench.

    They are built in, or registered by a package. An experiment or rig file may also name a module or a file:
    kind: my_package:NAME or kind: ./my_file.py:NAME.

    Examples:
      tcrctl kinds
      tcrctl kinds --json | jq -r '.[] | select(.from != "tcrctl") | .kind'
    """
    rows = list(_rows())
    if as_json:
        print(json.dumps(rows))
        return
    keys = ("section", "kind", "from", "description")
    print_table([key.upper() for key in keys], [[row[key] for key in keys] for row in rows])


def _rows() -> Iterator[dict[str, str]]:
    from tcrctl.experiment.plugged import BASES, built_in
    from tcrctl.experiment.spec import ExperimentSpec
    from tcrctl.plant.rig import plugged
    from tcrctl.plugins.groups import DEVICES, GROUPS

    for section in GROUPS:
        yield from _section(section, built_in(ExperimentSpec, section), BASES[section])
    for section in DEVICES:
        yield from _section(section, plugged.built_in(section), plugged.BASES[section])


def _section(
    section: str, known: Mapping[str, type[Settings]], base: type[Settings]
) -> Iterator[dict[str, str]]:
    from tcrctl.plugins.groups import package_of, registered

    for kind, settings in known.items():
        yield _row(section, kind, "tcrctl", (settings.__doc__ or "").splitlines()[0])
    for point in registered(section):
        taken = point.name in known
        yield _row(section, point.name, package_of(point), _described(section, point.name, base, taken=taken))


def _row(section: str, kind: str, source: str, description: str) -> dict[str, str]:
    return {"section": section, "kind": kind, "from": source, "description": description}


def _described(section: str, kind: str, base: type[Settings], *, taken: bool) -> str:
    """Return the first line about a registered kind, or why it cannot be used."""
    from pathlib import Path

    from tcrctl.errors import InputError
    from tcrctl.plugins.plugin import settings_of

    if taken:
        return "cannot be used: a built-in kind has this name"
    try:
        settings = settings_of(section, kind, base, Path)
    except InputError as error:
        return f"cannot be used: {error}"
    return ((settings.__doc__ if settings else "") or "").strip().partition("\n")[0]
