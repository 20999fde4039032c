"""Pairs of steps held against each other: the first difference, and how large all of them are."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass
from operator import attrgetter
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from tcrctl.log.columns import COLUMNS, Column
from tcrctl.signals import StepRecord

#: What a lean step leaves out; its checksum is compared instead.
_SPARSE: Final = (
    "estimate.q",
    "estimate.v",
    "estimate.disturbance",
    "info.predicted_tension",
    "info.integral",
    "truth.q",
)


def quantities(*left_out: str) -> dict[str, Column]:
    """Return the quantities of a step by path, in the order in which they come about; without parts ``left_out``.

    Args:
        *left_out: How the paths of what is left out begin.
    """
    return {column.path: column for column in COLUMNS.values() if not column.path.startswith(left_out)}


Value = float | int | bool | str


@dataclass(frozen=True, slots=True)
class Difference:
    """One number that is not the same.

    Attributes:
        step: Index of the step.
        field: Path of the number in the step, for instance ``wanted.speed[2]``.
        recorded: Its value in the log.
        replayed: Its value now.
        ulps: How many floating-point numbers lie between them; None if they are no finite floats.
    """

    step: int
    field: str
    recorded: Value
    replayed: Value
    ulps: int | None

    def as_json(self) -> dict[str, Any]:
        """Return the object ``first_difference`` of ``replay --json``; numbers that are not finite become text."""
        values = {"recorded": _plain(self.recorded), "replayed": _plain(self.replayed)}
        return {"step": self.step, "field": self.field, **values, "ulps": self.ulps}

    def __str__(self) -> str:
        ulps = "" if self.ulps is None else f" ({self.ulps} ulps)"
        return f"step {self.step}: {self.field} was {self.recorded!r}, is {self.replayed!r}{ulps}"


@dataclass(slots=True)
class Deviation:
    """How far one quantity differs over all compared steps.

    Attributes:
        field: Path of the quantity in the step.
        unit: Unit; empty if there is none.
        first_step: First step in which it differs.
        steps: Number of steps in which it differs.
        largest: Largest difference; NaN for text.
        rms: Root mean square over all its numbers in the steps in which it differs; NaN for text.
    """

    field: str
    unit: str
    first_step: int
    steps: int = 0
    largest: float = math.nan
    rms: float = math.nan

    def add(self, size: NDArray[np.float64]) -> None:
        """Take the absolute differences (n,) of one step."""
        self.steps += 1
        if size.size:
            squares = 0.0 if math.isnan(self.rms) else (self.steps - 1) * self.rms**2
            self.rms = math.sqrt((squares + float(np.mean(size**2))) / self.steps)
            self.largest = max(float(np.max(size)), 0.0 if math.isnan(self.largest) else self.largest)

    def as_json(self) -> dict[str, Any]:
        """Return an item of ``deviations`` in ``replay --json``."""
        return {
            "field": self.field,
            "unit": self.unit,
            "first_step": self.first_step,
            "steps": self.steps,
            "max": _plain(self.largest) if math.isfinite(self.largest) else None,
            "rms": _plain(self.rms) if math.isfinite(self.rms) else None,
        }


class Comparison:
    """Takes pairs of steps.

    Attributes:
        steps: Pairs taken.
        different: Pairs that differ.
        first: The first difference, None if all is the same.
        deviations: Deviation by path, only of what differs.
    """

    def __init__(self, columns: Mapping[str, Column], atol: float = 0.0, rtol: float = 0.0) -> None:
        """Compare by bytes, unless a tolerance is given.

        Args:
            columns: What is compared, by path.
            atol: Absolute difference that counts as none, in the unit of each quantity.
            rtol: The same, as part of the recorded value.
        """
        self._atol, self._rtol = atol, rtol
        self._tolerant = atol > 0.0 or rtol > 0.0
        self._fields = {path: (column, attrgetter(path)) for path, column in columns.items()}
        self.steps = self.different = 0
        self.first: Difference | None = None
        self.deviations: dict[str, Deviation] = {}

    def add(self, recorded: StepRecord, replayed: StepRecord) -> None:
        """Compare a step."""
        self.steps += 1
        differs = False
        for path, (column, get) in self._fields.items():
            was, now = _get(get, recorded), _get(get, replayed)
            if self._same(was, now) or (path in _SPARSE and _is_left_out(was, now)):
                continue
            differs = True
            if self.first is None:
                self.first = self._difference(recorded.k, path, was, now)
            deviation = self.deviations.setdefault(path, Deviation(path, column.unit, recorded.k))
            deviation.add(_sizes(was, now))
        self.different += self._checksums_differ(recorded, replayed) or differs

    def _checksums_differ(self, recorded: StepRecord, replayed: StepRecord) -> bool:
        """Compare what a lean step leaves out, and see whether its input is as it was when it was logged."""
        was, now = recorded.checksums, replayed.checksums
        if was is None or now is None or self._tolerant:
            return False
        differs = False
        for name, one, other in (("given", was.given, now.given), ("state", was.state, now.state)):
            if one == other:
                continue
            differs, path = True, f"checksums.{name}"
            if self.first is None:
                self.first = Difference(recorded.k, path, f"{one:08x}", f"{other:08x}", None)
            self.deviations.setdefault(path, Deviation(path, "", recorded.k)).add(np.zeros(0))
        return differs

    def _same(self, was: Any, now: Any) -> bool:
        if isinstance(was, np.ndarray) and isinstance(now, np.ndarray):
            if was.tobytes() == now.tobytes():
                return bool(was.shape == now.shape)
            return bool(was.shape == now.shape and self._close(was, now).all())
        if isinstance(was, float) and isinstance(now, float):
            # only equal bits are equal: neither the two zeros nor two kinds of NaN are
            return bool(np.float64(was).tobytes() == np.float64(now).tobytes() or self._close(was, now))
        return bool(was == now)

    def _close(self, was: Any, now: Any) -> Any:
        """Tell where a number is within the tolerance; bits of NaN do not count if there is one."""
        if not self._tolerant or np.asarray(was).dtype != np.float64:
            return _bits(was) == _bits(now)
        return np.isclose(now, was, rtol=self._rtol, atol=self._atol, equal_nan=True)

    def _difference(self, k: int, path: str, was: Any, now: Any) -> Difference:
        if not (isinstance(was, np.ndarray) and isinstance(now, np.ndarray)):
            return Difference(k, path, _value(was), _value(now), ulps(was, now))
        if was.shape != now.shape:
            return Difference(k, path, f"shape {was.shape}", f"shape {now.shape}", None)
        index = np.unravel_index(int(np.flatnonzero(~self._close(was, now))[0]), was.shape)
        label = ",".join(str(int(i)) for i in index)
        one, other = was[index].item(), now[index].item()
        return Difference(k, f"{path}[{label}]", one, other, ulps(one, other))


def _get(get: Callable[[StepRecord], Any], step: StepRecord) -> Any:
    """Return the value of a step; None if the record that it belongs to is lacking."""
    try:
        return get(step)
    except AttributeError:
        return None


def _is_left_out(was: Any, now: Any) -> bool:
    return was is not None and now is not None and not (was.size and now.size)


def _bits(values: Any) -> Any:
    array = np.asarray(values)
    return array.view(np.int64) if array.dtype == np.float64 else array


def ulps(one: Any, other: Any) -> int | None:
    """Return the representable numbers between two finite floats; None for anything else."""
    if not (
        isinstance(one, float) and isinstance(other, float) and math.isfinite(one) and math.isfinite(other)
    ):
        return None
    return abs(_rank(one) - _rank(other))


def _rank(number: float) -> int:
    """Return the index of a float in the order of all floats; -0.0 comes right before 0.0."""
    bits = int(np.float64(number).view(np.int64))
    return bits if bits >= 0 else -(bits & 0x7FFF_FFFF_FFFF_FFFF) - 1


def _sizes(was: Any, now: Any) -> NDArray[np.float64]:
    """Return the absolute differences of all numbers, empty if that has no meaning."""
    if isinstance(was, str) or was is None or now is None or np.shape(was) != np.shape(now):
        return np.zeros(0)
    size = np.abs(np.asarray(now, dtype=np.float64) - np.asarray(was, dtype=np.float64)).ravel()
    return size[~np.isnan(size)]


def _value(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return f"{value.shape} numbers"
    return "none" if value is None else value


def _plain(value: Value) -> Value:
    return repr(value) if isinstance(value, float) and not math.isfinite(value) else value


def table(deviations: Iterable[Deviation]) -> Iterator[tuple[str, ...]]:
    """Yield deviations as rows of text: quantity, first step, steps, largest, rms."""
    for item in deviations:
        unit = f" {item.unit}" if item.unit and not math.isnan(item.largest) else ""
        numbers = (
            ("", "") if math.isnan(item.largest) else (f"{item.largest:.4g}{unit}", f"{item.rms:.4g}{unit}")
        )
        yield item.field, str(item.first_step), str(item.steps), *numbers
