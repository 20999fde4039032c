"""From what a camera system sees to the nodes of the robot: every node in its row, or honestly not there."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.optimize import linear_sum_assignment  # type: ignore[attr-defined]

from tcr_hardware.errors import HardwareError
from tcr_hardware.natnet.frame import MODEL_FILLED, OCCLUDED, UNLABELLED, MocapFrame
from tcr_hardware.natnet.marker_frame import MarkerFrame
from tcr_hardware.natnet.models import ModelDefinitions
from tcr_hardware.rigid_transform import IDENTITY, Array, RigidTransform

#: No marker has it: numbers have 32 bits.
UNKNOWN_ID = -(1 << 40)
#: If more of the nodes than this share have jumped at once, those that lie where they were do so by chance.
MOST = 0.5


class MarkerMapError(HardwareError):
    """The server tracks no marker of that label.

    Attributes:
        labels: Labels that were looked for in vain.
        known: Labels that the server tracks.
    """

    def __init__(self, labels: Sequence[str], known: Sequence[str]) -> None:
        shown = ", ".join(known[:12]) + (f" and {len(known) - 12} more" if len(known) > 12 else "")
        super().__init__(
            f"the camera system tracks no marker {', '.join(labels)}; it tracks: {shown or 'none'}",
            hint="Labels are asset.marker, as in Motive's assets pane; one that two markers have is none.",
        )
        self.labels, self.known = tuple(labels), tuple(known)


class SharedMarkerError(HardwareError):
    """Two nodes are said to carry the same marker.

    Attributes:
        nodes: Their names.
    """

    def __init__(self, first: NodeMarker, second: NodeMarker) -> None:
        which = first.label or f"{first.asset}/{first.member}"
        super().__init__(f"nodes {first.node} and {second.node} cannot both carry marker {which}")
        self.nodes = (first.node, second.node)


@dataclass(frozen=True, slots=True)
class NodeMarker:
    """Which marker sits at a node: by ``label``, by numbers, or (neither) the one nearest to where it was.

    Attributes:
        node: Name of the node.
        label: ``asset.marker`` as in Motive.
        asset: Number of the asset.
        member: Number of the marker within it, from 1.
    """

    node: str
    label: str | None = None
    asset: int | None = None
    member: int | None = None

    def __post_init__(self) -> None:
        """Refuse half an identity.

        Raises:
            ValueError: Label and numbers, or only one number.
        """
        numbers = (self.asset is not None) + (self.member is not None)
        if numbers == 1 or (numbers and self.label is not None):
            raise ValueError(f"{self.node}: give a label, or asset and member, or neither")


@dataclass(frozen=True, slots=True)
class Located:
    """Nodes in the rig frame.

    Attributes:
        positions: Row by row (n, 3), single precision as cameras deliver them; NaN where not valid [m].
        valid: Which nodes are really seen (n,).
        reasons: Why not: ``no names``, ``unknown label``, ``missing``, ``occluded``, ``filled``, ``not finite``,
            ``residual``, ``jump``, or why the whole frame is doubted; empty for a valid node.
    """

    positions: NDArray[np.float32]
    valid: NDArray[np.bool_]
    reasons: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class Gate:
    """How far a node may have moved since it was last seen; keep ``largest_m`` below half the marker distance.

    Attributes:
        smallest_m: Just after it was seen [m].
        speed_m_s: Growth of the gate [m/s].
        largest_m: Whatever the time; a marker further off is another one [m].
    """

    smallest_m: float = 0.010
    speed_m_s: float = 0.5
    largest_m: float = 0.024

    def width(self, elapsed: Array) -> Array:
        """Gate after ``elapsed`` [s]."""
        with np.errstate(invalid="ignore"):  # infinite time at no speed, or no time at infinite speed
            grown = self.smallest_m + self.speed_m_s * np.maximum(elapsed, 0.0)
        return np.fmin(grown, self.largest_m)


class MarkerMap:
    """Finds the nodes in one frame after the other.

    Attributes:
        nodes: What is looked for, row by row.
        transform: From the camera system to the rig frame.

    Raises:
        SharedMarkerError: Two nodes with the same label or numbers.
    """

    def __init__(
        self,
        nodes: Sequence[NodeMarker],
        rest: ArrayLike,
        transform: RigidTransform = IDENTITY,
        *,
        gate: Gate | None = None,
        max_residual_m: float = float("inf"),
    ) -> None:
        self.nodes, self.transform = tuple(nodes), transform
        _check_shared(self.nodes)
        self._gate, self._max_residual = gate or Gate(), max_residual_m
        self._rest = np.array(rest, float).reshape(len(self.nodes), 3)
        self._unlabelled = np.array([node.label is None and node.asset is None for node in self.nodes], bool)
        self._named = np.array([node.label is not None for node in self.nodes], bool)
        self._ids = np.array(
            [
                UNKNOWN_ID if node.asset is None else node.asset << 16 | (node.member or 0)
                for node in self.nodes
            ],
            dtype=np.int64,
        )
        self._models: ModelDefinitions | None = None
        self.reset()

    def reset(self) -> None:
        """Forget where the nodes were: labels are trusted anew, unlabelled nodes are looked for at rest."""
        self._last = np.where(self._unlabelled[:, None], self._rest, np.nan)
        self._last_at = np.full(len(self.nodes), -np.inf)

    def resolve(self, models: ModelDefinitions) -> None:
        """Look up the labels.

        Raises:
            MarkerMapError: The server does not track some of them; names them all.
        """
        known = self._look_up(models)
        unknown = [node.label for node in self.nodes if node.label is not None and node.label not in known]
        if unknown:
            raise MarkerMapError(unknown, sorted(known))

    def locate(self, frame: MarkerFrame, expected: ArrayLike | None = None) -> Located:
        """Find the nodes in a frame; frames must come in order.

        Args:
            frame: The frame.
            expected: Where an observer expects the nodes (n, 3) [m]; default: where they were last seen.
        """
        if frame.models is not None and frame.models is not self._models:
            self._look_up(frame.models)
        reasons = np.full(len(self.nodes), "", dtype=object)
        found = self._by_number(frame.data, reasons)
        reference = self._last if expected is None else np.asarray(expected, float)
        width = self._gate.width(frame.taken_at - self._last_at)
        if self._unlabelled.any():
            found[self._unlabelled] = self._nearest(
                frame.data, reference[self._unlabelled], width[self._unlabelled]
            )
            reasons[self._unlabelled] = np.where(np.isnan(found[self._unlabelled, 0]), "missing", "")
        far = np.linalg.norm(found - reference, axis=1) > width  # False without a reference
        reasons[jumped(reasons == "", far)] = "jump"
        if frame.models is None:
            reasons[self._named] = "no names"
        if frame.doubt:
            reasons[:] = frame.doubt
        valid = reasons == ""
        self._last[valid], self._last_at[valid] = found[valid], frame.taken_at
        found[~valid] = np.nan
        return Located(found.astype(np.float32), valid, tuple(reasons))

    def _look_up(self, models: ModelDefinitions) -> dict[str, int]:
        known = models.labels()
        for row, node in enumerate(self.nodes):
            if node.label is not None:
                self._ids[row] = known.get(node.label, UNKNOWN_ID)
        self._models = models
        return known

    def _by_number(self, data: MocapFrame, reasons: NDArray[np.object_]) -> Array:
        """Return the positions (n, 3) of labelled nodes in the rig frame; fills in why they cannot be used."""
        found = np.full((len(self.nodes), 3), np.nan)
        rows = {number: row for row, number in enumerate(data.markers["id"].tolist())}
        at = np.array([rows.get(number, -1) for number in self._ids.tolist()], int)
        reasons[at < 0] = "missing"
        reasons[self._named & (self._ids == UNKNOWN_ID)] = "unknown label"
        listed = at >= 0
        marker = data.markers[at[listed]]
        why = np.full(len(marker), "", dtype=object)
        why[~(marker["residual"] <= self._max_residual)] = "residual"
        why[~np.isfinite(marker["position"]).all(axis=1)] = "not finite"
        why[marker["params"] & MODEL_FILLED != 0] = "filled"
        why[marker["params"] & OCCLUDED != 0] = "occluded"
        reasons[listed] = why
        found[listed] = self.transform.apply(marker["position"])
        return found

    def _nearest(self, data: MocapFrame, reference: Array, width: Array) -> Array:
        """Match unlabelled points to nodes so that the sum of gated distances is least; NaN where none fits."""
        found = np.full_like(reference, np.nan)
        points = self.transform.apply(_points_without_name(data))
        if not len(points):
            return found
        distance = np.linalg.norm(reference[:, None] - points[None], axis=2)
        nodes, picked = linear_sum_assignment(np.minimum(distance, width[:, None]))
        near = distance[nodes, picked] <= width[nodes]
        found[nodes[near]] = points[picked[near]]
        return found


def jumped(usable: NDArray[np.bool_], far: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return which nodes have jumped (n,): all of them if most have, for then it is the picture that has.

    Args:
        usable: Which nodes are seen (n,).
        far: Which are further from where they were than their gate (n,).
    """
    away = far & usable
    most = np.count_nonzero(away) > MOST * np.count_nonzero(usable)
    return usable if most else away


def _check_shared(nodes: Sequence[NodeMarker]) -> None:
    owners: dict[tuple[str | int | None, ...], NodeMarker] = {}
    for node in nodes:
        identity = (node.label, node.asset, node.member)
        if any(part is not None for part in identity) and owners.setdefault(identity, node) is not node:
            raise SharedMarkerError(owners[identity], node)


def _points_without_name(data: MocapFrame) -> NDArray[np.float32]:
    """Return unlabelled points (k, 3): from their own list, or (newer servers) flagged among labelled markers."""
    points = data.unlabelled
    if not len(points):
        points = data.markers["position"][data.markers["params"] & UNLABELLED != 0]
    return points[np.isfinite(points).all(axis=1)]
