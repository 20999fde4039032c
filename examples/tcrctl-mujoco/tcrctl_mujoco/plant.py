"""The plant: MuJoCo's robot, driven at the speeds of tcrctl and measured by ideal or noisy cameras."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Literal

import mujoco
import numpy as np

from tcrctl.extend import Array, Command, Measurement, PlantSection, Robot, Truth, quantity
from tcrctl_mujoco.model import mujoco_model
from tcrctl_mujoco.rigid import NODES, rigid_modules

#: What MuJoCo counts when it finds numbers that are none.
_UNSTABLE = (
    mujoco.mjtWarning.mjWARN_BADQPOS,
    mujoco.mjtWarning.mjWARN_BADQVEL,
    mujoco.mjtWarning.mjWARN_BADQACC,
)
#: Steps in which a robot is given time to come to rest.
_PATIENCE = 200_000


class MujocoSection(PlantSection):
    """The robot in MuJoCo: rigid modules, springs and cables as tendons."""

    kind: Literal["mujoco"] = "mujoco"
    step_ms: float = quantity(
        "ms", "internal time step; a whole number of them makes a period", 0.5, gt=0, le=2
    )
    noise_um: float = quantity("um", "standard deviation of every measured coordinate", 0.0, ge=0)

    def misfits(self, period_s: float) -> Iterator[tuple[tuple[str, ...], str]]:
        """Yield that no whole number of steps makes a control period [s]."""
        steps = 1e3 * period_s / self.step_ms
        if abs(steps - round(steps)) > 1e-6 * steps:
            yield ("step_ms",), f"a control period of {period_s:g} s must be a whole number of steps"


class MujocoPlant:
    """One robot in MuJoCo.

    Attributes:
        model: MuJoCo's model.
        data: Its state.
        time: Simulated time [s].
    """

    def __init__(self, settings: MujocoSection, robot: Robot, period: float, seed: int) -> None:
        """Let the robot hang where tcrctl's equilibrium is.

        Args:
            settings: Of the plant.
            robot: Of the controller.
            period: Control period [s].
            seed: Of the noise.
        """
        self.model = mujoco_model(robot, settings.step_ms / 1e3)
        self.data = mujoco.MjData(self.model)
        self.time, self._robot, self._period = 0.0, robot, period
        self._steps = round(1e3 * period / settings.step_ms)
        self._noise, self._random = 1e-6 * settings.noise_um, np.random.default_rng(seed)
        self._drive = np.zeros(robot.n_cables)
        self._local = np.stack([module.nodes for module in rigid_modules(robot)])
        self._ratio = robot.model.cables[:, 2] / robot.model.cables[:, 1]  # damping by stiffness [s]
        mujoco.mj_forward(self.model, self.data)

    def read(self) -> Measurement:
        """Return the ring nodes now, with noise, and the drives."""
        rings = self.nodes()[1:, :3].reshape(-1, 3)
        rings = rings + self._noise * self._random.standard_normal(rings.shape)
        seen = np.ones(len(rings), dtype=bool)
        return Measurement(self.time, rings.astype(np.float32), seen, self._drive.copy())

    def write(self, command: Command) -> Command:
        """Move the drives at ``command.speed`` for one period, as far as their stroke goes.

        Raises:
            RuntimeError: If the simulation became unstable; MuJoCo would begin again at rest, without a word.
        """
        low, high = self._robot.stroke
        after = np.clip(self._drive + self._period * command.speed, low, high)
        speed = (after - self._drive) / self._period
        for i in range(1, self._steps + 1):
            self._advance(
                self._drive + speed * (self._period * i / self._steps), speed, self._robot.model.damping
            )
        self._check()
        self._drive = after
        self.time += self._period
        return Command(speed, after.copy())

    def truth(self) -> Truth:
        """Return end pose, tensions and shape."""
        nodes = self.nodes()
        ring = nodes[self._robot.tip // NODES, :3]
        normal = np.cross(ring[1] - ring[0], ring[2] - ring[1])
        return Truth(ring.mean(axis=0), normal / np.linalg.norm(normal), self.tension(), nodes.ravel())

    def close(self) -> None:
        """Do nothing: there is nothing to leave safe."""

    def nodes(self) -> Array:
        """Return all nodes, base first (n_modules + 1, 4, 3) [m]."""
        mujoco.mj_kinematics(self.model, self.data)
        turn = self.data.xmat[1:].reshape(-1, 3, 3)
        moved = np.einsum("iab,ijb->ija", turn, self._local) + self.data.xpos[1:, None]
        base = self._robot.rest.q.reshape(-1, NODES, 3)[:1]
        return np.concatenate([base, moved])

    def tension(self) -> Array:
        """Return the cables' tensions in the last step (m,) [N]."""
        pulls: Array = -self.data.actuator_force[-self._robot.n_cables :]
        return np.maximum(pulls, 0.0)

    def settle(self, drive: Array, rate: float = 20.0, slowest: float = 1e-6) -> None:
        """Go to drive lengths (m,) [m] slowly and come to rest there, under a damping that no robot has.

        Args:
            drive: Where the drives stop.
            rate: Mass-proportional damping meanwhile [1/s].
            slowest: Speed of the fastest freedom at which it counts as rest [m/s, rad/s].

        Raises:
            RuntimeError: If it does not come to rest, or becomes unstable.
        """
        start, ramp = self._drive.copy(), round(2.0 / self.model.opt.timestep)
        self._drive = np.array(drive, dtype=float)
        for i in range(_PATIENCE):
            part = min(1.0, i / ramp)
            self._advance(start + part * (self._drive - start), np.zeros_like(start), rate)
            if i > ramp and np.abs(self.data.qvel).max() < slowest:
                self._check()
                return
        raise RuntimeError(f"not at rest after {_PATIENCE} steps")

    def _check(self) -> None:
        if any(self.data.warning[kind].number for kind in _UNSTABLE):
            raise RuntimeError(
                f"MuJoCo's simulation is unstable after {self.time:g} s; try a smaller step_ms"
            )

    def _advance(self, drive: Array, speed: Array, rate: float) -> None:
        """Make one internal step with drives (m,) [m] that move [m/s] and mass-proportional damping [1/s]."""
        self.data.ctrl[-len(drive) :] = drive + self._ratio * speed
        mujoco.mj_mulM(self.model, self.data, self.data.qfrc_applied, self.data.qvel)
        self.data.qfrc_applied *= -rate
        mujoco.mj_step(self.model, self.data)
