"""One page per run, or of several side by side, that needs nothing but a browser, not even a network.

log.mcap -> history, summary, files -> payload (numbers) + page (text) -> report.html

The page carries its numbers as JSON with arrays in base64, and draws robot and curves on canvases with the scripts
in this folder. Everything that comes from the log is escaped, and the page's own content security policy forbids it
to load anything.
"""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from tcrctl.analysis.history import read_histories
from tcrctl.analysis.result import run_result
from tcrctl.errors import DeviceError, InputError
from tcrctl.experiment.run_folder import make_folder_for
from tcrctl.report.numbers import payload
from tcrctl.report.page import page


def write_report(
    path: Path | Sequence[Path], out: Path | None = None, *, force: bool = False, labels: Sequence[str] = ()
) -> Path:
    """Write the page of a run, or one page of several side by side.

    Args:
        path: The log, finished or not, or the folder of the run; or several of them.
        out: HTML file to create; ``report.html`` beside the log if left out, in this folder for several.
        force: Replace ``out`` if it exists.
        labels: Names of the runs, one each; found from the logs if left out.

    Returns:
        The file.

    Raises:
        InputError: If ``path`` is not a log with steps, or ``out`` exists and ``force`` is False.
        LogError: If the log is damaged inside.
        DeviceError: If ``out`` cannot be written.
    """
    histories = read_histories([path] if isinstance(path, Path) else path, labels=labels)
    out = out or (histories[0].log.path if len(histories) == 1 else Path("log")).with_name("report.html")
    if out.exists() and not force:
        raise InputError(f"{out}: exists already", hint="Give another name with -o, or --force.")
    results = [run_result(history.log) for history in histories]
    text = page(histories, results, payload(histories, results))
    make_folder_for(out)
    try:
        with open(out, "w" if force else "x", encoding="utf-8") as stream:
            stream.write(text)
    except OSError as error:
        raise DeviceError(f"{out}: cannot be written: {error.strerror or error}") from error
    return out
