"""The model is the robot of the file: masses, shapes at rest and under the drives of Table II, slack cables."""

from __future__ import annotations

import numpy as np
import pytest
from tcrctl_mujoco.plant import MujocoPlant, MujocoSection
from tcrctl_mujoco.rigid import rigid_modules

import tcrctl
from tcrctl.experiment.spec import load_spec

TABLE_II = ("table2_bending", "table2_contraction", "table2_s_shape")
LENGTH = 0.7


def plant(robot, **keys):
    return MujocoPlant(MujocoSection(**keys), robot, 0.05, 0)


def test_a_rigid_module_has_the_kinetic_energy_of_its_nodes(robot):
    random = np.random.default_rng(1)
    for module, block in zip(rigid_modules(robot), robot.model.mass, strict=True):
        speed, turn = random.standard_normal((2, 3))
        nodes = speed + np.cross(turn, module.nodes)
        centre = speed + np.cross(turn, module.centre)
        energy = module.mass * centre @ centre / 2 + turn @ module.inertia @ turn / 2
        assert energy == pytest.approx(nodes.ravel() @ block @ nodes.ravel() / 2, rel=1e-12)


def test_it_hangs_where_the_equilibrium_of_tcrctl_is_and_stays_there(robot):
    made = plant(robot)
    made.settle(np.zeros(robot.n_cables))
    np.testing.assert_allclose(made.truth().q, robot.rest.q, atol=1e-6)
    np.testing.assert_allclose(made.tension(), robot.rest.tension, atol=1e-4)


@pytest.mark.parametrize("name", TABLE_II)
def test_static_ends_of_both_plants_agree_within_one_per_cent_of_the_length(tcr700, name):
    drive = np.array(load_spec(name).spec.trajectory.legs[-1].drives_mm) / 1e3
    made = plant(tcr700)
    made.settle(drive)
    wanted = tcrctl.Robot("tcr700").statics(drive)
    assert np.linalg.norm(made.truth().position - wanted.position) < 0.01 * LENGTH
    np.testing.assert_allclose(made.tension(), wanted.tension, atol=0.5)


def test_a_cable_that_is_paid_out_is_slack_and_does_not_push(tcr700):
    made = plant(tcr700)
    drive = np.array([0, -0.05, 0, 0, 0, 0])
    made.settle(drive)
    wanted = tcrctl.Robot("tcr700").statics(drive)
    assert wanted.tension[1] == 0.0
    assert made.data.actuator_force[-6:][1] == 0.0
    np.testing.assert_allclose(made.tension(), wanted.tension, atol=0.1)
    np.testing.assert_allclose(made.truth().position, wanted.position, atol=1e-3)


def test_a_free_swing_has_the_slowest_frequency_that_tcrctl_predicts(tcr700):
    made = plant(tcr700)
    slowest = tcrctl.Robot("tcr700").modes(count=1).frequency[0]
    made.data.qvel[0::6] = 0.005  # a small push along x
    speeds = []
    for _ in range(round(8.0 / made.model.opt.timestep)):
        made._advance(np.zeros(6), np.zeros(6), 0.0)
        speeds.append(made.data.qvel[-6])
    spectrum = np.abs(np.fft.rfft(speeds * np.hanning(len(speeds)), 8 * len(speeds)))
    found = np.argmax(spectrum) / (8 * len(speeds) * made.model.opt.timestep)
    assert found == pytest.approx(slowest, rel=0.03)
