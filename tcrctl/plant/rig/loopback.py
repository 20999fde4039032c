"""What to do when a device on this computer does not answer: there it is an emulated one."""

from __future__ import annotations

import re
from typing import Final

_HERE: Final = re.compile(r"\b(127\.\d+\.\d+\.\d+|localhost)\b|::1")


def emulate_hint(where: str) -> str:
    """Return how the devices of this computer are started; empty for an address elsewhere.

    Args:
        where: Text with the address.
    """
    return (
        "The bench on this computer is emulated; start it in another terminal: tcrctl emulate"
        if _HERE.search(where)
        else ""
    )
