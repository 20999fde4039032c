"""Hysteresis of springs: width of the loop, loss, and a robot that remembers."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support import mechanics
from tcrctl.elements import bar
from tcrctl.plant.reality_settings import HysteresisSettings
from tcrctl.plant.settings import SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.plant.spring_hysteresis import SpringHysteresis
from tcrctl.signals import Command

STIFFNESS, REST, START = 2000.0, 0.02, 0.03


def one_spring(share=0.1, range_mm=2.0):
    """A spring between the apexes of two modules, and the shape in which it is ``stretch`` longer."""
    rigid = [(4, 5, 1.0, 1.0, 0.0, 0.0)] * 12
    model = mechanics.elements_only(2, bars=[*rigid, (7, 11, REST, STIFFNESS, 0.0, 1.0)])

    def shape(stretch):
        q = np.zeros((12, 3))
        q[11, 2] = -(START + stretch)
        return q.ravel()

    return SpringHysteresis(HysteresisSettings(share=share, range_mm=range_mm), model, shape(0.0)), shape


def force(element, q):
    """Force of the spring and its friction element [N]."""
    length = np.linalg.norm(q.reshape(-1, 3)[11] - q.reshape(-1, 3)[7])
    rows = element.model.bars[-2:]
    return float(np.sum(rows[:, bar.STIFFNESS] * (length - rows[:, bar.REST])))


def passed(element, shape, ways, count=400):
    """Stretches, forces, and energy lost on a way through ``ways`` [m]."""
    x = np.concatenate([np.linspace(a, b, count) for a, b in itertools.pairwise(ways)])
    forces, lost = [], 0.0
    for stretch in x:
        lost += element.give_way(shape(stretch))
        forces.append(force(element, shape(stretch)))
    return x, np.array(forces), lost


@pytest.mark.parametrize("share", [0.05, 0.2])
def test_the_loop_is_as_wide_as_the_share_of_the_force_range(share):
    """Stretched and released by range_mm: both branches are the share of k range apart in the middle."""
    element, shape = one_spring(share)
    passed(element, shape, [0.0, 1e-3, -1e-3])
    x, up, _ = passed(element, shape, [-1e-3, 1e-3])
    _, down, lost = passed(element, shape, [1e-3, -1e-3])
    middle = np.interp(0.0, x, up) - np.interp(0.0, x, down[::-1])
    assert middle == pytest.approx(share * STIFFNESS * 2e-3, rel=0.01)
    assert lost > 0.0


def test_small_motions_are_elastic_and_lose_nothing():
    element, shape = one_spring(0.1)
    limit = 0.99 * element.yield_length
    x, forces, lost = passed(element, shape, [0.0, limit, -limit, 0.0])
    assert lost == 0.0
    np.testing.assert_allclose(np.diff(forces), 1.2 * STIFFNESS * np.diff(x), rtol=1e-9, atol=1e-9)


def test_the_area_of_the_loop_is_the_energy_lost_whatever_the_step():
    lost = []
    for count in (100, 800):
        element, shape = one_spring()
        passed(element, shape, [0.0, 1e-3, -1e-3], count)
        x, forces, heat = passed(element, shape, [-1e-3, 1e-3, -1e-3], count)
        lost.append(float(np.sum(0.5 * (forces[1:] + forces[:-1]) * np.diff(x))))
        assert heat == pytest.approx(lost[-1], rel=8.0 / count)
    assert lost[0] == pytest.approx(lost[1], rel=0.03)


@given(st.lists(st.floats(-5e-3, 5e-3), min_size=1, max_size=50))
def test_giving_way_only_takes_energy(stretches):
    element, shape = one_spring()
    for stretch in stretches:
        assert element.give_way(shape(stretch)) >= 0.0
        assert abs(force(element, shape(stretch)) - STIFFNESS * (START + stretch - REST)) <= (
            2.0 * 0.1 * STIFFNESS * element.yield_length * (1.0 + 1e-9)
        )


@pytest.mark.slow
def test_a_robot_begins_at_rest_and_remembers_where_it_has_been(tcr5x4):
    """Bent to one side or to the other and straightened again: the end is not at the same place."""
    ends = []
    for side in (1.0, -1.0):
        settings = SimulatedSettings(kind="simulated", step_ms=2.5, springs_hysteresis={"share": 0.3})
        plant = SimulatedPlant(settings, tcr5x4, 0.05, 1)
        bend = side * np.array([1.0, 0.0, -1.0, 0.0])
        still = np.zeros(4)
        plant.write(Command(still, still))
        np.testing.assert_allclose(plant.truth().q, tcr5x4.rest.q, atol=1e-6)
        for speed in [0.04 * bend] * 10 + [-0.04 * bend] * 10 + [still] * 100:
            plant.write(Command(speed, still))
        ends.append(plant.truth().position)
    assert 1e-5 < np.linalg.norm(ends[0] - ends[1]) < 1e-2
