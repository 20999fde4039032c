"""The whole bench without a bench: Motive server and PLCs as a rig file describes them, round simulated robots.

    rig file -> one PLC per robot --servo positions--> simulated robots --ring nodes, noise--> Motive server
                        ^ set-points                                                              | frames
                        +------------------------------- tcrctl run --------- <-------------------+

The emulators speak the real protocols on real sockets; a run cannot tell them from the devices, apart from
the numbers.
"""

from __future__ import annotations

import errno
import time
from collections.abc import Callable
from contextlib import ExitStack
from types import TracebackType
from typing import Any, Final, Self

import numpy as np

from tcr_hardware.emulators.motive import MotiveEmulator
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcr_hardware.emulators.plc import PlcEmulator
from tcr_hardware.errors import HardwareError
from tcr_hardware.rigid_transform import RigidTransform
from tcrctl.emulate.drives import emulated_drives
from tcrctl.emulate.fault_script import FaultPlayer, FaultScript
from tcrctl.emulate.imperfections import Imperfections
from tcrctl.emulate.line import EmulatedDrives, open_line
from tcrctl.emulate.robot import EmulatedRobot
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.mounting import transform
from tcrctl.plant.rig.settings import MountedRobot, RigFile
from tcrctl.plugins.plugin import plugin_of
from tcrctl.robot.description import load_robot
from tcrctl.robot.robot import Robot, build_robot
from tcrctl.signals import Array

#: How often the fault script looks at the time, and the main thread at the signals [s].
TICK: Final = 0.005
#: What to do if the port of the cameras cannot be had.
HINTS: Final = {
    errno.EADDRINUSE: "Is another tcrctl emulate running?",
    errno.EACCES: "Ports below 1024 need privileges.",
}


class EmulatedBench:
    """Emulators of one rig file; a context manager.

    Attributes:
        motive: The camera system.
        plcs: The PLC of every robot.
        robots: The simulated robots.
    """

    def __init__(
        self, rig: RigFile, settings: EmulationSettings, robots: dict[str, Robot] | None = None
    ) -> None:
        """Build everything; nothing is opened yet.

        Args:
            rig: The bench.
            settings: Its imperfections.
            robots: Robots by name where they are built already.

        Raises:
            InputError: If the rig file cannot be emulated.
            DeviceError: If the port of the cameras is taken.
        """
        self._rig = rig
        self._settings = settings
        _refuse_others(rig)
        built = robots or {}
        self._random = np.random.default_rng(settings.seed)
        self._failure: Exception | None = None
        self.plcs: dict[str, EmulatedDrives] = {}
        self.robots: dict[str, EmulatedRobot] = {}
        self._real: dict[str, Imperfections] = {}
        self._back: dict[str, RigidTransform] = {}
        names: list[str] = []
        for name, mounted in rig.robots.items():
            robot = built[name] if name in built else build_robot(load_robot(name))
            real = Imperfections(name, robot, settings.mismatch, settings.realistic, settings.seed)
            self.plcs[name] = emulated_drives(mounted, settings, real)
            self.robots[name] = self._moved(name, mounted, real)
            self._real[name] = real
            self._back[name] = transform(mounted.calibration)
            names += _labels(mounted, robot.n_modules)
        try:
            self.motive = MotiveEmulator(names, self._markers, _motive_settings(rig, settings))
            self.motive.faults.loss = max(real.lost_frames for real in self._real.values())
        except OSError as error:
            where = f"{rig.cameras.server}:{rig.cameras.command_port}"
            hint = HINTS.get(error.errno or 0, "Only addresses of this computer can be emulated.")
            raise DeviceError(
                f"cameras cannot be emulated at {where}: {error.strerror}", hint=hint
            ) from error
        self._opened = ExitStack()

    def _moved(self, name: str, mounted: MountedRobot, real: Imperfections) -> EmulatedRobot:
        plc = self.plcs[name]
        cables = [mounted.cables[cable] for cable in real.robot.cable_names]
        axes = len(plc.positions_um())

        def drives() -> list[float]:
            positions = plc.positions_um()
            return [1e-6 * cable.sign * positions[cable.axis - 1] for cable in cables]

        def tensions(newtons: Any) -> None:
            felt = [0.0] * axes
            for cable, newton in zip(cables, newtons, strict=True):
                felt[cable.axis - 1] = newton
            plc.set_tensions(felt)

        return EmulatedRobot(real.robot, real.plant, drives, tensions)

    def _markers(self) -> Array:
        """Return all markers in the frame of the cameras (n, 3) [m]."""
        try:
            exact = np.concatenate([self._seen(name) for name in self.robots])
        except Exception as error:
            self._failure = error
            raise
        noisy = exact + self._settings.noise * self._random.standard_normal(exact.shape)
        lost = max(real.lost_markers for real in self._real.values())
        if lost:
            noisy[self._random.random(len(noisy)) < lost] = np.nan
        return np.asarray(noisy)

    def _seen(self, name: str) -> Array:
        """Return the markers of one robot in the frame of the cameras (3 + 3 n_modules, 3) [m]."""
        return self._back[name].inverse_apply(self._real[name].markers(self.robots[name].rings()))

    def __enter__(self) -> Self:
        """Open all ports.

        Raises:
            DeviceError: If a port is taken.
        """
        try:
            for name, plc in self.plcs.items():
                open_line(plc, self._rig.robots[name].plc, self._opened)
            self.motive.start()
            self._opened.callback(self.motive.stop)
        except BaseException as error:
            self._opened.close()
            self.motive.stop()  # its port is taken since it was built
            if isinstance(error, HardwareError | OSError):
                hint = getattr(error, "hint", "")
                raise DeviceError(f"the bench cannot be emulated: {error}", hint=hint) from error
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close them."""
        self._opened.close()

    @property
    def places(self) -> dict[str, str]:
        """Where the PLC of every robot is found."""
        found = {}
        for name, mounted in self._rig.robots.items():
            plc = self.plcs[name]
            host, port = plc.address if isinstance(plc, PlcEmulator) else ("", 0)
            found[name] = f"{host}:{port}" if port else mounted.plc.place
        return found

    def check(self) -> None:
        """Do nothing, unless a simulation broke down.

        Raises:
            DivergenceError: If one did.
        """
        if self._failure is not None:
            raise self._failure

    def as_json(self) -> dict[str, Any]:
        """Say what the bench is doing, for ``tcrctl emulate --json``."""
        return {
            "rig": self._rig.name,
            "cameras": {"frames": self.motive.frames_sent, "clients": self.motive.clients},
            "robots": {
                name: {
                    "positions_mm": [round(1e-3 * um, 4) for um in self.plcs[name].positions_um()],
                    "status": str(self.plcs[name].snapshot()["status"]),
                    "slipped_s": round(robot.slipped, 3),
                }
                for name, robot in self.robots.items()
            },
        }


def emulate(
    bench: EmulatedBench,
    script: FaultScript | None,
    stop: Callable[[], bool],
    notify: Callable[[str], None],
) -> None:
    """Keep an opened bench going until it shall stop, and let its faults happen.

    Args:
        bench: The bench.
        script: What shall go wrong and when.
        stop: Whether to stop.
        notify: Takes what happens, for people.

    Raises:
        DivergenceError: If a simulation broke down.
    """
    player = FaultPlayer(script, bench.motive, bench.plcs, notify) if script else None
    begun = time.monotonic()
    while not stop():
        if player is not None:
            player.play(time.monotonic() - begun)
        bench.check()
        time.sleep(TICK)


def _refuse_others(rig: RigFile) -> None:
    """Refuse devices of other kinds."""
    hint = "Emulate them by a program of your own; the other devices need a rig file with shipped kinds."
    if plugin_of(rig.cameras) is not None:
        raise InputError(
            f"only NatNet cameras are emulated from a rig file, not {rig.cameras.kind}", hint=hint
        )
    for mounted in rig.robots.values():
        if plugin_of(mounted.plc) is not None:
            raise InputError(f"only shipped kinds of drives are emulated, not {mounted.plc.kind}", hint=hint)


def marker_names(rig: RigFile) -> list[str]:
    """Return the names of all markers on a rig, as Motive streams them.

    Args:
        rig: The bench.

    Raises:
        InputError: If the rig file does not say them.
    """
    return [
        label
        for name, mounted in rig.robots.items()
        for label in _labels(mounted, load_robot(name).modules.count)
    ]


def _labels(mounted: MountedRobot, modules: int) -> list[str]:
    """Return the names of all markers of a robot: base ring, then ring by ring."""
    markers = mounted.markers
    if markers.labels is None:
        raise InputError("markers.labels is needed to emulate a rig; markers.nodes alone is not enough")
    base = [markers.base.format(node=node) for node in (1, 2, 3)]
    rings = range(1, modules + 1)
    return base + [markers.labels.format(ring=ring, node=node) for ring in rings for node in (1, 2, 3)]


def _motive_settings(rig: RigFile, settings: EmulationSettings) -> MotiveSettings:
    cameras = rig.cameras
    return MotiveSettings(
        host=cameras.server,
        command_port=cameras.command_port,
        data_port=cameras.data_port or 1511,
        multicast=cameras.transport == "multicast",
        group=cameras.multicast_group or MotiveSettings().group,
        unicast_to=settings.unicast_to,
        version=settings.version,
        rate_hz=settings.rate,
        seed=settings.seed,
    )
