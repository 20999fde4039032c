"""The new robot file: the given one with every comment, new values in place, and where they come from on top."""

from __future__ import annotations

import datetime
import math
from typing import Any

import yaml
from yaml.nodes import MappingNode, Node, ScalarNode, SequenceNode

from tcrctl import __version__
from tcrctl.config import strict_yaml
from tcrctl.errors import SpecError
from tcrctl.identify.parameters import split, with_values
from tcrctl.identify.result import Result
from tcrctl.robot.description import RobotDescription


def robot_text(given: str, result: Result) -> str:
    """Return text of the new robot file.

    Args:
        given: Text of the robot file that was started from.
        result: What was found.
    """
    found = {p.path: float(v) for p, v in zip(result.parameters, result.values, strict=True)}
    changes: dict[str, Any] = {"name": result.new_robot, **found}
    wanted = with_values(result.base, changes)
    text = _in_place(given, changes)
    if (
        text is None or _read(text) != wanted
    ):  # a value that is not in the file, or cables given by length now
        text = strict_yaml.dumps(wanted.model_dump(mode="json", exclude_none=True))
    return f"{_provenance(result)}\n{text}"


def _read(text: str) -> RobotDescription | None:
    try:
        return strict_yaml.validate(strict_yaml.loads(text), RobotDescription)
    except SpecError:
        return None


def _in_place(text: str, changes: dict[str, Any]) -> str | None:
    """Replace scalars where they stand; None if one is not in the file."""
    root = yaml.compose(text, Loader=yaml.SafeLoader)
    places = []
    for path, value in changes.items():
        node = _scalar(root, path)
        if node is None:
            return None
        places.append((node.start_mark.index, node.end_mark.index, value))
    for start, end, value in sorted(places, reverse=True):
        text = text[:start] + (value if isinstance(value, str) else repr(value)) + text[end:]
    return text


def _scalar(node: Node | None, path: str) -> ScalarNode | None:
    for key in split(path):
        if isinstance(node, MappingNode):
            node = next((value for name, value in node.value if name.value == key), None)
        elif isinstance(node, SequenceNode) and isinstance(key, int) and key < len(node.value):
            node = node.value[key]
        else:
            return None
    return node if isinstance(node, ScalarNode) else None


def _provenance(result: Result) -> str:
    now = datetime.datetime.now(datetime.UTC).isoformat(timespec="seconds")
    certainty, held_out = result.certainty, result.held_out_error_mm
    lines = [
        f"Identified by tcrctl {__version__} on {now}: {result.spec}, starting from {result.robot}.",
        f"Method {result.method}, seed {result.seed}, status {result.status}, "
        f"{result.evaluations} evaluations.",
        f"Mean error {result.mean_error_before_mm:.4g} mm before, {result.mean_error_after_mm:.4g} mm after, "
        f"{f'{held_out:.4g} mm' if math.isfinite(held_out) else 'unknown'} held out.",
        f"SHA-256 of the data: {result.data_sha256}.",
    ]
    for i, (p, value) in enumerate(zip(result.parameters, result.values, strict=True)):
        spread = "" if certainty is None else f" +- {certainty.std[i]:.3g}"
        lines.append(f"{p.path}: {p.start:.6g} -> {value:.6g}{spread}, bounds {p.low:.6g} to {p.high:.6g}")
    lines += [f"Warning: {warning}" for warning in result.warnings]
    return "".join(f"# {line}\n" for line in lines)
