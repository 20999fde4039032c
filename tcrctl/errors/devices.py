"""Devices, connections and the file system: exit code 5."""

from __future__ import annotations

from tcrctl.errors.base import TcrctlError


class DeviceError(TcrctlError):
    """A device, connection or the file system failed."""

    exit_code = 5


class LogError(DeviceError):
    """A log could not be written or read.

    Attributes:
        path: The log file.
    """

    def __init__(self, path: object, message: str, *, hint: str = "") -> None:
        super().__init__(f"{path}: {message}", hint=hint)
        self.path = str(path)


class UntrustworthyDeviceError(DeviceError):
    """A device answers, but what it says cannot be true; waiting or asking again does not help."""
