"""One program moves a robot: of several at one PLC at most one arms, and the others do not disturb it."""

from __future__ import annotations

import threading
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress

import numpy as np
import pytest

from support.fault_matrix import Loop, WatchedEmulators
from tcr_hardware.modbus.blocks import Counters
from tcr_hardware.modbus.bus import PlcBus
from tcr_hardware.modbus.errors import LinkError, PlcTakenError
from tcr_hardware.modbus.registers import Control, Status
from tcrctl.commissioning.jog import Jog, jog_rig
from tcrctl.commissioning.zero import reset_rig, zero_rig
from tcrctl.errors import ArmingRefusedError, DeviceError, NotArrivedError
from tcrctl.plant.rig.modbus_drives import bus_settings
from tcrctl.plant.rig.operation import Operation

pytestmark = pytest.mark.slow

NAMES = ("c1", "c2", "c3", "c4")
#: A busy computer answers late; what is looked for here does not depend on it.
RULES = {"stale_after_ms": 1000, "stale_stop_ms": 4000, "silence_stop_ms": 4000, "arm_timeout_s": 5}
AGREED = Operation(confirmed=True)


@pytest.fixture
def bench(tcr5x4):
    with WatchedEmulators(tcr5x4, RULES, watchdog_ms=2000, timeout_ms=800) as emulators:
        yield emulators


def jog(bench, by_mm, cables=("c1",), check=lambda: None):
    motion = Jog(cables, 1e-3 * by_mm, None, 0.02)
    return jog_rig(bench.loaded(), NAMES, motion, AGREED, dry_run=False, check=check)


def writer(bench):
    """A program that writes to the PLC without asking whose it is."""
    return PlcBus(bus_settings(bench.loaded().mounted.plc))


def enabled(bench):
    return Status.ENABLED in bench.plc.snapshot()["status"]


def test_of_two_that_begin_at_once_at_most_one_moves(bench):
    """Both find the PLC free; what they drew decides, not who was first.

    Only the PLC could make the question and the first write one step: a computer that sleeps between the two for
    longer than a claim takes writes over a motion that has begun, which then ends and names the other one.
    """
    refused, ends = [], []
    for _ in range(5):
        before, both = bench.plc.positions_um()[0], both_jog(bench)
        found = [end for end in both if not isinstance(end, ArmingRefusedError)]
        moved = bench.plc.positions_um()[0] - before
        assert len(found) <= 1
        assert 1000.0 * found.count(None) - 100.0 <= moved <= 1000.0 * len(found) + 100.0
        assert all("another program writes" in str(end) for end in found if end)
        ends += found
        refused += [str(end) for end in both if end not in found]
    assert ends
    assert any("another program" in why or "somebody else" in why for why in refused)


def both_jog(bench):
    """How two jogs that begin together end: None, or with an error."""
    both = threading.Barrier(2)

    def begin():
        both.wait()
        try:
            jog(bench, 1.0)
        except (ArmingRefusedError, DeviceError) as error:
            return error

    with ThreadPoolExecutor(2) as programs:
        return [each.result() for each in [programs.submit(begin) for _ in range(2)]]


def test_whoever_finds_the_drives_enabled_refuses_and_leaves_them_to_their_owner(bench):
    plant = bench.plant()
    try:
        plant.start()
        with pytest.raises(ArmingRefusedError, match="enabled by somebody else"):
            jog(bench, 1.0)
        with pytest.raises(ArmingRefusedError, match="enabled by somebody else"):
            zero_rig(bench.loaded(), NAMES, AGREED, dry_run=False)
        second = bench.plant()
        try:
            with pytest.raises(ArmingRefusedError, match="enabled by somebody else"):
                second.start()
            with pytest.raises(ArmingRefusedError, match="another program"):
                second.arm("without asking first")
        finally:
            second.close()
        assert enabled(bench)
    finally:
        plant.close()
    assert not enabled(bench)


def test_whoever_only_looks_on_sees_a_running_robot_and_refuses_with_the_reason(bench):
    """HEARTBEAT and its echo belong to the owner: they say nothing about answers to those who never wrote."""
    plant = bench.plant()
    running, owner = threading.Event(), []

    def drive():
        plant.start()
        running.set()
        loop = Loop(plant)
        while running.is_set():
            loop.run(0.05)
        owner.append(plant.supervisor.state)

    thread = threading.Thread(target=drive)
    thread.start()
    try:
        assert running.wait(10.0)
        with writer(bench) as watcher:
            for _ in range(20):
                assert Status.ENABLED in watcher.read_status().status
                threading.Event().wait(0.03)
            with pytest.raises(PlcTakenError, match="enabled"):
                watcher.claim([0] * 6, 50_000)
        with pytest.raises(ArmingRefusedError, match="enabled by somebody else"):
            zero_rig(bench.loaded(), NAMES, AGREED, dry_run=False)
        assert reset_rig(bench.loaded(), NAMES, AGREED, dry_run=False) == {"fault": None, "cleared": False}
    finally:
        running.clear()
        thread.join()
        plant.close()
    assert owner == ["running"]


def test_a_claim_over_which_somebody_writes_is_given_up(bench):
    with writer(bench) as first, writer(bench) as second:
        begun, ends = threading.Event(), []

        def claim():
            begun.set()
            try:
                first.claim([0] * 6, 50_000)
            except PlcTakenError as error:
                ends.append(error)

        thread = threading.Thread(target=claim)
        thread.start()
        begun.wait()
        while thread.is_alive():
            second.exchange([0] * 6, Control(0), 50_000)
            thread.join(0.02)
        assert len(ends) == 1
        second.claim([0] * 6, 50_000)  # the PLC is free for the other one


def both_write(other, loop):
    """``other`` counts as it likes."""
    other._counters = Counters.drawn()
    for _ in range(200):
        with suppress(LinkError):  # it notices us too
            other.exchange([0] * 6, Control.ENABLE | Control.RUN | Control.FOLLOW, 50_000)
        loop.run(0.02)


def test_one_that_writes_in_between_ends_the_run_and_is_named(bench):
    plant = bench.plant()
    try:
        plant.start()
        loop = Loop(plant)
        loop.run(0.2)
        with (
            writer(bench) as other,
            pytest.raises(DeviceError, match="another program writes"),
        ):
            both_write(other, loop)
    finally:
        plant.close()
    assert not enabled(bench)


@pytest.mark.parametrize("by_mm", [0.5, 1.5])
def test_a_jog_that_does_not_arrive_says_where_the_drive_is_and_where_it_was_sent(bench, by_mm):
    """A jammed drive that is nearer to its set-point than a following error."""
    bench.plc.faults.set("jam", axis=2)
    with pytest.raises(NotArrivedError) as caught:
        jog(bench, by_mm, ("c1", "c2"))
    assert caught.value.exit_code == 4
    assert f"c2 is at 0.000 mm, sent to {by_mm:.3f} mm" in str(caught.value)
    assert "c1" not in str(caught.value)
    assert np.allclose(caught.value.wanted_mm, [by_mm, by_mm, 0.0, 0.0])
    assert not enabled(bench)


def test_a_jog_whose_speed_the_limits_cut_does_not_arrive(bench):
    """The cables of this rig may move faster than the largest step of a write allows."""
    bench.rules = {**RULES, "max_step_mm": 0.1}
    with pytest.raises(NotArrivedError, match="c1 is at"):
        jog(bench, 4.0)
