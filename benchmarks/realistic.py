"""Errors on realistic plants, over seeds: every seed draws another plant of the family (docs/reality.md).

    python benchmarks/realistic.py [--seeds 20] [--level moderate] [--processes 2] [--set KEY=VALUE] [NAME ...]

Runs the shipped experiments as their files say, but for the plant. Prints for each the median over the seeds, the
95 % bootstrap interval of the median, the worst, the largest angle between the normals, and how many runs were
stopped; those count as infinitely wrong.
"""

from __future__ import annotations

import argparse
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from simulate import simulate

EXPERIMENTS = (
    "letter_t",
    "fixed_point_rotation",
    "cone_frustum",
    "helix",
    "laser_pipe",
    "box_scan",
    "dynamic_10s",
)
#: Samples of the bootstrap; the same every time.
SAMPLES = 2000


@dataclass(frozen=True)
class Row:
    """Largest position error [mm] and largest angle between the normals [deg] of one run; inf if it was stopped."""

    position: float
    angle: float


def one(name: str, level: str, seed: int, overrides: tuple[str, ...]) -> Row:
    """Run one experiment on the plant of one seed."""
    outcome = simulate(name, (f"plant.realistic={level}", f"seed={seed}", *overrides))
    if outcome.failure:
        return Row(np.inf, np.inf)
    return Row(outcome.part("position_error_mm"), outcome.part("orientation_error_deg"))


def interval(values: NDArray[np.float64]) -> tuple[float, float]:
    """Return the 95 % bootstrap interval of the median."""
    random = np.random.default_rng(0)
    medians = np.median(random.choice(values, (SAMPLES, values.size)), axis=1)
    low, high = np.sort(medians)[[int(0.025 * SAMPLES), int(0.975 * SAMPLES) - 1]]
    return float(low), float(high)


def line(name: str, rows: list[Row]) -> str:
    """Return the table row of one experiment."""
    position = np.array([row.position for row in rows])
    angle = np.array([row.angle for row in rows])
    low, high = interval(position)
    stopped = int(np.isinf(position).sum())
    tilt = "-" if np.isnan(angle).all() else f"{np.median(angle):.1f} / {np.max(angle):.1f}"
    return (
        f"| {name} | {np.median(position):.1f} [{low:.1f}, {high:.1f}] | {np.max(position):.1f} | {tilt} "
        f"| {stopped} of {len(rows)} |"
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=EXPERIMENTS)
    parser.add_argument("--seeds", type=int, default=20)
    parser.add_argument("--first", type=int, default=1, help="first seed")
    parser.add_argument("--level", default="moderate", choices=("off", "mild", "moderate", "severe"))
    parser.add_argument("--processes", type=int, default=2)
    parser.add_argument("--set", action="append", default=[], dest="overrides", metavar="KEY=VALUE")
    given = parser.parse_args()
    changes = " ".join(given.overrides) or "as shipped"
    print(f"{given.level} plants, {given.seeds} seeds from {given.first} on, {changes}")
    print()
    print(
        "| experiment | position error, median [95 %] mm | worst mm | angle, median / worst deg | stopped |"
    )
    print("|---|---|---|---|---|")
    with ProcessPoolExecutor(given.processes) as pool:
        for name in given.names:
            jobs = [
                pool.submit(one, name, given.level, seed, tuple(given.overrides))
                for seed in range(given.first, given.first + given.seeds)
            ]
            print(line(name, [job.result() for job in jobs]), flush=True)


if __name__ == "__main__":
    main()
