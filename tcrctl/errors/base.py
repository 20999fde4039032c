"""The base of all errors, an end that is nobody's mistake, and how an error is told in one line."""

from __future__ import annotations

from tcrctl.visible import visible


class TcrctlError(Exception):
    """Base of all errors of tcrctl.

    Attributes:
        exit_code: Process exit code of this kind of error.
        hint: What the user can do about it; may be empty.
    """

    exit_code = 1

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(visible(message))
        self.hint = visible(hint)


class RunInterruptedError(TcrctlError):
    """A signal asked the run to stop, and it did so between two control steps.

    Attributes:
        signal: Number of the signal.
        exit_code: 128 + number: 130 for Ctrl-C, 143 for SIGTERM.
    """

    def __init__(self, number: int, name: str) -> None:
        super().__init__(f"stopped by {name}")
        self.signal, self.exit_code = number, 128 + number


def with_hint(error: TcrctlError) -> str:
    """Return what went wrong, and what can be done about it, for places that have one line."""
    return f"{error}. {error.hint}" if error.hint else str(error)
