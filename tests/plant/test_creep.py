"""Creep of cables: the standard linear solid, alone and in a robot."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tcrctl.plant.creep import Creep
from tcrctl.plant.reality_settings import CreepBranch
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Command

BRANCHES = (CreepBranch(strength=0.1, time_s=0.5), CreepBranch(strength=0.3, time_s=8.0))


@pytest.mark.parametrize("h", [1e-3, 0.05, 0.4])
def test_a_constant_tension_gives_the_analytic_elongation_whatever_the_step(h):
    """u(t) = sum r_i (T / k) (1 - exp(-t / tau_i)) after a step from zero."""
    creep, elastic = Creep(BRANCHES, np.zeros(2)), np.array([1e-3, 4e-3])
    grown = sum(creep.grow(elastic, h) for _ in range(round(4.0 / h)))
    law = sum(b.strength * -np.expm1(-4.0 / b.time_s) for b in BRANCHES)
    np.testing.assert_allclose(grown, law * elastic, rtol=1e-10)


def test_at_rest_nothing_creeps():
    elastic = np.array([1e-3, 4e-3])
    creep = Creep(BRANCHES, elastic)
    for _ in range(100):
        assert np.abs(creep.grow(elastic, 0.01)).max() < 1e-18


@given(st.lists(st.floats(0.0, 1.0), min_size=2, max_size=60), st.floats(1e-3, 5.0))
def test_no_loop_of_tensions_gives_energy_back(tensions, h):
    """Branch i stores u_i^2 / (2 r_i) (times k); what the tension does at it is never less than what is stored."""
    creep = Creep(BRANCHES, np.zeros(1))
    strengths = np.array([b.strength for b in BRANCHES])
    work = 0.0
    for tension in [*tensions, 0.0]:
        work += float(tension * creep.grow(np.array([tension]), h)[0])
        stored = float(np.sum(creep.late[:, 0] ** 2 / (2.0 * strengths)))
        assert work >= stored - 1e-15


def moved(plant, seconds, speed=0.0):
    for _ in range(round(seconds / plant.period)):
        plant.write(Command(np.full(plant.robot.n_cables, speed), np.zeros(plant.robot.n_cables)))


@pytest.mark.slow
@pytest.mark.parametrize("friction", [None, {"coefficient": 0.05}])
def test_a_robot_relaxes_after_a_drive_step_by_what_the_cables_creep(tcr5x4, friction):
    """All cables taken in alike: each creeps r T / k, as if its drive had paid that out."""
    creep = ({"strength": 0.2, "time_s": 0.4},)
    settings = {"kind": "simulated", "step_ms": 2.5, "friction": friction}
    plain = SimulatedPlant(SimulatedSettings(**settings, drives={}), tcr5x4, 0.05, 1)
    real = SimulatedPlant(SimulatedSettings(**settings, cables={"creep": creep}), tcr5x4, 0.05, 1)
    start = real.truth().tension
    moved(real, 0.5)
    np.testing.assert_allclose(real.truth().tension, start, atol=1e-6)
    for plant in (plain, real):
        moved(plant, 0.2, 0.02)
        moved(plant, 4.0)
    lost = plain.truth().position[2] - real.truth().position[2]
    assert 0.0 < lost < 5e-3
    assert np.all(real.truth().tension < plain.truth().tension)
