"""What shall go wrong with an emulated bench, and when: a YAML file, checked before anything starts.

faults:
  - {at_s: 2, after: moving, cameras: {loss: 0.1}, for_s: 5}
  - {at_s: 8, after: moving, plc: estop, for_s: 1}
  - {at_s: 12, plc: exception, with: {code: 4}, robot: tcr700}
  - {at_s: 15, cameras: {version: '3.1'}}

Cameras can also ``restart`` (once), stream another ``version``, and be ``renamed``: all markers get names that
nobody knows.
"""

from __future__ import annotations

import dataclasses
import re
from collections.abc import Callable, Collection, Iterator, Mapping
from pathlib import Path
from typing import Any, Literal

from pydantic import Field, model_validator

from tcr_hardware.emulators.motive import MotiveEmulator
from tcr_hardware.emulators.motive_faults import MotiveFaults
from tcr_hardware.emulators.plc import PlcEmulator
from tcr_hardware.emulators.plc_faults import FAULTS
from tcr_hardware.modbus.registers import Status
from tcrctl.config import strict_yaml
from tcrctl.config.keys import Finding, Keys
from tcrctl.config.settings import Settings, quantity, refuse

_DEFAULTS = MotiveFaults()
_CHANGES = {"version": "", "renamed": False}
CAMERA_FAULTS = (*(field.name for field in dataclasses.fields(MotiveFaults)), *_CHANGES)
#: Camera faults that are shares of all frames.
SHARES = ("loss", "duplicate", "corrupt", "truncate", "wrong_size", "second_source")
#: Camera faults that name markers.
MARKERS = ("occluded", "missing", "nan", "swap")
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
    plc: str | None = Field(default=None, description=f"what is wrong with the PLC: {', '.join(FAULTS)}")
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
        elif wrong := _wrong_value(name, value):
            yield ("cameras", name), wrong
    if fault.plc is not None and fault.plc not in FAULTS:
        yield ("plc",), f"there is no fault {fault.plc}; known: {', '.join(FAULTS)}"
    elif fault.plc is not None:
        for name in fault.with_:
            if name not in FAULTS[fault.plc].arguments:
                known = ", ".join(FAULTS[fault.plc].arguments) or "none"
                yield ("with", name), f"{fault.plc} has no such argument; known: {known}"


def _wrong_value(name: str, value: Any) -> str:
    """Say what is wrong with the value of a camera fault; empty if nothing is."""
    try:
        taken = camera_value(name, value)
    except (TypeError, ValueError) as error:
        return str(error)
    if name in SHARES and not 0 <= taken <= 1:
        return f"must be a share of the frames, 0 to 1, not {value!r}"
    if name in ("delay_s", "reorder") and not 0 <= taken < float("inf"):
        return f"must be >= 0, not {value!r}"
    return ""


def camera_value(name: str, value: Any) -> Any:
    """Return a value from a file as the attribute of ``MotiveFaults`` wants it.

    Raises:
        ValueError: If it is not of that kind.
    """
    if name == "version" and isinstance(value, str) and re.fullmatch(r"[0-9]+\.[0-9]+", value):
        return value
    kind = type(_CHANGES[name] if name in _CHANGES else getattr(_DEFAULTS, name))
    if kind is frozenset and isinstance(value, list) and all(isinstance(item, str) for item in value):
        return frozenset(value)
    if name == "swap" and isinstance(value, list) and all(isinstance(v, list) and len(v) == 2 for v in value):
        return tuple((str(a), str(b)) for a, b in value)
    if name == "offset_m" and isinstance(value, list) and len(value) == 3:
        return tuple(float(item) for item in value)
    if (
        kind in (bool, int, float)
        and type(value) in (kind, int)
        and not (kind is bool and type(value) is int)
    ):
        return kind(value)
    names = {
        str: "text",
        frozenset: "a list of marker names",
        bool: "true or false",
        int: "a whole number",
        float: "a number",
    }
    special = {
        "version": "a version such as '3.1'",
        "swap": "a list of pairs of marker names",
        "offset_m": "three numbers",
    }
    raise ValueError(f"must be {special.get(name) or names[kind]}, not {value!r}")


class FaultScript(Settings):
    """Everything that goes wrong."""

    faults: tuple[Fault, ...] = Field(min_length=1)


def load_fault_script(
    path: Path, robots: Collection[str] | None = None, markers: Collection[str] | None = None
) -> FaultScript:
    """Read a fault script.

    Args:
        path: The file.
        robots: Robots that there are; None if any name may be given.
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
    fault: Fault, at: Keys, robots: Collection[str] | None, markers: Collection[str] | None
) -> Iterator[Finding]:
    """Return the names in a fault that nobody on the rig has."""
    if robots is not None and fault.robot is not None and fault.robot not in robots:
        yield (*at, "robot"), f"there is no robot {fault.robot} on the rig; there are {', '.join(robots)}"
    for key, value in fault.cameras.items() if isinstance(fault.cameras, dict) else ():
        if markers is None or key not in MARKERS:
            continue
        given = [name for pair in value for name in pair] if key == "swap" else value
        if unknown := [name for name in given if name not in markers]:
            some = ", ".join(list(markers)[:4])
            yield (*at, "cameras", key), f"there is no marker {', '.join(unknown)}; there are {some}, ..."


class FaultPlayer:
    """Lets the faults of a script happen."""

    def __init__(
        self,
        script: FaultScript,
        motive: MotiveEmulator,
        plcs: Mapping[str, PlcEmulator],
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
            for name, value in fault.cameras.items():
                self._change_cameras(name, camera_value(name, value))
        else:
            for plc in self._chosen(fault):
                plc.faults.set(str(fault.plc), **fault.with_)
        if fault.for_s is not None:
            self._active.append((now + fault.for_s, fault))

    def _clear(self, fault: Fault) -> None:
        self._notify(f"over: {fault}")
        if isinstance(fault.cameras, dict):
            for name in fault.cameras:
                self._change_cameras(name, getattr(_DEFAULTS, name, None))
        elif fault.plc is not None:
            for plc in self._chosen(fault):
                plc.faults.clear(fault.plc)

    def _change_cameras(self, name: str, value: Any) -> None:
        """Set a fault of the cameras, or take it back with its default."""
        if name == "version":
            self._motive.change_version(value or self._motive.settings.version)
        elif name == "renamed":
            self._motive.change_models([f"{known}?" if value else known for known in self._names])
        else:
            setattr(self._motive.faults, name, value)

    def _chosen(self, fault: Fault) -> list[PlcEmulator]:
        return [plc for name, plc in self._plcs.items() if fault.robot in (None, name)]


def _status(plc: PlcEmulator) -> Status:
    status = plc.snapshot()["status"]
    return status if isinstance(status, Status) else Status(0)
