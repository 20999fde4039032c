"""Every error a device can cause: one base class, evidence in attributes."""

from __future__ import annotations


class HardwareError(Exception):
    """Base of all errors of ``tcr_hardware``; a program that meets one has a device or connection problem.

    Attributes:
        hint: What the user can do about it; may be empty.
    """

    def __init__(self, message: str, *, hint: str = "") -> None:
        super().__init__(message)
        self.hint = hint


class SocketError(HardwareError):
    """A socket could not be opened or used.

    Attributes:
        address: The local address and port, or the host that could not be found.
        reason: What the operating system said.
    """

    def __init__(self, address: str, reason: str, *, hint: str = "") -> None:
        super().__init__(f"{address}: {reason}", hint=hint)
        self.address, self.reason = address, reason
