"""Drawings to test with: small ones by hand, random ones by hypothesis."""

from __future__ import annotations

import cmath
import itertools
import json
import math
from pathlib import Path
from types import SimpleNamespace

import numpy as np
from hypothesis import assume, settings
from hypothesis import strategies as st
from pydantic import RootModel

from tcrctl.trajectory.settings import TrajectorySettings
from tcrctl.trajectory.trajectory import build_trajectory

REST = np.array([0.004, -0.003, -0.6])
UP = np.array([0.0, 0.0, 1.0])
AT_REST = SimpleNamespace(rest_position=REST, rest_normal=UP)
DT = 0.005
LETTERS = ["letter_i", "heart", "letter_d", "letter_u", "letter_t"]
EXPERIMENTS = Path(__file__).parents[2] / "experiments"


class Section(RootModel[TrajectorySettings]):
    pass


law = settings(deadline=None, max_examples=40)


def parsed(section):
    return Section.model_validate_json(json.dumps(section)).root


def drawing(*strokes, **keys):
    return parsed({"kind": "strokes", "strokes": list(strokes), "corner_angle_deg": 0, **keys})


def built(section, targets=None):
    return build_trajectory(section, AT_REST, targets or {})


def at_start(x, y, **keys):
    """Keys that put the drawing's first point (x, y) on the rest position: no approach."""
    return {"plane": {"offset_mm": [-x, -y, 0]}, "lead_in_s": 0.0, **keys}


def sampled(trajectory, dt=DT):
    t = np.arange(0.0, trajectory.duration + dt, dt)
    return t, trajectory.position(t)


def in_plane_mm(position, section):
    return 1e3 * (position - REST) - np.array(section.plane.offset_mm)


coordinates = st.integers(-60, 60).map(float)
points = st.tuples(coordinates, coordinates)


@st.composite
def polylines(draw):
    line = draw(st.lists(points, min_size=2, max_size=6))
    assume(all(a != b for a, b in itertools.pairwise(line)))
    return {"line": line}


@st.composite
def arcs(draw):
    start = draw(st.integers(-360, 360))
    sweep = draw(st.integers(5, 500)) * draw(st.sampled_from([-1, 1]))
    radius = draw(st.integers(1, 60))
    return {"arc": {"center": draw(points), "radius": radius, "from_deg": start, "to_deg": start + sweep}}


@st.composite
def tangent_paths(draw):
    """A line into an arc into a line, without corners, somewhere on the sheet."""
    heading, radius = draw(st.integers(0, 359)), draw(st.integers(2, 50))
    left, sweep = draw(st.sampled_from([-1, 1])), draw(st.integers(10, 300))
    first, last = draw(st.integers(1, 60)), draw(st.integers(1, 60))
    before = cmath.exp(1j * math.radians(heading))
    after = before * cmath.exp(1j * math.radians(left * sweep))
    centre = left * 1j * before * radius
    end = centre - left * 1j * after * radius
    arc_from = heading - left * 90
    return {
        "path": [
            {"line": [pair(-first * before), [0, 0]]},
            {
                "arc": {
                    "center": pair(centre),
                    "radius": radius,
                    "from_deg": arc_from,
                    "to_deg": arc_from + left * sweep,
                }
            },
            {"line": [pair(end), pair(end + last * after)]},
        ]
    }


def pair(z):
    return [z.real, z.imag]


limits = st.fixed_dictionaries(
    {
        "speed_limit_mm_s": st.floats(1.0, 60.0),
        "travel_speed_limit_mm_s": st.floats(5.0, 60.0),
        "acceleration_limit_mm_s2": st.floats(5.0, 100.0),
        "ramp_s": st.floats(0.2, 2.0),
    }
)
drawings = st.lists(st.one_of(polylines(), arcs(), tangent_paths()), min_size=1, max_size=2)


def to_edge(position, a, b):
    along = np.clip((position - a) @ (b - a) / np.dot(b - a, b - a), 0.0, 1.0)
    return np.linalg.norm(position - a - along[:, None] * (b - a), axis=1)
