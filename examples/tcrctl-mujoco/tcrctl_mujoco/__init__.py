"""The robot of a tcrctl robot file in MuJoCo, as ``plant: {kind: mujoco}``."""

from __future__ import annotations

from tcrctl_mujoco.plant import MujocoPlant, MujocoSection

__version__ = "0.1.0"

#: What the entry point names: settings and builder.
MUJOCO = (MujocoSection, MujocoPlant)
