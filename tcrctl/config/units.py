"""Keys end in their unit: which key is meant by one with another unit, or with none."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Final

#: Units as keys spell them, the longest first, so that ``m_s`` is no ``s``.
_UNITS: Final = tuple(
    sorted(
        (
            *("s", "ms", "us", "min", "hz", "khz", "1_s", "percent"),
            *("m", "cm", "mm", "um", "nm", "m_s", "cm_s", "mm_s", "um_s", "m_s2", "mm_s2"),
            *("deg", "rad", "mrad", "deg_s", "rad_s"),
            *("n", "mn", "kn", "g", "kg", "mg", "n_s_m", "n_m", "n_mm", "pa", "kpa", "mpa", "gpa", "ma", "a"),
        ),
        key=len,
        reverse=True,
    )
)


def _taken_apart(key: str) -> tuple[str, str]:
    """Return the name of a key and its unit, which is empty if it has none."""
    unit = next((unit for unit in _UNITS if key.lower().endswith(f"_{unit}")), "")
    return (key[: -len(unit) - 1], unit) if unit else (key, "")


def same_in_another_unit(key: str, allowed: Iterable[str]) -> str:
    """Return a hint at the key of the same name and its unit; empty if there is none.

    Args:
        key: What was written.
        allowed: Keys that there are.
    """
    name, unit = _taken_apart(key)
    for other in allowed:
        called, wanted = _taken_apart(other)
        if called == name and wanted:
            than = f", not in {_said(unit)}" if unit else ""
            return f"; did you mean {other}? It is in {_said(wanted)}{than}"
    return ""


def _said(unit: str) -> str:
    """Write a unit as people do: ``mm/s``, ``N s/m``."""
    special = {"1_s": "1/s", "n_s_m": "N s/m", "n_m": "N/m", "n_mm": "N/mm", "percent": "%", "hz": "Hz"}
    usual = {"n": "N", "mn": "mN", "kn": "kN", "pa": "Pa", "kpa": "kPa", "mpa": "MPa", "gpa": "GPa"}
    return special.get(unit) or usual.get(unit) or unit.replace("_", "/")
