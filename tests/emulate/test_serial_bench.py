"""PLCs on a serial line are emulated from a rig file, at the name that it gives."""

from __future__ import annotations

import sys

import pytest

from support.loopback import patient_rig
from tcrctl.commissioning.jog import Jog, jog_rig
from tcrctl.commissioning.status import rig_status
from tcrctl.config import strict_yaml
from tcrctl.emulate.bench import EmulatedBench
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.file import load_rig, read_rig
from tcrctl.plant.rig.operation import Operation
from tcrctl.robot.description import load_robot

pytestmark = [
    pytest.mark.slow,
    pytest.mark.skipif(sys.platform == "win32", reason="there are no pseudo-terminals"),
]
NAMES = ("c1", "c2", "c3")


@pytest.fixture
def rig(tmp_path):
    """Path of a rig with one robot on a serial line, and the name of the line."""
    data = strict_yaml.loads(patient_rig()).data
    line = tmp_path / "plc"
    plc = {"kind": "modbus_rtu", "device": str(line), "timeout_ms": 400}
    one = {**data["robots"]["tcr600"], "plc": plc}
    path = tmp_path / "serial.yaml"
    path.write_text(strict_yaml.dumps({**data, "robots": {"tcr600": one}}))
    return path, line


def bench(path, tcr600):
    settings = EmulationSettings(rate=50.0, watchdog_ms=2000)
    return EmulatedBench(read_rig(str(path))[0], settings, {"tcr600": tcr600})


def test_a_jog_over_an_emulated_serial_line_arrives_and_the_line_goes_with_the_bench(rig, tcr600):
    path, line = rig
    loaded = load_rig(str(path), load_robot("tcr600"))
    with bench(path, tcr600) as emulated:
        assert emulated.places == {"tcr600": str(line)}
        motion = Jog(("c2",), 1e-3, None, 0.02)
        moved = jog_rig(loaded, NAMES, motion, Operation(confirmed=True), dry_run=False, check=lambda: None)
        assert moved["to_mm"]["c2"] == pytest.approx(1.0, abs=0.1)
        assert emulated.plcs["tcr600"].positions_um()[1] == pytest.approx(1000, abs=100)
        assert rig_status(loaded, NAMES).exit_code == 0
    assert not line.is_symlink()


def test_a_name_that_is_taken_is_left_alone(rig, tcr600):
    path, line = rig
    line.write_text("a device")
    with pytest.raises(DeviceError, match=r"plc: File exists"), bench(path, tcr600):
        pass
    assert line.read_text() == "a device"
    line.unlink()
    line.symlink_to("gone")  # left by a bench that was killed
    with bench(path, tcr600):
        assert line.exists()


def test_devices_that_are_plug_ins_cannot_be_emulated_and_say_so(rig, tcr600, tmp_path):
    path, _ = rig
    code = (
        "from tcrctl.extend import DriveSection\nclass Keys(DriveSection):\n    pass\nDRIVES = (Keys, dict)\n"
    )
    (tmp_path / "own.py").write_text(code)
    data = strict_yaml.load(path).data
    data["robots"]["tcr600"]["plc"] = {"kind": "./own.py:DRIVES"}
    path.write_text(strict_yaml.dumps(data))
    with pytest.raises(InputError, match="only shipped kinds of drives"), bench(path, tcr600):
        pass
