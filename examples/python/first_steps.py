"""Two controllers on one path, compared from Python: ``python examples/python/first_steps.py``.

The second controller is the 20 lines below; the experiment names this file.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

import tcrctl
from tcrctl.extend import Array, Estimate, OwnControllerSection, Reference, Robot, quantity


class Keys(OwnControllerSection):
    """Removes the error of the end position by the static map of the rest shape."""

    gain_1_s: float = quantity("1/s", "part of the error that is removed per second", 1.5, gt=0)


class Mine:
    """Follows the motion of the reference, and its error."""

    def __init__(self, settings: Keys, robot: Robot) -> None:
        self.settings = settings
        self.drives_per_metre = np.linalg.pinv(robot.rest_gain[:3], rcond=1e-2)

    def control(self, estimate: Estimate, reference: Reference) -> Array:
        """Return drive speeds (m,) [m/s]."""
        motion = (reference.ahead_position[0] - reference.position) / self.settings.period_s
        error = reference.position - estimate.position
        speeds: Array = self.drives_per_metre @ (motion + self.settings.gain_1_s * error)
        return speeds


MINE = (Keys, Mine)

TASK = {
    "name": "first_steps",
    "robot": "tcr600",
    "trajectory": {
        "kind": "strokes",
        "strokes": [{"arc": {"center": [0, 0], "radius": 20, "from_deg": 0, "to_deg": 360}}],
        "speed_limit_mm_s": 30,
        "travel_speed_limit_mm_s": 30,
    },
    "plant": {"kind": "simulated", "mismatch": {"springs_youngs_modulus": 0.8}, "noise_um": 50},
}
CONTROLLERS = {"ioc": {"kind": "ioc"}, "mine": {"kind": f"{Path(__file__).resolve()}:MINE"}}


def main(out: Path) -> None:
    """Run, load, compare and plot; everything is written to a folder."""
    robot = tcrctl.Robot("tcr600")
    rest = robot.statics()
    print(f"end at rest {1e3 * rest.position[2]:.1f} mm, tensions {rest.tension.round(2)} N")
    print(f"lowest vibrations {robot.modes(count=2).frequency.round(2)} Hz")

    runs = {name: tcrctl.run({**TASK, "controller": keys}, out=out) for name, keys in CONTROLLERS.items()}
    runs = {name: tcrctl.load(run.path) for name, run in runs.items()}  # from their logs, at any later time
    for name, run in runs.items():
        print(f"{name}: {run.summary['status']}, at most {1e3 * run.error.max():.2f} mm, {run.path}")
    plot(runs, out / "first_steps.png")


def plot(runs: dict[str, tcrctl.Run], path: Path) -> None:
    """Draw paths from above and errors over time."""
    import matplotlib

    matplotlib.use("Agg")
    import matplotlib.pyplot as plt

    figure, (above, errors) = plt.subplots(1, 2, figsize=(10, 4), layout="constrained")
    for name, run in runs.items():
        columns = run.columns("t", "truth_position")
        above.plot(*(1e3 * columns["truth_position"][:, :2].T), label=name)
        errors.plot(columns["t"], 1e3 * run.error, label=name)
    above.plot(*(1e3 * run.reference[:, :2].T), "k:", label="wanted")
    above.set(xlabel="x [mm]", ylabel="y [mm]", aspect="equal")
    errors.set(xlabel="t [s]", ylabel="error [mm]")
    above.legend()
    figure.savefig(path, dpi=150)


if __name__ == "__main__":
    main(Path(sys.argv[1] if len(sys.argv) > 1 else "logs"))
