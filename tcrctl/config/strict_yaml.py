"""YAML read strictly, every value with its place in the file.

Scalars follow the YAML 1.2 core schema: ``1e-3`` is a number, ``off`` and ``12:30`` are text, only
``true`` and ``false`` are booleans. Duplicate keys, merge keys, NaN and infinity are problems.

    text -> loads -> Document -> override (--set) -> validate -> settings, or every problem at once
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from yaml.nodes import MappingNode, Node, SequenceNode

from tcrctl.config.budget import MAX_BYTES, MAX_DEPTH, MAX_PROBLEMS
from tcrctl.config.keys import Finding, Keys, dotted
from tcrctl.config.yaml_core import Builder, compose, dumps, position
from tcrctl.errors import InputError, Problem, SpecError
from tcrctl.regular_file import open_file

if TYPE_CHECKING:
    from pydantic import BaseModel

Model = TypeVar("Model", bound="BaseModel")

__all__ = ["Document", "dumps", "load", "loads", "override", "placed", "read", "validate"]


@dataclass(frozen=True)
class Document:
    """Contents of one YAML file and where everything stands.

    Attributes:
        name: File name, as shown in messages.
        data: Maps, lists, text, numbers, booleans and None.
        broken: What is wrong with the YAML itself, each with the path of the value that it spoils (None
            if no value is lost). ``validate`` reports it; a caller that skips ``validate`` looks here.
    """

    name: str
    data: Any
    broken: tuple[tuple[Keys | None, Problem], ...] = ()
    _root: Node | None = field(default=None, repr=False, compare=False)
    _overridden: dict[Keys, str] = field(default_factory=dict, repr=False, compare=False)

    def where(self, path: Keys) -> str:
        """Return ``file:line:column`` of a value, or of its nearest parent that is in the file.

        Args:
            path: Keys and list indices from the top.

        Returns:
            Position of the key (1-based), or ``--set key`` for a value given on the command line.
        """
        for length in range(len(path), 0, -1):
            if path[:length] in self._overridden:
                return self._overridden[path[:length]]
        return position(self.name, self._mark(path))

    def is_override(self, path: Keys) -> bool:
        """Tell whether a value, or something around it, was given on the command line."""
        ends = (path[:length] for length in range(1, len(path) + 1))
        return any(self._overridden.get(end, "").startswith("--set") for end in ends)

    def problem(self, keys: Keys, message: str) -> Problem:
        """Return what is wrong with a value, with its place.

        Args:
            keys: The value.
            message: What is wrong with it.
        """
        return Problem(self.where(keys), dotted(keys), message)

    def refuse(self, findings: Iterable[Finding]) -> None:
        """Raise SpecError with everything that was found wrong, if anything was.

        Args:
            findings: Which values, and what is wrong with them.
        """
        problems = [self.problem(keys, message) for keys, message in findings]
        if problems:
            raise SpecError(problems)

    def _mark(self, path: Keys) -> Any:
        node, mark = self._root, self._root.start_mark if self._root else None
        for key in path:
            child = _child(node, key)
            if child is None:
                break
            mark, node = child[0].start_mark, child[1]
        return mark


def _child(node: Node | None, key: str | int) -> tuple[Node, Node] | None:
    """Return the node whose position stands for an entry, and the node of its value."""
    if isinstance(node, MappingNode):
        return next(((k, v) for k, v in node.value if k.value == key), None)
    if isinstance(node, SequenceNode) and isinstance(key, int) and 0 <= key < len(node.value):
        return node.value[key], node.value[key]
    return None


def read(path: str | Path) -> bytes:
    """Return the contents of a file.

    Args:
        path: The file.

    Raises:
        InputError: If it cannot be read, or is larger than any file of settings or measurements.
    """
    try:
        with open_file(path) as file:
            content = file.read(MAX_BYTES + 1)  # the size that a file tells may be wrong
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{path}: cannot be read: {reason}") from None
    if len(content) > MAX_BYTES:
        raise InputError(f"{path}: larger than {MAX_BYTES} bytes, the limit of such files")
    return content


def load(path: str | Path) -> Document:
    """Read a YAML file.

    Args:
        path: The file.

    Returns:
        The document; problems that leave it readable are in ``broken``.

    Raises:
        InputError: If the file cannot be read.
        SpecError: If it is not one YAML document in UTF-8.
    """
    return loads(read(path), str(path))


def loads(text: str | bytes, name: str = "<text>") -> Document:
    """Read YAML from memory; see ``load``.

    Args:
        text: One YAML document.
        name: File name for messages.

    Raises:
        SpecError: If it is not one YAML document in UTF-8.
    """
    root = compose(text if isinstance(text, str) else _decoded(text, name), name)
    builder = Builder(name)
    data = builder.build(root)
    return Document(name, data, tuple(builder.broken), root)


def placed(name: str, data: Any, places: dict[Keys, str]) -> Document:
    """Return data from elsewhere, a table for instance, as a document that knows where they came from.

    Args:
        name: File name for messages.
        data: Maps, lists, text, numbers, booleans and None.
        places: ``file:line:column`` of values, or of parents of them.
    """
    return Document(name, data, _overridden=dict(places))


def _decoded(raw: bytes, name: str) -> str:
    try:
        return raw.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = raw.count(b"\n", 0, error.start) + 1
        column = error.start - raw.rfind(b"\n", 0, error.start)
        message = f"byte 0x{raw[error.start]:02x} is not UTF-8 text; save the file as UTF-8"
        raise SpecError([Problem(f"{name}:{line}:{column}", "", message)]) from None


def override(document: Document, assignment: str) -> Document:
    """Return the document with one value replaced, as by ``--set a.b=c``.

    Args:
        document: What to start from; it is not changed.
        assignment: ``key=value``; keys are separated by dots, a number is a list index, the value is
            YAML. Maps missing on the way are made.

    Returns:
        The new document, which reports ``--set a.b`` as the place of the value.

    Raises:
        SpecError: If the assignment has no key or value, or leads through something that is no map or list.
    """
    key, equals, text = assignment.partition("=")
    key = key.strip()
    where = f"--set {key}"
    if not equals or not text.strip() or not all(key.split(".")):
        raise _refused(f"--set {assignment}", "must be key=value, for instance controller.period_s=0.1")
    if key.count(".") >= MAX_DEPTH:
        raise _refused(f"--set {key[:60]}...", f"more than {MAX_DEPTH} keys deep")
    new = _value_of(text, where)
    made: dict[Keys, str] = {}
    data = _assigned(document.data, key.split("."), new, (), made, where)
    target = max(made, key=len)
    kept = {path: old for path, old in document._overridden.items() if path[: len(target)] != target}
    mended = tuple(item for item in document.broken if item[0] is None or item[0][: len(target)] != target)
    return replace(document, data=data, broken=mended, _overridden={**made, **kept, target: where})


def _refused(where: str, message: str) -> SpecError:
    return SpecError([Problem(where, "", message)])


def _value_of(text: str, where: str) -> Any:
    try:
        given = loads(text, where)
    except SpecError as error:  # a line number within one command line argument helps nobody
        raise _refused(where, error.problems[0].message) from None
    if given.broken:
        raise _refused(where, given.broken[0][1].message)
    return given.data


def _assigned(old: Any, keys: list[str], value: Any, path: Keys, made: dict[Keys, str], where: str) -> Any:
    """Return a copy of old with value put in at keys; made collects the paths that come into being."""
    if not keys:
        made[path] = where
        return value
    if isinstance(old, dict):
        here = (*path, keys[0])
        if keys[0] not in old:
            made[here] = where
        below = old.get(keys[0], {})
        return {**old, keys[0]: _assigned(below, keys[1:], value, here, made, where)}
    name = dotted(path) or "the file"
    if not isinstance(old, list):
        raise _refused(where, f"{name} is {old!r}, neither a map nor a list")
    if not re.fullmatch("[0-9]{1,9}", keys[0]) or int(keys[0]) >= len(old):
        raise _refused(
            where, f"{name} is a list of {len(old)}; there is no index {keys[0]!r} (0 is the first)"
        )
    index = int(keys[0])
    item = _assigned(old[index], keys[1:], value, (*path, index), made, where)
    return [*old[:index], item, *old[index + 1 :]]


def validate(document: Document, model: type[Model]) -> Model:
    """Return the settings that a document describes.

    Args:
        document: What was read.
        model: Pydantic model to be filled.

    Raises:
        SpecError: With every problem of the YAML and of the values, in file order.
    """
    # pydantic is slow to import, and listing files needs none of it
    from tcrctl.config.validation import check

    settings, found = check(document.data, model)
    lost = {path for path, _ in document.broken if path is not None}
    problems = [problem for _, problem in document.broken]
    for path, message in found:
        if not any(path[:length] in lost for length in range(len(path) + 1)):
            problems.append(document.problem(path, message))
    if settings is None or problems:
        problems.sort(key=_file_order)
        if len(problems) > MAX_PROBLEMS:
            more = Problem(document.name, "", f"further problems; the first {MAX_PROBLEMS} are listed")
            problems = [*problems[:MAX_PROBLEMS], more]
        raise SpecError(problems)
    return settings


def _file_order(problem: Problem) -> tuple[int, int]:
    place = re.search(r":(\d+):(\d+)$", problem.where)
    return (int(place[1]), int(place[2])) if place else (0, 0)
