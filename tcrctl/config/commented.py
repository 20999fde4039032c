"""A settings file written again with other values, every comment kept; and with a comment on every key.

The text itself is edited, at the places that the parser gives: a value that is the same keeps its spelling, and a
key that the file leaves out is written behind the last one of its map.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, get_args

from pydantic import BaseModel
from pydantic.fields import FieldInfo
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from tcrctl.config import strict_yaml
from tcrctl.config.yaml_core import compose, dumps

#: What is put in place of the text from one index to another.
_Edit = tuple[int, int, str]


def with_values(text: str, data: Mapping[str, Any]) -> str:
    """Return a YAML file that holds other data, with its comments.

    Args:
        text: The file; its top is a map.
        data: What it shall hold. A key of the file that is not here stays; one that is None may be left out.
    """
    if not isinstance(strict_yaml.loads(text).data, dict):
        return dumps(data)
    text = text if text.endswith("\n") else f"{text}\n"
    made = _edited(text, list(_changes(text, compose(text, "settings"), data)))
    return made if _same(strict_yaml.loads(made).data, data) else dumps(data)


def with_descriptions(text: str, model: type[BaseModel]) -> str:
    """Return a valid YAML file with a comment behind every key that has none: what it means, and its unit.

    Args:
        text: The file; its top is a map.
        model: What it is a file of.
    """
    return _edited(text, list(_comments(text, compose(text, "settings"), model)))


def _edited(text: str, edits: list[_Edit]) -> str:
    for start, end, new in sorted(edits, reverse=True):
        text = text[:start] + new + text[end:]
    return text


def _changes(text: str, node: Node, data: Mapping[str, Any]) -> Iterator[_Edit]:
    """Yield what has to change in a map for it to hold ``data``."""
    held = {key.value: value for key, value in node.value}
    for name, value in held.items():
        if name not in data or _same(_data(text, value), data[name]):
            continue
        if _is_block(value) and isinstance(data[name], Mapping):
            yield from _changes(text, value, data[name])
        else:
            yield value.start_mark.index, _end(value), _flow(data[name])
    missing = {name: value for name, value in data.items() if name not in held and value is not None}
    if missing:
        at = text.index("\n", _end(node)) + 1
        indent = " " * node.value[0][0].start_mark.column
        yield at, at, "".join(f"{indent}{name}: {_flow(value)}\n" for name, value in missing.items())


def _data(text: str, node: Node) -> Any:
    """Return what a part of the file holds; a block is read without its indentation."""
    start = node.start_mark
    return strict_yaml.loads(" " * start.column + text[start.index : _end(node)]).data


def _same(held: Any, wanted: Any) -> bool:
    """Tell whether two values are equal; a key whose value is None may be left out."""
    if isinstance(held, Mapping) and isinstance(wanted, Mapping):
        return held.keys() <= wanted.keys() and all(
            _same(held.get(name), value) for name, value in wanted.items()
        )
    if isinstance(held, list) and isinstance(wanted, list | tuple):
        return len(held) == len(wanted) and all(map(_same, held, wanted))
    return bool(held == wanted)


def _is_block(node: Node) -> bool:
    return isinstance(node, MappingNode) and not node.flow_style


def _end(node: Node) -> int:
    """Return where the text of a value ends; the parser says of a block where the next thing begins."""
    if not isinstance(node, MappingNode | SequenceNode) or node.flow_style or not node.value:
        index: int = node.end_mark.index
        return index
    last = node.value[-1] if isinstance(node, SequenceNode) else node.value[-1][1]
    return _end(last)


def _flow(value: Any) -> str:
    """Write a value on one line."""
    if isinstance(value, Mapping):
        return "{" + ", ".join(f"{name}: {_flow(inner)}" for name, inner in value.items()) + "}"
    if isinstance(value, list | tuple):
        return "[" + ", ".join(map(_flow, value)) + "]"
    return dumps([value]).strip().strip("[]").removeprefix("- ")


def _comments(text: str, node: Node, model: type[BaseModel]) -> Iterator[_Edit]:
    for key, value in node.value:
        field = model.model_fields.get(key.value)
        if field is None:
            continue
        inner = _model_of(field)
        block = not isinstance(value, ScalarNode) and not value.flow_style
        line_end = text.find("\n", key.end_mark.index if block else _end(value))
        line_end = len(text) if line_end < 0 else line_end
        said = field.description or _first_line(inner)
        if said and "#" not in text[text.rfind("\n", 0, key.start_mark.index) + 1 : line_end]:
            yield line_end, line_end, f"  # {said}"
        if inner is not None and _is_block(value):
            yield from _comments(text, value, inner)


def _model_of(field: FieldInfo) -> type[BaseModel] | None:
    """Return the settings that a section holds; None if it is no section."""
    kinds = (field.annotation, *get_args(field.annotation))
    return next((kind for kind in kinds if isinstance(kind, type) and issubclass(kind, BaseModel)), None)


def _first_line(model: type[BaseModel] | None) -> str:
    return "" if model is None else (model.__doc__ or "").partition("\n")[0].rstrip(".")
