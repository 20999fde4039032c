"""tcrctl: experiments with cable-driven tensegrity continuum robots (TCR).

One name for one thing. Every module uses this notation; SI units inside, other units only at the
borders (YAML keys, JSON keys, PLC registers), where the unit is part of the name.

================  ==========================================================  ================  =======
name              meaning                                                     shape             unit
================  ==========================================================  ================  =======
``q``             node positions, world frame, flattened node by node         (3 n_nodes,)      m
``v``             node velocities, same order as ``q``                        (3 n_nodes,)      m/s
``a``             node accelerations, same order as ``q``                     (3 n_nodes,)      m/s2
``drive``, d      cable length taken in by the actuator since rest, per       (m,)              m
                  cable; positive shortens the cable
``speed``, u      control input: d(drive)/dt, eq. (20)                        (m,)              m/s
``tension``, λ    cable tension = Lagrange multiplier of the driving          (m,)              N
                  constraint, eq. (9); never negative
``rest_length``   unstretched length of an element                            (n_elements,)     m
``y``, position   end position: centroid of the tip ring, eq. (11)            (3,)              m
``n``, normal     end normal: unit normal of the tip ring, +z at rest         (3,)              1
``theta_x, _y``   end orientation angles of eq. (45), both 0 at rest          ()                rad
``period``        control period η                                            ()                s
``horizon``       prediction horizon of the controller                        ()                s
``h``             internal step: time step of an integrator, up to a period   ()                s
``step``          control step: one round of the loop, one record of a log
``k``             index of the control step, 0 .. n-1
``n_free``        free coordinates: all of ``q`` but those of the fixed base
================  ==========================================================  ================  =======

World frame: right-handed, z up, origin in the centre of the base ring; the robot hangs towards -z.
Nodes: module 0 is the fixed base; module i (1 .. n_modules) hangs below module i-1. Every module has
four nodes, ``n1 n2 n3`` on its ring (counter-clockwise seen from +z) and ``apex``, so that node j of
module i is row ``4 i + j``. In files a node is written ``base.n1``, ``m7.apex``. What
follows from that kind of module is in :mod:`tcrctl.robot.module` and nowhere else.
Frame: what the cameras send at one instant; a coordinate frame is called so, or by its name (world frame,
rig frame). Bench: the place with cameras, drives and robots; rig: the file that describes it, and the plant
that it makes. Problem: what is wrong in a file. Sight: what the camera of a task sees. State: q, v and what
else an integrator needs; what the supervisor is in is a safety state. Session: of the cameras' server, from
one start to the next.
Equation numbers refer to the paper, key [TCR] in REFERENCES.md.
"""

from __future__ import annotations

import importlib

from tcrctl.caches.hook import watch_imports

__version__ = "0.1.0"

#: The program from Python, and where it is; loaded when it is used, because that takes a second. ``__init__.pyi``
#: tells type checkers the same.
_API = {
    "run": "tcrctl.api.running",
    "simulate": "tcrctl.api.running",
    "Simulation": "tcrctl.api.running",
    "load": "tcrctl.api.recorded",
    "Run": "tcrctl.api.recorded",
    "Robot": "tcrctl.api.robot",
}

watch_imports()


def __getattr__(name: str) -> object:
    """Load a part of the API, with the compiler flags of the command line."""
    if name not in _API:
        raise AttributeError(f"module 'tcrctl' has no attribute {name!r}")
    from tcrctl.caches.flags import set_flags

    set_flags()
    return getattr(importlib.import_module(_API[name]), name)


def __dir__() -> list[str]:
    """Return what there is, the API included."""
    return sorted((*globals(), *_API))
