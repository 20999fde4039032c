"""What a rig file may say: the facts of one bench, units in the key names; nothing of experiments."""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Annotated, ClassVar, Literal, TypeAlias

from pydantic import Field, model_validator

from tcrctl.config.keys import Finding
from tcrctl.config.settings import Settings, quantity, refuse
from tcrctl.plant.settings import Rings
from tcrctl.robot.sections import Name, NodeName

Port: TypeAlias = Annotated[int, Field(ge=1, le=65535)]
Host: TypeAlias = Annotated[str, Field(min_length=1, description="host name or address")]


class CameraSection(Settings):
    """What every ``cameras:`` section can be asked, whatever its kind."""

    up_axis: Literal["y", "z"] = Field(
        default="y", description="axis of the cameras that points up; only for rig calibrate"
    )


class DriveSection(Settings):
    """What every ``plc:`` section can be asked, whatever moves the cables."""

    #: What ``tcrctl rig check`` calls drives that do not answer.
    called: ClassVar[str] = "drives"


class CameraSettings(CameraSection):
    """An OptiTrack system that streams over NatNet."""

    kind: Literal["natnet"]
    server: Host = Field(default="127.0.0.1", description="computer on which Motive runs")
    local: Host = Field(default="127.0.0.1", description="address of this computer in the cameras' network")
    transport: Literal["multicast", "unicast"] = Field(default="multicast", description="as set in Motive")
    command_port: Port = Field(default=1510, description="as set in Motive")
    data_port: Port | None = Field(default=None, description="as set in Motive; null: as the server says")
    multicast_group: str | None = Field(default=None, description="null: as the server says")
    bitstream: str | None = Field(
        default=None, pattern=r"^[0-9]+\.[0-9]+$", description="NatNet version to ask for (unicast only)"
    )
    allow_newer: bool = Field(default=False, description="decode versions newer than those that were tested")
    rate_hz: float | None = quantity("Hz", "frames per second; null: the server is asked", None, gt=0)
    jump_gate_mm: float = quantity(
        "mm", "a marker that has jumped further is not used; less than half the marker distance", 24.0, gt=0
    )
    log_raw: bool = Field(default=True, description="keep every marker of every frame used in the log")
    max_residual_mm: float | None = quantity("mm", "markers with a larger residual are not used", None, gt=0)


class MarkerEntry(Settings):
    """One marker and the node that it sits on; without label and member it is found by nearness."""

    node: NodeName
    label: str | None = Field(default=None, description="asset.marker as in Motive")
    asset: int | None = Field(default=None, ge=0, description="streaming id of the asset")
    member: int | None = Field(default=None, ge=0, description="number of the marker in it")

    @model_validator(mode="after")
    def _one_identity(self) -> MarkerEntry:
        if (self.asset is None) != (self.member is None):
            refuse([((), "asset and member belong together")])
        if self.label is not None and self.asset is not None:
            refuse([((), "give a label, or asset and member, not both")])
        return self


class MarkerSettings(Settings):
    """Which marker sits on which ring node."""

    labels: str | None = Field(
        default=None,
        description="label of the marker on every ring node, {ring} and {node} (1..3) stand for numbers",
    )
    rings: Rings = Field(default="all", description="rings whose three nodes carry markers named by labels")
    nodes: tuple[MarkerEntry, ...] = Field(default=(), description="markers one by one, beside or instead")
    base: str = Field(
        default="base.n{node}", description="labels of the markers on the base ring, for rig calibrate"
    )

    @model_validator(mode="after")
    def _says_something(self) -> MarkerSettings:
        if self.labels is None and not self.nodes:
            refuse([((), "must give labels, or nodes one by one")])
        for key, text in (("labels", self.labels), ("base", self.base)):
            try:
                (text or "").format(ring=1, node=1)
            except (KeyError, IndexError, ValueError):
                refuse([((key,), f"may contain {{ring}} and {{node}} in braces, nothing else: {text}")])
        return self


class Calibration(Settings):
    """Where the cameras' frame lies in the robot's: x_robot = rotation (scale x_camera) + translation."""

    quaternion_xyzw: tuple[float, float, float, float] = Field(
        default=(0.0, 0.0, 0.0, 1.0), description="rotation, a unit quaternion"
    )
    translation_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
    scale_m: float = quantity("m", "length of the cameras' unit; Motive streams metres", 1.0, gt=0)

    @model_validator(mode="after")
    def _unit_length(self) -> Calibration:
        length = math.sqrt(sum(x * x for x in self.quaternion_xyzw))
        if abs(length - 1.0) > 1e-3:
            refuse([(("quaternion_xyzw",), f"must have length 1, not {length:.4g}")])
        return self


class _Plc(DriveSection):
    called: ClassVar[str] = "PLC"

    unit: int = Field(default=1, ge=0, le=247, description="Modbus unit (slave) number")
    timeout_ms: float = quantity("ms", "how long an answer is waited for", 60.0, gt=0, le=1000)
    watchdog_ms: float = quantity(
        "ms",
        "silence after which the PLC stops by itself; a control period too long for it is refused",
        200.0,
        gt=0,
    )
    retries: int = Field(
        default=1, ge=0, le=3, description="an exchange without an answer is repeated so often"
    )
    exchange: Literal["auto", "fc23", "fc16_fc3"] = Field(default="auto", description="function codes used")
    word_order: Literal["auto", "high_first", "low_first"] = "high_first"
    byte_order: Literal["auto", "big", "little"] = "big"
    map: dict[str, dict[str, int | float | str]] = Field(
        default={}, description="registers that differ from the default map: {SP: {address: 40}}"
    )


class ModbusTcp(_Plc):
    """A PLC on Modbus TCP."""

    #: A request costs next to no time, so the status may be asked for in between.
    prompt: ClassVar[bool] = True

    kind: Literal["modbus_tcp"]
    host: Host
    port: Port = 502

    @property
    def place(self) -> str:
        """Where it is, for messages."""
        return f"{self.host}:{self.port}"


class ModbusRtu(_Plc):
    """A PLC on a serial line."""

    prompt: ClassVar[bool] = False

    kind: Literal["modbus_rtu"]
    device: str = Field(min_length=1, description="for instance /dev/ttyUSB0")
    baud: int = Field(default=115200, ge=1200)
    parity: Literal["N", "E", "O"] = "N"
    stop_bits: Literal[1, 2] = 1

    @property
    def place(self) -> str:
        """Where it is, for messages."""
        return self.device


class Dynamixel(DriveSection):
    """Dynamixel motors of the X series, one per cable; ``axis`` is the number of the motor (extra dynamixel)."""

    called: ClassVar[str] = "Dynamixel bus"

    kind: Literal["dynamixel"]
    device: str = Field(min_length=1, description="for instance /dev/ttyUSB0")
    baud: int = Field(default=1_000_000, ge=9600)
    timeout_ms: float = quantity("ms", "how long an answer is waited for", 20.0, gt=0, le=1000)
    mm_per_turn: float = quantity(
        "mm", "cable per turn of the drum; the whole stroke has to fit in a turn", gt=0
    )
    zero_tick: int = Field(default=1024, ge=0, le=4095, description="position of the motors at tension-zero")
    watchdog_ms: float = quantity(
        "ms", "time after which they stop by their bus watchdog, in steps of 28", 300.0, ge=28, le=3500
    )
    current_limit_ma: float | None = quantity(
        "mA", "largest current, in operating mode 5; null: mode 3, without", None, gt=0
    )
    current_unit_ma: float = quantity("mA", "unit of the model's goal current", 2.69, gt=0)

    @property
    def place(self) -> str:
        """Where they are, for messages."""
        return self.device


class CableDrive(Settings):
    """The drive of one cable."""

    axis: int = Field(ge=1, description="axis of the PLC, 1 is the first")
    sign: Literal[1, -1] = Field(default=1, description="-1 if the axis counts up when the cable is let out")
    min_mm: float = quantity("mm", "soft limit, cable let out; inside that of the PLC")
    max_mm: float = quantity("mm", "soft limit, cable pulled in; inside that of the PLC")
    speed_limit_mm_s: float = quantity("mm/s", "largest speed that is ever sent", 50.0, gt=0)


class Antagonists(Settings):
    """Cables round one segment, whose sum is limited: all pulled crush the robot, all released drop it."""

    cables: tuple[str, ...] = Field(min_length=2)
    min_sum_mm: float = quantity("mm", "smallest sum of their drive lengths")
    max_sum_mm: float = quantity("mm", "largest sum of their drive lengths")


class MountedRobot(Settings):
    """One robot on this bench: its drives, its markers, where it hangs."""

    plc: Annotated[ModbusTcp | ModbusRtu | Dynamixel, Field(discriminator="kind")]
    cables: dict[str, CableDrive] = Field(
        min_length=1, description="drive of every cable of the robot, by name"
    )
    antagonists: tuple[Antagonists, ...] = ()
    markers: MarkerSettings
    calibration: Calibration = Calibration()

    @model_validator(mode="after")
    def _agrees(self) -> MountedRobot:
        refuse(_contradictions(self))
        return self


def _contradictions(robot: MountedRobot) -> Iterator[Finding]:
    axes: dict[int, str] = {}
    for name, cable in robot.cables.items():
        if not cable.min_mm < cable.max_mm:
            yield ("cables", name, "max_mm"), f"must be greater than min_mm, {cable.min_mm:g}"
        if cable.axis in axes:
            yield ("cables", name, "axis"), f"axis {cable.axis} already drives cable {axes[cable.axis]}"
        axes[cable.axis] = name
    for i, group in enumerate(robot.antagonists):
        for j, name in enumerate(group.cables):
            if name not in robot.cables:
                known = ", ".join(robot.cables)
                yield ("antagonists", i, "cables", j), f"there is no cable {name}; known: {known}"
        if not group.min_sum_mm < group.max_sum_mm:
            yield ("antagonists", i, "max_sum_mm"), f"must be greater than min_sum_mm, {group.min_sum_mm:g}"


class SafetyRules(Settings):
    """When the supervisor holds or stops the drives."""

    stale_after_ms: float = quantity(
        "ms", "age of the measurement from which the drives are held", 50.0, gt=0
    )
    stale_stop_ms: float = quantity("ms", "age from which the run is stopped", 200.0, gt=0)
    min_seen_fraction: float = quantity(
        "1", "share of the mapped markers that a usable measurement must show", 0.3, gt=0, le=1
    )
    silence_stop_ms: float = quantity(
        "ms", "time without an answer of the PLC after which the run is stopped", 100.0, gt=0
    )
    max_rejects: int = Field(default=3, ge=1, description="refused set-points in a row that stop the run")
    following_mm: float = quantity("mm", "largest distance of a drive from its set-point", 6.0, gt=0)
    max_step_mm: float = quantity("mm", "most that a set-point changes from one write to the next", 3.0, gt=0)
    acceleration_limit_mm_s2: float | None = quantity(
        "mm/s2", "largest change of speed; null: not limited", None, gt=0
    )
    standstill_s: float = quantity("s", "time in which a controlled stop must end", 2.0, gt=0)
    arm_timeout_s: float = quantity("s", "time in which the drives must be on", 3.0, gt=0)

    @model_validator(mode="after")
    def _ordered(self) -> SafetyRules:
        if not self.stale_after_ms < self.stale_stop_ms:
            refuse([(("stale_stop_ms",), f"must be greater than stale_after_ms, {self.stale_after_ms:g}")])
        return self


class RigFile(Settings):
    """One bench: cameras, and the robots that hang there."""

    name: Name
    description: str = Field(default="", description="one line for listings")
    cameras: CameraSettings
    robots: dict[Name, MountedRobot] = Field(min_length=1, description="by the name of the robot")
    safety: SafetyRules = SafetyRules()
    fifo_priority: int | None = Field(
        default=None, ge=1, le=99, description="SCHED_FIFO priority of the control thread; null: normal"
    )
