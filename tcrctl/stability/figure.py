"""Both curves of a stability report over time, as a figure like Fig. 13."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tcrctl.errors import DeviceError
from tcrctl.stability.report import StabilityReport


def draw(report: StabilityReport, out: Path) -> None:
    """Draw max |μ| of (42) and the spectral radius of the closed loop.

    Args:
        report: The report.
        out: File to write; the suffix gives the format (png, pdf, svg).

    Raises:
        DeviceError: If it cannot be written.
    """
    from matplotlib.figure import Figure

    columns = report.columns()
    t = columns["t_s"]
    figure = Figure(figsize=(7.0, 5.0), layout="constrained")
    outer, inner = figure.subplots(2, 1, sharex=True)
    outer.plot(t, columns["spectral_radius"], "o-", markersize=3, color="C0")
    outer.axhline(1.0, color="0.4", linewidth=0.8, linestyle="--")
    outer.set_ylabel("spectral radius,\nstep to step")
    outer.set_title(f"{report.spec}: {report.robot}, controller {report.controller}", fontsize="medium")
    mu = columns["inner_mu_max"]
    inner.plot(t, np.maximum(mu, 1e-12), "o-", markersize=3, color="C1")
    inner.axhline(1.0, color="0.4", linewidth=0.8, linestyle="--")
    inner.set_yscale("log")
    inner.set_ylabel("max |μ| of (42),\ninner iteration")
    inner.set_xlabel("t [s]")
    for axes in (outer, inner):
        for i, moment in enumerate(t[columns["limited"] > 0.0]):
            axes.axvline(moment, color="C3", alpha=0.15, linewidth=3.0, label="" if i else "a limit acts")
    if columns["limited"].any():
        outer.legend(loc="best", fontsize="small")
    try:
        figure.savefig(out, dpi=160)
    except OSError as error:
        raise DeviceError(f"{out}: cannot be written: {error.strerror or error}") from error
