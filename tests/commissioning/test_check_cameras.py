"""What ``tcrctl rig check`` says about frames: how old they are, and whose."""

from __future__ import annotations

from dataclasses import replace

import pytest

from support.fault_matrix import PATIENT, WatchedEmulators
from tcr_hardware.emulators.motive import CLOCK_HZ, MotiveEmulator
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcrctl.commissioning.check import check_rig

pytestmark = pytest.mark.slow


def findings(robot, faults=None, **settings):
    motive = MotiveSettings(**{"command_port": 0, "rate_hz": 200.0, **settings})
    with WatchedEmulators(robot, PATIENT, motive_settings=motive) as emulators:
        for name, value in (faults or {}).items():
            setattr(emulators.motive.faults, name, value)
        return {found.what: found for found in check_rig(emulators.loaded(), robot, 0.05)}


@pytest.mark.parametrize("version", ["2.5", "2.7", "2.9"])
def test_old_servers_do_not_tell_how_old_a_frame_is(version, tcr5x4):
    """Their frames carry a time stamp where newer ones have nothing; it is not taken for an age."""
    found = findings(tcr5x4, version=version)
    assert f"not told by NatNet {version}" in found["age"].text
    assert found["age"].exit_code == 0
    assert found["frames"].exit_code == 0


def test_an_age_beyond_what_a_run_accepts_is_a_finding(tcr5x4):
    good, bad = findings(tcr5x4), findings(tcr5x4, latency_s=0.3)
    assert (good["age"].exit_code, bad["age"].exit_code) == (0, 4)
    assert "stale_after_ms" in bad["age"].text


def test_impossible_time_stamps_are_a_finding(tcr5x4, monkeypatch):
    """A server that says of every frame that it was taken 20 s ago."""
    look = MotiveEmulator._look

    def long_ago(motive, now):
        stamp, view = look(motive, now)
        return replace(stamp, mid_exposure=stamp.mid_exposure - 20 * CLOCK_HZ), view

    monkeypatch.setattr(MotiveEmulator, "_look", long_ago)
    found = findings(tcr5x4)
    assert (found["age"].exit_code, "impossible" in found["age"].text) == (4, True)


def test_a_second_source_of_frames_is_a_finding(tcr5x4):
    found = findings(tcr5x4, {"second_source": 0.1})
    assert found["source"].exit_code == 4
    assert "second source" in found["source"].text
    assert "source" not in findings(tcr5x4)
