"""Time stepping of the robot: order two, energy, work of the drives, equilibrium, sub-steps, (26)."""

from __future__ import annotations

import threading
import time

import numpy as np
import pytest

from support import mechanics
from support.mechanics import FREE
from tcrctl.elements import bar, sliding_cable
from tcrctl.numerics.generalized_alpha import coefficients
from tcrctl.robot import dynamics
from tcrctl.robot.equations import FORCE, Q_FREE, Load, assemble, make_workspace, residual
from tcrctl.robot.equilibrium import equilibrium, static_load
from tcrctl.robot.robot import hole_friction
from tcrctl.robot.sections import FrictionSettings
from tcrctl.robot.unworn import unworn

ROBOTS = ["tcr600", "tcr700", "tcr5x4"]
RHO = 0.8


@pytest.fixture(params=ROBOTS)
def robot(request):
    return request.getfixturevalue(request.param)


class Motion:
    """A robot's model and its state in time."""

    def __init__(self, robot, model=None, rho=RHO, q=None, drive=None):
        self.model = robot.model if model is None else model
        self.weight, self.rho = robot.weight, rho
        drive = np.zeros(robot.n_cables) if drive is None else drive
        self.state = dynamics.rest_state(robot.rest.q if q is None else q, drive)
        self.work, self.scratch = make_workspace(self.model), dynamics.make_scratch(self.model)
        self.work.tension[:] = robot.rest.tension

    def advance(self, speed, duration, h=1e-3):
        """Advance; returns (converged, residual, smallest internal step, iterations)."""
        rule = dynamics.Rule(h, self.rho)
        return dynamics.advance(
            self.model, self.state, speed, duration, rule, self.weight, self.work, self.scratch
        )

    def branch(self, rho):
        """The same state, to be continued with another spectral radius."""
        other = Motion.__new__(Motion)
        other.__dict__.update(self.__dict__)
        x = self.state
        other.state = dynamics.State(
            x.q.copy(), x.v.copy(), x.acceleration.copy(), x.acceleration.copy(), x.drive.copy(), None
        )
        other.rho = rho
        return other


def speeds(robot):
    """Different speeds that keep all cables taut [m/s]."""
    return 0.03 + 0.03 * np.cos(1.0 + np.arange(robot.n_cables))


def swinging(robot, model=None, rho=RHO):
    """In smooth motion after the drives have gently come to ``speeds``."""
    motion, ramp = Motion(robot, model, rho), 300
    for k in range(ramp):
        t = (k + 0.5) / ramp
        motion.advance(speeds(robot) * (10 * t**3 - 15 * t**4 + 6 * t**5), 5e-4, 5e-4)
    assert (motion.work.tension > 0.0).all()
    return motion


def test_a_static_equilibrium_is_a_fixed_point(robot):
    drive = np.linspace(0.005, 0.02, robot.n_cables)
    rest = equilibrium(robot.model, drive, robot.weight, robot.rest.q)
    motion = Motion(robot, q=rest.q, drive=drive)
    converged, *_ = motion.advance(np.zeros(robot.n_cables), 0.2)
    assert converged
    np.testing.assert_allclose(motion.state.q, rest.q, atol=1e-9)
    np.testing.assert_allclose(motion.state.v, 0.0, atol=1e-8)
    np.testing.assert_allclose(motion.work.tension, rest.tension, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("rho", [0.8, 0.3])
def test_positions_and_velocities_converge_with_the_square_of_the_step(robot, rho):
    start = swinging(robot)
    start.advance(speeds(robot), 0.1, 2.5e-4)
    exact = start.branch(rho)
    exact.advance(speeds(robot), 0.16, 1.25e-4)
    errors = []
    for step in (4e-3, 2e-3, 1e-3):
        motion = start.branch(rho)
        motion.advance(speeds(robot), 0.16, step)
        q, v = motion.state.q - exact.state.q, motion.state.v - exact.state.v
        errors.append([np.linalg.norm(q), np.linalg.norm(v)])
    order = np.log2(np.divide(errors[:-1], errors[1:]))
    assert np.all((order[:, 0] > 1.8) & (order[:, 0] < 2.2)), order
    assert np.all(order[:, 1] > 1.5), order
    assert np.all(order[-1] > 1.9), order


@pytest.mark.slow
def test_without_dampers_and_dissipation_energy_is_kept(robot):
    model = mechanics.undamped(robot.model)
    motion, energy = swinging(robot, model, rho=1.0), mechanics.EnergyMeter(model, robot.weight)
    still = np.zeros(robot.n_cables)
    start, kinetic = (
        energy(motion.state),
        0.5 * motion.state.v[FREE:] @ mechanics.mass_times(model, motion.state.v),
    )
    history = []
    for _ in range(100):
        motion.advance(still, 0.01)
        history.append(energy(motion.state) - start)
    assert np.abs(history).max() < 0.02 * kinetic
    assert abs(np.mean(history[-20:]) - np.mean(history[:20])) < 5e-3 * kinetic


def test_with_held_drives_dampers_only_ever_take_energy(robot):
    motion, energy = swinging(robot), mechanics.EnergyMeter(robot.model, robot.weight)
    v, still = motion.state.v, np.zeros(robot.n_cables)
    kinetic, history = 0.5 * v[FREE:] @ mechanics.mass_times(robot.model, v), [energy(motion.state)]
    for _ in range(100):
        motion.advance(still, 0.01)
        history.append(energy(motion.state))
    assert np.diff(history).max() < 0.0
    assert history[0] - history[-1] > 0.5 * kinetic


def dissipation(model, state, speed):
    """Power [W] that goes into rods, springs, cables and mass-proportional damping."""
    length, rate = np.zeros(len(model.bars)), np.zeros(len(model.bars))
    bar.lengths_and_rates(state.q, state.v, model.bar_nodes, length, rate)
    slack = (model.bars[:, bar.TENSION_ONLY] == 1.0) & (length < model.bars[:, bar.REST])
    lengths, G = np.zeros(len(speed)), np.zeros((len(speed), state.q.size))
    sliding_cable.path_gradients(
        state.q, model.first_hole, model.hole_nodes, model.hole_weights, model.cables, lengths, G
    )
    in_bars = np.sum(np.where(slack, 0.0, model.bars[:, bar.DAMPING]) * rate**2)
    in_cables = np.sum(model.cables[:, sliding_cable.DAMPING] * (G @ state.v + speed) ** 2)
    return in_bars + in_cables + model.damping * state.v[FREE:] @ mechanics.mass_times(model, state.v)


def imbalance(robot, step, duration=0.2):
    """Work of the drives minus change of energy minus dissipated energy [J], and the work itself."""
    motion, energy, u = swinging(robot), mechanics.EnergyMeter(robot.model, robot.weight), speeds(robot)
    motion.advance(u, 0.05, 2.5e-4)
    start, powers = energy(motion.state), []
    for _ in range(round(duration / step)):
        powers.append([motion.work.tension @ u, dissipation(robot.model, motion.state, u)])
        motion.advance(u, step, step)
    powers.append([motion.work.tension @ u, dissipation(robot.model, motion.state, u)])
    work, lost = np.trapezoid(np.array(powers), dx=step, axis=0)
    return work - (energy(motion.state) - start) - lost, work


@pytest.mark.slow
def test_the_work_of_the_drives_is_stored_or_dissipated(robot):
    coarse, work = imbalance(robot, 2e-3)
    fine, _ = imbalance(robot, 1e-3)
    assert work > 0.01
    assert abs(fine) < 1e-4 * work
    assert abs(fine) < 0.4 * abs(coarse)


def test_the_equation_of_motion_holds_at_the_end_of_a_step(robot):
    model = mechanics.undamped(robot.model)
    motion, work = swinging(robot, model), make_workspace(model)
    residual(model, motion.state.q, motion.state.drive, static_load(model, robot.weight), work)
    unbalanced = mechanics.mass_times(model, motion.state.acceleration) + work.r
    assert np.abs(work.r).max() > 1e-4
    assert np.abs(unbalanced).max() < 2 * dynamics.TOLERANCE
    np.testing.assert_allclose(work.tension, motion.work.tension, rtol=1e-14)


def test_the_base_does_not_move(robot):
    motion = swinging(robot)
    assert np.array_equal(motion.state.q[:FREE], robot.rest.q[:FREE])
    assert not motion.state.v[:FREE].any()


def test_the_result_does_not_depend_on_how_the_time_is_cut(robot):
    whole, parts = Motion(robot), Motion(robot)
    u = speeds(robot)
    whole.advance(u, 0.05)
    for duration in (0.01, 0.025, 0.015):
        parts.advance(u, duration)
    np.testing.assert_allclose(parts.state.q, whole.state.q, atol=1e-12)
    np.testing.assert_allclose(parts.state.drive, 0.05 * u, rtol=1e-12)


def test_a_duration_that_is_no_multiple_of_the_step_is_kept(tcr5x4):
    motion, u = Motion(tcr5x4), speeds(tcr5x4)
    assert motion.advance(u, 0.0107)[0]
    np.testing.assert_allclose(motion.state.drive, 0.0107 * u, rtol=1e-12)


def test_a_violent_pull_is_resolved_by_sub_steps(tcr700):
    motion = Motion(tcr700)
    converged, force, smallest, _ = motion.advance(np.array([8.0, 0, 0, 0, 0, 0]), 0.02, 5e-3)
    assert converged
    assert force <= dynamics.TOLERANCE
    assert smallest < 5e-3
    np.testing.assert_allclose(motion.state.drive, [0.16, 0, 0, 0, 0, 0], atol=1e-12)


def test_a_step_that_cannot_be_made_leaves_the_state_as_it_was(tcr700):
    motion = swinging(tcr700)
    before = motion.branch(RHO).state
    converged, _, smallest, _ = motion.advance(np.full(6, np.nan), 0.01)
    assert not converged
    assert smallest == pytest.approx(1e-3 / 2**dynamics.MAX_HALVINGS)
    for name in ("q", "v", "drive"):
        assert np.array_equal(getattr(motion.state, name), getattr(before, name))
    assert motion.advance(speeds(tcr700), 0.01)[0]


def test_a_motion_that_breaks_down_halfway_ends_at_its_last_good_step(tcr5x4):
    motion = Motion(tcr5x4)
    u = np.array([40.0, 0, 0, 0])
    converged, force, smallest, _ = motion.advance(u, 0.004, 0.05)
    assert not converged
    assert force > dynamics.TOLERANCE
    assert smallest == pytest.approx(0.05 / 2**dynamics.MAX_HALVINGS)
    assert 0.0 < motion.state.drive[0] < 0.16
    ws = make_workspace(tcr5x4.model)
    residual(tcr5x4.model, motion.state.q, motion.state.drive, static_load(tcr5x4.model, tcr5x4.weight), ws)
    assert np.isfinite(ws.r).all()
    assert motion.advance(np.zeros(4), 0.05)[0]


def test_cables_only_pull(tcr700):
    motion = Motion(tcr700)
    for _ in range(20):
        assert motion.advance(np.array([0.1, 0.1, -0.8, -0.8, -0.8, 0.1]), 0.01)[0]
        assert motion.work.tension.min() >= 0.0
    assert (motion.work.tension == 0.0).sum() >= 2
    assert motion.work.tension.max() > 1.0


def test_other_threads_run_while_the_plant_advances(tcr700):
    motion, ticks, done = Motion(tcr700), [], threading.Event()
    motion.advance(speeds(tcr700), 0.001)  # compiled or loaded now

    def tick():
        while not done.wait(0.001):
            ticks.append(time.perf_counter())

    thread = threading.Thread(target=tick)
    thread.start()
    begin = time.perf_counter()
    motion.advance(speeds(tcr700), 0.3, 1e-4)
    end = time.perf_counter()
    done.set()
    thread.join()
    assert sum(begin < t < end for t in ticks) > 5


def step_of_the_bordered_system(robot, x, speed, h):
    """One step with unknowns (q, s, λ) by dense Newton on (26): s the actuation nodes, Φ = s - d = 0."""
    model, ws, s = robot.model, make_workspace(robot.model), dynamics.make_scratch(robot.model)
    c, m, size = coefficients(RHO, h), robot.n_cables, 12 * robot.n_modules
    dynamics.lengths_before(model, x.q, x.v, x.drive, speed, 0.5 * h, s, ws)
    new_a = (x.acceleration - c.alpha_m * x.auxiliary) / (1 - c.alpha_m)
    q0 = x.q + h * x.v + h * h * ((0.5 - c.beta) * x.auxiliary + c.beta * new_a)
    v0 = x.v + h * ((1 - c.gamma) * x.auxiliary + c.gamma * new_a)
    inertia = c.acceleration + model.damping * c.velocity
    s.nodal[Q_FREE] = q0 - (x.acceleration + model.damping * v0) / inertia
    s.nodal[FORCE] = robot.weight
    load = Load(inertia, 2.0 / h, s.nodal, s.bar_before, s.cable_before, None)
    q, node, multiplier, one = q0.copy(), x.drive.copy(), np.zeros(m), np.eye(m)
    for _ in range(12):
        assemble(model, q, node, load, ws, np.bool_(True))
        G, C = ws.G[:, FREE:], np.diag(ws.axial)
        matrix = np.block(
            [
                [mechanics.dense_tangent(ws), G.T @ C, np.zeros((size, m))],
                [C @ G, C, -one],
                [np.zeros((m, size)), one, np.zeros((m, m))],
            ]
        )
        unbalanced = np.concatenate([ws.r, ws.tension - multiplier, node - (x.drive + h * speed)])
        step = np.linalg.solve(matrix, -unbalanced)
        q[FREE:] += step[:size]
        node += step[size : size + m]
        multiplier += step[size + m :]
    return q, multiplier


@pytest.mark.parametrize("name", ["tcr5x4", "tcr600"])
def test_a_step_with_the_actuation_nodes_eliminated_is_that_of_the_bordered_system(name, request):
    robot = request.getfixturevalue(name)
    motion = swinging(robot)
    q, multiplier = step_of_the_bordered_system(robot, motion.state, 1.5 * speeds(robot), 2e-3)
    motion.advance(1.5 * speeds(robot), 2e-3, 2e-3)
    np.testing.assert_allclose(motion.state.q, q, atol=1e-10)
    np.testing.assert_allclose(motion.work.tension, multiplier, atol=1e-5)


@pytest.mark.parametrize("rubs", [False, True])
def test_what_a_step_knows_of_the_last_one_changes_nothing(tcr5x4, rubs):
    """The cables' geometry is not measured again where the last internal step ended: bit for bit the same."""
    model, still = tcr5x4.model, np.zeros(4)

    def moved(fresh):
        holes = hole_friction(FrictionSettings(coefficient=0.1), model.first_hole)
        slip = unworn(model, tcr5x4.rest.q, still, tcr5x4.rest.tension, holes) if rubs else None
        state = dynamics.rest_state(tcr5x4.rest.q, still, slip)
        work, scratch = make_workspace(model, rubbing=rubs), dynamics.make_scratch(model)
        for k in range(40):
            if fresh:
                work, scratch = make_workspace(model, rubbing=rubs), dynamics.make_scratch(model)
            speed, rule = 0.05 * np.cos(0.2 * k + np.arange(4)), dynamics.Rule(1e-3, RHO)
            done = dynamics.advance(model, state, speed, 2e-3, rule, tcr5x4.weight, work, scratch)
            assert done[0]
        return state.q

    assert np.array_equal(moved(fresh=False), moved(fresh=True))
