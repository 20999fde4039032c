"""Tables of samples as files: CSV, Parquet and npz become columns of numbers."""

from __future__ import annotations

import io
import math
import zipfile
from pathlib import Path
from typing import Any

import numpy as np

from tcrctl.config.budget import MAX_PROBLEMS
from tcrctl.config.csv_table import CsvTable, number_in
from tcrctl.errors import InputError, Problem, SpecError
from tcrctl.regular_file import open_file
from tcrctl.signals import Array
from tcrctl.trajectory.samples import Columns

#: Largest file [bytes], and most numbers.
MAX_BYTES = 64 * 2**20
MAX_NUMBERS = 4_000_000


def read_bytes(path: Path) -> bytes:
    """Return a file's bytes.

    Raises:
        InputError: If it cannot be read, or is too large.
    """
    try:
        with open_file(path) as file:
            content = file.read(MAX_BYTES + 1)  # the size that a file tells may be wrong
    except OSError as error:
        raise InputError(f"{path}: cannot be read: {error.strerror}") from None
    if len(content) > MAX_BYTES:
        raise InputError(f"{path}: larger than {MAX_BYTES // 2**20} MiB")
    return content


def columns_of(content: bytes, name: str) -> Columns:
    """Return the columns of a table.

    Args:
        content: The file's bytes.
        name: The file's name: how it ends says what it is; also for messages.

    Raises:
        SpecError: If a cell is no number, at its line.
        InputError: If the file is of another kind, or damaged.
    """
    ending = Path(name).suffix.lower()
    if ending == ".csv":
        return _csv(content, name)
    if ending == ".npz":
        return _npz(content, name)
    if ending in (".parquet", ".pq"):
        return _parquet(content, name)
    raise InputError(f"{name}: must end in .csv, .parquet or .npz")


def _csv(content: bytes, name: str) -> Columns:
    table = CsvTable(content, name)
    header = table.header
    if table.separator is not None:
        raise SpecError([Problem(f"{name}:1:1", "", "columns must be separated by commas")])
    if len(set(header)) != len(header):
        twice = next(cell for cell in header if header.count(cell) > 1)
        raise SpecError([Problem(f"{name}:1:1", "", f"column {twice!r} stands there twice")])
    problems: list[Problem] = []
    lines: list[int] = []
    numbers: list[list[float]] = []
    for line, cells in table.rows():
        lines.append(line)
        numbers.append(_row(cells, header, f"{name}:{line}:1", problems))
        if len(problems) >= MAX_PROBLEMS:
            break
    if problems:
        raise SpecError(problems)
    values = np.array(numbers, dtype=float).reshape(len(numbers), len(header))
    return Columns(name, dict(zip(header, values.T, strict=True)), tuple(lines))


def _row(row: list[str], header: list[str], where: str, problems: list[Problem]) -> list[float]:
    """Return a row's numbers; NaN, with a problem, where there is none."""
    if len(row) != len(header):
        problems.append(Problem(where, "", f"has {len(row)} cells; the header has {len(header)}"))
        return [math.nan] * len(header)
    found = [number_in(cell) for cell in row]
    problems += [
        Problem(where, column, f"must be a finite number, not {cell.strip()[:40]!r}")
        for column, cell, number in zip(header, row, found, strict=True)
        if math.isnan(number)
    ]
    return found


def _npz(content: bytes, name: str) -> Columns:
    try:
        with zipfile.ZipFile(io.BytesIO(content)) as archive:
            _check_count(sum(member.file_size for member in archive.infolist()) // 8, name)
        with np.load(io.BytesIO(content), allow_pickle=False) as arrays:  # a pickle would be a program
            return Columns(name, _vectors({key: arrays[key] for key in arrays.files}, name))
    except InputError:
        raise
    except Exception as error:  # whatever zipfile and numpy find wrong
        raise InputError(f"{name}: is no npz file of numbers: {error}") from None


def _parquet(content: bytes, name: str) -> Columns:
    try:
        import pyarrow.parquet as parquet
    except ImportError:
        raise InputError(f"{name}: Parquet needs pyarrow", hint="pip install 'tcrctl[parquet]'") from None
    try:
        opened: Any = parquet.ParquetFile
        file = opened(io.BytesIO(content))
        _check_count(file.metadata.num_rows * file.metadata.num_columns, name)
        table = file.read()
        arrays = {column: table.column(column).to_numpy() for column in table.column_names}
    except InputError:
        raise
    except Exception as error:  # whatever pyarrow finds wrong
        raise InputError(f"{name}: is no Parquet file: {error}") from None
    return Columns(name, _vectors(arrays, name))


def _check_count(numbers: int, name: str) -> None:
    """Raise if a file says that it expands to more than may be; a few bytes can stand for gigabytes."""
    if numbers > MAX_NUMBERS + 1000:  # an archive has headers
        raise InputError(f"{name}: expands to more than {MAX_NUMBERS} numbers")


def _vectors(arrays: dict[str, Array], name: str) -> dict[str, Array]:
    """Return arrays as columns of numbers (n,) of one length."""
    found: dict[str, Array] = {}
    for key, array in arrays.items():
        if array.dtype.kind not in "fiu":
            raise InputError(f"{name}: {key} holds {array.dtype}, not numbers")
        if array.ndim != 1:
            raise InputError(f"{name}: {key} has shape {array.shape}; it must be one column, (n,)")
        found[key] = array.astype(float)
    sizes = {array.size for array in found.values()}
    if len(sizes) > 1 or sum(sizes) * len(found) > MAX_NUMBERS:
        raise InputError(f"{name}: its columns must have one length, of at most {MAX_NUMBERS} numbers in all")
    return found
