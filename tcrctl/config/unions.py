"""Settings that are told apart by ``kind``: which ones an annotation names, and what their kinds are called."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, TypeAlias, get_args

from pydantic import BaseModel, Tag

Tagged: TypeAlias = tuple[type[BaseModel], str]
"""A settings class and its tag in a union; the tag is empty if the union has none."""


def kind_of(model: type[BaseModel]) -> str:
    """Return the ``kind`` of a settings class; empty if it has none."""
    field = model.model_fields.get("kind")
    names = get_args(field.annotation) if field else ()
    return str(names[0]) if names else ""


def models_in(annotation: Any, tag: str = "") -> Iterator[Tagged]:
    """Yield the settings classes named anywhere in an annotation, each with its tag."""
    if isinstance(annotation, type) and issubclass(annotation, BaseModel):
        yield annotation, tag
        return
    parts = get_args(annotation)
    tag = next((part.tag for part in parts if isinstance(part, Tag)), tag)
    for part in parts:
        yield from models_in(part, tag)
