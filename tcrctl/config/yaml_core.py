"""From YAML text to data by the YAML 1.2 core schema; the lower half of ``strict_yaml``.

PyYAML scans and parses; which scalars are numbers, and what is refused, is decided here.
"""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode
from yaml.reader import Reader

from tcrctl.config.blanks import blank_message, first_blank, outer_blank
from tcrctl.config.budget import MAX_BYTES, MAX_DEPTH, MAX_VALUES, Budget
from tcrctl.config.keys import Keys, dotted
from tcrctl.errors import Problem, SpecError

try:
    from yaml import CSafeLoader as _BaseLoader
except ImportError:  # PyYAML built without libyaml
    from yaml import SafeLoader as _BaseLoader  # type: ignore[assignment]

_TAG = "tag:yaml.org,2002:"
_CORE_SCHEMA = (  # YAML 1.2.2, Sec. 10.3.2
    ("null", re.compile(r"null|Null|NULL|~|")),
    ("merge", re.compile(r"<<")),  # of YAML 1.1, known here so that it can be refused as a key
    ("bool", re.compile(r"true|True|TRUE|false|False|FALSE")),
    ("int", re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")),
    ("float", re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")),
    ("float", re.compile(r"[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)")),
)


def _plain_tag(text: str) -> str:
    """Return the tag that an unquoted scalar has in the core schema."""
    matching = (name for name, pattern in _CORE_SCHEMA if pattern.fullmatch(text))
    return _TAG + next(matching, "str")


def _tag(kind: type[Node], value: Any, implicit: Any) -> str:
    if kind is ScalarNode:
        return _plain_tag(value) if implicit[0] else _TAG + "str"
    return _TAG + ("map" if kind is MappingNode else "seq")


class _Loader(_BaseLoader):
    def resolve(self, kind: type[Node], value: Any, implicit: Any) -> str:
        return _tag(kind, value, implicit)


class _Dumper(yaml.SafeDumper):
    def resolve(self, kind: type[Node], value: Any, implicit: Any) -> str:
        return _tag(kind, value, implicit)

    def ignore_aliases(self, data: Any) -> bool:
        return True

    def represent_str(self, data: str) -> ScalarNode:
        """Quote what begins or ends with a blank that is no space: unquoted it would be refused when read."""
        return self.represent_scalar(_TAG + "str", data, style='"' if outer_blank(data) else None)


_Dumper.add_representer(str, _Dumper.represent_str)


def position(name: str, mark: Any) -> str:
    """Return ``file:line:column``, counted from 1, of a PyYAML mark (None: the start)."""
    return f"{name}:{mark.line + 1}:{mark.column + 1}" if mark else f"{name}:1:1"


def compose(text: str, name: str) -> Node:
    """Parse one YAML document.

    Args:
        text: The YAML.
        name: File name for messages.

    Raises:
        SpecError: If the syntax is broken or there is not exactly one document.
    """
    if len(text) > MAX_BYTES:
        raise _refused(name, None, f"larger than {MAX_BYTES} bytes")
    _check_characters(text, name)
    try:
        _check_events(text, name)
        root: Node | None = yaml.compose(text, Loader=_Loader)
    except yaml.MarkedYAMLError as error:
        raise _syntax_error(text, name, error) from None
    if root is None:
        raise _refused(name, None, "the file is empty")
    excess = Budget().first_excess(root)
    if excess is not None:
        raise _refused(name, excess[0].start_mark, excess[1])
    return root


def _refused(name: str, mark: Any, message: str) -> SpecError:
    return SpecError([Problem(position(name, mark), "", message)])


def _syntax_error(text: str, name: str, error: yaml.MarkedYAMLError) -> SpecError:
    blank = first_blank(text)
    if blank is not None:  # YAML goes on reading, and complains further down
        return SpecError([Problem(_place(text, name, blank), "", blank_message(text[blank]))])
    return _refused(name, error.problem_mark or error.context_mark, _syntax_message(error))


def _place(text: str, name: str, index: int) -> str:
    return f"{name}:{text.count(chr(10), 0, index) + 1}:{index - text.rfind(chr(10), 0, index)}"


def _check_characters(text: str, name: str) -> None:
    bad = Reader.NON_PRINTABLE.search(text)
    if bad:
        message = f"not YAML: character U+{ord(bad[0]):04X} is not allowed"
        raise SpecError([Problem(_place(text, name, bad.start()), "", message)])


def _check_events(text: str, name: str) -> None:
    """Count before anything is built."""
    depth = values = 0
    for event in yaml.parse(text, Loader=_Loader):
        depth += isinstance(event, yaml.CollectionStartEvent) - isinstance(event, yaml.CollectionEndEvent)
        values += isinstance(event, yaml.NodeEvent)
        if depth > MAX_DEPTH:
            raise _refused(name, event.start_mark, f"nested more than {MAX_DEPTH} levels deep")
        if values > MAX_VALUES:
            raise _refused(name, event.start_mark, f"more than {MAX_VALUES} values")


def _syntax_message(error: yaml.MarkedYAMLError) -> str:
    problem = str(error.problem)
    if "another document" in problem:
        return "more than one document in the file; give one"
    if "maximum nesting depth" in problem:  # of libyaml, which reads ahead of our own count
        return f"nested more than {MAX_DEPTH} levels deep"
    hint = "; indent with spaces" if "cannot start any token" in problem else ""
    return f"not YAML: {error.context + ', ' if error.context else ''}{problem}{hint}"


class Builder:
    """Turns nodes into data and collects what is wrong with them.

    Attributes:
        broken: Problems found. A value that cannot be had becomes None and its path stands beside the
            problem; beside a problem with a key stands None.
    """

    def __init__(self, name: str) -> None:
        self.name = name
        self.broken: list[tuple[Keys | None, Problem]] = []
        self._done: dict[int, Any] = {}  # an aliased node is built once, however often it is used
        self._open: set[int] = set()

    def build(self, node: Node, path: Keys = ()) -> Any:
        """Return the data of a node.

        Args:
            node: The node.
            path: Where it stands in the document.
        """
        if id(node) in self._open:
            return self._refuse(node, path, "an alias inside the value it stands for")
        if id(node) not in self._done:
            self._open.add(id(node))
            self._done[id(node)] = self._value(node, path)
            self._open.discard(id(node))
        return self._done[id(node)]

    def _refuse(self, node: Node, path: Keys, message: str, *, is_key: bool = False) -> None:
        problem = Problem(position(self.name, node.start_mark), dotted(path), message)
        self.broken.append((None if is_key else path, problem))

    def _value(self, node: Node, path: Keys) -> Any:
        if isinstance(node, MappingNode) and node.tag == _TAG + "map":
            return {key: self.build(value, (*path, key)) for key, value in self._entries(node, path)}
        if isinstance(node, SequenceNode) and node.tag == _TAG + "seq":
            return [self.build(item, (*path, i)) for i, item in enumerate(node.value)]
        if not isinstance(node, ScalarNode):
            return self._refuse(node, path, f"tag {node.tag!r} is not supported")
        blank = outer_blank(node.value) if not node.style else ""
        if blank:
            return self._refuse(node, path, blank_message(blank))
        try:
            return _scalar(node.tag.removeprefix(_TAG), node.value)
        except ValueError as error:
            return self._refuse(node, path, str(error))

    def _entries(self, node: MappingNode, path: Keys) -> Iterator[tuple[str, Node]]:
        first: dict[str, int] = {}
        for key, value in node.value:
            problem = _key_problem(key, first)
            if problem:
                named = (*path, key.value) if isinstance(key, ScalarNode) else path
                self._refuse(key, named, problem, is_key=True)
            else:
                first[key.value] = key.start_mark.line + 1
                yield key.value, value


def _key_problem(key: Node, first: dict[str, int]) -> str:
    if not isinstance(key, ScalarNode):
        return "a key must be text, not a map or list"
    if key.tag == _TAG + "merge":
        return "merge keys are not supported; write the keys out"
    if key.tag != _TAG + "str":
        return f"a key must be text; write '{key.value}' in quotes"
    return f"duplicate key, first given in line {first[key.value]}" if key.value in first else ""


def _scalar(kind: str, text: str) -> Any:
    """Return the value of a scalar; ValueError says why there is none."""
    if kind in ("str", "merge"):
        return text
    if kind not in ("null", "bool", "int", "float"):
        raise ValueError(f"tag {kind!r} is not supported")
    found = _plain_tag(text).removeprefix(_TAG)
    if kind not in (found, {"int": "float"}.get(found)):
        raise ValueError(f"{text!r} is not a {kind}")
    if kind == "null":
        return None
    if kind == "bool":
        return text.lower() == "true"
    return _integer(text) if kind == "int" else _finite(text)


def _integer(text: str) -> int:
    if len(text) > 100:
        raise ValueError("a whole number of more than 100 digits")
    return int(text, 0) if text[:2] in ("0o", "0x") else int(text)


def _finite(text: str) -> float:
    number = math.nan if "n" in text.lower() else float(text)
    if not math.isfinite(number):
        raise ValueError(f"{text} is not a finite number")
    return number


def dumps(data: Any, columns: int = 100) -> str:
    """Return data as YAML that ``strict_yaml.loads`` reads back unchanged.

    Args:
        data: Maps with text keys, lists, text, finite numbers, booleans and None.
        columns: A line is broken behind the first entry that goes beyond.
    """
    text: str = yaml.dump(
        data, Dumper=_Dumper, sort_keys=False, allow_unicode=True, width=columns, default_flow_style=None
    )
    return text
