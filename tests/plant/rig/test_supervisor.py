"""The safety supervisor as a state machine, and its transitions as events with causes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.rig_fakes import RULES
from tcrctl.errors import ArmingRefusedError, DeviceError, RigStopError
from tcrctl.plant.rig.devices import DriveControl, DriveStatus
from tcrctl.plant.rig.health import Health
from tcrctl.plant.rig.supervisor import SafetyState, Supervisor

WELL = DriveStatus(np.zeros(3, np.int64), enabled=True, zeroed=True)
GOOD = Health(age=0.004, status=WELL)
MOVING = (SafetyState.ARMED, SafetyState.RUNNING, SafetyState.HOLDING)


def status(**changes):
    return replace(GOOD, status=replace(WELL, **changes))


def made(state=SafetyState.DISARMED):
    events = []
    supervisor = Supervisor(RULES, lambda *event: events.append(event))
    if state in (*MOVING, SafetyState.STOPPING, SafetyState.FAULTED):
        supervisor.arm("test")
    if state in (SafetyState.RUNNING, SafetyState.HOLDING):
        supervisor.run()
    if state is SafetyState.HOLDING:
        supervisor.watch(0.0, replace(GOOD, age=0.1))
    if state is SafetyState.STOPPING:
        supervisor.stop(0.0, "test")
    if state is SafetyState.FAULTED:
        supervisor.watch(0.0, status(estop=True))
    if state is SafetyState.ZEROING:
        supervisor.begin_zeroing()
    assert supervisor.state is state
    events.clear()
    return supervisor, events


@pytest.mark.parametrize("state", SafetyState)
def test_the_drives_follow_only_while_running_or_holding(state):
    control = made(state)[0].control
    assert control.follow == (state in (SafetyState.RUNNING, SafetyState.HOLDING))
    assert control.permit == (state in (*MOVING, SafetyState.ZEROING))
    assert control.enable == (state in (*MOVING, SafetyState.STOPPING))
    assert (control.reset, control.zero) == (False, False)


REFUSED = {
    "operator": (GOOD, False, "--yes"),
    "no answer": (replace(GOOD, trouble="timeout"), True, "do not answer timeout"),
    "never seen": (replace(GOOD, status=None), True, "do not answer"),
    "stale": (replace(GOOD, age=0.06), True, "60 ms old"),
    "no frame ever": (replace(GOOD, age=np.inf), True, "shown no usable"),
    "not zeroed": (status(zeroed=False), True, "tcrctl rig zero"),
    "local": (status(remote=False), True, "remote"),
    "no echo": (status(acknowledged=False), True, "acknowledge"),
    "e-stop": (status(estop=True), True, "emergency stop"),
    "watchdog": (status(watchdog=True, fault="watchdog"), True, "watchdog"),
    "fault": (status(fault="drive"), True, "drive"),
}


@pytest.mark.parametrize("name", REFUSED)
def test_arming_is_refused_with_every_reason(name):
    health, confirmed, word = REFUSED[name]
    supervisor, events = made()
    with pytest.raises(ArmingRefusedError) as caught:
        supervisor.check_ready(health, confirmed=confirmed)
    assert word in str(caught.value)
    assert (caught.value.exit_code, len(caught.value.reasons)) == (4, 1)
    assert (supervisor.state, events) == (SafetyState.DISARMED, [])


def test_all_reasons_are_given_at_once_and_a_latched_fault_says_how_to_reset():
    supervisor, _ = made()
    with pytest.raises(ArmingRefusedError) as caught:
        supervisor.check_ready(replace(status(zeroed=False, fault="watchdog"), age=1.0), confirmed=False)
    assert len(caught.value.reasons) == 4
    assert "tcrctl rig reset" in caught.value.hint
    supervisor.check_ready(GOOD, confirmed=True)


FAULTS = {
    "e-stop": (status(estop=True), SafetyState.FAULTED, RigStopError, "emergency stop"),
    "watchdog": (status(watchdog=True), SafetyState.FAULTED, RigStopError, "watchdog"),
    "PLC fault": (status(fault="drive"), SafetyState.FAULTED, RigStopError, "drive"),
    "drives off": (status(enabled=False), SafetyState.FAULTED, RigStopError, "switched themselves off"),
    "stale for long": (replace(GOOD, age=0.2), SafetyState.STOPPING, RigStopError, "200 ms"),
    "silent": (replace(GOOD, trouble="timeout", silence=0.11), SafetyState.STOPPING, DeviceError, "110 ms"),
    "nonsense": (
        replace(GOOD, trouble="swapped", hopeless=True),
        SafetyState.STOPPING,
        DeviceError,
        "swapped",
    ),
    "lag": (
        replace(GOOD, following=5001, laggard="c2"),
        SafetyState.STOPPING,
        RigStopError,
        "cable c2 is 5.00 mm",
    ),
    "PLC sees lag": (status(following_error=True), SafetyState.STOPPING, RigStopError, "from its set-point"),
    "refused thrice": (
        replace(status(reject="step, cable c1"), refused=3),
        SafetyState.STOPPING,
        RigStopError,
        "step, cable c1",
    ),
}


@pytest.mark.parametrize("state", MOVING)
@pytest.mark.parametrize("name", FAULTS)
def test_every_fault_ends_every_moving_state_with_its_cause(name, state):
    health, end, kind, word = FAULTS[name]
    supervisor, events = made(state)
    assert supervisor.watch(1.0, health) is end
    assert type(supervisor.failure) is kind
    assert word in str(supervisor.failure)
    ((where, level, text),) = events
    assert (where, level) == ("supervisor", "error")
    assert text == f"{state} -> {end}: {supervisor.failure}"
    assert not supervisor.control.permit


DOUBTS = {
    "stale": replace(GOOD, age=0.05),
    "one lost answer": replace(GOOD, trouble="timeout", silence=0.06),
    "one refusal": replace(status(reject="speed, cable c1"), refused=1),
}


@pytest.mark.parametrize("name", DOUBTS)
def test_a_doubt_holds_the_drives_and_good_news_let_them_run_again(name):
    supervisor, events = made(SafetyState.RUNNING)
    assert supervisor.watch(1.0, DOUBTS[name]) is SafetyState.HOLDING
    assert supervisor.watch(1.05, DOUBTS[name]) is SafetyState.HOLDING
    assert supervisor.failure is None
    assert supervisor.watch(1.1, GOOD) is SafetyState.RUNNING
    assert [level for _, level, _ in events] == ["warning", "info"]


def test_a_controlled_stop_ends_disarmed_at_standstill():
    supervisor, events = made(SafetyState.RUNNING)
    supervisor.stop(1.0, "end of the run")
    assert supervisor.rest(1.02, status(stopping=True), moved=True) is SafetyState.STOPPING
    assert supervisor.rest(1.04, status(enabled=False), moved=True) is SafetyState.STOPPING
    assert supervisor.rest(1.06, status(enabled=False), moved=False) is SafetyState.DISARMED
    assert [text.partition(":")[0] for _, _, text in events] == [
        "running -> stopping",
        "stopping -> disarmed",
    ]
    assert supervisor.failure is None


@pytest.mark.parametrize(
    ("health", "word"),
    [(status(stopping=True), "still moving"), (replace(GOOD, trouble="timeout", silence=0.5), "timeout")],
)
def test_a_stop_that_does_not_end_is_a_fault(health, word):
    supervisor, _ = made(SafetyState.STOPPING)
    assert supervisor.rest(RULES.standstill, health, moved=True) is SafetyState.STOPPING
    assert supervisor.rest(RULES.standstill + 0.01, health, moved=True) is SafetyState.FAULTED
    assert word in str(supervisor.failure)


def test_an_emergency_stop_during_a_controlled_stop_is_latched():
    supervisor, _ = made(SafetyState.STOPPING)
    assert supervisor.rest(0.1, status(estop=True), moved=False) is SafetyState.FAULTED


STATES_OF_HEALTH = st.builds(
    replace,
    st.just(GOOD),
    age=st.sampled_from([0.001, 0.06, 0.3]),
    status=st.builds(
        replace, st.just(WELL), estop=st.booleans(), enabled=st.booleans(), stopping=st.booleans()
    ),
    silence=st.sampled_from([0.0, 0.0, 0.06, 0.2]),
    refused=st.integers(0, 4),
)


@pytest.mark.slow
@given(st.sampled_from([SafetyState.STOPPING, SafetyState.FAULTED]), st.lists(STATES_OF_HEALTH, max_size=20))
def test_nothing_that_is_seen_lets_a_stopped_robot_move_again(state, healths):
    supervisor, _ = made(state)
    for k, health in enumerate(healths):
        supervisor.watch(0.01 * k, health)
        supervisor.run()
        supervisor.rest(0.01 * k, health, moved=False)
        assert supervisor.state in (SafetyState.STOPPING, SafetyState.FAULTED, SafetyState.DISARMED)
        assert supervisor.control in (DriveControl(), DriveControl(enable=True))
    supervisor.stop(1.0, "again")
    if supervisor.state is SafetyState.FAULTED:
        supervisor.reset()
    assert supervisor.state in (SafetyState.DISARMED, SafetyState.STOPPING)


def test_a_transition_that_the_drawing_does_not_show_is_a_fault_of_the_program():
    supervisor, _ = made(SafetyState.STOPPING)
    with pytest.raises(RuntimeError, match="cannot go from stopping to armed"):
        supervisor.arm("never")
