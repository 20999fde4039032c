"""The emulated bench as a real one: its robots, drives and markers are those of a realistic simulated plant."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from tcr_hardware.dynamixel import table
from tcr_hardware.emulators.dynamixel_motor import DynamixelMotor
from tcr_hardware.servo import ServoSettings
from tcrctl.emulate.drives import emulated_drives
from tcrctl.emulate.imperfections import Imperfections
from tcrctl.emulate.robot import EmulatedRobot
from tcrctl.emulate.settings import EmulationSettings
from tcrctl.plant.rig.file import read_rig
from tcrctl.plant.settings import Mismatch, SimulatedSettings
from tcrctl.plant.simulated import SimulatedPlant
from tcrctl.signals import Command

MISMATCH = Mismatch(springs_youngs_modulus=0.7)


def mounted(*cables):
    """A mounted robot with cables (axis, sign)."""
    names = [f"c{i}" for i in range(1, len(cables) + 1)]
    return SimpleNamespace(
        cables={name: SimpleNamespace(axis=a, sign=s) for name, (a, s) in zip(names, cables, strict=True)}
    )


FOUR = mounted((4, 1), (2, -1), (1, 1), (6, -1))


def test_off_is_the_robot_and_the_drives_that_always_were(tcr5x4):
    real = Imperfections("tcr5x4", tcr5x4, MISMATCH, "off", 1)
    assert real.robot is tcr5x4
    assert real.servos(FOUR, 6) == (ServoSettings(),) * 6
    assert (real.lost_markers, real.lost_frames) == (0.0, 0.0)
    rings = np.random.default_rng(0).random((18, 3))
    np.testing.assert_allclose(real.markers(rings), rings, rtol=0, atol=1e-15)


def test_every_axis_gets_the_drive_of_its_cable_with_the_sign_of_its_winch(tcr5x4):
    real = Imperfections("tcr5x4", tcr5x4, MISMATCH, "moderate", 1)
    drives, servos = real.plant.drives, real.servos(FOUR, 6)
    for c, cable in enumerate(FOUR.cables.values()):
        servo = servos[cable.axis - 1]
        assert servo.lag_s == drives.lag_s
        assert servo.backlash_um == pytest.approx(200.0)
        assert servo.zero_error_um == pytest.approx(1e3 * cable.sign * drives.zero_error_mm[c])
        assert servo.radius_error == drives.radius_error[c]
    assert servos[2] == servos[4] == ServoSettings()


def test_markers_sit_beside_their_nodes_those_of_the_base_do_not(tcr5x4):
    real = Imperfections("tcr5x4", tcr5x4, MISMATCH, "moderate", 1)
    rings = tcr5x4.rest.q.reshape(-1, 4, 3)[:, :3].reshape(-1, 3)
    seen = real.markers(rings)
    draw = real._draw
    np.testing.assert_allclose(seen[:3], draw.in_frame(rings[:3]), rtol=0, atol=1e-15)
    back = (seen - draw.translation) @ np.linalg.inv(draw.in_frame(np.eye(3)) - draw.translation)
    np.testing.assert_allclose(np.linalg.norm(back[3:] - rings[3:], axis=1), 1e-3, rtol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("level", ["off", "moderate"])
def test_the_robot_moves_as_that_of_a_simulated_plant_with_ideal_drives(tcr5x4, level):
    real = Imperfections("tcr5x4", tcr5x4, MISMATCH, level, 1)
    ideal = real.plant.model_copy(
        update={"drives": None, "cameras": None, "realistic": "off", "step_ms": 2.0}
    )
    plant = SimulatedPlant(ideal, real.robot, 0.01, 1)
    now, cable = [0.0], np.zeros(4)
    robot = EmulatedRobot(
        real.robot, real.plant, lambda: cable.tolist(), lambda newtons: None, clock=lambda: now[0]
    )
    for k in range(60):
        speed = 0.04 * np.cos(0.1 * k + np.arange(4))
        plant.write(Command(speed, np.zeros(4)))
        cable = plant.read().drive
        now[0] += 0.01 + 1e-9
        rings = robot.rings()
    np.testing.assert_allclose(rings[3:], plant.read().nodes, rtol=0, atol=3e-5)
    assert np.abs(plant.truth().q - real.robot.rest.q).max() > 3e-3
    assert isinstance(ideal, SimulatedSettings)


@pytest.mark.parametrize("level", ["off", "moderate"])
def test_emulated_motors_have_the_drawn_drives_in_counts(tcr600, level):
    section = read_rig("dynamixel_loopback")[0].robots["tcr600"]
    real = Imperfections("tcr600", tcr600, MISMATCH, level, 3)
    with emulated_drives(section, EmulationSettings(), real).bus as bus:
        if level == "off":
            assert [motor.servo.output for motor in bus.motors.values()] == [0.0] * 3
        else:
            count = 1e3 * section.plc.mm_per_turn / 4096
            wanted = [1e3 * error / count for error in real.plant.drives.zero_error_mm]
            assert [motor.servo.output for motor in bus.motors.values()] == pytest.approx(wanted)
        assert {round(turn) for turn in bus.turns().values()} == {section.plc.zero_tick - 100}


def test_a_motor_reports_its_horn_and_winds_what_lag_play_and_drum_leave():
    servo = ServoSettings(
        lag_s=0.1,
        speed_um_s=np.inf,
        acceleration_um_s2=np.inf,
        backlash_um=20.0,
        radius_error=0.1,
        zero_error_um=5.0,
    )
    motor = DynamixelMotor(1000, 0.0, servo=servo)
    motor.write(table.TORQUE_ENABLE.address, b"\1")
    motor.write(table.GOAL_POSITION.address, (1200).to_bytes(4, "little"))
    for t in np.arange(0.0, 0.2, 1e-3):
        motor.advance(t)
    behind = 1200 - motor.turn  # the profile has arrived after 0.064 s and is followed with the lag
    assert behind == pytest.approx(
        200 * (np.exp(0.064 / 0.1) - 1) * 0.1 / 0.064 * np.exp(-0.2 / 0.1), rel=0.05
    )
    for t in np.arange(0.2, 3.0, 1e-3):
        motor.advance(t)
    assert motor.get(table.PRESENT_POSITION) == 1200
    assert motor.servo.output == pytest.approx(5.0 + 1.1 * (200.0 - 10.0), abs=0.01)
