"""What pydantic finds, said in plain words: path of the value, what it is, what was allowed."""

from __future__ import annotations

import difflib
import itertools
import json
from collections.abc import Iterator
from typing import Any, TypeVar

from pydantic import BaseModel, ValidationError

from tcrctl.config.budget import MAX_PROBLEMS
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.unions import Tagged, kind_of, models_in
from tcrctl.config.units import same_in_another_unit

Model = TypeVar("Model", bound=BaseModel)

_TEMPLATES = {
    "missing": "required key is missing",
    "string_type": "must be text",
    "bool_type": "must be true or false",
    "int_type": "must be a whole number",
    "int_from_float": "must be a whole number",
    "float_type": "must be a number",
    "finite_number": "must be a finite number",
    "none_required": "must be null",
    "model_type": "must be a map of keys and values",
    "model_attributes_type": "must be a map of keys and values",
    "dict_type": "must be a map of keys and values",
    "list_type": "must be a list",
    "tuple_type": "must be a list",
    "greater_than": "must be > {gt}",
    "greater_than_equal": "must be >= {ge}",
    "less_than": "must be < {lt}",
    "less_than_equal": "must be <= {le}",
    "multiple_of": "must be a multiple of {multiple_of}",
    "literal_error": "must be {expected}",
    "too_short": "must have at least {min_length} entries, has {actual_length}",
    "too_long": "must have at most {max_length} entries, has {actual_length}",
    "string_too_short": "must have {min_length} or more characters",
    "string_too_long": "must have at most {max_length} characters",
    "string_pattern_mismatch": "must match the pattern {pattern}",
    "union_tag_invalid": "must be one of {expected_tags}",
    "value_error": "{error}",
    "cross_check": "{text}",
}
_SAYS_ALL = {"missing", "too_short", "too_long", "value_error"}


def check(data: Any, model: type[Model]) -> tuple[Model | None, list[Finding]]:
    """Fill a model, or say everything that is wrong.

    Args:
        data: Maps, lists, text, numbers, booleans, None.
        model: Pydantic model to be filled.

    Returns:
        The filled model and no findings, or None and what is wrong where.
    """
    try:
        # JSON, because that is where pydantic's strict mode takes a list for a tuple
        return model.model_validate_json(json.dumps(data)), []
    except ValidationError as error:
        # one more than will be listed, so that it can be said that there are more
        first = itertools.islice(error.errors(include_url=False), MAX_PROBLEMS + 1)
        return None, _merged(f for e in first for f in _findings(e, data, model))


def _merged(findings: Iterator[Finding]) -> list[Finding]:
    """Join what the members of a union say about the same value."""
    merged: dict[Keys, list[str]] = {}
    for path, message in findings:
        said = merged.setdefault(path, [])
        if message not in said:
            said.append(message)
    return [(path, "; ".join(said)) for path, said in merged.items()]


def _findings(error: Any, data: Any, model: type[BaseModel]) -> Iterator[Finding]:
    kind, context = error["type"], error.get("ctx", {})
    path = _data_path(error["loc"], data, ends_in_key=kind in ("missing", "extra_forbidden"))
    if kind == "cross_check":
        for below, message in context["problems"]:
            yield (*path, *below), message
    elif kind == "too_short" and len(error["input"]) >= context["min_length"]:
        return  # pydantic counts only the good entries; the bad ones have findings of their own
    elif kind == "missing" and isinstance(path[-1], int):
        yield path, f"the list is too short: entry {path[-1] + 1} is missing"
    elif kind == "missing" and path[-1] == "kind":
        yield path, _missing_kind(_models_at(error["loc"][:-1], data, model))
    elif kind == "extra_forbidden":
        yield path, _unknown_key(str(path[-1]), _models_at(error["loc"][:-1], data, model))
    elif kind == "union_tag_not_found":
        yield (*path, "kind"), _missing_kind(_models_at(error["loc"], data, model))
    elif kind == "union_tag_invalid":
        yield (*path, "kind"), _sentence(error, error["input"]["kind"])
    else:
        yield path, _sentence(error, error["input"])


def _sentence(error: Any, given: Any) -> str:
    kind, context = error["type"], error.get("ctx", {})
    text = _TEMPLATES[kind].format(**context) if kind in _TEMPLATES else error["msg"]
    if kind in _SAYS_ALL:
        return text
    allowed = context.get("expected", context.get("expected_tags", ""))
    names = [name.strip(" '") for name in allowed.replace(" or ", ",").split(",")]
    return f"{text}, not {_shown(given)}{_closest(given, names)}"


def _shown(value: Any) -> str:
    """Return a value as it would be written in the file, cut short."""
    if isinstance(value, dict | list):
        return "a map" if isinstance(value, dict) else "a list"
    text = json.dumps(value, ensure_ascii=False, default=str)
    return text if len(text) <= 60 else text[:57] + "..."


def _closest(given: Any, allowed: list[str]) -> str:
    close = difflib.get_close_matches(str(given)[:100], filter(None, allowed), n=1)
    return f"; did you mean {close[0]}?" if close else ""


def _unknown_key(key: str, models: list[Tagged]) -> str:
    for model, _ in models:
        section = getattr(model, "moved", {}).get(key)
        if section is not None:
            return f"belongs to {section}: write {_written_below(section, key, model)}"
    allowed = list(dict.fromkeys(name for model, _ in models for name in model.model_fields))
    known = [*allowed, *(name for model, _ in models for name in getattr(model, "moved", {}))]
    hint = same_in_another_unit(key, known) or _closest(key, known)
    return f"unknown key{hint}; allowed: {', '.join(allowed)}"


def _written_below(section: str, key: str, model: type[BaseModel]) -> str:
    """Return how a key that was moved into a section below is written there, and for which kinds."""
    below = [m for m, _ in models_in(model.model_fields[section].annotation) if key in m.model_fields]
    text = f"{section}: {{kind: {kind_of(below[0])}, {key}: ...}}"
    return f"{text}; kinds that have it: {', '.join(kind_of(m) for m in below)}"


def _missing_kind(models: list[Tagged]) -> str:
    return f"required key is missing; must be {' or '.join(repr(kind_of(model)) for model, _ in models)}"


def _steps(loc: Keys, data: Any) -> Iterator[tuple[str | int, bool]]:
    """Walk a pydantic location through the data; the flag tells the tag of a union from a key.

    A union chosen by ``kind`` puts the kind into the location right after the map's own key, where
    it must not be taken for a key of the same name.
    """
    tagged = False
    for step in loc:
        is_tag = isinstance(data, dict) and not tagged and data.get("kind") == step
        if is_tag or not _has(data, step):
            tagged = is_tag
            yield step, True
        else:
            data, tagged = data[step], False
            yield step, False


def _has(data: Any, step: str | int) -> bool:
    if isinstance(data, list):
        return isinstance(step, int) and step < len(data)
    return isinstance(data, dict) and step in data


def _data_path(loc: Keys, data: Any, *, ends_in_key: bool) -> Keys:
    """Return a pydantic location without the names of union members in it."""
    steps = list(_steps(loc, data))
    path = tuple(step for step, is_tag in steps if not is_tag)
    return (*path, loc[-1]) if ends_in_key and steps[-1][1] else path


def _models_at(loc: Keys, data: Any, model: type[BaseModel]) -> list[Tagged]:
    """Return the model, or the members of the union, that stands at a location."""
    models: list[Tagged] = [(model, "")]
    for step, is_tag in _steps(loc, data):
        if is_tag:
            models = [m for m in models if step in (m[1], kind_of(m[0]))] or models
        elif isinstance(step, str):
            fields = [m.model_fields[step] for m, _ in models if step in m.model_fields]
            models = [found for field in fields for found in models_in(field.annotation)]
    return models
