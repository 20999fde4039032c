"""One page per run that needs nothing but a browser, not even a network.

log.mcap -> history, summary, files -> payload (numbers) + page (text) -> report.html

The page carries its numbers as JSON with arrays in base64, and draws robot and curves on canvases with the scripts
in this folder. Everything that comes from the log is escaped, and the page's own content security policy forbids it
to load anything.
"""

from __future__ import annotations

from pathlib import Path

from tcrctl.analysis.history import read_histories
from tcrctl.analysis.result import run_result
from tcrctl.errors import DeviceError, InputError
from tcrctl.report.numbers import payload
from tcrctl.report.page import page


def write_report(path: Path, out: Path | None = None, *, force: bool = False) -> Path:
    """Write the page of a run.

    Args:
        path: The log, finished or not, or the folder of the run.
        out: HTML file to create; ``report.html`` beside the log if left out.
        force: Replace ``out`` if it exists.

    Returns:
        The file.

    Raises:
        InputError: If ``path`` is not a log with steps, or ``out`` exists and ``force`` is False.
        LogError: If the log is damaged inside.
        DeviceError: If ``out`` cannot be written.
    """
    (history,) = read_histories([path])
    out = history.log.path.with_name("report.html") if out is None else out
    if out.exists() and not force:
        raise InputError(f"{out}: exists already", hint="Give another name with -o, or --force.")
    text = page(history, run_result(history.log), payload(history))
    try:
        with open(out, "w" if force else "x", encoding="utf-8") as stream:
            stream.write(text)
    except OSError as error:
        raise DeviceError(f"{out}: cannot be written: {error.strerror or error}") from error
    return out
