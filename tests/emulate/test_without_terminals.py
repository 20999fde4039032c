"""On a system without serial terminals of Unix the bench is emulated all the same, over TCP."""

from __future__ import annotations

import json
import subprocess
import sys

import pytest

from support.loopback import patient_rig

#: Modules that Windows does not have.
ABSENT = ("fcntl", "grp", "pty", "pwd", "resource", "termios", "tty")
HIDE = f"import sys; sys.modules.update(dict.fromkeys({ABSENT!r}))\n"


def program(text, *arguments):
    return subprocess.run(
        [sys.executable, "-c", HIDE + text, *arguments], capture_output=True, text=True, check=False
    )


@pytest.mark.slow
def test_emulate_starts(tmp_path):
    (tmp_path / "rig.yaml").write_text(patient_rig())
    done = program(
        "from tcrctl.cli.app import main; sys.exit(main(['emulate', sys.argv[1], '--for-s', '0', '--json']))",
        str(tmp_path / "rig.yaml"),
    )
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["status"] == "ok"


def test_a_serial_line_says_why_it_cannot_be_emulated():
    done = program(
        "from tcr_hardware.emulators.modbus_rtu import RtuPort\n"
        "from tcr_hardware.errors import HardwareError\n"
        "try:\n    RtuPort(None, None, 0)\nexcept HardwareError as error:\n    print(error)"
    )
    assert done.stdout.startswith("a serial line can be emulated on Linux and macOS only"), done.stderr
