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
