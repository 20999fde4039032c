"""Where received frames wait for their readers."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable

from tcr_hardware.errors import HardwareError
from tcr_hardware.natnet.marker_frame import MarkerFrame

#: Frames kept for ``drain``: four seconds at 240 Hz.
QUEUE_FRAMES = 1024


class Inbox:
    """A slot for the newest frame and a bounded queue of all, filled by one thread, read by others.

    Attributes:
        newest: The newest frame, or None.
        failure: Why no more will come, or None.
        dropped: Frames that left the queue unread.
    """

    def __init__(self) -> None:
        self.newest: MarkerFrame | None = None
        self.failure: HardwareError | None = None
        self.dropped = 0
        self._queue: deque[MarkerFrame] = deque(maxlen=QUEUE_FRAMES)
        self._changed = threading.Condition()

    def put(self, frame: MarkerFrame) -> None:
        """Make a frame the newest one."""
        with self._changed:
            self.dropped += len(self._queue) == QUEUE_FRAMES
            self._queue.append(frame)
            self.newest = frame
            self._changed.notify_all()

    def notify(self) -> None:
        """Let the waiting look again."""
        with self._changed:
            self._changed.notify_all()

    def fail(self, error: HardwareError) -> None:
        """End the delivery."""
        self.failure = error
        self.notify()

    def check(self) -> None:
        """Raise what ended the delivery, if anything did."""
        if self.failure is not None:
            raise self.failure

    def wait(self, condition: Callable[[], bool], timeout_s: float) -> bool:
        """Wait until ``condition`` holds or the delivery ended; return whether one of them came about in time."""
        with self._changed:
            return self._changed.wait_for(lambda: self.failure is not None or condition(), timeout_s)

    def drain(self) -> list[MarkerFrame]:
        """Take every frame since the last call, oldest first."""
        with self._changed:
            frames = list(self._queue)
            self._queue.clear()
        return frames
