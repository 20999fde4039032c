"""What each part of the controller is worth: one setting changed at a time, on the mismatched, noisy, late plant.

    python benchmarks/ablation.py [--jobs N]

The table of docs/control.md. Stiff plant: springs +40 %, density -30 %, cables +30 %, whose slow modes are half as
fast again as the model's.
"""

from __future__ import annotations

import argparse
import os

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ.setdefault("NUMBA_OPT", "1")

from rich.console import Console
from rich.table import Table

from tcrctl.errors import TcrctlError
from tcrctl.executors.engine import Engine, physical_cores
from tcrctl.executors.outcomes import Crash, outcomes
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.spec import load_spec
from tcrctl.experiment.summary import Summary
from tcrctl.experiment.unrecorded import run_unrecorded

STIFF = tuple(
    f"plant.mismatch.{name}={factor}"
    for name, factor in (("springs_youngs_modulus", 1.4), ("density", 0.7), ("cables_youngs_modulus", 1.3))
)
PLANTS: dict[str, tuple[str, tuple[str, ...]]] = {
    "letter_t": ("letter_t", ()),
    "cone_frustum": ("cone_frustum", ()),
    "cone_frustum, stiff plant": ("cone_frustum", STIFF),
    "dynamic_10s": ("dynamic_10s", ()),
}
LITERAL = ("prediction=literal", "tension=off", "integral=off")
CHANGES: dict[str, tuple[str, ...]] = {
    "as shipped": (),
    "`integral=off`": ("integral=off",),
    "`prediction.offset=off`": ("prediction.offset=off",),
    "both off": ("integral=off", "prediction.offset=off"),
    "`tension=off`": ("tension=off",),
    "`prediction.offset.filter_s=0.1`": ("prediction.offset.filter_s=0.1",),
    "`prediction.offset.filter_s=1`": ("prediction.offset.filter_s=1.0",),
    "`weights.speed_change=220`": ("weights.speed_change=220.0",),
    "`weights.speed_change=3.5e3`": ("weights.speed_change=3500.0",),
    "`weights.speed_change=3.5e4`": ("weights.speed_change=35000.0",),
    "`prediction.horizon_s=0.4`": ("prediction.horizon_s=0.4",),
    "`prediction.horizon_s=1.2`": ("prediction.horizon_s=1.2",),
    "`prediction.blocks=1`": ("prediction.blocks=1",),
    "`model=static`": ("model=static",),
    "`prediction={kind: one_step, horizon_s: 0.4}`": ("prediction={kind: one_step, horizon_s: 0.4}",),
    "`prediction=literal`, as printed": LITERAL,
}


def simulate(order: tuple[str, str]) -> Summary | str:
    """Run one change on one plant; why not, if it cannot be run."""
    change, plant = order
    spec, settings = PLANTS[plant]
    try:
        loaded = load_spec(spec, (*settings, *(f"controller.{text}" for text in CHANGES[change])))
        return run_unrecorded(prepare(loaded))
    except TcrctlError as error:
        return str(error)


def cell(outcome: Summary | str | Crash) -> str:
    """Return the largest and rms error, largest angle; or when it was stopped."""
    if not isinstance(outcome, Summary):
        return str(outcome)
    found = outcome.measures
    if outcome.status not in ("success", "failed") or found.position_error_mm is None:
        return f"diverges after {found.duration_s:.0f} s"
    text = f"{found.position_error_mm['max']:.2f} / {found.position_error_mm['rms']:.2f} mm"
    angle = found.orientation_error_deg
    return text if angle is None else f"{text}, {angle['max']:.2f}°"


def main() -> None:
    """Print the table, as Markdown where the output is no terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=physical_cores(), help="processes")
    engine = Engine(parser.parse_args().jobs)
    orders = [(change, plant) for change in CHANGES for plant in PLANTS]
    found = dict(outcomes(engine, simulate, orders))
    rows = [(change, *(cell(found[change, plant]) for plant in PLANTS)) for change in CHANGES]
    console, header = Console(), ("setting", *PLANTS)
    if console.is_terminal:
        table = Table(*header)
        for row in rows:
            table.add_row(*row)
        console.print(table)
        return
    for row in (header, ("---",) * len(header), *rows):
        print(f"| {' | '.join(row)} |")


if __name__ == "__main__":
    main()
