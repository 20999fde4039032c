"""The example of other cameras: they keep their promises, and a run on the emulated bench sees through them."""

from __future__ import annotations

import json
import runpy
import socket
import threading
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from support.loopback import free_ports
from support.short_runs import SHORT
from tcrctl.commissioning.check import check_rig
from tcrctl.emulate.bench import EmulatedBench
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.errors import DeviceError, InputError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.plant.rig.assembly import connect_cameras
from tcrctl.plant.rig.file import load_rig, read_rig
from tcrctl.plant.rig.mounting import mounting
from tcrctl.replay.replay import replay
from tcrctl.robot.description import load_robot
from tcrctl.testing import CameraBench, CameraConformance

FOLDER = Path(__file__).parents[2] / "examples" / "udp_markers"
LATE = 0.5


class Bridge:
    """Sends markers at 50 Hz, 4 ms old, to a port; what goes wrong is an attribute."""

    def __init__(self, port, places):
        self.to, self.places = ("127.0.0.1", port), places
        self.silent = self.freeze = self.hide = False
        self.first, self.text, self.more = 0, None, []
        self._out, self._end = socket.socket(socket.AF_INET, socket.SOCK_DGRAM), threading.Event()
        self._thread = threading.Thread(target=self._send)

    def __enter__(self):
        self._thread.start()
        return self

    def __exit__(self, *error):
        self._end.set()
        self._thread.join()
        self._out.close()

    def _send(self):
        random, number = np.random.default_rng(0), self.first
        while not self._end.wait(0.02):
            number += 1
            if self.silent:
                continue
            if not (self.freeze and self.text):
                places = {k: (p + 1e-5 * random.standard_normal(3)).tolist() for k, p in self.places.items()}
                places.update(dict.fromkeys(list(places)[:2]) if self.hide else {})
                self.text = {"frame": number, "age_s": 0.004, "markers": places}
            for datagram in (json.dumps(self.text).encode(), *self.more):
                self._out.sendto(datagram, self.to)


def rig_on(tmp_path, port, plc_port=15600):
    """The rig file of the example on ports of its own, beside its code."""
    text = (FOLDER / "rig.yaml").read_text().replace("15520", str(port)).replace("15600", str(plc_port))
    text = text.replace(
        "stale_after_ms: 100, stale_stop_ms: 400", "stale_after_ms: 1000, stale_stop_ms: 4000"
    )
    text = text.replace("silence_stop_ms: 250", "silence_stop_ms: 4000, following_mm: 20")
    text = text.replace(f"port: {plc_port}}}", f"port: {plc_port}, timeout_ms: 400}}")
    (tmp_path / "udp_markers.py").write_bytes((FOLDER / "udp_markers.py").read_bytes())
    path = tmp_path / "rig.yaml"
    path.write_text(text)
    return path


@pytest.fixture
def stream(tmp_path, tcr600):
    """A bridge that sends the markers of the robot at rest, the rig as loaded, and what is looked for."""
    (port,) = free_ports(1)
    loaded = load_rig(str(rig_on(tmp_path, port)), load_robot("tcr600"))
    wanted = mounting(loaded.mounted, tcr600)
    places = wanted.transform.inverse_apply(wanted.rest)
    named = {marker.label: place for marker, place in zip(wanted.markers, places, strict=True)}
    with Bridge(port, named) as bridge:
        yield bridge, loaded, wanted


@pytest.mark.slow
class TestUdpMarkers(CameraConformance):
    @pytest.fixture
    def bench(self, stream):
        bridge, loaded, wanted = stream
        cameras = loaded.rig.cameras.model_copy(update={"rate_hz": 50.0})
        rig = loaded.rig.model_copy(update={"cameras": cameras})
        slower = replace(loaded, rig=rig)
        return CameraBench(
            open=lambda: connect_cameras(slower, wanted)._made,
            size=wanted.size,
            latency=LATE,
            slack=LATE,
            silence=lambda wrong: setattr(bridge, "silent", wrong),
            freeze=lambda wrong: setattr(bridge, "freeze", wrong),
            hide=lambda wrong: setattr(bridge, "hide", wrong),
        )


NONSENSE = (
    b"",
    b"\xff\xfe",
    b"7",
    b"[" * 50_000,
    b'{"frame": 1}',
    b'{"frame": -1, "markers": {}}',
    b'{"frame": 99999999999999999999, "markers": {}}',
    b'{"frame": 1, "markers": [1]}',
    b'{"frame": 1, "markers": {"a": 1}}',
    b'{"frame": 1, "markers": {"a": [0, 0]}}',
    b'{"frame": 1, "markers": {"a": "abc"}}',
    b'{"frame": 1, "markers": {"a": [NaN, 0, 0]}}',
    b'{"frame": 1, "age_s": 1e9, "markers": {"a": [0, 0, 0]}}',
)


@pytest.mark.slow
def test_datagrams_that_are_no_frames_are_counted_and_change_nothing(stream):
    bridge, loaded, wanted = stream
    bridge.more = NONSENSE
    cameras = connect_cameras(loaded, wanted)
    try:
        for _ in range(5):
            seen = cameras.next(2.0, fresh=True)
            assert seen.valid.all()
        assert cameras.status().malformed >= len(bridge.more)
        assert cameras.clock == ""
    finally:
        cameras.close()


@pytest.mark.slow
def test_a_second_bridge_is_not_used_and_named(stream):
    bridge, loaded, wanted = stream
    cameras = connect_cameras(loaded, wanted)
    try:
        with Bridge(bridge.to[1], {name: place + 0.1 for name, place in bridge.places.items()}):
            for _ in range(20):
                seen = cameras.next(2.0, fresh=True)
                assert np.abs(seen.nodes - wanted.rest).max() < 0.01
        (found,) = cameras.checks([seen])
        assert (found.what, found.exit_code) == ("source", 4)
    finally:
        cameras.close()


@pytest.mark.slow
def test_labels_that_the_bridge_does_not_send_and_a_silent_bridge_are_told(stream):
    bridge, loaded, wanted = stream
    bridge.places.pop("tcr600_m3.n2")
    with pytest.raises(InputError, match=r"no marker tcr600_m3\.n2; there are tcr600_m1\.n1"):
        connect_cameras(loaded, wanted)
    bridge.silent = True
    with pytest.raises(DeviceError, match="no frame within 2 s"):
        connect_cameras(loaded, wanted)


@pytest.mark.slow
def test_the_rig_file_of_the_example_is_that_of_the_emulated_bench_but_for_the_cameras():
    own, shipped = read_rig(str(FOLDER / "rig.yaml"))[0], read_rig("loopback")[0]
    assert own.robots["tcr600"].model_dump() == shipped.robots["tcr600"].model_dump()
    assert own.safety == shipped.safety


def emulated_rig(command, data, plc):
    """The part of the shipped loopback rig that the example uses, on ports of its own."""
    text = read_rig("loopback")[2].decode()
    text = text[: text.index("  tcr700:")] + text[text.index("\nsafety:") :]
    for old, new in (("15510", command), ("15511", data), ("15600", plc)):
        text = text.replace(old, str(new))
    return text


@pytest.mark.slow
def test_a_run_on_the_emulated_bench_sees_through_the_bridge(tmp_path):
    command, data, plc, port = free_ports(4)
    rig = rig_on(tmp_path, port, plc)
    (tmp_path / "emulated.yaml").write_text(emulated_rig(command, data, plc))
    experiment = prepare(load_spec("letter_t", (*SHORT, "criteria=[]", "plant.kind=rig", f"plant.rig={rig}")))
    program = runpy.run_path(str(FOLDER / "bridge.py"))
    cameras = replace(program["CAMERAS"], command_port=command, data_port=data)
    end = threading.Event()
    settings = EmulationSettings(rate=100.0, watchdog_ms=2000)
    with EmulatedBench(read_rig(str(tmp_path / "emulated.yaml"))[0], settings):
        bridge = threading.Thread(
            target=program["main"], args=(cameras, ("127.0.0.1", port), lambda: not end.is_set())
        )
        bridge.start()
        try:
            found = {one.what: one for one in check_rig(experiment.loaded.rig, experiment.robot, 0.05)}
            summary = run_experiment(experiment, out=tmp_path / "runs", confirmed=True)
        finally:
            end.set()
            bridge.join()
    assert {found[what].exit_code for what in ("cameras", "markers", "rings", "calibration")} == {0}
    assert (summary.status, summary.reason) == ("success", "")
    log = read_log(summary.log)
    frames = [step.measurement.raw for step in log.steps() if step.measurement.raw is not None]
    assert "tcr600_m11.n3" in frames[0].names.split("\n")
    assert [row["kind"] for row in json.loads(log.attachments["plugins.json"][1])] == [
        "./udp_markers.py:CAMERAS"
    ]
    assert replay(summary.log).status == "identical"
