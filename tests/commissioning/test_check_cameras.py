"""What ``tcrctl rig check`` says about frames: how old they are, and whose."""

from __future__ import annotations

from dataclasses import replace

import pytest

from support.fault_matrix import PATIENT, WatchedEmulators
from tcr_hardware.emulators.motive import CLOCK_HZ, MotiveEmulator
from tcr_hardware.emulators.motive_settings import MotiveSettings
from tcr_hardware.emulators.plc_program import PlcProgram
from tcrctl.commissioning.check import check_rig

pytestmark = pytest.mark.slow


def lines(robot, faults=None, **settings):
    """Everything that is found."""
    motive = MotiveSettings(**{"command_port": 0, "rate_hz": 200.0, **settings})
    with WatchedEmulators(robot, PATIENT, motive_settings=motive) as emulators:
        for name, value in (faults or {}).items():
            setattr(emulators.motive.faults, name, value)
        return list(check_rig(emulators.loaded(), robot, 0.05))


def findings(robot, faults=None, **settings):
    """The last line of every kind."""
    return {found.what: found for found in lines(robot, faults, **settings)}


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


def rings_swapped(*rings):
    return tuple(tuple(f"m{ring}.n{node}" for ring in rings) for node in (1, 2, 3))


@pytest.mark.parametrize(
    ("faults", "named"),
    [
        ({"swap": rings_swapped(2, 4)}, ("ring 2", "ring 4")),
        ({"swap": (("m3.n1", "m3.n2"), ("m3.n2", "m3.n3"))}, ("ring 3",)),
        ({"turned_deg": (0.0, 0.0, 20.0)}, ("turned about the vertical by 20 deg",)),
        ({"mirrored": (1.0, 0.0, 0.0)}, ("mirrored",)),
    ],
    ids=["rings swapped", "labels turned", "frame turned", "frame mirrored"],
)
def test_a_picture_that_a_run_would_not_believe_is_a_finding_with_ring_or_frame(faults, named, tcr5x4):
    told = [found for found in lines(tcr5x4, faults) if found.what == "picture"]
    assert {found.exit_code for found in told} == {4}
    said = " ".join(found.text for found in told)
    assert all(name in said for name in named), said


def test_a_right_picture_is_said_to_be_right(tcr5x4):
    told = [found for found in lines(tcr5x4) if found.what == "picture"]
    assert [found.exit_code for found in told] == [0]


def test_a_picture_is_not_judged_while_nobody_knows_where_the_drives_are(tcr5x4, monkeypatch):
    never = property(lambda program: False, lambda program, value: None)
    monkeypatch.setattr(PlcProgram, "zeroed", never, raising=False)
    told = [found for found in lines(tcr5x4, {"mirrored": (1.0, 0.0, 0.0)}) if found.what == "picture"]
    assert [(found.exit_code, "not judged" in found.text) for found in told] == [(0, True)]
