"""Laws of the stability analysis: known loops are exact, real loops grow and fade as their spectral radius says."""

from __future__ import annotations

import copy
import csv
import json
from types import SimpleNamespace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.closed_loop import KINDS, constant, ioc, resting, settings_of
from support.short_runs import arguments
from tcrctl.cli.app import main
from tcrctl.controller.controller import build_controller
from tcrctl.controller.inner_map import Linearisable, newton_map
from tcrctl.controller.literal import LiteralIoc
from tcrctl.controller.settings import CostWeights
from tcrctl.controller.shell import Shell
from tcrctl.errors import InputError
from tcrctl.estimator.estimator import build_estimator
from tcrctl.estimator.settings import ExactSettings, PassiveObserverSettings
from tcrctl.loop.loop import Parts
from tcrctl.memory import Kept
from tcrctl.numerics.spectrum import Spectrum
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.robot.equilibrium import static_load
from tcrctl.signals import Command
from tcrctl.stability import analysis
from tcrctl.stability.analysis import analysed_steps, inner_radius, linearisable, spectrum_of
from tcrctl.stability.closed_loop import ClosedLoop, StepMap
from tcrctl.stability.report import StabilityPoint, StabilityReport

pytestmark = pytest.mark.slow

MISMATCH = Mismatch(springs_youngs_modulus=0.7, density=1.2)


class LinearPlant:
    """x+ = A x + B u, measured without error."""

    def __init__(self, A, B):
        self.A, self.B, self.x = A, B, np.ones(len(A))

    def read(self):
        return SimpleNamespace(
            x=self.x.copy(), drive=np.zeros(1), position=np.zeros(3), tension=np.zeros(1), converged=True
        )

    def truth(self):
        return None

    def write(self, command):
        self.x = self.A @ self.x + self.B @ command.speed
        return command

    def memory(self):
        return {"x": Kept(self.x, 1e-3)}


class LinearController:
    """u = -K x - w with the integral w+ = w + x_0, and something kept that nothing depends on."""

    ahead = np.ones(1)

    def __init__(self, K):
        self.K, self.w, self.idle = K, np.zeros(1), np.array([1.0, 2.0])

    def control(self, estimate, reference):
        u = -self.K @ estimate.x - self.w
        self.w = self.w + estimate.x[:1]
        return Command(u, np.zeros(1)), SimpleNamespace(converged=True, reason="")

    def memory(self):
        return {"w": Kept(self.w, 0.5), "idle": Kept(self.idle, 1.0, blind=np.array([0.6, 0.8]))}


class Standing:
    """A trajectory that stays where it is."""

    duration = 1.0

    def __init__(self, position, normal):
        self._position, self._normal = position, normal

    def position(self, t):
        return np.tile(self._position, (len(t), 1))

    def normal(self, t):
        return np.tile(self._normal, (len(t), 1))


class Through:
    """An estimator that believes what it sees."""

    def update(self, measured, applied):
        return measured

    def memory(self):
        return {}


@pytest.mark.parametrize("gain", [0.1, 0.4, 1.5])
def test_the_radius_of_a_linear_loop_is_exact(gain):
    A, B = np.array([[1.0, 0.1], [-0.2, 0.95]]), np.array([[0.0], [0.1]])
    K = gain * np.array([[1.0, 1.0]])
    still = Standing(np.zeros(3), np.array([0.0, 0.0, 1.0]))
    parts = Parts(still, LinearPlant(A, B), Through(), LinearController(K), period=1.0, steps=1)
    loop = ClosedLoop(parts)
    loop.step()  # from then on a set-point is remembered, on which nothing depends here
    found, converged = spectrum_of(StepMap(loop))
    whole = np.block([[A - B @ K, -B], [np.array([[1.0, 0.0, 1.0]])]])
    # of the two idle numbers one direction is declared without effect, the other stays: eigenvalues 0 and 1
    expected = np.sort(np.abs(np.append(np.linalg.eigvals(whole), [0.0, 1.0])))[::-1]
    assert converged
    np.testing.assert_allclose(np.abs(found), expected[:4], rtol=1e-6, atol=1e-9)


def real_loop(robot, settings, steps, offset=(0.01, 0.0, 0.02), exact=False, mismatch=MISMATCH):
    """A loop of the robot's own parts on its way to a target."""
    plant = SimulatedPlant(
        SimulatedSettings(kind="simulated", step_ms=2.5, mismatch=mismatch, latency_ms=10.0),
        robot,
        settings.period_s,
        seed=3,
    )
    plant.without_noise()
    kind = ExactSettings(kind="exact") if exact else PassiveObserverSettings(kind="passive_observer")
    estimator = build_estimator(kind, robot, settings.period_s, plant.state)
    estimator.sharpen()
    target = Standing(robot.rest_position + np.array(offset), robot.rest_normal)
    controller = build_controller(settings, robot)
    loop = ClosedLoop(Parts(target, plant, estimator, controller, settings.period_s, steps))
    for _ in range(steps):
        loop.step()
    return loop


@pytest.mark.parametrize("kind", KINDS)
def test_a_loop_that_is_given_the_memory_of_another_goes_on_like_it(tcr600, kind):
    """So nothing that matters is left out of the memory."""
    # the phase of a dither is a clock, not a memory; only the loop of one step wakes it here
    settings = settings_of(kind, **({"dither": None} if kind == "one_step" else {}))
    older = real_loop(tcr600, settings, 15)
    newer = copy.deepcopy(older)
    for _ in range(5):
        newer.step()
    older.parts.plant.time, older.k, older.applied = newer.parts.plant.time, newer.k, newer.applied
    before = StepMap(older)(np.zeros(StepMap(older).size))
    for name, part in older.kept().items():
        part.values[...] = newer.kept()[name].values
    one, other = (StepMap(loop)(np.zeros(before.size)) for loop in (older, newer))
    assert np.linalg.norm(one - other) < 2e-3 * np.linalg.norm(before - other)


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_can_be_linearised(tcr600, kind):
    assert isinstance(build_controller(settings_of(kind), tcr600), Linearisable)


def test_a_controller_that_only_controls_is_refused():
    with pytest.raises(InputError, match="cannot be linearised"):
        linearisable(LinearController(np.eye(1)))


def test_a_copied_loop_is_whole(tcr5x4):
    """The exact estimator of a copy looks at the plant of the copy."""
    loop = real_loop(tcr5x4, settings_of("kinematic"), 3, exact=True)
    step = StepMap(loop)
    moved, plant = copy.deepcopy(loop).parts, loop.parts.plant
    moved.plant.memory()["q"].values[...] += 1e-3
    assert moved.estimator.update(moved.plant.read(), loop.applied).q[20] == moved.plant.state()[0][20]
    before = plant.state()[0]
    assert moved.plant.state()[0][20] == pytest.approx(before[20] + 1e-3)
    assert np.array_equal(step(np.zeros(step.size)), step(np.zeros(step.size)))
    assert np.array_equal(plant.state()[0], before)


@pytest.mark.parametrize(("gain", "unstable", "push"), [(0.3, False, 1e-3), (2.0, True, 1e-6)])
def test_a_small_push_grows_or_fades_as_the_radius_says(tcr5x4, gain, unstable, push):
    settings = settings_of("kinematic", gain_1_s=gain)
    loop = real_loop(tcr5x4, settings, 10, offset=(0.0, 0.0, 0.0), mismatch=None)
    found, converged = spectrum_of(StepMap(loop))
    radius = abs(found[0])
    assert converged
    assert (radius > 1.0) == unstable
    twin, distance = copy.deepcopy(loop), []
    depth = twin.parts.plant.memory()["q"].values.reshape(-1, 3)[:, 2]
    twin.parts.plant.memory()["v"].values.reshape(-1, 3)[:, :2] += push * depth[:, None]
    for _ in range(300):
        loop.step()
        twin.step()
        pairs = zip(loop.kept().values(), twin.kept().values(), strict=True)
        distance.append(np.sqrt(sum(np.sum(((a.values - b.values) / a.scale) ** 2) for a, b in pairs)))
    size = np.log(distance).reshape(-1, 50).mean(axis=1)  # over periods of the slow mode, so its pulse is out
    assert np.exp((size[-1] - size[-3]) / 100.0) == pytest.approx(radius, abs=2e-3)


def test_the_shipped_controller_is_stable_and_the_literal_one_is_not(tcr700):
    weights = CostWeights(position=7.2e4, normal=44.0, twist=1e-3)
    shipped = real_loop(tcr700, ioc(output="pose", weights=weights, dither="off"), 40)
    found, converged = spectrum_of(StepMap(shipped))
    assert converged
    assert abs(found[0]) < 0.9999
    settings = ioc("literal", output="pose", weights=weights, integral="off", tension="off")
    literal = real_loop(tcr700, settings, 40)
    found, _ = spectrum_of(StepMap(literal))
    assert abs(found[0]) > 1.005
    after = StepMap(literal).after(np.zeros(StepMap(literal).size))
    assert inner_radius(after.loop.parts.controller.inner_map()) < 0.5  # and (42) does not notice


def test_the_literal_iteration_has_the_eigenvalues_of_its_inputs_alone(tcr600):
    """At the solution (28) moves q by ξ2 du and nothing else, so (42) is ∂u/∂z along the columns of ξ2: m by m."""
    settings = ioc("literal", integral="off", tension="off")
    planner = LiteralIoc(settings, tcr600)
    controller = Shell(settings, tcr600, planner)
    _, info = controller.control(resting(tcr600), constant(tcr600, controller, (0.02, 0.01, 0.03)))
    assert info.converged
    inner = controller.inner_map()
    period, base, step = 0.05, inner.point, 1e-8
    inner.apply(base)  # leaves ∂q/∂d there
    ways = [
        np.concatenate([period * column, unit])
        for column, unit in zip(planner.gain.T, np.eye(3), strict=True)
    ]
    answers = [inner.apply(base + step * way) - inner.apply(base - step * way) for way in ways]
    reduced = np.stack([answer[-3:] / (2.0 * step) for answer in answers], axis=1)
    largest = np.abs(np.linalg.eigvals(reduced)).max()
    assert largest > 1e-4
    assert inner_radius(inner) == pytest.approx(largest, rel=0.05)


def test_the_newton_map_is_flat_at_its_solution(tcr600):
    """Its image of a deviation shrinks with the square of it."""
    load = static_load(tcr600.model, tcr600.weight)
    inner = newton_map("statics", tcr600, load, np.zeros(3), tcr600.rest.q)
    bend, base = tcr600.rest.gain[:, 0], inner.apply(inner.point)
    image = [np.linalg.norm(inner.apply(inner.point + size * bend) - base) for size in (2e-7, 1e-7)]
    assert image[0] / image[1] == pytest.approx(4.0, rel=0.1)
    assert inner_radius(inner) < 1e-2


@given(st.integers(1, 500), st.integers(1, 60), st.none() | st.integers(1, 100))
def test_analysed_steps_lie_within_the_run_after_the_first(steps, points, every):
    chosen = analysed_steps(steps, points, every)
    assert chosen == sorted(set(chosen))
    assert all(0 < k < steps for k in chosen)
    if every is None:
        assert len(chosen) <= points
        assert not chosen or chosen[0] == 1


def report(*radii, stopped=""):
    points = tuple(
        StabilityPoint(0.5 * i, 0.1, np.array([r, 0.5, 0.4, 0.3], complex), True, False, False)
        for i, r in enumerate(radii)
    )
    return StabilityReport("an experiment", "a robot", "ioc", 0.05, 10, "Newton", points, stopped)


@pytest.mark.parametrize("in_vain", [0, 1, 5])
def test_a_search_that_finds_nothing_begins_elsewhere(in_vain, monkeypatch):
    starts = []

    def search(product, start, count):
        starts.append(tuple(start))
        found = np.array([0.9 + 0.0j] * (len(starts) > in_vain))
        return Spectrum(found, 1, found.size > 0)

    monkeypatch.setattr(analysis, "derivative", lambda *_, **__: lambda w: w)
    monkeypatch.setattr(analysis, "largest_eigenvalues", search)
    found, converged = spectrum_of(SimpleNamespace(size=9))
    assert converged == (found.size > 0) == (in_vain < analysis.STARTS)
    assert len(set(starts)) == len(starts) == min(in_vain + 1, analysis.STARTS)


def test_the_verdict_follows_the_largest_radius():
    assert report(0.9, 0.99).exit_code == 0
    assert report(0.9, 1.01, 0.8).exit_code == 3
    assert report(0.9, np.nan).exit_code == 3
    assert report().exit_code == 3
    assert report(0.9, stopped="too far").exit_code == 4
    worst = report(0.9, 1.01, 0.8)
    assert worst.worst.t == 0.5
    assert worst.growth(worst.worst) == pytest.approx(1.01**20)
    assert worst.as_json()["status"] == "failed"
    assert "1 of 3" in worst.reason
    assert report(0.9, np.nan).as_json()["points"][1]["spectral_radius"] is None


def test_the_command_reports_the_same_numbers_in_every_form(tmp_path, capsys):
    files = ["-o", str(tmp_path / "s.csv"), "--figure", str(tmp_path / "s.png")]
    assert main(["stability", "letter_t", *arguments(), "--points", "1", *files, "--json", "--quiet"]) == 0
    said = json.loads(capsys.readouterr().out)
    with (tmp_path / "s.csv").open() as stream:
        rows = list(csv.DictReader(stream))
    assert said["status"] == "success"
    assert len(rows) == len(said["points"]) == 1
    assert (
        float(rows[0]["spectral_radius"])
        == said["points"][0]["spectral_radius"]
        == said["closed_loop"]["max"]
    )
    assert 0.9 < said["closed_loop"]["max"] < 1.0
    assert said["inner_iteration"]["max"] < 1.0
    assert (tmp_path / "s.png").read_bytes().startswith(b"\x89PNG")


def test_a_run_that_is_stopped_is_reported_up_to_there(capsys):
    limit = ("safety.position_error_mm=0.001", "trajectory.lead_in_s=0")
    assert main(["stability", "letter_t", *arguments(*limit), "--points", "1"]) == 4
    printed = capsys.readouterr()
    assert "position error" in printed.err
    assert "letter_t" in printed.out


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (["-o", "table.txt"], "must end in .csv or .npz"),
        (["--figure", "no/folder/f.png"], "there is no folder"),
        (["--figure", "there.png"], "exists already"),
    ],
)
def test_a_file_that_cannot_be_written_is_refused_before_the_work(
    options, said, tmp_path, monkeypatch, capsys
):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.png").touch()
    assert main(["stability", "letter_t", *options]) == 2
    assert said in capsys.readouterr().err


@pytest.mark.parametrize(
    "effect", ["plant.friction.coefficient=0.1", "plant.drives.backlash_mm=0.2", "plant.step_ms=auto"]
)
def test_a_plant_that_cannot_be_linearised_is_refused(effect, capsys):
    assert main(["stability", "letter_t", "--set", effect, "--points", "1", "--quiet"]) == 2
    assert "can be linearised" in capsys.readouterr().err
