"""Pages of the files that people write: every key with its type, default and meaning, from the JSON schema."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final

from tcrctl.config.settings import Settings

Schema = dict[str, Any]

#: Bounds of a number, by their key in a schema.
_BOUNDS: Final = {
    "minimum": ">= {}",
    "exclusiveMinimum": "> {}",
    "maximum": "<= {}",
    "exclusiveMaximum": "< {}",
    "minLength": "at least {} letters",
    "minItems": "at least {}",
    "maxItems": "at most {}",
}


def files() -> dict[str, tuple[str, str, type[Settings]]]:
    """Return title, command that prints the schema, and settings of every kind of file, by the page's name."""
    from tcrctl.experiment.spec import ExperimentSpec
    from tcrctl.identify.settings import IdentificationSpec
    from tcrctl.plant.rig.settings import RigFile
    from tcrctl.robot.description import RobotDescription
    from tcrctl.study.settings import StudySpec

    return {
        "experiment": ("Experiment files", "tcrctl schema", ExperimentSpec),
        "robot": ("Robot files", "tcrctl schema --robot", RobotDescription),
        "rig": ("Rig files", "tcrctl schema --rig", RigFile),
        "identification": ("Identification files", "tcrctl schema --identification", IdentificationSpec),
        "study": ("Study files", "tcrctl schema --study", StudySpec),
    }


def write(folder: Path) -> None:
    """Write a page for every kind of file."""
    folder.mkdir()
    for name, (title, command, model) in files().items():
        (folder / f"{name}.md").write_text(page(name, title, command, model.model_json_schema()), "utf-8")


def page(name: str, title: str, command: str, schema: Schema) -> str:
    """Return the page of one kind of file."""
    head = (
        f"# {title}: every key\n\nMade from the schema that `{command}` prints. A key without a default must be "
        "given. Files are read strictly: a key that is not here, a wrong type or a value out of bounds is an error "
        "with its line.\n"
    )
    return "\n".join([head, *_Page(name, schema).lines()])


class _Page:
    """Writes the top of a file and, once each, all sections below it in the order in which they are met."""

    def __init__(self, name: str, schema: Schema) -> None:
        self._name, self._schema = name, schema
        self._definitions: dict[str, Schema] = schema.get("$defs", {})
        self._places: dict[str, str] = {}
        self._waiting: list[str] = []

    def lines(self) -> Iterator[str]:
        """Yield the page."""
        yield from self._table(self._schema, "")
        while self._waiting:
            name = self._waiting.pop(0)
            yield f"\n({self._anchor(name)})="
            yield f"## {self._title(name)}\n"
            said = str(self._definitions[name].get("description", "")).replace("\n", " ")
            yield f"{said}\n" if said else ""
            yield from self._table(self._definitions[name], self._places[name])

    def _table(self, schema: Schema, place: str) -> Iterator[str]:
        properties: dict[str, Schema] = schema.get("properties", {})
        if not properties:
            yield f"Written as {self._type(schema, place)}."
            return
        required = schema.get("required", ())
        yield "| key | type | default | meaning |\n| --- | --- | --- | --- |"
        for key, value in properties.items():
            where = f"{place}.{key}" if place else key
            default = _default(value) if key not in required else ""
            cells = (f"`{key}`", self._type(value, where), default, self._meaning(value))
            yield "| " + " | ".join(str(cell).replace("|", "\\|").replace("\n", " ") for cell in cells) + " |"

    def _meaning(self, node: Schema) -> str:
        """Return what a key says about itself, or else the first line of what its section says."""
        name = str(node.get("$ref", "")).rpartition("/")[2]
        said = str(self._definitions.get(name, {}).get("description", "")).partition("\n")[0].rstrip(".")
        return str(node.get("description", "")) or f"{said[:1].lower()}{said[1:]}"

    def _type(self, node: Schema, place: str) -> str:
        if "$ref" in node:
            return self._link(node["$ref"].rsplit("/", 1)[1], place)
        for several in ("anyOf", "oneOf"):
            if several in node:
                parts = dict.fromkeys(self._type(part, place) for part in node[several])
                return " or ".join(part for part in parts if part != "null")
        if "const" in node:
            return f"`{node['const']}`"
        if "enum" in node:
            return " or ".join(f"`{value}`" for value in node["enum"])
        return self._plain(node, place)

    def _plain(self, node: Schema, place: str) -> str:
        kind = str(node.get("type", "anything"))
        if kind == "array" and "prefixItems" in node:
            several = ", ".join(self._type(item, place) for item in node["prefixItems"])
            return f"list of {len(node['prefixItems'])}: {several}"
        if kind == "array":
            kind = f"list of {self._type(node.get('items', {}), f'{place}[]')}"
        elif kind == "object":
            patterns = iter(node.get("patternProperties", {}).values())
            inner = node.get("additionalProperties") or next(patterns, None)
            kind = f"map to {self._type(inner, f'{place}.NAME')}" if isinstance(inner, dict) else "map"
        bounds = [text.format(node[key]) for key, text in _BOUNDS.items() if key in node]
        return ", ".join([{"string": "text", "boolean": "true or false"}.get(kind, kind), *bounds])

    def _link(self, name: str, place: str) -> str:
        if name not in self._places:
            self._places[name] = place
            self._waiting.append(name)
        return f"[{self._kind(name) or self._title(name)}](#{self._anchor(name)})"

    def _title(self, name: str) -> str:
        kind = self._kind(name)
        return f"`{self._places[name]}`, kind {kind}" if kind else f"`{self._places[name]}`"

    def _kind(self, name: str) -> str:
        """Return what the key ``kind`` of a section must be; empty if it has none."""
        kind = self._definitions[name].get("properties", {}).get("kind", {})
        return f"`{kind['const']}`" if "const" in kind else ""

    def _anchor(self, name: str) -> str:
        return f"{self._name}-{name}".lower()


def _default(node: Schema) -> str:
    if "default" not in node or (isinstance(node["default"], dict) and node["default"]):
        return "as below"
    if node["default"] is None:
        return "`off`" if {"const": "off"} in node.get("anyOf", ()) else "left out"
    return f"`{json.dumps(node['default'])}`"
