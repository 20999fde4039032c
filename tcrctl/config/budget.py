"""What a file from anywhere may cost: everything larger is refused before it is built.

A few hundred bytes of YAML can stand for gigabytes, because an alias repeats whatever it stands for.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from yaml.nodes import MappingNode, Node, ScalarNode

#: Largest file that is read as YAML or as a table [bytes].
MAX_BYTES: Final = 2 * 2**20
#: Most values, keys included, of one file with every alias written out.
MAX_VALUES: Final = 10_000
#: Most characters of them.
MAX_CHARACTERS: Final = 4 * 2**20
#: A file nested deeper is a mistake or an attack, and would exhaust the stack.
MAX_DEPTH: Final = 100
#: So many problems of one file are listed.
MAX_PROBLEMS: Final = 100


@dataclass(frozen=True, slots=True)
class Size:
    """Size of a node with every alias in it written out.

    Attributes:
        values: Number of values and keys.
        characters: Characters of them.
        depth: Levels of maps and lists.
    """

    values: int
    characters: int
    depth: int

    @property
    def excess(self) -> str:
        """What is too large, a sentence; empty if nothing is."""
        if self.depth > MAX_DEPTH:
            return f"nested more than {MAX_DEPTH} levels deep"
        if self.values > MAX_VALUES:
            return f"more than {MAX_VALUES} values with every alias written out"
        if self.characters > MAX_CHARACTERS:
            return f"more than {MAX_CHARACTERS} characters with every alias written out"
        return ""


class Budget:
    """Measures nodes, each once however often it is used."""

    def __init__(self) -> None:
        self._sizes: dict[int, Size] = {}
        self._open: set[int] = set()

    def first_excess(self, node: Node) -> tuple[Node, str] | None:
        """Return the innermost node that is too large, and what of it is; None if all fit."""
        if id(node) in self._sizes or id(node) in self._open:  # an alias to itself is refused elsewhere
            return None
        self._open.add(id(node))
        for child in _children(node):
            found = self.first_excess(child)
            if found is not None:
                return found
        self._open.discard(id(node))
        size = self._sizes[id(node)] = self._size(node)
        return (node, size.excess) if size.excess else None

    def _size(self, node: Node) -> Size:
        if isinstance(node, ScalarNode):
            return Size(1, len(node.value), 0)
        below = [self._sizes[id(child)] for child in _children(node) if id(child) in self._sizes]
        values = 1 + sum(size.values for size in below)
        return Size(values, sum(s.characters for s in below), 1 + max((s.depth for s in below), default=0))


def _children(node: Node) -> list[Node]:
    if isinstance(node, MappingNode):
        return [part for pair in node.value for part in pair]
    return [] if isinstance(node, ScalarNode) else list(node.value)
