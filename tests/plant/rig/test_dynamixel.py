"""Dynamixel motors on an emulated bus: promises of drives, and what is peculiar to them."""

from __future__ import annotations

import time

import numpy as np
import pytest

from tcr_hardware.dynamixel import table
from tcr_hardware.emulators.dynamixel import DynamixelEmulator
from tcrctl.errors import DeviceError, InputError
from tcrctl.plant.rig.devices import DriveControl
from tcrctl.plant.rig.dynamixel_drives import DynamixelDrives
from tcrctl.plant.rig.mounting import CableAxis
from tcrctl.plant.rig.settings import Dynamixel
from tcrctl.testing import DriveBench, DriveConformance

pytestmark = pytest.mark.slow

#: A busy computer answers late; what is tried here does not depend on it.
LATE = 0.5
TURN_MM = 150.0
COUNT_UM = 1e3 * TURN_MM / table.TURN
CABLES = (
    CableAxis("c1", 1, 1, -20_000, 60_000, 50_000.0),
    CableAxis("c2", 7, -1, -20_000, 20_000, 50_000.0),
    CableAxis("c3", 3, 1, -20_000, 60_000, 50_000.0),
)
IDS = (1, 7, 3)
ON = DriveControl(enable=True, permit=True)
MOVING = DriveControl(enable=True, permit=True, follow=True)


@pytest.fixture
def emulator():
    with DynamixelEmulator(dict.fromkeys(IDS, 1100)) as opened:
        yield opened


def drives(emulator, **changes):
    given = {"mm_per_turn": TURN_MM, "timeout_ms": 200.0, "watchdog_ms": 1500.0, **changes}
    return DynamixelDrives(Dynamixel(kind="dynamixel", device=emulator.device, **given), CABLES)


class TestDynamixelDrives(DriveConformance):
    @pytest.fixture
    def bench(self, emulator):
        return DriveBench(
            open=lambda: drives(emulator),
            cables=3,
            still=int(2 * COUNT_UM),
            near=int(3 * COUNT_UM),
            answer=4 * LATE,
            stop=4 * LATE,
            emulated=True,
            silence=lambda wrong: setattr(emulator, "silent", wrong),
        )


@pytest.fixture
def opened(emulator):
    made = drives(emulator)
    yield made
    made.close()


def switched_on(made):
    start = made.status().position
    for _ in range(3):
        found = made.exchange(start, ON)
    assert found.enabled
    return start


def test_zero_is_the_homing_offset_of_the_motors_and_stays_when_the_line_is_closed(emulator, opened):
    assert not opened.status().zeroed
    place = opened.status().position
    assert place.tolist() == [round(76 * COUNT_UM), -round(76 * COUNT_UM), round(76 * COUNT_UM)]
    found = opened.exchange(place, DriveControl(permit=True, zero=True))
    assert found.zeroed
    assert np.abs(found.position).max() <= COUNT_UM
    assert {motor.get(table.HOMING_OFFSET) for motor in emulator.motors.values()} == {1024 - 1100}
    assert all(motor.get(table.TORQUE_ENABLE) for motor in emulator.motors.values())
    opened.close()
    assert drives(emulator).status().zeroed


def test_a_horn_that_is_too_far_from_zero_is_refused_with_its_motor():
    with DynamixelEmulator({1: 1100, 7: 3000, 3: 1100}) as emulator:
        made = drives(emulator)
        found = made.exchange(made.status().position, DriveControl(permit=True, zero=True))
        assert "motor 7: its horn" in found.reject
        assert not found.zeroed
        made.close()


def test_motors_hold_when_they_are_off_and_when_the_program_is_gone(emulator, opened):
    switched_on(opened)
    opened.exchange(opened.status().position, DriveControl())
    opened.close()
    assert all(motor.get(table.TORQUE_ENABLE) for motor in emulator.motors.values())


def test_the_speed_of_the_motors_is_bounded_by_their_profile(emulator, opened):
    switched_on(opened)
    units = emulator.motors[1].get(table.PROFILE_VELOCITY)
    speed = units * table.VELOCITY_UNIT * TURN_MM * 1e3
    assert 0.95 * CABLES[0].speed < speed <= CABLES[0].speed


def test_set_points_are_reached_in_a_period_and_not_before(emulator, opened):
    target = switched_on(opened)
    opened.load(0.2)
    unit = table.VELOCITY_UNIT * TURN_MM * 1e3
    for way in (4_000, 800):  # 4 mm in 0.2 s, less than the 50 mm/s of the cables, and slower
        target = target + np.array([way, way, 0])
        opened.exchange(target, MOVING)
        speed = emulator.motors[1].get(table.PROFILE_VELOCITY) * unit
        assert way <= 0.2 * speed <= 1.1 * way + 0.2 * unit
        assert emulator.motors[3].get(table.PROFILE_VELOCITY) == 1
        time.sleep(0.25)
        assert np.abs(opened.status().position - target).max() <= COUNT_UM


def test_a_motor_whose_position_loop_lags_is_not_sent_slower_for_it(emulator, opened):
    """On the way back it stands where it shall be, but its profile is elsewhere."""
    start = switched_on(opened)
    opened.load(0.2)
    for motor in emulator.motors.values():
        motor.servo.jammed = True
    opened.exchange(start + np.array([4_000, 0, 0]), MOVING)
    opened.exchange(start, MOVING)
    speed = emulator.motors[1].get(table.PROFILE_VELOCITY) * table.VELOCITY_UNIT * TURN_MM * 1e3
    assert 0.2 * speed >= 4_000


def test_a_motor_that_shuts_down_is_a_fault_that_no_reset_clears(emulator, opened):
    place = switched_on(opened)
    emulator.motors[7].fail(table.HardwareFault.OVERLOAD)
    found = opened.exchange(place, MOVING)
    assert found.fault == "motor 7: overload"
    for control in (DriveControl(), DriveControl(reset=True), DriveControl()):
        found = opened.exchange(place, control)
    assert found.fault == "motor 7: overload"
    found = opened.exchange(place, ON)
    assert not found.enabled


def test_a_motor_that_lost_its_torque_is_a_fault(emulator, opened):
    place = switched_on(opened)
    emulator.motors[3].write(table.TORQUE_ENABLE.address, b"\0")
    assert opened.exchange(place, MOVING).fault == "motor 3: torque is off"


def test_one_garbled_answer_is_asked_for_again(emulator, opened):
    place = switched_on(opened)
    emulator.corrupt = 1
    assert opened.exchange(place, MOVING).enabled


def test_another_program_sees_that_they_are_taken(emulator, opened):
    switched_on(opened)
    other = drives(emulator)
    assert other.status().enabled
    other.close()


def test_what_does_not_fit_the_rig_file_is_refused_when_the_line_is_opened(emulator, tmp_path):
    with pytest.raises(
        InputError, match="operating mode 5 is needed; motor 1 in 3, motor 7 in 3, motor 3 in 3"
    ):
        drives(emulator, current_limit_ma=500.0)
    emulator.silent = True
    with pytest.raises(DeviceError, match="motor 1 does not answer"):
        drives(emulator, timeout_ms=20.0)
    emulator.silent = False
    with pytest.raises(DeviceError, match="12345 baud is no rate"):
        drives(emulator, baud=12345)
    missing = Dynamixel(kind="dynamixel", device=str(tmp_path / "none"), mm_per_turn=TURN_MM)
    with pytest.raises(DeviceError, match="cannot be opened"):
        DynamixelDrives(missing, CABLES)


def test_the_current_is_bounded_in_the_mode_that_can(emulator):
    with DynamixelEmulator(dict.fromkeys(IDS, 1100), mode=table.Mode.CURRENT_POSITION) as current:
        made = drives(current, current_limit_ma=500.0)
        switched_on(made)
        assert {motor.get(table.GOAL_CURRENT) for motor in current.motors.values()} == {185}
        made.close()


def test_a_slow_line_or_watchdog_is_refused(emulator):
    slow = drives(emulator, baud=57600)
    with pytest.raises(InputError, match=r"takes 104\.5 ms, too long"):
        slow.load(0.02)
    assert 0.0 < slow.load(0.2) < 1.0
    slow.close()
    hasty = drives(emulator, watchdog_ms=100.0)
    with pytest.raises(InputError, match="watchdog_ms must be at least 210 for 50 ms"):
        hasty.load(0.05)
    hasty.close()


def test_a_killed_program_leaves_them_stopped_by_their_own_watchdog(emulator):
    """Nothing is sent any more: neither closed nor switched off."""
    gone = drives(emulator, watchdog_ms=400.0)
    start = switched_on(gone)
    gone.exchange(start + np.array([15_000, -15_000, 15_000]), MOVING)
    time.sleep(0.4 + LATE)
    later = drives(emulator)
    found = later.status()
    assert (found.watchdog, found.enabled) == (True, False)
    time.sleep(0.2)
    assert np.abs(later.status().position - found.position).max() <= COUNT_UM
    later.close()
    gone.close()
