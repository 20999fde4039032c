"""The shipped bench with Dynamixel motors, emulated: work on the rig, a run and its replay, faults of a script."""

from __future__ import annotations

import time

import numpy as np
import pytest

from support import short_runs
from support.loopback import PATIENT, free_ports
from support.punctual import on_a_punctual_computer
from support.short_runs import SHORT
from tcr_hardware.dynamixel import table
from tcrctl.commissioning.check import check_rig
from tcrctl.commissioning.jog import Jog, jog_rig
from tcrctl.commissioning.zero import reset_rig, zero_rig
from tcrctl.config import shipped
from tcrctl.emulate.bench import EmulatedBench
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.errors import ArmingRefusedError, InputError
from tcrctl.experiment.prepare import prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.plant.rig.file import load_rig, read_rig
from tcrctl.plant.rig.operation import Operation
from tcrctl.replay.replay import replay
from tcrctl.robot.description import load_robot

pytestmark = pytest.mark.slow

NAMES = ("c1", "c2", "c3")
#: A busy computer may pause for so long; that of a real bench is tried in the fault matrix.
WATCHDOG_MS = 1500
AGREED = Operation(confirmed=True)


@pytest.fixture
def rig(tmp_path):
    """The shipped rig file on ports and lines of its own, with one robot and the patience of a busy computer."""
    text = shipped.rigs()["dynamixel_loopback"].read_text()
    text = text[: text.index("  tcr700:")] + PATIENT + "\n"
    for old, new in zip(("15510", "15511"), free_ports(2), strict=True):
        text = text.replace(old, str(new))
    text = text.replace("/tmp/tcrctl-dynamixel-600", str(tmp_path / "motors"))
    path = tmp_path / "rig.yaml"
    path.write_text(
        text.replace("timeout_ms: 60, watchdog_ms: 400", f"timeout_ms: 400, watchdog_ms: {WATCHDOG_MS}")
    )
    return path


@pytest.fixture
def bench(rig, tcr600):
    with EmulatedBench(read_rig(str(rig))[0], EmulationSettings(rate=100.0), {"tcr600": tcr600}) as opened:
        yield opened


def jog(loaded, by):
    motion = Jog(("c2",), by, None, 0.02)
    return jog_rig(loaded, NAMES, motion, AGREED, dry_run=False, check=lambda: None)


def test_the_bench_is_in_order_is_jogged_and_zeroed(bench, rig, tcr600):
    loaded = load_rig(str(rig), load_robot("tcr600"))
    found = {one.what: one for one in check_rig(loaded, tcr600, 0.05)}
    assert {what: found[what].exit_code for what in ("Dynamixel bus", "limits", "fault", "zeroed", "rings")} == {
        "Dynamixel bus": 0, "limits": 0, "fault": 0, "zeroed": 0, "rings": 0,
    }  # fmt: skip
    assert jog(loaded, 2e-3)["to_mm"]["c2"] == pytest.approx(2.0, abs=0.1)
    assert bench.plcs["tcr600"].positions_um()[1] == pytest.approx(2000, abs=100)
    done = zero_rig(loaded, NAMES, AGREED, dry_run=False)
    assert (done["zeroed"], done["after_mm"]["c2"]) == (True, pytest.approx(0.0, abs=0.05))


def test_a_run_follows_its_path_and_replays(bench, rig, tmp_path):
    experiment = prepare(load_spec("letter_t", (*SHORT, "criteria=[]", "plant.kind=rig", f"plant.rig={rig}")))
    summary = run_experiment(experiment, out=tmp_path / "runs", confirmed=True)
    assert (summary.status, summary.reason) == ("success", "")
    moved = np.ptp([step.measurement.drive for step in read_log(summary.log).steps()], axis=0)
    assert moved.max() > 1e-3
    assert replay(summary.log).status == "identical"


def test_faults_of_a_script_reach_the_motors_and_others_are_refused(bench, rig):
    winches = bench.plcs["tcr600"]
    winches.faults.set("silence")
    assert winches.bus.silent
    winches.faults.clear()
    assert not winches.bus.silent
    with pytest.raises(
        InputError, match="have no fault estop; they have silence, corrupt, delay, drive, jam"
    ):
        winches.faults.set("estop")
    with pytest.raises(InputError, match="jam of emulated Dynamixel motors takes axis, not seconds"):
        winches.faults.set("jam", seconds=1.0)
    with pytest.raises(InputError, match="there is no motor 9; there are 1, 2, 3"):
        winches.faults.set("jam", axis=9)


def until(true, seconds=120.0):
    """The time that it took until something was true [s]."""
    begun = time.monotonic()
    while not true():
        assert time.monotonic() - begun < seconds
        time.sleep(0.002)
    return time.monotonic() - begun


@on_a_punctual_computer
def test_motors_of_a_killed_run_are_stopped_by_their_own_watchdog_in_its_time_and_stay(bench, rig, tmp_path):
    bus, loaded = bench.plcs["tcr600"].bus, load_rig(str(rig), load_robot("tcr600"))
    reset_rig(loaded, NAMES, AGREED, dry_run=False)  # should this be tried again
    start = np.array(list(bus.turns().values()))
    options = short_runs.arguments("plant.kind=rig", f"plant.rig={rig}")
    run = short_runs.start(*options, "--yes", "--out", str(tmp_path / "runs"), cwd=tmp_path)
    until(lambda: run.poll() is not None or np.abs(np.array(list(bus.turns().values())) - start).max() > 20.0)
    assert run.poll() is None, run.communicate()
    run.kill()
    run.communicate()
    armed_for = until(lambda: bus.watchdogs() == [table.TRIPPED] * 3)
    assert armed_for <= 1e-3 * WATCHDOG_MS + 0.1
    stopped = bus.turns()
    assert [motor.get(table.TORQUE_ENABLE) for motor in bus.motors.values()] == [1] * 3
    with pytest.raises(ArmingRefusedError, match="watchdog of the drives has tripped"):
        jog(loaded, 2e-3)
    assert bus.turns() == stopped
    assert reset_rig(loaded, NAMES, AGREED, dry_run=False)["cleared"] is True
    jogged = jog(loaded, 2e-3)
    assert jogged["to_mm"]["c2"] == pytest.approx(jogged["from_mm"]["c2"] + 2.0, abs=0.1)
