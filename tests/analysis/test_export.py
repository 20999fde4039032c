"""What is exported comes back in the tools that people use: the same bits, with units, errors and events."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.io

from support import records
from support.log_files import STOP, open_log
from tcrctl.analysis.export import export_log
from tcrctl.analysis.result import run_result
from tcrctl.analysis.table import UNIT_SUFFIX, table
from tcrctl.errors import InputError
from tcrctl.log.reader import read_log

N_STEPS = 20
MESSAGE = "cable c1 slack, „müde“\nand more"


@pytest.fixture(scope="module")
def log(tmp_path_factory):
    path = tmp_path_factory.mktemp("logs") / "log.mcap"
    with open_log(path) as writer:
        for k in range(N_STEPS):
            writer.step(records.record(k))
        writer.event(0.5, "limit", "warning", MESSAGE)
        writer.finish(STOP)
    return path


@pytest.fixture(scope="module")
def logged(log):
    """What shall come back: numbers by name of their column."""
    return {name: series.values for name, series in table(read_log(log), nodes=True, ahead=True).items()}


@pytest.fixture(scope="module")
def events(log):
    """What shall come back of the events."""
    return [(event.t, event.kind, event.level, event.message) for event in read_log(log).events()]


def same_numbers(frame, logged):
    assert list(frame.columns) == list(logged)
    for name, values in logged.items():
        if values.dtype.kind != "U":
            found = frame[name].to_numpy().astype(values.dtype)
            np.testing.assert_array_equal(found, values, err_msg=name)


@pytest.mark.slow
@pytest.mark.parametrize("form", ["csv", "parquet"])
def test_pandas_reads_tables_with_the_same_bits(form, log, logged, events, tmp_path):
    pandas = pytest.importorskip("pandas")
    steps, beside = export_log(log, form, tmp_path / f"run.{form}", nodes=True, ahead=True).files
    if form == "csv":
        frames = [pandas.read_csv(file) for file in (steps, beside)]
    else:
        frames = [pandas.read_parquet(file) for file in (steps, beside)]
    same_numbers(frames[0], logged)
    assert list(frames[1].itertuples(index=False, name=None)) == events


def test_matlab_files_hold_whole_quantities_names_and_events(log, events, tmp_path):
    made = export_log(log, "mat", tmp_path / "run.mat")
    held, log = scipy.io.loadmat(made.files[0]), read_log(log)
    assert {name for name in held if not name.startswith("__")} == set(made.names)
    assert all(len(name) <= 63 for name in made.names)
    for name, values in log.columns().items():
        (found,) = [held[key] for key in (name, *(name + end for end in UNIT_SUFFIX.values())) if key in held]
        if values.dtype.kind != "U" and values.size:
            wanted = values[:, None] if values.ndim == 1 else values
            np.testing.assert_array_equal(found, wanted.astype(found.dtype), err_msg=name)
    assert [cell[0] for cell in held["cable_names"].ravel()] == list(log.cable_names)
    columns = [held[f"events_{name}"].ravel() for name in ("t_s", "kind", "level", "message")]
    assert [(row[0], *(text[0] for text in row[1:])) for row in zip(*columns, strict=True)] == events


def test_every_column_of_a_parquet_file_tells_unit_and_meaning(log, tmp_path):
    parquet = pytest.importorskip("pyarrow.parquet")
    for file in export_log(log, "parquet", tmp_path / "run.parquet", nodes=True, ahead=True).files:
        for field in parquet.read_schema(file):
            told = {key.decode(): value.decode() for key, value in field.metadata.items()}
            unit = told["unit"] if told["unit"] != "1" else ""
            assert field.name.endswith(UNIT_SUFFIX[unit]) if unit else unit == ""
            assert told["meaning"] or field.name in ("k", "t_s", "period_s")


def test_errors_are_those_of_the_result(log):
    found, result = table(read_log(log)), run_result(read_log(log))
    position, angle = (found[f"error_{name}"].values for name in ("position_m", "orientation_rad"))
    assert 1e3 * position.max() == pytest.approx(result["position_error_mm"]["max"], rel=1e-12)
    assert np.degrees(angle).max() == pytest.approx(result["orientation_error_deg"]["max"], rel=1e-12)


def test_neither_table_is_written_if_one_exists(log, tmp_path):
    (tmp_path / "run.events.csv").write_text("mine")
    with pytest.raises(InputError, match=r"run.events.csv: exists already"):
        export_log(log, "csv", tmp_path / "run.csv")
    assert [path.name for path in tmp_path.iterdir()] == ["run.events.csv"]
    assert len(export_log(log, "csv", tmp_path / "run.csv", force=True).files) == 2
