"""Fault scripts: checked before anything starts, and played at the times they say."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tcr_hardware.emulators.motive import MotiveEmulator, MotiveSettings
from tcr_hardware.emulators.plc import PlcEmulator
from tcr_hardware.emulators.plc_faults import FAULTS
from tcrctl.emulate.drive_faults import ARGUMENTS, Drives, drives_of
from tcrctl.emulate.fault_script import CAMERA_FAULTS, FaultPlayer, load_fault_script
from tcrctl.errors import SpecError
from tcrctl.plant.rig.file import read_rig


def script(tmp_path, *lines, **names):
    path = tmp_path / "faults.yaml"
    path.write_text("faults:\n" + "".join(f"  - {line}\n" for line in lines))
    return load_fault_script(path, **names)


WRONG = {
    "neither": ("{at_s: 1}", "either cameras or plc"),
    "both": ("{at_s: 1, plc: estop, cameras: restart}", "either cameras or plc"),
    "unknown camera fault": ("{at_s: 1, cameras: {los: 0.1}}", "no such fault; known: loss"),
    "unknown plc fault": ("{at_s: 1, plc: estopp}", "no fault estopp; known: exception"),
    "unknown argument": ("{at_s: 1, plc: jam, with: {axle: 2}}", "jam has no such argument; known: axis"),
    "not a share": ("{at_s: 1, cameras: {loss: much}}", "must be a number"),
    "not a switch": ("{at_s: 1, cameras: {freeze: 1}}", "must be true or false"),
    "not names": ("{at_s: 1, cameras: {nan: 3}}", "must be a list of marker names"),
    "not pairs": ("{at_s: 1, cameras: {swap: [a, b]}}", "must be a list of pairs"),
    "not a vector": ("{at_s: 1, cameras: {turned_deg: [0, 20]}}", "must be three numbers, not [0, 20]"),
    "not finite": ("{at_s: 1, cameras: {drift_mm_s: [0, .inf, 0]}}", "must be three numbers"),
    "not a body": ("{at_s: 1, cameras: {pivot: 3}}", "must be the name of a body, not 3"),
    "not a version": ("{at_s: 1, cameras: {version: 4.1}}", "must be a version such as '3.1'"),
    "before the start": ("{at_s: -1, plc: estop}", "must be >= 0"),
    "more than all frames": ("{at_s: 1, cameras: {loss: 3}}", "must be a share of the frames, 0 to 1, not 3"),
    "earlier than now": ("{at_s: 1, cameras: {delay_s: -0.1}}", "must be >= 0, not -0.1"),
    "no exception code": (
        "{at_s: 1, plc: exception, with: {code: 0}}",
        "must be a whole number from 1 to 255",
    ),
    "half an axis": (
        "{at_s: 1, plc: jam, with: {axis: 1.5}}",
        "must be a whole number from 1 to 252, not 1.5",
    ),
    "no count": ("{at_s: 1, plc: silence, with: {count: -1}}", "must be a whole number from 1"),
    "late by a negative time": (
        "{at_s: 1, plc: delay, with: {seconds: -1}}",
        "must be a number from 0 to 3600",
    ),
    "arguments of cameras": ("{at_s: 1, cameras: restart, with: {axis: 1}}", "cameras take no arguments"),
    "unknown event": ("{at_s: 1, after: lunch, plc: estop}", "after"),
}


@pytest.mark.parametrize("name", WRONG)
def test_a_mistake_is_found_before_anything_starts(name, tmp_path):
    line, message = WRONG[name]
    with pytest.raises(SpecError) as caught:
        script(tmp_path, line)
    assert message in str(caught.value)
    assert "faults.yaml:2:" in str(caught.value)


STRANGERS = {
    "robot": ("{at_s: 1, plc: estop, robot: tcr999}", ":2:27: faults.0.robot: there is no robot tcr999"),
    "marker": (
        "{at_s: 1, cameras: {nan: [a.1, b.7]}}",
        ":2:25: faults.0.cameras.nan: there is no marker b.7",
    ),
    "body": ("{at_s: 1, cameras: {moved_labels: [b]}}", "there is no body b; there are a, ..."),
    "pivot": ("{at_s: 1, cameras: {pivot: a.1}}", "there is no body a.1; there are a, ..."),
    "pair of bodies": ("{at_s: 1, cameras: {exchanged: [[a, a.2]]}}", "there is no body a.2"),
    "marker or body": ("{at_s: 1, cameras: {drifting: [a, a.1, q]}}", "there is no marker q; there are a.1"),
    "pair": ("{at_s: 1, cameras: {swap: [[a.1, c.3]]}}", "there is no marker c.3"),
}


RIGHT = {
    **{"tcr999": "tcr600", "b.7": "a.2", "c.3": "a.2", "[b]": "[a]", "pivot: a.1": "pivot: a"},
    **{"[a, a.2]": "[a, a]", ", q]": "]"},
}


@pytest.mark.parametrize("name", STRANGERS)
def test_a_robot_or_marker_that_is_not_on_the_rig_is_found_before_anything_starts(name, tmp_path):
    line, message = STRANGERS[name]
    known = {
        "robots": dict.fromkeys(("tcr600", "tcr700"), Drives({"estop": ()}, (1,))),
        "markers": ["a.1", "a.2"],
    }
    with pytest.raises(SpecError) as caught:
        script(tmp_path, line, **known)
    assert message in str(caught.value)
    for strange, right in RIGHT.items():
        line = line.replace(strange, right)
    script(tmp_path, line, **known)


OF_DRIVES = {
    "loopback: {plc: jam, with: {axis: 4}, robot: tcr600}": "drives of tcr600 have no axis 4; they have 1, 2, 3",
    "loopback: {plc: drive, with: {axis: 1}}": "the drives of tcr600 have a fault drive that takes no arguments",
    "dynamixel_loopback: {plc: estop}": "the drives of tcr600 have no fault estop; they have silence, corrupt",
    "dynamixel_loopback: {plc: jam, with: {axis: 7}, robot: tcr700}": "have no axis 7; they have 1, 2, 3, 4, 5, 6",
    "dynamixel_loopback: {plc: exception, with: {code: 4}}": "have no fault exception",
}


@pytest.mark.parametrize("line", OF_DRIVES)
def test_what_the_drives_of_a_robot_do_not_have_is_found_before_anything_starts(line, tmp_path):
    rig, _, fault = line.partition(": ")
    robots = drives_of(read_rig(rig)[0])
    with pytest.raises(SpecError) as caught:
        script(tmp_path, fault.replace("{", "{at_s: 1, ", 1), robots=robots)
    assert OF_DRIVES[line] in str(caught.value)
    script(tmp_path, "{at_s: 1, plc: jam, with: {axis: 3}}", robots=robots)
    motors = [] if rig == "loopback" else ["{at_s: 2, plc: drive, with: {axis: 2}}"]
    script(tmp_path, "{at_s: 1, plc: delay, with: {seconds: 0.2}}", *motors, robots=robots)


@pytest.fixture
def bench():
    plc = PlcEmulator()
    plc.positions_um = lambda: plc.where
    plc.where = (0.0,) * 6
    motive = MotiveEmulator(["a.1", "a.2"], lambda: np.zeros((2, 3)), MotiveSettings(command_port=0))
    yield motive, plc
    motive.stop()


def test_faults_come_and_go_at_their_times(tmp_path, bench):
    motive, plc = bench
    said = []
    made = script(
        tmp_path,
        "{at_s: 1, cameras: {loss: 0.5, nan: [a.1], swap: [[a.1, a.2]], offset_m: [0.1, 0, 0]}, for_s: 2}",
        "{at_s: 2, plc: jam, with: {axis: 3}, for_s: 1}",
        "{at_s: 0.5, after: moving, plc: silence}",
    )
    player = FaultPlayer(made, motive, {"tcr600": plc}, said.append)
    seen = {}
    for now in np.arange(0.0, 6.0, 0.25):
        plc.where = (0.0 if now < 4.0 else 100.0,) * 6
        player.play(float(now))
        seen[float(now)] = (motive.faults.loss, dict(plc.faults.active))
    assert [now for now, (loss, _) in seen.items() if loss] == [1.0 + 0.25 * i for i in range(8)]
    assert [now for now, (_, active) in seen.items() if "jam" in active] == [2.0, 2.25, 2.5, 2.75]
    assert seen[2.0][1]["jam"]["axis"] == 3
    assert [now for now, (_, active) in seen.items() if "silence" in active] == [
        4.5 + 0.25 * i for i in range(6)
    ]
    assert (motive.faults.nan, motive.faults.swap, motive.faults.offset_m) == (
        frozenset(),
        (),
        (0.0, 0.0, 0.0),
    )
    assert sum("fault:" in text for text in said) == 3


def test_a_fault_of_one_robot_leaves_the_others_alone(tmp_path, bench):
    motive, plc = bench
    other = PlcEmulator()
    made = script(tmp_path, "{at_s: 0, plc: estop, robot: tcr700}")
    FaultPlayer(made, motive, {"tcr600": plc, "tcr700": other}, lambda text: None).play(0.0)
    assert (list(plc.faults.active), list(other.faults.active)) == ([], ["estop"])


def test_every_fault_of_the_emulators_can_be_asked_for(tmp_path):
    names = "[a.1]"
    values = {
        **{"occluded": names, "missing": names, "nan": names, "swap": "[[a.1, a.2]]"},
        **{"offset_m": "[0, 0, 1]", "reorder": "2", "version": "'3.1'", "renamed": "true"},
        **dict.fromkeys(("turned_deg", "turning_deg_s", "mirrored", "drift_mm_s"), "[0, 0, 1]"),
        **{"pivot": "a", "moved_labels": "[a]", "exchanged": "[[a, b]]", "drifting": "[a, b.1]"},
    }
    switches = ("freeze", "silent", "mute", "untracked", "unlabelled")
    given = {name: values.get(name, "true" if name in switches else "0.5") for name in CAMERA_FAULTS}
    lines = [f"{{at_s: 0, cameras: {{{name}: {value}}}}}" for name, value in given.items()]
    lines += [f"{{at_s: 0, plc: {name}}}" for name in FAULTS]
    assert len(script(tmp_path, *lines).faults) == len(CAMERA_FAULTS) + len(FAULTS)


def test_the_document_of_the_bench_names_every_fault_and_argument():
    text = (Path(__file__).parents[2] / "docs" / "bench.md").read_text()
    names = [*CAMERA_FAULTS, *ARGUMENTS, *(name for taken in ARGUMENTS.values() for name in taken)]
    assert [name for name in names if f"`{name}`" not in text and f"{name}: " not in text] == []


def test_cameras_change_names_and_version_and_change_them_back(tmp_path, bench):
    motive, plc = bench
    made = script(tmp_path, "{at_s: 1, cameras: {renamed: true, version: '3.1'}, for_s: 1}")
    player = FaultPlayer(made, motive, {"tcr600": plc}, lambda text: None)
    player.play(1.0)
    assert (motive.tracked.names, motive.version) == (("a.1?", "a.2?"), (3, 1))
    player.play(2.0)
    assert (motive.tracked.names, motive.version) == (("a.1", "a.2"), (4, 1))


def test_what_belongs_together_is_wrong_in_the_same_frame(tmp_path, bench):
    motive, plc = bench
    made = script(tmp_path, "{at_s: 1, cameras: {turned_deg: [0, 0, 90], pivot: a}, for_s: 1}")
    seen = []

    class Watched:
        """Takes note of every change of the faults."""

        tracked, settings = motive.tracked, motive.settings

        def __setattr__(self, name, value):
            seen.append((value.turned_deg, value.pivot))
            object.__setattr__(self, name, value)

    watched = Watched()
    object.__setattr__(watched, "faults", motive.faults)
    player = FaultPlayer(made, watched, {"tcr600": plc}, lambda text: None)
    player.play(1.0)
    player.play(2.0)
    assert seen == [((0.0, 0.0, 90.0), "a"), ((0.0, 0.0, 0.0), "")]
