"""The command ``tcrctl``: which verbs there are, and how every error becomes one line and one exit code."""

from __future__ import annotations

import errno
import json
import os
import shlex
import sys
import traceback
from collections.abc import Callable, MutableMapping, Sequence
from pathlib import Path
from typing import Annotated

import typer

from tcrctl import __version__
from tcrctl.caches.flags import set_flags
from tcrctl.cli.accuracy import accuracy
from tcrctl.cli.commit import commit
from tcrctl.cli.diff import diff
from tcrctl.cli.emulate import emulate
from tcrctl.cli.export import export
from tcrctl.cli.identify import identify
from tcrctl.cli.info import info
from tcrctl.cli.kinds import kinds
from tcrctl.cli.list import list_shipped
from tcrctl.cli.new import new
from tcrctl.cli.paper import paper
from tcrctl.cli.play import play
from tcrctl.cli.plot import plot
from tcrctl.cli.recover import recover
from tcrctl.cli.replay import replay
from tcrctl.cli.report import report
from tcrctl.cli.rig.verbs import RIG_VERBS
from tcrctl.cli.run import run
from tcrctl.cli.runs import runs
from tcrctl.cli.schema import schema
from tcrctl.cli.show import show
from tcrctl.cli.stability import stability
from tcrctl.cli.streams import Output, robust_streams
from tcrctl.cli.sweep import sweep
from tcrctl.cli.tune import tune
from tcrctl.cli.validate import validate
from tcrctl.cli.workspace import workspace
from tcrctl.errors import DeviceError, InputError, SpecError, TcrctlError

VERBS: dict[str, Callable[..., None]] = {
    "run": run,
    "sweep": sweep,
    "tune": tune,
    "runs": runs,
    "workspace": workspace,
    "identify": identify,
    "list": list_shipped,
    "kinds": kinds,
    "show": show,
    "validate": validate,
    "new": new,
    "schema": schema,
    "stability": stability,
    "info": info,
    "recover": recover,
    "export": export,
    "emulate": emulate,
    "paper": paper,
    "replay": replay,
    "diff": diff,
    "accuracy": accuracy,
    "play": play,
    "plot": plot,
    "report": report,
}

#: Verbs of which nothing is left if their output cannot be written.
ONLY_SAY = ("list", "kinds", "show", "schema", "info", "runs", "diff", "accuracy")


#: So many digits of a commit tell it apart.
_COMMIT = 12


def _print_version(wanted: bool) -> None:
    if wanted:
        found = commit(Path(__file__).parents[2])
        print(f"tcrctl {__version__}" + (f" (commit {found[:_COMMIT]})" if found else ""))
        raise typer.Exit()


def _options(
    version: Annotated[
        bool,
        typer.Option(
            "--version",
            help="Print version and commit.",
            callback=_print_version,
            is_eager=True,
        ),
    ] = False,
) -> None:
    """Experiments with cable-driven tensegrity continuum robots, simulated or on the bench.

    Exit codes: 0 ok, 1 internal error, 2 wrong usage or input, 3 a criterion failed, 4 stopped by a safety
    limit or divergence, 5 device, connection or file system, 130 Ctrl-C, 143 SIGTERM.
    """


def build_app() -> typer.Typer:
    """Return the application with all verbs."""
    app = typer.Typer(no_args_is_help=True, pretty_exceptions_enable=False, rich_markup_mode="rich")
    app.callback()(_options)
    for name, verb in VERBS.items():
        app.command(name)(verb)
    rig = typer.Typer(no_args_is_help=True, rich_markup_mode="rich")
    for name, verb in RIG_VERBS.items():
        rig.command(name)(verb)
    app.add_typer(
        rig, name="rig", help="Work on a bench: check, status, calibrate, zero, excite, jog, reset."
    )
    return app


def main(arguments: Sequence[str] | None = None) -> int:
    """Run the command line.

    Args:
        arguments: Arguments after the program name; those of the process if left out.

    Returns:
        The exit code.
    """
    _prepare_process(os.environ)
    given = list(sys.argv[1:] if arguments is None else arguments)
    with robust_streams() as output:
        code = _run_verb(given)
        return _with_delivery(code, given, output)


def _run_verb(given: list[str]) -> int:
    as_json = "--json" in given
    try:
        _refuse_empty(given)
        build_app()(args=given, prog_name="tcrctl")
    except SystemExit as end:  # how typer ends, always
        if end.code == 2 and as_json:
            said = getattr(end.__context__, "format_message", None)
            if said is not None:  # else a verb has ended so, and has printed its object
                _print_json(str(said()))
        return end.code if isinstance(end.code, int) else int(end.code is not None)
    except KeyboardInterrupt:
        return 130
    except Exception as error:
        return _report(_known(error), error, as_json)
    return 0


def _refuse_empty(given: list[str]) -> None:
    """Raise an InputError if an argument is empty: as a path it would be the working directory."""
    if "" in given:
        hint = "A variable of the shell that is not set?"
        raise InputError(f"argument {given.index('') + 1} is empty: {shlex.join(given)}", hint=hint)


def _with_delivery(code: int, given: list[str], output: Output) -> int:
    """Return the exit code, which is another one if a verb did nothing but say something that got lost.

    A reader that has gone had enough.
    """
    output.flush()
    if code or output.failure is None or isinstance(output.failure, BrokenPipeError):
        return code
    text = f"error: the output could not be written: {output.failure.strerror}"
    print(text, file=sys.stderr)
    return DeviceError.exit_code if given[:1] and given[0] in ONLY_SAY else code


def _prepare_process(environment: MutableMapping[str, str]) -> None:
    """Set what libraries read when they are loaded."""
    set_flags(environment)
    for size in ("COLUMNS", "LINES"):  # 0 stands for unknown, and would be taken for no room at all
        if environment.get(size, "1").strip("0") == "":
            del environment[size]


def _known(error: Exception) -> TcrctlError:
    if isinstance(error, TcrctlError):
        return error
    if isinstance(error, OSError):
        if error.errno == errno.ENOENT and error.filename is None:  # what getcwd says
            return DeviceError("the folder that the program was started in is gone")
        return (
            InputError(f"{error.filename}: {error.strerror}")
            if _is_bad_name(error)
            else DeviceError(str(error))
        )
    hint = "Set TCRCTL_TRACEBACK=1 for the traceback; this is a fault of the program, please report it."
    return TcrctlError(f"internal error: {type(error).__name__}: {error}", hint=hint)


def _is_bad_name(error: OSError) -> bool:
    return error.errno == errno.ENAMETOOLONG and error.filename is not None


def _report(error: TcrctlError, raised: Exception, as_json: bool) -> int:
    if os.environ.get("TCRCTL_TRACEBACK"):
        traceback.print_exception(raised)
    problems = [str(problem) for problem in error.problems] if isinstance(error, SpecError) else []
    for line in problems or [str(error)]:
        print(f"error: {line}", file=sys.stderr)
    if error.hint:
        print(f"hint: {error.hint}", file=sys.stderr)
    if as_json:
        _print_json(str(error), problems)
    return error.exit_code


def _print_json(reason: str, problems: Sequence[str] = ()) -> None:
    print(json.dumps({"status": "error", "reason": reason, **({"problems": problems} if problems else {})}))


if __name__ == "__main__":
    sys.exit(main())
