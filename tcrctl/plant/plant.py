"""What the loop needs of a plant, simulated, recorded or real."""

from __future__ import annotations

from typing import Protocol

from tcrctl.signals import Command, Measurement, Truth


class Plant(Protocol):
    """A robot that can be measured and driven."""

    def read(self) -> Measurement:
        """Return the newest measurement."""
        ...

    def write(self, command: Command) -> Command:
        """Send a command for one control period; returns what was really sent, after the plant's limits."""
        ...

    def truth(self) -> Truth | None:
        """Return what a simulated plant knows about itself at the time of the last ``read``; None on a rig."""
        ...

    def close(self) -> None:
        """Leave the robot in a safe state."""
        ...


class RunnablePlant(Plant, Protocol):
    """A plant of a run: what is not recorded has to be got ready."""

    def start(self) -> None:
        """Get ready to be driven: a rig arms its drives, a simulation has nothing to do.

        Raises:
            StoppedError: If it must not be driven now.
            DeviceError: If it cannot.
        """
        ...
