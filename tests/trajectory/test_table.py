"""Tables of samples: the path passes through them, and what is wrong is told at its line."""

from __future__ import annotations

import io
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pyarrow as pa
import pyarrow.parquet as parquet
import pytest

from tcrctl.errors import InfeasibleError, InputError, SpecError
from tcrctl.experiment.again import load_experiment
from tcrctl.experiment.prepare import make_trajectory, prepare
from tcrctl.experiment.run import run_experiment
from tcrctl.experiment.spec import load_spec
from tcrctl.log.reader import read_log
from tcrctl.replay.replay import replay
from tcrctl.robot.robot import build_robot
from tcrctl.trajectory.table import build_table
from tcrctl.trajectory.table_files import MAX_BYTES, MAX_NUMBERS, read_bytes
from tcrctl.trajectory.table_settings import TableSettings

REST = np.array([0.0, 0.0, -0.6])
ROBOT = SimpleNamespace(rest_position=REST)
T = np.linspace(0.0, 4.0, 41)
CIRCLE = np.stack((20.0 * np.cos(T) - 20.0, 20.0 * np.sin(T), 0.0 * T), axis=1)


def section(content, file="path.csv", **keys):
    return TableSettings(kind="table", file=file, lead_in_s=0.5, settle_s=0.5, **keys).with_content(content)


def csv_of(header="t_s,x_mm,y_mm,z_mm", t=T, values=CIRCLE):
    rows = (",".join(repr(float(v)) for v in (a, *b)) for a, b in zip(t, values, strict=True))
    return "\n".join((header, *rows)).encode()


def npz_of(**columns):
    buffer = io.BytesIO()
    np.savez(buffer, **columns)
    return buffer.getvalue()


def parquet_of(**columns):
    buffer = io.BytesIO()
    parquet.write_table(pa.table(columns), buffer)
    return buffer.getvalue()


X, Y, Z = CIRCLE.T
SAME = {
    "units in brackets": section(csv_of("time [s],X (mm),Y (mm),Z (mm)")),
    "other units": section(csv_of("t_ms,px_m,py_m,pz_m", 1e3 * T, 1e-3 * CIRCLE)),
    "npz": section(npz_of(t_s=T, x_mm=X, y_mm=Y, z_mm=Z, note_1=T), "path.npz"),
    "Parquet": section(parquet_of(t_s=T, x_mm=X, y_mm=Y, z_mm=Z), "path.parquet"),
    "time from elsewhere": section(csv_of(t=T + 1e4)),
    "empty lines": section(csv_of().replace(b"\n", b"\r\n\r\n")),
}


@pytest.mark.parametrize("name", SAME)
def test_the_path_is_the_same_however_the_table_is_written(name):
    t = np.linspace(-1.0, 7.0, 500)
    wanted = build_table(section(csv_of()), ROBOT).position(t)
    np.testing.assert_allclose(build_table(SAME[name], ROBOT).position(t), wanted, atol=1e-12)


def test_the_path_passes_through_its_samples_between_two_rests():
    trajectory = build_table(section(csv_of(), origin="rest"), ROBOT)
    assert trajectory.duration == 5.0
    np.testing.assert_allclose(trajectory.position(0.5 + T), REST + 1e-3 * CIRCLE, atol=1e-12)
    ends = trajectory.position(np.array([-1.0, 0.0, 0.5, 4.5, 5.0, 9.0]))
    np.testing.assert_allclose(ends, REST + 1e-3 * CIRCLE[[0, 0, 0, -1, -1, -1]], atol=1e-12)
    assert trajectory.normal(T) is None


def test_speed_and_acceleration_are_continuous():
    trajectory, h = build_table(section(csv_of()), ROBOT), 1e-4
    for knot in 0.5 + T[1:-1:7]:
        around = trajectory.position(knot + h * np.arange(-3, 4))
        second = np.diff(around, 2, axis=0) / h**2
        assert np.abs(second[-1] - second[0]).max() < 0.05 * np.abs(second).max()


def test_a_quaternion_is_the_normal_that_it_turns_z_to():
    tilt = 0.2 * np.sin(T) ** 2
    quaternion = np.stack((np.cos(tilt / 2), np.sin(tilt / 2), 0 * T, 0 * T), axis=1)
    normal = np.stack((0 * T, -np.sin(tilt), np.cos(tilt)), axis=1)
    turned = section(csv_of("t_s,x_mm,y_mm,z_mm,qw,qx,qy,qz", values=np.hstack((CIRCLE, quaternion))))
    given = section(csv_of("t_s,x_mm,y_mm,z_mm,nx,ny,nz", values=np.hstack((CIRCLE, normal))))
    t = np.linspace(0.0, 5.0, 200)
    found = build_table(turned, ROBOT).normal(t)
    np.testing.assert_allclose(found, build_table(given, ROBOT).normal(t), atol=1e-12)
    np.testing.assert_allclose(np.linalg.norm(found, axis=1), 1.0, atol=1e-12)


def changed(line, text):
    """The table with one line replaced; line 1 is the header."""
    lines = csv_of().decode().split("\n")
    lines[line - 1] = text
    return "\n".join(lines).encode()


MALFORMED = {
    "no unit": (changed(1, "t,x_mm,y_mm,z_mm"), r"path\.csv:1:1: column 't': has no unit: write t_s or t_ms"),
    "wrong unit": (
        changed(1, "t_s,x_s,y_mm,z_mm"),
        r"path\.csv:1:1: column 'x_s': unit s; allowed: m, cm, mm",
    ),
    "missing": (changed(1, "t_s,x_mm,y_mm,height_mm"), r"path\.csv:1:1: columns that are missing: z"),
    "twice": (changed(1, "t_s,x_mm,x_mm,z_mm"), r"path\.csv:1:1: column 'x_mm' stands there twice"),
    "two names": (changed(1, "t_s,x_mm,px_mm,z_mm"), r"path\.csv:1:1: columns 'x_mm' and 'px_mm' are both x"),
    "semicolons": (csv_of().replace(b",", b";"), r"path\.csv:1:1: columns must be separated by commas"),
    "no number": (changed(7, "0.5,left,0,0"), r"path\.csv:7:1: x_mm: must be a finite number, not 'left'"),
    "NaN": (changed(7, "0.5,nan,0,0"), r"path\.csv:7:1: x_mm: must be a finite number, not 'nan'"),
    "short row": (changed(7, "0.5,1"), r"path\.csv:7:1: has 2 cells; the header has 4"),
    "same time": (changed(8, "0.5,-2.4,9.5,0"), r"path\.csv:8:1: t_s: the same time as in the row before"),
    "backwards": (changed(8, "0.45,-2.4,9.5,0"), r"path\.csv:8:1: t_s: time goes backwards"),
    "gap": (
        csv_of(t=T + 2.0 * (T > 1.95)),
        r"path\.csv:22:1: t_s: a gap of 2\.1 s, where samples are usually 0\.1 s",
    ),
    "jump": (changed(12, "1.0,90,16,0"), r"path\.csv:12:1: jumps by 97\.57 mm"),
    "ms for s": (csv_of(t=1e3 * T), r"path\.csv:3:1: t_s: the samples are 100 s apart; is the time in ms\?"),
    "s for ms": (
        csv_of("t_us,x_mm,y_mm,z_mm"),
        r"path\.csv:3:1: t_us: the samples are 1e-07 s apart; is the time in s\?",
    ),
    "mm for m": (csv_of("t_s,x_m,y_m,z_m"), r"path\.csv:\d+:1: is \d+\.\d+ m away; is that in mm\?"),
    "few": (b"\n".join(csv_of().split(b"\n")[:4]), r"path\.csv:1:1: has 3 rows; a path needs at least 4"),
    "open quote": (changed(7, '0.5,"1,0,0'), r"path\.csv:7:1: a quote that is opened here is not closed"),
    "a character that acts": (
        changed(7, "0.5,1\x1b[2J,0,0"),
        r"path\.csv:7:6: character U\+001B is not allowed",
    ),
    "after an empty line": (changed(7, "\n0.5,nan,0,0"), r"path\.csv:8:1: x_mm: must be a finite number"),
    "long normal": (
        csv_of("t_s,x_mm,y_mm,z_mm,nx,ny,nz", values=np.hstack((CIRCLE, np.tile([0, 0, 1.1], (41, 1))))),
        r"path\.csv:2:1: nx: its length must be 1, not 1\.1",
    ),
    "half a normal": (
        csv_of("t_s,x_mm,y_mm,nz"),
        "columns that are missing: z, nx, ny",
    ),
}


@pytest.mark.parametrize("name", MALFORMED)
def test_what_is_wrong_is_told_at_its_line(name):
    content, message = MALFORMED[name]
    with pytest.raises(SpecError, match=message):
        build_table(section(content), ROBOT)


REFUSED = {
    "path.npz": (b"PK nonsense", "is no npz file of numbers"),
    "path.parquet": (b"nonsense", "is no Parquet file"),
    "path.txt": (b"t_s", r"must end in \.csv, \.parquet or \.npz"),
}


@pytest.mark.parametrize("file", REFUSED)
def test_a_file_of_another_kind_is_refused(file):
    content, message = REFUSED[file]
    with pytest.raises(InputError, match=message):
        build_table(section(content, file), ROBOT)


def test_a_pickle_in_an_archive_is_not_opened():
    objects = np.array([{}], dtype=object)
    with pytest.raises(InputError, match="is no npz file of numbers"):
        build_table(section(npz_of(t_s=objects), "path.npz"), ROBOT)


def packed(form):
    """A small file that expands to twice the numbers that may be."""
    zeros, stream = np.zeros(2 * MAX_NUMBERS), io.BytesIO()
    if form == "npz":
        np.savez_compressed(stream, t_s=zeros)
    else:
        parquet.write_table(pa.table({"t_s": zeros}), stream)
    return stream.getvalue()


@pytest.mark.parametrize("form", ["npz", "parquet"])
def test_a_small_file_that_expands_to_a_large_one_is_refused_before_it_does(form):
    content = packed(form)
    assert len(content) < 200_000
    with pytest.raises(InputError, match=f"expands to more than {MAX_NUMBERS} numbers"):
        build_table(section(content, f"path.{form}"), ROBOT)


@pytest.mark.skipif(not Path("/dev/zero").exists(), reason="has no file without an end")
def test_a_file_without_an_end_is_refused():
    with pytest.raises(InputError, match="this is a device, not a file"):
        read_bytes(Path("/dev/zero"))


def test_a_file_that_is_larger_than_any_table_is_refused(tmp_path):
    large = tmp_path / "path.csv"
    with large.open("wb") as file:
        file.truncate(MAX_BYTES + 1)
    with pytest.raises(InputError, match="larger than 64 MiB"):
        read_bytes(large)


def test_samples_that_need_too_much_acceleration_are_refused_with_their_time():
    with pytest.raises(InfeasibleError, match=r"acceleration of path\.csv is .* mm/s2, limit 5 mm/s2"):
        build_table(section(csv_of(), acceleration_limit_mm_s2=5.0), ROBOT)


def test_a_missing_file_is_told_where_the_experiment_names_it(tmp_path):
    spec = tmp_path / "own.yaml"
    spec.write_text(
        "name: own\nrobot: tcr600\ntrajectory: {kind: table, file: gone.csv}\n"
        "controller: {kind: ioc}\nplant: {kind: simulated}\n"
    )
    with pytest.raises(SpecError, match=r"own\.yaml:3:27: trajectory\.file: .*gone\.csv: cannot be read"):
        load_spec(str(spec))


@pytest.mark.slow
def test_a_shipped_letter_sampled_at_the_control_rate_is_the_same_path(tmp_path):
    loaded = load_spec("letter_t")
    robot = build_robot(loaded.robot)
    strokes = make_trajectory(loaded.spec, robot)
    t = np.arange(0.0, strokes.duration, 0.05)
    table = section(csv_of(t=t, values=1e3 * strokes.position(t)))
    between = np.arange(0.0, t[-1], 0.011)
    apart = build_table(table, robot).position(0.5 + between) - strokes.position(between)
    assert np.linalg.norm(apart, axis=1).max() < 2e-5


@pytest.mark.slow
def test_a_run_keeps_its_table_and_is_replayed_and_done_again_without_the_file(tmp_path):
    (tmp_path / "path.csv").write_bytes(csv_of(t=0.25 * T, values=0.02 * CIRCLE))
    (tmp_path / "own.yaml").write_text(
        "name: own\nrobot: tcr600\n"
        "trajectory: {kind: table, file: path.csv, origin: rest, lead_in_s: 0, settle_s: 0}\n"
        "controller: {kind: kinematic}\nplant: {kind: simulated}\n"
    )
    first = run_experiment(prepare(load_spec(str(tmp_path / "own.yaml"))), out=tmp_path / "runs").log
    (tmp_path / "path.csv").unlink()
    assert replay(first).status == "identical"
    again = run_experiment(prepare(load_experiment(str(first.parent))), out=tmp_path / "again").log
    steps = zip(read_log(first).steps(), read_log(again).steps(), strict=True)
    assert all(a.wanted.speed.tobytes() == b.wanted.speed.tobytes() for a, b in steps)
    assert read_log(again).attachments["trajectory.csv"] == read_log(first).attachments["trajectory.csv"]
