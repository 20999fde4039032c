"""Base of every settings class read from YAML: strict, frozen, finite, unknown keys refused."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Annotated, Any, ClassVar, Self, TypeAlias, TypeVar

from pydantic import BaseModel, ConfigDict, Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import PydanticCustomError, core_schema

from tcrctl.config.keys import Finding, dotted

T = TypeVar("T")
NotNegative: TypeAlias = Annotated[float, Field(ge=0.0)]
Positive: TypeAlias = Annotated[float, Field(gt=0.0)]
Vector: TypeAlias = tuple[float, float, float]


class Settings(BaseModel):
    """Settings of one part; a float takes whole numbers too, nothing else is converted."""

    model_config = ConfigDict(
        frozen=True, extra="forbid", strict=True, allow_inf_nan=False, validate_default=True
    )

    #: Keys that were here before, and the section below this one that has them now.
    moved: ClassVar[Mapping[str, str]] = {}
    #: Where its kind comes from, if it is no built-in one; see :mod:`tcrctl.plugins.plugin`.
    plugin: ClassVar[object | None] = None

    def __deepcopy__(self, memo: dict[int, Any] | None = None) -> Self:
        """Return itself: settings never change."""
        del memo
        return self


def quantity(unit: str, description: str, default: Any = ..., **bounds: Any) -> Any:
    """Declare a number with a unit; without a default the key is required.

    Args:
        unit: Unit of the value as written in the file.
        description: What the number is; shown by editors that know the JSON Schema.
        default: Value of a key left out.
        **bounds: ``gt``, ``ge``, ``lt``, ``le`` as in ``pydantic.Field``.
    """
    text = f"{description} [{unit}]"
    return Field(default, description=text, json_schema_extra={"unit": unit}, **bounds)


def refuse(problems: Iterable[Finding]) -> None:
    """Raise one validation error carrying every problem of a cross-check, if there is any.

    Meant for ``model_validator(mode="after")``; ``strict_yaml.validate`` gives each its own position.

    Args:
        problems: Place of the offending value below the model at hand, and what is wrong with it.

    Raises:
        PydanticCustomError: If there is at least one problem; ``context["problems"]`` holds them.
    """
    found = list(problems)
    if found:
        text = "; ".join(f"{dotted(keys)}: {message}" for keys, message in found)
        raise PydanticCustomError("cross_check", "{text}", {"text": text, "problems": found})


class _OffSwitch:
    """Lets a section be written ``off`` (None in memory, ``off`` again in resolved files)."""

    @staticmethod
    def _from_file(value: Any) -> Any:
        if value == "off":
            return None
        if isinstance(value, str | bool | int | float | list):
            raise PydanticCustomError("off_or_map", "must be off or a map of keys and values")
        return value

    @staticmethod
    def _to_file(value: Any, serialize: core_schema.SerializerFunctionWrapHandler) -> Any:
        return "off" if value is None else serialize(value)

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        inner = handler(source)
        writing = core_schema.wrap_serializer_function_ser_schema(
            self._to_file, schema=inner, when_used="json"
        )
        return core_schema.no_info_before_validator_function(self._from_file, inner, serialization=writing)

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        made = handler(schema)
        return {**made, "anyOf": [*made["anyOf"], {"const": "off"}]}


OrOff = Annotated[T | None, _OffSwitch()]
"""A section that may be written ``off``."""


class ShortKind:
    """Lets a section that is told apart by ``kind`` be written as the bare name of one.

    A map without ``kind`` has the first of them.
    """

    def __init__(self, *kinds: str) -> None:
        self._kinds = kinds

    def _from_file(self, value: Any) -> Any:
        if isinstance(value, str):
            return {"kind": value}
        return {"kind": self._kinds[0], **value} if isinstance(value, dict) else value

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> core_schema.CoreSchema:
        return core_schema.no_info_before_validator_function(self._from_file, handler(source))

    def __get_pydantic_json_schema__(
        self, schema: core_schema.CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [handler(schema), {"enum": list(self._kinds)}]}
