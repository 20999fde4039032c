"""Every fault ends in the state that it must end in, in time, and no set-point ever does what it must not.

The whole matrix with strict times, as a table: ``python benchmarks/fault_matrix.py``.
"""

from __future__ import annotations

import time

import numpy as np
import pytest

from support.fault_matrix import (
    BEFORE,
    CASES,
    PATIENT,
    Loop,
    WatchedEmulators,
    bound,
    play,
    suite_cells,
    violations,
)
from support.punctual import late_or_not, on_a_punctual_computer
from tcr_hardware.modbus.registers import Status
from tcrctl.commissioning.zero import reset_rig
from tcrctl.errors import ArmingRefusedError, InputError, RigStopError
from tcrctl.plant.rig.assembly import build_rig
from tcrctl.plant.rig.operation import Operation

#: What a busy computer may add to any time [s].
LATE = 1.0
WATCHDOG_MS = 400


@pytest.mark.slow
@pytest.mark.parametrize(("case", "phase"), suite_cells(), ids=lambda x: x if isinstance(x, str) else x.name)
@on_a_punctual_computer
def test_a_fault_ends_the_run_safely_and_in_time(case, phase, tcr5x4):
    outcome = play(case, phase, tcr5x4, PATIENT, WATCHDOG_MS)
    with late_or_not():
        assert violations(outcome) == []
    assert outcome.state == case.phases()[phase], outcome.events
    if outcome.error is not None:
        assert outcome.seconds <= bound(case, phase, PATIENT) + LATE
    if phase != "stopping":
        assert outcome.error is not None
    if phase in ("armed", "moving"):
        assert outcome.error.exit_code == case.exit_code, str(outcome.error)
        assert case.says in str(outcome.error)
    if phase == "connect":
        assert len(outcome.sent) == 0
        assert outcome.events == []


@pytest.mark.slow
@on_a_punctual_computer
def test_faults_that_do_no_harm_do_not_stop_the_run(tcr5x4):
    """One after the other in one run; a busy computer may hold it in between."""
    harmless = [case for case in CASES if case.moving == "running"]
    assert len(harmless) > 10
    with WatchedEmulators(tcr5x4, PATIENT, WATCHDOG_MS) as emulators:
        plant = emulators.plant()
        picture = emulators.picture(plant)
        plant.start()
        loop = Loop(plant, picture)
        loop.run(BEFORE)
        for case in harmless:
            emulators.fail(case)
            loop.run(0.15)
            emulators.heal()
            loop.run(0.05)
        assert str(plant.supervisor.state) in ("running", "holding")
        plant.close()
        assert str(plant.supervisor.state) == "disarmed"
        sent = np.array(emulators.sent)[:, :4]
    assert len(sent) > 50
    assert np.abs(np.diff(sent, axis=0)).max() <= 500


@pytest.mark.slow
@on_a_punctual_computer
def test_the_watchdog_catches_a_controller_that_hangs(tcr5x4):
    with WatchedEmulators(tcr5x4, PATIENT, watchdog_ms=150) as emulators:
        plant = emulators.plant()
        plant.start()
        loop = Loop(plant)
        loop.run(0.1)
        time.sleep(0.4)
        assert Status.WATCHDOG in emulators.plc.snapshot()["status"]
        assert Status.ENABLED not in emulators.plc.snapshot()["status"]
        with pytest.raises(RigStopError, match="watchdog"):
            loop.run(1.0)
        plant.close()
        assert str(plant.supervisor.state) == "faulted"


@on_a_punctual_computer
def test_after_a_fault_nothing_is_armed_until_an_operator_has_reset_it(tcr5x4):
    with WatchedEmulators(tcr5x4, PATIENT, WATCHDOG_MS) as emulators:
        emulators.plc.press_estop()
        time.sleep(0.02)
        names = tcr5x4.cable_names
        agreed, not_agreed = Operation(confirmed=True), Operation(confirmed=False)
        with pytest.raises(ArmingRefusedError, match="emergency stop is pressed"):
            reset_rig(emulators.loaded(), names, agreed, dry_run=False)
        emulators.plc.release_estop()
        plant = emulators.plant()
        with pytest.raises(ArmingRefusedError, match="fault"):
            plant.start()
        plant.close()
        with pytest.raises(ArmingRefusedError, match="--yes"):
            reset_rig(emulators.loaded(), names, not_agreed, dry_run=False)
        assert reset_rig(emulators.loaded(), names, agreed, dry_run=True)["cleared"] is False
        assert reset_rig(emulators.loaded(), names, agreed, dry_run=False)["cleared"] is True
        assert reset_rig(emulators.loaded(), names, agreed, dry_run=False) == {
            "fault": None,
            "cleared": False,
        }
        plant = emulators.plant()
        plant.start()
        plant.close()
        assert str(plant.supervisor.state) == "disarmed"


@on_a_punctual_computer
def test_a_rig_file_that_allows_more_than_the_plc_is_refused(tcr5x4):
    with WatchedEmulators(tcr5x4, {**PATIENT, "max_step_mm": 7.0}, WATCHDOG_MS, high_mm=30) as emulators:
        with pytest.raises(InputError) as caught:
            emulators.plant()
        assert "cable c3: -20 to 30 mm on axis 3, PLC -25 to 25 mm" in str(caught.value)
        assert "max_step_mm 7 mm, PLC 6 mm" in str(caught.value)
    with (
        WatchedEmulators(tcr5x4, PATIENT, watchdog_ms=200) as emulators,
        pytest.raises(InputError, match="watchdog"),
    ):
        build_rig(emulators.loaded(), tcr5x4, 0.15, Operation())


@on_a_punctual_computer
def test_a_label_that_the_cameras_do_not_know_is_refused(tcr5x4):
    with WatchedEmulators(tcr5x4, PATIENT, WATCHDOG_MS) as emulators:
        emulators.motive.change_models([f"marker.{i}" for i in range(15)])
        with pytest.raises(InputError, match=r"tracks no marker m1.n1"):
            emulators.plant()
