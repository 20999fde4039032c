"""The linearised response against the nonlinear robot, its own static limit and its order in time."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg

from support import mechanics
from support.mechanics import FREE
from tcrctl.elements.sliding_cable import STIFFNESS
from tcrctl.numerics import block_banded
from tcrctl.robot import dynamics, linear, pose, response, response_basis
from tcrctl.robot.equations import assemble, make_workspace
from tcrctl.robot.equilibrium import equilibrium, static_load
from tcrctl.robot.hole_drag import fill_hole_drag, no_drag, turn
from tcrctl.robot.modes import modes
from tcrctl.robot.robot import hole_friction
from tcrctl.robot.sections import FrictionSettings

ROBOTS = ["tcr600", "tcr700"]
MODES = 16


@pytest.fixture(params=ROBOTS)
def robot(request):
    return request.getfixturevalue(request.param)


def instants(step, steps):
    """Times of responses (steps,) [s]."""
    return step * np.arange(1.0, steps + 1.0)


class Bent:
    """A robot at a bent, taut equilibrium, with the basis of its response."""

    def __init__(self, robot, basis_modes=MODES, model=None):
        self.robot = robot
        self.model = robot.model if model is None else model
        self.drive = 0.012 + 0.004 * np.cos(np.arange(robot.n_cables))
        self.rest = equilibrium(self.model, self.drive, robot.weight, robot.rest.q)
        assert (self.rest.tension > 1.0).all()
        self.basis = response_basis.start_basis(self.model, self.workspace(), basis_modes)

    def workspace(self):
        ws = make_workspace(self.model)
        load = static_load(self.model, self.robot.weight)
        assemble(self.model, self.rest.q, self.drive, load, ws, np.bool_(True))
        assert linear.factor_shifted(ws.K, ws.U) == 0.0
        linear.couple(ws, ws.r)
        return ws

    def respond(self, offset, v, step, steps, drag=None, held=None, turn=0.0, gain=None):
        held = np.zeros(self.basis.shape[0]) if held is None else held
        gain = np.zeros((held.size, self.robot.n_cables)) if gain is None else gain
        change, stable = response.respond(
            self.model,
            self.rest.q,
            response.Release(offset, v, gain),
            instants(step, steps),
            self.robot.tip,
            self.workspace(),
            self.basis.copy(),
            response.Drag(no_drag(self.model) if drag is None else drag, held, turn),
        )
        assert stable
        return change

    def outputs(self, q, tension):
        tip = self.robot.tip
        return np.concatenate([pose.position(q, tip), pose.normal(q, tip), [pose.twist(q, tip)], tension])

    def simulate(self, v, speed, step, steps):
        """Changes of the outputs in the nonlinear simulation (steps, 7 + m)."""
        x = dynamics.rest_state(self.rest.q, self.drive)
        x.v[:] = v
        work, scratch = make_workspace(self.model), dynamics.make_scratch(self.model)
        before, out = self.outputs(self.rest.q, self.rest.tension), []
        rule = dynamics.Rule(h=5e-4, rho=0.8)
        for _ in range(steps):
            moved = dynamics.advance(self.model, x, speed, step, rule, self.robot.weight, work, scratch)
            assert moved[0]
            out.append(self.outputs(x.q, work.tension) - before)
        return np.array(out)


def slow_velocity(bent, size):
    """Velocity in the two slowest modes, ``size`` [m/s] at its fastest node."""
    found = modes(bent.model, bent.rest, bent.drive, bent.robot.weight, 2)
    v = found.shape @ [1.0, 0.5]
    return size * np.concatenate([np.zeros(FREE), v / np.abs(v).max()])


def without_dampers(robot):
    """Mass-proportional damping alone, which is what the response knows of damping."""
    return mechanics.undamped(robot.model)._replace(damping=robot.model.damping)


@pytest.mark.slow
def test_small_motions_are_those_of_the_nonlinear_robot_up_to_second_order(robot):
    bent = Bent(robot, basis_modes=40, model=without_dampers(robot))
    u = 0.02 * np.cos(1.0 + np.arange(robot.n_cables))
    v, still = slow_velocity(bent, 0.05), np.zeros_like(bent.rest.q)
    change = bent.respond(still, v, 0.01, 30)
    linear_motion = change[:, :, :-1] @ u + change[:, :, -1]
    errors = []
    for part in (0.25, 0.125):
        motion = bent.simulate(part * v, part * u, 0.01, 30)
        difference = np.abs(motion - part * linear_motion)[:, :3].max()
        errors.append([difference, np.abs(motion)[:, :3].max()])
    (large, moved), (small, _) = errors
    assert moved > 1e-3
    assert large < 0.06 * moved
    assert small < 0.3 * large


@pytest.mark.slow
def test_the_end_position_is_forecast_within_two_per_cent(robot):
    """With the shipped basis and all dampers of the plant."""
    bent = Bent(robot)
    u, v = 0.001 * np.cos(1.0 + np.arange(robot.n_cables)), slow_velocity(bent, 0.005)
    change = bent.respond(np.zeros_like(v), v, 0.025, 32)
    forecast = change[:, :, :-1] @ u + change[:, :, -1]
    motion = bent.simulate(v, u, 0.025, 32)
    assert np.abs(forecast - motion)[:, :3].max() < 0.02 * np.abs(motion)[:, :3].max()
    assert np.abs(forecast - motion)[:, 3:6].max() < 0.03 * np.abs(motion)[:, 3:6].max()


def test_after_a_slow_ramp_the_change_is_the_static_gain(robot):
    """A ramp of 1 m/s after t seconds: gain times (t - lag), so differences of late times are the gain."""
    bent = Bent(robot, model=without_dampers(robot)._replace(damping=20.0))
    change = bent.respond(np.zeros_like(bent.rest.q), np.zeros_like(bent.rest.q), 0.1, 400)
    slope = (change[-1] - change[-101]) / 10.0
    first = 3 * (robot.tip - 4)
    C = pose.output_matrix(bent.rest.q, robot.tip)
    expected = C @ bent.rest.gain[first : first + 9]
    np.testing.assert_allclose(slope[:7, :-1], expected, atol=1e-4 * np.abs(expected).max())
    ws = bent.workspace()
    linear.couple(ws, ws.r)
    tensions = linear.tension_gain(ws, bent.rest.gain)
    np.testing.assert_allclose(slope[7:, :-1], tensions, atol=1e-3 * np.abs(tensions).max())


def test_free_motion_dies_out_towards_the_point_of_rest(robot):
    bent = Bent(robot, model=without_dampers(robot)._replace(damping=20.0))
    offset = slow_velocity(bent, 0.01)
    change = bent.respond(offset, np.zeros_like(offset), 0.1, 400)
    first = 3 * robot.tip
    expected = -pose.output_matrix(bent.rest.q, robot.tip) @ offset[first : first + 9]
    np.testing.assert_allclose(change[-1, :7, -1], expected, atol=1e-6)


def test_responses_converge_with_the_square_of_the_step(robot):
    bent = Bent(robot)
    v = slow_velocity(bent, 0.05)
    ends = [bent.respond(np.zeros_like(v), v, 0.4 / n, n)[-1, :6] for n in (16, 32, 64, 512)]
    free = [np.abs(end[:, -1] - ends[-1][:, -1]).max() for end in ends[:-1]]
    order = np.log2(np.divide(free[:-1], free[1:]))
    assert np.all((order > 1.8) & (order < 2.2)), order


@pytest.mark.slow
def test_the_response_is_linear_in_the_state(robot):
    bent = Bent(robot)
    a, b = slow_velocity(bent, 0.01), np.roll(slow_velocity(bent, 0.02), 3)
    b[:FREE] = 0.0
    still = np.zeros_like(a)
    both = bent.respond(a, b, 0.02, 10)
    apart = bent.respond(a, still, 0.02, 10)[:, :, -1] + bent.respond(still, b, 0.02, 10)[:, :, -1]
    np.testing.assert_allclose(both[:, :, -1], apart, atol=1e-9 * np.abs(apart).max())


def test_the_basis_holds_the_slowest_modes_and_the_static_answers(robot):
    bent = Bent(robot)
    found = modes(bent.model, bent.rest, bent.drive, robot.weight, 4)
    M_V = np.stack([mechanics.mass_times(bent.model, np.r_[np.zeros(FREE), x]) for x in bent.basis.T], axis=1)
    gram = bent.basis.T @ M_V
    kept = np.diag(gram) > 0.5
    np.testing.assert_allclose(gram[np.ix_(kept, kept)], np.eye(kept.sum()), atol=1e-9)
    for shape in (*found.shape.T, *bent.rest.gain.T):
        outside = shape - bent.basis @ (M_V.T @ shape)
        assert np.linalg.norm(outside) < 1e-5 * np.linalg.norm(shape)


def test_the_basis_comes_with_the_stiffness_and_the_cable_lengths_on_it(robot):
    bent = Bent(robot)
    ws, V = bent.workspace(), bent.basis.copy()
    reduced = response_basis.refine_basis(bent.model, ws, V)
    KV, MV = np.empty(V.shape), np.empty(V.shape)
    block_banded.multiply_columns(ws.K, V, KV)
    response_basis.mass_columns(bent.model.mass, V, MV)
    GV = ws.G[:, FREE:] @ V
    stiffness = V.T @ KV + GV.T @ (ws.axial[:, None] * GV)
    np.testing.assert_allclose(reduced.weighted, MV, atol=1e-12 * np.abs(MV).max())
    np.testing.assert_allclose(reduced.lengths, GV, atol=1e-9 * np.abs(GV).max())
    np.testing.assert_allclose(reduced.stiffness, stiffness, atol=1e-9 * np.abs(stiffness).max())


def test_a_slack_cable_keeps_its_authority_over_its_predicted_tension(tcr700):
    bent = Bent(tcr700)
    ws = bent.workspace()
    ws.axial[1] = 0.0  # as if cable 2 were slack
    still = np.zeros_like(bent.rest.q)
    no_more = np.zeros((bent.basis.shape[0], tcr700.n_cables))
    release, ahead = response.Release(still, still, no_more), instants(0.02, 5)
    drag = response.Drag(no_drag(bent.model), still[FREE:], 0.0)
    change, stable = response.respond(
        bent.model, bent.rest.q, release, ahead, tcr700.tip, ws, bent.basis.copy(), drag
    )
    assert stable
    assert change[-1, 7 + 1, 1] > 0.0


def test_ramps_go_further_by_the_gain_that_the_model_lacks_and_cables_stay_as_long(tcr700):
    bent, part = Bent(tcr700), 0.4
    still = np.zeros_like(bent.rest.q)
    plain = bent.respond(still, still, 0.2, 300)
    further = bent.respond(still, still, 0.2, 300, gain=part * bent.rest.gain)
    went = plain[-1, :6, :-1] - plain[-101, :6, :-1]
    goes = further[-1, :6, :-1] - further[-101, :6, :-1]
    np.testing.assert_allclose(goes, (1.0 + part) * went, atol=0.02 * np.abs(went).max())
    np.testing.assert_array_equal(further[:, :, -1], plain[:, :, -1])
    rise, rises = plain[-1, 7:] - plain[-101, 7:], further[-1, 7:] - further[-101, 7:]
    np.testing.assert_allclose(rises, rise, atol=0.02 * np.abs(rise).max())


def dragged(bent):
    """Drag of a robot with friction whose cables are moved to and fro by 2 mm."""
    drag = no_drag(bent.model)
    friction = hole_friction(FrictionSettings(), bent.model.first_hole)
    fill_hole_drag(bent.model, bent.rest.q, bent.workspace(), friction, turn(0.1, 2e-3), drag)
    return drag


def dense(bent, drag, time):
    """System matrix of (δ, δ', f, t, 1), and its columns for unit ramps, from dense matrices."""
    ws, size, m = bent.workspace(), bent.basis.shape[0], bent.robot.n_cables
    mass, stiffness = np.empty((size, size)), np.empty((size, size))
    response_basis.mass_columns(bent.model.mass, np.eye(size), mass)
    block_banded.multiply_columns(ws.K, np.eye(size), stiffness)
    G, axial = ws.G[:, FREE:], bent.model.cables[:, STIFFNESS]
    stiffness += G.T @ (axial[:, None] * G)
    cable = np.repeat(np.arange(m), np.diff(bent.model.first_hole))
    of = np.array([cable == c for c in range(m)], dtype=float)
    D = drag.path.T @ (drag.coefficient[:, None] * drag.path)
    F = drag.path.T @ (drag.coefficient[:, None] * drag.through[:, None] * of.T)
    inverse, n = np.linalg.inv(mass), 3 * size
    systems = []
    for c in range(m + 1):  # the last one moves by itself
        S = np.zeros((n + 2, n + 2))
        S[:size, size : 2 * size] = np.eye(size)
        S[size : 2 * size, :size] = -inverse @ stiffness
        S[size : 2 * size, size : 2 * size] = -bent.model.damping * np.eye(size)
        S[size : 2 * size, 2 * size : n] = inverse
        S[2 * size : n, size : 2 * size] = -D / time
        S[2 * size : n, 2 * size : n] = -np.eye(size) / time
        if c < m:
            S[size : 2 * size, n] = -inverse @ (axial[c] * G[c])
            S[2 * size : n, n + 1] = -F[:, c] / time
            S[n, n + 1] = 1.0
        systems.append(S)
    return systems


@pytest.mark.slow
@pytest.mark.parametrize("time", [0.05, 0.2])
def test_drag_that_follows_the_slip_late_is_that_of_the_dense_equations(tcr600, time):
    bent = Bent(tcr600)
    drag, size, m = dragged(bent), bent.basis.shape[0], tcr600.n_cables
    still, first_cable = np.zeros_like(bent.rest.q), slice(0, bent.model.first_hole[1])
    held = drag.path[first_cable].T @ (0.05 * drag.coefficient * drag.through)[first_cable]
    found = bent.respond(still, still, 0.01, 60, drag=drag, held=held, turn=time)[:, :3]
    output = pose.output_matrix(bent.rest.q, tcr600.tip)[:3]
    first = 3 * tcr600.tip - FREE
    for c, system in enumerate(dense(bent, drag, time)):
        step, x = scipy.linalg.expm(0.01 * system), np.zeros(3 * size + 2)
        x[-1] = 1.0
        if c == m:
            x[2 * size : 3 * size] = held
        wanted = np.empty((60, 3))
        for n in range(60):
            x = step @ x
            wanted[n] = output @ x[first : first + 9]
        aside = found[:, :2, c] - wanted[:, :2]  # along the robot it is too quick for these steps
        assert np.abs(aside).max() < 0.02 * np.abs(wanted[:, :2]).max()


def test_drag_that_follows_late_ends_where_one_that_follows_at_once_does(tcr700):
    bent = Bent(tcr700)
    drag, still = dragged(bent), np.zeros_like(bent.rest.q)
    now, late = (bent.respond(still, still, 0.1, 400, drag=drag, turn=time) for time in (0.0, 0.3))
    assert np.abs(now[3] - late[3]).max() > 0.01 * np.abs(now[3]).max()
    last = slice(-10, None)  # what does not grow with the ramp is small beside it
    np.testing.assert_allclose(np.diff(late[last], axis=0), np.diff(now[last], axis=0), rtol=1e-2, atol=1e-3)
