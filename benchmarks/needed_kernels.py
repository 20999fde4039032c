"""Write the list of the kernels that runs need: tcrctl/kernels/needed.json.

    python benchmarks/needed_kernels.py [--jobs 2] [--out tcrctl/kernels/needed.json]

Runs every shipped experiment, and letter_t with other settings, each in a process of its own: what it compiles
tells types, callees and times, and what a second one loads tells what Python calls. Ten minutes on two cores.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field
from functools import partial
from graphlib import TopologicalSorter
from pathlib import Path
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as the command line does
os.environ.setdefault("NUMBA_OPT", "1")

from numba.core import event, types
from numba.core.dispatcher import Dispatcher

from tcrctl.config import shipped
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.kernel_words import kernel_words
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.kernels.needed import FILE, ROOT, Needed, NeededKernels, write_needed
from tcrctl.kernels.type_words import TypeWords

#: What letter_t is run with, beside its own settings.
VARIANTS = (
    (), ("estimator=exact",), ("plant.realistic=moderate",), ("plant.realistic=mild",), ("plant.realistic=severe",),
    ("plant.realistic=moderate", "estimator=exact"),
    ("controller.model=static",), ("controller.prediction=one_step",), ("controller.prediction=literal",),
    ("controller.prediction=literal", "estimator=exact"), ("controller.prediction=one_step", "estimator=exact"),
    ("controller.dither=off",), ("controller.integral=off",), ("controller.prediction.rest_gain=off",),
    ("controller.prediction.hole_drag=off",), ("controller.prediction.tension_gap=off",),
    ("plant.friction.coefficient=0.1",), ("plant.mismatch=off",),
    ("controller={kind: kinematic, period_s: 0.05, output: position}",),
)  # fmt: skip
Key = tuple[str, tuple[str, ...]]


@dataclass
class Found:
    """What all runs have told, by kernel and words of its arguments."""

    words: TypeWords = field(default_factory=TypeWords)
    calls: dict[Key, list[Key]] = field(default_factory=dict)
    seconds: dict[Key, float] = field(default_factory=dict)
    when: dict[Key, frozenset[str]] = field(default_factory=dict)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--out", type=Path, default=FILE)
    parser.add_argument(
        "--one", nargs="+", help="an experiment and its settings: print what its run has loaded"
    )
    given = parser.parse_args()
    if given.one:
        print(json.dumps(told_by_run(*given.one)))
        return
    cases = [("letter_t", *overrides) for overrides in VARIANTS]
    cases += [(name,) for name in shipped.experiments() if name != "letter_t"]
    with tempfile.TemporaryDirectory() as cache, ThreadPoolExecutor(given.jobs) as pool:
        told = [report for case in pool.map(partial(reports, cache=cache), cases) for report in case]
    found = Found()
    for report in told:
        take(found, report)
    write_needed(listed(found), given.out)


def reports(case: tuple[str, ...], cache: str) -> list[dict[str, Any]]:
    """Run an experiment, and once more if it has compiled something; return what both have told."""
    found: list[dict[str, Any]] = []
    while not found or found[-1]["compiled"]:
        command = [sys.executable, __file__, "--one", *case]
        environment = {**os.environ, "NUMBA_CACHE_DIR": cache}
        done = subprocess.run(command, env=environment, stdout=subprocess.PIPE, text=True, check=False)
        if done.returncode:
            print(f"left out: {' '.join(case)}", file=sys.stderr)
            break
        found.append(json.loads(done.stdout.splitlines()[-1]))
        print(" ".join(case), len(found[-1]["compiled"]), len(found[-1]["loaded"]), file=sys.stderr)
    return found


def told_by_run(name: str, *overrides: str) -> dict[str, Any]:
    """Run an experiment in this process, and return what it has compiled and loaded."""
    words, spent = TypeWords(), Spent()
    with event.install_listener("numba:compile", spent), tempfile.TemporaryDirectory() as out:
        experiment = prepare(load_experiment(name, overrides), ahead=False)
        run_experiment(experiment, out=Path(out))
    overloads = list(loaded_overloads())
    fresh = [one for one in overloads if not isinstance(one[2].type_annotation, str)]
    return {
        "words": sorted(kernel_words(experiment.spec, experiment.loaded.robot)),
        "compiled": [
            (key(words, d, args), [key(words, *c) for c in callees(made)], spent.of(d, args))
            for d, args, made in fresh
        ],
        "loaded": [] if fresh else [key(words, d, args) for d, args, _ in overloads],
        "tuples": words.tuples,
    }


class Spent(event.Listener):
    """How long the compiler took for each kernel, without those that it calls [s]."""

    def __init__(self) -> None:
        self._running: list[list[float]] = []
        self._seconds: dict[Any, float] = {}

    def on_start(self, event: Any) -> None:
        """Begin with a kernel, maybe within another one."""
        self._running.append([time.process_time(), 0.0])

    def on_end(self, event: Any) -> None:
        """Note what it took."""
        begin, inner = self._running.pop()
        whole = time.process_time() - begin
        if self._running:
            self._running[-1][1] += whole
        self._seconds[id(event.data["dispatcher"]), tuple(event.data["args"])] = whole - inner

    def of(self, dispatcher: Any, args: Any) -> float:
        """Return what a kernel took [s]."""
        return self._seconds.get((id(dispatcher), tuple(args)), 0.0)


def loaded_overloads() -> Iterator[tuple[Any, Any, Any]]:
    """Yield kernel, types of arguments and result of the compiler for everything that is loaded."""
    modules = [module for name, module in sorted(sys.modules.items()) if name.startswith(ROOT)]
    kernels = [(m.__name__, k) for m in modules for k in vars(m).values() if isinstance(k, Dispatcher)]
    for module, kernel in kernels:
        if kernel.py_func.__module__ == module:
            yield from ((kernel, args, made) for args, made in kernel.overloads.items())


def callees(made: Any) -> Iterator[tuple[Any, Any]]:
    """Yield the kernels of the program that a compiled one calls, and types of arguments."""
    for call, signature in made.type_annotation.calltypes.items():
        if vars(call).get("op") != "call":
            continue
        function = made.type_annotation.typemap.get(call.func.name)
        if isinstance(function, types.Dispatcher) and function.dispatcher.py_func.__module__.startswith(ROOT):
            yield function.dispatcher, signature.args


def key(words: TypeWords, dispatcher: Any, args: Iterable[Any]) -> Key:
    name = f"{dispatcher.py_func.__module__}.{dispatcher.py_func.__qualname__}".removeprefix(ROOT)
    return name, tuple(words.word_of(one) for one in args)


def take(found: Found, report: dict[str, Any]) -> None:
    """Add what one run has told; its table of tuples is merged into the one of all."""
    own = TypeWords(report["tuples"])

    def merged(told: list[Any]) -> Key:
        return told[0], tuple(found.words.word_of(own.type_of(word)) for word in told[1])

    for one, called, seconds in report["compiled"]:
        found.calls[merged(one)] = [merged(callee) for callee in called]
        found.seconds[merged(one)] = seconds
    words = frozenset(report["words"])
    for one in report["loaded"]:
        found.when[merged(one)] = found.when.get(merged(one), words) & words


def listed(found: Found) -> NeededKernels:
    """Return the list, callees first, without words that tell nothing because every run has them."""
    graph = {one: set(called) & set(found.calls) for one, called in found.calls.items()}
    order = list(TopologicalSorter({one: sorted(graph[one]) for one in sorted(graph)}).static_order())
    number = {one: i for i, one in enumerate(order)}
    common = frozenset.intersection(*found.when.values())
    kernels = tuple(
        Needed(
            kernel=one[0],
            arguments=one[1],
            calls=tuple(sorted(number[callee] for callee in graph[one])),
            seconds=found.seconds[one],
            when=found.when[one] - common if one in found.when else None,
        )
        for one in order
    )
    return NeededKernels(kernels, found.words.tuples)


if __name__ == "__main__":
    main()
