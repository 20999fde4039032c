"""Types of a kernel's arguments as words that people can read, and back.

================================  ===============================================================
``float64``, ``int64``, ``bool``  a number
``float64[:, ::1]``               an array with its layout, as numba writes it
``readonly float64[::1]``         one that may not be changed
``none``                          None
``literal 3``                     a number that the compiler knows
``optional float64``              a value or None
``omitted 3``                     an argument that is left out, with its default in JSON
anything else                     a tuple of the table, named after its class
================================  ===============================================================
"""

from __future__ import annotations

import importlib
import json
import re
from collections.abc import Mapping, Sequence
from typing import Any, Final

import numba

types: Any = numba.types  # without types of their own
_ARRAY: Final = re.compile(r"(readonly )?(\w+)\[([:1, ]+)\]")
#: Class of the table's plain tuples.
_PLAIN: Final = "tuple"


class TypeWords:
    """Words for types; tuples are listed in a table because they are long.

    Attributes:
        tuples: For the name of each, its class as ``module:name`` and after it the words of its fields.
    """

    def __init__(self, tuples: Mapping[str, Sequence[str]] | None = None):
        """Take a table; an empty one if None."""
        self.tuples = {name: tuple(words) for name, words in (tuples or {}).items()}
        self._types: dict[str, Any] = {}

    def type_of(self, word: str) -> Any:
        """Return the type that a word stands for.

        Raises:
            ValueError: If it stands for none.
            ImportError, AttributeError: If a class is not there.
        """
        if word not in self._types:
            self._types[word] = self._read(word)
        return self._types[word]

    def word_of(self, found: Any) -> str:
        """Return the word for a type, and list it if it is a tuple.

        Raises:
            ValueError: If there is none.
        """
        word = self._listed(found) if isinstance(found, types.BaseTuple) else _simple(found, self)
        if self.type_of(word) != found:
            raise ValueError(f"{found} cannot be told in words")
        return word

    def _read(self, word: str) -> Any:
        if word in self.tuples:
            origin, *fields = self.tuples[word]
            inner = tuple(self.type_of(field) for field in fields)
            return types.BaseTuple.from_types(inner, None if origin == _PLAIN else _class(origin))
        first, _, rest = word.partition(" ")
        if first == "literal":
            return types.literal(int(rest))
        if first == "optional":
            return types.Optional(self.type_of(rest))
        if first == "omitted":
            return types.Omitted(json.loads(rest))
        return types.none if word == "none" else _array(word) or _number(word)

    def _listed(self, found: Any) -> str:
        origin = getattr(found, "instance_class", None)
        name = _PLAIN if origin is None else f"{origin.__module__}:{origin.__qualname__}"
        entry = (name, *(self.word_of(field) for field in found.types))
        for word, known in self.tuples.items():
            if known == entry:
                return word
        short = name.rpartition(":")[2]
        number = sum(known[0].rpartition(":")[2] == short for known in self.tuples.values())
        word = f"{short}.{number}"
        self.tuples[word] = entry
        return word


def _simple(found: Any, words: TypeWords) -> str:
    if isinstance(found, types.Array):
        readonly = "" if found.mutable else "readonly "
        return f"{readonly}{found.dtype}[{', '.join(_axes(found.ndim, found.layout))}]"
    if isinstance(found, types.IntegerLiteral):
        return f"literal {found.literal_value}"
    if isinstance(found, types.Optional):
        return f"optional {words.word_of(found.type)}"
    if isinstance(found, types.Omitted):
        return f"omitted {json.dumps(found.value)}"
    return str(found)


def _axes(count: int, layout: str) -> list[str]:
    axes = [":"] * count
    if layout in "CF":
        axes[-1 if layout == "C" else 0] = "::1"
    return axes


def _array(word: str) -> Any:
    match = _ARRAY.fullmatch(word)
    if match is None:
        return None
    readonly, dtype, axes = match[1], match[2], match[3].split(", ")
    layout = "C" if axes[-1] == "::1" else "F" if axes[0] == "::1" else "A"
    return types.Array(_number(dtype), len(axes), layout, readonly=readonly is not None)


def _number(word: str) -> Any:
    found = getattr(types, word, None)
    if not isinstance(found, types.Number | types.Boolean):
        raise ValueError(f"no type of an argument: {word}")
    return found


def _class(origin: str) -> Any:
    module, _, name = origin.partition(":")
    return getattr(importlib.import_module(module), name)
