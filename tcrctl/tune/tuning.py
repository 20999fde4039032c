"""CMA-ES over the ranges of a study: every candidate runs on the same plants, and every run is kept.

Why CMA-ES: a handful of continuous settings, an objective that is the same every time but full of kinks, a whole
generation side by side, and nothing to be chosen but its size. It asks the same again when it is started again, so
an interrupted search finds its runs in the store.
"""

from __future__ import annotations

import importlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Final

from tcrctl.errors import InputError
from tcrctl.executors.engine import Engine
from tcrctl.experiment.provenance import resolved_text
from tcrctl.experiment.spec import load_spec
from tcrctl.study.design import Cell
from tcrctl.study.groups import Run, done
from tcrctl.study.loading import LoadedStudy
from tcrctl.study.plan import PlannedRun, planned
from tcrctl.study.row import Row, unanswered
from tcrctl.study.settings import CASE, CompareSettings, StudySpec
from tcrctl.study.sweep import sweep
from tcrctl.tune.score import Scales, by_case, scales, score
from tcrctl.tune.space import Space, space_of

SHIPPED: Final = "shipped"
TUNED: Final = "tuned"
#: First step of the search, as a part of the ranges.
FIRST_STEP: Final = 0.25

Told = Callable[[PlannedRun, Row], None]


@dataclass(frozen=True, slots=True)
class Search:
    """How long and from where is searched.

    Attributes:
        generations: How many.
        population: Candidates of each.
        seed: Of the search.
        held_out: Seeds of the plants that judge.
    """

    generations: int
    population: int
    seed: int
    held_out: tuple[int, ...]

    def runs(self, plants: int, experiments: int) -> int:
        """Return how many runs a whole search over so many plants and experiments takes."""
        candidates = 1 + self.generations * self.population
        return experiments * (plants * candidates + 2 * len(self.held_out))


@dataclass(frozen=True, slots=True)
class Tuned:
    """What came out.

    Attributes:
        settings: The best ones.
        before: Worst decile with the shipped ones, on the plants that were tuned on; 1 is the usual error.
        after: With the best ones.
        held_out_before: On the plants that judge, with the shipped ones.
        held_out_after: With the best ones.
        best: Best worst decile after every generation.
        unanswered: How many of the runs that are compared have no result; nothing if all have one.
        judging: The study on the plants that judge, shipped against tuned.
        runs: Its runs.
    """

    settings: Mapping[str, Any]
    before: float
    after: float
    held_out_before: float
    held_out_after: float
    best: tuple[float, ...]
    unanswered: str
    judging: StudySpec
    runs: tuple[Run, ...]

    @property
    def better(self) -> bool:
        """Whether the worst decile is lower on plants that were not seen; nobody knows if a run has no result."""
        return not self.unanswered and self.held_out_after < self.held_out_before


@dataclass
class _Trials:
    """Runs sets of settings on plants."""

    study: LoadedStudy
    engine: Engine
    out: Path
    told: Told

    def runs(
        self, settings: Mapping[str, Mapping[str, Any]], seeds: Sequence[int], *, retry: bool = False
    ) -> list[Run]:
        """Run sets of settings by name; ``retry``: again what had no result when it was tried before."""
        study = replace(self.study, spec=self.spec(settings, seeds))
        result = sweep(
            study,
            planned(study),
            engine=self.engine,
            out=self.out,
            logs="none",
            retry=retry,
            told=self.told,
        )
        if result.interruption is not None:
            raise result.interruption
        return done(result.runs, result.rows)

    def spec(self, settings: Mapping[str, Mapping[str, Any]], seeds: Sequence[int]) -> StudySpec:
        """Return the study that these runs are."""
        changes = {
            "cases": {name: dict(values) for name, values in settings.items()},
            "vary": {},
            "design": "grid",
            "samples": None,
            "seeds": tuple(seeds),
            "compare": CompareSettings(factor=CASE, against=SHIPPED) if SHIPPED in settings else None,
        }
        return self.study.spec.model_copy(update=changes)


def tune(study: LoadedStudy, search: Search, *, engine: Engine, out: Path, told: Told) -> Tuned:
    """Search, and judge what was found.

    Args:
        study: Its ranges are searched, its seeds are the plants, its first measure is made smaller.
        search: How.
        engine: Where runs are done.
        out: Where the folder of the study is.
        told: Is told of every run that is done.

    Raises:
        SpecError: If the study cannot be tuned.
        InputError: If the package cma is not installed, or a plant would be its own judge.
        RunInterruptedError: If a signal came; what is done is kept.
    """
    space = space_of(study.spec, study.document)
    measure = study.spec.measures[0]
    seeds = study.spec.seeds or ()
    if {*seeds} & {*search.held_out}:
        raise InputError("the plants that judge must not be those that are tuned on", hint="See --held-out.")
    trials = _Trials(study, engine, out, told)
    shipped = trials.runs({SHIPPED: {}}, seeds, retry=True)
    sizes = scales(shipped, measure)
    before = score(shipped, measure, sizes)
    settings, after, best = _searched(trials, space, search, sizes, before)
    both = {SHIPPED: {}, TUNED: settings}
    judged = trials.runs(both, search.held_out, retry=True)
    marks = {name: score(runs, measure, sizes) for name, runs in by_case(judged).items()}
    judging = trials.spec(both, search.held_out)
    lost = unanswered([row for _, row in (*shipped, *judged)])
    return Tuned(settings, before, after, marks[SHIPPED], marks[TUNED], best, lost, judging, tuple(judged))


def _searched(
    trials: _Trials, space: Space, search: Search, sizes: Scales, before: float
) -> tuple[dict[str, Any], float, tuple[float, ...]]:
    """Return the best settings, their score, and the best score after every generation."""
    measure, seeds = trials.study.spec.measures[0], trials.study.spec.seeds or ()
    strategy = _strategy(_start(trials.study, space), search)
    settings = dict[str, Any]()
    least = before
    best = list[float]()
    for _ in range(search.generations):
        asked = strategy.ask()
        candidates = {f"c{i}": space.settings(x) for i, x in enumerate(asked)}
        found = by_case(trials.runs(candidates, seeds))
        marks = [score(found[name], measure, sizes) for name in candidates]
        strategy.tell(asked, marks)
        first = min(range(len(marks)), key=marks.__getitem__)
        if marks[first] < least:
            settings, least = candidates[f"c{first}"], marks[first]
        best.append(least)
    return settings, least, tuple(best)


def _strategy(start: list[float], search: Search) -> Any:
    try:
        cma: Any = importlib.import_module("cma")
    except ImportError:
        raise InputError(
            "tuning needs the package cma, which is not installed", hint="pip install 'tcrctl[tune]'"
        ) from None
    start = [*start, 0.5] if len(start) == 1 else start  # it wants two dimensions
    options = {"bounds": [0.0, 1.0], "popsize": search.population, "seed": search.seed + 1, "verbose": -9}
    return cma.CMAEvolutionStrategy(start, FIRST_STEP, options)


def _start(study: LoadedStudy, space: Space) -> list[float]:
    """Return where the shipped settings of the first experiment stand; in the middle where it has none."""
    data = study.load(Cell(study.spec.experiments[0], None, {})).spec.model_dump(mode="json")
    found = {}
    for key in space.axes:
        value: Any = data
        for part in key.split("."):
            value = value.get(part) if isinstance(value, dict) else None
        found[key] = value if isinstance(value, int | float) else space.settings([0.5] * len(space.axes))[key]
    return space.point(found)


def experiment_text(study: LoadedStudy, name: str, tuned: Tuned) -> bytes:
    """Return an experiment of the study with the settings that were found, and where they come from.

    Args:
        study: The study.
        name: Experiment, as the study names it.
        tuned: What came out.
    """
    assigned = [f"{key}={value!r}" for key, value in tuned.settings.items()]
    spec = load_spec(study.experiment_path(name), assigned).spec
    source = (
        f"{spec.source}; tuned by the study {study.spec.name} ({', '.join(assigned)}): worst decile of "
        f"{study.spec.measures[0]} on plants not seen {tuned.held_out_before:.3g} -> {tuned.held_out_after:.3g}"
    )
    return resolved_text(spec.model_copy(update={"name": f"{spec.name}_tuned", "source": source}))
