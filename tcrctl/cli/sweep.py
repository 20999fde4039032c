"""``tcrctl sweep STUDY|SPEC``: many runs, and what they say together."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.options import LOGS, AsJson, Quiet, SideBySide, to_make, unfolded
from tcrctl.cli.progress import runs_bar

if TYPE_CHECKING:
    from tcrctl.study.loading import LoadedStudy
    from tcrctl.study.plan import PlannedRun

Name = Annotated[
    str, typer.Argument(metavar="STUDY|SPEC", help="Study or experiment: shipped, or path of a YAML file.")
]
Sets = Annotated[
    list[str] | None,
    typer.Option("--set", metavar="KEY=A,B,C", help="Values that a setting takes one by one; repeatable."),
]


@dataclass(frozen=True)
class Plan:
    """What is run."""

    seeds: Annotated[str | None, typer.Option("--seeds", metavar="A..B", help="Seeds: 0..9, or 1,4,7.")] = (
        None
    )
    design: Annotated[
        str | None, typer.Option("--design", help="grid, zip, random, sobol or latin; default: grid.")
    ] = None
    samples: Annotated[
        int | None, typer.Option("--samples", metavar="N", min=1, help="Combinations that a design draws.")
    ] = None
    experiment: Annotated[
        list[str] | None,
        typer.Option("--experiment", metavar="NAME", help="Only this one of a study; repeatable."),
    ] = None
    case: Annotated[
        list[str] | None,
        typer.Option("--case", metavar="NAME", help="Only this case of a study; repeatable."),
    ] = None
    measure: Annotated[
        list[str] | None,
        typer.Option("--measure", metavar="NAME", help="What is compared, as in run --json; repeatable."),
    ] = None


@dataclass(frozen=True)
class Manner:
    """How it is run."""

    dry_run: Annotated[bool, typer.Option("--dry-run", help="Print the table of runs; run nothing.")] = False
    timeout: Annotated[
        float | None,
        typer.Option("--timeout", metavar="S", min=0.1, help="A run that takes longer is stopped."),
    ] = None
    logs: Annotated[str, typer.Option("--logs", help="Logs that are kept: all, failed or none.")] = "failed"
    retry: Annotated[bool, typer.Option("--retry", help="Do again what has no result.")] = False
    out: Annotated[
        Path,
        typer.Option(
            "--out", metavar="DIR", parser=to_make, envvar=LOGS, help="Where the study's folder is."
        ),
    ] = Path("logs")


@dataclass(frozen=True)
class Shown:
    """How the result is shown."""

    form: Annotated[str, typer.Option("--format", help="text, csv, latex or markdown.")] = "text"
    parquet: Annotated[
        bool, typer.Option("--parquet", help="Write table.parquet too; needs 'tcrctl\\[parquet]'.")
    ] = False
    figures: Annotated[
        str | None, typer.Option("--figures", metavar="FORMAT", help="Draw figures too: png, pdf or svg.")
    ] = None
    quiet: Quiet = False


@unfolded
def sweep(
    name: Name,
    sets: Sets = None,
    plan: Plan = Plan(),
    manner: Manner = Manner(),
    side: SideBySide = SideBySide(),
    shown: Shown = Shown(),
    as_json: AsJson = False,
) -> None:
    """Run a study: experiments over seeds and settings, side by side, each run once.

    Rows of the runs that are done are kept in DIR/NAME.study; started again, it does what is missing, whatever
    ended it. table.csv there has one row per run and is the same byte for byte whatever the engine. A run that
    diverges, times out or crashes is a row with its reason. Exit code 3: a run has no result, because it crashed,
    timed out or ended in an error; a missed criterion, a limit and a refused path are results.

    Examples:
      tcrctl sweep letter_t --seeds 0..9 --set plant.mismatch.springs_youngs_modulus=0.6,0.8,1
      tcrctl sweep realistic --experiment letter_t --seeds 1..5
      tcrctl sweep realistic --dask local --format markdown
      tcrctl sweep my_study.yaml --dry-run
    """
    from tcrctl.loop.interruption import signals_exit

    with signals_exit():
        _check(manner, shown)
        study = _study(name, sets or [], plan, manner)
        from tcrctl.study.plan import planned

        runs = planned(study)
        if manner.dry_run:
            _print_plan(study, runs, manner.out, side.engine.jobs, as_json=as_json)
            return
        from tcrctl.study.sweep import sweep as run_study
    with runs_bar(study.spec.name, len(runs), quiet=shown.quiet) as told:
        result = run_study(
            study,
            runs,
            engine=side.engine,
            out=manner.out,
            logs=manner.logs,  # type: ignore[arg-type]  # checked above
            retry=manner.retry,
            told=told,
        )
    from tcrctl.cli.sweep_result import Shape, show, write

    found = write(study, result, manner.out, parquet=shown.parquet, figures=shown.figures)
    show(study, result, found, manner.out, Shape(shown.form, as_json, shown.quiet))
    if result.exit_code:
        raise typer.Exit(result.exit_code)


def _check(manner: Manner, shown: Shown) -> None:
    from tcrctl.errors import UnknownNameError
    from tcrctl.study.text import FORMATS

    if manner.logs not in ("all", "failed", "none"):
        raise UnknownNameError("choice of logs", manner.logs, ("all", "failed", "none"))
    if shown.form not in FORMATS:
        raise UnknownNameError("format", shown.form, FORMATS)
    if shown.figures is not None:
        from tcrctl.plots import check_names

        check_names((), shown.figures)


def _study(name: str, sets: list[str], plan: Plan, manner: Manner) -> LoadedStudy:
    from tcrctl.study.command_line import told_study
    from tcrctl.study.loading import narrowed

    changes: dict[str, Any] = {
        "seeds": None if plan.seeds is None else _seeds(plan.seeds),
        "design": plan.design,
        "samples": plan.samples,
        "measures": plan.measure or None,
        "timeout_s": manner.timeout,
    }
    study = told_study(name, sets, changes)
    if plan.experiment or plan.case:
        study = narrowed(study, experiments=plan.experiment or (), cases=plan.case or ())
    return study


def _seeds(text: str) -> str | list[int]:
    if "," not in text and not text.strip().isdecimal():
        return text
    from tcrctl.errors import InputError

    parts = [part.strip() for part in text.split(",")]
    if not all(part.isdecimal() for part in parts):
        raise InputError(f"--seeds must be FIRST..LAST or whole numbers with commas, not {text}")
    return [int(part) for part in parts]


def _print_plan(study: LoadedStudy, runs: list[PlannedRun], out: Path, jobs: int, *, as_json: bool) -> None:
    from tcrctl.study.estimate import estimate
    from tcrctl.study.sweep import folder_of

    plan = estimate(runs, folder_of(study, out), jobs)
    if as_json:
        print(json.dumps({"status": "success", "reason": "", "study": study.spec.name, **plan.as_json()}))
        return
    from tcrctl.cli.table import print_table

    print_table(plan.titles, plan.rows())
    print(plan.sentence)
