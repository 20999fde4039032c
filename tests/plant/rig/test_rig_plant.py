"""The rig plant on fake devices and a fake clock: arming, the loop, every way to stop."""

from __future__ import annotations

import numpy as np
import pytest

from support.rig_fakes import OFF, PERIOD, STEP, FakeRig, M, N, envelope
from tcrctl.errors import (
    ArmingRefusedError,
    DeviceError,
    RigStopError,
    StoppedError,
    UntrustworthyDeviceError,
)
from tcrctl.plant.rig.devices import DriveControl
from tcrctl.signals import Command


def command(speed=0.01):
    return Command(np.full(M, speed), np.zeros(M))


def started(**options):
    rig = FakeRig(**options)
    rig.plant.start()
    return rig


def test_set_points_begin_where_the_drives_are():
    rig = FakeRig()
    rig.drives.say(position=np.array([1000, -500, 20]))
    rig.plant.start()
    assert rig.state == "armed"
    rig.step(command(0.0))
    assert rig.state == "running"
    assert rig.targets()[0].tolist() == [1000, -500, 20]
    before_moving = [control for _, _, control in rig.drives.sent if not control.follow]
    assert set(before_moving) == {DriveControl(enable=True, permit=True)}


def test_speeds_are_integrated_and_what_was_sent_is_returned():
    rig = started()
    steps = rig.run(command(0.01), 10)
    np.testing.assert_allclose(rig.targets(), 500.0 * np.arange(1, 11)[:, None] * np.ones(M))
    for measured, applied in steps:
        np.testing.assert_allclose(applied.speed, 0.01)
        np.testing.assert_allclose(applied.drive, measured.drive + PERIOD * 0.01, atol=1e-9)


def test_a_measurement_is_as_old_as_its_exposure():
    rig = started()
    measured, _ = rig.step(command())
    assert measured.t == pytest.approx(rig.cameras.clock.time - 0.003, abs=PERIOD)
    assert measured.valid.all()
    assert measured.raw is not None


def test_without_consent_nothing_is_armed():
    rig = FakeRig(confirmed=False)
    with pytest.raises(ArmingRefusedError, match="--yes"):
        rig.plant.start()
    rig.plant.close()
    assert rig.drives.sent == []
    assert (rig.cameras.closed, rig.drives.closed) == (1, 1)


def test_a_drive_outside_its_limits_is_not_armed():
    rig = FakeRig()
    rig.drives.say(position=np.array([50_000, 0, 0]))
    with pytest.raises(ArmingRefusedError, match=r"cable c1 is at 50.00 mm, outside"):
        rig.plant.start()
    assert not any(control.enable for _, _, control in rig.drives.sent)


def test_drives_that_do_not_switch_on_are_given_up_and_left_off():
    rig = FakeRig()
    rig.drives.enables = False
    with pytest.raises(ArmingRefusedError, match="not on after 1 s"):
        rig.plant.start()
    assert rig.drives.sent[-1][2] == OFF
    with pytest.raises(ArmingRefusedError, match="never started"):
        rig.plant.write(command())


def test_the_end_of_a_run_is_a_controlled_stop_and_disarmed():
    rig = started()
    rig.run(command(), 5)
    rig.plant.close()
    assert rig.state == "disarmed"
    assert [text.partition(":")[0] for text in rig.transitions] == [
        "disarmed -> armed",
        "armed -> running",
        "running -> stopping",
        "stopping -> disarmed",
    ]
    assert DriveControl(enable=True) in [control for _, _, control in rig.drives.sent]
    assert rig.drives.sent[-1][2] == OFF
    assert (rig.cameras.closed, rig.drives.closed) == (1, 1)


def test_without_a_frame_in_time_the_last_one_is_repeated_and_the_drives_are_held():
    rig = started()
    last = rig.run(command(), 3)[-1][0]
    rig.cameras.silent = True
    while rig.state == "running":
        measured, applied = rig.step(command())
    assert (measured.t, measured.raw) == (last.t, None)
    assert measured.valid.all()
    assert rig.state == "holding"
    assert not applied.speed.any()
    rig.cameras.silent = False
    _, applied = rig.step(command())
    assert rig.state == "running"
    np.testing.assert_allclose(applied.speed, 0.01)
    assert np.abs(np.diff(rig.targets(), axis=0)).max() <= STEP


def test_cameras_that_stay_away_stop_the_run():
    rig = started()
    rig.run(command(), 3)
    gone = rig.clock.time
    rig.cameras.silent = True
    with pytest.raises(RigStopError, match="no usable measurement"):
        rig.run(command(), 20)
    assert rig.clock.time - gone <= 0.2 + 2 * PERIOD
    held = [tuple(t) for t in rig.targets()[-2:]]
    rig.plant.close()
    assert rig.state == "disarmed"
    assert len(set(held)) == 1


def test_frames_that_show_too_few_markers_do_not_count():
    rig = started()
    rig.cameras.seen = N // 3
    rig.run(command(), 10)
    rig.cameras.seen = 1
    with pytest.raises(RigStopError, match="no usable measurement"):
        rig.run(command(), 20)


def test_one_lost_answer_is_held_over_two_end_the_run():
    rig = started()
    rig.run(command(), 3)
    target = rig.targets()[-1]
    rig.drives.error = DeviceError("no answer within 60 ms")
    rig.drives.error_takes = 0.03
    rig.plant.read()
    assert rig.state == "holding"
    rig.drives.error = None
    applied = rig.plant.write(command())
    assert not applied.speed.any()
    np.testing.assert_array_equal(rig.targets()[-1], target)
    rig.step(command())
    rig.step(command())
    assert rig.state == "running"
    rig.drives.error = DeviceError("no answer within 60 ms")
    lost = rig.clock.time
    with pytest.raises(DeviceError, match="have not answered"):
        rig.run(command(), 20)
    assert rig.clock.time - lost < 0.2
    rig.plant.close()
    assert rig.state == "faulted"  # nobody has confirmed a standstill
    assert rig.drives.closed == 1


def test_nonsense_from_the_drives_is_not_waited_out():
    rig = started()
    rig.run(command(), 3)
    rig.drives.error = UntrustworthyDeviceError("axis 1 reports 819200 mm")
    with pytest.raises(DeviceError, match="819200"):
        rig.step(command())


def test_an_emergency_stop_ends_the_run_without_another_motion():
    rig = started()
    rig.run(command(), 3)
    sent = len(rig.targets())
    rig.drives.say(estop=True, enabled=False, fault="estop")
    with pytest.raises(RigStopError, match="emergency stop"):
        rig.step(command())
    rig.plant.close()
    assert rig.state == "faulted"
    assert len(rig.targets()) == sent
    assert rig.drives.sent[-1][2] == OFF


def test_a_refused_set_point_is_not_built_upon_and_three_end_the_run():
    rig = started()
    rig.run(command(), 3)
    rig.drives.follows = False
    rig.drives.say(reject="step, cable c1")
    with pytest.raises(RigStopError, match=r"refused 3 set-points in a row: step, cable c1"):
        rig.run(command(), 10)
    assert np.abs(np.diff(rig.targets(), axis=0)).max() <= STEP


def test_answers_to_questions_do_not_hide_that_commands_fail():
    rig = started()
    rig.run(command(), 3)
    exchange, lost = rig.drives.exchange, rig.clock.time

    def fails(target, control):
        exchange(target, control)
        raise DeviceError("echoes a wrong address")

    rig.drives.exchange = fails
    with pytest.raises(DeviceError, match="echoes a wrong address"):
        rig.run(command(), 20)
    assert rig.clock.time - lost <= 0.1 + 2 * PERIOD


def test_set_points_that_are_not_acknowledged_count_as_refused():
    rig = started()
    rig.run(command(), 3)
    rig.drives.say(acknowledged=False)
    with pytest.raises(RigStopError, match="refused 3 set-points in a row: it was not acknowledged"):
        rig.run(command(), 10)


def test_a_drive_that_lags_behind_ends_the_run():
    rig = started()
    rig.drives.follows = False
    with pytest.raises(RigStopError, match=r"cable c\d is .* mm from its set-point"):
        rig.run(command(0.04), 20)


def test_clamps_are_reported_once_with_both_values_and_their_end():
    rig = started(limits=envelope(high=np.full(M, 1200)))
    rig.run(command(0.01), 6)
    rig.run(command(-0.01), 1)
    clamps = [(level, text) for kind, level, text in rig.events if kind == "clamp"]
    assert [level for level, _ in clamps] == ["warning"] * M + ["info"] * M
    assert clamps[0][1] == "cable c1: stroke limit: wanted 1.500 mm, sent 1.200 mm"
    assert clamps[M][1] == "cable c1: stroke limit: over after 4 steps"
    assert rig.targets().max() == 1200


def test_doubted_markers_are_reported_when_the_reasons_change_not_in_every_frame():
    rig = started()
    for doubts in ("", "2 jump", "3 jump", "1 jump, 1 occluded", "1 jump"):
        rig.cameras.doubts = doubts
        rig.run(command(0.0), 30)
    rig.cameras.doubts = ""
    rig.run(command(0.0), 30)
    found = [(level, text) for kind, level, text in rig.events if kind == "markers"]
    assert [level for level, _ in found] == ["warning", "warning", "warning", "info"]
    assert found[0][1] == "markers that cannot be used: 2 jump"
    assert "1 jump, 1 occluded" in found[1][1]


def test_whatever_goes_wrong_the_devices_are_closed():
    rig = started()
    rig.run(command(), 2)

    def interrupted(*arguments):
        raise KeyboardInterrupt

    rig.drives.exchange = interrupted
    with pytest.raises(KeyboardInterrupt):
        rig.plant.close()
    assert (rig.cameras.closed, rig.drives.closed) == (1, 1)


def test_a_stop_that_is_not_confirmed_is_an_error_of_an_otherwise_good_run():
    rig = started()
    rig.run(command(), 2)
    rig.drives.say(stopping=True)
    exchange = rig.drives.exchange

    def keeps_moving(target, control):
        return exchange(target, control)

    rig.drives.exchange = keeps_moving
    with pytest.raises(DeviceError, match="no standstill"):
        rig.plant.close()
    assert rig.state == "faulted"


def test_every_stop_is_a_tcrctl_error_with_a_safe_exit_code():
    assert {RigStopError("x").exit_code, ArmingRefusedError(["x"]).exit_code} == {4}
    assert issubclass(RigStopError, StoppedError)
    assert UntrustworthyDeviceError("x").exit_code == 5
