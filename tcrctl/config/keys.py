"""Where a value stands in a document: keys and list indices from the top."""

from __future__ import annotations

from typing import TypeAlias

Keys: TypeAlias = tuple[str | int, ...]
"""Keys and list indices from the top of a document to one of its values."""

Finding: TypeAlias = tuple[Keys, str]
"""Where something is wrong, and what."""


def dotted(keys: Keys) -> str:
    """Return keys as they are written for people: ``legs.0.drives_mm``."""
    return ".".join(map(str, keys))
