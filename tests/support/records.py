"""Step records for tests: those of a swaying robot, and arbitrary ones drawn by hypothesis."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np
from hypothesis import strategies as st

from tcrctl.log.geometry import CableHoles, LogGeometry
from tcrctl.signals import (
    Command,
    ControlInfo,
    Estimate,
    Measurement,
    RawFrame,
    Reference,
    StepRecord,
    Timing,
    Truth,
)

EPOCH_NS = 1_795_000_000_000_000_000
PERIOD_S = 0.05
ATTACHMENTS = {
    "spec.yaml": ("application/yaml", b"robot: tcr700\n"),
    "versions.json": ("application/json", b"{}"),
}
START = {"run_id": "20261122-061500Z_test", "robot": "test"}


def geometry(n_modules: int = 3, n_cables: int = 3) -> LogGeometry:
    """Straight cables through node 1, 2 or 3 of every ring; markers on every ring but the base."""
    rings = np.arange(n_modules + 1)
    routes = tuple(
        CableHoles(
            name=f"c{j + 1}",
            nodes=4 * rings[:, None] + np.arange(3),
            weights=np.tile(np.eye(3)[j % 3], (n_modules + 1, 1)),
        )
        for j in range(n_cables)
    )
    markers = tuple(4 * i + j for i in range(1, n_modules + 1) for j in range(3))
    springs = np.array([[4 * i + 3, 4 * (i + 1) + j] for i in range(n_modules) for j in range(3)])
    path = np.stack([np.linspace(0.0, 0.1, 20), np.zeros(20), np.full(20, -0.6)], axis=1)
    return LogGeometry(n_modules, routes, markers, tip_ring=n_modules, springs=springs, reference_path=path)


def shape(t: float, n_modules: int, rng: np.random.Generator) -> np.ndarray:
    """Node positions of a hanging robot that sways, with rounding noise in every digit."""
    angle = 2 * np.pi * np.arange(3) / 3
    ring = np.stack([0.035 * np.cos(angle), 0.035 * np.sin(angle), np.zeros(3)], axis=-1)
    module = np.vstack([ring, [0.0, 0.0, -0.0558]])
    depth = 0.04955 * np.arange(n_modules + 1)
    sway = 0.1 * np.sin(0.5 * t) * (depth / 0.65) ** 2
    centre = np.stack([sway, 0.3 * sway, -depth], axis=-1)
    nodes = centre[:, None, :] + module
    nodes[1:] += 1e-5 * rng.standard_normal(nodes[1:].shape)
    return nodes.ravel()


def record(k: int, n_modules: int = 3, n_cables: int = 3, *, period: float = PERIOD_S) -> StepRecord:
    """Step k of a swaying robot: every number of full entropy, as a run produces them."""
    rng = np.random.default_rng(k)
    t = k * period
    q = shape(t, n_modules, rng)
    truth_q = shape(t, n_modules, rng)
    free = np.repeat(np.arange(n_modules + 1) > 0, 12)
    nodes = truth_q.reshape(-1, 4, 3)[1:, :3].reshape(-1, 3)
    drive = 0.01 * np.sin(0.5 * t + np.arange(n_cables))
    speed = 0.005 * np.cos(0.5 * t + np.arange(n_cables)) + 1e-4 * rng.standard_normal(n_cables)
    tension = 5.0 + rng.standard_normal(n_cables)
    up = np.array([0.0, 0.0, 1.0])
    tip, true_tip = nodes[-3:].mean(axis=0), truth_q.reshape(-1, 4, 3)[-1, :3].mean(axis=0)
    return StepRecord(
        k=k,
        t=t,
        period=period,
        reference=Reference(t, tip + 1e-3, up, np.tile(tip, (1, 1)), np.tile(up, (1, 1))),
        measurement=Measurement(
            t - 0.01,
            (nodes + 5e-5 * rng.standard_normal(nodes.shape)).astype(np.float32),
            np.ones(len(nodes), np.bool_),
            drive,
        ),
        estimate=Estimate(
            t,
            q,
            0.01 * rng.standard_normal(q.size) * free,
            drive,
            tension,
            tip,
            up,
            np.zeros_like(q),
            True,
        ),
        wanted=Command(speed * 1.1, drive + speed * period),
        applied=Command(speed, drive + speed * period),
        info=ControlInfo(
            True,
            4,
            1e-9 * rng.random(),
            1e-14,
            7,
            speed > 0.005,
            tension + 0.1,
            1e-3 * rng.standard_normal(3),
        ),
        truth=Truth(true_tip, up, tension, truth_q),
        timing=Timing(1e-4, 5e-4, 1e-3 * (1 + rng.random()), 2e-3, 0.0),
    )


def _bits(dtype: Any, length: int) -> st.SearchStrategy[np.ndarray]:
    """Arrays of arbitrary bit patterns: every NaN payload, both zeros, subnormals."""
    size = length * np.dtype(dtype).itemsize
    return st.binary(min_size=size, max_size=size).map(lambda data: np.frombuffer(data, dtype).copy())


_NUMBER = st.floats(allow_nan=True, allow_infinity=True)
_TIME = st.floats(min_value=0.0, max_value=1e6)


@st.composite
def steps(draw: st.DrawFn) -> StepRecord:
    """An arbitrary step: arrays of any length and any bit pattern, optional parts there or not."""
    n, m, p, h = (draw(st.integers(0, 6)) for _ in range(4))

    def doubles(length: int) -> np.ndarray:
        return draw(_bits(np.float64, length))

    def vectors(rows: int) -> np.ndarray:
        return doubles(3 * rows).reshape(rows, 3)

    def bools(length: int) -> np.ndarray:
        return np.array(draw(st.lists(st.booleans(), min_size=length, max_size=length)), np.bool_)

    def integers(length: int) -> np.ndarray:
        return draw(_bits(np.int32, length))

    optional = draw(st.tuples(*[st.booleans()] * 5))
    r = draw(st.integers(0, 6))
    frames = (draw(st.integers(0, 2**63)), draw(st.integers(0, 9)), draw(_NUMBER), integers(r))
    return StepRecord(
        k=draw(st.integers(0, 2**32 - 1)),
        t=draw(_TIME),
        period=draw(_NUMBER),
        reference=Reference(
            draw(_NUMBER),
            doubles(3),
            doubles(3) if optional[0] else None,
            vectors(h),
            vectors(h) if optional[1] else None,
            doubles(m) if optional[3] else None,
        ),
        measurement=Measurement(
            draw(_NUMBER),
            draw(_bits(np.float32, 3 * p)).reshape(p, 3),
            bools(p),
            doubles(m),
            RawFrame(
                *frames,
                draw(_bits(np.float32, 3 * r)).reshape(r, 3),
                integers(r),
                draw(st.none() | st.text(max_size=5)),
            )
            if optional[4]
            else None,
        ),
        estimate=Estimate(
            draw(_NUMBER),
            doubles(3 * n),
            doubles(3 * n),
            doubles(m),
            doubles(m),
            doubles(3),
            doubles(3),
            doubles(3 * n),
            draw(st.booleans()),
        ),
        wanted=Command(doubles(m), doubles(m)),
        applied=Command(doubles(m), doubles(m)),
        info=ControlInfo(
            draw(st.booleans()),
            draw(st.integers(-(2**63), 2**63 - 1)),
            draw(_NUMBER),
            draw(_NUMBER),
            draw(st.integers(-1, 100)),
            bools(m),
            doubles(m),
            doubles(draw(st.sampled_from([0, 3, 6]))),
            draw(st.text(max_size=20).filter(lambda text: text.isprintable())),
        ),
        truth=Truth(doubles(3), doubles(3), doubles(m), doubles(3 * n)) if optional[2] else None,
        timing=Timing(*(draw(_NUMBER) for _ in range(5))),
    )


def fingerprint(value: Any) -> Any:
    """Everything about a record that must survive, floats and arrays as bytes so that NaN equals NaN.

    Checksums are left out: the log adds them.
    """
    if dataclasses.is_dataclass(value):
        names = [f.name for f in dataclasses.fields(value) if f.name != "checksums"]
        return {name: fingerprint(getattr(value, name)) for name in names}
    if isinstance(value, np.ndarray):
        return value.dtype.str, value.shape, value.tobytes()
    if isinstance(value, float):
        return np.float64(value).tobytes()
    return value
