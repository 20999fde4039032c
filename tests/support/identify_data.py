"""Measurements of robots whose parameters are known, made by the model itself, with noise on top."""

from __future__ import annotations

import numpy as np

from tcrctl.config import strict_yaml
from tcrctl.identify.loading import from_document
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import build_robot

#: The short robot takes milliseconds, but its cables hardly stretch; the long one tells their modulus.
ROBOT, LONG = "tcr5x4", "tcr700"
SPRINGS, CABLES, MASS = "springs.youngs_modulus_mpa", "cables.youngs_modulus_mpa", "modules.mass_g"
DRIVES_MM = {
    ROBOT: [[12, 2, -4, 2], [2, 10, 2, -4], [6, 6, 6, 6], [10, 10, -2, -2], [-3, 4, 9, 4]],
    LONG: [
        [90, 50, 50, 50, 50, 50],
        [90, 70, 90, 70, 90, 70],
        [60, 25, 55, 85, 55, 25],
        [50, 80, 60, 20, 30, 30],
        [40, 60, 20, 60, 40, 10],
    ],
}


def true_robot(name=ROBOT, **factors):
    """A robot with other values: ``springs``, ``cables``, ``mass`` as factors."""
    paths = {"springs": SPRINGS, "cables": CABLES, "mass": MASS}
    data = load_robot(name).model_dump(mode="json")
    overrides = []
    for what, factor in factors.items():
        section, key = paths[what].split(".")
        overrides.append(f"{paths[what]}={data[section][key] * factor}")
    return build_robot(load_robot(name, overrides=overrides))


def measured_shapes(robot, drives_mm=None):
    """Node positions at rest (n, n_nodes, 3) [mm]."""
    drives = np.array(DRIVES_MM[robot.name] if drives_mm is None else drives_mm) / 1e3
    shapes = [equilibrium(robot.model, drive, robot.weight, robot.rest.q).q for drive in drives]
    return 1e3 * np.array(shapes).reshape(len(shapes), -1, 3)


def ring_points(shape):
    """Nodes of the rings as a map of points."""
    names = ("n1", "n2", "n3")
    rings = range(1, len(shape) // 4)
    return {f"m{r}.{name}": shape[4 * r + k].tolist() for r in rings for k, name in enumerate(names)}


def static_data(robot, noise_mm=0.0, drives_mm=None, place=lambda points: points, points=ring_points, seed=3):
    """A file's worth of configurations, seen in another frame if ``place`` moves them."""
    random, shapes = np.random.default_rng(seed), measured_shapes(robot, drives_mm)
    shapes = place(shapes + noise_mm * random.standard_normal(shapes.shape))
    entries = zip(DRIVES_MM[robot.name] if drives_mm is None else drives_mm, shapes, strict=True)
    configurations = [
        {"name": f"c{i}", "drives_mm": [float(d) for d in drive], "points_mm": points(shape)}
        for i, (drive, shape) in enumerate(entries)
    ]
    return {"configurations": configurations}


def identification(folder, data, parameters=(SPRINGS, CABLES), robot=ROBOT, /, **more):
    """Load an identification of ``data`` (what a file holds, or the path of one)."""
    path = data
    if isinstance(data, dict):
        path = folder / "data.yaml"
        path.write_text(strict_yaml.dumps(data))
    bounds = parameters if isinstance(parameters, dict) else {name: {} for name in parameters}
    told = {
        "kind": "identification",
        "name": "test",
        "robot": robot,
        "parameters": bounds,
        "data": [{"file": str(path)}],
        "method": "least-squares",
        **more,
    }
    text = strict_yaml.dumps(told)
    return from_document(strict_yaml.loads(text, "test.yaml"), text.encode(), folder)
