"""Pictures of a robot that bends slowly, as cameras see it: biased and noisy markers, a frame that is a little off.

The robot is at rest at every moment, of other material than the controller knows; so tests can look at every kind
of wrong picture without an experiment for each.
"""

from __future__ import annotations

import functools
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial.transform import Rotation

from tcrctl.picture.judge import PictureJudge
from tcrctl.picture.settings import PictureSettings
from tcrctl.plant.cameras import draw_cameras
from tcrctl.plant.reality_settings import CameraSettings
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.module import RING, ring_rows
from tcrctl.robot.robot import build_robot, mismatched
from tcrctl.signals import Measurement

PERIOD, SECONDS, COARSE = 0.05, 24.0, 0.2
RINGS = 11
NOISE = 50e-6
STILL = 10
"""Frames before anything moves."""


@functools.cache
def robot():
    """The robot as the controller knows it."""
    return build_robot(load_robot("tcr600"))


@functools.cache
def film():
    """Drives (k, m) and ring nodes (k, 3 RINGS, 3) of a robot that contracts, and bends to all sides [m]."""
    real = mismatched(robot(), springs=0.7, density=1.2)
    times = np.arange(0.0, SECONDS + COARSE, COARSE)
    grow = np.minimum(times / 8.0, 1.0)[:, None]
    phase = 2.0 * np.pi * (times[:, None] / 16.0 - np.arange(3) / 3.0)
    drives = grow * (12e-3 + 20e-3 * np.sin(phase))
    q, shapes = real.rest.q, []
    for before, drive in zip(np.vstack([0.0 * drives[:1], drives]), drives, strict=False):
        q = equilibrium(real.model, drive, real.weight, q, before).q
        shapes.append(q.reshape(-1, 3)[ring_rows(RINGS)])
    fine = np.arange(0.0, SECONDS, PERIOD)
    return _between(fine, times, drives), _between(fine, times, np.array(shapes))


def _between(fine, times, values):
    flat = values.reshape(len(times), -1)
    return np.stack([np.interp(fine, times, column) for column in flat.T], axis=1).reshape(
        -1, *values.shape[1:]
    )


def frames(seed=1, bias_mm=2.0, noise=NOISE, lost=0.0, steps=None):
    """Measurements of the film, the first STILL of them of a robot at rest."""
    drives, nodes = film()
    random = np.random.default_rng(seed)
    off = {"rotation_deg": 0.5, "translation_mm": 1.0}
    draw = draw_cameras(CameraSettings(marker_bias_mm=bias_mm, frame_error=off), RING * RINGS, seed)
    made = []
    for k in range(min(steps or 10**9, len(nodes) + STILL)):
        at = max(0, k - STILL)
        seen = draw.in_frame(draw.beside(nodes[at])) + noise * random.standard_normal((RING * RINGS, 3))
        valid = random.random(RING * RINGS) >= lost
        made.append(Measurement(k * PERIOD, seen.astype(np.float32), valid, drives[at]))
    return made


def moved(measured, nodes, valid=None):
    """The same frame with markers elsewhere."""
    valid = measured.valid if valid is None else valid
    return Measurement(measured.t, np.asarray(nodes, np.float32), valid, measured.drive)


def turned(measured, *degrees):
    """The frame turned about the base by a rotation vector."""
    return moved(measured, Rotation.from_rotvec(np.radians(degrees)).apply(measured.nodes))


def mirrored(measured, axis):
    """The frame mirrored across an axis."""
    return moved(measured, measured.nodes * np.where(np.arange(3) == axis, -1.0, 1.0))


def relabelled(measured, order):
    """The frame with the marker of row ``order[i]`` labelled as row i."""
    return moved(measured, measured.nodes[order], measured.valid[order])


def exchanged(measured, first, second):
    """The frame with two rings swapped."""
    order = np.arange(RING * RINGS).reshape(RINGS, RING)
    order[[first - 1, second - 1]] = order[[second - 1, first - 1]]
    return relabelled(measured, order.ravel())


def labels_moved(measured, ring, by=1):
    """The frame with the labels of a ring moved on."""
    order = np.arange(RING * RINGS).reshape(RINGS, RING)
    order[ring - 1] = np.roll(order[ring - 1], by)
    return relabelled(measured, order.ravel())


def shifted(measured, rows, millimetres):
    """The frame with some markers elsewhere."""
    nodes = measured.nodes.astype(float)
    nodes[rows] += 1e-3 * np.array(millimetres)
    return moved(measured, nodes)


def rows_of(ring):
    return list(range(RING * (ring - 1), RING * ring))


@dataclass
class Judged:
    """What became of a film.

    Attributes:
        out: Markers that were left out though they were seen, frame by frame (n, 3 RINGS).
        doubts: Why the drives were held, frame by frame.
        stopped: Index of the frame that would have stopped the run; None if none would.
        events: What was said.
        told: In which frame each was said.
    """

    out: list = field(default_factory=list)
    doubts: list = field(default_factory=list)
    stopped: int | None = None
    events: list = field(default_factory=list)
    told: list = field(default_factory=list)

    @property
    def first(self):
        """Index of the first frame of which something was left out; None if there is none."""
        return next((k for k, out in enumerate(self.out) if out.any()), None)

    @property
    def names(self):
        """Names of what was not believed."""
        told = [text.partition(" is not")[0] for _, level, text in self.events if level == "warning"]
        return [name for name in told if not name.startswith("the drives are held")]


def judged(measurements, elapsed=None, **settings):
    """Let a judge look at frames, of which the first STILL are those of the start, at some times [s] or in time."""
    found = Judged()
    judge = PictureJudge(
        PictureSettings(**settings),
        robot(),
        PERIOD,
        measurements[:STILL],
        lambda *event: found.events.append(event),
    )
    for k, measured in enumerate(measurements[STILL:]):
        left = judge.judged(measured, k * PERIOD if elapsed is None else elapsed[k])
        found.out.append(measured.valid & ~left.valid)
        found.told += [k] * (len(found.events) - len(found.told))
        found.doubts.append(judge.doubt)
        if found.stopped is None and judge.broken(k) is not None:
            found.stopped = k
    return found
