"""What flows round the loop: frozen records, SI units, world frame, time-stamped.

trajectory -> Reference --+
plant -> Measurement -> estimator -> Estimate -> controller -> Command -> plant
                                      every record of one step -> StepRecord -> log
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

Array: TypeAlias = NDArray[np.float64]


def _not_told() -> Array:
    return np.zeros(0)


@dataclass(frozen=True, slots=True)
class Reference:
    """Target of the end ring now and at the prediction instants.

    Attributes:
        t: Time of this step [s].
        position: End position wanted at ``t`` (3,) [m].
        normal: End normal wanted at ``t`` (3,), or None for position-only tracking.
        ahead_position: End positions wanted at the controller's prediction instants (n, 3) [m].
        ahead_normal: End normals wanted there (n, 3), or None.
        drive: Drive lengths wanted at the first prediction instant (m,) [m]; None unless the trajectory gives them.
    """

    t: float
    position: Array
    normal: Array | None
    ahead_position: Array
    ahead_normal: Array | None
    drive: Array | None = None


@dataclass(frozen=True, slots=True)
class RawFrame:
    """Markers of one camera frame as they came, before they were mapped to the robot; none if the rig says so.

    Attributes:
        number: Frame number of the camera system.
        session: Times that the camera system was restarted before.
        delay: Time from the middle of the exposure to the arrival here [s].
        ids: Numbers by which the camera system tells markers apart (n,) int32; empty if it has none.
        positions: Marker positions in the frame of the cameras (n, 3) float32, in their unit of length.
        flags: What it says of each marker, in bits of its own (n,) int32; empty if nothing.
        names: Names of the markers, one a line; None if it has only numbers.
    """

    number: int
    session: int
    delay: float
    ids: NDArray[np.int32]
    positions: NDArray[np.float32]
    flags: NDArray[np.int32]
    names: str | None = None


@dataclass(frozen=True, slots=True)
class Measurement:
    """What the cameras and the drives report.

    Attributes:
        t: Instant at which the nodes were where they are reported [s].
        nodes: Ring node positions (n_markers, 3), single precision as cameras deliver them [m].
        valid: Which markers were seen (n_markers,) bool.
        drive: Drive lengths reported by the actuators (m,) [m].
        raw: The camera frame it came from; None in simulation, and if no frame came in time.
    """

    t: float
    nodes: NDArray[np.float32]
    valid: NDArray[np.bool_]
    drive: Array
    raw: RawFrame | None = None


@dataclass(frozen=True, slots=True)
class Estimate:
    """State of the robot model after one estimator update.

    Attributes:
        t: Time the state refers to [s].
        q: Node positions (3 n_nodes,) [m].
        v: Node velocities (3 n_nodes,) [m/s].
        drive: Drive lengths that the cables have now (m,) [m].
        tension: Cable tensions of the model (m,) [N].
        position: End position (3,) [m].
        normal: End normal (3,).
        disturbance: Force that the model lacks, per node coordinate (3 n_nodes,) [N].
        converged: False if the estimator's own solve failed and the state was extrapolated.
        set_point: Drive lengths that were sent last (m,) [m]; a log does not tell.
        arrived: Those sent a dead time of the drives ago (m,) [m]; a log does not tell.
        lag: Time constant of the drives, as far as it is known [s]; a log does not tell.
    """

    t: float
    q: Array
    v: Array
    drive: Array
    tension: Array
    position: Array
    normal: Array
    disturbance: Array
    converged: bool
    set_point: Array = field(default_factory=_not_told)
    arrived: Array = field(default_factory=_not_told)
    lag: float = 0.0


@dataclass(frozen=True, slots=True)
class Command:
    """What is asked of the actuators for one control period.

    Attributes:
        speed: Drive speeds u (m,) [m/s].
        drive: Drive lengths to be reached at the end of the period (m,) [m].
    """

    speed: Array
    drive: Array


@dataclass(frozen=True, slots=True)
class ControlInfo:
    """How the controller came to its command.

    Attributes:
        converged: The inner problem was solved within its tolerance; otherwise the last safe command is held.
        iterations: Iterations of the inner problem.
        residual: Its residual at the end [N].
        lcp_residual: Complementarity residual of the LCP solution.
        lcp_pivots: Pivots of Lemke's algorithm.
        saturated: Which inputs stand at a speed limit (m,) bool.
        predicted_tension: Tensions at the end of the horizon (m,) [N].
        integral: State of the integral action (3,) or (6,) [m], [1].
        reason: Empty, or why the step was not usable.
    """

    converged: bool
    iterations: int
    residual: float
    lcp_residual: float
    lcp_pivots: int
    saturated: NDArray[np.bool_]
    predicted_tension: Array
    integral: Array
    reason: str = ""


@dataclass(frozen=True, slots=True)
class Truth:
    """What only a simulated plant knows about itself.

    Attributes:
        position: End position (3,) [m].
        normal: End normal (3,).
        tension: Cable tensions (m,) [N].
        q: Node positions (3 n_nodes,) [m].
    """

    position: Array
    normal: Array
    tension: Array
    q: Array


@dataclass(frozen=True, slots=True)
class Timing:
    """Wall-clock durations of the sections of one tick [s].

    Attributes:
        read: Waiting for and reading the plant.
        estimate: Estimator.
        control: Controller.
        write: Sending the command (simulated plant: advancing it).
        lateness: How late the tick began after its deadline; 0 when not paced.
    """

    read: float
    estimate: float
    control: float
    write: float
    lateness: float


@dataclass(frozen=True, slots=True)
class Checksums:
    """32-bit digests that stand for what a log leaves out, and that betray what was changed in it.

    Attributes:
        given: Of measurement and reference.
        state: Of the full state: positions, velocities and disturbance of the estimate, and inner variables of the
            controller.
    """

    given: int
    state: int


@dataclass(frozen=True, slots=True)
class StepRecord:
    """Everything that entered or left the controller in one step.

    Attributes:
        k: Step index.
        t: Time of the step [s].
        period: Control period the controller used [s].
        wanted: Command before limits.
        applied: Command after limits: what was really sent.
        truth: Simulated truth, or None on a rig.
        checksums: Added by the log; None before.
    """

    k: int
    t: float
    period: float
    reference: Reference
    measurement: Measurement
    estimate: Estimate
    wanted: Command
    applied: Command
    info: ControlInfo
    truth: Truth | None
    timing: Timing
    checksums: Checksums | None = None
