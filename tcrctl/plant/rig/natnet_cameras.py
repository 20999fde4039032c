"""OptiTrack cameras as the rig plant wants them: markers of a NatNet stream on the nodes of the robot."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray

from tcr_hardware.errors import HardwareError
from tcr_hardware.markers import Gate, MarkerMap, MarkerMapError, NodeMarker
from tcr_hardware.natnet.client import NatNetClient
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.settings import NatNetSettings
from tcr_hardware.rigid_transform import RigidTransform
from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.devices import Sighting
from tcrctl.plant.rig.loopback import emulate_hint
from tcrctl.plant.rig.settings import Calibration, CameraSettings, MarkerSettings
from tcrctl.robot.module import node_index, ring_rows
from tcrctl.robot.robot import Robot
from tcrctl.signals import RawFrame


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


def transform(calibration: Calibration) -> RigidTransform:
    """Return the way from the cameras' frame to that of the robot."""
    return RigidTransform.from_dict(calibration.model_dump())


def node_markers(markers: MarkerSettings, n_modules: int) -> list[NodeMarker]:
    """Return which marker sits on which ring node, in the order of the nodes.

    Args:
        markers: Section of the rig file.
        n_modules: Number of free modules.
    """
    rings = range(1, n_modules + 1) if markers.rings == "all" else markers.rings
    found: dict[str, NodeMarker] = {}
    if markers.labels is not None:
        for ring in rings:
            for node in (1, 2, 3):
                name = f"m{ring}.n{node}"
                found[name] = NodeMarker(name, label=markers.labels.format(ring=ring, node=node))
    for entry in markers.nodes:
        found[entry.node] = NodeMarker(entry.node, entry.label, entry.asset, entry.member)
    return [found[name] for name in sorted(found, key=node_index)]


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
        mapped: Number of nodes that carry a marker.
    """

    def __init__(
        self, cameras: CameraSettings, markers: MarkerSettings, calibration: Calibration, robot: Robot
    ) -> None:
        """Connect.

        Raises:
            DeviceError: If the camera system does not answer.
            InputError: If a label is not known there.
        """
        self.client = connect(cameras)
        self._settings = cameras
        self._last = None
        self._bits = b""
        try:
            with device_errors(f"cameras at {cameras.server}"):
                self.rate = cameras.rate_hz or self.client.frame_rate()
                self._map, self._rows = _marker_map(cameras, markers, calibration, robot)
                self._check_labels()
            self._n_nodes = len(ring_rows(robot.n_modules))
        except BaseException:
            self.client.close()
            raise
        self.mapped = len(self._rows)

    _last: MarkerFrame | None

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
        # A server that tells anew what it tracks has forgotten it for a moment: no reason to go without the check.
        models = self.client.wait_models()
        try:
            self._map.resolve(models)
        except MarkerMapError as error:
            raise InputError(f"the rig file names markers in vain: {error}", hint=error.hint) from error

    def _mapped(self, frame: MarkerFrame) -> Sighting:
        located = self._map.locate(frame)
        nodes = np.zeros((self._n_nodes, 3), np.float32)
        valid = np.zeros(self._n_nodes, np.bool_)
        nodes[self._rows[located.valid]] = located.positions[located.valid]
        valid[self._rows] = located.valid
        doubts = Counter(reason for reason in located.reasons if reason)
        text = ", ".join(f"{count} {reason}" for reason, count in sorted(doubts.items()))
        return Sighting(frame.taken_at, nodes, valid, text, self._raw(frame))

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

    def close(self) -> None:
        """End the connection."""
        self.client.close()


def _marker_map(
    cameras: CameraSettings, markers: MarkerSettings, calibration: Calibration, robot: Robot
) -> tuple[MarkerMap, NDArray[np.int64]]:
    """Return the map, and for each of its markers the row in ``Measurement.nodes``."""
    wanted = node_markers(markers, robot.n_modules)
    row_of = {row: i for i, row in enumerate(ring_rows(robot.n_modules))}
    nodes = [node_index(marker.node) for marker in wanted]
    residual, widest = cameras.max_residual_mm, cameras.jump_gate_mm / 1e3
    made = MarkerMap(
        wanted,
        robot.rest.q.reshape(-1, 3)[nodes],
        transform(calibration),
        gate=Gate(smallest_m=min(Gate().smallest_m, widest), largest_m=widest),
        max_residual_m=np.inf if residual is None else residual / 1e3,
    )
    return made, np.array([row_of[node] for node in nodes], dtype=np.int64)
