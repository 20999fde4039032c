"""Measurements of a short robot whose parameters are known, made by the model itself, with noise on top."""

from __future__ import annotations

import numpy as np

from tcrctl import strict_yaml
from tcrctl.identify.loading import from_document
from tcrctl.robot.description import load_robot
from tcrctl.robot.equilibrium import equilibrium
from tcrctl.robot.robot import build_robot

#: tcr5x4 has four cables and five modules, so that a test takes milliseconds.
ROBOT = "tcr5x4"
SPRINGS, CABLES, MASS = "springs.youngs_modulus_mpa", "cables.youngs_modulus_mpa", "modules.mass_g"
DRIVES_MM = [[12, 2, -4, 2], [2, 10, 2, -4], [6, 6, 6, 6], [10, 10, -2, -2], [-3, 4, 9, 4]]


def true_robot(**factors):
    """The short robot with other values: ``springs``, ``cables``, ``mass`` as factors."""
    paths = {"springs": SPRINGS, "cables": CABLES, "mass": MASS}
    data = load_robot(ROBOT).model_dump(mode="json")
    overrides = []
    for name, factor in factors.items():
        section, key = paths[name].split(".")
        overrides.append(f"{paths[name]}={data[section][key] * factor}")
    return build_robot(load_robot(ROBOT, overrides=overrides))


def measured_shapes(robot, drives_mm=DRIVES_MM):
    """Node positions at rest (n, n_nodes, 3) [mm]."""
    shapes = [equilibrium(robot.model, np.array(d) / 1e3, robot.weight, robot.rest.q).q for d in drives_mm]
    return 1e3 * np.array(shapes).reshape(len(shapes), -1, 3)


def ring_points(shape, rings=(1, 2, 3, 4, 5)):
    """Nodes of the rings as a map of points."""
    names = ("n1", "n2", "n3")
    return {f"m{r}.{name}": shape[4 * r + k].tolist() for r in rings for k, name in enumerate(names)}


def static_data(robot, noise_mm=0.0, drives_mm=DRIVES_MM, place=lambda points: points, points=ring_points, seed=3):
    """A file's worth of configurations, seen in another frame if ``place`` moves them."""
    random, shapes = np.random.default_rng(seed), measured_shapes(robot, drives_mm)
    shapes = place(shapes + noise_mm * random.standard_normal(shapes.shape))
    entries = zip(drives_mm, shapes, strict=True)
    configurations = [
        {"name": f"c{i}", "drives_mm": [float(d) for d in drive], "points_mm": points(shape)}
        for i, (drive, shape) in enumerate(entries)
    ]
    return {"configurations": configurations}


def identification(folder, data, parameters=(SPRINGS, CABLES), robot=ROBOT, **more):
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
