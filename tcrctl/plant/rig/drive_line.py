"""The conversation with the drives: what they said last, and what went wrong since."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from tcrctl.errors import DeviceError, UntrustworthyDeviceError
from tcrctl.plant.rig.devices import DriveControl, Drives, DriveStatus
from tcrctl.plant.rig.set_points import Micrometres


@dataclass(slots=True)
class _Calls:
    """How calls of one kind went: when the last one succeeded, and what has gone wrong since."""

    answered: float
    trouble: str = ""
    hopeless: bool = False


class DriveLine:
    """Questions and commands are counted apart: a PLC that answers questions may still not take commands.

    Attributes:
        status: What the drives said last; None if they never did.
    """

    def __init__(self, drives: Drives, clock: Callable[[], float]) -> None:
        """Take over open drives; ``clock`` never jumps [s]."""
        self._drives, self._clock = drives, clock
        self._questions, self._commands = _Calls(clock()), _Calls(clock())
        self.status: DriveStatus | None = None

    def ask(self) -> bool:
        """Tell whether the drives answered the question how they are."""
        return self._call(self._questions, self._drives.status)

    def exchange(self, target: Micrometres, control: DriveControl) -> bool:
        """Tell whether the drives answered a command; a PLC answers before it looks at the set-points."""
        return self._call(self._commands, lambda: self._drives.exchange(target, control))

    def _call(self, calls: _Calls, call: Callable[[], DriveStatus]) -> bool:
        try:
            self.status = call()
        except DeviceError as error:
            calls.trouble, calls.hopeless = str(error), isinstance(error, UntrustworthyDeviceError)
            return False
        calls.answered, calls.trouble, calls.hopeless = self._clock(), "", False
        return True

    @property
    def trouble(self) -> str:
        """What the last failed call said; empty if calls of its kind work again."""
        return self._commands.trouble or self._questions.trouble

    @property
    def hopeless(self) -> bool:
        """Whether the drives answer what cannot be true."""
        return self._commands.hopeless or self._questions.hopeless

    def silence(self) -> float:
        """Return how long calls of a kind that fails now have not succeeded [s]; 0 if none fails."""
        now = self._clock()
        failing = [calls for calls in (self._questions, self._commands) if calls.trouble]
        return max((now - calls.answered for calls in failing), default=0.0)

    def position(self) -> Micrometres:
        """Return where the drives were when they answered last (m,) [um].

        Raises:
            DeviceError: If they never did.
        """
        if self.status is None:
            raise DeviceError(f"the drives do not answer: {self.trouble}")
        return self.status.position

    def close(self) -> None:
        """End the connection."""
        self._drives.close()
