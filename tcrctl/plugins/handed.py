"""What flows round the loop, as code of others gets and gives it: copies, so that nothing recorded changes."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any, TypeVar, cast

import numpy as np

Given = TypeVar("Given")


def handed(given: Given) -> Given:
    """Return the same with copies of all arrays in it, also of those in dataclasses within it.

    Args:
        given: An array, or a dataclass of arrays, such as a Measurement; anything else is returned as it is.
    """
    found: Any = given
    made: Any = given
    if isinstance(found, np.ndarray):
        made = found.copy()
    elif is_dataclass(found) and not isinstance(found, type):
        made = replace(found, **{field.name: handed(getattr(found, field.name)) for field in fields(found)})
    return cast("Given", made)
