"""``--set plant.kind=rig`` on a file written for another kind: the keys of the former kind are left out.

A key is left out only if the new kind does not know it, the former kind does, and the file gives it, not the
command line: a misspelt key is still an error.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

from pydantic import BaseModel

from tcrctl.config.strict_yaml import Document
from tcrctl.config.unions import kind_of, models_in


def without_former_keys(
    document: Document, written: Any, model: type[BaseModel]
) -> tuple[Document, tuple[str, ...]]:
    """Leave out what belongs to kinds that ``--set`` has replaced.

    Args:
        document: With ``--set`` applied.
        written: Its data as the file gives them.
        model: Settings class of the whole document.

    Returns:
        The document without those keys, and one sentence for every section that lost some.
    """
    if not isinstance(document.data, dict) or not isinstance(written, dict):
        return document, ()
    data, notes = dict(document.data), []
    for section, before, after in _switched(written, document.data):
        kinds = {kind_of(kind): kind for kind in _members(model, section)}
        if before["kind"] not in kinds or after["kind"] not in kinds:
            continue
        former, new = kinds[before["kind"]].model_fields, kinds[after["kind"]].model_fields
        lost = [key for key in after if key in before and key in former and key not in new]
        lost = [key for key in lost if not document.where((section, key)).startswith("--set")]
        if lost:
            data[section] = {key: value for key, value in after.items() if key not in lost}
            names = ", ".join(f"{section}.{key}" for key in lost)
            notes.append(
                f"{names}: left out, because {section}.kind is {after['kind']}, not {before['kind']}"
            )
    return replace(document, data=data), tuple(notes)


def _switched(before: dict[str, Any], after: dict[str, Any]) -> Iterator[tuple[str, Any, Any]]:
    for section, new in after.items():
        old = before.get(section)
        if isinstance(old, dict) and isinstance(new, dict) and {"kind"} <= old.keys() & new.keys():
            known = isinstance(old["kind"], str) and isinstance(new["kind"], str)
            if known and old["kind"] != new["kind"]:
                yield section, old, new


def _members(model: type[BaseModel], section: str) -> list[type[BaseModel]]:
    field = model.model_fields.get(section)
    return [] if field is None else [found for found, _ in models_in(field.annotation)]
