"""The MuJoCo model of a robot: free bodies, held together by tendons alone.

Every module is a body with six freedoms. Springs are tendons between two nodes, cables are tendons through their
holes. MuJoCo's own stiffness of tendons would push too; here an actuator on every tendon has the law of tcrctl,

    force = -max(0, k (length - rest) + c d(length)/dt)

as an affine actuator whose force is bounded by zero: a slack cable does not push. The drive of a cable is the
actuator's control, so that length and drive add up as in tcrctl.
"""

from __future__ import annotations

import itertools
from xml.etree import ElementTree

import mujoco
import numpy as np

from tcrctl.extend import Array, Robot
from tcrctl_mujoco.rigid import NODES, RigidModule, rigid_modules

#: Rods and ring sides of a module, which come first among the bars and are rigid here.
RIGID_BARS = 6
#: A pull that nothing reaches [N].
_MOST = "1e6"


def mujoco_model(robot: Robot, step: float) -> mujoco.MjModel:
    """Return the model of a robot, at rest.

    Args:
        robot: As tcrctl built it from its file.
        step: Internal time step [s].
    """
    return mujoco.MjModel.from_xml_string(mjcf(robot, step))


def mjcf(robot: Robot, step: float) -> str:
    """Return the model as MJCF; bodies are called m1, m2, ..., cables as in the robot's file."""
    root = ElementTree.Element("mujoco", model=robot.name)
    gravity = robot.weight[-3 * NODES :].reshape(NODES, 3).sum(axis=0) / robot.model.mass[-1][::3, ::3].sum()
    option = {"timestep": repr(step), "integrator": "implicitfast", "gravity": _text(gravity)}
    flags = ElementTree.SubElement(root, "option", option)
    ElementTree.SubElement(flags, "flag", contact="disable")
    ElementTree.SubElement(root, "size", memory="16M")
    world = ElementTree.SubElement(root, "worldbody")
    modules = rigid_modules(robot)
    bodies = [world, *(_body(world, i, module) for i, module in enumerate(modules, 1))]
    _node_sites(bodies, robot, modules)
    tendons = ElementTree.SubElement(root, "tendon")
    actuators = ElementTree.SubElement(root, "actuator")
    _springs(tendons, actuators, robot)
    _cables(bodies, tendons, actuators, robot, modules)
    return ElementTree.tostring(root, encoding="unicode")


def _body(world: ElementTree.Element, number: int, module: RigidModule) -> ElementTree.Element:
    body = ElementTree.SubElement(world, "body", name=f"m{number}", pos=_text(module.origin))
    ElementTree.SubElement(body, "freejoint")
    i = module.inertia
    inertia = (i[0, 0], i[1, 1], i[2, 2], i[0, 1], i[0, 2], i[1, 2])
    made = {"pos": _text(module.centre), "mass": repr(module.mass), "fullinertia": _text(inertia)}
    ElementTree.SubElement(body, "inertial", made)
    return body


def _node_sites(bodies: list[ElementTree.Element], robot: Robot, modules: list[RigidModule]) -> None:
    base = robot.rest.q.reshape(-1, NODES, 3)[0]
    for i, (body, nodes) in enumerate(zip(bodies, [base, *(m.nodes for m in modules)], strict=True)):
        for j, node in enumerate(nodes):
            ElementTree.SubElement(body, "site", name=f"n{NODES * i + j}", pos=_text(node), size="0.001")


def _springs(tendons: ElementTree.Element, actuators: ElementTree.Element, robot: Robot) -> None:
    first = RIGID_BARS * robot.n_modules
    pairs = zip(robot.model.bar_nodes[first:], robot.model.bars[first:], strict=True)
    for i, (nodes, (rest, stiffness, damping, tension_only)) in enumerate(pairs):
        name = f"spring{i}"
        _tendon(tendons, name, [f"n{node}" for node in nodes])
        law = {"biasprm": _text((stiffness * rest, -stiffness, -damping)), "gainprm": "0"}
        _actuator(actuators, name, law, pulls_only=bool(tension_only))


def _cables(
    bodies: list[ElementTree.Element],
    tendons: ElementTree.Element,
    actuators: ElementTree.Element,
    robot: Robot,
    modules: list[RigidModule],
) -> None:
    model = robot.model
    base = robot.rest.q.reshape(-1, NODES, 3)[0]
    nodes = [base, *(module.nodes for module in modules)]
    for c, (first, last) in enumerate(itertools.pairwise(model.first_hole)):
        name = robot.cable_names[c]
        sites = []
        for hole in range(first, last):
            module = int(model.hole_nodes[hole, 0]) // NODES
            place = model.hole_weights[hole] @ nodes[module][model.hole_nodes[hole] % NODES]
            sites.append(f"{name}_{hole}")
            ElementTree.SubElement(bodies[module], "site", name=sites[-1], pos=_text(place), size="0.001")
        _tendon(tendons, name, sites)
        rest, stiffness, damping, lead = model.cables[c]
        law = {
            "biasprm": _text((stiffness * (rest - lead), -stiffness, -damping)),
            "gainprm": _text((-stiffness,)),
        }
        _actuator(actuators, name, law, pulls_only=True)


def _tendon(tendons: ElementTree.Element, name: str, sites: list[str]) -> None:
    spatial = ElementTree.SubElement(tendons, "spatial", name=name)
    for site in sites:
        ElementTree.SubElement(spatial, "site", site=site)


def _actuator(actuators: ElementTree.Element, name: str, law: dict[str, str], *, pulls_only: bool) -> None:
    bound = {"forcelimited": "true", "forcerange": f"-{_MOST} 0"} if pulls_only else {}
    kind = {"name": name, "tendon": name, "gaintype": "fixed", "biastype": "affine"}
    ElementTree.SubElement(actuators, "general", {**kind, **law, **bound})


def _text(values: Array | tuple[float, ...]) -> str:
    return " ".join(repr(float(value)) for value in np.asarray(values))
