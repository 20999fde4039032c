"""``tcrctl run SPEC``: an experiment, from its file to a log."""

from __future__ import annotations

import json
import shlex
import sys
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from tcrctl.cli.options import LOGS, AsJson, Overrides, Quiet, Spec, to_make, unfolded
from tcrctl.cli.progress import kernels_bar, progress_bar

if TYPE_CHECKING:
    from tcrctl.experiment.feasibility import StaticPath
    from tcrctl.experiment.prepare import Experiment, Notify
    from tcrctl.experiment.spec import LoadedSpec
    from tcrctl.experiment.summary import Summary
    from tcrctl.log.mcap_file import Tap

DryRun = Annotated[bool, typer.Option("--dry-run", help="Check everything, move nothing, write nothing.")]
RealTime = Annotated[bool, typer.Option("--realtime", help="Pace a simulated plant by the clock.")]
Out = Annotated[
    Path,
    typer.Option(
        "--out",
        metavar="DIR",
        parser=to_make,
        envvar=LOGS,
        help="Where the run's folder is made.",
        show_default=True,
    ),
]
Seed = Annotated[
    int | None, typer.Option("--seed", metavar="N", min=0, max=2**63 - 1, help="Seed of everything random.")
]
Force = Annotated[bool, typer.Option("--force", help="Run even if the trajectory seems infeasible.")]
View = Annotated[bool, typer.Option("--view", help="Show the run in the Foxglove app while it runs.")]
ViewHost = Annotated[
    str, typer.Option("--view-host", metavar="ADDRESS", help="Where to serve it; 0.0.0.0 for everybody.")
]
ViewPort = Annotated[
    int, typer.Option("--view-port", metavar="N", min=0, max=65535, help="Port of it; 0 takes a free one.")
]
Yes = Annotated[bool, typer.Option("--yes", help="A rig: the drives may be armed and move; nobody is asked.")]


@dataclass(frozen=True)
class Manner:
    """How an experiment is run."""

    dry_run: DryRun = False
    realtime: RealTime = False
    out: Out = Path("logs")
    seed: Seed = None
    force: Force = False


@dataclass(frozen=True)
class Viewing:
    """Whether and where a run is shown while it runs."""

    view: View = False
    view_host: ViewHost = "127.0.0.1"
    view_port: ViewPort = 8765


@unfolded
def run(
    spec: Spec,
    overrides: Overrides = None,
    manner: Manner = Manner(),
    viewing: Viewing = Viewing(),
    yes: Yes = False,
    quiet: Quiet = False,
    as_json: AsJson = False,
) -> None:
    """Run an experiment and record every control step.

    The result goes to a new folder DIR/TIME_NAME_ID with log.mcap, spec.yaml, spec.resolved.yaml and
    summary.json. Ctrl-C or SIGTERM stop a run safely between two steps; a second Ctrl-C stops it at once.

    DIR/latest leads to the last run. The folder of a run, in place of SPEC, does it again bit for bit.

    Examples:
      tcrctl run letter_t
      tcrctl run logs/latest --set controller.prediction.horizon_s=0.6
      tcrctl run letter_t --set plant.mismatch=off --seed 7
      tcrctl run my_experiment.yaml --dry-run
      tcrctl run letter_t --realtime --view
      tcrctl run letter_t --json --out /data/runs | jq .position_error_mm.max
      tcrctl run letter_t --set plant.kind=rig --set plant.rig=loopback   (see: tcrctl emulate --help)
    """
    from tcrctl.cli.consent import ask, check_can_ask
    from tcrctl.experiment.again import load_experiment
    from tcrctl.experiment.run_folder import link_latest
    from tcrctl.loop.interruption import signals_exit

    say: Notify = _nothing if quiet else _say
    dry_run, shown = manner.dry_run, viewing.view and not manner.dry_run
    with ExitStack() as stack:
        with signals_exit():
            loaded = load_experiment(spec, overrides or ())
            for note in loaded.notes:
                say(f"note: {note}")
            say(_headline(loaded))
            if not dry_run:
                if loaded.rig is not None and not yes:
                    check_can_ask()
                _get_ready(manner.out)
            tap = stack.enter_context(_live_view(loaded, viewing, say) if shown else nullcontext())
            from tcrctl.experiment.prepare import prepare

            with kernels_bar(shown=not quiet) as watch:
                experiment = prepare(loaded, seed=manner.seed, notify=say, watch=watch)
            path = _planned(experiment, manner.force, say)
        if dry_run:
            if as_json or not quiet:
                print(json.dumps(_plan_json(experiment, path)) if as_json else _plan_text(experiment, path))
            return
        if loaded.rig is not None and not yes:
            ask(f"{loaded.robot.name} on rig {loaded.rig.rig.name} will move for {_length(experiment)}.")
        summary = _run(experiment, manner, say, tap, quiet=quiet)
        if summary.log is not None:
            link_latest(summary.log.parent)
    _tell(summary, quiet=quiet, as_json=as_json)
    if summary.exit_code:
        raise typer.Exit(summary.exit_code)


def _tell(summary: Summary, *, quiet: bool, as_json: bool) -> None:
    if summary.reason:
        print(f"{'error' if summary.exit_code != 3 else summary.status}: {summary.reason}", file=sys.stderr)
    if as_json:
        print(json.dumps(summary.as_json()))
    elif not quiet:
        _print_summary(summary)


def _get_ready(out: Path) -> None:
    """Do what a run needs, before the seconds that preparation takes."""
    from tcrctl.experiment.run_folder import check_writable

    check_writable(out)
    import tcrctl.experiment.run  # noqa: F401  (later a signal shall find it loaded)


@contextmanager
def _live_view(loaded: LoadedSpec, viewing: Viewing, say: Notify) -> Iterator[Tap]:
    """Serve the run to the Foxglove app while it is prepared and while it runs."""
    from tcrctl.view.live import LiveView

    with LiveView(loaded.spec.name, host=viewing.view_host, port=viewing.view_port) as live:
        say(f"live view at {live.url}; open {live.app_url}")
        yield live.tap
        if live.failure is not None:
            say(f"warning: the live view ended before the run: {live.failure}")


def _run(experiment: Experiment, manner: Manner, say: Notify, tap: Tap | None, *, quiet: bool) -> Summary:
    from tcrctl.experiment.run import run_experiment

    with progress_bar(experiment.spec.name, shown=not quiet) as progress:
        return run_experiment(
            experiment,
            out=manner.out,
            realtime=manner.realtime,
            confirmed=True,
            notify=say,
            progress=progress,
            tap=tap,
        )


def _length(experiment: Experiment) -> str:
    return f"{experiment.steps * experiment.period:.0f} s"


def _planned(experiment: Experiment, force: bool, say: Notify) -> StaticPath | None:
    from tcrctl.errors import InfeasibleError
    from tcrctl.experiment.prepare import plan

    if force:
        say("warning: --force: feasibility is not checked")
        return None
    try:
        return plan(experiment)
    except InfeasibleError as error:
        error.hint = f"{error.hint} --force runs it all the same.".strip()
        raise


def _nothing(text: str) -> None:
    del text


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)


def _headline(loaded: LoadedSpec) -> str:
    spec = loaded.spec
    parts = f"robot {loaded.robot.name}, plant {spec.plant.kind}, controller {spec.controller.kind}"
    return f"{spec.name}: {parts}, {1.0 / spec.controller.period_s:.4g} Hz"


def _plan_json(experiment: Experiment, path: StaticPath | None) -> dict[str, Any]:
    spec = experiment.spec
    return {
        "status": "success",
        "reason": "",
        "spec": spec.name,
        "robot": experiment.robot.name,
        "plant": spec.plant.kind,
        "controller": spec.controller.kind,
        "steps": experiment.steps,
        "duration_s": experiment.steps * experiment.period,
        "feasibility": None if path is None else path.as_json(),
    }


def _plan_text(experiment: Experiment, path: StaticPath | None) -> str:
    lines = [f"{experiment.steps} steps, {experiment.steps * experiment.period:.2f} s"]
    if path is not None:
        found = path.as_json()
        tension, drive = found["tension_n"], found["drive_mm"]
        lines += [
            f"feasible: drives {drive['min']:.1f} to {drive['max']:.1f} mm, at most "
            f"{found['drive_speed_mm_s']['max']:.1f} mm/s",
            f"          tensions {tension['min']:.1f} to {tension['max']:.1f} N (slow motion, nominal robot)",
        ]
    return "\n".join(lines)


def _print_summary(summary: Summary) -> None:
    from tcrctl.cli.run_table import rows
    from tcrctl.cli.table import print_facts

    print_facts(rows(summary))
    print(f"look at the log: tcrctl info {shlex.quote(str(summary.log))}")
