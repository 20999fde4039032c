"""Cameras of any kind, behind a bridge that sends what they see as JSON over UDP, a datagram per frame.

    {"frame": 1234, "age_s": 0.004, "markers": {"m1.n1": [0.1, 0.2, 1.5], "m1.n2": null}}

``frame`` counts, ``age_s`` says how long before sending the frame was taken (left out if that is not known), and
``markers`` has the positions by label, null for a marker that is tracked and not seen. Units and axes are those of
the cameras; ``calibration`` of the rig file takes them to the robot.
"""

from __future__ import annotations

import json
import math
import socket
import threading
import time

from tcrctl.extend import (
    CameraSection,
    CameraStatus,
    DeviceError,
    Finding,
    Identity,
    InputError,
    LabelledMarkers,
    Positive,
    quantity,
)

FIRST_FRAME_S = 2.0
LARGEST_DATAGRAM = 65535
#: A bridge that has been silent for so long may have been restarted: then another port is listened to.
RESTARTED_S = 1.0


class Keys(CameraSection):
    """Labelled markers from a bridge that sends JSON over UDP."""

    host: str = "127.0.0.1"
    port: int = 15520
    rate_hz: Positive = quantity("Hz", "frames per second that the bridge sends")
    jump_gate_mm: Positive = quantity("mm", "a marker that has jumped further is not used", 24.0)


class Frame:
    """One datagram on our own clock."""

    def __init__(self, datagram):
        self.arrival = time.monotonic()
        told = json.loads(datagram)
        self.number, self.markers = int(told["frame"]), dict(told["markers"])
        self.dated = "age_s" in told
        self.delay = float(told.get("age_s", 0.0))
        self.taken = self.arrival - self.delay
        whole = 0 <= self.number < 2**63 and 0.0 <= self.delay < 10.0
        if not whole or not all(_is_place(place) for place in self.markers.values()):
            raise ValueError("no frame")


def _is_place(value):
    return value is None or (len(value) == 3 and all(math.isfinite(x) for x in value))


class UdpCameras:
    """Listens in a thread; see :class:`tcrctl.extend.Cameras` for what the members have to do."""

    def __init__(self, settings, mounting):
        self.rate, self._finder = settings.rate_hz, LabelledMarkers(mounting, settings.jump_gate_mm / 1e3)
        self._where = f"UDP markers at {settings.host}:{settings.port}"
        self._changed, self._newest, self._taken = threading.Condition(), None, None
        self._source, self._strangers, self._lost, self._malformed, self._open = None, 0, 0, 0, True
        self._socket = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self._socket.bind((settings.host, settings.port))
        self._socket.settimeout(0.1)
        self._thread = threading.Thread(target=self._receive, daemon=True)
        self._thread.start()
        try:
            self._check_labels([marker.label for marker in mounting.markers])
        except BaseException:
            self.close()
            raise

    @property
    def identity(self):
        """Who sends."""
        return Identity("cameras", self._where, "bridge, JSON over UDP", {"bridge": str(self._source)})

    @property
    def clock(self):
        """Why it is not known when frames were taken; empty if it is."""
        newest = self._newest
        return "" if newest is None or newest.dated else "age_s is not told by the bridge"

    def next(self, timeout, *, fresh):
        """Return the newest frame not returned before."""
        with self._changed:
            before = self._newest
            if fresh or before is self._taken:
                self._changed.wait_for(lambda: self._newest is not before, timeout)
            frame = self._newest
            if frame is self._taken or not self._open:
                return None
            self._taken = frame
        return self._finder.sighting(frame.taken, frame.markers, number=frame.number, delay=frame.delay)

    def status(self):
        """Return what was counted."""
        newest = self._newest
        markers = 0 if newest is None else sum(place is not None for place in newest.markers.values())
        return CameraStatus(lost=self._lost, malformed=self._malformed, markers=markers)

    def checks(self, seen):
        """Yield whether somebody else sends, too."""
        if self._strangers:
            yield Finding("source", f"{self._strangers} frames of a second bridge, not used", 4)

    def close(self):
        """Listen no more."""
        with self._changed:
            self._open = False
        self._thread.join()
        self._socket.close()

    def _check_labels(self, labels):
        with self._changed:
            if not self._changed.wait_for(lambda: self._newest is not None, FIRST_FRAME_S):
                raise DeviceError(f"{self._where}: no frame within {FIRST_FRAME_S:g} s")
            known = self._newest.markers
        unknown = [label for label in labels if label not in known]
        if unknown:
            raise InputError(
                f"{self._where}: no marker {', '.join(unknown)}; there are {', '.join(sorted(known))}"
            )

    def _receive(self):
        while self._open:
            try:
                datagram, source = self._socket.recvfrom(LARGEST_DATAGRAM)
            except TimeoutError:
                continue
            except OSError:  # told by the frames that do not come any more
                return
            self._take(datagram, source)

    def _take(self, datagram, source):
        try:
            frame = Frame(datagram)
        except (ValueError, TypeError, KeyError, AttributeError, RecursionError):
            self._malformed += 1
            return
        last = self._newest
        if last is None or frame.arrival - last.arrival > RESTARTED_S:
            self._source = source
        if source != self._source:
            self._strangers += 1
        elif last is None or (frame.taken > last.taken and frame.markers != last.markers):
            self._accept(frame, last)  # cameras have noise: one that repeats the last was not taken anew

    def _accept(self, frame, last):
        with self._changed:
            self._lost += 0 if last is None else max(0, frame.number - last.number - 1)
            self._newest = frame
            self._changed.notify_all()


CAMERAS = (Keys, UdpCameras)
