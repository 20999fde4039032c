"""A key in another unit is told in which unit it is."""

from __future__ import annotations

import pytest

from tcrctl.config.units import same_in_another_unit

KEYS = ("period_s", "latency_ms", "speed_limit_mm_s", "damping_n_s_m", "mass_g", "tilt_deg", "kind", "start")


@pytest.mark.parametrize(
    ("written", "hint"),
    [
        ("period_ms", "period_s? It is in s, not in ms"),
        ("latency_s", "latency_ms? It is in ms, not in s"),
        ("speed_limit_m_s", "speed_limit_mm_s? It is in mm/s, not in m/s"),
        ("speed_limit", "speed_limit_mm_s? It is in mm/s"),
        ("mass_kg", "mass_g? It is in g, not in kg"),
        ("tilt_rad", "tilt_deg? It is in deg, not in rad"),
        ("damping", "damping_n_s_m? It is in N s/m"),
    ],
)
def test_the_key_of_the_same_name_is_meant(written, hint):
    assert same_in_another_unit(written, KEYS) == f"; did you mean {hint}"


@pytest.mark.parametrize("written", ["perod_s", "start_s", "kind_ms", "mass_mass", "_s", ""])
def test_other_keys_are_left_to_their_likeness(written):
    assert same_in_another_unit(written, KEYS) == ""
