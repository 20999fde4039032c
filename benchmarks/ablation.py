"""What each part of the controller is worth: one setting changed at a time, on the mismatched, noisy, late plant.

    python benchmarks/ablation.py [--jobs N]

The table of docs/control.md. Stiff plant: springs +40 %, density -30 %, cables +30 %, whose slow modes are half as
fast again as the model's.
"""

from __future__ import annotations

import argparse
import os
from concurrent.futures import ProcessPoolExecutor

from rich.console import Console
from rich.table import Table
from simulate import Outcome, simulate

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


def cell(outcome: Outcome) -> str:
    """Return the largest and rms error, largest angle; or when it was stopped."""
    if outcome.failure:
        return f"diverges after {outcome.measures.duration_s:.0f} s"
    text = f"{outcome.part('position_error_mm'):.2f} / {outcome.part('position_error_mm', 'rms'):.2f} mm"
    angle = outcome.part("orientation_error_deg")
    return text if angle != angle else f"{text}, {angle:.2f}°"


def main() -> None:
    """Print the table, as Markdown where the output is no terminal."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--jobs", type=int, default=os.cpu_count(), help="processes")
    jobs = parser.parse_args().jobs
    with ProcessPoolExecutor(jobs) as pool:
        runs = {
            name: [
                pool.submit(simulate, spec, (*plant, *(f"controller.{change}" for change in changes)))
                for spec, plant in PLANTS.values()
            ]
            for name, changes in CHANGES.items()
        }
        rows = [(name, *(cell(run.result()) for run in row)) for name, row in runs.items()]
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
