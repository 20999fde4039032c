"""Rows survive whatever ends the process that writes them; addresses tell runs apart."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from support.short_runs import ROOT, short_spec
from support.studies import QUICK, SOFT, quick_study
from tcrctl.errors import DeviceError
from tcrctl.experiment.spec import load_spec
from tcrctl.study import address as addressing
from tcrctl.study.address import ABOVE, address
from tcrctl.study.plan import planned
from tcrctl.study.row import Row, loads
from tcrctl.study.store import ROWS, Store

TEXT = st.text(max_size=20)


def row(i, **more):
    return Row(f"{i:064x}", "success", "", {"position_error_mm": {"max": 0.1 * i}}, seconds=1.0, **more)


@given(TEXT, st.floats(allow_nan=False, allow_infinity=False), TEXT)
def test_a_row_is_read_as_it_was_written(reason, value, log):
    given_row = Row("a" * 64, "failed", reason, {"x": value, "y": [None, True]}, 1.0, {}, log)
    assert loads(given_row.dumps()) == given_row
    assert given_row.dumps().count(b"\n") == 1


@pytest.mark.parametrize("kept", range(0, 400, 37))
def test_whatever_is_torn_off_the_end_only_whole_rows_count_and_new_ones_follow(kept, tmp_path):
    with Store(tmp_path) as store:
        for i in range(3):
            store.add(row(i))
    path = tmp_path / ROWS
    whole = path.read_bytes()
    path.write_bytes(whole[:kept])
    with Store(tmp_path) as store:
        count = whole[:kept].count(b"\n")
        assert len(store) == count
        assert store.repaired == (not whole[:kept].endswith(b"\n") and kept > 0)
        store.add(row(7))
    with Store(tmp_path) as store:
        assert [store.get(f"{i:064x}") for i in (*range(count), 7)] == [row(i) for i in (*range(count), 7)]
        assert store.repaired == 0


def test_a_line_that_is_spoilt_in_the_middle_is_that_run_alone(tmp_path):
    with Store(tmp_path) as store:
        for i in range(3):
            store.add(row(i))
    lines = (tmp_path / ROWS).read_bytes().splitlines(keepends=True)
    (tmp_path / ROWS).write_bytes(lines[0] + b"#" * (len(lines[1]) - 1) + b"\n" + lines[2])
    with Store(tmp_path) as store:
        assert (len(store), store.repaired) == (2, 1)
        assert store.get(row(2).address) == row(2)


@pytest.mark.parametrize(
    "changes",
    [
        {"status": 5}, {"status": "fine"}, {"status": []}, {"address": [1]}, {"reason": None}, {"result": [1]},
        {"result": None}, {"timing": 5}, {"path": []}, {"log": 5}, {"program": 5}, {"seconds": "x"}, {"more": 1},
    ],
)  # fmt: skip
def test_a_row_with_values_of_other_types_is_no_row_and_its_run_is_done_again(changes, tmp_path):
    good = json.loads(row(0).dumps())
    (tmp_path / ROWS).write_text(json.dumps({**good, **changes}) + "\n" + row(1).dumps().decode())
    with Store(tmp_path) as store:
        assert (len(store), store.repaired) == (1, 1)
        assert store.get(row(1).address) == row(1)


def test_the_last_row_of_an_address_counts_and_only_what_has_no_result_is_forgotten(tmp_path):
    with Store(tmp_path) as store:
        store.add(Row("a", "timeout", "late"))
        store.add(Row("b", "aborted", "diverged"))
        store.add(Row("d", "error", "disk full"))
        store.forget(["a", "b", "c", "d"])
        assert [name in store for name in "abd"] == [False, True, False]
        store.add(Row("a", "success", ""))
    with Store(tmp_path) as store:
        assert store.get("a").status == "success"


def test_a_second_writer_is_told_who_the_first_one_is(tmp_path):
    with Store(tmp_path), pytest.raises(DeviceError, match=f"another process, {os.getpid()}"):
        Store(tmp_path).__enter__()
    with Store(tmp_path) as store:
        store.add(row(0))


def fill(store, text):
    for i in range(100):
        store.add(row(i, log=text))


def test_a_full_disk_loses_no_row_that_was_there(tiny_filesystem):
    long = "x" * 20000
    with Store(tiny_filesystem) as store:
        with pytest.raises(DeviceError, match="a row cannot be written"):
            fill(store, long)
        count = len(store)
    with Store(tiny_filesystem) as store:
        assert (len(store), store.repaired) == (count, 0)
        assert count >= 5


WRITER = """
import sys
from pathlib import Path
from tcrctl.study.plan import planned
from tcrctl.study.row import Row
from tcrctl.study.store import Store
with Store(Path(sys.argv[1])) as store:
    print("ready", flush=True)
    for i in range(10**9):
        store.add(Row(f"{i:064x}", "success", "", {"x": "y" * 3000}))
"""


@pytest.mark.slow
def test_kill_9_in_the_middle_of_writing_leaves_whole_rows(tmp_path):
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(sys.path)}
    for _ in range(3):
        writer = subprocess.Popen(
            [sys.executable, "-c", WRITER, str(tmp_path)], env=environment, stdout=subprocess.PIPE
        )
        writer.stdout.readline()
        while (tmp_path / ROWS).stat().st_size < 100_000:
            pass
        writer.send_signal(signal.SIGKILL)
        writer.communicate()
        with Store(tmp_path) as store:  # the lock went with its process
            assert store.repaired <= 1
            assert all(store.get(f"{i:064x}") is not None for i in range(len(store)))


def test_what_a_number_depends_on_changes_the_address_and_words_do_not(monkeypatch):
    def of(*overrides, seed=1, random_path=False):
        return address(short_spec(*overrides), seed, random_path=random_path)

    base = of()
    assert base == of() == of("description=other", "seed=5")
    assert base == of(f"{SOFT}=0.7")  # what the file says anyway
    others = [
        of(f"{SOFT}=0.8"), of(seed=2), of(random_path=True), of("robot=tcr5x4"), of("controller.weights.speed=2.0"),
        of("plant.realistic=moderate"), of("plant.realistic=moderate", seed=2), of("plant.tip_load_g=1"),
    ]  # fmt: skip
    assert len({base, *others}) == len(others) + 1
    monkeypatch.setattr(addressing, "program", lambda: "another version")
    assert of() != base


def test_a_robot_of_the_same_name_with_other_numbers_has_another_address(tmp_path):
    path = load_spec("letter_t").robot_path
    text = path.read_text()
    robot = tmp_path / "tcr600.yaml"
    robot.write_text(text)
    spec = tmp_path / "spec.yaml"
    spec.write_text(load_spec("letter_t").path.read_text().replace("robot: tcr600", "robot: ./tcr600.yaml"))
    before = address(load_spec(str(spec)), 1, random_path=False)
    robot.write_text(text.replace("youngs_modulus_mpa: 90", "youngs_modulus_mpa: 91"))
    assert robot.read_text() != text
    assert address(load_spec(str(spec)), 1, random_path=False) != before


def test_samples_and_code_of_others_count_by_what_is_in_their_files(tmp_path):
    spec = tmp_path / "spec.yaml"
    own = "trajectory: {kind: table, file: path.csv}\ncontroller: {kind: ./own.py:OWN, period_s: 0.05}\n"
    spec.write_text(f"name: mine\nrobot: tcr600\nplant: {{kind: simulated}}\n{own}")
    rows = "t_s,x_mm,y_mm,z_mm\n" + "\n".join(f"{t},{{}},0,-600" for t in range(5)) + "\n"
    code = """
from tcrctl.extend import OwnControllerSection
class Own(OwnControllerSection):
    pass
OWN = (Own, lambda settings, robot: None)
"""

    def written(x, comment):
        (tmp_path / "path.csv").write_text(rows.format(*[x * t for t in range(5)]))
        (tmp_path / "own.py").write_text(code + comment)
        return address(load_spec(str(spec)), 1, random_path=False)

    assert written(1, "") == written(1, "")
    assert len({written(1, ""), written(2, ""), written(1, "# another")}) == 3


def test_a_robot_beside_the_study_is_found_and_counts_by_what_it_says_not_by_where_it_is(tmp_path):
    text = load_spec("letter_t").robot_path.read_text()
    found = []
    for name in ("a", "b"):
        folder = tmp_path / name
        folder.mkdir()
        (folder / f"robot_{name}.yaml").write_text(text)
        study = quick_study(folder, set={**QUICK, "robot": f"./robot_{name}.yaml"})
        found += planned(study)
    assert found[0].address == found[1].address == planned(quick_study(tmp_path))[0].address


def test_what_the_address_leaves_out_stands_above_experiments_and_imports_point_down():
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text())["tool"]["importlinter"]["contracts"]
    (layers,) = (contract["layers"] for contract in contracts if contract["id"] == "layers")
    names = [[name.strip(" ()") for name in layer.replace(":", "|").split("|")] for layer in layers]
    above = [name for layer in names[: names.index(["experiment"])] for name in layer]
    assert {*above, "caches", "executors"} == {*ABOVE}
    roots = {name.partition("/")[0] for name, _ in addressing._sources()}
    assert roots == {"tcrctl", "tcr_hardware"}
