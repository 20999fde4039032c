"""What the emulated cameras see: named markers, grouped into rigid bodies, with the faults of one frame applied."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from tcr_hardware.emulators.motive_faults import MotiveFaults

#: Flags of a labelled marker as Motive sends them.
SEEN, OCCLUDED, UNLABELLED = 0x0A, 0x0B, 0x12
MARKER_SIZE = 0.008
RESIDUAL = 0.0003
FIRST_POINT_CLOUD_ID = 50001


@dataclass(frozen=True, slots=True)
class Body:
    """A rigid body of the scene: its number, its name, the names of its markers and their rows."""

    id: int
    name: str
    markers: tuple[str, ...]
    rows: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class BodyPose:
    """Where a body is; ``tracked`` is False if too few of its markers are seen."""

    id: int
    position: NDArray[np.float64]
    orientation: NDArray[np.float64]
    tracked: bool
    markers: NDArray[np.float64]


@dataclass(frozen=True, slots=True)
class Labelled:
    """One entry of the list of labelled markers."""

    id: int
    position: NDArray[np.float64]
    params: int


@dataclass(frozen=True, slots=True)
class View:
    """One frame before encoding: positions by marker set, unlabelled points, bodies, labelled markers."""

    sets: tuple[tuple[str, NDArray[np.float64]], ...]
    unlabelled: NDArray[np.float64]
    bodies: tuple[BodyPose, ...]
    labelled: tuple[Labelled, ...]


class Scene:
    """Markers with names ``body.marker``; a name without a dot belongs to the body ``markers``.

    Attributes:
        names: Names of the markers, row by row.
        bodies: Rigid bodies in order of appearance; their numbers count from 1, as do those of their markers.
        rest: Positions that define the bodies (n, 3) [m].
    """

    def __init__(self, names: Sequence[str], rest: NDArray[np.float64]) -> None:
        self.names, self.rest = tuple(names), np.array(rest, float)
        if self.rest.shape != (len(self.names), 3):
            raise ValueError(f"{len(self.names)} names, but positions of shape {self.rest.shape}")
        rows: dict[str, list[int]] = {}
        for row, name in enumerate(self.names):
            rows.setdefault(name.rpartition(".")[0] or "markers", []).append(row)
        self.bodies = tuple(
            Body(k + 1, body, tuple(self.names[row].rpartition(".")[2] for row in of), tuple(of))
            for k, (body, of) in enumerate(rows.items())
        )
        self._row = {name: row for row, name in enumerate(self.names)}
        self._frames = {body.id: _triad(self.rest[list(body.rows)]) for body in self.bodies}

    def view(self, positions: NDArray[np.float64], faults: MotiveFaults) -> View:
        """Look at the markers at ``positions`` (n, 3) [m] through faulty cameras."""
        seen = np.array(positions, float) + np.asarray(faults.offset_m, float)
        for first, second in faults.swap:
            pair = [self._row[first], self._row[second]]
            seen[pair] = seen[pair[::-1]]
        seen[self._rows(faults.nan)] = np.nan
        missing = set(self._rows(faults.missing))
        occluded = set(self._rows(faults.occluded))
        if faults.unlabelled:
            return self._unlabelled(seen, missing | occluded)
        in_sets = seen.copy()
        in_sets[list(missing)] = 0.0
        sets = [(body.name, in_sets[list(body.rows)]) for body in self.bodies]
        hidden = missing | occluded
        return View(
            (*sets, ("all", in_sets)),
            np.empty((0, 3)),
            tuple(self._pose(body, seen, hidden, faults.untracked) for body in self.bodies),
            tuple(
                Labelled(body.id << 16 | member + 1, seen[row], OCCLUDED if row in occluded else SEEN)
                for body in self.bodies
                for member, row in enumerate(body.rows)
                if row not in missing
            ),
        )

    def _rows(self, names: frozenset[str]) -> list[int]:
        return [self._row[name] for name in names if name in self._row]

    def _unlabelled(self, seen: NDArray[np.float64], hidden: set[int]) -> View:
        """Nothing is recognised: points in an order of their own."""
        rows = [row for row in range(len(seen)) if row not in hidden][::-1]
        points = tuple(
            Labelled(FIRST_POINT_CLOUD_ID + k, seen[row], UNLABELLED) for k, row in enumerate(rows)
        )
        bodies = tuple(
            BodyPose(body.id, np.zeros(3), np.array([0, 0, 0, 1.0]), False, np.zeros((len(body.rows), 3)))
            for body in self.bodies
        )
        empty = tuple((body.name, np.zeros((len(body.rows), 3))) for body in self.bodies)
        return View((*empty, ("all", np.zeros((len(seen), 3)))), seen[rows], bodies, points)

    def _pose(self, body: Body, seen: NDArray[np.float64], hidden: set[int], untracked: bool) -> BodyPose:
        """Pose against the definition, from the body's first three markers."""
        markers = seen[list(body.rows)]
        tracked = not untracked and len(hidden & set(body.rows)) == 0 and bool(np.isfinite(markers).all())
        quaternion = np.array([0.0, 0.0, 0.0, 1.0])
        frame = self._frames[body.id]
        now = _triad(markers) if frame is not None and tracked else None
        if frame is not None and now is not None:
            quaternion = Rotation.from_matrix(now @ frame.T).as_quat()
        return BodyPose(body.id, markers.mean(axis=0), quaternion, tracked, markers)


def _triad(markers: NDArray[np.float64]) -> NDArray[np.float64] | None:
    """Orthonormal axes (3, 3), as columns, fixed to the first three of ``markers``; None for fewer or a line."""
    if len(markers) < 3:
        return None
    x, across = markers[1] - markers[0], markers[2] - markers[0]
    z = np.cross(x, across)
    length, height = np.linalg.norm(x), np.linalg.norm(z)
    if height < 1e-9:
        return None
    x, z = x / length, z / height
    return np.column_stack([x, np.cross(z, x), z])
