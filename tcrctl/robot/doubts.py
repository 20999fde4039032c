"""Values of a robot file that can be meant, but hardly are: another unit, a tip in the middle."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, Final

from tcrctl.config.settings import Settings
from tcrctl.robot.description import RobotDescription

#: Endings of keys: least and largest value of robots that one can hold, and the unit that is mistaken for theirs
#: below and above, with its size in units of the key.
_USUAL: Final[dict[str, tuple[float, float, tuple[str, float], tuple[str, float]]]] = {
    "youngs_modulus_mpa": (1e-2, 1e6, ("GPa", 1e3), ("Pa", 1e-6)),
    "ring_diameter_mm": (10.0, 1e4, ("m", 1e3), ("um", 1e-3)),
    "pitch_mm": (10.0, 1e4, ("m", 1e3), ("um", 1e-3)),
    "cone_height_mm": (10.0, 1e4, ("m", 1e3), ("um", 1e-3)),
    "diameter_mm": (1e-2, 1e3, ("m", 1e3), ("um", 1e-3)),
    "natural_length_mm": (1.0, 1e4, ("m", 1e3), ("um", 1e-3)),
}
_MODULE_MASS_G: Final = (0.5, 5e3, ("kg", 1e3), ("mg", 1e-3))


def doubts(robot: RobotDescription) -> Iterator[str]:
    """Yield a sentence for every value that is hardly meant."""
    for key, value in _numbers(robot, ""):
        usual = _MODULE_MASS_G if key == "modules.mass_g" else _usual(key)
        if usual is None or value == 0.0 or usual[0] <= value <= usual[1]:
            continue
        unit, size = usual[2] if value < usual[0] else usual[3]
        yield f"{key}: {value:g} is unusual; is it in {unit}? That would be {value * size:g} here"
    if robot.tip.ring < robot.modules.count:
        yield (
            f"tip.ring: {robot.tip.ring} is not the last ring, {robot.modules.count}; "
            "what hangs below it follows, and is not controlled"
        )


def _usual(key: str) -> Any:
    name = key.rpartition(".")[2]
    return _USUAL.get(name) or (_USUAL["diameter_mm"] if name.endswith("_diameter_mm") else None)


def _numbers(settings: Settings, path: str) -> Iterator[tuple[str, float]]:
    for name in type(settings).model_fields:
        value = getattr(settings, name)
        if isinstance(value, Settings):
            yield from _numbers(value, f"{path}{name}.")
        elif isinstance(value, float):
            yield f"{path}{name}", value
