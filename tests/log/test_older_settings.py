"""Laws of settings of older logs: what had a meaning keeps its value, what had none is left out."""

from __future__ import annotations

import pytest

from tcrctl.controller.settings import IocSettings
from tcrctl.log.older_settings import in_todays_form

BESIDE = {
    "horizon_s": 0.9,
    "instants": 12,
    "blocks": 3,
    "modes": 6,
    "offset": {"filter_s": 0.4},
    "feedforward": False,
}
MEANT = {
    ("dynamic", "multi_step"): set(BESIDE),
    ("static", "multi_step"): set(BESIDE) - {"modes"},
    ("dynamic", "one_step"): {"horizon_s"},
    ("dynamic", "literal"): set(),
    ("static", "literal"): set(),
}


def old(model, prediction):
    return {
        "kind": "ioc",
        "period_s": 0.1,
        "model": model,
        "prediction": prediction,
        **BESIDE,
        "integral": "off",
    }


@pytest.mark.parametrize(("model", "prediction"), MEANT)
def test_what_has_a_meaning_keeps_its_value_and_the_rest_is_left_out(model, prediction):
    found = in_todays_form({"name": "a", "controller": old(model, prediction)})
    controller = found["controller"]
    assert found["name"] == "a"
    assert controller["prediction"] == {
        "kind": prediction,
        **{key: value for key, value in BESIDE.items() if key in MEANT[model, prediction]},
    }
    assert not set(BESIDE) & set(controller)
    assert IocSettings.model_validate(controller).model_dump(mode="json")["integral"] == "off"


@pytest.mark.parametrize(
    "settings",
    [
        None,
        "text",
        {},
        {"controller": "ioc"},
        {"controller": {"kind": "kinematic", "period_s": 0.1}},
        {"controller": {"kind": "ioc", "prediction": "literal"}},
        {"controller": {"kind": "ioc", "prediction": {"kind": "one_step", "horizon_s": 0.4}}},
    ],
)
def test_what_is_not_old_comes_back_as_it_is(settings):
    assert in_todays_form(settings) == settings


def test_a_converted_form_is_not_old_any_more():
    found = in_todays_form({"controller": old("dynamic", "multi_step")})
    assert in_todays_form(found) == found
