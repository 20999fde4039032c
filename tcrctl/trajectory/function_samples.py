"""A function of time becomes a table, once, before a run; from then on nothing but the table counts."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Final

import numpy as np

from tcrctl.errors import InputError
from tcrctl.plugins.faults import told
from tcrctl.signals import Array
from tcrctl.trajectory.function_settings import FunctionSettings

HEADERS: Final = {3: "t_s,x_m,y_m,z_m", 6: "t_s,x_m,y_m,z_m,nx,ny,nz"}


def sampled(settings: FunctionSettings, function: Callable[[float], Any], file: str) -> bytes:
    """Return the samples of a function as a CSV file, every number to its last bit.

    Args:
        settings: How often and how long.
        function: Takes the time [s]; returns the end position (3,) [m], or that and the unit normal (6,).
        file: Where it is defined, for messages.

    Raises:
        InputError: If it raises, or returns something else.
    """
    count = round(settings.duration_s * settings.rate_hz) + 1
    rows = [_row(settings.function, function, file, float(t)) for t in _instants(settings, count)]
    widths = {len(row) for row in rows}
    if len(widths) > 1:
        raise InputError(f"{settings.function} returned 3 numbers at some times and 6 at others")
    lines = (",".join(repr(float(value)) for value in row) for row in rows)
    return "\n".join((HEADERS[widths.pop() - 1], *lines, "")).encode()


def _instants(settings: FunctionSettings, count: int) -> Array:
    return np.linspace(0.0, settings.duration_s, count)


def _row(name: str, function: Callable[[float], Any], file: str, t: float) -> Array:
    """Return time and what the function says then (1 + 3,) or (1 + 6,)."""
    try:
        found = function(t)
    except (Exception, SystemExit) as error:
        raise InputError(f"{name} raised {told(error, file)} at t = {t:g} s") from error
    try:
        values = np.array(found, dtype=float)
    except (TypeError, ValueError):
        raise InputError(f"{name} returned no numbers at t = {t:g} s") from None
    if values.shape not in ((3,), (6,)):
        what = f"{name} returned shape {values.shape} at t = {t:g} s"
        raise InputError(
            what, hint="It must be the end position (3,) in m, or that and the unit normal (6,)."
        )
    if not np.isfinite(values).all():
        raise InputError(f"{name} returned values that are no finite numbers at t = {t:g} s")
    return np.concatenate(([t], values))
