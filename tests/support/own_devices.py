"""A bench without wires as a plug-in: cameras and drives with the members of the protocols and no others.

The robot stands still but for the noise of its markers. Drives keep their state for as long as the process lives.
"""

from __future__ import annotations

from textwrap import dedent

DEVICES = '''
    import time
    from dataclasses import replace

    import numpy as np
    from tcrctl.extend import (
        CameraSection, CameraStatus, DeviceLimits, DriveSection, DriveStatus, Finding, Identity, LabelledMarkers,
        Positive, quantity,
    )

    BASE = {base}
    STATE = {{"position": np.zeros(4, np.int64), "fault": "", "zeroed": True}}


    class CameraKeys(CameraSection):
        """Cameras of a test."""

        rate_hz: Positive = quantity("Hz", "frames per second", 200.0)


    class FakeCameras:
        clock = ""

        def __init__(self, settings, mounting):
            seen = mounting.transform.inverse_apply(mounting.rest)
            places = {{marker.label: place for marker, place in zip(mounting.markers, seen)}}
            self._places = {{label: BASE.get(label, place) for label, place in places.items()}}
            self._finder, self._random = LabelledMarkers(mounting), np.random.default_rng(1)
            self.rate, self._last = settings.rate_hz, 0
            self.identity = Identity("cameras", "cameras of a test", "test 1.0", {{"server": "test"}})

        def next(self, timeout, *, fresh):
            k = int(time.monotonic() * self.rate)
            k = max(k, self._last) + 1 if fresh or k <= self._last else k
            wait = k / self.rate - time.monotonic()
            time.sleep(min(max(0.0, wait), timeout))
            if wait > timeout:
                return None
            self._last = k
            markers = {{name: p + 2e-5 * self._random.standard_normal(3) for name, p in self._places.items()}}
            return self._finder.sighting(k / self.rate, markers, number=k, delay=0.001)

        def status(self):
            return CameraStatus(markers=len(self._places))

        def checks(self, seen):
            yield Finding("lenses", f"clean in {{len(seen)}} frames")

        def close(self):
            pass


    class DriveKeys(DriveSection):
        """Drives of a test."""

        watchdog_ms: Positive = quantity("ms", "watchdog", 500.0)


    class FakeDrives:
        def __init__(self, settings, cables):
            m = len(cables)
            self.identity = Identity("drives", "drives of a test", "test 2.0")
            self.limits = DeviceLimits(np.full(m, -1e5), np.full(m, 1e5), 1e5, 1e4)
            self.watchdog = settings.watchdog_ms / 1e3
            self._on = self._was_zero = False

        def load(self, period):
            return 0.01

        def status(self):
            return DriveStatus(
                STATE["position"].copy(), enabled=self._on, zeroed=STATE["zeroed"], fault=STATE["fault"]
            )

        def exchange(self, target, control):
            if control.zero and not self._was_zero:
                STATE.update(position=np.zeros_like(target), zeroed=True)
            if control.reset:
                STATE.update(fault="")
            self._was_zero = control.zero
            self._on = control.enable and control.permit and not STATE["fault"]
            if self._on and control.follow:
                STATE["position"] = target.copy()
            return self.status()

        def checks(self):
            return [Finding("grease", "fresh")]

        def close(self):
            pass


    CAMERAS = (CameraKeys, FakeCameras)
    DRIVES = (DriveKeys, FakeDrives)
'''
RIG = """
    name: own
    cameras: {kind: './devices.py:CAMERAS', up_axis: z}
    robots:
      tcr5x4:
        plc: {kind: './devices.py:DRIVES'}
        cables:
          c1: {axis: 1, min_mm: -20, max_mm: 20}
          c2: {axis: 2, min_mm: -20, max_mm: 20}
          c3: {axis: 3, min_mm: -20, max_mm: 20}
          c4: {axis: 4, min_mm: -20, max_mm: 20}
        markers: {labels: 'm{ring}.n{node}'}
        calibration: {translation_m: [0.1, -0.2, 0.3]}
    safety: {stale_after_ms: 1000, stale_stop_ms: 4000, silence_stop_ms: 4000}
"""
EXPERIMENT = """
    name: own_bench
    robot: tcr5x4
    trajectory: {kind: hold, duration_s: 0.4}
    controller: {kind: kinematic}
    plant: {kind: rig, rig: own.yaml}
    safety: {picture: {judged: false}}
"""


def write_bench(folder, robot, old="", new=""):
    """Write rig, devices with one text replaced, and an experiment; returns the path of the rig file."""
    ring = robot.rest.q.reshape(-1, 3)[:3] - [0.1, -0.2, 0.3]
    base = {f"base.n{i}": place.tolist() for i, place in enumerate(ring, start=1)}
    code = dedent(DEVICES.format(base=base))
    assert old in code
    folder.mkdir(exist_ok=True)
    (folder / "devices.py").write_text(code.replace(old, new, 1) if old else code)
    (folder / "own.yaml").write_text(dedent(RIG))
    (folder / "bench.yaml").write_text(dedent(EXPERIMENT))
    return folder / "own.yaml"
