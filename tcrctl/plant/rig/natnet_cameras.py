"""OptiTrack cameras as the rig plant wants them: markers of a NatNet stream on the nodes of the robot."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from typing import Final

import numpy as np

from tcr_hardware.errors import HardwareError
from tcr_hardware.markers import Gate, MarkerMap, MarkerMapError
from tcr_hardware.natnet.client import NatNetClient
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.settings import NatNetSettings
from tcrctl.errors import ArmingRefusedError, DeviceError, InputError
from tcrctl.plant.rig.devices import CameraStatus, Identity, Sighting
from tcrctl.plant.rig.finding import Finding
from tcrctl.plant.rig.loopback import emulate_hint
from tcrctl.plant.rig.mounting import Mounting
from tcrctl.plant.rig.settings import CameraSettings
from tcrctl.signals import RawFrame

#: Older servers do not tell when a frame was taken.
OLDEST_WITH_CLOCK: Final = (3, 0)


@contextmanager
def device_errors(what: str) -> Iterator[None]:
    """Let errors of a device leave as those of this program."""
    try:
        yield
    except HardwareError as error:
        raise DeviceError(f"{what}: {error}", hint=emulate_hint(str(error)) or error.hint) from error


def client_settings(cameras: CameraSettings) -> NatNetSettings:
    """Return the settings of a NatNet client."""
    return NatNetSettings(
        server=cameras.server,
        local=cameras.local,
        multicast=cameras.transport == "multicast",
        command_port=cameras.command_port,
        data_port=cameras.data_port,
        group=cameras.multicast_group,
        bitstream=cameras.bitstream if cameras.transport == "unicast" else None,
        allow_newer=cameras.allow_newer,
    )


def connect(cameras: CameraSettings) -> NatNetClient:
    """Open a client.

    Raises:
        DeviceError: If the camera system does not answer, or speaks another version.
    """
    client = NatNetClient(client_settings(cameras))
    with device_errors(f"cameras at {cameras.server}"):
        try:
            client.open()
        except BaseException:
            client.close()
            raise
    return client


class NatNetCameras:
    """Frames of one camera system, mapped to one robot.

    Attributes:
        client: The connection.
        rate: Frames per second [Hz].
    """

    def __init__(self, cameras: CameraSettings, mounting: Mounting) -> None:
        """Connect.

        Args:
            cameras: Section of the rig file.
            mounting: What is looked for.

        Raises:
            DeviceError: If the camera system does not answer.
            InputError: If a label is not known there.
        """
        self.client = connect(cameras)
        self._settings, self._mounting = cameras, mounting
        self._last = None
        self._bits = b""
        try:
            with device_errors(f"cameras at {cameras.server}"):
                self.rate = cameras.rate_hz or self.client.frame_rate()
                self._map = _marker_map(cameras, mounting)
                self._check_labels()
        except BaseException:
            self.client.close()
            raise

    _last: MarkerFrame | None

    @property
    def identity(self) -> Identity:
        """The program that streams, and the version that it speaks."""
        server, version = self.client.server, str(self.client.version)
        application = "" if server is None else server.application
        return Identity(
            "cameras",
            f"cameras at {self._settings.server}",
            f"{application}, NatNet {version}" if application else "",
            {"server": application, "natnet": version},
        )

    @property
    def clock(self) -> str:
        """Frames before 3.0 do not say when they were taken."""
        version = self.client.version
        old = version is not None and version < OLDEST_WITH_CLOCK
        return f"not told by NatNet {version}" if old else ""

    def next(self, timeout: float, *, fresh: bool) -> Sighting | None:
        """Return the newest frame not returned before; one that repeats the last bit for bit is none.

        Cameras have noise: a frame that equals the one before was not taken anew.
        """
        end = time.monotonic() + timeout
        with device_errors(f"cameras at {self._settings.server}"):
            waiting = self._unseen()
            frame = waiting if waiting is not None and not fresh else self._awaited(end) or waiting
            while frame is not None and not self._is_new(frame):
                frame = self._awaited(end)
        return None if frame is None else self._mapped(frame)

    def _unseen(self) -> MarkerFrame | None:
        """Return the newest frame if it was not looked at before."""
        newest, last = self.client.newest(), self._last
        return None if newest is None or (last and newest.sequence <= last.sequence) else newest

    def _awaited(self, end: float) -> MarkerFrame | None:
        return self.client.wait_next(self.client.newest(), max(0.0, end - time.monotonic()))

    def _is_new(self, frame: MarkerFrame) -> bool:
        bits = frame.data.markers["position"].tobytes() + frame.data.unlabelled.tobytes()
        new, self._last, self._bits = bits != self._bits or not bits, frame, bits
        return new

    def _check_labels(self) -> None:
        if not any(marker.label for marker in self._mounting.markers):
            return
        # A server that tells anew what it tracks has forgotten it for a moment: no reason to go without the check.
        models = self.client.wait_models()
        try:
            self._map.resolve(models)
        except MarkerMapError as error:
            raise InputError(f"the rig file names markers in vain: {error}", hint=error.hint) from error

    def _mapped(self, frame: MarkerFrame) -> Sighting:
        return self._mounting.sighting(self._map.locate(frame), frame.taken_at, self._raw(frame))

    def _raw(self, frame: MarkerFrame) -> RawFrame:
        markers = frame.data.markers if self._settings.log_raw else frame.data.markers[:0]
        return RawFrame(
            number=frame.number,
            session=frame.session,
            delay=frame.arrival - frame.taken_at,
            ids=markers["id"].astype(np.int32),
            positions=np.ascontiguousarray(markers["position"], dtype=np.float32),
            flags=markers["params"].astype(np.int32),
        )

    def status(self) -> CameraStatus:
        """Return what the client has counted."""
        counts, newest = self.client.statistics(), self.client.newest()
        markers = 0 if newest is None else len(newest.data.markers)
        return CameraStatus(counts.lost, counts.malformed, counts.impossible, markers)

    def checks(self, seen: Sequence[Sighting]) -> Iterator[Finding]:
        """Yield whether somebody else sends frames, too."""
        del seen
        counts = self.client.statistics()
        if counts.strangers:
            text = f"frames of a second source: {counts.strangers}; {counts.last_problem}"
            yield Finding("source", text, ArmingRefusedError.exit_code)

    def close(self) -> None:
        """End the connection; a frame that nobody has asked for is gone with it."""
        self.client.close()
        with suppress(HardwareError):
            self._last = self.client.newest() or self._last


def _marker_map(cameras: CameraSettings, mounting: Mounting) -> MarkerMap:
    residual, widest = cameras.max_residual_mm, cameras.jump_gate_mm / 1e3
    gate = Gate(smallest_m=min(Gate().smallest_m, widest), largest_m=widest)
    return MarkerMap(
        mounting.markers,
        mounting.rest,
        mounting.transform,
        gate=gate if mounting.gated else Gate(np.inf, np.inf, np.inf),
        max_residual_m=np.inf if residual is None else residual / 1e3,
    )
