"""``tcrctl emulate``: a bench on this computer, without a bench."""

from __future__ import annotations

import json
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tcrctl.cli.options import AsJson

if TYPE_CHECKING:
    from tcrctl.emulate.bench import EmulatedBench
    from tcrctl.emulate.fault_script import FaultScript


def emulate(
    rig: Annotated[
        str, typer.Argument(metavar="RIG", help="Shipped rig, or path of a rig file.")
    ] = "loopback",
    faults: Annotated[
        Path | None, typer.Option("--faults", metavar="FILE", help="YAML file of what goes wrong, and when.")
    ] = None,
    perfect: Annotated[
        bool, typer.Option("--perfect", help="Robots exactly as the controller's model; no marker noise.")
    ] = False,
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
    controller believes, 50 um of marker noise. With --json, one object with counts at the end.

    Examples:
      tcrctl emulate
      tcrctl run letter_t --set plant.kind=rig --set plant.rig=loopback --yes    (in another terminal)
      tcrctl emulate --faults estop.yaml
    """
    from tcrctl.errors import RunInterruptedError
    from tcrctl.loop.interruption import Interruption, signals_exit

    with signals_exit():
        bench, script = _built(rig, faults, perfect, rate_hz, watchdog_ms)
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


def _built(
    rig: str, faults: Path | None, perfect: bool, rate_hz: float, watchdog_ms: int
) -> tuple[EmulatedBench, FaultScript | None]:
    from tcrctl.emulate.bench import EmulatedBench, EmulationSettings, marker_names
    from tcrctl.emulate.fault_script import load_fault_script
    from tcrctl.experiment.compilation import announced_compilation
    from tcrctl.plant.rig.file import read_rig

    file, *_ = read_rig(rig)
    script = None if faults is None else load_fault_script(faults, file.robots, marker_names(file))
    settings = EmulationSettings(rate=rate_hz, watchdog_ms=watchdog_ms)
    if perfect:
        settings = replace(settings, mismatch=None, noise=1e-9)
    with announced_compilation(_say):
        return EmulatedBench(file, settings), script


def _places(rig: str, bench: EmulatedBench) -> str:
    host, port = bench.motive.address
    plcs = ", ".join(f"{name} {plc.address[0]}:{plc.address[1]}" for name, plc in bench.plcs.items())
    return f"rig {rig} is emulated: cameras {host}:{port}; PLC of {plcs}; Ctrl-C ends it"


def _say(text: str) -> None:
    print(text, file=sys.stderr, flush=True)
