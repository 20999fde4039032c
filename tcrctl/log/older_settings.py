"""Settings as logs of older versions have them, in the form of today.

Files that people write are not converted: they get an error that says what to write, and today's defaults. A log
cannot be written again, and has to run as it did.
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
    if not isinstance(settings, dict):
        return settings
    found = dict(settings)
    if _is_kind(found.get("controller"), "ioc"):
        found["controller"] = _without_news(_nested(found["controller"]))
    if _is_kind(found.get("estimator"), "passive_observer"):
        found["estimator"] = {"fit_start": False, "hold_blank": False, **found["estimator"]}
    if isinstance(found.get("safety"), dict):
        found["safety"] = {"picture": {"judged": False}, **found["safety"]}
    return found


def _is_kind(section: Any, kind: str) -> bool:
    """Return whether a section is there, and of that kind."""
    return isinstance(section, dict) and section.get("kind") == kind


def _nested(controller: dict[str, Any]) -> dict[str, Any]:
    """Return a controller with the keys of its prediction in ``prediction``."""
    name = controller.get("prediction", "multi_step")
    if not isinstance(name, str) or not any(key in controller for key in _BESIDE):
        return controller
    meant = _MEANT.get((controller.get("model", "dynamic"), name), ())
    prediction = {"kind": name, **{key: controller[key] for key in meant if key in controller}}
    converted = {key: value for key, value in controller.items() if key not in _BESIDE}
    return {**converted, "prediction": prediction}


def _without_news(controller: dict[str, Any]) -> dict[str, Any]:
    """Return a controller that does without what it did not have when it ran, and has by default now."""
    found = {"dither": "off", "drives": {"lag_s": 0.0}, "settle_s": 0.0, **controller}
    prediction = controller.get("prediction", "multi_step")
    dynamic = controller.get("model", "dynamic") == "dynamic"
    if isinstance(prediction, str):
        prediction = {"kind": prediction}
    if dynamic and isinstance(prediction, dict) and prediction.get("kind", "multi_step") == "multi_step":
        prediction = {"kind": "multi_step", "tension_gap": "off", "hole_drag": "off", **prediction}
        offset = prediction.get("offset", {})
        if isinstance(offset, dict):
            prediction["offset"] = {"from_start": False, **offset}
        if isinstance(prediction["tension_gap"], dict):
            prediction["tension_gap"] = {"smooth_s": 0.0, **prediction["tension_gap"]}
        found["prediction"] = prediction
    return found
