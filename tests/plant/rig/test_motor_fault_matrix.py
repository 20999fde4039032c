"""Every fault of Dynamixel motors ends in the state that it must end in, in time; a killed run leaves them stopped.

All phases with strict times, as a table: ``python benchmarks/fault_matrix.py``.
"""

from __future__ import annotations

import time

import numpy as np
import pytest

from support.fault_matrix import BEFORE, PATIENT, Loop, bound, play, violations
from support.motor_matrix import CASES, SUITE, WatchedMotors
from support.punctual import late_or_not, on_a_punctual_computer
from tcr_hardware.dynamixel import table
from tcrctl.errors import RigStopError

pytestmark = pytest.mark.slow

#: What a busy computer may add to any time [s].
LATE = 1.0
WATCHDOG_MS = 400
CELLS = [(case, phase) for case in CASES for phase in SUITE.get(case.name, ())]


@pytest.mark.parametrize(("case", "phase"), CELLS, ids=lambda x: x if isinstance(x, str) else x.name)
@on_a_punctual_computer
def test_a_fault_of_the_motors_ends_the_run_safely_and_in_time(case, phase, tcr5x4):
    outcome = play(case, phase, tcr5x4, PATIENT, WATCHDOG_MS, WatchedMotors)
    with late_or_not():
        assert violations(outcome) == []
    assert outcome.state == case.phases()[phase], outcome.events
    assert outcome.error is not None
    assert outcome.seconds <= bound(case, phase, PATIENT) + LATE
    if phase in ("armed", "moving"):
        assert case.says in str(outcome.error)
    if phase == "connect":
        assert len(outcome.sent) == 0


@on_a_punctual_computer
def test_faults_of_the_motors_that_do_no_harm_do_not_stop_the_run(tcr5x4):
    with WatchedMotors(tcr5x4, PATIENT, WATCHDOG_MS) as emulators:
        plant = emulators.plant()
        plant.start()
        loop = Loop(plant)
        loop.run(BEFORE)
        for case in (case for case in CASES if case.moving == "running"):
            emulators.fail(case)
            loop.run(0.1)
            emulators.heal()
        assert str(plant.supervisor.state) in ("running", "holding")
        plant.close()
        assert str(plant.supervisor.state) == "disarmed"
    assert len(emulators.sent) > 10
    assert np.abs(np.diff(emulators.sent, axis=0)).max() <= 500


@on_a_punctual_computer
def test_the_bus_watchdog_catches_a_controller_that_hangs(tcr5x4):
    with WatchedMotors(tcr5x4, PATIENT, watchdog_ms=150) as emulators:
        plant = emulators.plant()
        plant.start()
        loop = Loop(plant)
        loop.run(0.1)
        time.sleep(0.4)
        assert emulators.plc.bus.watchdogs() == [table.TRIPPED] * 4
        with pytest.raises(RigStopError, match="watchdog"):
            loop.run(1.0)
        plant.close()
        assert str(plant.supervisor.state) == "faulted"
