"""Small models, deformed shapes, energies and finite differences for the tests of mechanics."""

from __future__ import annotations

import itertools

import numpy as np

from tcrctl.elements import bar, sliding_cable
from tcrctl.numerics import block_banded
from tcrctl.robot.description import load_robot
from tcrctl.robot.equations import FORCE, Load, make_workspace, residual
from tcrctl.robot.equilibrium import static_load
from tcrctl.robot.model import Model, freeze
from tcrctl.robot.module import FIXED
from tcrctl.robot.robot import build_robot

FREE = 3 * FIXED


def altered(name, *overrides):
    """Shipped robot with some values of its file changed."""
    return build_robot(load_robot(name, overrides=overrides))


def elements_only(modules, bars=(), cables=()):
    """Massless model of a few elements.

    Args:
        modules: Number of free modules.
        bars: (node, node, rest length, stiffness, damping, tension only).
        cables: (holes, rest length, stiffness, damping, lead) with holes a list of (ring, weights (3,)).
    """
    holes = [hole for cable in cables for hole in cable[0]]
    rings = np.array([ring for ring, _ in holes], dtype=np.int64).reshape(-1, 1)
    return freeze(
        Model(
            mass=np.zeros((modules, 12, 12)),
            damping=0.0,
            bandwidth=max(modules - 1, 1),
            bar_nodes=np.array([b[:2] for b in bars], dtype=np.int64).reshape(-1, 2),
            bars=np.array([b[2:] for b in bars], dtype=float).reshape(-1, 4),
            first_hole=np.cumsum([0] + [len(cable[0]) for cable in cables]).astype(np.int64),
            hole_nodes=FIXED * rings + np.arange(3),
            hole_weights=np.array([weights for _, weights in holes], dtype=float).reshape(-1, 3),
            cables=np.array([cable[1:] for cable in cables], dtype=float).reshape(-1, 4),
        )
    )


def rule_load(model, rng, q, inertia=0.0, w=0.0, springs=0.0):
    """Load of an implicit rule with everything in it: forces, virtual springs, lengths before."""
    nodal = np.zeros((4, q.size))
    nodal[0] = q + 1e-4 * rng.standard_normal(q.size)
    nodal[FORCE] = 0.1 * rng.standard_normal(q.size)
    nodal[2] = springs * rng.random(q.size)
    nodal[3] = q + 1e-3 * rng.standard_normal(q.size)
    ends = q.reshape(-1, 3)[model.bar_nodes]
    bar_before = np.linalg.norm(ends[:, 1] - ends[:, 0], axis=1) * (1 + 1e-4 * rng.standard_normal(len(ends)))
    cable_before = model.cables[:, sliding_cable.REST] + 1e-3 * rng.standard_normal(len(model.cables))
    return Load(inertia, w, nodal, bar_before, cable_before, None)


def turned(vector):
    """Rotation matrix of the rotation vector (3,) [rad] (Rodrigues)."""
    angle = np.linalg.norm(vector)
    if angle == 0.0:
        return np.eye(3)
    x, y, z = vector / angle
    S = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + np.sin(angle) * S + (1.0 - np.cos(angle)) * S @ S


def deformed(robot, seed, bend=0.1, noise=2e-5):
    """The robot at rest, every module turned against the one above it, then all nodes shaken [m]."""
    rng = np.random.default_rng(seed)
    modules = robot.rest.q.reshape(-1, FIXED, 3)
    frame, centre, out = np.eye(3), np.zeros(3), [modules[0]]
    for above, below in itertools.pairwise(modules):
        frame = frame @ turned(bend * rng.uniform(-1.0, 1.0, 3) * [1.0, 1.0, 0.3])
        step = below[:3].mean(axis=0) - above[:3].mean(axis=0)
        centre = centre + frame @ step
        out.append(centre + (below - below[:3].mean(axis=0)) @ frame.T)
    nodes = np.array(out)
    nodes[1:] += noise * rng.standard_normal(nodes[1:].shape)
    return nodes.ravel()


def some_drives(robot, seed):
    """Drive lengths [m]: cables pulled by up to 20 mm, one of them paid out until it is slack."""
    drive = np.random.default_rng([seed, 1]).uniform(0.01, 0.03, robot.n_cables)
    drive[seed % robot.n_cables] = -0.1
    return drive


def dense_tangent(ws):
    """K + G'CG (12 n, 12 n) of the workspace."""
    G = ws.G[:, FREE:]
    return block_banded.to_dense(ws.K) + G.T @ (ws.axial[:, None] * G)


def slopes(function, x, step):
    """Derivative of ``function`` by central differences, one column per component of x."""
    columns = []
    for i in range(x.size):
        up, down = x.copy(), x.copy()
        up[i] += step
        down[i] -= step
        columns.append((function(up) - function(down)) / (2.0 * step))
    return np.array(columns).T


def free_slopes(function, q, step):
    """Derivative of a function of all coordinates (3 n_nodes,) with respect to the free ones."""
    return slopes(lambda x: function(np.concatenate([q[:FREE], x])), q[FREE:], step)


def undamped(model):
    """The same robot without any damping."""
    bars, cables = model.bars.copy(), model.cables.copy()
    bars[:, bar.DAMPING] = 0.0
    cables[:, sliding_cable.DAMPING] = 0.0
    return freeze(model._replace(bars=bars, cables=cables, damping=0.0))


def mass_times(model, v):
    """M v (n_free,) for v over all nodes."""
    return np.einsum("nab,nb->na", model.mass, v[FREE:].reshape(-1, 12)).ravel()


class EnergyMeter:
    """Kinetic plus elastic plus gravity energy of states of one robot [J]."""

    def __init__(self, model, weight):
        self.model, self.work, self.load = model, make_workspace(model), static_load(model, weight)

    def __call__(self, state):
        potential = residual(self.model, state.q, state.drive, self.load, self.work)
        return potential + 0.5 * state.v[FREE:] @ mass_times(self.model, state.v)
