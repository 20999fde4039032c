"""Figures of a study: boxes with all runs, empirical distributions, a map over two factors."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Final

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tcrctl.experiment.summary import unit_of
from tcrctl.plots import save
from tcrctl.plots.style import BLACK, BLUE, VERMILION, legend, line, new_figure, printed
from tcrctl.signals import Array
from tcrctl.study.groups import Run
from tcrctl.study.settings import StudySpec
from tcrctl.study.values import value_of

#: Groups that a figure can tell apart.
MOST_GROUPS: Final = 28

Samples = Mapping[str, Sequence[float]]


def draw_study(spec: StudySpec, runs: Sequence[Run]) -> Iterator[tuple[str, Figure]]:
    """Yield name and figure of everything that can be drawn of a study.

    Args:
        spec: The study.
        runs: Runs that are done.
    """
    for measure in spec.measures:
        samples = _samples(spec, runs, measure)
        if not any(math.isfinite(value) for values in samples.values() for value in values):
            continue
        name, pair = measure.replace(".", "_"), _two_factors(spec, runs)
        with printed():
            yield f"{name}_box", boxes(samples, measure)
            if len(samples) <= MOST_GROUPS:
                yield f"{name}_distribution", distributions(samples, measure)
            if pair is not None:
                yield f"{name}_map", heat_map(runs, measure, *pair)


def save_study_figures(spec: StudySpec, runs: Sequence[Run], folder: Path, file_format: str) -> list[Path]:
    """Draw all figures of a study into a folder; return the files.

    Raises:
        DeviceError: If a file cannot be written.
    """
    paths = []
    for name, figure in draw_study(spec, runs):
        path = folder / f"{name}.{file_format}"
        save(figure, path)
        paths.append(path)
    return paths


def _samples(spec: StudySpec, runs: Sequence[Run], measure: str) -> Samples:
    factors = spec.factors if spec.group_by is None else spec.group_by
    found: dict[str, list[float]] = {}
    for run, row in runs:
        value = value_of(row, measure)
        if value is not None:
            found.setdefault(", ".join(run.levels.get(f, "") for f in factors), []).append(value)
    return found


def _title(measure: str) -> str:
    unit = unit_of(measure)
    return f"{measure} [{unit}]" if unit else measure


def boxes(samples: Samples, measure: str) -> Figure:
    """Draw a box per group with every run as a mark; runs that were stopped are counted at the right."""
    figure = new_figure(0.9 + 0.32 * len(samples))
    axes = figure.subplots()
    finite = [[v for v in values if math.isfinite(v)] for values in samples.values()]
    places = range(len(samples), 0, -1)
    drawn = [(p, v) for p, v in zip(places, finite, strict=True) if v]
    axes.boxplot(
        [v for _, v in drawn], positions=[p for p, _ in drawn], orientation="horizontal", widths=0.6,
        showfliers=False, medianprops={"color": BLACK}, manage_ticks=False,
    )  # fmt: skip
    for place, values, all_values in zip(places, finite, samples.values(), strict=True):
        shift = 0.12 * (np.arange(len(values)) % 3 - 1)
        axes.plot(values, place + shift, "o", color=BLUE, ms=3, alpha=0.7)
        if len(values) < len(all_values):
            text = f"{len(all_values) - len(values)} stopped"
            axes.annotate(text, (1.0, place), xycoords=("axes fraction", "data"), fontsize=7, color=VERMILION)
    axes.set_yticks(list(places), list(samples))
    axes.set_xlabel(_title(measure))
    return figure


def distributions(samples: Samples, measure: str) -> Figure:
    """Draw the share of runs that are no larger than a value, per group; below 1 at its end: stopped runs."""
    figure = new_figure(3.2)
    axes: Axes = figure.subplots()
    for i, (name, values) in enumerate(samples.items()):
        known = np.sort([v for v in values if math.isfinite(v)])
        share = np.arange(1, known.size + 1) / len(values)
        axes.step(known, share, where="post", label=name, **line(i))
    axes.set_ylim(0.0, 1.02)
    axes.set_xlabel(_title(measure))
    axes.set_ylabel("share of runs")
    legend(figure, [axes])
    return figure


def _two_factors(spec: StudySpec, runs: Sequence[Run]) -> tuple[str, str] | None:
    """Return the last two factors that have several levels, few enough to be drawn."""
    levels = {f: {run.levels.get(f) for run, _ in runs} for f in spec.factors}
    several = [f for f, found in levels.items() if 2 <= len(found) <= MOST_GROUPS]
    return (several[-2], several[-1]) if len(several) >= 2 else None


def heat_map(runs: Sequence[Run], measure: str, down: str, along: str) -> Figure:
    """Draw the median of a measure over two factors; crossed out where half of the runs or more were stopped."""
    rows, columns = (list(dict.fromkeys(run.levels[f] for run, _ in runs)) for f in (down, along))
    medians = _medians(runs, measure, (down, rows), (along, columns))
    figure = new_figure(1.2 + 0.35 * len(rows))
    axes = figure.subplots()
    shown = np.ma.masked_invalid(medians)
    image: Any = axes.imshow(shown, aspect="auto", cmap="cividis")
    for i, j in np.argwhere(~np.isnan(medians)):
        value = medians[i, j]
        text = f"{value:.3g}" if np.isfinite(value) else "×"
        dark = np.isfinite(value) and image.norm(value) < 0.5
        axes.text(j, i, text, ha="center", va="center", fontsize=7, color="white" if dark else "black")
    axes.grid(visible=False)
    axes.set_xticks(range(len(columns)), columns)
    axes.set_yticks(range(len(rows)), rows)
    axes.set_xlabel(along)
    axes.set_ylabel(down)
    figure.colorbar(image, label=f"median of {_title(measure)}")
    return figure


def _medians(
    runs: Sequence[Run], measure: str, down: tuple[str, list[str]], along: tuple[str, list[str]]
) -> Array:
    """Return the median per cell (rows, columns); NaN where there is no run, infinite where half were stopped."""
    cells: dict[tuple[int, int], list[float]] = {}
    for run, row in runs:
        value = value_of(row, measure)
        if value is not None:
            place = down[1].index(run.levels[down[0]]), along[1].index(run.levels[along[0]])
            cells.setdefault(place, []).append(value)
    medians = np.full((len(down[1]), len(along[1])), np.nan)
    for place, values in cells.items():
        medians[place] = np.median(values)
    return medians
