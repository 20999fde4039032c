"""Nothing of a rig moves before a person, or a script with ``--yes``, has agreed."""

from __future__ import annotations

import sys


def check_can_ask() -> None:
    """Find out before anything is connected whether somebody can be asked.

    Raises:
        InputError: If stdin is not a terminal.
    """
    from tcrctl.errors import InputError

    if not _is_terminal():
        raise InputError(
            "a rig moves only with consent, and there is no terminal to ask on",
            hint="--yes agrees in advance; first make sure that nobody is within the robot's reach.",
        )


def ask(what: str) -> None:
    """Ask whether the robot may move.

    Args:
        what: What is going to happen, a sentence.

    Raises:
        InputError: If the answer is not yes, or nobody can be asked.
    """
    from tcrctl.errors import InputError

    check_can_ask()
    print(
        f"{what} Is the emergency stop within reach, and nobody within the robot's? [y/N] ",
        end="",
        file=sys.stderr,
    )
    sys.stderr.flush()
    if _answer().strip().lower() not in ("y", "yes"):
        raise InputError("not agreed; nothing has moved")


def _is_terminal() -> bool:
    try:
        return sys.stdin is not None and sys.stdin.isatty()
    except (OSError, ValueError):  # closed
        return False


def _answer() -> str:
    try:
        return sys.stdin.readline()
    except (OSError, ValueError):  # gone, or no text
        return ""
