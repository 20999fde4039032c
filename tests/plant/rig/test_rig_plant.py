"""The rig plant on fake devices and a fake clock: arming, the loop, every way to stop."""

from __future__ import annotations

import numpy as np
import pytest

from support.rig_fakes import OFF, PERIOD, STEP, Bench, M, N, envelope
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
    bench = Bench(**options)
    bench.plant.start()
    return bench


def test_set_points_begin_where_the_drives_are():
    bench = Bench()
    bench.drives.say(position=np.array([1000, -500, 20]))
    bench.plant.start()
    assert bench.state == "armed"
    bench.step(command(0.0))
    assert bench.state == "running"
    assert bench.targets()[0].tolist() == [1000, -500, 20]
    before_moving = [control for _, _, control in bench.drives.sent if not control.follow]
    assert set(before_moving) == {DriveControl(enable=True, permit=True)}


def test_speeds_are_integrated_and_what_was_sent_is_returned():
    bench = started()
    steps = bench.run(command(0.01), 10)
    np.testing.assert_allclose(bench.targets(), 500.0 * np.arange(1, 11)[:, None] * np.ones(M))
    for measured, applied in steps:
        np.testing.assert_allclose(applied.speed, 0.01)
        np.testing.assert_allclose(applied.drive, measured.drive + PERIOD * 0.01, atol=1e-9)


def test_a_measurement_is_as_old_as_its_exposure():
    bench = started()
    measured, _ = bench.step(command())
    assert measured.t == pytest.approx(bench.cameras.clock.time - 0.003, abs=PERIOD)
    assert measured.valid.all()
    assert measured.raw is not None


def test_without_consent_nothing_is_armed():
    bench = Bench(confirmed=False)
    with pytest.raises(ArmingRefusedError, match="--yes"):
        bench.plant.start()
    bench.plant.close()
    assert bench.drives.sent == []
    assert (bench.cameras.closed, bench.drives.closed) == (1, 1)


def test_a_drive_outside_its_limits_is_not_armed():
    bench = Bench()
    bench.drives.say(position=np.array([50_000, 0, 0]))
    with pytest.raises(ArmingRefusedError, match=r"cable c1 is at 50.00 mm, outside"):
        bench.plant.start()
    assert not any(control.enable for _, _, control in bench.drives.sent)


def test_drives_that_do_not_switch_on_are_given_up_and_left_off():
    bench = Bench()
    bench.drives.enables = False
    with pytest.raises(ArmingRefusedError, match="not on after 1 s"):
        bench.plant.start()
    assert bench.drives.sent[-1][2] == OFF
    with pytest.raises(ArmingRefusedError, match="never started"):
        bench.plant.write(command())


def test_the_end_of_a_run_is_a_controlled_stop_and_disarmed():
    bench = started()
    bench.run(command(), 5)
    bench.plant.close()
    assert bench.state == "disarmed"
    assert [text.partition(":")[0] for text in bench.transitions] == [
        "disarmed -> armed", "armed -> running", "running -> stopping", "stopping -> disarmed",
    ]  # fmt: skip
    assert DriveControl(enable=True) in [control for _, _, control in bench.drives.sent]
    assert bench.drives.sent[-1][2] == OFF
    assert (bench.cameras.closed, bench.drives.closed) == (1, 1)


def test_without_a_frame_in_time_the_last_one_is_repeated_and_the_drives_are_held():
    bench = started()
    last = bench.run(command(), 3)[-1][0]
    bench.cameras.silent = True
    while bench.state == "running":
        measured, applied = bench.step(command())
    assert (measured.t, measured.raw) == (last.t, None)
    assert measured.valid.all()
    assert bench.state == "holding"
    assert not applied.speed.any()
    bench.cameras.silent = False
    _, applied = bench.step(command())
    assert bench.state == "running"
    np.testing.assert_allclose(applied.speed, 0.01)
    assert np.abs(np.diff(bench.targets(), axis=0)).max() <= STEP


def test_cameras_that_stay_away_stop_the_run():
    bench = started()
    bench.run(command(), 3)
    gone = bench.clock.time
    bench.cameras.silent = True
    with pytest.raises(RigStopError, match="no usable measurement"):
        bench.run(command(), 20)
    assert bench.clock.time - gone <= 0.2 + 2 * PERIOD
    held = [tuple(t) for t in bench.targets()[-2:]]
    bench.plant.close()
    assert bench.state == "disarmed"
    assert len(set(held)) == 1


def test_frames_that_show_too_few_markers_do_not_count():
    bench = started()
    bench.cameras.seen = N // 3
    bench.run(command(), 10)
    bench.cameras.seen = 1
    with pytest.raises(RigStopError, match="no usable measurement"):
        bench.run(command(), 20)


def test_one_lost_answer_is_held_over_two_end_the_run():
    bench = started()
    bench.run(command(), 3)
    target = bench.targets()[-1]
    bench.drives.error = DeviceError("no answer within 60 ms")
    bench.drives.error_takes = 0.03
    bench.plant.read()
    assert bench.state == "holding"
    bench.drives.error = None
    applied = bench.plant.write(command())
    assert not applied.speed.any()
    np.testing.assert_array_equal(bench.targets()[-1], target)
    bench.step(command())
    bench.step(command())
    assert bench.state == "running"
    bench.drives.error = DeviceError("no answer within 60 ms")
    lost = bench.clock.time
    with pytest.raises(DeviceError, match="have not answered"):
        bench.run(command(), 20)
    assert bench.clock.time - lost < 0.2
    bench.plant.close()
    assert bench.state == "faulted"  # nobody has confirmed a standstill
    assert bench.drives.closed == 1


def test_nonsense_from_the_drives_is_not_waited_out():
    bench = started()
    bench.run(command(), 3)
    bench.drives.error = UntrustworthyDeviceError("axis 1 reports 819200 mm")
    with pytest.raises(DeviceError, match="819200"):
        bench.step(command())


def test_an_emergency_stop_ends_the_run_without_another_motion():
    bench = started()
    bench.run(command(), 3)
    sent = len(bench.targets())
    bench.drives.say(estop=True, enabled=False, fault="estop")
    with pytest.raises(RigStopError, match="emergency stop"):
        bench.step(command())
    bench.plant.close()
    assert bench.state == "faulted"
    assert len(bench.targets()) == sent
    assert bench.drives.sent[-1][2] == OFF


def test_a_refused_set_point_is_not_built_upon_and_three_end_the_run():
    bench = started()
    bench.run(command(), 3)
    bench.drives.follows = False
    bench.drives.say(reject="step, cable c1")
    with pytest.raises(RigStopError, match=r"refused 3 set-points in a row: step, cable c1"):
        bench.run(command(), 10)
    assert np.abs(np.diff(bench.targets(), axis=0)).max() <= STEP


def test_answers_to_questions_do_not_hide_that_commands_fail():
    bench = started()
    bench.run(command(), 3)
    exchange, lost = bench.drives.exchange, bench.clock.time

    def fails(target, control):
        exchange(target, control)
        raise DeviceError("echoes a wrong address")

    bench.drives.exchange = fails
    with pytest.raises(DeviceError, match="echoes a wrong address"):
        bench.run(command(), 20)
    assert bench.clock.time - lost <= 0.1 + 2 * PERIOD


def test_set_points_that_are_not_acknowledged_count_as_refused():
    bench = started()
    bench.run(command(), 3)
    bench.drives.say(acknowledged=False)
    with pytest.raises(RigStopError, match="refused 3 set-points in a row: it was not acknowledged"):
        bench.run(command(), 10)


def test_a_drive_that_lags_behind_ends_the_run():
    bench = started()
    bench.drives.follows = False
    with pytest.raises(RigStopError, match=r"cable c\d is .* mm from its set-point"):
        bench.run(command(0.04), 20)


def test_clamps_are_reported_once_with_both_values_and_their_end():
    bench = started(limits=envelope(high=np.full(M, 1200)))
    bench.run(command(0.01), 6)
    bench.run(command(-0.01), 1)
    clamps = [(level, text) for kind, level, text in bench.events if kind == "clamp"]
    assert [level for level, _ in clamps] == ["warning"] * M + ["info"] * M
    assert clamps[0][1] == "cable c1: stroke limit: wanted 1.500 mm, sent 1.200 mm"
    assert clamps[M][1] == "cable c1: stroke limit: over after 4 steps"
    assert bench.targets().max() == 1200


def test_doubted_markers_are_reported_when_the_reasons_change_not_in_every_frame():
    bench = started()
    for doubts in ("", "2 jump", "3 jump", "1 jump, 1 occluded", "1 jump"):
        bench.cameras.doubts = doubts
        bench.run(command(0.0), 30)
    bench.cameras.doubts = ""
    bench.run(command(0.0), 30)
    found = [(level, text) for kind, level, text in bench.events if kind == "markers"]
    assert [level for level, _ in found] == ["warning", "warning", "warning", "info"]
    assert found[0][1] == "markers that cannot be used: 2 jump"
    assert "1 jump, 1 occluded" in found[1][1]


def test_whatever_goes_wrong_the_devices_are_closed():
    bench = started()
    bench.run(command(), 2)

    def interrupted(*arguments):
        raise KeyboardInterrupt

    bench.drives.exchange = interrupted
    with pytest.raises(KeyboardInterrupt):
        bench.plant.close()
    assert (bench.cameras.closed, bench.drives.closed) == (1, 1)


def test_a_stop_that_is_not_confirmed_is_an_error_of_an_otherwise_good_run():
    bench = started()
    bench.run(command(), 2)
    bench.drives.say(stopping=True)
    exchange = bench.drives.exchange

    def keeps_moving(target, control):
        return exchange(target, control)

    bench.drives.exchange = keeps_moving
    with pytest.raises(DeviceError, match="no standstill"):
        bench.plant.close()
    assert bench.state == "faulted"


def test_every_stop_is_a_tcrctl_error_with_a_safe_exit_code():
    assert {RigStopError("x").exit_code, ArmingRefusedError(["x"]).exit_code} == {4}
    assert issubclass(RigStopError, StoppedError)
    assert UntrustworthyDeviceError("x").exit_code == 5
