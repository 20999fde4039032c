"""``tcrctl emulate``: a bench on this computer, without a bench."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.options import AsJson, unfolded

if TYPE_CHECKING:
    from tcrctl.emulate.bench import EmulatedBench
    from tcrctl.emulate.fault_script import FaultScript
    from tcrctl.emulate.settings import EmulationSettings


@dataclass(frozen=True)
class Robots:
    """How far the robots, their drives and the cameras are from the controller's model."""

    perfect: Annotated[
        bool, typer.Option("--perfect", help="Robots exactly as the controller's model; no marker noise.")
    ] = False
    realistic: Annotated[
        str,
        typer.Option("--realistic", metavar="LEVEL", help="off, mild, moderate or severe: docs/reality.md."),
    ] = "off"
    seed: Annotated[
        int, typer.Option("--seed", min=0, help="Seed of noise and of what --realistic draws.")
    ] = 0


@unfolded
def emulate(
    rig: Annotated[
        str, typer.Argument(metavar="RIG", help="Shipped rig, or path of a rig file.")
    ] = "loopback",
    faults: Annotated[
        Path | None, typer.Option("--faults", metavar="FILE", help="YAML file of what goes wrong, and when.")
    ] = None,
    robots: Robots = Robots(),
    rate_hz: Annotated[
        float, typer.Option("--rate-hz", min=10, max=1000, help="Camera frames per second.")
    ] = 240.0,
    watchdog_ms: Annotated[
        int, typer.Option("--watchdog-ms", min=20, max=60000, help="Watchdog of the PLCs.")
    ] = 200,
    for_s: Annotated[
        float | None, typer.Option("--for-s", min=0, help="End after this time; default: at Ctrl-C.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Emulate cameras, PLCs and robots of a rig file; then run experiments on it from another terminal.

    The robots are those of the shipped experiments: springs 30 % softer and density 20 % higher than the
    controller believes, 50 um of marker noise. --realistic adds friction, unlike parts, imperfect drives,
    cables and cameras. With --json, one object with counts at the end.

    Examples:
      tcrctl emulate
      tcrctl run letter_t --set plant.kind=rig --set plant.rig=loopback --yes    (in another terminal)
      tcrctl emulate --faults estop.yaml
      tcrctl emulate --realistic moderate --seed 7
    """
    from tcrctl.errors import RunInterruptedError
    from tcrctl.loop.interruption import Interruption, signals_exit

    with signals_exit():
        settings = _settings(robots)
        bench, script = _built(rig, faults, replace(settings, rate=rate_hz, watchdog_ms=watchdog_ms))
    from tcrctl.emulate.bench import emulate as keep_going

    with Interruption() as interruption, bench:
        _say(_places(rig, bench))
        end = None if for_s is None else time.monotonic() + for_s

        def over() -> bool:
            interruption.check()
            return end is not None and time.monotonic() >= end

        try:
            keep_going(bench, script, over, _say)
        except RunInterruptedError as stopped:
            _say(f"\n{stopped}")
        result = bench.as_json()
    if as_json:
        print(json.dumps({"status": "ok", **result}))


def _settings(robots: Robots) -> EmulationSettings:
    from tcrctl.emulate.settings import EmulationSettings
    from tcrctl.errors import InputError
    from tcrctl.plant.realistic import LEVELS

    level = robots.realistic
    if level not in ("off", *LEVELS):
        raise InputError(f"--realistic must be off, {', '.join(LEVELS)}, not {level}")
    settings = EmulationSettings(realistic=level, seed=robots.seed)  # type: ignore[arg-type]  # checked above
    return replace(settings, mismatch=None, noise=1e-9) if robots.perfect else settings


def _built(
    rig: str, faults: Path | None, settings: EmulationSettings
) -> tuple[EmulatedBench, FaultScript | None]:
    from tcrctl.emulate.bench import EmulatedBench, marker_names
    from tcrctl.emulate.drive_faults import drives_of
    from tcrctl.emulate.fault_script import load_fault_script
    from tcrctl.experiment.compilation import announced_compilation
    from tcrctl.plant.rig.file import read_rig

    file, *_ = read_rig(rig)
    script = None if faults is None else load_fault_script(faults, drives_of(file), marker_names(file))
    with announced_compilation(_say):
        return EmulatedBench(file, settings), script


def _places(rig: str, bench: EmulatedBench) -> str:
    host, port = bench.motive.address
    plcs = ", ".join(f"{name} {place}" for name, place in bench.places.items())
    return f"rig {rig} is emulated: cameras {host}:{port}; PLC of {plcs}; Ctrl-C ends it"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
