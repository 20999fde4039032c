"""Rehearse every shipped experiment with ``tcrctl run NAME --dry-run``, in one process: kernels are loaded once."""

from __future__ import annotations

import io
import sys
from contextlib import redirect_stderr, redirect_stdout

from tcrctl.cli.app import main
from tcrctl.config import shipped


def dry_run(name: str) -> bool:
    """Print how a dry run ended; return whether it ended well."""
    said = io.StringIO()
    with redirect_stdout(said), redirect_stderr(said):
        code = main(["run", name, "--dry-run"])
    last = (said.getvalue().splitlines() or [""])[-1]
    print(f"dry run {name}:", "ok" if code == 0 else f"exit code {code}: {last}", flush=True)
    return code == 0


if __name__ == "__main__":
    names = list(shipped.experiments())
    failures = [name for name in names if not dry_run(name)]
    print(f"dry runs: {len(names)}, failed: {len(failures)}")
    sys.exit(0 if names and not failures else 1)
