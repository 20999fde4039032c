"""Laws of settings of older logs: what had a meaning keeps its value, what is new since then is off."""

from __future__ import annotations

import pytest

from tcrctl.controller.settings import IocSettings
from tcrctl.estimator.settings import PassiveObserverSettings
from tcrctl.experiment.spec import load_spec
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


#: What the dynamic multi-step prediction has today and had not.
NEWS = {"tension_gap": "off", "hole_drag": "off", "offset": {"from_start": False, **BESIDE["offset"]}}
OBSERVER = {"kind": "passive_observer", "stiffness_n_m": 1000.0, "pose_filter_s": 0.5}


@pytest.mark.parametrize(("model", "prediction"), MEANT)
def test_what_has_a_meaning_keeps_its_value_and_the_rest_is_left_out(model, prediction):
    found = in_todays_form({"name": "a", "controller": old(model, prediction)})
    controller = found["controller"]
    assert found["name"] == "a"
    assert controller["prediction"] == {
        "kind": prediction,
        **{key: value for key, value in BESIDE.items() if key in MEANT[model, prediction]},
        **(NEWS if (model, prediction) == ("dynamic", "multi_step") else {}),
    }
    assert not set(BESIDE) & set(controller)
    settings = IocSettings.model_validate(controller)
    assert not list(settings.prediction.misfits(settings.period_s, model))
    assert settings.model_dump(mode="json")["integral"] == "off"
    assert settings.dither is None


def nested(**prediction):
    return {"controller": {"kind": "ioc", "model": "dynamic", "prediction": prediction}}


def test_what_a_log_could_not_say_is_off():
    found = in_todays_form({**nested(kind="multi_step", offset={"filter_s": 0.4}), "estimator": OBSERVER})
    controller = IocSettings.model_validate(found["controller"])
    assert controller.dither is None
    assert controller.prediction.tension_gap is None
    assert not controller.prediction.offset.from_start
    assert controller.prediction.offset.filter_s == 0.4
    estimator = PassiveObserverSettings.model_validate(found["estimator"])
    assert not estimator.fit_start
    assert not estimator.hold_blank
    assert estimator.stiffness_n_m == 1000.0


def test_an_offset_that_was_off_stays_off():
    found = in_todays_form(nested(kind="multi_step", offset="off"))
    assert IocSettings.model_validate(found["controller"]).prediction.offset is None


def test_what_a_log_says_is_kept():
    loaded = load_spec("letter_t", ("controller.dither.least_mm=0.5", "controller.prediction.horizon_s=0.7"))
    spec = loaded.spec.model_dump(mode="json")
    assert in_todays_form(spec) == spec


def test_files_that_people_write_get_todays_defaults():
    controller = IocSettings.model_validate({"kind": "ioc", "prediction": {"offset": {"filter_s": 0.4}}})
    assert controller.dither is not None
    assert controller.prediction.tension_gap is not None
    assert controller.prediction.offset.from_start


@pytest.mark.parametrize(
    "settings",
    [
        None,
        "text",
        {},
        {"controller": "ioc"},
        {"controller": {"kind": "kinematic", "period_s": 0.1}},
        {
            "controller": {
                "kind": "ioc",
                "prediction": "literal",
                "dither": "off",
                "drives": {"lag_s": 0.0},
                "settle_s": 0.0,
            }
        },
        {
            "controller": {
                "kind": "ioc",
                "prediction": {"kind": "one_step", "horizon_s": 0.4},
                "dither": "off",
                "drives": {"lag_s": 0.03},
                "settle_s": 0.0,
            }
        },
        {"estimator": {"kind": "exact"}},
    ],
)
def test_what_is_not_old_comes_back_as_it_is(settings):
    assert in_todays_form(settings) == settings


@pytest.mark.parametrize(("model", "prediction"), MEANT)
def test_a_converted_form_is_not_old_any_more(model, prediction):
    found = in_todays_form({"controller": old(model, prediction), "estimator": OBSERVER})
    assert in_todays_form(found) == found
