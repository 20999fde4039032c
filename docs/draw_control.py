"""Run and draw the figures of control.md: python docs/draw_control.py (in a minute or two).

Each figure shows the same experiment with and without a part of the controller.
"""

from __future__ import annotations

import os
from pathlib import Path
from tempfile import TemporaryDirectory

os.environ.setdefault("NUMBA_OPT", "1")  # as the command line does

from tcrctl.analysis.history import read_histories
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.plots import draw, save

STIFF = tuple(
    f"plant.mismatch.{name}={factor}"
    for name, factor in (("springs_youngs_modulus", 1.4), ("density", 0.7), ("cables_youngs_modulus", 1.3))
)
#: Picture -> experiment, changes common to all its runs, figure, end of the time axis [s], changes of each run.
FIGURES = {
    "control_stiff.png": (
        "cone_frustum",
        STIFF,
        "error",
        20.0,
        {
            "as shipped": (),
            "offset off": ("controller.prediction.offset=off",),
            "W / 16": ("controller.weights.speed_change=220.0",),
        },
    ),
    "control_feedforward.png": (
        "dynamic_10s",
        (),
        "error",
        10.0,
        {"as shipped": (), "no feedforward": ("controller.prediction.feedforward=false",)},
    ),
}


def main() -> None:
    """Make every picture."""
    for picture, (name, common, figure, end, runs) in FIGURES.items():
        with TemporaryDirectory() as folder:
            logs = [
                run_experiment(prepare(load_spec(name, (*common, *changes))), out=Path(folder)).log
                for changes in runs.values()
            ]
            histories = read_histories(logs, labels=list(runs), end=end)
            save(draw(figure, histories), Path(__file__).with_name(picture))


if __name__ == "__main__":
    main()
