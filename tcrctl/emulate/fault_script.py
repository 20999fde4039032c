"""What shall go wrong with an emulated bench, and when: a YAML file, checked before anything starts.

faults:
  - {at_s: 2, after: moving, cameras: {loss: 0.1}, for_s: 5}
  - {at_s: 8, after: moving, plc: estop, for_s: 1}
  - {at_s: 12, plc: exception, with: {code: 4}, robot: tcr700}
  - {at_s: 15, cameras: {version: '3.1'}}

The picture can be wrong while every frame is right: a frame ``turned_deg``, ``turning_deg_s`` or ``mirrored``
about a ``pivot``, labels that have moved on within a body (``moved_labels``) or are ``exchanged`` between two, and
markers or bodies that are ``drifting``:

  - {at_s: 0, cameras: {turned_deg: [0, 20, 0], pivot: tcr600_base}}
  - {at_s: 5, after: moving, cameras: {drifting: [tcr600_m11], drift_mm_s: [0.5, 0, 0]}}

Cameras can also ``restart`` (once), stream another ``version``, and be ``renamed``: all markers get names that
nobody knows.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from tcr_hardware.emulators.motive import MotiveEmulator
from tcr_hardware.emulators.plc_faults import wrong_argument
from tcr_hardware.modbus.registers import Status
from tcrctl.config import strict_yaml
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.settings import Settings, quantity, refuse
from tcrctl.emulate.camera_faults import (
    CAMERA_FAULTS,
    CHANGES,
    DEFAULTS,
    camera_value,
    known_names,
    names_in,
    wrong_value,
)
from tcrctl.emulate.drive_faults import ARGUMENTS, Drives
from tcrctl.emulate.line import EmulatedDrives

#: A drive that moves faster than this between two looks is moving [um].
MOVING_UM = 30.0


class Fault(Settings):
    """One thing that goes wrong."""

    at_s: float = quantity("s", "when, after the event that ``after`` names", ge=0)
    after: Literal["start", "enabled", "moving"] = Field(
        default="start", description="start of the emulator, drives switched on, or first motion of a drive"
    )
    for_s: float | None = quantity("s", "how long; null: for good", None, gt=0)
    cameras: dict[str, Any] | Literal["restart"] | None = Field(
        default=None, description=f"what is wrong with the cameras: restart, or {', '.join(CAMERA_FAULTS)}"
    )
    plc: str | None = Field(default=None, description=f"what is wrong with the PLC: {', '.join(ARGUMENTS)}")
    with_: dict[str, float] = Field(default={}, alias="with", description="arguments of a fault of the PLC")
    robot: str | None = Field(default=None, description="whose PLC; null: all")

    @model_validator(mode="after")
    def _known(self) -> Fault:
        refuse(_unknown(self))
        return self

    def __str__(self) -> str:
        what = f"cameras {self.cameras}" if self.cameras is not None else f"PLC {self.plc} {self.with_ or ''}"
        return what.strip()


def _unknown(fault: Fault) -> Iterator[Finding]:
    if (fault.cameras is None) == (fault.plc is None):
        yield (), "must say what is wrong: either cameras or plc"
    for name, value in fault.cameras.items() if isinstance(fault.cameras, dict) else ():
        if name not in CAMERA_FAULTS:
            yield ("cameras", name), f"there is no such fault; known: {', '.join(CAMERA_FAULTS)}"
        elif wrong := wrong_value(name, value):
            yield ("cameras", name), wrong
    if fault.plc is not None and fault.plc not in ARGUMENTS:
        yield ("plc",), f"there is no fault {fault.plc}; known: {', '.join(ARGUMENTS)}"
    elif fault.plc is not None:
        yield from _wrong_arguments(fault.plc, fault.with_)
    elif fault.with_:
        yield ("with",), "cameras take no arguments besides their values"


def _wrong_arguments(fault: str, given: Mapping[str, float]) -> Iterator[Finding]:
    for name, value in given.items():
        if name not in ARGUMENTS[fault]:
            known = ", ".join(sorted(ARGUMENTS[fault])) or "none"
            yield ("with", name), f"{fault} has no such argument; known: {known}"
        elif wrong := wrong_argument(name, value):
            yield ("with", name), wrong


class FaultScript(Settings):
    """Everything that goes wrong."""

    faults: tuple[Fault, ...] = Field(min_length=1)


def load_fault_script(
    path: Path, robots: Mapping[str, Drives] | None = None, markers: Collection[str] | None = None
) -> FaultScript:
    """Read a fault script.

    Args:
        path: The file.
        robots: Robots that there are, and their drives; None if any name may be given.
        markers: Markers that there are, by Motive's names; None if any name may be given.

    Raises:
        SpecError: If the file has problems, or names a robot or marker that does not exist; all are listed.
        InputError: If it cannot be read.
    """
    document = strict_yaml.load(path)
    script = strict_yaml.validate(document, FaultScript)
    document.refuse(
        finding
        for i, fault in enumerate(script.faults)
        for finding in _strangers(fault, ("faults", i), robots, markers)
    )
    return script


def _strangers(
    fault: Fault, at: Keys, robots: Mapping[str, Drives] | None, markers: Collection[str] | None
) -> Iterator[Finding]:
    """Return what is named in a fault and nobody on the rig has."""
    if robots is not None and fault.robot is not None and fault.robot not in robots:
        yield (*at, "robot"), f"there is no robot {fault.robot} on the rig; there are {', '.join(robots)}"
    for name, drives in (robots or {}).items():
        if fault.plc is not None and fault.robot in (None, name):
            found = drives.wrong(fault.plc, fault.with_)
            yield from (((*at, *key), f"the drives of {name} {what}") for key, what in found)
    for key, value in fault.cameras.items() if isinstance(fault.cameras, dict) else ():
        known = known_names(key, markers or ())
        if markers is None or not known:
            continue
        if unknown := [name for name in names_in(value) if name not in known]:
            what = "marker" if known[0] in markers else "body"
            some = ", ".join(known[:4])
            yield (*at, "cameras", key), f"there is no {what} {', '.join(unknown)}; there are {some}, ..."


class FaultPlayer:
    """Lets the faults of a script happen."""

    def __init__(
        self,
        script: FaultScript,
        motive: MotiveEmulator,
        plcs: Mapping[str, EmulatedDrives],
        notify: Callable[[str], None],
    ) -> None:
        """Take a script; ``notify`` takes what happens, for people."""
        self._motive = motive
        self._plcs = plcs
        self._notify = notify
        self._names = motive.tracked.names
        self._waiting = list(script.faults)
        self._active: list[tuple[float, Fault]] = []
        self._since: dict[str, float] = {"start": 0.0}
        self._rest = {name: plc.positions_um() for name, plc in plcs.items()}

    def play(self, now: float) -> None:
        """Let happen what is due ``now`` [s after the start]."""
        self._look(now)
        for fault in list(self._waiting):
            begun = self._since.get(fault.after)
            if begun is not None and now >= begun + fault.at_s:
                self._waiting.remove(fault)
                self._set(fault, now)
        for end, fault in list(self._active):
            if now >= end:
                self._active.remove((end, fault))
                self._clear(fault)

    def _look(self, now: float) -> None:
        if len(self._since) == 3:
            return
        for name, plc in self._plcs.items():
            if "enabled" not in self._since and Status.ENABLED in _status(plc):
                self._since["enabled"] = now
            moved = max(abs(a - b) for a, b in zip(plc.positions_um(), self._rest[name], strict=True))
            if "moving" not in self._since and moved > MOVING_UM:
                self._since["moving"] = now

    def _set(self, fault: Fault, now: float) -> None:
        self._notify(f"{now:8.3f} s: fault: {fault}")
        if fault.cameras == "restart":
            self._motive.restart()
        elif isinstance(fault.cameras, dict):
            self._change_cameras({name: camera_value(name, value) for name, value in fault.cameras.items()})
        else:
            for plc in self._chosen(fault):
                plc.faults.set(str(fault.plc), **fault.with_)
        if fault.for_s is not None:
            self._active.append((now + fault.for_s, fault))

    def _clear(self, fault: Fault) -> None:
        self._notify(f"over: {fault}")
        if isinstance(fault.cameras, dict):
            self._change_cameras({name: getattr(DEFAULTS, name, None) for name in fault.cameras})
        elif fault.plc is not None:
            for plc in self._chosen(fault):
                plc.faults.clear(fault.plc)

    def _change_cameras(self, faults: Mapping[str, Any]) -> None:
        """Set faults of the cameras, all in the same frame, or take them back with their defaults."""
        motive = self._motive
        if "version" in faults:
            motive.change_version(faults["version"] or motive.settings.version)
        if "renamed" in faults:
            motive.change_models([f"{known}?" if faults["renamed"] else known for known in self._names])
        others = {name: value for name, value in faults.items() if name not in CHANGES}
        motive.faults = dataclasses.replace(motive.faults, **others)

    def _chosen(self, fault: Fault) -> list[EmulatedDrives]:
        return [plc for name, plc in self._plcs.items() if fault.robot in (None, name)]


def _status(plc: EmulatedDrives) -> Status:
    status = plc.snapshot()["status"]
    return status if isinstance(status, Status) else Status(0)
