"""Laws of the PLC program and of the drives, scan by scan, without a network."""

from __future__ import annotations

from dataclasses import replace

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tcr_hardware.emulators.plc_command import PlcCommand
from tcr_hardware.emulators.plc_limits import PlcLimitSettings
from tcr_hardware.emulators.plc_program import PlcProgram
from tcr_hardware.modbus.registers import Control, FaultCode, Reject, Status
from tcr_hardware.servo import Servo, ServoSettings

DT = 0.002
LIMITS = PlcLimitSettings()
ON = Control.ENABLE | Control.RUN
FOLLOW = ON | Control.FOLLOW
REST = PlcCommand(Control(0), 0, (0.0, 0.0), 50_000.0, 0)


class Host:
    """Writes commands to a program of two axes as a bus would: heartbeat and SEQ move on by themselves."""

    def __init__(self, *, zeroed=True, limits=LIMITS, servo=None):
        self.plc = PlcProgram(2, limits, servo or ServoSettings(), zeroed=zeroed)
        self.command = REST
        self.fastest = 0.0

    def send(self, control, *setpoints, vmax=50_000.0, scans=25):
        """Write a set, then let the PLC run."""
        command = self.command
        self.command = PlcCommand(
            control,
            (command.heartbeat + 1) & 0xFFFF,
            setpoints or command.setpoints,
            vmax,
            (command.seq + 1) & 0xFFFF,
        )
        self.wait(scans)
        return self.plc

    def wait(self, scans):
        """Let the PLC run without hearing from the host."""
        for _ in range(scans):
            before = list(self.plc.active)
            self.plc.scan(self.command, DT)
            moves = (abs(now - old) for now, old in zip(self.plc.active, before, strict=True))
            self.fastest = max(self.fastest, *moves)

    def following(self, *setpoints):
        """Enabled and following, standing at 0, then one set."""
        self.send(ON)
        self.send(FOLLOW, *(setpoints or (0.0, 0.0)))
        return self


def test_a_set_is_reached_by_all_axes_at_the_same_time_and_without_overshoot():
    host = Host().following()
    seen = []
    for k in range(1, 21):
        host.send(FOLLOW, 1000.0 * k, -250.0 * k, scans=25)
        seen.append((host.plc.active[0], host.plc.active[1]))
    assert all(a == pytest.approx(-4.0 * b, abs=1e-6) for a, b in seen)
    host.send(FOLLOW, 20_000.0, -5_000.0, scans=200)
    assert host.plc.positions() == pytest.approx([20_000.0, -5_000.0], abs=1.0)
    assert host.fastest <= 50_000.0 * DT * (1 + 1e-12)


def test_the_speed_cap_of_the_host_holds_and_is_reported():
    host = Host().following()
    host.send(FOLLOW, 5_000.0, 0.0, vmax=10_000.0)
    assert Status.LIMITED in host.plc.status()
    assert host.fastest == pytest.approx(10_000.0 * DT)


@pytest.mark.parametrize("silence_ms", [150, 195, 205, 1000])
def test_the_watchdog_trips_when_the_heartbeat_stands_still_and_not_before(silence_ms):
    host = Host().following()
    host.wait(round(silence_ms / 1e3 / DT) - 25)  # the last set was followed by 25 scans
    assert (host.plc.fault is FaultCode.WATCHDOG) == (silence_ms > LIMITS.watchdog_ms)


def test_a_tripped_watchdog_ramps_down_holds_and_stays_latched_until_a_reset_and_a_new_enable():
    host = Host().following()
    for k in range(1, 6):
        host.send(FOLLOW, 2_500.0 * k, 0.0, scans=25)
    host.send(FOLLOW, 18_400.0, 0.0, vmax=20_000.0, scans=102)  # still on its way when the watchdog trips
    assert host.plc.fault is FaultCode.WATCHDOG
    host.wait(50)
    held = list(host.plc.active)
    assert 12_500.0 < held[0] < 18_000.0
    assert Status.STOPPING not in host.plc.status()
    for _ in range(20):
        host.send(FOLLOW, held[0] + 100.0, 0.0)  # the host is back, and goes on as if nothing had happened
    assert host.plc.active == held
    assert host.plc.reject[0] is Reject.NOT_ENABLED
    assert {Status.WATCHDOG, Status.FAULT} <= set(host.plc.status())
    host.send(ON | Control.RESET)  # ENABLE is held: no edge, so nothing starts
    assert host.plc.fault is FaultCode.NONE
    assert not host.plc.enabled
    host.send(Control.RUN)
    assert host.send(ON).enabled


def test_a_stop_slows_down_with_the_deceleration_set():
    host = Host().following()
    for k in range(1, 11):
        host.send(FOLLOW, 2_500.0 * k, 0.0, scans=25)
    position, speed = host.plc.active[0], 50_000.0
    host.send(Control.ENABLE, 27_500.0, 0.0, scans=1)
    assert Status.STOPPING in host.plc.status()
    host.wait(100)
    brakes = speed**2 / (2 * LIMITS.deceleration_um_s2)
    assert host.plc.active[0] - position == pytest.approx(brakes, rel=0.1)
    assert not host.plc.enabled


@pytest.mark.parametrize(
    ("setpoints", "vmax", "verdict"),
    [
        ((95_001.0, 0.0), 50_000.0, (Reject.RANGE, 1)),
        ((0.0, -35_001.0), 50_000.0, (Reject.RANGE, 2)),
        ((0.0, 6_001.0), 50_000.0, (Reject.STEP, 2)),
        ((100.0, 100.0), 0.0, (Reject.SPEED, 0)),
        ((100.0, 100.0), 100_100.0, (Reject.SPEED, 0)),
    ],
)
def test_a_set_with_one_bad_value_is_refused_as_a_whole(setpoints, vmax, verdict):
    host = Host().following()
    accepted = host.plc.seq_ack
    host.send(FOLLOW, *setpoints, vmax=vmax, scans=100)
    assert host.plc.reject == verdict
    assert host.plc.active == [0.0, 0.0]
    assert host.plc.seq_ack == accepted
    host.send(FOLLOW, 100.0, 100.0)
    assert host.plc.reject == (Reject.NONE, 0)
    assert host.plc.seq_ack == host.command.seq


def test_set_points_are_taken_only_when_seq_changes():
    host = Host().following()
    seq = host.command.seq
    for k in range(10):
        host.command = replace(host.command, setpoints=(500.0 * k, 0.0), heartbeat=100 + k)
        host.wait(25)
    assert host.plc.active == [0.0, 0.0]
    assert host.plc.seq_ack == seq


def test_without_follow_a_set_is_acknowledged_and_ignored():
    host = Host()
    host.send(Control.RUN, 5_000.0, 5_000.0)
    assert host.plc.seq_ack == host.command.seq
    assert host.plc.reject == (Reject.NONE, 0)
    assert host.send(ON, 5_000.0, 5_000.0).active == [0.0, 0.0]


def test_following_before_enabling_is_refused():
    host = Host()
    host.send(Control.FOLLOW | Control.RUN, 100.0, 100.0)
    assert host.plc.reject[0] is Reject.NOT_ENABLED


@pytest.mark.parametrize("cause", ["estop", "drive_lost"])
def test_an_estop_stops_and_is_reset_only_after_it_was_released(cause):
    host = Host().following()
    host.send(FOLLOW, 3_000.0, 0.0, scans=5)
    setattr(host.plc, cause, True)
    host.send(FOLLOW, 6_000.0, 0.0, scans=50)
    held = list(host.plc.active)
    assert 0.0 < held[0] < 3_000.0
    host.send(Control.RUN)
    assert Status.FAULT in host.send(Control.RUN | Control.RESET).status()
    setattr(host.plc, cause, False)
    host.send(Control.RUN)
    assert Status.FAULT in host.plc.status()
    assert Status.FAULT not in host.send(Control.RUN | Control.RESET).status()
    assert host.send(ON).enabled
    assert host.plc.active == pytest.approx(held, abs=1.0)


def test_a_jammed_axis_is_a_following_error_and_does_not_jump_when_it_comes_free():
    host = Host().following()
    host.plc.servos[1].jammed = True
    for k in range(1, 8):
        host.send(FOLLOW, 2_000.0 * k, 2_000.0 * k)
    assert host.plc.fault is FaultCode.FOLLOWING_ERROR
    host.plc.servos[1].jammed = False
    host.wait(200)
    assert host.plc.positions()[1] == pytest.approx(0.0, abs=1e-6)


def test_a_plc_that_does_not_know_its_zero_cannot_be_enabled_until_it_is_taken():
    host = Host(zeroed=False)
    assert not host.send(ON).enabled
    host.send(Control.RUN | Control.ZERO)
    assert host.send(ON).enabled


def test_taking_the_zero_moves_no_drive_and_is_ignored_while_following():
    host = Host().following()
    host.send(FOLLOW, 4_000.0, -2_000.0, scans=12)
    host.send(FOLLOW | Control.ZERO, 4_000.0, -2_000.0, scans=90)
    assert host.plc.positions() == pytest.approx([4_000.0, -2_000.0], abs=20.0)
    host.send(Control.RUN, scans=90)
    physical = [servo.position for servo in host.plc.servos]
    host.send(Control.RUN | Control.ZERO, scans=90)
    assert host.plc.positions() == pytest.approx([0.0, 0.0], abs=5.0)
    assert [servo.position for servo in host.plc.servos] == pytest.approx(physical, abs=5.0)


def test_after_a_power_cycle_nothing_is_enabled_and_no_drive_has_moved():
    host = Host().following()
    host.send(FOLLOW, 4_000.0, -2_000.0, scans=90)
    host.plc.power_up()
    host.command = REST
    host.wait(100)
    assert not host.plc.enabled
    assert host.plc.positions() == pytest.approx([4_000.0, -2_000.0], abs=20.0)


moves = st.tuples(st.floats(-70_000, 70_000), st.floats(-70_000, 70_000))
events = st.one_of(
    st.tuples(st.just("send"), st.sampled_from([FOLLOW, FOLLOW, FOLLOW, ON, Control(0), Control.RUN]), moves),
    st.tuples(st.just("creep"), st.sampled_from([FOLLOW]), moves),
    st.tuples(st.just("reset"), st.just(Control.RUN | Control.RESET), moves),
    st.tuples(st.just("silence"), st.just(Control(0)), moves),
    st.tuples(st.just("estop"), st.just(Control(0)), moves),
)


@pytest.mark.slow
@settings(max_examples=60)
@given(st.lists(events, max_size=15), st.floats(200, 120_000))
def test_whatever_the_host_does_no_set_point_leaves_its_stroke_or_breaks_the_speed_limit(script, vmax):
    host = Host().following()
    for what, control, setpoints in script:
        if what == "creep":  # towards the set-point in steps that the PLC takes
            setpoints = tuple(
                at + max(-6_000.0, min(6_000.0, to - at))
                for at, to in zip(host.plc.active, setpoints, strict=True)
            )
        if what == "silence":
            host.wait(120)
        elif what == "estop":
            host.plc.estop = not host.plc.estop
            host.wait(5)
        else:
            host.send(control, *setpoints, vmax=vmax, scans=10)
        for at, servo in zip(host.plc.active, host.plc.servos, strict=True):
            assert LIMITS.min_um <= at <= LIMITS.max_um
            assert LIMITS.min_um - 1e-6 <= servo.position <= LIMITS.max_um + 1e-6
    assert host.fastest <= LIMITS.vmax_um_s * DT * (1 + 1e-9)
    assert all(abs(servo.speed) <= ServoSettings().speed_um_s for servo in host.plc.servos)


@settings(max_examples=60)
@given(
    st.floats(-5_000, 5_000),
    st.floats(0.0, 0.06),
    st.floats(5_000, 300_000),
    st.floats(5e5, 5e7),
)
def test_a_drive_arrives_without_overshoot_within_its_speed_and_acceleration(to, lag, speed, acceleration):
    limits = ServoSettings(lag_s=lag, speed_um_s=speed, acceleration_um_s2=acceleration)
    servo, before = Servo(limits), 0.0
    duration = abs(to) / speed + 12 * lag + 2 * (abs(to) / acceleration) ** 0.5 + speed / acceleration
    for _ in range(round(duration / DT) + 2):
        servo.advance(to, DT)
        assert abs(servo.speed) <= speed * (1 + 1e-12)
        assert abs(servo.speed - before) <= acceleration * DT * (1 + 1e-9) + 1e-9
        assert min(0.0, to) - 1e-3 <= servo.position <= max(0.0, to) + 1e-3
        before = servo.speed
    assert servo.position == pytest.approx(to, abs=1.0)


def test_a_drive_follows_a_ramp_late_by_its_lag():
    servo, speed = Servo(ServoSettings(lag_s=0.04)), 20_000.0
    for k in range(500):
        servo.advance(speed * k * DT, DT)
    assert speed * 499 * DT - servo.position == pytest.approx(speed * (0.04 - DT), rel=0.05)


def test_play_keeps_the_cable_still_when_the_drive_turns_round():
    servo = Servo(ServoSettings(backlash_um=200.0))
    for target in (1_000.0, 900.0):
        for _ in range(300):
            servo.advance(target, DT)
    assert servo.position == pytest.approx(900.0, abs=1.0)
    assert servo.output == pytest.approx(900.0, abs=1.0)  # 1000 - half the play on the way in
    for _ in range(300):
        servo.advance(700.0, DT)
    assert servo.output == pytest.approx(800.0, abs=1.0)


@pytest.mark.parametrize("dt", [0.0, -DT, float("nan")])
def test_a_scan_that_takes_no_time_moves_nothing_and_spoils_nothing(dt):
    host = Host().following()
    host.send(FOLLOW, 3_000.0, -3_000.0, scans=10)
    active, positions = list(host.plc.active), host.plc.positions()
    for _ in range(5):
        host.plc.scan(host.command, dt)
    assert (host.plc.active, host.plc.positions()) == (active, positions)
    host.send(Control.ENABLE, scans=1)  # the speed is remembered: it is brought to rest on a ramp
    assert Status.STOPPING in host.plc.status()
    host.wait(200)
    assert 0.0 < host.plc.active[0] - active[0] < 1_000.0
    assert host.plc.positions() == pytest.approx(host.plc.active, abs=1.0)


def test_a_program_that_starts_under_a_host_that_goes_on_waits_until_enable_was_0():
    host = Host().following()
    host.plc.power_up()
    for k in range(5):
        host.send(FOLLOW, 1_000.0 * k, 0.0)
    assert (host.plc.enabled, host.plc.active) == (False, [0.0, 0.0])
    host.send(Control.RUN)
    assert host.send(ON).enabled
