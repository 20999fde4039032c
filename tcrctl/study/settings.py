"""The study file: which experiments, what differs, which seeds, what is measured and compared."""

from __future__ import annotations

import difflib
import math
from collections.abc import Iterator
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import Positive, Settings, quantity, refuse
from tcrctl.experiment.summary import TASK, UNITS
from tcrctl.robot.sections import Name
from tcrctl.study.axes import MOST_RUNS, Axis, NormalSettings, RangeSettings, Seeds
from tcrctl.study.key_conflicts import SEED as SEED
from tcrctl.study.key_conflicts import key_conflicts

Design = Literal["grid", "zip", "random", "sobol", "latin"]
SAMPLED = ("random", "sobol", "latin")
EXPERIMENT, CASE = "experiment", "case"
MEASURES = ("position_error_mm.max", "orientation_error_deg.max")


class CompareSettings(Settings):
    """Differences between two levels of a factor, run by run."""

    factor: str = Field(description="what differs: experiment, case, or a key of vary")
    against: str = Field(description="level that all others are compared with, as in the table")
    paired_by: tuple[str, ...] | None = Field(
        default=None, description="what two runs of a pair have in common; everything else if left out"
    )


class CalibrateSettings(Settings):
    """Runs that know what a self-calibration found on the plant of their seed (docs/identify.md)."""

    cases: tuple[str, ...] = Field(default=(), description="cases of which that holds; all if left out")
    excitation: str = Field(
        default="excitation", description="experiment whose log it is found in, shipped or a path; open loop"
    )


class StudySpec(Settings):
    """One study, every default filled in."""

    kind: Literal["study"]
    name: Name
    description: str = Field(default="", description="one line for listings")
    source: str = Field(default="", description="where the study comes from")
    experiments: tuple[str, ...] = Field(
        min_length=1, description="shipped experiments, or paths of files relative to this one"
    )
    paths: Literal["as_written", "random"] = Field(
        default="as_written", description="random: every seed draws a pose path that the robot can follow"
    )
    set: dict[str, Any] = Field(default={}, description="what all runs have: dotted key -> value")
    cases: dict[str, dict[str, Any]] = Field(
        default={}, description="settings that differ together, by name: name -> dotted key -> value"
    )
    vary: dict[str, Axis] = Field(default={}, description="dotted key -> values, range or distribution")
    design: Design = Field(default="grid", description="how the values of vary are combined")
    samples: int | None = Field(
        default=None, ge=1, le=MOST_RUNS, description="how many combinations; designs random, sobol, latin"
    )
    design_seed: int = Field(default=0, ge=0, lt=2**32, description="seed of random, sobol and latin")
    seeds: Seeds | None = Field(
        default=None, description="seeds of every combination, a list or FIRST..LAST; each experiment's own"
    )
    calibrate: CalibrateSettings | None = Field(
        default=None, description="self-calibration before the runs, once for every plant"
    )
    measures: Annotated[tuple[str, ...], Field(min_length=1)] = Field(
        default=MEASURES, description="what is compared, as in run --json"
    )
    group_by: tuple[str, ...] | None = Field(
        default=None, description="factors that make a group; all but the seed if left out"
    )
    compare: CompareSettings | None = Field(default=None, description="paired differences")
    timeout_s: Positive | None = quantity("s", "a run that takes longer is stopped", None)

    @property
    def factors(self) -> tuple[str, ...]:
        """What can differ between two runs, but the seed."""
        cases = (CASE,) if self.cases else ()
        return (EXPERIMENT, *cases, *self.vary)

    @property
    def combinations(self) -> int:
        """How many combinations of the values of ``vary`` there are."""
        if self.design in SAMPLED:
            return self.samples or 0
        lengths = [_length(axis) for axis in self.vary.values()]
        return math.prod(lengths) if self.design == "grid" else max(lengths, default=1)

    @property
    def cells(self) -> int:
        """How many runs differ in more than the seed."""
        return len(self.experiments) * max(1, len(self.cases)) * self.combinations

    @property
    def runs(self) -> int:
        """How many runs there are."""
        return self.cells * (1 if self.seeds is None else len(self.seeds))

    @model_validator(mode="after")
    def _agrees(self) -> StudySpec:
        refuse([*key_conflicts(self), *_design_conflicts(self), *_unknown_names(self)])
        if self.runs > MOST_RUNS:
            where = "vary" if self.vary else "seeds"
            refuse([((where,), f"the study makes {self.runs} runs; at most {MOST_RUNS} are allowed")])
        return self


def _length(axis: Any) -> int:
    if isinstance(axis, RangeSettings):
        return axis.steps or 0
    return 0 if isinstance(axis, NormalSettings) else len(axis)


def _design_conflicts(spec: StudySpec) -> Iterator[Finding]:
    if spec.design in SAMPLED:
        if spec.samples is None:
            yield ("samples",), f"required with design: {spec.design}"
        if not spec.vary:
            yield ("vary",), f"required with design: {spec.design}"
        return
    if spec.samples is not None:
        yield ("samples",), f"has no meaning with design: {spec.design}"
    for key, axis in spec.vary.items():
        if isinstance(axis, NormalSettings):
            yield ("vary", key), f"a distribution needs design: {', '.join(SAMPLED)}, not {spec.design}"
        elif isinstance(axis, RangeSettings) and axis.steps is None:
            yield ("vary", key, "steps"), f"required with design: {spec.design}"
    lengths = {key: _length(axis) for key, axis in spec.vary.items()}
    if spec.design == "zip" and len(set(lengths.values())) > 1:
        first, *rest = lengths
        odd = next(key for key in rest if lengths[key] != lengths[first])
        yield ("vary", odd), f"has {lengths[odd]} values, and {first} has {lengths[first]}; zip needs as many"


def _unknown_names(spec: StudySpec) -> Iterator[Finding]:
    for i, name in enumerate(spec.measures):
        if name not in UNITS and not name.startswith(TASK):
            close = difflib.get_close_matches(name, UNITS, n=1)
            said = f"; did you mean {close[0]}?" if close else f"; known: {', '.join(UNITS)}"
            yield ("measures", i), f"a run has no result {name}{said}"
    for i, name in enumerate(spec.calibrate.cases if spec.calibrate else ()):
        if name not in spec.cases:
            yield ("calibrate", "cases", i), f"is no case; there are {', '.join(spec.cases) or 'none'}"
    for i, name in enumerate(spec.group_by or ()):
        if name not in spec.factors:
            yield ("group_by", i), f"is no factor; there are {', '.join(spec.factors)}"
    if spec.compare is not None:
        yield from _compare_conflicts(spec, spec.compare)


def _compare_conflicts(spec: StudySpec, compare: CompareSettings) -> Iterator[Finding]:
    if compare.factor not in spec.factors:
        yield ("compare", "factor"), f"is no factor; there are {', '.join(spec.factors)}"
    elif compare.factor == CASE and compare.against not in spec.cases:
        yield ("compare", "against"), f"is no case; there are {', '.join(spec.cases)}"
    for i, name in enumerate(compare.paired_by or ()):
        if name == compare.factor or name not in (*spec.factors, SEED):
            others = [f for f in (*spec.factors, SEED) if f != compare.factor]
            yield ("compare", "paired_by", i), f"must be one of {', '.join(others)}"
