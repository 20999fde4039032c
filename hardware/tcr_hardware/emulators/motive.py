"""An emulated Motive server: streams markers over NatNet, answers requests, and fails on demand.

with MotiveEmulator(["m1.n1", "m1.n2", "m1.n3"], lambda: positions, MotiveSettings(rate_hz=120)) as motive:
    motive.faults.loss = 0.1
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from types import TracebackType

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.emulators import motive_encoder as encoder
from tcr_hardware.emulators.motive_distortion import Distortion
from tcr_hardware.emulators.motive_encoder import Stamp, Version
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.motive_link import Client, MotiveLink
from tcr_hardware.emulators.motive_markers import TrackedMarkers, View
from tcr_hardware.emulators.motive_outbox import Outbox
from tcr_hardware.emulators.motive_requests import CLOCK_HZ, answer
from tcr_hardware.emulators.motive_settings import MotiveSettings

FRAMEOFDATA, DISCONNECTBYTIMEOUT = 7, 11
MODELS_CHANGED, BITSTREAM_CHANGED = 0x02, 0x08
#: A change is flagged in so many frames, that one lost packet does not hide it.
FLAGGED_FRAMES = 3


class MotiveEmulator:
    """A server in a thread of its own.

    Attributes:
        faults: What is wrong with it; change it at any time.
        settings: Settings.
        tracked: Names and bodies.
        version: Newest version served now.
        frames_sent: Frames taken while somebody listened; how many of them arrive is a matter of the faults.
        failure: What ended the stream, for instance an error of ``positions``; None while it runs.
    """

    def __init__(
        self,
        names: Sequence[str],
        positions: Callable[[], NDArray[np.float64]],
        settings: MotiveSettings | None = None,
        faults: MotiveFaults | None = None,
    ) -> None:
        self.settings = settings or MotiveSettings()
        self.faults = faults or MotiveFaults()
        self.version = _version(self.settings.version)
        self._positions = positions
        self.tracked = TrackedMarkers(names, positions())
        self.link = MotiveLink(self.settings)
        self._distortion = Distortion()
        self._outbox = Outbox(self.settings.seed)
        self.frames_sent = 0
        self._lock = threading.Lock()
        self._stopping = threading.Event()
        self.failure: Exception | None = None
        self._thread: threading.Thread | None = None
        self._begin(self.settings.clock_offset_s)

    def __enter__(self) -> MotiveEmulator:
        """Start."""
        self.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, traceback: TracebackType | None
    ) -> None:
        """Stop."""
        self.stop()

    @property
    def address(self) -> tuple[str, int]:
        """Host and port of requests."""
        return self.link.address

    @property
    def clients(self) -> int:
        """Unicast clients at present."""
        return len(self.link.clients)

    def start(self) -> None:
        """Begin to stream."""
        self._stopping.clear()
        self._thread = threading.Thread(target=self._run, name="motive", daemon=True)
        self._thread.start()

    def stop(self) -> None:
        """End the stream and close the sockets; raises what had ended it before, if anything had."""
        self._stopping.set()
        if self._thread is not None:
            self._thread.join()
            self._thread = None
        self.link.close()
        if self.failure is not None:
            raise self.failure

    def restart(self) -> None:
        """Do as after a crash: frames count from 0, the clock begins anew, unicast clients are forgotten."""
        with self._lock:
            self.link.clients.clear()
            self._begin(self._clock_offset + 500.0)

    def change_models(self, names: Sequence[str]) -> None:
        """Track the same markers under other names, in the same order of rows."""
        with self._lock:
            self.tracked = TrackedMarkers(names, self._positions())
            self._models_flag = FLAGGED_FRAMES

    def change_version(self, version: str) -> None:
        """Stream another version from now on, to everybody."""
        with self._lock:
            self.version = _version(version)
            self.link.change_version(self.version, FLAGGED_FRAMES)

    def ticks(self, at: float) -> int:
        """Return the server's clock at a time of ``time.monotonic`` [s]."""
        return round((at + self._clock_offset) * (1.0 + self.settings.clock_drift) * CLOCK_HZ)

    def _begin(self, clock_offset: float) -> None:
        self._clock_offset = clock_offset
        self._number = 0
        self._models_flag = FLAGGED_FRAMES
        self._frozen: tuple[Stamp, View] | None = None

    def _run(self) -> None:
        try:
            self._loop()
        except Exception as error:
            self.failure = error

    def _loop(self) -> None:
        period = 1.0 / self.settings.rate_hz
        next_frame = time.monotonic()
        while not self._stopping.is_set():
            now = time.monotonic()
            if now >= next_frame:
                with self._lock:
                    self._expose(now)
                next_frame = max(next_frame + period, now)  # frames that were missed are not made up
            self._outbox.flush(time.monotonic(), self.link.send)
            wake = min(next_frame, self._outbox.next_due())
            for datagram, client in self.link.receive(wake - time.monotonic()):
                with self._lock:
                    self._answer(datagram, client)
            for client in self.link.expire(time.monotonic()):
                self.link.send(encoder.packet(DISCONNECTBYTIMEOUT), client)

    def _answer(self, datagram: bytes, client: tuple[str, int]) -> None:
        if not self.faults.mute:
            for reply in answer(self, datagram, client):
                self.link.send(reply, client)

    def latest(self, version: Version) -> bytes:
        """Return the markers now, as one FRAMEOFDATA packet."""
        stamp, view = self._look(time.monotonic())
        return encoder.packet(FRAMEOFDATA, encoder.frame(version, stamp, self.tracked, view))

    def _look(self, now: float) -> tuple[Stamp, View]:
        sent = now + self.settings.latency_s
        received = now + 0.6 * self.settings.latency_s
        flags = MODELS_CHANGED if self._models_flag > 0 else 0
        stamp = Stamp(
            self._number,
            self._number / self.settings.rate_hz,
            self.ticks(now),
            self.ticks(received),
            self.ticks(sent),
            flags,
        )
        seen = self._distortion.seen(self.tracked, self._positions(), self.faults, now)
        return stamp, self.tracked.view(seen, self.faults)

    def _expose(self, now: float) -> None:
        """Take one frame and put it into the outbox, for every listener in its version."""
        look = self._frozen if self.faults.freeze and self._frozen is not None else self._look(now)
        if look is not self._frozen:
            self._number += 1
            self._models_flag -= 1
        self._frozen = look
        if self.faults.silent:
            return
        encoded: dict[tuple[Version, int], bytes] = {}
        for destination, listener in self.link.listeners(self.version):
            key = (listener.version, self._bitstream(listener))
            if key not in encoded:
                encoded[key] = self._encode(*key, *look)
            self._outbox.put(
                encoded[key],
                destination,
                now + self.settings.latency_s,
                1.0 / self.settings.rate_hz,
                self.faults,
            )
            if self._outbox.happens(self.faults.second_source):
                self.link.send_as_stranger(encoded[key], destination)
        self.frames_sent += bool(encoded)

    def _encode(self, version: Version, flags: int, stamp: Stamp, view: View) -> bytes:
        flagged = replace(stamp, params=stamp.params | flags)
        return encoder.packet(FRAMEOFDATA, encoder.frame(version, flagged, self.tracked, view))

    def _bitstream(self, listener: Client) -> int:
        if listener.flagged <= 0:
            return 0
        listener.flagged -= 1
        return BITSTREAM_CHANGED


def _version(text: str) -> Version:
    major, minor = text.split(".")[:2]
    return int(major), int(minor)
