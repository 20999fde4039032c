"""Which kernels runs need, for which types of arguments: the file ``needed.json``.

``nox -s kernels`` writes it anew (benchmarks/needed_kernels.py). What it says of a kernel that has changed since is
harmless: a kernel that is not there is left out, one for other types is compiled for nobody.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

#: Every kernel of the program stands in a module below this one.
ROOT: Final = "tcrctl."
FILE: Final = Path(__file__).parent / "needed.json"


@dataclass(frozen=True, slots=True)
class Needed:
    """One kernel for one list of arguments.

    Attributes:
        kernel: Module and name, without the program's own.
        arguments: Their types in words of :mod:`tcrctl.kernels.type_words`.
        calls: Numbers of the kernels that it calls.
        seconds: What compiling it took on the computer that wrote the file, without those [s].
        when: Words of all settings of which every run needs it that has them; None if only kernels call it.
    """

    kernel: str
    arguments: tuple[str, ...]
    calls: tuple[int, ...]
    seconds: float
    when: frozenset[str] | None


@dataclass(frozen=True, slots=True)
class NeededKernels:
    """The whole file.

    Attributes:
        kernels: All of them, in an order in which every one stands behind those that it calls.
        tuples: The table of :class:`tcrctl.kernels.type_words.TypeWords`.
    """

    kernels: tuple[Needed, ...]
    tuples: Mapping[str, Sequence[str]]

    def called_with(self, words: Iterable[str]) -> list[int]:
        """Return the numbers of those that Python calls in a run with some settings."""
        given = frozenset(words)
        return [i for i, one in enumerate(self.kernels) if one.when is not None and one.when <= given]


def read_needed(path: Path = FILE) -> NeededKernels:
    """Read the file.

    Raises:
        OSError: If it cannot be read.
        ValueError, KeyError, TypeError: If it is not what it should be.
    """
    found = json.loads(path.read_text())
    return NeededKernels(tuple(map(_needed, found["kernels"])), found["tuples"])


def write_needed(needed: NeededKernels, path: Path = FILE) -> None:
    """Write the file, one line per kernel and tuple."""
    kernels = ",\n".join(json.dumps(_as_json(one)) for one in needed.kernels)
    tuples = ",\n".join(f"{json.dumps(name)}: {json.dumps(list(of))}" for name, of in needed.tuples.items())
    path.write_text(f'{{"kernels": [\n{kernels}\n],\n"tuples": {{\n{tuples}\n}}}}\n')


def dispatcher(kernel: str) -> Any:
    """Return a kernel by its name.

    Raises:
        ImportError, AttributeError: If it is not there.
    """
    module, _, name = kernel.rpartition(".")
    return getattr(importlib.import_module(ROOT + module), name)


def _needed(found: Mapping[str, Any]) -> Needed:
    when = found.get("when")
    return Needed(
        kernel=found["kernel"],
        arguments=tuple(found["arguments"]),
        calls=tuple(found["calls"]),
        seconds=float(found["seconds"]),
        when=None if when is None else frozenset(when),
    )


def _as_json(one: Needed) -> dict[str, Any]:
    found: dict[str, Any] = {"kernel": one.kernel, "arguments": one.arguments, "calls": one.calls}
    found["seconds"] = round(one.seconds, 2)
    return found if one.when is None else found | {"when": sorted(one.when)}
