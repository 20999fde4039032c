"""Settings as logs of older versions have them, in the form of today.

Files that people write are not converted: they get an error that says what to write. A log cannot be written again.
"""

from __future__ import annotations

from typing import Any, Final

#: Keys of ``prediction:`` that stood beside it, and were there whether they had a meaning or not.
_BESIDE: Final = ("horizon_s", "instants", "blocks", "modes", "offset", "feedforward")
#: Those that have one, by the names of model and prediction.
_MEANT: Final = {
    ("dynamic", "multi_step"): _BESIDE,
    ("static", "multi_step"): ("horizon_s", "instants", "blocks", "offset", "feedforward"),
    ("dynamic", "one_step"): ("horizon_s",),
}


def in_todays_form(settings: Any) -> Any:
    """Return the resolved settings of an experiment, as a log carries them, in the form of today.

    Args:
        settings: What was read; it is not changed. What is no old form comes back as it is.
    """
    controller = settings.get("controller") if isinstance(settings, dict) else None
    if not isinstance(controller, dict) or controller.get("kind") != "ioc":
        return settings
    name = controller.get("prediction", "multi_step")
    if not isinstance(name, str) or not any(key in controller for key in _BESIDE):
        return settings
    meant = _MEANT.get((controller.get("model", "dynamic"), name), ())
    prediction = {"kind": name, **{key: controller[key] for key in meant if key in controller}}
    converted: dict[str, Any] = {}
    for key, value in controller.items():
        if key == "prediction":
            converted[key] = prediction
        elif key not in _BESIDE:
            converted[key] = value
    return {**settings, "controller": {**converted, "prediction": prediction}}
