"""``tcrctl identify SPEC``: from measured nodes to a robot file that predicts better."""

from __future__ import annotations

import json
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.console import console, has_styles
from tcrctl.cli.options import LOGS, AsJson, Overrides, Quiet, SideBySide, to_make, unfolded
from tcrctl.cli.progress import SpokenProgress

if TYPE_CHECKING:
    from tcrctl.identify.identification import Progress
    from tcrctl.identify.loading import LoadedIdentification
    from tcrctl.identify.result import Result

Inputs = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="[SPEC]", help="Shipped identification, or path of a YAML file; after --from: more data."
    ),
]
From = Annotated[
    list[str] | None,
    typer.Option(
        "--from", metavar="DATA...", help="Data instead of a SPEC: logs (.mcap), static sets (.yaml, .csv)."
    ),
]
RobotName = Annotated[
    str | None,
    typer.Option("--robot", metavar="ROBOT", help="With --from: robot to start from, name or path."),
]
Params = Annotated[
    str | None,
    typer.Option(
        "--params", metavar="PATH,PATH", help="With --from: what to find, e.g. springs.youngs_modulus_mpa."
    ),
]
MethodName = Annotated[
    str | None, typer.Option("--method", help="pso, least-squares, or both: pso+least-squares (default).")
]
StrungBy = Annotated[
    str | None, typer.Option("--strung-by", help="What stays when parameters change: tension or length.")
]
Seed = Annotated[
    int | None, typer.Option("--seed", metavar="N", min=0, max=2**32 - 1, help="Seed of the swarm.")
]
Out = Annotated[
    Path, typer.Option("--out", metavar="DIR", parser=to_make, envvar=LOGS, help="Where its folder is made.")
]


Calibrate = Annotated[
    str | None,
    typer.Option(
        "--calibrate", metavar="LOG", help="Log of an excitation: find its robot, cameras and drives."
    ),
]
Design = Annotated[
    str | None,
    typer.Option("--design", metavar="SPEC", help="An excitation: choose the poses that tell most."),
]


@dataclass(frozen=True)
class Told:
    """An identification that is told on the command line, without a file."""

    data: From = None
    robot: RobotName = None
    params: Params = None


@dataclass(frozen=True)
class Instead:
    """What is done instead of finding parameters."""

    calibrate: Calibrate = None
    design: Design = None


@dataclass(frozen=True)
class Changed:
    """Shorts for ``--set``."""

    method: MethodName = None
    strung_by: StrungBy = None
    seed: Seed = None


@dataclass(frozen=True)
class Shown:
    """What is printed."""

    quiet: Quiet = False
    as_json: AsJson = False


@unfolded
def identify(
    inputs: Inputs = None,
    told: Told = Told(),
    instead: Instead = Instead(),
    changed: Changed = Changed(),
    side: SideBySide = SideBySide(),
    overrides: Overrides = None,
    out: Out = Path("logs"),
    shown: Shown = Shown(),
) -> None:
    r"""Find parameters of a robot from measured positions, and say how certain they are.

    The result goes to a new folder DIR/TIME_NAME_ID with robot.yaml, report.json, figure.png and spec.yaml.
    Ctrl-C keeps the best answer so far.

    Examples:
      tcrctl identify identify_table2
      tcrctl identify my_data.yaml --method least-squares --json
      tcrctl identify --from run1.mcap run2.mcap --robot tcr700 \
                      --params springs.youngs_modulus_mpa,cables.youngs_modulus_mpa
      tcrctl run helix --set robot=logs/TIME_NAME_ID/robot.yaml
      tcrctl run excitation && tcrctl identify --calibrate logs/TIME_excitation_ID
      tcrctl identify --design excitation
    """
    from tcrctl.loop.interruption import signals_exit

    say = (lambda text: None) if shown.quiet else _say
    changes = [*(overrides or ()), *_assignments(changed)]
    with signals_exit():
        from tcrctl.experiment.run_folder import check_writable

        check_writable(out)
        if instead.calibrate or instead.design:
            raise typer.Exit(_instead(inputs or [], told, instead, changes, out, say, shown))
        loaded = _loaded(inputs or [], told, changes)
        say(_headline(loaded))
        from tcrctl.identify.identification import identify as find
    with _progress_line(shown=not shown.quiet) as progress:
        result = find(loaded, engine=side.engine, notify=say, progress=progress)
    files = _write(loaded, result, out)
    for warning in () if shown.quiet else result.warnings:
        print(f"warning: {warning}", file=sys.stderr)
    if result.reason:
        print(f"{result.status}: {result.reason}; this is the best answer until then", file=sys.stderr)
    if shown.as_json:
        print(json.dumps(result.as_json(*files)))
    elif not shown.quiet:
        from tcrctl.cli.identify_table import print_result

        print_result(result)
        print(f"new robot: tcrctl run SPEC --set robot={files[0]}")
    if result.exit_code:
        raise typer.Exit(result.exit_code)


def _instead(
    inputs: list[str],
    told: Told,
    instead: Instead,
    changes: list[str],
    out: Path,
    say: Callable[[str], None],
    shown: Shown,
) -> int:
    from tcrctl.cli.calibrate import calibrate_log, design_poses
    from tcrctl.errors import InputError

    if inputs or told != Told() or (instead.calibrate and instead.design):
        raise InputError("--calibrate and --design stand alone", hint="See: tcrctl identify --help")
    if instead.calibrate:
        return calibrate_log(instead.calibrate, changes, out, say, shown.as_json, quiet=shown.quiet)
    return design_poses(instead.design or "", changes, out, say, shown.as_json, quiet=shown.quiet)


def _assignments(changed: Changed) -> list[str]:
    return [f"{key}={value}" for key, value in vars(changed).items() if value is not None]


def _loaded(inputs: list[str], told: Told, changes: list[str]) -> LoadedIdentification:
    from tcrctl.errors import InputError
    from tcrctl.identify.loading import load_identification

    robot, params = told.robot, told.params
    if not told.data:
        if robot or params:
            raise InputError("--robot and --params belong to --from; a SPEC says both itself")
        if len(inputs) != 1:
            raise InputError(
                f"give one SPEC, not {len(inputs)}, or data by --from", hint="See: tcrctl identify --help"
            )
        return load_identification(inputs[0], changes)
    if not robot or not params:
        raise InputError("--from needs --robot and --params", hint="See: tcrctl identify --help")
    return _from_data([*told.data, *inputs], robot, params, changes)


def _from_data(data: list[str], robot: str, params: str, changes: list[str]) -> LoadedIdentification:
    """Build the identification that was told on the command line."""
    from tcrctl.config import strict_yaml
    from tcrctl.config.keys import Keys
    from tcrctl.identify.loading import from_document

    told: dict[str, Any] = {
        "kind": "identification",
        "name": "identification",
        "robot": robot,
        "parameters": {path.strip(): {} for path in params.split(",") if path.strip()},
        "data": [{"file": str(Path(file).absolute())} for file in data],
    }
    places: dict[Keys, str] = {
        ("robot",): "--robot",
        ("parameters",): "--params",
        ("data",): "--from",
        **{("data", i): f"--from {file}" for i, file in enumerate(data)},
    }
    document = strict_yaml.placed("command line", told, places)
    return from_document(document, strict_yaml.dumps(told).encode(), Path(), changes)


def _write(loaded: LoadedIdentification, result: Result, out: Path) -> tuple[Path, Path]:
    from tcrctl.identify.report import write_results

    return write_results(loaded, result, out)


def _headline(loaded: LoadedIdentification) -> str:
    from tcrctl.experiment.headline import count

    spec = loaded.spec
    amount = [count(len(loaded.configurations), "configuration")] if loaded.configurations else []
    amount += [count(len(loaded.logs), "log")] if loaded.logs else []
    return (
        f"{spec.name}: robot {loaded.robot.name}, {count(len(loaded.parameters), 'parameter')}, "
        f"{' and '.join(amount)}, method {spec.method}"
    )


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


@contextmanager
def _progress_line(*, shown: bool) -> Iterator[Progress]:
    """Show what is being done, evaluations per second and the best error, on stderr if that is a terminal.

    The time that is left is that of the method under way, and the longest: it ends when nothing gets better.
    """
    if not (shown and sys.stderr.isatty()):
        yield lambda what, evaluations, best_mm, most: None
        return
    if not has_styles(sys.stderr):
        spoken = SpokenProgress()
        yield lambda what, evaluations, best_mm, most: spoken.say(
            f"{what}, best {best_mm:.4g} mm, evaluations", evaluations, most
        )
        return
    import time

    from rich import progress

    begin = time.perf_counter()
    columns = (
        progress.SpinnerColumn(),
        progress.TextColumn("{task.description}"),
        progress.BarColumn(bar_width=12),
        progress.TimeElapsedColumn(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=console(stderr=True), transient=True) as bar:
        task = bar.add_task("reading data", total=None)

        def show(what: str, evaluations: int, best_mm: float, most: int | None) -> None:
            rate = evaluations / max(time.perf_counter() - begin, 1e-9)
            text = f"{what}: {evaluations} evaluations, {rate:.1f}/s, best {best_mm:.4g} mm"
            bar.update(task, description=text, completed=evaluations, total=most)

        yield show
